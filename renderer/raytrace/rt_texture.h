/* SPDX-License-Identifier: MIT */
/* Samples images in f64: a footprint chooses the level of detail, and filters and wrap modes are
 * those of OpenGL (4.5 core profile, 8.14). The levels are in the scene's blob
 * (renderer/scene/texture_levels.h). Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_TEXTURE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_TEXTURE_H

#include "renderer/scene/scene.h"
#include "renderer/scene/texture_levels.h"

struct rt_image {
    const uint8_t *levels[2][TEXTURE_LEVELS_MAX]; /* RGBA8, borrowed; second: averaged as sRGB; NULL
                                                     where no material samples the image so */
    uint32_t width_px, height_px, level_count;
    uint8_t finest[2]; /* level that footprints choose; likewise */
};

/* Where the images of a scene lie; out: image_count of them. */
void rt_images_find(const struct scene *scene, struct rt_image *images);

/* levels: per texture_key the finest that footprints are to choose, where that is there; 255, or
 * NULL for all: level 0. */
void rt_images_withhold(struct rt_image *images, size_t count, const uint8_t *levels);

/* From bytes to numbers. */
struct rt_texel_tables {
    double linear_from_srgb[256], linear_from_unorm[256];
};
void rt_texel_tables_fill(struct rt_texel_tables *tables);

/* The texels of one level around a place, and their weights. */
struct rt_texel_square {
    const uint8_t *texels[4]; /* RGBA */
    double weights[4];
    int count;     /* 1 or 4 */
    size_t x, y;   /* of the first */
    bool is_whole; /* the others are its neighbours to the right and below */
};

struct rt_texture_lookup {
    const struct rt_image *image;        /* required */
    const struct scene_texture *texture; /* required: filters and wraps */
    bool is_srgb;                        /* RGB is; alpha is linear always */
    double at[2];                        /* texture coordinates, 1 is the image's side */
    bool is_finest;                      /* of level 0, by the filter of magnified textures */
    double per_pixel[2][2]; /* else: how far `at` goes in a pixel to the right, and in one down */
};

/* At level 0, by the filter of magnified textures. */
void rt_texture_find_finest(const struct rt_texture_lookup *lookup, struct rt_texel_square *square);

/* What one sample sums: a level, or two neighbours. */
struct rt_texel_sum {
    struct rt_texel_square squares[2];
    double weights[2]; /* the second one's is 0 where only the first is set */
    bool is_srgb;
};

/* Finds the texels and has them brought into the cache: ask for several textures before the first
 * is summed. */
void rt_texture_find(const struct rt_texture_lookup *lookup, struct rt_texel_sum *sum);

/* Linear RGB and alpha. */
void rt_texture_add_up(const struct rt_texel_sum *sum, const struct rt_texel_tables *tables,
                       double out[4]);

/* Whether samplers of the texture choose among levels of detail. */
bool rt_texture_has_levels(const struct scene_texture *texture);

#endif
