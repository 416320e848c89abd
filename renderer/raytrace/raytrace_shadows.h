/* SPDX-License-Identifier: MIT */
/* Traced shadows for a rasterised picture: finds the transmittance between given points and each
 * light, or the environment map, with the scene, filters, media and tolerances of raytrace.h.
 * Thread: one per object; uses its own threads and no GL. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RAYTRACE_SHADOWS_H
#define VITRAIL_RENDERER_RAYTRACE_RAYTRACE_SHADOWS_H

#include "renderer/lights/clusters.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/scene/atmosphere_grid.h"

struct shadow_point; /* shaders/shared/records.h */

/* The scene and the lights of one frame. Borrows what the desc points to until it is destroyed. */
struct raytrace_shadows;

/* desc: view, state, camera, and the environment for raytrace_shadows_see; cache, threads, advance
 * and yield as of raytrace_render. is_shadowed: per light, copied; the others get no rays, and no
 * filters. stats: build_ms, is_scene_reused and scene_bytes. */
struct raytrace_shadows *raytrace_shadows_create(const struct raytrace_desc *desc,
                                                 const bool *is_shadowed,
                                                 struct raytrace_stats *stats, struct error *err);
void raytrace_shadows_destroy(struct raytrace_shadows *shadows); /* accepts NULL */

/* How far from the eye a surface of the frame may be [m]. */
double rt_points_farthest(const struct raytrace_desc *desc);

/* Points of one window, by pixel (rows from the bottom). All required but layer_ends. */
struct raytrace_shadow_points {
    const struct shadow_point *points; /* first those of layers, then those of opaque surfaces */
    size_t count;                      /* of both */
    size_t layer_count;
    const uint32_t *layer_ends; /* per pixel: its layers end there; NULL where there are none */
    const uint32_t *heads;      /* per pixel: first opaque surface << 3 | their number */
    int width, height;
    int image_x, image_y_bottom; /* pixel (0, 0) in the image, whose rows count from the top */
};

/* Some lights of every point's list: the global prefix of the clusters, then its cluster's. */
struct raytrace_shadow_chunk {
    const struct clusters *clusters; /* required; of the points' window */
    uint32_t first, count;           /* entries of each list */
    /* out: per point its first filter and its cluster. Each light of the chunk that is shadowed
     * has one filter, in the order of the list. Points without light keep theirs unset. */
    uint32_t (*table)[2];
    uint32_t (*filters)[2]; /* out: shared/records.h says how they are packed */
    size_t capacity;        /* of filters; see raytrace_shadows_room */
    size_t filter_count;    /* out */
};

/* After others used the cache: takes its scene back to the description's state and view. */
void raytrace_shadows_resume(struct raytrace_shadows *shadows);

/* Filters of the light at a point. */
uint32_t raytrace_shadows_filters(const struct raytrace_shadows *shadows, uint32_t light);
/* The most that so many lights have. */
uint64_t raytrace_shadows_most_filters(const struct raytrace_shadows *shadows,
                                       uint32_t light_count);

/* Lights of a list, counted from its first, whose filters for all points have room in a chunk; 0 if
 * not even one of each. */
uint32_t raytrace_shadows_room(const struct raytrace_shadows *shadows,
                               const struct raytrace_shadow_points *points,
                               const struct clusters *clusters, size_t capacity);

/* Traces the chunk, and yields between tiles; adds to stats->trace_ms and shadow_rays. A cancelled
 * one is ERROR_TIMEOUT, one that a yield point ended has the error of that. */
MUST_CHECK bool raytrace_shadows_trace(struct raytrace_shadows *shadows,
                                       const struct raytrace_shadow_points *points,
                                       struct raytrace_shadow_chunk *chunk,
                                       struct raytrace_stats *stats, struct error *err);

/* What is left of the map's light at each point, over each lobe of its surface: filters holds
 * lobe_count of enum VISIBILITY_* for each point, packed as above; those of points without light
 * stay unset. quality.environment_samples directions are taken for each side. Yields, adds to stats
 * (see_ms), and fails as above. */
MUST_CHECK bool raytrace_shadows_see(struct raytrace_shadows *shadows,
                                     const struct raytrace_shadow_points *points,
                                     uint32_t lobe_count, uint32_t (*filters)[2],
                                     struct raytrace_stats *stats, struct error *err);

/* The light of haze in a window's columns of slices (renderer/scene/atmosphere_grid.h), with the
 * shadows of all lights, as renderer/raytrace/rt_haze_grid.h finds it. */
struct raytrace_shadow_haze {
    const struct atmosphere_grid *size; /* required */
    double offset;                      /* of points in their quarters, (0, 1): of a round */
    float *lights; /* out, the caller's to free: slice by slice, row by row from below, 3 channels
                    */
};
/* Yields, adds to stats (haze_ms, shadow_rays), and fails as above. */
MUST_CHECK bool raytrace_shadows_light_haze(struct raytrace_shadows *shadows,
                                            struct raytrace_shadow_haze *haze,
                                            struct raytrace_stats *stats, struct error *err);

#endif
