/* SPDX-License-Identifier: MIT */
/* Triangles in f64 to triangles in f32, relative to the scene's centre. */
#include "renderer/shadows/area_casters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/caster_filter.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

void area_casters_foretell(const struct scene_state *state, bool *has_filters, bool *has_curves)
{
    *has_filters = *has_curves = false;
    for (size_t i = 0; i < state->item_count; i++) {
        bool is_opaque = state->items[i].class_ == STATE_OPAQUE;
        *has_filters |= state->items[i].casts_shadow && !is_opaque;
        *has_curves |= state->items[i].casts_shadow && is_opaque;
    }
}

static uint32_t log_of(double filter)
{
    double log = filter > 0 ? rint(-log2(filter) * AREA_LOG_ONE) : AREA_LOG_MOST;
    return (uint32_t)fmin(fmax(log, 0), AREA_LOG_MOST);
}

static struct area_caster caster_of(const struct scene_state *state, const struct state_item *item,
                                    enum view_blend_filter blend)
{
    struct area_caster caster = {.flags = item->cap ? AREA_CASTER_WHOLE : 0};
    double filter[3];
    caster_filter_of(state, item, blend, filter);
    if (item->class_ != STATE_TRANSPARENT)
        caster.flags |= AREA_CASTER_OPAQUE;
    caster.flags |= (item->node + 1) << AREA_CASTER_NODE;
    caster.log_r = log_of(filter[0]);
    caster.log_g = log_of(filter[1]);
    caster.log_b = log_of(filter[2]);
    return caster;
}

/* pack_unit of shaders/base/pack.glsl. */
static uint32_t pack_unit(const double n[3])
{
    double sum = fmax(fabs(n[0]) + fabs(n[1]) + fabs(n[2]), 1e-30), x = n[0] / sum, y = n[1] / sum;
    if (n[2] < 0) {
        double wrapped = (1 - fabs(y)) * (x >= 0 ? 1 : -1);
        y = (1 - fabs(x)) * (y >= 0 ? 1 : -1);
        x = wrapped;
    }
    return (uint32_t)((int32_t)rint(x * 32767) & 0xffff) |
           (uint32_t)((int32_t)rint(y * 32767) & 0xffff) << 16;
}

/* A normal of the mesh in the world, by the cofactor matrix. False where it has no direction. */
static bool turn_normal(const double m[16], bool is_mirrored, const float *local, double out[3])
{
    const double sign = is_mirrored ? -1 : 1;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = 0;
        for (int c = 0; c < 3; c++) {
            int a = 4 * ((c + 1) % 3), b = 4 * ((c + 2) % 3);
            out[i] += sign * (m[a + j] * m[b + k] - m[b + j] * m[a + k]) * (double)local[c];
        }
    }
    return vec3_normalize(out);
}

struct build { /* of all casters, on the host */
    const struct scene_state *state;
    uint32_t (*corners)[4];
    uint32_t *owners;
    struct area_caster *items;
    uint32_t triangle_count, item_count;
    bool has_filters, has_curves;
    double origin[3];
};

static bool is_same(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* The words of three normals; flat where they are one, or where light from behind is diffused,
 * which would be in its own shadow above the surface. */
static void put_normals(struct build *build, const struct state_item *item,
                        const struct state_geometry *from, const uint32_t vertices[3],
                        uint32_t (*corners)[4])
{
    const float *normals[3];
    double world[3];
    corners[0][3] = AREA_FLAT;
    corners[1][3] = corners[2][3] = 0;
    for (int i = 0; i < 3; i++)
        normals[i] = from->normals + 3 * (size_t)(from->primitive->first_vertex + vertices[i]);
    if (item->class_ != STATE_OPAQUE ||
        build->state->materials[item->material].base.diffuse_transmission > 0 ||
        (is_same(normals[0], normals[1]) && is_same(normals[0], normals[2])))
        return;
    uint32_t words[3];
    for (int i = 0; i < 3; i++) {
        if (!turn_normal(from->world, item->is_mirrored, normals[i], world))
            return;
        words[i] = pack_unit(world);
    }
    for (int i = 0; i < 3; i++)
        corners[i][3] = words[i];
    build->has_curves = true;
}

static void put_item(struct build *build, const struct state_item *item,
                     enum view_blend_filter blend)
{
    const struct state_geometry from = state_geometry_of(build->state, item);
    const struct scene_primitive *p = from.primitive;
    for (uint32_t i = 0; i + 2 < p->index_count; i += 3) {
        uint32_t(*corners)[4] = build->corners + 3 * (size_t)build->triangle_count;
        uint32_t vertices[3];
        for (uint32_t k = 0; k < 3; k++) {
            /* mirrored ones wind the other way: from here on all fronts wind alike */
            uint32_t corner = item->is_mirrored && k ? 3 - k : k;
            double world[3];
            vertices[k] = from.indices[p->first_index + i + corner];
            state_geometry_corner(&from, i + corner, world);
            for (int c = 0; c < 3; c++) {
                float relative = (float)(world[c] - build->origin[c]);
                memcpy(&corners[k][c], &relative, sizeof relative);
            }
        }
        put_normals(build, item, &from, vertices, corners);
        build->owners[build->triangle_count++] = build->item_count;
    }
    build->has_filters |= item->class_ == STATE_TRANSPARENT;
    build->items[build->item_count++] = caster_of(build->state, item, blend);
}

/* The constants of renderer/raytrace/rt_scene.c. */
static void find_constants(struct area_casters *casters, const struct scene_state *state)
{
    const struct state_ground_plane *ground = &state->ground_plane;
    double diagonal[3] = {0};
    memset(casters->origin, 0, sizeof casters->origin);
    if (state->bounds_min[0] <= state->bounds_max[0]) {
        vec3_sub(state->bounds_max, state->bounds_min, diagonal);
        for (int k = 0; k < 3; k++)
            casters->origin[k] = 0.5 * (state->bounds_min[k] + state->bounds_max[k]);
    }
    casters->radius_m = 0.5 * vec3_length(diagonal);
    casters->nudge_m = 1e-6 * casters->radius_m;
    casters->size_m = 8 * casters->radius_m;
    if (ground->is_there) {
        double above = fabs(state->bounds_max[1] - ground->center[1]);
        casters->size_m =
            fmax(casters->size_m, hypot(ground->reach_m, above) + 2 * casters->radius_m);
    }
}

static struct content_key key_of(const struct area_casters_desc *desc, uint64_t *triangles,
                                 uint32_t *items)
{
    const struct scene_state *state = desc->state;
    struct content_key key = content_key_begin();
    content_key_add_text(&key, desc->scene_key);
    content_key_add_word(&key, (uint64_t)desc->blend);
    content_key_add_word(&key, state->caps.serial);
    content_key_add(&key, state->bounds_min, sizeof state->bounds_min);
    content_key_add(&key, state->bounds_max, sizeof state->bounds_max);
    *triangles = *items = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        if (!item->casts_shadow)
            continue;
        content_key_add_word(&key, item->shadow_hash);
        content_key_add_word(&key, (uint64_t)item->node << 32 | item->primitive);
        content_key_add_word(&key, (uint64_t)item->class_);
        content_key_add_word(&key, state->materials[item->material].base.diffuse_transmission > 0);
        if (item->deformed)
            content_key_add(&key, &state->deforms.items[item->deformed - 1].pose,
                            sizeof(struct content_key));
        *triangles += state_geometry_of(state, item).primitive->index_count / 3;
        ++*items;
    }
    return key;
}

static bool upload(struct area_casters *casters, const struct build *build, struct error *err)
{
    const struct {
        struct gl_buffer *buffer;
        const char *label;
        const void *data;
        uint64_t bytes;
    } parts[] = {
        {&casters->corners, "shadow.area.corners", build->corners,
         build->triangle_count * 3 * sizeof *build->corners},
        {&casters->owners, "shadow.area.owners", build->owners,
         build->triangle_count * sizeof *build->owners},
        {&casters->items, "shadow.area.casters", build->items,
         build->item_count * sizeof *build->items},
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (!gl_buffer_reserve(parts[i].buffer,
                               &(struct gl_buffer_desc){.label = parts[i].label,
                                                        .size_bytes = parts[i].bytes,
                                                        .is_uploaded = true},
                               false, err))
            return false;
        if (parts[i].bytes)
            gl_buffer_write(parts[i].buffer, 0, parts[i].bytes, parts[i].data);
    }
    return true;
}

bool area_casters_prepare(struct area_casters *casters, const struct area_casters_desc *desc,
                          struct error *err)
{
    uint64_t triangles;
    uint32_t items;
    const struct scene_state *state = desc->state;
    struct content_key key = key_of(desc, &triangles, &items);
    find_constants(casters, state);
    casters->is_reused = content_key_equals(key, casters->key);
    if (casters->is_reused)
        return true;
    if (triangles > gl_limits_whole_block(desc->limits, 3 * sizeof(uint32_t[4])))
        return error_set(
            err, ERROR_OVER_BUDGET,
            "shadows area: %llu triangles cast shadows, the device holds %llu",
            (unsigned long long)triangles,
            (unsigned long long)gl_limits_whole_block(desc->limits, 3 * sizeof(uint32_t[4])));
    struct build build = {.state = state,
                          .corners = malloc((triangles * 3 + 1) * sizeof *build.corners),
                          .owners = malloc((triangles + 1) * sizeof *build.owners),
                          .items = malloc((items + (size_t)1) * sizeof *build.items)};
    memcpy(build.origin, casters->origin, sizeof build.origin);
    casters->key = (struct content_key){{0}};
    bool ok = build.corners && build.owners && build.items;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%llu triangles that cast shadows",
                  (unsigned long long)triangles);
    for (size_t i = 0; ok && i < state->item_count; i++)
        if (state->items[i].casts_shadow)
            put_item(&build, &state->items[i], desc->blend);
    ok = ok && upload(casters, &build, err);
    if (ok) {
        casters->key = key;
        casters->triangle_count = build.triangle_count;
        casters->item_count = build.item_count;
        casters->has_filters = build.has_filters;
        casters->has_curves = build.has_curves;
    }
    free(build.corners);
    free(build.owners);
    free(build.items);
    return ok;
}

uint64_t area_casters_size_bytes(const struct area_casters *casters)
{
    return casters->corners.size_bytes + casters->owners.size_bytes + casters->items.size_bytes;
}

void area_casters_finish(struct area_casters *casters)
{
    gl_buffer_finish(&casters->corners);
    gl_buffer_finish(&casters->owners);
    gl_buffer_finish(&casters->items);
    *casters = (struct area_casters){.key = {{0}}};
}
