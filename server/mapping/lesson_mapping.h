/* SPDX-License-Identifier: MIT */
/* What a frame teaches <-> JSON, with the same bits of numbers. Thread: any.
 *
 * On the way from one worker to the one that keeps what is learned for `auto`:
 * {"timed", "ms", "cases": [[technique, 1 where it is left out, view, term ...], ...]}, of which
 * the first is the frame and the others those that were compared.
 *
 * On the way from one worker to all others, for max_error and budget_ms:
 * {"case": [...], "ms", "bytes", "compiled"}. */
#ifndef VITRAIL_SERVER_MAPPING_LESSON_MAPPING_H
#define VITRAIL_SERVER_MAPPING_LESSON_MAPPING_H

#include <jansson.h>

#include "protocol/error.h"
#include "renderer/frame/frame_lesson.h"

/* A frame that was promised for a time. */
struct time_lesson {
    struct learning_case frame; /* its setting and scene, and the time before what frames taught */
    double took_ms;
    double fresh_bytes; /* that its worker had not had before */
    bool has_compiled;  /* some of the time went into programs */
};

/* NULL: no memory. */
MUST_CHECK json_t *lesson_to_json(const struct frame_lesson *lesson);
MUST_CHECK json_t *time_lesson_to_json(const struct time_lesson *lesson);
/* False: it is no lesson. */
MUST_CHECK bool lesson_from_json(const json_t *json, struct frame_lesson *lesson);
MUST_CHECK bool time_lesson_from_json(const json_t *json, struct time_lesson *lesson);

#endif
