/* SPDX-License-Identifier: MIT */
/* Finds the finest level of each image that a view of drawables can sample. It is a conservative
 * bound: no finer level is sampled anywhere. CPU only. Thread: any, one object on one thread at a
 * time. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_NEED_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_NEED_H

#include "renderer/scene/scene_state.h"

enum { TEXTURE_UNNEEDED = 255 }; /* in an array of levels: nothing samples the image */

/* The images of a scene as GPUs hold them: 2 * image + scene_slot_is_srgb. */
static inline uint32_t texture_key(uint32_t image, bool is_srgb)
{
    return 2 * image + is_srgb;
}

/* How a camera or a light projects: through a pinhole, or by parallel rays. */
struct texture_lens {
    double eye[3];     /* world */
    double forward[3]; /* world, unit; all 0: depth is at least the distance times depth_share */
    double depth_share;
    double near_m; /* no depth is less */
    double slant;  /* distance over depth at the corner of the picture, at least 1 */
    double pixel;  /* perspective: side of a pixel at depth 1; parallel: in metres */
    bool is_parallel;
};

/* How many texels a primitive has per metre, computed when it is first requested. */
struct texture_density;
struct texture_density *texture_density_create(const struct scene *scene, struct error *err);
/* For a composed scene. All parts have to be set before use; their densities are borrowed. */
struct texture_density *texture_density_compose(const struct scene *scene, struct error *err);
void texture_density_set_part(struct texture_density *density, uint32_t part,
                              struct texture_density *of_part);
void texture_density_destroy(struct texture_density *density);

struct texture_need_desc {
    struct texture_density *density; /* required, of the state's scene */
    const struct scene_state *state; /* required */
    const uint32_t *items;           /* required: what is drawn */
    size_t item_count;
    uint32_t slots; /* bit set of 1u << enum scene_texture_slot: those that are sampled */
    const struct texture_lens *lens; /* required */
};
/* Lowers levels[texture_key] to the finest levels that these drawables can sample. GPUs choose a
 * level by the longest side of a pixel's footprint along u and v, or by more than that (OpenGL 4.5
 * core profile, 8.14). The bound takes the triangle with the fewest texels per metre, at the depth
 * of the drawable's nearest point. GPUs measure the footprint in texels of the finest level that is
 * present. Where the sides of that level were rounded down, their choice shifts; so the bound never
 * names a level whose sides are below 256 and no exact fractions of those of level 0. */
void texture_need_add(const struct texture_need_desc *desc, uint8_t *levels);

#endif
