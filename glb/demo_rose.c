/* SPDX-License-Identifier: MIT */
/* The pattern of the rose window: rings of petals and roundels in twelve parts. */
#include <math.h>

#include "glb/demo_glass.h"

static const double pi = 3.14159265358979323846;

/* Polar coordinates relative to the middle of one of `parts` equal sectors. */
struct sector {
    int index;
    double x, y; /* m; y outward along the middle line of the sector, x across it */
};

static struct sector sector_of(const struct glass_texel *texel, int parts, double offset)
{
    double r = hypot(texel->x, texel->y), step = 2 * pi / parts;
    double angle = atan2(texel->x, texel->y) / step + offset;
    double index = floor(angle + 0.5), local = (angle - index) * step;
    int whole = ((int)index % parts + parts) % parts;
    return (struct sector){.index = whole, .x = r * sin(local), .y = r * cos(local)};
}

/* Distance to the nearest line between two sectors. */
static double spoke_distance(const struct sector *sector, int parts)
{
    double half = pi / parts;
    return fabs(sector->x) * cos(half) - sector->y * sin(half);
}

static double circle(double x, double y, double center_y, double radius)
{
    return hypot(x, y - center_y) - radius;
}

/* A pointed petal between y0 and y1: the overlap of two circles, as wide as given in the middle. */
static double petal(double x, double y, double y0, double y1, double width)
{
    double half_length = (y1 - y0) / 2, half_width = width / 2;
    double radius = (half_length * half_length + half_width * half_width) / (2 * half_width);
    double middle = (y0 + y1) / 2, offset = radius - half_width;
    return fmax(hypot(x + offset, y - middle), hypot(x - offset, y - middle)) - radius;
}

/* Twelve long petals with an almond inside, on a ground cut by spokes. */
static void draw_petals(struct glass_texel *texel, double r)
{
    static const enum glass_color grounds[] = {GLASS_COBALT, GLASS_VIOLET};
    static const enum glass_color petals[] = {GLASS_RUBY, GLASS_AZURE, GLASS_EMERALD};
    struct sector twelve = sector_of(texel, 12, 0), between = sector_of(texel, 12, 0.5);
    glass_piece(texel, r - 1.26, grounds[between.index % 2], 100 + between.index);
    glass_line(texel, fmax(fabs(twelve.x), r - 1.26));
    glass_piece(texel, petal(twelve.x, twelve.y, 0.40, 1.24, 0.40), petals[twelve.index % 3],
                200 + twelve.index);
    glass_piece(texel, petal(twelve.x, twelve.y, 0.66, 1.14, 0.19), GLASS_GOLD, 300 + twelve.index);
    glass_piece(texel, circle(between.x, between.y, 1.14, 0.085), GLASS_PEARL, 400 + between.index);
}

/* Twelve roundels with a six-leaved flower each, small ones between them. */
static void draw_roundels(struct glass_texel *texel, double r)
{
    static const enum glass_color discs[] = {GLASS_COBALT, GLASS_RUBY, GLASS_TEAL};
    static const enum glass_color leaves[] = {GLASS_GOLD, GLASS_AZURE, GLASS_ROSE};
    struct sector twelve = sector_of(texel, 12, 0), between = sector_of(texel, 12, 0.5);
    struct sector ground = sector_of(texel, 24, 0.5);
    glass_piece(texel, r - 1.98, ground.index / 2 % 2 ? GLASS_EMERALD : GLASS_VIOLET,
                500 + ground.index);
    glass_line(texel, fmax(spoke_distance(&ground, 24), r - 1.98));
    glass_piece(texel, circle(between.x, between.y, 1.83, 0.115), GLASS_ORANGE,
                600 + between.index);
    glass_piece(texel, circle(between.x, between.y, 1.515, 0.07), GLASS_PEARL, 630 + between.index);
    glass_piece(texel, circle(twelve.x, twelve.y, 1.685, 0.268), discs[twelve.index % 3],
                660 + twelve.index);
    struct glass_texel local = {.x = twelve.x, .y = twelve.y - 1.685};
    struct sector leaf = sector_of(&local, 6, 0);
    glass_piece(texel, petal(leaf.x, leaf.y, 0.05, 0.235, 0.11), leaves[twelve.index % 3],
                700 + twelve.index * 6 + leaf.index);
    glass_piece(texel, hypot(local.x, local.y) - 0.062, GLASS_PEARL, 800 + twelve.index);
}

/* A band of equal pieces between two radii. */
static void draw_band(struct glass_texel *texel, double r, double outer, int parts,
                      const enum glass_color colors[2], int cell)
{
    struct sector piece = sector_of(texel, parts, 0);
    glass_piece(texel, r - outer, colors[piece.index % 2], cell + piece.index);
    glass_line(texel, fmax(spoke_distance(&piece, parts), r - outer));
}

void glass_draw_rose(struct glass_texel *texel)
{
    static const enum glass_color border[2] = {GLASS_COBALT, GLASS_RUBY};
    static const enum glass_color belt[2] = {GLASS_RUBY, GLASS_GOLD};
    static const enum glass_color eye[2] = {GLASS_COBALT, GLASS_PEARL};
    double r = hypot(texel->x, texel->y), came = texel->came_half_width;
    draw_band(texel, r, 2.3, 72, border, 0);
    texel->came_half_width = 2.2 * came; /* the rings carry the weight */
    glass_piece(texel, r - 1.98, GLASS_VIOLET, 0);
    texel->came_half_width = came;
    if (r < 1.98 + 4 * came)
        draw_roundels(texel, r);
    texel->came_half_width = 2.2 * came;
    glass_line(texel, r - 1.98);
    glass_piece(texel, r - 1.39, GLASS_GOLD, 0);
    texel->came_half_width = came;
    if (r < 1.39) {
        draw_band(texel, r, 1.39, 48, belt, 900);
        texel->came_half_width = 2.2 * came;
        glass_line(texel, r - 1.39);
        glass_piece(texel, r - 1.26, GLASS_COBALT, 0);
        texel->came_half_width = came;
    }
    if (r < 1.26) {
        draw_petals(texel, r);
        texel->came_half_width = 2.2 * came;
        glass_line(texel, r - 1.26);
        texel->came_half_width = came;
    }
    if (r > 0.5)
        return;
    draw_band(texel, r, 0.42, 24, eye, 1000);
    glass_piece(texel, r - 0.34, GLASS_RUBY, 1100);
    struct sector six = sector_of(texel, 6, 0);
    glass_piece(texel, petal(six.x, six.y, 0.07, 0.325, 0.15), GLASS_GOLD, 1200 + six.index);
    glass_piece(texel, r - 0.10, GLASS_AZURE, 1300);
}
