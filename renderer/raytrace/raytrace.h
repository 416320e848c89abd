/* SPDX-License-Identifier: MIT */
/* Ground truth: an independent CPU renderer on Embree over the same scene state, materials and
 * lights (docs/shading.md). Camera rays go through all transparent layers, shadow rays multiply
 * every filter they meet, every light is asked at every surface. It shares no code with the
 * rasteriser beyond the evaluation of the view. Thread: any; uses its own threads and no GL. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RAYTRACE_H
#define VITRAIL_RENDERER_RAYTRACE_RAYTRACE_H

#include "renderer/image/image.h"
#include "renderer/plan/camera.h"
#include "renderer/scene/scene_state.h"

struct raytrace_desc {
    const struct view *view;         /* required; size, background, quality, clip planes */
    const struct scene_state *state; /* required */
    const struct camera *camera;     /* required */
    int samples_per_side;            /* of a pixel's regular grid; 0 means 1: the pixel's centre */
    int threads;                     /* 0 means one per core */
    /* Optional, called from any thread with the share done in [0, 1]; returning true cancels. */
    bool (*progress)(void *context, double share);
    void *context;
};

struct raytrace_stats {
    double build_ms, trace_ms;
    uint64_t camera_rays, shadow_rays;
};

/* Renders linear radiance with associated alpha, F32 RGBA, of view's size. A cancelled render is
 * ERROR_TIMEOUT. image is empty on failure. */
MUST_CHECK bool raytrace_render(const struct raytrace_desc *desc, struct image *image,
                                struct raytrace_stats *stats, struct error *err);

/* Transmittance per channel from each light to given points: the shadow term alone, in f64. Of an
 * area light the mean over its area, by view's quality.area_samples. out: [light][point][3]. */
struct raytrace_probe_desc {
    const struct view *view;         /* required */
    const struct scene_state *state; /* required */
    const double (*points)[3];       /* required */
    size_t point_count;
};
MUST_CHECK bool raytrace_probe(const struct raytrace_probe_desc *desc, double (*out)[3],
                               struct error *err);

#endif
