/* SPDX-License-Identifier: MIT */
/* The means of drawing stained glass, between the patterns and the rasteriser of demo_glass.c. */
#ifndef VITRAIL_GLB_DEMO_GLASS_H
#define VITRAIL_GLB_DEMO_GLASS_H

#include "glb/demo_internal.h"

enum glass_color {
    GLASS_RUBY,
    GLASS_COBALT,
    GLASS_EMERALD,
    GLASS_GOLD,
    GLASS_VIOLET,
    GLASS_AZURE,
    GLASS_ORANGE,
    GLASS_PEARL,
    GLASS_ROSE,
    GLASS_TEAL,
    GLASS_COUNT
};
extern const double glass_colors[GLASS_COUNT][3]; /* linear transmittance */

/* One point of the window while it is drawn. */
struct glass_texel {
    double x, y;            /* m; x = 0 in the middle, y upward */
    double came_half_width; /* m; patterns may change it between pieces */
    double came_distance;   /* m, to the nearest came; negative on it */
    enum glass_color color;
    int cell; /* tells pieces of one colour apart */
};

/* Covers the inside of a shape with glass, its edge with a came. distance: negative inside. */
void glass_piece(struct glass_texel *texel, double distance, enum glass_color color, int cell);
/* A came where distance is 0. */
void glass_line(struct glass_texel *texel, double distance);

struct glass_pattern {
    const char *name;
    double width_m, height_m, top_m; /* the bounds of the window in the coordinates of the texel */
    double came_half_width_m;
    void (*draw)(struct glass_texel *texel);
};
const struct glass_pattern *glass_pattern(enum demo_window window);

/* The patterns. */
void glass_draw_rose(struct glass_texel *texel);       /* demo_rose.c */
void glass_draw_medallions(struct glass_texel *texel); /* demo_lancets.c */
void glass_draw_scales(struct glass_texel *texel);
void glass_draw_lily(struct glass_texel *texel);

#endif
