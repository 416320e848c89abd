/* SPDX-License-Identifier: MIT */
/* The shadow term of the ray tracer at points of the scene. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_RAYTRACE_PROBE_H
#define VITRAIL_TESTS_SUPPORT_RAYTRACE_PROBE_H

#include "renderer/raytrace/raytrace.h"

/* Transmittance per channel from each light to given points: the shadow term alone, in f64. Of an
 * area light the mean over its area, by view's quality.area_samples. out: [light][point][3]. */
struct raytrace_probe_desc {
    const struct view *view;         /* required */
    const struct scene_state *state; /* required */
    const double (*points)[3];       /* required */
    size_t point_count;
    bool follows_edges; /* of area lights: area_integral.h, to 1e-5 with 65,536 samples, instead of
                           the sequence that pictures take, which errs by N^(-3/4) */
    uint64_t *shadow_rays; /* optional out */
};
MUST_CHECK bool raytrace_probe(const struct raytrace_probe_desc *desc, double (*out)[3],
                               struct error *err);

#endif
