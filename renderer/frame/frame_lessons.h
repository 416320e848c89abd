/* SPDX-License-Identifier: MIT */
/* Collects what `shadows: auto` learns from the frames whose technique it chose. What is learned is
 * published only when it changes something, because pixels follow it. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_LESSONS_H
#define VITRAIL_RENDERER_FRAME_FRAME_LESSONS_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame_report.h"

struct frame_lessons;

struct frame_lessons *frame_lessons_create(void); /* NULL: no memory */
void frame_lessons_destroy(struct frame_lessons *lessons);

/* The published state, by which choices are made. Only frame_lessons_publish and frame_lessons_set
 * change it. */
const struct learning *frame_lessons_published(const struct frame_lessons *lessons);
/* The state with what is not published yet. */
const struct learning *frame_lessons_live(const struct frame_lessons *lessons);
/* A print of the published state. Equal prints make equal choices; 0: nothing was learned yet. */
uint64_t frame_lessons_print(const struct frame_lessons *lessons);
/* Publishes what was learned, if that is due. Between frames. */
void frame_lessons_publish(struct frame_lessons *lessons);
/* learned: NULL forgets all. */
void frame_lessons_set(struct frame_lessons *lessons, const struct learning *learned);

/* What may be learned from a frame. Zeroed = nothing. */
struct frame_lesson {
    bool is_open;  /* the technique was chosen by a forecast, */
    bool is_timed; /* or drawn to be timed, for nobody to see */
    enum shadow_technique technique;
    struct learning_case cold[SHADOWS_COUNT], frames[SHADOWS_COUNT];
    double processor_begin_ms; /* of the process */
};
struct frame_lesson frame_lesson_begin(void);
void frame_lesson_of_choice(struct frame_lesson *lesson, const struct auto_choice *choice);

/* Learns from a frame that is complete. Nothing is learned from frames that compiled, uploaded
 * textures, were paused or cut, or reused surfaces. is_software: the processor does the device's
 * work. */
void frame_lessons_take(struct frame_lessons *lessons, const struct frame_lesson *lesson,
                        const struct frame_report *report, bool is_software);

#endif
