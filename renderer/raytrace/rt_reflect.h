/* SPDX-License-Identifier: MIT */
/* The share of the arriving light that a surface sends to the viewer (docs/explanation/shading.md,
 * section 3). Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_REFLECT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_REFLECT_H

#include "renderer/raytrace/rt_lobes.h"
#include "renderer/raytrace/rt_surface.h"

/* The base under a thin film (KHR_materials_iridescence), whose terms are linear in nothing. */
struct rt_filmed {
    double weight, ior, thickness_nm; /* weight 0: there is none */
    double dielectric, interface;     /* share of the base; weight of its reflection */
    double f0[3], edge[3];            /* of the interface, and what it rises to */
    double base[3];
    double diffuse[3], through[3], diffused[3]; /* with what the interface reflects */
};

/* An anisotropic lobe (KHR_materials_anisotropy). */
struct rt_grain {
    bool is_there;
    double along[3], across[3];       /* unit, across the normal */
    double alpha_along, alpha_across; /* roughnesses, squared */
    double seen;                      /* the visibility function's root for view */
};

/* What all lights share at a surface seen from one side. The terms of f are linear in the specular
 * lobe and in w, the power of Schlick's approximation:
 * diffuse - w * diffuse_edge + lobe * (specular + w * specular_edge). */
struct rt_reflector {
    double normal[3], view[3];          /* unit */
    double n_dot_v;                     /* at least 1e-4 */
    double alpha_square;                /* of the roughness' square; anisotropic: of their mean */
    double seen;                        /* the visibility function's root for view */
    double diffuse[3], diffuse_edge[3]; /* 1/sr */
    double specular[3], specular_edge[3];
    double through[3], through_edge[3]; /* of the mirrored lobe: through - w * through_edge */
    double diffused[3];                 /* from behind: diffused - w * diffused_edge [1/sr] */
    double diffused_edge[3];
    bool transmits;        /* light that arrives from behind, too */
    struct rt_grain grain; /* of the lobe, where it has one */
    struct rt_filmed film; /* instead of these, where there is one */
    struct rt_lobes lobes; /* over all of these */
};

/* view: unit, away from the surface. */
void rt_reflector_init(struct rt_reflector *reflector, const struct rt_surface *surface,
                       const double view[3]);

/* f * cosine of appendix B.3, and the mirrored lobe of KHR_materials_transmission [1/sr]. l: unit,
 * to the light. False: nothing is sent, and out is not set. */
bool rt_reflect(const struct rt_reflector *reflector, const double l[3], double out[3]);

/* What the surface emits towards the viewer [nt]. */
void rt_reflector_emission(const struct rt_reflector *reflector, const struct rt_surface *surface,
                           double out[3]);

/* Adds what the hemisphere light of the state sends to the viewer [nt]. */
void rt_reflect_hemisphere(const struct scene_state *state, const struct rt_reflector *reflector,
                           const struct rt_surface *s, double out[3]);

#endif
