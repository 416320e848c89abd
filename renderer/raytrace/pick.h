/* SPDX-License-Identifier: MIT */
/* Finds what is at a point of an image, or in a rectangle of it, by rays on the CPU in f64. Plain
 * data. */
#ifndef VITRAIL_RENDERER_RAYTRACE_PICK_H
#define VITRAIL_RENDERER_RAYTRACE_PICK_H

#include "renderer/raytrace/raytrace.h"

struct pick_desc {
    /* A point: continuous, px from the upper left corner; a rectangle: its upper left pixel. */
    double x, y;
    int width, height; /* px of a rectangle; 0: a point */
    bool is_through;   /* what is behind transparent layers, too */
};

struct pick_node {
    uint32_t node;
    uint64_t pixels;
};

/* Zeroed = nothing there. */
struct pick_result {
    struct raytrace_layer *layers; /* of a point, nearest first; owned */
    size_t layer_count;
    struct pick_node *nodes; /* of a rectangle, by node; owned */
    size_t node_count;
};
void pick_result_finish(struct pick_result *result); /* accepts zeroed */

#endif
