/* SPDX-License-Identifier: MIT */
/* The speed of the worker's device, measured once and kept in a file (server/worker/speed_file.h).
 * Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_DEVICE_SPEED_H
#define VITRAIL_SERVER_WORKER_DEVICE_SPEED_H

#include "protocol/capabilities.h"
#include "renderer/frame/calibrate.h"
#include "renderer/frame/texture_speed.h"

struct device_speed_desc {
    struct renderer *renderer; /* required */
    const char *path;          /* of the file; its folder is made; "" keeps nothing */
};

/* Reads it: false where it has to be measured. */
MUST_CHECK bool device_speed_recall(struct device_speed *speed,
                                    const struct device_speed_desc *desc,
                                    char note[CAPABILITIES_TEXT_BYTES]);

/* Measures and writes it. A failure to write is reported in `note` alone. */
MUST_CHECK bool device_speed_measure(struct device_speed *speed,
                                     const struct device_speed_desc *desc,
                                     char note[CAPABILITIES_TEXT_BYTES], struct error *err);

/* Of textures: reads it, or measures and writes it; zeroed where none that are compressed are
 * sampled. */
MUST_CHECK bool texture_speed_find(struct texture_speed *speed,
                                   const struct device_speed_desc *desc,
                                   char note[CAPABILITIES_TEXT_BYTES], struct error *err);

/* The file, for tests: false where it cannot be read or is of another device. */
MUST_CHECK bool device_speed_load(struct device_speed *speed, const char *path, const char *key);
MUST_CHECK bool device_speed_save(const struct device_speed *speed, const char *path,
                                  const char *key, struct error *err);

#endif
