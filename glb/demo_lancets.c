/* SPDX-License-Identifier: MIT */
/* The patterns of the lancet windows, and the table of all patterns. */
#include <math.h>

#include "glb/demo_glass.h"

/* The height of the arch above its spring, shape_outline_arch. */
#define LANCET_RISE (LANCET_WIDTH * 0.80622577482985496) /* sqrt(0.9^2 - 0.4^2) */
#define LANCET_TOP (LANCET_SPRING + LANCET_RISE)
#define LANCET_HEIGHT (LANCET_TOP - LANCET_BOTTOM)

/* Signed distance to the window drawn in by inset. */
static double lancet_distance(double x, double y, double inset)
{
    double radius = LANCET_POINTEDNESS * LANCET_WIDTH, offset = radius - LANCET_WIDTH / 2;
    double side = y < LANCET_SPRING ? fabs(x) - LANCET_WIDTH / 2
                                    : hypot(fabs(x) + offset, y - LANCET_SPRING) - radius;
    return fmax(side, LANCET_BOTTOM - y) + inset;
}

/* Distance to the nearest of the lines at whole multiples of step. */
static double lines_distance(double at, double step)
{
    return fabs(at - step * floor(at / step + 0.5));
}

/* A strip of glass pieces along the edge; what is inside it is drawn afterwards. Returns whether
 * the texel lies inside. */
static bool draw_border(struct glass_texel *texel, enum glass_color a, enum glass_color b)
{
    double came = texel->came_half_width, step = 0.22;
    int piece = (int)floor(texel->y / step);
    glass_piece(texel, lancet_distance(texel->x, texel->y, -1), piece % 2 ? a : b,
                2 * piece + (texel->x > 0));
    glass_line(texel, lines_distance(texel->y, step));
    double inner = lancet_distance(texel->x, texel->y, 0.10);
    if (inner >= came) {
        glass_line(texel, inner);
        return false;
    }
    texel->came_distance = INFINITY;
    return true;
}

static void end_border(struct glass_texel *texel)
{
    double came = texel->came_half_width;
    texel->came_half_width = 1.6 * came;
    glass_line(texel, lancet_distance(texel->x, texel->y, 0.10));
    texel->came_half_width = came;
}

/* Diamond quarries behind a column of medallions, each with a cross of four leaves. */
void glass_draw_medallions(struct glass_texel *texel)
{
    static const enum glass_color quarries[] = {GLASS_AZURE, GLASS_COBALT, GLASS_TEAL};
    static const enum glass_color discs[] = {GLASS_RUBY, GLASS_EMERALD, GLASS_VIOLET};
    if (!draw_border(texel, GLASS_RUBY, GLASS_GOLD))
        return;
    double a = (texel->x / 0.26 + texel->y / 0.36), b = (texel->x / 0.26 - texel->y / 0.36);
    int i = (int)floor(a), j = (int)floor(b);
    texel->color = quarries[((i + 2 * j) % 3 + 3) % 3];
    texel->cell = 50 * i + j;
    glass_line(texel, lines_distance(a, 1) * 0.21);
    glass_line(texel, lines_distance(b, 1) * 0.21);
    double pitch = 0.94, phase = texel->y - LANCET_BOTTOM - 0.62;
    int medallion = (int)fmin(2, fmax(0, floor(phase / pitch + 0.5)));
    double x = texel->x, y = phase - pitch * medallion, r = hypot(x, y);
    glass_piece(texel, r - 0.43, GLASS_GOLD, 1000 + medallion);
    glass_piece(texel, r - 0.36, discs[medallion], 1010 + medallion);
    double leaf = hypot(fabs(x) - 0.0, fabs(y) - 0.17), across = hypot(fabs(x) - 0.17, y);
    glass_piece(texel, fmin(leaf, across) - 0.125, GLASS_PEARL, 1020 + medallion);
    glass_piece(texel, fmin(leaf, across) - 0.075, GLASS_ORANGE, 1030 + medallion);
    glass_piece(texel, r - 0.09, GLASS_COBALT, 1040 + medallion);
    end_border(texel);
}

/* Overlapping scales, warm at the sill and cool at the top. */
void glass_draw_scales(struct glass_texel *texel)
{
    static const enum glass_color ramp[] = {GLASS_RUBY,   GLASS_ORANGE, GLASS_GOLD,  GLASS_GOLD,
                                            GLASS_PEARL,  GLASS_TEAL,   GLASS_AZURE, GLASS_COBALT,
                                            GLASS_VIOLET, GLASS_VIOLET};
    if (!draw_border(texel, GLASS_COBALT, GLASS_EMERALD))
        return;
    double width = 0.30, rise = 0.085, radius = 0.175;
    int top = (int)ceil((texel->y - LANCET_BOTTOM + radius) / rise) + 1;
    /* From the top row down: lower scales lie over higher ones, like tiles seen upside down. */
    for (int row = top; row >= top - 6; row--) {
        double shift = row % 2 ? 0.5 : 0, column = floor(texel->x / width + shift + 0.5);
        double center_x = (column - shift) * width, center_y = LANCET_BOTTOM + row * rise;
        int band = (int)floor(row * 10 / 36.0);
        band = band < 0 ? 0 : band > 9 ? 9 : band;
        double distance = hypot(texel->x - center_x, texel->y - center_y) - radius;
        enum glass_color color = ramp[band];
        if ((row + (int)column) % 5 == 0)
            color = ramp[(band + 3) % 10];
        glass_piece(texel, distance, color, 100 * row + (int)column + 50);
    }
    end_border(texel);
}

/* A pointed leaf from (0, 0) to (length, 0) in its own frame. */
static double leaf_distance(double x, double y, double length, double width)
{
    double radius = (length * length / 4 + width * width / 4) / width;
    double offset = radius - width / 2;
    return hypot(x - length / 2, fabs(y) + offset) - radius;
}

/* A lily: a stem with leaves in pairs, and a flower in the sun. */
void glass_draw_lily(struct glass_texel *texel)
{
    static const enum glass_color rays[] = {GLASS_GOLD, GLASS_ORANGE, GLASS_GOLD, GLASS_ROSE};
    if (!draw_border(texel, GLASS_VIOLET, GLASS_GOLD))
        return;
    double sun_y = LANCET_SPRING - 0.05, x = texel->x, y = texel->y;
    double angle = atan2(x, y - sun_y), r = hypot(x, y - sun_y), step = 0.3926990816987241;
    int ray = (int)floor(angle / step) + 8;
    int band = (int)floor((y - LANCET_BOTTOM) / 0.37);
    texel->color = band % 2 ? GLASS_COBALT : GLASS_AZURE;
    texel->cell = 40 + 2 * band + (x > 0);
    glass_line(texel, lines_distance(y - LANCET_BOTTOM, 0.37));
    glass_piece(texel, r - 0.50, rays[ray % 4], 100 + ray);
    if (r < 0.5)
        glass_line(texel, r * sin(lines_distance(angle, step)));
    double stem = fmax(fabs(x) - 0.028, fmax(y - sun_y, LANCET_BOTTOM + 0.1 - y));
    for (int pair = 0; pair < 4; pair++) {
        double base_y = LANCET_BOTTOM + 0.22 + 0.40 * pair, c = 0.60, s = 0.80;
        double dx = fabs(x), dy = y - base_y;
        glass_piece(texel, leaf_distance(dx * c + dy * s, dy * c - dx * s, 0.58, 0.19),
                    GLASS_EMERALD, 200 + 2 * pair + (x > 0));
    }
    glass_piece(texel, stem, GLASS_EMERALD, 300);
    for (int petal = -2; petal <= 2; petal++) {
        double turn = 0.62 * (petal == 2 || petal == -2 ? petal * 0.95 : petal);
        double c = cos(turn), s = sin(turn), dy = y - (sun_y - 0.26);
        double along = x * s + dy * c, across = x * c - dy * s;
        glass_piece(texel, leaf_distance(along, across, petal ? 0.52 : 0.60, 0.17),
                    petal % 2 ? GLASS_ROSE : GLASS_PEARL, 400 + petal);
    }
    glass_piece(texel, hypot(x, y - sun_y + 0.24) - 0.085, GLASS_RUBY, 500);
    end_border(texel);
}

const struct glass_pattern *glass_pattern(enum demo_window window)
{
    static const struct glass_pattern patterns[DEMO_WINDOW_COUNT] = {
        [DEMO_ROSE] = {.name = "Rose",
                       .width_m = 2 * ROSE_RADIUS,
                       .height_m = 2 * ROSE_RADIUS,
                       .top_m = ROSE_RADIUS,
                       .came_half_width_m = 0.0095,
                       .draw = glass_draw_rose},
        [DEMO_LANCET_MEDALLIONS] = {.name = "Medallions",
                                    .draw = glass_draw_medallions,
                                    .width_m = LANCET_WIDTH,
                                    .height_m = LANCET_HEIGHT,
                                    .top_m = LANCET_TOP,
                                    .came_half_width_m = 0.009},
        [DEMO_LANCET_SCALES] = {.name = "Scales",
                                .draw = glass_draw_scales,
                                .width_m = LANCET_WIDTH,
                                .height_m = LANCET_HEIGHT,
                                .top_m = LANCET_TOP,
                                .came_half_width_m = 0.009},
        [DEMO_LANCET_LILY] = {.name = "Lily",
                              .draw = glass_draw_lily,
                              .width_m = LANCET_WIDTH,
                              .height_m = LANCET_HEIGHT,
                              .top_m = LANCET_TOP,
                              .came_half_width_m = 0.009},
    };
    return &patterns[window];
}
