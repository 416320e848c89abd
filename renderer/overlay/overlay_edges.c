/* SPDX-License-Identifier: MIT */
/* Draws feature edges. It finds which edges of the drawn meshes are creases, borders or silhouettes
 * and where they are hidden, and draws their lines with antialiasing. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/overlay/overlay.h"
#include "renderer/overlay/overlay_screen.h"

enum { PIECES_MAX = 1 << 16 };
static const double PIECE_PX = 2; /* of a line, seen or hidden as its middle is */

struct piece { /* of a line, in pixels */
    float ends[2][2];
    double depth_m, tolerance_m; /* of its middle */
};

struct drawing {
    const struct overlay_desc *desc;
    const struct view_edges *style;
    struct overlay_stats *stats;
    struct overlay_screen screen;
    double least_cosine;  /* of the normals on both sides of an edge that is no crease */
    uint8_t *alpha[2];    /* owned; per pixel drawn: of what is seen, of what is hidden */
    struct piece *pieces; /* owned; that wait for their rays ... */
    double (*pixels)[2];  /* owned; ... through their middles */
    size_t piece_count;
};

static double distance_to(const struct piece *piece, double x, double y)
{
    double from[2] = {(double)piece->ends[0][0], (double)piece->ends[0][1]};
    double way[2] = {(double)piece->ends[1][0] - from[0], (double)piece->ends[1][1] - from[1]};
    double square = way[0] * way[0] + way[1] * way[1];
    double t = square > 0 ? ((x - from[0]) * way[0] + (y - from[1]) * way[1]) / square : 0;
    t = fmax(0, fmin(1, t));
    return hypot(x - from[0] - t * way[0], y - from[1] - t * way[1]);
}

/* The coverage of a pixel by a line of the style's width, from the distance of its middle. */
static void draw_piece(const struct drawing *d, const struct piece *piece, uint8_t *alpha)
{
    double reach = 0.5 * (double)d->style->width_px + 0.5;
    double thin = fmin(1, (double)d->style->width_px);
    int x0 = (int)floor(fmin((double)piece->ends[0][0], (double)piece->ends[1][0]) - reach);
    int x1 = (int)ceil(fmax((double)piece->ends[0][0], (double)piece->ends[1][0]) + reach);
    int y0 = (int)floor(fmin((double)piece->ends[0][1], (double)piece->ends[1][1]) - reach);
    int y1 = (int)ceil(fmax((double)piece->ends[0][1], (double)piece->ends[1][1]) + reach);
    const struct view_tile *drawn = &d->screen.drawn;
    int right = drawn->x_px + drawn->width_px, bottom = drawn->y_px + drawn->height_px;
    for (int y = y0 < drawn->y_px ? drawn->y_px : y0; y <= y1 && y < bottom; y++)
        for (int x = x0 < drawn->x_px ? drawn->x_px : x0; x <= x1 && x < right; x++) {
            double a = fmin(thin, fmax(0, reach - distance_to(piece, x + 0.5, y + 0.5)));
            size_t row = (size_t)(y - drawn->y_px), column = (size_t)(x - drawn->x_px);
            uint8_t *out = &alpha[row * (size_t)drawn->width_px + column];
            uint8_t byte = (uint8_t)lround(255 * a);
            *out = *out > byte ? *out : byte;
        }
}

static void visit_piece(void *context, size_t index, const struct raytrace_layer *layers,
                        size_t count)
{
    struct drawing *d = context;
    const struct piece *piece = &d->pieces[index];
    const struct raytrace_layer *last = count ? &layers[count - 1] : NULL;
    bool is_hidden =
        last && !last->is_transparent && last->depth < piece->depth_m - piece->tolerance_m;
    if (d->alpha[is_hidden])
        draw_piece(d, piece, d->alpha[is_hidden]);
}

static bool flush(struct drawing *d, struct error *err)
{
    const struct raytrace_look look = {.pixels = (const double(*)[2])d->pixels,
                                       .count = d->piece_count,
                                       .context = d,
                                       .visit = visit_piece};
    d->piece_count = 0;
    return look.count == 0 || raytrace_look(d->desc->rays, &look, err);
}

/* Clips a segment to a part of the picture and `margin` pixels around it (Liang and Barsky 1984, "A
 * New Concept and Method for Line Clipping"). */
static bool clip_to(const struct drawing *d, const struct view_tile *part, const double a[2],
                    const double b[2], double range[2])
{
    double margin = (double)d->style->width_px + 1;
    const double low[2] = {part->x_px - margin, part->y_px - margin};
    const double high[2] = {part->x_px + part->width_px + margin,
                            part->y_px + part->height_px + margin};
    range[0] = 0, range[1] = 1;
    for (int k = 0; k < 2; k++) {
        double way = b[k] - a[k];
        double low_t = (low[k] - a[k]) / way, high_t = (high[k] - a[k]) / way;
        if (way == 0 && (a[k] < low[k] || a[k] > high[k]))
            return false;
        if (way == 0)
            continue;
        range[0] = fmax(range[0], fmin(low_t, high_t));
        range[1] = fmin(range[1], fmax(low_t, high_t));
    }
    return range[0] < range[1];
}

/* The depth at a share of the way between two projected points: 1 / depth is linear there. */
static double depth_at(const struct drawing *d, const double ends[2][3], double t)
{
    if (d->screen.camera->is_orthographic)
        return ends[0][2] + t * (ends[1][2] - ends[0][2]);
    return 1 / ((1 - t) / ends[0][2] + t / ends[1][2]);
}

/* Lines are cut into the same pieces whatever of the picture is drawn; those that may reach into it
 * are kept. */
static bool add_line(struct drawing *d, const double a[3], const double b[3], struct error *err)
{
    const struct view_tile picture = {.width_px = d->screen.width_px,
                                      .height_px = d->screen.height_px};
    double ends[2][3], pixel[2][2], range[2], near[2];
    memcpy(ends[0], a, sizeof ends[0]);
    memcpy(ends[1], b, sizeof ends[1]);
    if (!overlay_screen_clip_segment(&d->screen, ends))
        return true;
    for (int i = 0; i < 2; i++)
        overlay_screen_project(&d->screen, ends[i], pixel[i]);
    if (!clip_to(d, &picture, pixel[0], pixel[1], range) ||
        !clip_to(d, &d->screen.drawn, pixel[0], pixel[1], near))
        return true;
    double way[2] = {pixel[1][0] - pixel[0][0], pixel[1][1] - pixel[0][1]};
    int count = (int)ceil((range[1] - range[0]) * hypot(way[0], way[1]) / PIECE_PX);
    double step = (range[1] - range[0]) / count;
    int first = (int)fmax(0, floor((near[0] - range[0]) / step) - 1);
    int end = (int)fmin(count, ceil((near[1] - range[0]) / step) + 1);
    d->stats->edges++;
    for (int i = first; i < end; i++) {
        if (d->piece_count == PIECES_MAX && !flush(d, err))
            return false;
        double t = range[0] + (i + 0.5) * step;
        struct piece *piece = &d->pieces[d->piece_count];
        for (int e = 0; e < 2; e++)
            for (int k = 0; k < 2; k++)
                piece->ends[e][k] = (float)(pixel[0][k] + (t + (e - 0.5) * step) * way[k]);
        for (int k = 0; k < 2; k++)
            d->pixels[d->piece_count][k] = pixel[0][k] + t * way[k];
        piece->depth_m = depth_at(d, (const double(*)[3])ends, t);
        piece->tolerance_m =
            1e-5 * piece->depth_m + 0.5 * overlay_screen_pixel_m(&d->screen, piece->depth_m);
        d->piece_count++;
    }
    return true;
}

struct mesh {             /* of one item, in view space */
    double (*points)[3];  /* owned */
    double (*normals)[3]; /* owned; per triangle, unit or zero */
    bool *faces_eye;      /* owned; per triangle */
};

static void mesh_finish(struct mesh *mesh)
{
    free(mesh->points);
    free(mesh->normals);
    free(mesh->faces_eye);
}

static bool mesh_init(struct mesh *mesh, const struct drawing *d, const struct state_item *item,
                      struct error *err)
{
    const struct scene_state *state = d->desc->rays->state;
    const struct state_geometry geometry = state_geometry_of(state, item);
    const struct scene_primitive *p = geometry.primitive;
    const uint32_t *index = geometry.indices + p->first_index;
    size_t triangles = p->index_count / 3;
    *mesh = (struct mesh){.points = malloc((p->vertex_count + 1u) * sizeof *mesh->points),
                          .normals = malloc((triangles + 1) * sizeof *mesh->normals),
                          .faces_eye = malloc(triangles + 1)};
    if (!mesh->points || !mesh->normals || !mesh->faces_eye)
        return error_set(err, ERROR_NO_MEMORY, "edges of %zu triangles", triangles);
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        double world[3];
        state_geometry_point(&geometry, i, world);
        camera_to_view(d->screen.camera, world, mesh->points[i]);
    }
    for (size_t i = 0; i < triangles; i++) {
        const double *corner = mesh->points[index[3 * i]];
        double e1[3], e2[3], *normal = mesh->normals[i];
        vec3_sub(mesh->points[index[3 * i + 1]], corner, e1);
        vec3_sub(mesh->points[index[3 * i + 2]], corner, e2);
        vec3_cross(e1, e2, normal);
        double length = vec3_length(normal);
        for (int k = 0; k < 3; k++)
            normal[k] = length > 0 ? normal[k] / length : 0;
        mesh->faces_eye[i] =
            (d->screen.camera->is_orthographic ? normal[2] : vec3_dot(normal, corner)) > 0;
    }
    return true;
}

/* Whether the style shows the edge. */
static bool is_feature(const struct drawing *d, const struct mesh *mesh,
                       const struct edge_record *edge, const uint32_t faces[2])
{
    if (edge->uses == 1)
        return !d->style->omits_borders;
    if (edge->uses != 2)
        return true; /* three sheets or more meet */
    const double *a = mesh->normals[faces[0]], *b = mesh->normals[faces[1]];
    double cosine = vec3_dot(a, b), turned = edge->signed_count == 0 ? 1 : -1;
    if (vec3_dot(a, a) == 0 || vec3_dot(b, b) == 0)
        return false; /* a sliver without area */
    bool is_outline =
        (mesh->faces_eye[faces[0]] == mesh->faces_eye[faces[1]]) == (edge->signed_count != 0);
    return turned * cosine < d->least_cosine || (is_outline && !d->style->omits_silhouettes);
}

static bool add_item(struct drawing *d, const struct state_item *item, struct error *err)
{
    const struct scene *scene = d->desc->rays->state->scene;
    struct mesh mesh = {0};
    const struct edge_table *table = feature_edges_of(d->desc->edges, scene, item->primitive, err);
    bool ok = table && mesh_init(&mesh, d, item, err);
    for (uint32_t i = 0; ok && i < table->count; i++) {
        const struct edge_record *edge = &table->records[i];
        if (is_feature(d, &mesh, edge, table->faces[i]))
            ok = add_line(d, mesh.points[edge->low], mesh.points[edge->high], err);
    }
    mesh_finish(&mesh);
    return ok;
}

static void composite(const struct drawing *d)
{
    struct image *color = d->desc->color;
    size_t count = (size_t)color->width_px * (size_t)color->height_px;
    for (int layer = 1; layer >= 0; layer--) { /* what is seen lies over what is hidden */
        float most = layer ? d->style->hidden : 1;
        for (size_t i = 0; d->alpha[layer] && i < count; i++)
            if (d->alpha[layer][i])
                overlay_blend((float *)color->pixels + 4 * i, d->style->color,
                              most * (float)d->alpha[layer][i] / 255);
    }
}

bool overlay_draw_edges(const struct overlay_desc *desc, struct overlay_stats *stats,
                        struct error *err)
{
    const struct scene_state *state = desc->rays->state;
    const struct view_edges *style = &desc->rays->view->edges;
    size_t pixels = (size_t)desc->color->width_px * (size_t)desc->color->height_px;
    struct drawing d = {.desc = desc,
                        .style = style,
                        .stats = stats,
                        .least_cosine = cos((double)style->crease_deg * M_PI / 180),
                        .alpha = {calloc(pixels, 1), style->hidden > 0 ? calloc(pixels, 1) : NULL},
                        .pieces = malloc(PIECES_MAX * sizeof *d.pieces),
                        .pixels = malloc(PIECES_MAX * sizeof *d.pixels)};
    overlay_screen_init(&d.screen, desc->rays->camera, desc->rays->view);
    bool ok = d.alpha[0] && (d.alpha[1] || !(style->hidden > 0)) && d.pieces && d.pixels;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "edges of %zu pixels", pixels);
    int least_px = d.screen.width_px < d.screen.height_px ? d.screen.width_px : d.screen.height_px;
    double wider = 1 + 2 * ((double)style->width_px + 1) / least_px; /* clip_to's margin */
    for (size_t i = 0; ok && i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        if (item->casts_shadow && /* triangles */
            camera_may_see(desc->rays->camera, item->center, item->radius_m, wider))
            ok = add_item(&d, item, err);
    }
    ok = ok && flush(&d, err);
    if (ok)
        composite(&d);
    free(d.alpha[0]);
    free(d.alpha[1]);
    free(d.pieces);
    free(d.pixels);
    return ok;
}
