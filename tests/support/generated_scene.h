/* SPDX-License-Identifier: MIT */
/* Scenes and views by a seed, unlike those that the models of renderer/forecast/forecast were
 * fitted to: what promises and choices are held against. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_GENERATED_SCENE_H
#define VITRAIL_TESTS_SUPPORT_GENERATED_SCENE_H

#include "protocol/error.h"
#include "renderer/view.h"

enum { GENERATED_LIGHTS_MAX = 250 };

enum generated_kind {
    GENERATED_BOXES,     /* many on a floor */
    GENERATED_SPHERES,   /* in a room, some of glass */
    GENERATED_PANES,     /* of coloured glass behind each other, over a floor */
    GENERATED_COLONNADE, /* finely divided columns in rows */
    GENERATED_KINDS
};

struct generated_scene {
    enum generated_kind kind;
    char name[64]; /* "boxes, 50 spots" */
    void *glb;     /* malloc'ed */
    size_t glb_bytes;
    struct view_light lights[GENERATED_LIGHTS_MAX];
    /* Color, of these lights, with a camera that LOOKS_AT; size and samples too. */
    struct view view;
};

/* The same scene for the same seed, from 1 on. Its view borrows its lights: not to be moved. */
MUST_CHECK bool generated_scene_make(struct generated_scene *scene, uint64_t seed,
                                     struct error *err);

/* The same with a density grid "Smoke" and often another, "More smoke", of balls with soft edges.
 */
MUST_CHECK bool generated_scene_make_smoky(struct generated_scene *scene, uint64_t seed,
                                           struct error *err);

/* 3000 boxes, 36,000 triangles, and a floor under so many shadowed spots. */
MUST_CHECK bool generated_scene_make_boxes(struct generated_scene *scene, size_t spots, int samples,
                                           struct error *err);
/* A colonnade of 249,000 triangles under 25 shadowed spots, with 4 samples. */
MUST_CHECK bool generated_scene_make_colonnade(struct generated_scene *scene, struct error *err);

void generated_scene_finish(struct generated_scene *scene);

#endif
