/* SPDX-License-Identifier: MIT */
/* Shadows of area, point and parallel lights at given points, on the device: a grid brings points
 * and the triangles that may block them together, and each point rasterises the triangles of its
 * cell onto the light's samples (Wang, Zhou, Ke and Popescu 2014, "GEARS: A General and Efficient
 * Algorithm for Rendering Shadows"; docs/explanation/area-shadows.md). Thread: GL, but for
 * area_grid_list_programs. */
#ifndef VITRAIL_RENDERER_SHADOWS_AREA_GRID_H
#define VITRAIL_RENDERER_SHADOWS_AREA_GRID_H

#include "renderer/gl/program_list.h"
#include "renderer/lights/light_lists.h"
#include "renderer/shadows/area_casters.h"

/* Triangles in cells that one pass places at most: 256 MiB. */
enum { AREA_PAIRS_MAX = 64 << 20 };

struct area_counts {  /* of what was done since they were zeroed */
    uint64_t pairs;   /* triangles in cells */
    uint64_t longest; /* most in one cell */
    uint64_t parts;   /* of grids whose pairs had room */
};

struct area_grid { /* zeroed before the first call; buffers are kept */
    struct gl_buffer cells, counts, firsts, starts, places, pairs, statistics, light_filters;
    uint64_t pairs_max; /* 0: AREA_PAIRS_MAX */
    struct area_counts counts_of_frame;
    struct gl_buffer masks[2]; /* tables of a rectangle and of a disk (area_table.h) */
    uint32_t masks_samples[2]; /* that they have; 0: none */
};

struct area_points {                  /* of a window, on the device */
    const struct gl_buffer *points;   /* required: struct shadow_point[] */
    uint32_t count, layer_count;      /* of layers: the first of them */
    uint32_t width;                   /* of the window [px] */
    uint32_t image_x, image_y_bottom; /* its first column and row, counted from the top */
};

struct area_grid_desc {
    struct program_cache *programs;     /* required */
    const struct gl_limits *limits;     /* required */
    const struct area_casters *casters; /* required, prepared */
    const struct scene_state *state;    /* required */
    const struct camera *camera;        /* required */
    int image_height_px;                /* required */
    double farthest_m;                  /* from the eye: no surface is farther */
    struct area_points points;
    /* Clustered, and a part of each list, as light_list_chunk has it. NULL: all points have every
     * light that is asked for, at the filters that their table says. */
    const struct light_lists *lists;
    uint32_t first, count;
    const struct gl_buffer *table;   /* required: uvec2 per point: first filter, cluster */
    const struct gl_buffer *filters; /* required for area_grid_find: uvec2 each */
    uint32_t loop_steps;             /* that an invocation may take; 0: any */
    /* As published: the points of areas are the same at every pixel, and where all casters are
     * opaque, whole, and the points are few enough, tables have the masks of edges. */
    bool is_faithful;
};

struct area_light {
    uint32_t index, samples;
    uint32_t kind;               /* AREA_RECTANGLE, AREA_POINT, AREA_PARALLEL */
    double center[3];            /* relative to the casters' origin */
    double axes[3][3];           /* unit: two across the light, one along it */
    double half[2];              /* of the area along the first two axes [m] */
    double half_u[3], half_v[3]; /* of struct state_light */
    bool is_disk, is_one_sided;
    double behind_m; /* the projection's centre is so far behind it */
};
struct area_light area_light_of(const struct state_light *light, uint32_t index, uint32_t samples,
                                const struct area_casters *casters);

/* Finds where the rays of all points begin, and places their filters: light_filters says how many
 * each light of the state has, 0 for one without a shadow. filter_count: out. */
MUST_CHECK bool area_grid_begin(struct area_grid *grid, const struct area_grid_desc *desc,
                                const uint32_t *light_filters, uint64_t *filter_count,
                                struct error *err);
/* Fills the filters of one light at all points. ERROR_OVER_BUDGET where one cell has more triangles
 * than a pass can place, or than the loops of the device can walk. */
MUST_CHECK bool area_grid_find(struct area_grid *grid, const struct area_grid_desc *desc,
                               const struct area_light *light, struct error *err);

uint64_t area_grid_size_bytes(const struct area_grid *grid);
void area_grid_finish(struct area_grid *grid);

struct area_listing {
    bool is_orthographic, has_filters, has_curves;
    bool has_planes;  /* of the state: shadow_plane_count */
    bool is_software; /* of struct gl_limits */
    bool is_faithful; /* of struct area_grid_desc */
    bool has_kind[3]; /* lights of AREA_* */
    uint32_t samples; /* of areas */
};
/* The programs of frames with such lights and casters. Thread: any. */
void area_grid_list_programs(const struct area_listing *listing, const char *pass,
                             struct program_list *list);

#endif
