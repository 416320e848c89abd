/* SPDX-License-Identifier: MIT */
/* Peeling layers: three draws find and write the nearest layer of each pixel behind the last one
 * (and, from both sides, the farthest before the last one from behind), which is lit and composited
 * before the next is looked for. Memory goes by pixels, whatever lies behind one another. Layers
 * are those of `lists` in the same order, so that the pictures agree; of equal depths the ties of
 * the lists decide, and no coplanar layer is lost. How many there are is counted first, so that
 * peeling ends with the last one; every few sets it ends where no pixel lets anything through any
 * more. What is beyond the most layers is left out, and counted: the farthest, or, from both sides,
 * those in the middle. Thread: GL. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_PEELING_H
#define VITRAIL_RENDERER_TRANSPARENCY_PEELING_H

#include "renderer/transparency/pixel_lists.h"

enum { PEELING_DRAWS = 3 };

struct peeling {    /* constant */
    uint64_t sides; /* 1, or 2: the layers of a set, of each pixel */
    struct geometry_layer_pass draws[PEELING_DRAWS];
    const char *adding; /* the compute shader that composites a set */
};

extern const char peeling_pass[]; /* of the draws */
extern const struct transparency_pass peeling_passes[];
extern const struct surface_kind peeling_surfaces;

/* The functions of struct transparency_method that hang on the sides. */
void peeling_list_programs(const struct peeling *peeling, const struct window_frame *frame,
                           const struct geometry_items *items, struct program_list *list);
/* Its memory does not go by what is found, so that there is nothing to guess. */
enum layers_outcome peeling_find(const struct peeling *peeling, struct layers *layers,
                                 const struct window_frame *frame,
                                 const struct geometry_items *items, struct error *err);
MUST_CHECK bool peeling_light(const struct peeling *peeling, struct layers *layers,
                              const struct window_frame *frame, const struct geometry_items *items,
                              const struct surface_lighter *lighter, struct error *err);
int peeling_count_sets(const struct peeling *peeling, const struct layers *layers);

/* And those that do not. */
void peeling_bind(const struct layers *layers, const struct gl_program *program);
void peeling_report(const struct layers *layers, struct frame_report *report);
void peeling_clear(struct layers *layers);
void peeling_finish(struct layers *layers);
uint64_t peeling_size_bytes(const struct layers *layers);
#define PEELING_MEMBERS                                                                  \
    .passes = peeling_passes, .surfaces = &peeling_surfaces, .count = pixel_lists_count, \
    .bind = peeling_bind, .report = peeling_report, .clear = peeling_clear,              \
    .finish = peeling_finish, .size_bytes = peeling_size_bytes

#endif
