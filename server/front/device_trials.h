/* SPDX-License-Identifier: MIT */
/* Devices whose drivers end the worker, or keep it for ever, before it serves. The worker tells
 * each step that it takes with a device before it takes it; the supervisor notes how the worker
 * ended meanwhile, and has the next one pass over what will not do. Not locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_DEVICE_TRIALS_H
#define VITRAIL_SERVER_FRONT_DEVICE_TRIALS_H

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

#include "renderer/base/device_choice.h"

enum {
    DEVICE_TRIAL_CRASHES = 2, /* in a row: one may be the fault of the machine's memory */
    DEVICE_TRIAL_MS = 90000, /* of one step: 60 times what llvmpipe takes that has compiled nothing,
                                and less than what the command line waits for a private server */
};

/* Zeroed = none. */
struct device_trials {
    struct gl_device_list devices; /* that were tried; those with a reason are passed over */
    int crashes[GL_DEVICES_MAX];   /* in a row */
    int current;                   /* index + 1 of the one that is tried now; 0: none is */
    enum gl_device_step step;
};

/* Notes the trial that the worker announces (server/mapping/device_messages.h). */
void device_trials_begin(struct device_trials *trials, const json_t *message);
/* The trial is over: the worker serves, and earlier failures of its device are cleared; or the
 * worker said itself what fails. */
void device_trials_succeed(struct device_trials *trials);
void device_trials_abandon(struct device_trials *trials);

/* How the worker ended: "signal 11 (Segmentation fault)"; is_hang: it was late, and was killed. The
 * device that it tried, with a reason where it is passed over from now on, else to be tried once
 * more; NULL: it tried none. */
const struct gl_device *device_trials_end(struct device_trials *trials, const char *how,
                                          bool is_hang);

int device_trials_passed_over(const struct device_trials *trials); /* their number */

#endif
