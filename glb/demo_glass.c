/* SPDX-License-Identifier: MIT */
/* Draws stained glass: every texel lies in a piece of coloured glass, or on the lead around it.
 *
 * A pattern is drawn as a stack of pieces, each covering what is below: a piece has a shape with a
 * signed distance (negative inside), a colour and a lead came along its edge. The distance to the
 * nearest came gives exact coverage over a texel, so the drawing is antialiased at any size. */
#include <math.h>
#include <stdlib.h>

#include "glb/demo_glass.h"
#include "glb/demo_noise.h"

static const double lead_color[3] = {0.012, 0.012, 0.014};

const double glass_colors[GLASS_COUNT][3] = {
    [GLASS_RUBY] = {0.80, 0.018, 0.022},  [GLASS_COBALT] = {0.018, 0.07, 0.80},
    [GLASS_EMERALD] = {0.02, 0.52, 0.09}, [GLASS_GOLD] = {1.0, 0.58, 0.045},
    [GLASS_VIOLET] = {0.38, 0.03, 0.62},  [GLASS_AZURE] = {0.06, 0.42, 0.90},
    [GLASS_ORANGE] = {0.98, 0.22, 0.02},  [GLASS_PEARL] = {0.95, 0.92, 0.82},
    [GLASS_ROSE] = {0.90, 0.16, 0.32},    [GLASS_TEAL] = {0.02, 0.45, 0.42},
};

void glass_piece(struct glass_texel *texel, double distance, enum glass_color color, int cell)
{
    double came = fabs(distance) - texel->came_half_width;
    if (distance < 0) {
        texel->color = color;
        texel->cell = cell;
        texel->came_distance = came;
    } else if (came < texel->came_distance) {
        texel->came_distance = came;
    }
}

void glass_line(struct glass_texel *texel, double distance)
{
    double came = fabs(distance) - texel->came_half_width;
    if (came < texel->came_distance)
        texel->came_distance = came;
}

/* Hand-blown glass: each piece has its own depth of colour and faint streaks. */
static double glass_tone(const struct glass_texel *texel)
{
    double streaks = demo_noise(3 + 5 * texel->x + 1.5 * texel->y, 40 + 26 * texel->y, 1 << 20, 17);
    return 0.80 + 0.24 * demo_hash(texel->cell, (int)texel->color, 23) - 0.10 * streaks;
}

struct glass_picture {
    int width_px, height_px;
    uint8_t *glass, *clear; /* RGBA8 */
};

static void draw_texel(const struct glass_pattern *pattern, struct glass_picture *picture, int px,
                       int py)
{
    double pitch = pattern->width_m / picture->width_px; /* metres per texel */
    struct glass_texel texel = {
        .x = (px + 0.5) * pitch - pattern->width_m / 2,
        .y = pattern->top_m - (py + 0.5) * pattern->height_m / picture->height_px,
        .came_half_width = pattern->came_half_width_m,
        .came_distance = INFINITY,
    };
    pattern->draw(&texel);
    double lead = fmin(1, fmax(0, 0.5 - texel.came_distance / pitch));
    double tone = glass_tone(&texel);
    size_t at = 4 * ((size_t)py * (size_t)picture->width_px + (size_t)px);
    for (int i = 0; i < 3; i++) {
        double glass = pow(glass_colors[texel.color][i], 2 - tone) * (0.5 + 0.5 * tone);
        picture->glass[at + (size_t)i] = demo_srgb8(glass + lead * (lead_color[i] - glass));
        picture->clear[at + (size_t)i] = (uint8_t)lround(255 * (1 - lead));
    }
    picture->glass[at + 3] = picture->clear[at + 3] = 255;
}

void demo_draw_window(struct demo *demo, enum demo_window window, int *glass, int *clear)
{
    const struct glass_pattern *pattern = glass_pattern(window);
    int side_px = demo->texture_size_px;
    struct glass_picture picture = {
        .width_px = window == DEMO_ROSE ? side_px : side_px / 2,
        .height_px = side_px,
    };
    size_t size_bytes = (size_t)picture.width_px * (size_t)picture.height_px * 4;
    picture.glass = malloc(size_bytes);
    picture.clear = malloc(size_bytes);
    if (picture.glass && picture.clear) {
        for (int y = 0; y < picture.height_px; y++)
            for (int x = 0; x < picture.width_px; x++)
                draw_texel(pattern, &picture, x, y);
        *glass = demo_add_picture(demo, pattern->name, picture.glass, picture.width_px,
                                  picture.height_px, GLB_WRAP_CLAMP);
        *clear = demo_add_picture(demo, pattern->name, picture.clear, picture.width_px,
                                  picture.height_px, GLB_WRAP_CLAMP);
    } else {
        struct error cause = {0};
        error_set(&cause, ERROR_NO_MEMORY, "window '%s'", pattern->name);
        *glass = *clear = glb_builder_fail(demo->builder, &cause);
    }
    free(picture.glass);
    free(picture.clear);
}
