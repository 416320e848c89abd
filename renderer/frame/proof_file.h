/* SPDX-License-Identifier: MIT */
/* A file that keeps the result of the self-test from one start to the next. A file that is damaged,
 * of another key, from the future or too old is ignored. No GL. Thread: any. */
#ifndef VITRAIL_RENDERER_FRAME_PROOF_FILE_H
#define VITRAIL_RENDERER_FRAME_PROOF_FILE_H

#include "protocol/error.h"
#include "renderer/base/content_key.h"
#include "renderer/gl/wide_floats.h"

/* A device ages, and what else its results depend on may change unseen: chosen so that a daemon
 * that is started at every request tests once a week. */
enum { PROOF_VALID_S = 7 * 24 * 3600 };

struct proof {
    uint32_t structures;                   /* trials of renderer/frame/scene_selftest.h */
    int64_t since_s;                       /* of the oldest of them, since 1970 */
    struct wide_floats_choice wide_floats; /* which they were drawn with */
};

/* False, and `proof` zeroed: there is none that holds. */
MUST_CHECK bool proof_file_load(const char *path, struct content_key key, int64_t now_s,
                                struct proof *proof);
/* Written whole or not at all; makes the folder, too. ERROR_IO says what is wrong. */
MUST_CHECK bool proof_file_save(const char *path, struct content_key key, const struct proof *proof,
                                struct error *err);

#endif
