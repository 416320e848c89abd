/* SPDX-License-Identifier: MIT */
/* Loops to disjoint outlines and triangles, by winding numbers: the tessellator of GLU. */
#include <GL/glu.h>
#include <stdlib.h>

#include "renderer/scene/section.h"

void section_outline_finish(struct section_outline *outline)
{
    free(outline->points);
    free(outline->ends);
    *outline = (struct section_outline){0};
}

bool section_outline_add(struct section_outline *outline, const double point[2])
{
    if (outline->point_count == outline->point_capacity) {
        uint32_t capacity = outline->point_capacity ? 2 * outline->point_capacity : 64;
        void *points = realloc(outline->points, capacity * sizeof *outline->points);
        if (!points)
            return false;
        outline->points = points;
        outline->point_capacity = capacity;
    }
    outline->points[outline->point_count][0] = point[0];
    outline->points[outline->point_count++][1] = point[1];
    return true;
}

bool section_outline_end(struct section_outline *outline)
{
    if (outline->loop_count == outline->loop_capacity) {
        uint32_t capacity = outline->loop_capacity ? 2 * outline->loop_capacity : 16;
        void *ends = realloc(outline->ends, capacity * sizeof *outline->ends);
        if (!ends)
            return false;
        outline->ends = ends;
        outline->loop_capacity = capacity;
    }
    outline->ends[outline->loop_count++] = outline->point_count;
    return true;
}

/* The state that callbacks share. Vertices are indices of `places`. */
struct resolving {
    struct section_outline places; /* of all loops, and where they cross */
    struct section_outline *out;
    bool as_triangles, has_failed;
};

static void *handle_of(uint32_t place)
{
    return (void *)(uintptr_t)place;
}

static void on_begin(GLenum type, void *context)
{
    (void)type;
    (void)context;
}

static void on_vertex(void *handle, void *context)
{
    struct resolving *r = context;
    size_t place = (size_t)(uintptr_t)handle;
    r->has_failed |= !section_outline_add(r->out, r->places.points[place]);
}

static void on_end(void *context)
{
    struct resolving *r = context;
    if (!r->as_triangles)
        r->has_failed |= !section_outline_end(r->out);
}

static void on_edge_flag(GLboolean flag, void *context) /* asks for triangles alone, not strips */
{
    (void)flag;
    (void)context;
}

static void on_combine(GLdouble at[3], void *handles[4], GLfloat weights[4], void **out,
                       void *context)
{
    struct resolving *r = context;
    (void)handles;
    (void)weights;
    r->has_failed |= !section_outline_add(&r->places, at);
    *out = handle_of(r->places.point_count - 1);
}

static void on_error(GLenum code, void *context)
{
    (void)code;
    ((struct resolving *)context)->has_failed = true;
}

/* Adds loops as contours, reversed if they are to be subtracted. */
static void add_contours(GLUtesselator *tess, struct resolving *r,
                         const struct section_outline *outline, bool is_turned)
{
    for (uint32_t loop = 0; loop < outline->loop_count; loop++) {
        uint32_t first = loop ? outline->ends[loop - 1] : 0, count = outline->ends[loop] - first;
        gluTessBeginContour(tess);
        for (uint32_t i = 0; i < count && !r->has_failed; i++) {
            const double *point = outline->points[first + (is_turned ? count - 1 - i : i)];
            double at[3] = {point[0], point[1], 0};
            r->has_failed |= !section_outline_add(&r->places, point);
            if (!r->has_failed)
                gluTessVertex(tess, at, handle_of(r->places.point_count - 1));
        }
        gluTessEndContour(tess);
    }
}

bool section_resolve(const struct section_outline *outline,
                     const struct section_outline *const *without, size_t without_count,
                     bool as_triangles, struct section_outline *resolved, struct error *err)
{
    struct resolving r = {.out = resolved, .as_triangles = as_triangles};
    GLUtesselator *tess = gluNewTess();
    *resolved = (struct section_outline){0};
    if (!tess)
        return error_set(err, ERROR_NO_MEMORY, "the cap of a section");
    gluTessCallback(tess, GLU_TESS_BEGIN_DATA, (void (*)(void))on_begin);
    gluTessCallback(tess, GLU_TESS_VERTEX_DATA, (void (*)(void))on_vertex);
    gluTessCallback(tess, GLU_TESS_END_DATA, (void (*)(void))on_end);
    gluTessCallback(tess, GLU_TESS_COMBINE_DATA, (void (*)(void))on_combine);
    gluTessCallback(tess, GLU_TESS_ERROR_DATA, (void (*)(void))on_error);
    if (as_triangles)
        gluTessCallback(tess, GLU_TESS_EDGE_FLAG_DATA, (void (*)(void))on_edge_flag);
    gluTessProperty(tess, GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_POSITIVE);
    gluTessProperty(tess, GLU_TESS_BOUNDARY_ONLY, as_triangles ? GL_FALSE : GL_TRUE);
    gluTessNormal(tess, 0, 0, 1);
    gluTessBeginPolygon(tess, &r);
    add_contours(tess, &r, outline, false);
    for (size_t i = 0; i < without_count; i++)
        add_contours(tess, &r, without[i], true);
    gluTessEndPolygon(tess);
    gluDeleteTess(tess);
    section_outline_finish(&r.places);
    if (!r.has_failed)
        return true;
    section_outline_finish(resolved);
    return error_set(err, ERROR_NO_MEMORY, "the cap of a section of %u points",
                     outline->point_count);
}
