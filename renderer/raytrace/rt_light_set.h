/* SPDX-License-Identifier: MIT */
/* The lights of a frame for production pictures. It tells which lights may reach a point of the
 * picture, and computes in f32 what arrives there. Thread: built by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_LIGHT_SET_H
#define VITRAIL_RENDERER_RAYTRACE_RT_LIGHT_SET_H

#include "renderer/lights/clusters.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_scene.h"

struct rt_light_record {
    float position[3], direction[3]; /* relative to rt_scene.origin; unit, of travel */
    float cone_scale, cone_offset;   /* of a spot: its cosine to [0, 1] */
    float least_cosine;              /* of a spot: nothing arrives beyond it, by its square */
    float inverse_range;             /* 0: unbounded */
    uint32_t samples;                /* 1, or points of an area light */
    enum scene_light_type type;
    bool is_area, casts_shadow;
    float color[3];
};

/* Lights side by side: most lights in the list of a surface do not reach it, and are culled
 * together. */
enum { RT_BLOCK_LIGHTS = 32 };
struct rt_light_block {
    size_t key; /* of the list and the part of it that is here; rt_light_set_block */
    size_t count;
    uint32_t lights[RT_BLOCK_LIGHTS];
    /* the light, or of directional ones the way to it, seen from: position - moves * point */
    float x[RT_BLOCK_LIGHTS], y[RT_BLOCK_LIGHTS], z[RT_BLOCK_LIGHTS], moves[RT_BLOCK_LIGHTS];
    float axis_x[RT_BLOCK_LIGHTS], axis_y[RT_BLOCK_LIGHTS], axis_z[RT_BLOCK_LIGHTS]; /* of travel */
    float inverse_square[RT_BLOCK_LIGHTS]; /* of the range; 0: it has none */
    float edge[RT_BLOCK_LIGHTS];   /* of the cone: its cosine's signed square, -FLT_MAX without */
    float behind[RT_BLOCK_LIGHTS]; /* likewise the least that a surface may look its way */
};

struct rt_light_set { /* zeroed before init */
    const struct scene_state *state;
    struct rt_light_record *records; /* by light */
    struct clusters clusters;
    double (*sigma)[3];          /* by light: rt_media_at; NULL without media */
    struct rt_light_block *all;  /* every light, in order; NULL where the clusters are asked */
    struct camera_window window; /* of the clusters */
};

MUST_CHECK bool rt_light_set_init(struct rt_light_set *light_set, const struct rt_scene *scene,
                                  const struct raytrace_desc *desc, struct error *err);
void rt_light_set_finish(struct rt_light_set *light_set); /* accepts zeroed */

/* Lights that may reach what the pixel (y down) shows at a depth: two runs of light numbers. */
struct rt_light_list {
    size_t cluster;
    const uint32_t *items[2];
    size_t counts[2];
    size_t count; /* of both; with `all` items are NULL */
};
static inline uint32_t rt_light_list_at(const struct rt_light_list *list, size_t i)
{
    return !list->items[0]       ? (uint32_t)i
           : i < list->counts[0] ? list->items[0][i]
                                 : list->items[1][i - list->counts[0]];
}
struct rt_light_list rt_light_set_near(const struct rt_light_set *light_set, int x, int y,
                                       double view_z);

/* Neighbouring surfaces ask the same lists. Zeroed before use; one thread's. */
enum { RT_BLOCKS_KEPT = 16 };
struct rt_light_blocks {
    struct rt_light_block kept[RT_BLOCKS_KEPT];
};

/* The lights of the list from `first`, a multiple of RT_BLOCK_LIGHTS, on. Valid until the next. */
const struct rt_light_block *rt_light_set_block(const struct rt_light_set *light_set,
                                                struct rt_light_blocks *blocks,
                                                const struct rt_light_list *list, size_t first);

/* Lights of the block that reach the point by range and cone, and from the side that the normal is
 * on; all of them, a few more by rounding, and whatever lights a short block has. normal: zero for
 * any side. lights: out, in order.
 * reaching: out, how many reach it from whichever side. Returns how many are in lights. */
size_t rt_light_block_look(const struct rt_light_block *block, const float point[3],
                           const float normal[3], uint32_t lights[RT_BLOCK_LIGHTS],
                           size_t *reaching);

/* Irradiance on a facing plane over the light's colour, before shadows; direction: unit, to the
 * light. Not of area lights. */
float rt_light_set_arrive(const struct rt_light_set *light_set, uint32_t light,
                          const float point[3], float direction[3], float *distance_m);

#endif
