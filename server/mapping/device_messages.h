/* SPDX-License-Identifier: MIT */
/* Devices in the messages between worker and front: those that are tried, and those that are passed
 * over, with their reasons. Thread: any; nothing here touches GL. */
#ifndef VITRAIL_SERVER_MAPPING_DEVICE_MESSAGES_H
#define VITRAIL_SERVER_MAPPING_DEVICE_MESSAGES_H

#include <jansson.h>
#include <stdbool.h>

#include "renderer/base/device_choice.h"

/* What the worker says: {"op": "trying", "step", "device"}; and back: false where it names no step.
 * The device has no reason then. */
json_t *device_trials_message(const struct gl_device *device, enum gl_device_step step);
bool device_trials_read(const json_t *message, struct gl_device *device, enum gl_device_step *step);

/* Those with a reason, as the worker is sent them; and back. */
json_t *device_reasons_to_json(const struct gl_device_list *devices);
void device_reasons_from_json(const json_t *json, struct gl_device_list *devices);

/* One line on each, as gl_device_describe has it: of a worker that finds no device. */
json_t *device_lines_to_json(const struct gl_device_list *devices);
/* "EGL device 1: passed over: ...; EGL device 2: ...": to be freed; NULL where memory runs out. */
char *device_lines_join(const json_t *lines);

#endif
