/* SPDX-License-Identifier: MIT */
/* Light lists by tile and depth slice (Olsson, Billeter and Assarsson 2012, "Clustered deferred and
 * forward shading"), filled on the CPU: contiguous, in ascending light index, never missing a
 * light. Thread: any. */
#ifndef VITRAIL_RENDERER_LIGHTS_CLUSTERS_H
#define VITRAIL_RENDERER_LIGHTS_CLUSTERS_H

#include "renderer/lights/tile_grid.h"

enum {
    CLUSTER_TILE_PX = 32, /* measured: smaller tiles cost more to build than they save */
    CLUSTER_SLICES = 24,
    /* 128 MiB: the storage block and buffer texture every GL 4.5 device reads. */
    CLUSTER_ENTRIES_MAX = 32 << 20,
};

struct cluster_run { /* one light in neighbouring slices of one tile */
    uint32_t light, cluster, count;
};

/* Zeroed = empty. Arrays are kept between builds; all but the outputs are working memory. */
struct clusters {
    /* outputs: what light_list.glsl reads */
    int columns, rows, slices, tile_px;
    /* slice = floor(f(view_z) * scale + offset), f = log2, or identity when linear. */
    float slice_scale, slice_offset;
    bool is_linear;  /* orthographic */
    uint32_t *heads; /* {offset, count} of items; cluster (row * columns + column) * slices + k */
    uint32_t *items; /* the global prefix, then the clusters' lists */
    size_t prefix_count, item_count;
    uint32_t longest; /* most lights any pixel walks, prefix included */

    struct light_bounds own_bounds;
    const struct light_bounds *bounds; /* of the build; own_bounds where the caller had none */
    struct tile_grid grid;
    struct cluster_run *runs;
    size_t run_count, run_capacity, head_capacity, item_capacity;
    uint64_t entry_count;
};

struct clusters_desc {
    const struct state_light *lights; /* required unless light_count is 0 */
    size_t light_count;
    const struct camera *camera;        /* required */
    const struct camera_window *window; /* required */
    const struct light_bounds *bounds;  /* of these lights for this camera; NULL: found here */
    uint64_t entries_max; /* 0 means CLUSTER_ENTRIES_MAX; ERROR_OVER_BUDGET above it */
};

/* Lights that reach nearly all clusters join the global prefix, where they are stored once. */
MUST_CHECK bool clusters_build(struct clusters *clusters, const struct clusters_desc *desc,
                               struct error *err);
void clusters_finish(struct clusters *clusters);

/* The cluster that the shader picks for a pixel (y up) and depth; for tests. */
size_t clusters_find(const struct clusters *clusters, int x, int y, float view_z);

#endif
