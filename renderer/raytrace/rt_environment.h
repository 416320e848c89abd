/* SPDX-License-Identifier: MIT */
/* Directions from a surface towards an environment: one half drawn by the map's light, the other
 * by the surface's lobes. Each counts by the sum of both densities, the balance heuristic of Veach
 * and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering" (section
 * 4.2). Light from behind a surface is one of these only where it is diffused
 * (KHR_materials_diffuse_transmission): glass shows what is behind it, the map as well where it is
 * the background. Thread: any. */
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

/* A viewer behind a bent normal is drawn from the horizon. */
void rt_ggx_lobe_init(struct rt_ggx_lobe *lobe, const double normal[3], const double view[3],
                      double alpha_square);
/* A visible normal, by two numbers in [0, 1) [unit, world]. */
void rt_ggx_lobe_normal(const struct rt_ggx_lobe *lobe, const double u[2], double normal[3]);

struct rt_environment_sampler {
    const struct environment_light *light;
    /* Light of the environment is reflected by: the surface's own, or where it diffuses light from
     * behind, that without what shows the background anyway. */
    const struct rt_reflector *reflector;
    struct rt_reflector own;
    bool has_behind; /* directions from behind count, too */
    struct rt_ggx_lobe base, coat;
    double share[4]; /* of the draws by lobes: cosine, base, coat, cosine behind; sum 1 */
    uint32_t count;  /* of both halves; that of the map has one more where it is odd */
    uint32_t seed;   /* turns the sequences */
};

/* Points to take: quality.environment_samples or its default; 0: there is no map, or it is dark. */
uint32_t rt_environment_count(const struct environment_light *light,
                              const struct view_quality *quality);

/* Borrows the light and the reflector; the sampler stays in its place. */
void rt_environment_begin(struct rt_environment_sampler *sampler,
                          const struct environment_light *light,
                          const struct rt_reflector *reflector, uint32_t count, uint32_t seed);

/* The index-th direction (unit, to the light), and what arrives from there for this sample of
 * `count`: radiance over densities [nt sr], so that the sum of f * cosine times it is what the
 * surface sends. False: nothing arrives, and nothing else is set. */
bool rt_environment_draw(const struct rt_environment_sampler *sampler, uint32_t index,
                         double direction[3], double arriving[3]);

/* What the base's lobe of GGX sends of a direction's light where it reflects all: f * cosine
 * [1/sr]. */
double rt_environment_mirrored(const struct rt_environment_sampler *sampler,
                               const double direction[3]);

#endif
