/* SPDX-License-Identifier: MIT */
/* Numbers that were measured of a device, kept in a small JSON file beside the compiled shaders:
 * another driver, processor or build measures anew, and so does a file that is damaged or gone.
 * Thread: any. */
#ifndef VITRAIL_SERVER_WORKER_SPEED_FILE_H
#define VITRAIL_SERVER_WORKER_SPEED_FILE_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"
#include "renderer/renderer.h"

enum { SPEED_KEY_BYTES = 1024 };

struct speed_member { /* a double */
    const char *name;
    size_t offset; /* in the struct of the numbers */
};
struct speed_members {
    const struct speed_member *members;
    int count;
};

/* All that may change the speed but what else runs on the machine. */
void speed_file_make_key(struct renderer *renderer, char key[SPEED_KEY_BYTES]);
/* False where it cannot be read, is of another key, or a number is not in (0, 1e9). */
MUST_CHECK bool speed_file_load(void *numbers, const struct speed_members *members,
                                const char *path, const char *key);
/* Makes the folder, too. */
MUST_CHECK bool speed_file_save(const void *numbers, const struct speed_members *members,
                                const char *path, const char *key, struct error *err);

#endif
