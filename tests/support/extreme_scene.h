/* SPDX-License-Identifier: MIT */
/* A small scene of panes, solids and a comb with teeth of a millimetre, under three kinds of light,
 * that can be placed anywhere, scaled, turned and recoloured: its picture must not tell. Thread:
 * the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_EXTREME_SCENE_H
#define VITRAIL_TESTS_SUPPORT_EXTREME_SCENE_H

#include "glb/glb_builder.h"
#include "tests/support/render_support.h"

enum { EXTREME_LIGHTS = 3 };

struct extreme_desc {
    double scale;    /* 0 means 1: a scene of 4 m */
    bool is_edited;  /* scaled, placed and turned by an edit of the view, not in the file */
    double place[3]; /* m, of its origin */
    double turn_deg;
    double turn_axis[3]; /* of any length; all 0: +Y */
    int channels;        /* colours are moved by so many channels, [0, 2] */
    bool has_detail;     /* the camera looks at the comb from 0.1 m */
    bool swaps_panes;    /* two panes of different colours change places */
    bool halves_pane;    /* one pane of colour T becomes two of sqrt(T) */
    bool has_up; /* the lights say how the texels of their maps lie: they turn with the scene */
    /* Adds to the scene under the node `root`; NULL = nothing. */
    void (*extend)(struct glb_builder *builder, int root, void *context);
    void *context;
};

struct extreme_scene {
    struct rig_scene rig;
    struct view view; /* 160 x 120 pixels, points to the lights below */
    struct view_light lights[EXTREME_LIGHTS];
    struct view_node_override root; /* where the view has an edit */
};

/* Fails the test when the scene is refused. */
void extreme_scene_open(struct extreme_scene *scene, struct renderer *renderer, const char *key,
                        const struct extreme_desc *desc);
void extreme_scene_finish(struct extreme_scene *scene, struct renderer *renderer);

/* A direction, from the scene's own coordinates to those of the world. */
void extreme_turn(const struct extreme_desc *desc, const double local[3], double world[3]);
/* From the scene's own coordinates to those of the world. */
void extreme_place(const struct extreme_desc *desc, const double local[3], double world[3]);

#endif
