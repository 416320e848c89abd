/* SPDX-License-Identifier: MIT */
/* The shader programs of a plan, listed without compiling or drawing. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_PROGRAMS_H
#define VITRAIL_RENDERER_FRAME_FRAME_PROGRAMS_H

#include "renderer/gl/program_list.h"
#include "renderer/plan/frame_plan.h"

struct frame_programs_desc { /* all required but the flags */
    const struct frame_plan *plan;
    const struct view *view;
    const struct scene_state *state;
    const struct camera *camera;
    const struct gl_limits *limits;
    const struct scene_gpu *gpu;
    uint64_t loop_steps;            /* of struct shade */
    uint64_t depths_bytes;          /* smoke_depths_most */
    struct shadow_ways shadow_ways; /* shadow_system_ways */
    bool is_in_batches;             /* light_batches_are_known */
};

/* Every program that a frame of the plan may need, under the pass that needs it; those that all
 * such frames need are not conditional: which lights make a batch, and whether the lights of a
 * point are too many for one dispatch, is known while drawing. Left out is what only a budget that
 * is exceeded on the way for the first time calls for: lists that are compressed then, lights in
 * batches where the plan knows of none; and of batches of lights of more than
 * SHADOW_FEATURE_SETS_MAX kinds some. Thread: GL. */
MUST_CHECK bool frame_programs_list(const struct frame_programs_desc *desc,
                                    struct program_list *list, struct error *err);

/* Every program that frames of such a view may need, from wherever they look: the plan is one that
 * sees_all. Of scenes whose lights differ in more than SHADOW_FEATURE_SETS_MAX ways some are
 * missing. Thread: GL. */
MUST_CHECK bool frame_programs_list_all(const struct frame_programs_desc *desc,
                                        struct program_list *list, struct error *err);

#endif
