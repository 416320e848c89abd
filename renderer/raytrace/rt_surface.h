/* SPDX-License-Identifier: MIT */
/* Materials at a ray's hit: textures, normals, and the filter that light crosses
 * (docs/explanation/shading.md).
 */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SURFACE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SURFACE_H

#include "renderer/raytrace/rt_footprint.h"
#include "renderer/raytrace/rt_math.h"

struct rt_surface {
    const struct scene_material *material;
    double normal[3]; /* shading, unit, on the viewer's side */
    double base[3], alpha;
    double metallic, roughness, occlusion;
    double emissive[3]; /* nt */
    double transmission, thickness_m, f0;
    double specular, specular_color[3];     /* where the material has SCENE_MATERIAL_SPECULAR */
    double coat, coat_roughness;            /* where it has a clearcoat */
    double coat_normal[3];                  /* unit, on the viewer's side */
    double sheen_color[3], sheen_roughness; /* where it has a sheen */
    double film, film_nm;                   /* weight, 0 without one; thickness */
    /* Share of light from behind that is diffused, and its colour. */
    double translucence, translucent[3];
    double grain, along[3]; /* strength of anisotropy, 0 without any; direction, of any length but
                               0, not always across the normal */
};

/* Base colour and alpha after texture and vertex colour, each in [0, 1]. footprint: chooses the
 * textures' levels of detail, here and below; NULL: the finest. */
void rt_surface_base(const struct rt_scene *scene, const struct rt_hit *hit,
                     const struct rt_footprint *footprint, double base[4]);

/* Of a masked surface: whether its alpha reaches the cutoff, in the finest level. */
bool rt_surface_is_solid(const struct rt_scene *scene, const struct rt_hit *hit);

/* Only what rt_surface_light_filter needs: material, base, alpha, transmission and thickness; of
 * the finest levels. */
void rt_surface_evaluate_filter(const struct rt_scene *scene, const struct rt_hit *hit,
                                struct rt_surface *surface);

/* One bit for each enum scene_texture_slot whose texture a mesh of this material and primitive
 * reads: one with an image, of a primitive with texture coordinates. */
uint32_t rt_surface_sampled_slots(const struct scene *scene, const struct scene_material *material,
                                  const struct scene_primitive *primitive);

/* Whether light loses the same at every place, from both sides and at any angle, to all crossings
 * of a mesh; then `filter` is rt_surface_light_filter's. mesh: bound to its material. */
bool rt_surface_plain_filter(const struct rt_mesh *mesh, enum view_blend_filter blend,
                             double filter[3]);

/* Whether a mesh is lit, and its light is that of a base seen and lit from one side: nothing over
 * the base, and nothing through it but coverage. mesh: bound to its material, here and below. */
bool rt_surface_is_bare(const struct rt_mesh *mesh);

/* Whether it is bare, and all that rt_surface_evaluate finds but the normal is the same at every
 * place: no textures, no vertex colours. */
bool rt_surface_is_plain(const struct rt_mesh *mesh);

void rt_surface_evaluate(const struct rt_scene *scene, const struct rt_hit *hit,
                         const struct rt_footprint *footprint, struct rt_surface *surface);

/* What a dielectric reflects at grazing angles beyond f0: the rest; a medium thinner than water
 * less, and ior 1 nothing at all. */
static inline double rt_surface_edge(const struct rt_surface *surface)
{
    return rt_min(50 * surface->f0, 1) - surface->f0;
}

/* f0 of the dielectric by channel and the weight of its reflection (KHR_materials_specular).
 * Returns the largest f0. */
double rt_surface_specular(const struct rt_surface *surface, double f0[3], double *weight);

/* Transmittance of one crossing by light (docs/explanation/shading.md, section 1). cosine: |n.l| */
void rt_surface_light_filter(const struct rt_surface *surface, double cosine, bool enters,
                             enum view_blend_filter blend, double filter[3]);
/* The same for the camera, section 2. view: unit, away from the surface. */
void rt_surface_view_filter(const struct rt_surface *surface, const double view[3], bool enters,
                            double filter[3]);

#endif
