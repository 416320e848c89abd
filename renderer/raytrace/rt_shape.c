/* SPDX-License-Identifier: MIT */
/* Which meshes are shared, and their Embree scenes. */
#include "renderer/raytrace/rt_shape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"

enum { LEAST_TRIANGLES = 32 /* an instance takes as much memory as so many */ };

#define LONGEST_OVER_SHORTEST 4 /* axes of an instance */
#define LEAST_DETERMINANT 0.5   /* over the product of their lengths: hardly sheared */
#define FARTHEST_VERTEX 4       /* from its mesh's origin, over half the diagonal of the scene */

bool rt_shape_fits(const struct scene_state *state, const struct state_item *item)
{
    if (item->cap || item->deformed)
        return false;
    const double *m = state->world[item->node];
    const struct scene_primitive *p = &state->scene->primitives[item->primitive];
    double lengths[3], diagonal[3], farthest = 0, across[3];
    for (int k = 0; k < 3; k++) {
        lengths[k] = vec3_length(m + 4 * k);
        farthest =
            fmax(farthest, fmax(fabs((double)p->bounds_min[k]), fabs((double)p->bounds_max[k])));
    }
    double longest = fmax(lengths[0], fmax(lengths[1], lengths[2]));
    double shortest = fmin(lengths[0], fmin(lengths[1], lengths[2]));
    vec3_cross(m, m + 4, across);
    vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    return shortest > 1e-18 && longest < 1e18 && longest <= LONGEST_OVER_SHORTEST * shortest &&
           fabs(vec3_dot(across, m + 8)) >=
               LEAST_DETERMINANT * lengths[0] * lengths[1] * lengths[2] &&
           farthest * longest <= FARTHEST_VERTEX * 0.5 * vec3_length(diagonal);
}

/* What items that share have in common. */
struct look {
    const float *positions;
    const uint32_t *indices;
    bool is_opaque; /* else it has a filter */
    uint32_t item;
};

static int compare_looks(const void *a, const void *b)
{
    const struct look *x = a, *y = b;
    if (x->positions != y->positions)
        return x->positions < y->positions ? -1 : 1;
    if (x->indices != y->indices)
        return x->indices < y->indices ? -1 : 1;
    if (x->is_opaque != y->is_opaque)
        return x->is_opaque ? -1 : 1;
    return x->item < y->item ? -1 : x->item > y->item;
}

static bool is_same_shape(const struct look *a, const struct look *b)
{
    return a->positions == b->positions && a->indices == b->indices && a->is_opaque == b->is_opaque;
}

static size_t list_looks(const struct scene_state *state, struct look *looks)
{
    size_t count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        const struct state_geometry from = state_geometry_of(state, item);
        if (item->casts_shadow && from.primitive->index_count / 3 >= LEAST_TRIANGLES &&
            rt_shape_fits(state, item))
            looks[count++] = (struct look){.positions = from.positions +
                                                        3 * (size_t)from.primitive->first_vertex,
                                           .indices = from.indices + from.primitive->first_index,
                                           .is_opaque = item->class_ == STATE_OPAQUE,
                                           .item = (uint32_t)i};
    }
    qsort(looks, count, sizeof *looks, compare_looks);
    return count;
}

static bool is_large(const struct scene_state *state)
{
    uint64_t triangles = 0;
    for (size_t i = 0; i < state->item_count; i++)
        if (state->items[i].casts_shadow)
            triangles += state_geometry_of(state, &state->items[i]).primitive->index_count / 3;
    return triangles > RT_SHARING_TRIANGLES;
}

bool rt_shapes_init(struct rt_shapes *shapes, const struct scene_state *state, struct error *err)
{
    *shapes = (struct rt_shapes){.count = 0};
    if (!is_large(state))
        return true;
    struct look *looks = calloc(state->item_count + 1, sizeof *looks);
    shapes->of_item = calloc(state->item_count + 1, sizeof *shapes->of_item);
    if (!looks || !shapes->of_item) {
        free(looks);
        return error_set(err, ERROR_NO_MEMORY, "ray tracing %zu drawables", state->item_count);
    }
    size_t count = list_looks(state, looks);
    for (size_t first = 0, end; first < count; first = end) {
        for (end = first + 1; end < count && is_same_shape(&looks[first], &looks[end]);)
            end++;
        if (end - first < 2)
            continue;
        shapes->count++;
        for (size_t i = first; i < end; i++)
            shapes->of_item[looks[i].item] = (uint32_t)shapes->count;
    }
    free(looks);
    shapes->scenes = calloc(shapes->count + 1, sizeof(RTCScene));
    return shapes->scenes ||
           error_set(err, ERROR_NO_MEMORY, "ray tracing %zu shapes", shapes->count);
}

void rt_shapes_finish(struct rt_shapes *shapes)
{
    for (size_t i = 0; shapes->scenes && i < shapes->count; i++)
        if (shapes->scenes[i])
            rtcReleaseScene(shapes->scenes[i]);
    free(shapes->scenes);
    free(shapes->of_item);
    *shapes = (struct rt_shapes){.count = 0};
}

RTCScene rt_shape_take(struct rt_shapes *shapes, size_t shape, RTCDevice device,
                       const struct scene_state *state, const struct state_item *item,
                       RTCFilterFunctionN filter)
{
    if (shapes->scenes[shape])
        return shapes->scenes[shape];
    const struct state_geometry from = state_geometry_of(state, item);
    const struct scene_primitive *p = from.primitive;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             12, p->vertex_count);
    void *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            12, p->index_count / 3);
    if (!vertices || !indices) {
        rtcReleaseGeometry(geometry);
        return NULL;
    }
    memcpy(vertices, from.positions + 3 * (size_t)p->first_vertex, (size_t)p->vertex_count * 12);
    memcpy(indices, from.indices + p->first_index, (size_t)p->index_count / 3 * 12);
    if (item->class_ != STATE_OPAQUE) {
        rtcSetGeometryIntersectFilterFunction(geometry, filter);
        rtcSetGeometryOccludedFilterFunction(geometry, filter);
    }
    rtcCommitGeometry(geometry);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | EMBREE_SCENE_FILTERS);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM); /* no spatial splits */
    rtcAttachGeometryByID(scene, geometry, 0);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    shapes->scenes[shape] = scene;
    return scene;
}

void rt_shape_place(RTCGeometry instance, const double world[16], const double origin[3])
{
    float columns[12];
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < 3; k++)
            columns[3 * c + k] = (float)(world[4 * c + k] - (c == 3 ? origin[k] : 0));
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
}
