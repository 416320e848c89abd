/* SPDX-License-Identifier: MIT */
/* What `auto` has learned of a device, kept beside its speed (server/worker/speed_file.h) and
 * written whole or not at all. Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_OBSERVATIONS_FILE_H
#define VITRAIL_SERVER_MAPPING_OBSERVATIONS_FILE_H

#include <stdbool.h>

#include "protocol/error.h"
#include "renderer/cost/learning.h"

/* False where it cannot be read, is of another key (speed_file_make_key), or holds what no
 * observations make; `learned` is then what learning_init makes. */
MUST_CHECK bool observations_file_load(struct learning *learned, const char *path, const char *key);
MUST_CHECK bool observations_file_save(const struct learning *learned, const char *path,
                                       const char *key, struct error *err);

#endif
