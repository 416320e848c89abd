/* SPDX-License-Identifier: MIT */
/* Parallel panes before a wall of light of 1, seen from the front: what a method of transparency
 * makes of them has a closed form. Thread: the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_PANE_STACK_H
#define VITRAIL_TESTS_SUPPORT_PANE_STACK_H

#include "tests/support/render_support.h"

enum { PANE_STACK_EYE_Z = 10 };

/* Either of light of its own, over alpha of what is behind; or clear, with the color as its filter,
 * and without light. */
struct pane {
    double z; /* below PANE_STACK_EYE_Z, above -20 */
    double color[3], alpha;
    bool is_clear;
    double transmission; /* beside it: glass that bends what is behind */
};

struct pane_shot {
    enum transparency transparency;
    enum shadow_technique shadows;
    int side_px, samples;
    bool faithful, is_perspective;
    double haze;
    struct view_tile tile;
};

/* The panes fill the picture. The frame is the caller's to finish. */
void pane_stack_render(struct renderer *renderer, const struct pane *panes, int count,
                       const struct pane_shot *shot, struct frame *frame);

/* A channel of the picture, of panes from the nearest to the farthest. */
double pane_stack_exact(const struct pane *panes, int count, int channel);
/* What a pane lets through of a channel, and its light over black. */
double pane_filter(const struct pane *pane, int channel);
double pane_light(const struct pane *pane, int channel);

#endif
