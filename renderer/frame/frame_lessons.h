/* SPDX-License-Identifier: MIT */
/* What `shadows: auto` learns from frames: each one whose technique it chose teaches, and what is
 * learned is published where it changes something, since pixels follow it. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_LESSONS_H
#define VITRAIL_RENDERER_FRAME_FRAME_LESSONS_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame_report.h"

struct frame_lessons;

struct frame_lessons *frame_lessons_create(void); /* NULL: no memory */
void frame_lessons_destroy(struct frame_lessons *lessons);

/* What choices go by. It changes in frame_lessons_publish and frame_lessons_set alone. */
const struct learning *frame_lessons_published(const struct frame_lessons *lessons);
/* With what is not published yet. */
const struct learning *frame_lessons_live(const struct frame_lessons *lessons);
/* Of all that it holds: equal, and choices are; 0: nothing was learned yet. */
uint64_t frame_lessons_print(const struct frame_lessons *lessons);
/* Publishes what is due. Between frames. */
void frame_lessons_publish(struct frame_lessons *lessons);
/* learned: NULL forgets all. */
void frame_lessons_set(struct frame_lessons *lessons, const struct learning *learned);

/* A frame that may teach. Zeroed = it does not. */
struct frame_lesson {
    bool is_open;  /* the technique was chosen by a forecast, */
    bool is_timed; /* or drawn to be timed, for nobody to see */
    enum forecast_technique technique;
    struct learning_case cold[FORECAST_TECHNIQUES], frames[FORECAST_TECHNIQUES];
    double processor_begin_ms; /* of the process */
};
struct frame_lesson frame_lesson_begin(void);
void frame_lesson_of_choice(struct frame_lesson *lesson, const struct auto_choice *choice);

/* The frame is done. Such teach nothing: those that compiled, loaded textures, were paused or cut,
 * or kept surfaces of another one. is_software: the device's work is the processor's. */
void frame_lessons_take(struct frame_lessons *lessons, const struct frame_lesson *lesson,
                        const struct frame_report *report, bool is_software);

#endif
