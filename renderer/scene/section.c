/* SPDX-License-Identifier: MIT */
/* Slicing closed meshes, and their caps as drawables. */
#include "renderer/scene/section.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/polygon_clip.h"
#include "renderer/scene/state_caps.h"

static const double COINCIDENT = 1e-12; /* of unit normals, and relative of offsets */

struct segment { /* of a cut, in the world; the body on its left, seen from what is cut away */
    double from[3], to[3];
    bool is_used;
};

struct slice { /* of one item by one plane */
    uint32_t item;
    struct section_outline outline;
    double low[2], high[2];
};

struct section {
    struct scene_state *state;
    const struct view *view;
    size_t plane;
    double origin[3], u[3], v[3], outward[3]; /* of the plane; unit; u x v is outward */
    struct slice *slices;                     /* owned; opaque ones first */
    size_t slice_count, opaque_count;
};

/* ---- cutting ---- */

/* Finds the segment in which a triangle meets the plane; points on the plane count as kept. */
static bool cut_triangle(const double plane[4], const double corners[3][3], bool is_mirrored,
                         struct segment *segment)
{
    int crossings = 0;
    for (int i = 0; i < 3; i++) {
        const double *a = corners[i], *b = corners[(i + 1) % 3];
        bool is_a_kept = plane_height(plane, a) >= 0, is_b_kept = plane_height(plane, b) >= 0;
        if (is_a_kept == is_b_kept)
            continue;
        crossings++;
        plane_meet(plane, a, b, is_b_kept != is_mirrored ? segment->from : segment->to);
    }
    segment->is_used = false;
    return crossings == 2 && points_compare(segment->from, segment->to) != 0;
}

static int compare_segments(const void *a, const void *b)
{
    const struct segment *x = a, *y = b;
    int order = points_compare(x->from, y->from);
    return order ? order : points_compare(x->to, y->to);
}

static struct segment *find_next(struct segment *segments, size_t count, const double from[3])
{
    size_t low = 0, high = count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (points_compare(segments[middle].from, from) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    while (low < count && segments[low].is_used && !points_compare(segments[low].from, from))
        low++;
    return low < count && !points_compare(segments[low].from, from) ? &segments[low] : NULL;
}

static void to_plane(const struct section *section, const double world[3], double point[2])
{
    double offset[3];
    vec3_sub(world, section->origin, offset);
    point[0] = vec3_dot(section->u, offset);
    point[1] = vec3_dot(section->v, offset);
}

/* As many segments end at a point as begin there, since the mesh is closed: walking on from one to
 * the next comes back to the first. */
static bool link_segments(const struct section *section, struct segment *segments, size_t count,
                          struct section_outline *outline)
{
    qsort(segments, count, sizeof *segments, compare_segments);
    for (size_t i = 0; i < count; i++) {
        struct segment *at = &segments[i];
        if (at->is_used)
            continue;
        for (const double *first = at->from; at; at = find_next(segments, count, at->to)) {
            double point[2];
            at->is_used = true;
            to_plane(section, at->from, point);
            if (!section_outline_add(outline, point))
                return false;
            if (points_compare(at->to, first) == 0)
                break;
        }
        if (!section_outline_end(outline))
            return false;
    }
    return true;
}

static bool slice_item(const struct section *section, const struct state_item *item,
                       struct section_outline *loops, struct error *err)
{
    const double *plane = section->view->clip_planes[section->plane];
    const struct state_geometry from = state_geometry_of(section->state, item);
    const struct scene_primitive *p = from.primitive;
    struct segment *segments = malloc((p->index_count / 3 + 1) * sizeof *segments);
    size_t count = 0;
    double low = 0, high = 0;
    for (uint32_t i = 0; segments && i + 2 < p->index_count; i += 3) {
        double corners[3][3];
        for (uint32_t c = 0; c < 3; c++) {
            state_geometry_corner(&from, i + c, corners[c]);
            low = fmin(low, plane_height(plane, corners[c]));
            high = fmax(high, plane_height(plane, corners[c]));
        }
        count +=
            cut_triangle(plane, (const double(*)[3])corners, item->is_mirrored, &segments[count]);
    }
    if (!(low < 0 && high > 0)) /* it touches the plane at most */
        count = 0;
    bool ok = segments && link_segments(section, segments, count, loops);
    free(segments);
    return ok || error_set(err, ERROR_NO_MEMORY, "a section of %u triangles", p->index_count / 3);
}

/* ---- the slices of a plane ---- */

static void place_plane(struct section *section, const struct state_item *item)
{
    const double *plane = section->view->clip_planes[section->plane];
    double length = vec3_length(plane);
    int least = 0;
    for (int k = 0; k < 3; k++) {
        section->outward[k] = -plane[k] / length;
        least = fabs(plane[k]) < fabs(plane[least]) ? k : least;
    }
    double axis[3] = {least == 0, least == 1, least == 2};
    vec3_cross(axis, section->outward, section->u);
    vec3_normalize(section->u);
    vec3_cross(section->outward, section->u, section->v);
    double height = plane_height(plane, item->center) / length;
    for (int k = 0; k < 3; k++)
        section->origin[k] = item->center[k] + section->outward[k] * height;
}

static void bound(struct slice *slice)
{
    for (int k = 0; k < 2; k++) {
        slice->low[k] = DBL_MAX, slice->high[k] = -DBL_MAX;
        for (uint32_t i = 0; i < slice->outline.point_count; i++) {
            slice->low[k] = fmin(slice->low[k], slice->outline.points[i][k]);
            slice->high[k] = fmax(slice->high[k], slice->outline.points[i][k]);
        }
    }
}

static bool is_cut(const struct section *section, const struct state_item *item)
{
    uint32_t through;
    return item->casts_shadow &&
           state_planes_meet(section->view->clip_planes, section->view->clip_plane_count,
                             item->bounds_min, item->bounds_max, &through) &&
           (through >> section->plane & 1);
}

static bool add_slice(struct section *section, uint32_t index, struct error *err)
{
    struct section_outline loops = {0};
    struct slice *slice = &section->slices[section->slice_count];
    slice->item = index;
    bool ok = slice_item(section, &section->state->items[index], &loops, err) &&
              section_resolve(&loops, NULL, 0, false, &slice->outline, err);
    section_outline_finish(&loops);
    bound(slice);
    section->slice_count += ok && slice->outline.loop_count > 0;
    return ok;
}

static bool add_slices(struct section *section, bool of_transparent, struct error *err)
{
    struct scene_state *state = section->state;
    for (uint32_t i = 0; i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        bool is_closed =
            state->scene->primitives[item->primitive].flags & SCENE_PRIMITIVE_IS_CLOSED;
        if ((item->class_ == STATE_TRANSPARENT) != of_transparent || !is_cut(section, item))
            continue;
        state->open_section_count += !is_closed;
        if (is_closed && !add_slice(section, i, err))
            return false;
    }
    return true;
}

/* ---- drawables ---- */

/* What closes an opaque body shows its factors, or the plane's colour; of a transparent one it is a
 * surface like the others: of a medium, a filter without thickness. */
static void fill_material(const struct section *section, const struct state_item *source,
                          struct state_material *material)
{
    const struct view_cut *cut = &section->view->cuts[section->plane];
    struct scene_material *m = &material->base;
    *material = section->state->materials[source->material];
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        m->textures[slot].texture = -1;
    m->flags |= SCENE_MATERIAL_DOUBLE_SIDED;
    if (source->class_ == STATE_TRANSPARENT) {
        m->thickness = source->is_medium ? 0 : m->thickness;
        memset(material->sigma, 0, sizeof material->sigma);
        m->attenuation_distance = 0;
        return;
    }
    m->alpha_mode = SCENE_OPAQUE;
    if (!cut->has_cap_color)
        return;
    memcpy(m->base_color, cut->cap_color, sizeof cut->cap_color);
    m->metallic = 0, m->roughness = 1;
    memset(m->emissive, 0, sizeof m->emissive);
}

/* The same half-space, but for rounding: such planes are one. */
static bool coincide(const double a[4], const double b[4])
{
    double size_a = vec3_length(a), size_b = vec3_length(b);
    double off_a = a[3] / size_a, off_b = b[3] / size_b;
    for (int k = 0; k < 3; k++)
        if (fabs(a[k] / size_a - b[k] / size_b) > COINCIDENT)
            return false;
    return fabs(off_a - off_b) <= COINCIDENT * fmax(fabs(off_a), fabs(off_b));
}

/* Clips a polygon by all other planes. */
static int clip(const struct section *section, double (*corners)[3], int count)
{
    const double(*planes)[4] = section->view->clip_planes;
    for (size_t p = 0; p < section->view->clip_plane_count && count; p++)
        if (p != section->plane && !coincide(planes[p], planes[section->plane]))
            count = polygon_clip(planes[p], corners, count);
    return count;
}

static void add_triangles(const struct section *section, const struct section_outline *triangles,
                          struct state_cap *cap)
{
    struct state_caps *caps = &section->state->caps;
    for (uint32_t i = 0; i + 2 < triangles->point_count; i += 3) {
        double corners[POLYGON_CORNERS_MAX][3];
        for (uint32_t c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                corners[c][k] = section->origin[k] + triangles->points[i + c][0] * section->u[k] +
                                triangles->points[i + c][1] * section->v[k];
        int count = clip(section, corners, 3);
        for (int c = 2; c < count; c++) {
            const int fan[3] = {0, c - 1, c};
            for (int k = 0; k < 3; k++) {
                double local[3];
                vec3_sub(corners[fan[k]], cap->world + 12, local);
                state_caps_add_vertex(caps, cap, local, section->outward);
            }
        }
    }
}

static void add_item(const struct section *section, const struct slice *slice,
                     struct state_cap *cap)
{
    struct scene_state *state = section->state;
    const struct state_item *source = &state->items[slice->item];
    struct state_item item = *source;
    cap->source_material = source->material;
    item.material = state->material_count++;
    fill_material(section, source, &state->materials[item.material]);
    item.class_ = source->class_ == STATE_TRANSPARENT ? STATE_TRANSPARENT : STATE_OPAQUE;
    state_caps_add_item(state, cap, item);
}

static bool add_cap(struct section *section, size_t index, struct error *err)
{
    struct scene_state *state = section->state;
    const struct slice *slice = &section->slices[index];
    const struct section_outline **without =
        malloc((section->slice_count + 1) * sizeof(struct section_outline *));
    struct section_outline triangles = {0};
    size_t others = index < section->opaque_count ? index : section->opaque_count, count = 0;
    for (size_t i = 0; without && i < others; i++) {
        const struct slice *other = &section->slices[i];
        if (other->low[0] < slice->high[0] && other->high[0] > slice->low[0] &&
            other->low[1] < slice->high[1] && other->high[1] > slice->low[1])
            without[count++] = &other->outline;
    }
    bool ok = without || error_set(err, ERROR_NO_MEMORY, "caps of a section");
    ok = ok && section_resolve(&slice->outline, without, count, true, &triangles, err) &&
         state_caps_reserve(state, (size_t)triangles.point_count * (POLYGON_CORNERS_MAX - 2), err);
    if (ok) {
        double middle[2] = {0.5 * (slice->low[0] + slice->high[0]),
                            0.5 * (slice->low[1] + slice->high[1])};
        double origin[3];
        for (int k = 0; k < 3; k++)
            origin[k] = section->origin[k] + middle[0] * section->u[k] + middle[1] * section->v[k];
        struct state_cap cap = state_caps_begin(state, origin);
        add_triangles(section, &triangles, &cap);
        if (cap.primitive.vertex_count)
            add_item(section, slice, &cap);
    }
    section_outline_finish(&triangles);
    free(without);
    return ok;
}

static bool cap_plane(struct section *section, struct error *err)
{
    struct scene_state *state = section->state;
    const struct state_item *first = NULL;
    for (size_t i = 0; i < state->whole_count && !first; i++)
        first = is_cut(section, &state->items[i]) ? &state->items[i] : NULL;
    if (!first)
        return true;
    place_plane(section, first);
    section->slices = calloc(state->whole_count + 1, sizeof *section->slices);
    bool ok = section->slices || error_set(err, ERROR_NO_MEMORY, "sections of drawables");
    ok = ok && add_slices(section, false, err);
    section->opaque_count = section->slice_count;
    ok = ok && add_slices(section, true, err);
    for (size_t i = 0; ok && i < section->slice_count; i++)
        ok = add_cap(section, i, err);
    for (size_t i = 0; section->slices && i <= state->whole_count; i++)
        section_outline_finish(&section->slices[i].outline);
    free(section->slices);
    return ok;
}

bool section_add(struct scene_state *state, const struct view *view, struct error *err)
{
    static atomic_uint_least64_t serial;
    state->caps.serial = ++serial;
    for (size_t i = 0; view->cuts && i < view->clip_plane_count; i++) {
        struct section section = {.state = state, .view = view, .plane = i};
        bool has_cap = view->cuts[i].has_cap;
        for (size_t p = 0; p < i && has_cap; p++) /* the first of planes that coincide has it */
            has_cap =
                !view->cuts[p].has_cap || !coincide(view->clip_planes[p], view->clip_planes[i]);
        if (has_cap && !cap_plane(&section, err))
            return false;
    }
    return true;
}

void section_drop(struct scene_state *state)
{
    state_caps_finish(&state->caps);
    state->item_count = state->whole_count;
    state->material_count = state->scene ? state->scene->material_count : 0;
    state->open_section_count = 0;
}
