/* SPDX-License-Identifier: MIT */
/* What a frame teaches <-> JSON, on the way from one worker to the one that keeps what is learned:
 * {"timed", "ms", "cases": [[technique, 1 where it is left out, view, term ...], ...]}, of which
 * the first is the frame and the others those that were compared. Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_LESSON_MAPPING_H
#define VITRAIL_SERVER_MAPPING_LESSON_MAPPING_H

#include <jansson.h>

#include "protocol/error.h"
#include "renderer/frame/frame_lesson.h"

/* NULL: no memory. */
MUST_CHECK json_t *lesson_to_json(const struct frame_lesson *lesson);
/* With the same bits. False: it is no lesson. */
MUST_CHECK bool lesson_from_json(const json_t *json, struct frame_lesson *lesson);

#endif
