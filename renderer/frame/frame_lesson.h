/* SPDX-License-Identifier: MIT */
/* What one frame teaches `shadows: auto`, as plain values: so that a renderer which keeps what is
 * learned also learns from the frames of others on devices of the same kind. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_LESSON_H
#define VITRAIL_RENDERER_FRAME_FRAME_LESSON_H

#include "renderer/cost/learning.h"

struct renderer;

struct frame_lesson {
    bool is_timed;   /* drawn to be timed, for nobody to see */
    double alone_ms; /* what it took, alone on the machine */
    struct learning_case frame;
    struct learning_case frames[SHADOWS_COUNT]; /* by technique: what was compared for the choice;
                                                   nothing where one is no candidate */
};

/* The oldest that a renderer which learns nothing of its own has kept, of the last 16. False: it
 * has none. */
bool renderer_take_lesson(struct renderer *renderer, struct frame_lesson *lesson);

/* As if the frame had been drawn here; what is then due to be published is. Between frames. */
void renderer_learn(struct renderer *renderer, const struct frame_lesson *lesson);

#endif
