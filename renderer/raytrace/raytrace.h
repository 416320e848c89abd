/* SPDX-License-Identifier: MIT */
/* An independent CPU renderer on Embree over the same scene state, materials and lights
 * (docs/explanation/shading.md). Camera rays go through all transparent layers, shadow rays
 * multiply every filter they meet. Two forms by view's quality.reference: the ground truth (f64,
 * every light asked at every surface, pixels on a regular grid), and production (packets of rays,
 * light clusters, surfaces shaded once per pixel, the standard multisample positions). Thread: any;
 * uses its own threads and no GL. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RAYTRACE_H
#define VITRAIL_RENDERER_RAYTRACE_RAYTRACE_H

#include "renderer/base/yield_point.h"
#include "renderer/environment/environment.h"
#include "renderer/image/image.h"
#include "renderer/scene/camera.h"
#include "renderer/scene/scene_state.h"

/* The last scene built. It borrows the state's scene: clear it before that goes. Thread: one. */
struct raytrace_cache;
struct raytrace_cache *raytrace_cache_create(struct error *err);
void raytrace_cache_destroy(struct raytrace_cache *cache);
void raytrace_cache_clear(struct raytrace_cache *cache);
/* From true to false others may use the cache while a picture that was made with it is paused. */
void raytrace_cache_lend(struct raytrace_cache *cache, bool is_lent);
uint64_t raytrace_cache_size_bytes(const struct raytrace_cache *cache);

struct raytrace_desc {
    const struct view *view;         /* required; size, background, quality, clip planes */
    const struct scene_state *state; /* required */
    const struct camera *camera;     /* required */
    const struct environment_light *environment; /* optional: the view's */
    /* Per pixel: a square, of a regular grid; 0 means 1: the pixel's centre. Production takes the
     * patterns of renderer/base/sample_pattern.h for 4 and 8. */
    int samples;
    struct raytrace_cache *cache; /* optional: keeps the built scene for the next render */
    /* Optional: per texture_key (renderer/textures/texture_need.h) the finest level that camera
     * rays of production sample; 255: any. Masks and filters of shadow rays are read at level 0. */
    const uint8_t *texture_levels;
    bool asks_all_lights; /* production without light clusters, to compare them with */
    int threads;          /* 0 means one per core */
    /* Optional, called from any thread with the share done in [0, 1]. */
    void (*advance)(void *context, double share);
    void *advance_context;
    /* Optional: asked between tiles, or rows; the cache is to be lent while it runs urgent frames.
     * Where it is_unwanted the render is cancelled. */
    const struct yield_point *yield;
};

struct raytrace_stats {
    double build_ms, trace_ms; /* without urgent frames */
    double haze_ms;            /* the light of haze, not in trace_ms */
    double see_ms;             /* of raytrace_shadows_see, likewise */
    bool is_scene_reused; /* taken from the cache: only the view, lights or materials changed */
    uint64_t scene_bytes; /* of Embree's structure and our copy of the vertices */
    uint64_t camera_rays, shadow_rays;
    /* of production: shaded surfaces, lights looked at for them, and of these those in reach */
    uint64_t surfaces, lights_listed, lights_reaching;
};

/* Renders linear radiance with associated alpha, F32 RGBA, of view's size. A cancelled render is
 * ERROR_TIMEOUT; one that a yield point ended has the error of that. image is empty on failure. */
MUST_CHECK bool raytrace_render(const struct raytrace_desc *desc, struct image *image,
                                struct raytrace_stats *stats, struct error *err);

/* Builds what such a render keeps in the cache, and traces nothing. stats: build_ms,
 * is_scene_reused, scene_bytes. */
MUST_CHECK bool raytrace_build(const struct raytrace_desc *desc, struct raytrace_stats *stats,
                               struct error *err);

/* A surface on a camera ray. */
struct raytrace_layer {
    uint32_t node, material;
    double position[3], normal[3]; /* world; normal: geometric, unit, on the camera's side */
    double depth;                  /* m, along the view direction */
    bool is_front, is_transparent;
};

/* What camera rays meet, exactly: the points and normals are computed in f64. view: size, camera
 * and clip planes. Uses desc's cache. `visit` gets the layers of each ray, nearest first, to the
 * first opaque one; `count` 0: nothing is there. */
struct raytrace_pick {
    double x, y;       /* continuous pixel coordinates of the first ray, y down */
    int width, height; /* rays at steps of one pixel; required */
    void *context;
    void (*visit)(void *context, const struct raytrace_layer *layers, size_t count);
};
MUST_CHECK bool raytrace_pick(const struct raytrace_desc *desc, const struct raytrace_pick *pick,
                              struct error *err);

/* The same for rays through given points of the picture, in pixel coordinates with y down. */
struct raytrace_look {
    const double (*pixels)[2]; /* required */
    size_t count;
    void *context;
    void (*visit)(void *context, size_t index, const struct raytrace_layer *layers, size_t count);
};
MUST_CHECK bool raytrace_look(const struct raytrace_desc *desc, const struct raytrace_look *look,
                              struct error *err);

#endif
