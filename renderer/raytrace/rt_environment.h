/* SPDX-License-Identifier: MIT */
/* Directions from a surface towards an environment: one half drawn by the map's light, the other
 * by the surface's lobes. Each counts by the sum of both densities, the balance heuristic of Veach
 * and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering" (section
 * 4.2). Light that arrives from behind a surface is none of these: glass shows what is behind it,
 * the map as well where it is the background. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_ENVIRONMENT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_ENVIRONMENT_H

#include "renderer/environment/environment.h"
#include "renderer/raytrace/rt_reflect.h"

/* A lobe of GGX about a normal, whose visible normals are drawn: Heitz 2018, "Sampling the GGX
 * Distribution of Visible Normals". */
struct rt_ggx_lobe {
    double x[3], y[3], normal[3]; /* unit, across each other */
    double view[3];               /* along them; unit, z > 0 */
    double alpha;
};

struct rt_environment_sampler {
    const struct environment_light *light;
    const struct rt_reflector *reflector;
    struct rt_ggx_lobe base, coat;
    double share[3]; /* of the draws by lobes: cosine, base, coat; sum 1 */
    uint32_t count;  /* of both halves; that of the map has one more where it is odd */
    uint32_t seed;   /* turns the sequences */
};

/* Points to take: quality.environment_samples or its default; 0: there is no map, or it is dark. */
uint32_t rt_environment_count(const struct environment_light *light,
                              const struct view_quality *quality);

/* Borrows the light and the reflector. */
void rt_environment_begin(struct rt_environment_sampler *sampler,
                          const struct environment_light *light,
                          const struct rt_reflector *reflector, uint32_t count, uint32_t seed);

/* The index-th direction (unit, to the light), and what arrives from there for this sample of
 * `count`: radiance over densities [nt sr], so that the sum of f * cosine times it is what the
 * surface sends. False: nothing arrives, and nothing else is set. */
bool rt_environment_draw(const struct rt_environment_sampler *sampler, uint32_t index,
                         double direction[3], double arriving[3]);

/* The density with which a direction is drawn by the lobes alone [1/sr]. */
double rt_environment_lobe_density(const struct rt_environment_sampler *sampler,
                                   const double direction[3]);

#endif
