/* SPDX-License-Identifier: MIT */
/* The execution of a plan: its steps in their order, those of windows once for each. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_RUN_H
#define VITRAIL_RENDERER_FRAME_FRAME_RUN_H

#include "renderer/frame/renderer_internal.h"
#include "renderer/plan/frame_plan.h"

struct frame_run {
    struct frame_context *context;               /* required */
    struct resident_scene *scene;                /* required */
    const struct frame_plan *frame_plan;         /* required */
    struct content_key placement;                /* required: view_placement_key */
    const struct view *view;                     /* required; of the plan */
    const struct scene_state *state;             /* required; of the plan */
    const struct camera *camera;                 /* required; of the plan */
    const struct environment_light *environment; /* required; of the view */
    struct frame *frame;         /* required; outputs are created, the report is filled */
    struct time_slice_pace pace; /* of frames like it */
    bool may_keep;               /* the picture may be one that is kept, and kept itself */
    struct content_key picture;  /* with may_keep: what decides it */
    bool only_builds;            /* what frames keep for those after them, and no picture */
    bool is_again;               /* it goes on after a pause: the report has what it did before */
    uint64_t shadow_frame;       /* required: shadow_system_number_frame */
    struct frame_textures *textures;                 /* set by frame_run */
    const struct environment_maps *environment_maps; /* likewise; NULL: not drawn with any */
};

static inline bool frame_run_needs(const struct frame_run *run, enum plan_need need)
{
    return run->frame_plan->plan.requirements[need].is_met;
}

/* Runs what the plan lists and nothing else. */
MUST_CHECK bool frame_run(const struct frame_run *desc, struct error *err);

/* Whether the sizes of lists may be guessed, and are read back with the picture. */
bool frame_run_may_guess(const struct frame_run *run);

/* Whether GL draws anything in this frame. */
bool frame_run_is_rasterised(const struct frame_run *run);
/* The traced shadows of the frame; NULL where shadows are in structures. */
struct traced_shadows *frame_run_rays(const struct frame_run *run);
/* Whether rays start from the surfaces of its windows: to lights, or to the environment. */
bool frame_run_starts_rays(const struct frame_run *run);
/* The lights and their shadows, for the shaders. */
MUST_CHECK bool frame_run_upload_lights(const struct frame_run *run, struct error *err);

#endif
