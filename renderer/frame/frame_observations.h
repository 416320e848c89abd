/* SPDX-License-Identifier: MIT */
/* Collects what `shadows: auto` learns from the frames whose technique it chose. What is learned is
 * published only when it changes something, because pixels follow it. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_OBSERVATIONS_H
#define VITRAIL_RENDERER_FRAME_FRAME_OBSERVATIONS_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame/frame_lesson.h"
#include "renderer/frame_report.h"

struct frame_observations;

/* learns_nothing: what frames tell is kept for another (frame_observations_pop); only
 * frame_observations_set changes what is known. NULL: no memory. */
struct frame_observations *frame_observations_create(bool learns_nothing);
void frame_observations_destroy(struct frame_observations *observations);

/* The published state, by which choices are made. Only frame_observations_publish and
 * frame_observations_set change it. */
const struct learning *frame_observations_published(const struct frame_observations *observations);
/* The state with what is not published yet. */
const struct learning *frame_observations_live(const struct frame_observations *observations);
/* A print of the published state. Equal prints make equal choices; 0: nothing was learned yet. */
uint64_t frame_observations_print(const struct frame_observations *observations);
/* Publishes what was learned, if that is due. Between frames. */
void frame_observations_publish(struct frame_observations *observations);
/* learned: NULL forgets all. */
void frame_observations_set(struct frame_observations *observations,
                            const struct learning *learned);

/* What may be learned from a frame. Zeroed = nothing. */
struct frame_observation {
    bool is_open;  /* the technique was chosen by a forecast, */
    bool is_timed; /* or drawn to be timed, for nobody to see */
    enum shadow_technique technique;
    struct learning_case cold[SHADOWS_COUNT], frames[SHADOWS_COUNT];
    double processor_begin_ms; /* of the process */
};
struct frame_observation frame_observation_begin(void);
void frame_observation_of_choice(struct frame_observation *observation,
                                 const struct auto_choice *choice);

/* Learns from a frame that is complete. Nothing is learned from frames that compiled, uploaded
 * textures, were paused or cut, or reused surfaces. is_software: the processor does the device's
 * work. */
void frame_observations_take(struct frame_observations *observations,
                             const struct frame_observation *observation,
                             const struct frame_report *report, bool is_software);

/* The oldest lesson that was kept; false: none. */
bool frame_observations_pop(struct frame_observations *observations, struct frame_lesson *lesson);
/* Learns from a frame of another renderer. */
void frame_observations_learn(struct frame_observations *observations,
                              const struct frame_lesson *lesson);

#endif
