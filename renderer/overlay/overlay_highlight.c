/* SPDX-License-Identifier: MIT */
/* Draws the outline of selected nodes. It rasterises their coverage with 16 samples per pixel,
 * finds the distance of each pixel from the border, and dims the outline where an opaque surface
 * hides it.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/overlay/overlay.h"
#include "renderer/overlay/overlay_screen.h"

enum { SIDE = 4, SAMPLES = SIDE * SIDE };

struct border { /* a pixel on the border of the selection */
    int x, y;
    bool is_seen;
};

struct outline {
    const struct overlay_desc *desc;
    const struct view_highlight *style;
    struct overlay_screen screen;
    int reach_px;           /* how far from a border pixel its outline may be */
    struct view_tile area;  /* of the picture: what is drawn, and what its outlines depend on */
    bool *is_selected;      /* owned; per node */
    uint16_t *samples;      /* owned; per pixel of the area: bits of those that it covers */
    float *distance_px;     /* owned; per pixel: from the border outward, INFINITY far away */
    bool *is_seen;          /* owned; per pixel: the border that is nearest is */
    struct border *borders; /* owned */
    double (*pixels)[2];    /* owned; of their rays */
    size_t border_count;
};

/* Selects nodes and all nodes below them; parents come before their children. */
static bool select_nodes(struct outline *o, struct error *err)
{
    const struct scene *scene = o->desc->rays->state->scene;
    for (size_t i = 0; i < o->style->node_count; i++) {
        int32_t node = scene_find_node(scene, o->style->nodes[i]);
        if (node < 0)
            return error_set_at(err, ERROR_NOT_FOUND, "/highlight/nodes",
                                "the scene has no node '%s'", o->style->nodes[i]);
        o->is_selected[node] = true;
    }
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (scene->nodes[i].parent >= 0 && o->is_selected[scene->nodes[i].parent])
            o->is_selected[i] = true;
    return true;
}

/* The place of a pixel of the picture among those of the area. */
static size_t place_of(const struct outline *o, int x, int y)
{
    return (size_t)(y - o->area.y_px) * (size_t)o->area.width_px + (size_t)(x - o->area.x_px);
}

/* Sets the samples of a row from one to another, numbered through the picture. */
static void cover_row(struct outline *o, int row, int first, int last)
{
    for (int i = first; i <= last; i++)
        o->samples[place_of(o, i / SIDE, row / SIDE)] |=
            (uint16_t)(1u << (row % SIDE * SIDE + i % SIDE));
}

/* Rasterises a triangle. Samples on an edge count as covered. */
static void cover_triangle(struct outline *o, const double *const corners[3])
{
    double low = fmin(corners[0][1], fmin(corners[1][1], corners[2][1]));
    double high = fmax(corners[0][1], fmax(corners[1][1], corners[2][1]));
    const int begin[2] = {o->area.x_px * SIDE, o->area.y_px * SIDE};
    const int end[2] = {begin[0] + o->area.width_px * SIDE, begin[1] + o->area.height_px * SIDE};
    int first_row = (int)fmin(end[1], fmax(begin[1], ceil(low * SIDE - 0.5)));
    int last_row = (int)fmax(-1, fmin(end[1] - 1, floor(high * SIDE - 0.5)));
    for (int row = first_row; row <= last_row; row++) {
        double y = (row + 0.5) / SIDE, left = INFINITY, right = -INFINITY;
        for (int i = 0; i < 3; i++) {
            const double *a = corners[i], *b = corners[(i + 1) % 3];
            if ((y < a[1] && y < b[1]) || (y > a[1] && y > b[1]))
                continue;
            double t = a[1] == b[1] ? 0 : (y - a[1]) / (b[1] - a[1]);
            double x = a[0] + t * (b[0] - a[0]);
            left = fmin(left, a[1] == b[1] ? fmin(a[0], b[0]) : x);
            right = fmax(right, a[1] == b[1] ? fmax(a[0], b[0]) : x);
        }
        cover_row(o, row, (int)fmax(begin[0], ceil(fmin(left, end[0]) * SIDE - 0.5)),
                  (int)fmax(-1, fmin(end[0] - 1, floor(right * SIDE - 0.5))));
    }
}

static void cover_item(struct outline *o, const struct state_item *item)
{
    const struct scene_state *state = o->desc->rays->state;
    const struct state_geometry geometry = state_geometry_of(state, item);
    for (uint32_t i = 0; i + 2 < geometry.primitive->index_count; i += 3) {
        double corners[POLYGON_CORNERS_MAX][3], pixels[POLYGON_CORNERS_MAX][2];
        for (uint32_t c = 0; c < 3; c++) {
            double world[3];
            state_geometry_corner(&geometry, i + c, world);
            camera_to_view(o->screen.camera, world, corners[c]);
        }
        int count = overlay_screen_clip(&o->screen, corners, 3);
        for (int c = 0; c < count; c++)
            overlay_screen_project(&o->screen, corners[c], pixels[c]);
        for (int c = 2; c < count; c++)
            cover_triangle(o, (const double *const[3]){pixels[0], pixels[c - 1], pixels[c]});
    }
}

static uint16_t samples_at(const struct outline *o, int x, int y)
{
    bool is_inside = x >= 0 && y >= 0 && x < o->screen.width_px && y < o->screen.height_px;
    return is_inside ? o->samples[place_of(o, x, y)] : UINT16_MAX;
}

static bool is_border(const struct outline *o, int x, int y)
{
    uint16_t own = samples_at(o, x, y);
    if (!own || own != UINT16_MAX)
        return own != 0;
    return samples_at(o, x - 1, y) != UINT16_MAX || samples_at(o, x + 1, y) != UINT16_MAX ||
           samples_at(o, x, y - 1) != UINT16_MAX || samples_at(o, x, y + 1) != UINT16_MAX;
}

/* The place of a sample in its pixel, both coordinates from 0 to 1. */
static void place_sample(int sample, double place[2])
{
    int row = sample / SIDE, column = sample % SIDE;
    place[0] = (column + 0.5) / SIDE;
    place[1] = (row + 0.5) / SIDE;
}

/* The place of that covered sample which is nearest to the mean of all covered ones. */
static void aim(uint16_t samples, double middle[2])
{
    double sum[2] = {0}, best = INFINITY, place[2];
    int count = __builtin_popcount(samples);
    for (int i = 0; i < SAMPLES; i++) {
        place_sample(i, place);
        for (int k = 0; k < 2 && samples >> i & 1; k++)
            sum[k] += place[k] / count;
    }
    for (int i = 0; i < SAMPLES; i++) {
        place_sample(i, place);
        double away = hypot(place[0] - sum[0], place[1] - sum[1]);
        if (samples >> i & 1 && away < best) {
            best = away;
            memcpy(middle, place, sizeof place);
        }
    }
}

/* What is drawn and `margin_px` around it, within the picture. */
static struct view_tile around(const struct overlay_screen *screen, int margin_px)
{
    const struct view_tile *drawn = &screen->drawn;
    int x = drawn->x_px > margin_px ? drawn->x_px - margin_px : 0;
    int y = drawn->y_px > margin_px ? drawn->y_px - margin_px : 0;
    int right = drawn->x_px + drawn->width_px + margin_px;
    int bottom = drawn->y_px + drawn->height_px + margin_px;
    right = right < screen->width_px ? right : screen->width_px;
    bottom = bottom < screen->height_px ? bottom : screen->height_px;
    return (struct view_tile){x, y, right - x, bottom - y};
}

/* In the order of the picture, so that of two as near the same one is taken in every tile. */
static bool list_borders(struct outline *o, struct error *err)
{
    const struct view_tile near = around(&o->screen, o->reach_px);
    size_t count = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int y = near.y_px; y < near.y_px + near.height_px; y++)
            for (int x = near.x_px; x < near.x_px + near.width_px; x++) {
                if (!is_border(o, x, y))
                    continue;
                if (pass == 0) {
                    count++;
                    continue;
                }
                double middle[2] = {0.5, 0.5};
                aim(samples_at(o, x, y), middle);
                o->pixels[o->border_count][0] = x + middle[0];
                o->pixels[o->border_count][1] = y + middle[1];
                o->borders[o->border_count++] = (struct border){.x = x, .y = y};
            }
        if (pass)
            break;
        o->borders = malloc((count + 1) * sizeof *o->borders);
        o->pixels = malloc((count + 1) * sizeof *o->pixels);
        if (!o->borders || !o->pixels)
            return error_set(err, ERROR_NO_MEMORY, "an outline of %zu pixels", count);
    }
    return true;
}

/* A border pixel is seen if its ray meets a selected surface before the first opaque surface, or if
 * that surface is selected. */
static void visit_border(void *context, size_t index, const struct raytrace_layer *layers,
                         size_t count)
{
    struct outline *o = context;
    o->borders[index].is_seen = count == 0;
    for (size_t i = 0; i < count; i++)
        o->borders[index].is_seen |= o->is_selected[layers[i].node];
}

/* Gives the pixels around a border pixel their distance, if none is nearer. */
static void spread(struct outline *o, const struct border *border)
{
    const struct view_tile *drawn = &o->screen.drawn;
    int reach = o->reach_px;
    double covered = __builtin_popcount(samples_at(o, border->x, border->y)) / (double)SAMPLES;
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++) {
            int x = border->x + dx, y = border->y + dy;
            if (x < drawn->x_px || y < drawn->y_px || x >= drawn->x_px + drawn->width_px ||
                y >= drawn->y_px + drawn->height_px)
                continue;
            size_t at = place_of(o, x, y);
            float distance = (float)(hypot(dx, dy) - (covered - 0.5));
            if (distance < o->distance_px[at]) {
                o->distance_px[at] = distance;
                o->is_seen[at] = border->is_seen;
            }
        }
}

static void composite(struct outline *o, struct overlay_stats *stats)
{
    const struct view_tile *drawn = &o->screen.drawn;
    size_t width = (size_t)drawn->width_px, count = width * (size_t)drawn->height_px;
    for (size_t i = 0; i < count; i++) {
        size_t at = place_of(o, drawn->x_px + (int)(i % width), drawn->y_px + (int)(i / width));
        float outside = 1 - (float)__builtin_popcount(o->samples[at]) / SAMPLES;
        float near = o->style->width_px + 0.5f - o->distance_px[at];
        float alpha = fminf(1, fmaxf(0, near)) * outside * (o->is_seen[at] ? 1 : o->style->hidden);
        if (alpha <= 0)
            continue;
        overlay_blend((float *)o->desc->color->pixels + 4 * i, o->style->color, alpha);
        stats->outlined++;
    }
}

static bool outline_init(struct outline *o, struct error *err)
{
    const struct raytrace_desc *rays = o->desc->rays;
    overlay_screen_init(&o->screen, rays->camera, rays->view);
    o->reach_px = (int)ceil((double)o->style->width_px) + 1;
    o->area = around(&o->screen, o->reach_px + 1); /* a border pixel depends on its neighbours */
    size_t pixels = (size_t)o->area.width_px * (size_t)o->area.height_px;
    o->is_selected = calloc(rays->state->scene->node_count + 1u, sizeof *o->is_selected);
    o->samples = calloc(pixels, sizeof *o->samples);
    o->distance_px = calloc(pixels, sizeof *o->distance_px);
    o->is_seen = calloc(pixels, sizeof *o->is_seen);
    if (!o->is_selected || !o->samples || !o->distance_px || !o->is_seen)
        return error_set(err, ERROR_NO_MEMORY, "an outline over %zu pixels", pixels);
    for (size_t i = 0; i < pixels; i++)
        o->distance_px[i] = INFINITY;
    return true;
}

static void outline_finish(struct outline *o)
{
    free(o->is_selected);
    free(o->samples);
    free(o->distance_px);
    free(o->is_seen);
    free(o->borders);
    free(o->pixels);
}

bool overlay_draw_highlight(const struct overlay_desc *desc, struct overlay_stats *stats,
                            struct error *err)
{
    const struct scene_state *state = desc->rays->state;
    struct outline o = {.desc = desc, .style = &desc->rays->view->highlight};
    bool ok = outline_init(&o, err) && select_nodes(&o, err);
    for (size_t i = 0; ok && i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        if (item->casts_shadow && o.is_selected[item->node] &&
            camera_may_see(desc->rays->camera, item->center, item->radius_m, 1))
            cover_item(&o, item);
    }
    ok = ok && list_borders(&o, err);
    const struct raytrace_look look = {.pixels = (const double(*)[2])o.pixels,
                                       .count = o.border_count,
                                       .context = &o,
                                       .visit = visit_border};
    ok = ok && (o.border_count == 0 || raytrace_look(desc->rays, &look, err));
    for (size_t i = 0; ok && i < o.border_count; i++)
        spread(&o, &o.borders[i]);
    if (ok)
        composite(&o, stats);
    outline_finish(&o);
    return ok;
}
