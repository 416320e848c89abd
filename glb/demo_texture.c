/* SPDX-License-Identifier: MIT */
/* Stone for the demo scene: a tiled floor and coursed masonry, from smooth deterministic noise. */
#include <math.h>
#include <stdlib.h>

#include "glb/demo_internal.h"
#include "glb/demo_noise.h"

int demo_add_picture(struct demo *demo, const char *name, const uint8_t *rgba, int width_px,
                     int height_px, enum glb_wrap wrap)
{
    int image = glb_builder_add_image(demo->builder, name, rgba, width_px, height_px);
    return glb_builder_add_texture(
        demo->builder,
        &(struct glb_texture_desc){.name = name, .image = image, .wrap_s = wrap, .wrap_t = wrap});
}

/* Draws one texel at (u, v) in [0,1)^2 as linear RGB. */
typedef void draw_texel(double u, double v, double color[3]);

static int add_drawn(struct demo *demo, const char *name, int side_px, draw_texel *draw)
{
    uint8_t *rgba = malloc((size_t)side_px * (size_t)side_px * 4);
    if (!rgba) {
        struct error cause = {0};
        error_set(&cause, ERROR_NO_MEMORY, "texture '%s'", name);
        return glb_builder_fail(demo->builder, &cause);
    }
    for (int y = 0; y < side_px; y++)
        for (int x = 0; x < side_px; x++) {
            double color[3];
            draw((x + 0.5) / side_px, (y + 0.5) / side_px, color);
            uint8_t *texel = rgba + 4 * ((size_t)y * (size_t)side_px + (size_t)x);
            for (int i = 0; i < 3; i++)
                texel[i] = demo_srgb8(color[i]);
            texel[3] = 255;
        }
    int texture = demo_add_picture(demo, name, rgba, side_px, side_px, GLB_WRAP_REPEAT);
    free(rgba);
    return texture;
}

enum { FLOOR_TILES = 6, STONE_COURSES = 5, STONE_BLOCKS = 3 };

/* Square tiles, two warm greys in turn, with dark joints. */
static void draw_floor(double u, double v, double color[3])
{
    static const double light[3] = {0.56, 0.51, 0.44}, dark[3] = {0.40, 0.37, 0.335};
    double s = u * FLOOR_TILES, t = v * FLOOR_TILES;
    int i = (int)s, j = (int)t;
    double edge = fmin(fmin(s - i, i + 1 - s), fmin(t - j, j + 1 - t));
    double joint = 1 - demo_smooth_step(0.012, 0.026, edge);
    double tone = 0.90 + 0.2 * demo_hash(i, j, 7);
    double veins = 0.94 + 0.12 * demo_noise(u * 24, v * 24, 24, 3);
    const double *base = (i + j) % 2 ? light : dark;
    for (int k = 0; k < 3; k++)
        color[k] = base[k] * tone * veins * (1 - 0.7 * joint);
}

/* Courses of cut stone, every other one shifted by half a block. */
static void draw_stone(double u, double v, double color[3])
{
    static const double base[3] = {0.54, 0.50, 0.43};
    double t = v * STONE_COURSES;
    int j = (int)t;
    double s = u * STONE_BLOCKS + (j % 2 ? 0.5 : 0);
    int i = (int)s;
    double edge_s = fmin(s - i, i + 1 - s) * STONE_COURSES / STONE_BLOCKS;
    double edge = fmin(edge_s, fmin(t - j, j + 1 - t));
    double joint = 1 - demo_smooth_step(0.015, 0.04, edge);
    double tone = 0.88 + 0.24 * demo_hash(i % STONE_BLOCKS, j, 11);
    double grain = 0.93 + 0.14 * demo_noise(u * 32, v * 32, 32, 5);
    for (int k = 0; k < 3; k++)
        color[k] = base[k] * tone * grain * (1 - 0.35 * joint);
}

int demo_add_floor_texture(struct demo *demo)
{
    return add_drawn(demo, "Tiles", demo->texture_size_px / 2, draw_floor);
}

int demo_add_stone_texture(struct demo *demo)
{
    return add_drawn(demo, "Masonry", demo->texture_size_px / 2, draw_stone);
}
