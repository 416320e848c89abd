/* SPDX-License-Identifier: MIT */
/* The lights of a frame as production asks for them: which ones may reach a point of the picture,
 * and in f32 what arrives. Thread: built by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_LAMPS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_LAMPS_H

#include "renderer/lights/clusters.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_scene.h"

struct rt_lamp {
    float position[3], direction[3]; /* relative to rt_scene.origin; unit, of travel */
    float cone_scale, cone_offset;   /* of a spot: its cosine to [0, 1] */
    float least_cosine;              /* of a spot: nothing arrives beyond it, by its square */
    float inverse_range;             /* 0: unbounded */
    uint32_t samples;                /* 1, or points of an area light */
    enum scene_light_type type;
    bool is_area;
};

struct rt_lamps { /* zeroed before init */
    const struct scene_state *state;
    struct rt_lamp *lamps; /* by light */
    struct clusters clusters;
    double (*sigma)[3]; /* by light: rt_media_at; NULL without media */
    uint32_t *all;      /* every light's number; NULL where the clusters are asked */
    int height_px;
};

MUST_CHECK bool rt_lamps_init(struct rt_lamps *lamps, const struct rt_scene *scene,
                              const struct raytrace_desc *desc, struct error *err);
void rt_lamps_finish(struct rt_lamps *lamps); /* accepts zeroed */

/* Lights that may reach what the pixel (y down) shows at a depth: two runs of light numbers. */
struct rt_lamp_list {
    const uint32_t *items[2];
    size_t counts[2];
};
struct rt_lamp_list rt_lamps_near(const struct rt_lamps *lamps, int x, int y, double view_z);

/* Irradiance on a facing plane over the light's colour, before shadows; direction: unit, to the
 * light. Not of area lights. */
float rt_lamp_arrive(const struct rt_lamps *lamps, uint32_t light, const float point[3],
                     float direction[3], float *distance_m);

#endif
