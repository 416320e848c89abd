/* SPDX-License-Identifier: MIT */
/* What lies over a surface's base: the fibres of KHR_materials_sheen (Estevez and Kulla 2017,
 * "Production Friendly Microfacet Sheen BRDF") and the coat of KHR_materials_clearcoat
 * (docs/explanation/shading.md, section 3). Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_LOBES_H
#define VITRAIL_RENDERER_RAYTRACE_RT_LOBES_H

#include <stdbool.h>

struct rt_surface;

/* Of one surface seen from one side. Cosines are in (0, 1]. */
struct rt_lobes {
    bool has_sheen, has_coat;
    double color[3], sheen[3]; /* of the fibres; of their lobe, where they would send too much */
    double sheen_alpha;        /* roughness squared */
    double sheen_sent;         /* of a uniform light from everywhere, by fibres of colour 1 */
    double coat, coat_alpha_square;
    double coat_normal[3], coat_n_dot_v;
    double below_sheen, below_coat; /* shares of the light of what lies below that come through */
};

/* view: unit, away from the surface. */
void rt_lobes_init(struct rt_lobes *lobes, const struct rt_surface *surface, const double view[3]);

/* Distribution times visibility of the fibres [1/sr]. */
double rt_sheen_lobe(double alpha, double n_dot_h, double n_dot_l, double n_dot_v);

/* The share of a uniform light from everywhere that fibres of colour 1 send to the viewer, from the
 * table that shaders have, too. roughness: [0, 1]. Outside of this module, a test integrates it
 * anew. */
double rt_sheen_albedo(double n_dot_v, double roughness);

/* The share of light from behind that fibres and coat let through towards the viewer. */
static inline double rt_lobes_passed(const struct rt_lobes *lobes)
{
    return lobes->below_sheen * lobes->below_coat;
}

#endif
