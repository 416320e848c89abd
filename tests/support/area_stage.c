/* SPDX-License-Identifier: MIT */
/* Stages of triangles and points on the device. */
#include "tests/support/area_stage.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/shadows/caster_filter.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static void must(bool ok, const struct error *err)
{
    if (!ok)
        fail_msg("%s", err->message);
}

static void make(struct gl_buffer *buffer, const char *label, uint64_t bytes, const void *data)
{
    struct error err = {0};
    must(gl_buffer_init(buffer,
                        &(struct gl_buffer_desc){
                            .label = label, .size_bytes = bytes, .data = data, .is_dynamic = true},
                        &err),
         &err);
}

static uint32_t float_bits(double value)
{
    float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

/* One caster for each triangle. Positions become what the device has. */
static void put_casters(struct area_stage *stage, struct area_casters *casters)
{
    uint32_t count = stage->triangle_count;
    uint32_t(*corners)[4] = calloc(3 * (size_t)count + 1, sizeof *corners);
    uint32_t *owners = calloc(count + (size_t)1, sizeof *owners);
    struct area_caster *items = calloc(count + (size_t)1, sizeof *items);
    assert_true(corners && owners && items);
    for (uint32_t i = 0; i < count; i++) {
        struct area_triangle *t = &stage->triangles[i];
        owners[i] = i;
        items[i].flags = (t->filter > 0 ? 0 : AREA_CASTER_OPAQUE) | (i + 1) << AREA_CASTER_NODE;
        items[i].log_r = items[i].log_g = items[i].log_b =
            t->filter > 0 ? (uint32_t)rint(-log2(t->filter) * AREA_LOG_ONE) : AREA_LOG_MOST;
        casters->has_filters |= t->filter > 0;
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++) {
                t->at[k][c] = (double)(float)t->at[k][c];
                corners[3 * i + (uint32_t)k][c] = float_bits(t->at[k][c]);
            }
        corners[3 * i][3] = AREA_FLAT;
    }
    make(&casters->corners, "corners", 48ull * count, corners);
    make(&casters->owners, "owners", 4ull * count, owners);
    make(&casters->items, "items", sizeof *items * (uint64_t)count, items);
    casters->triangle_count = casters->item_count = count;
    casters->radius_m = 4;
    casters->nudge_m = 1e-6;
    casters->size_m = 50;
    free(corners);
    free(owners);
    free(items);
}

/* As frames have them; the triangles become the stage's. */
static void prepare_casters(const struct shadow_rig *rig, struct area_stage *stage,
                            struct area_casters *casters)
{
    const struct scene_state *state = stage->state;
    const struct area_casters_desc desc = {
        .state = state, .scene_key = "stage", .limits = gl_context_limits(rig->context)};
    struct error err = {0};
    must(area_casters_prepare(casters, &desc, &err), &err);
    stage->triangle_count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        const struct state_geometry from = state_geometry_of(state, item);
        double filter[3];
        caster_filter_of(state, item, desc.blend, filter);
        for (uint32_t k = 0; item->casts_shadow && k + 2 < from.primitive->index_count; k += 3) {
            struct area_triangle *t =
                area_stage_add(stage, item->class_ == STATE_TRANSPARENT ? filter[0] : 0);
            for (uint32_t corner = 0; corner < 3; corner++)
                state_geometry_corner(&from, k + corner, t->at[corner]);
        }
    }
}

static void put_points(struct area_stage *stage, const double origin[3], struct area_grid *grid,
                       struct gl_buffer *points, struct gl_buffer *table)
{
    uint32_t count = stage->point_count;
    struct shadow_point *p = calloc(count, sizeof *p);
    struct area_start *starts = calloc(count, sizeof *starts);
    uint32_t(*rows)[2] = calloc(count, sizeof *rows);
    assert_true(p && starts && rows);
    for (uint32_t i = 0; i < count; i++) {
        p[i].pixel_roughness = i;
        p[i].flags = SHADOW_POINT_TRANSMITS; /* light from everywhere counts */
        rows[i][0] = i * stage->samples;
        starts[i].normal_y = 1;
        starts[i].skip = AREA_NOWHERE;
        starts[i].origin_offset.v[3] = 1e-5f;
        for (int k = 0; k < 3; k++) {
            float relative = (float)(stage->points[i][k] - origin[k]);
            starts[i].origin_offset.v[k] = relative;
            stage->points[i][k] = origin[k] + (double)relative;
        }
    }
    make(points, "points", sizeof *p * count, p);
    make(table, "table", 8ull * count, rows);
    make(&grid->starts, "starts", sizeof *starts * count, starts);
    free(p);
    free(starts);
    free(rows);
}

static void *read_all(const struct gl_buffer *buffer)
{
    void *bytes = calloc(1, buffer->size_bytes);
    assert_non_null(bytes);
    gl_buffer_read(buffer, 0, buffer->size_bytes, bytes);
    return bytes;
}

bool area_stage_ask(const struct shadow_rig *rig, struct area_stage *stage,
                    struct area_answer *answer, struct error *err)
{
    struct area_grid grid = {.pairs_max = stage->pairs_max};
    struct area_casters casters = {.triangle_count = 0};
    struct scene_state state = {.light_count = 1};
    struct camera camera = {
        .right = {1, 0, 0}, .up = {0, 1, 0}, .back = {0, 0, 1}, .half_height = 1};
    struct gl_buffer points = {0}, table = {0}, filters = {0};
    if (stage->state)
        prepare_casters(rig, stage, &casters);
    else
        put_casters(stage, &casters);
    put_points(stage, casters.origin, &grid, &points, &table);
    make(&filters, "filters", 8ull * stage->point_count * stage->samples, NULL);
    const struct area_grid_desc desc = {
        .programs = rig->programs,
        .limits = gl_context_limits(rig->context),
        .casters = &casters,
        .state = &state,
        .camera = &camera,
        .image_height_px = 100,
        .points = {.points = &points,
                   .count = stage->point_count,
                   .width = AREA_STAGE_WIDTH,
                   .image_x = AREA_STAGE_COLUMN,
                   .image_y_bottom = AREA_STAGE_BOTTOM},
        .table = &table,
        .filters = &filters,
        .loop_steps = stage->loop_steps,
        .is_faithful = stage->is_faithful,
    };
    const struct area_light light = area_light_of(&stage->light, 0, stage->samples, &casters);
    bool ok = area_grid_find(&grid, &desc, &light, err);
    if (ok)
        *answer = (struct area_answer){.filters = read_all(&filters),
                                       .places = read_all(&grid.places),
                                       .firsts = read_all(&grid.firsts),
                                       .pairs = read_all(&grid.pairs),
                                       .cells = read_all(&grid.cells),
                                       .light = light,
                                       .counts = grid.counts_of_frame};
    gl_buffer_finish(&points);
    gl_buffer_finish(&table);
    gl_buffer_finish(&filters);
    area_casters_finish(&casters);
    area_grid_finish(&grid);
    return ok;
}

struct area_answer area_stage_must_ask(const struct shadow_rig *rig, struct area_stage *stage)
{
    struct error err = {0};
    struct area_answer answer = {.filters = NULL};
    must(area_stage_ask(rig, stage, &answer, &err), &err);
    return answer;
}

void area_answer_finish(struct area_answer *answer)
{
    free(answer->filters);
    free(answer->places);
    free(answer->firsts);
    free(answer->pairs);
    free(answer->cells);
    *answer = (struct area_answer){.filters = NULL};
}

void area_stage_finish(struct area_stage *stage)
{
    free(stage->triangles);
    free(stage->points);
    *stage = (struct area_stage){.triangles = NULL};
}

double area_answer_channel(const uint32_t words[2], int channel)
{
    uint64_t both = (uint64_t)words[1] << 32 | words[0];
    uint64_t mantissa = both >> (channel * TRACED_FILTER_BITS) & ((1u << TRACED_FILTER_BITS) - 1);
    return ldexp((double)mantissa,
                 1 - TRACED_FILTER_BITS - (int)(both >> (3 * TRACED_FILTER_BITS)));
}

double area_answer_filter(const uint32_t words[2])
{
    return area_answer_channel(words, 0);
}

/* ---- the definition ---- */

enum area_meeting area_triangle_meet(const struct area_triangle *t, const double from[3],
                                     const double to[3])
{
    const double hair = 2e-5;
    double way[3], e1[3], e2[3], s[3], across[3], q[3], normal[3];
    vec3_sub(to, from, way);
    vec3_sub(t->at[1], t->at[0], e1);
    vec3_sub(t->at[2], t->at[0], e2);
    vec3_sub(from, t->at[0], s);
    vec3_cross(way, e2, across);
    vec3_cross(e1, e2, normal);
    double det = vec3_dot(e1, across), size = vec3_length(normal) * vec3_length(way);
    if (!(size > 0))
        return AREA_MEETS_NOT;
    vec3_cross(s, e1, q);
    double u = vec3_dot(s, across) / det, v = vec3_dot(way, q) / det, w = vec3_dot(e2, q) / det;
    double longest = fmax(vec3_length(e1), vec3_length(e2));
    double slim = 1e-5 * longest * (longest + vec3_length(s)) / vec3_length(normal);
    double inside = fmin(fmin(u, v), 1 - u - v), before = fmin(w - 2e-5, 1 - w);
    double edge = (hair + slim) / fmin(1, fabs(det) / size + 1e-12);
    if (inside < -edge || before < -1e-3)
        return AREA_MEETS_NOT;
    return inside > edge && before > 1e-3 ? AREA_MEETS : AREA_MEETING_HANGS;
}

void area_stage_sample(const struct area_stage *stage, uint32_t point, uint32_t index, double at[3])
{
    double unit[2];
    memcpy(at, stage->light.position, 3 * sizeof *at);
    if (stage->samples == 1)
        return;
    int x = AREA_STAGE_COLUMN + (int)(point % AREA_STAGE_WIDTH);
    int y = AREA_STAGE_BOTTOM - (int)(point / AREA_STAGE_WIDTH);
    if (stage->is_faithful) /* the same at all pixels */
        x = y = 0;
    rt_sequence_point(index, rt_job_seed(x, y, 0), unit);
    rt_light_place(&stage->light, unit, at);
}

void area_stage_aim(const struct area_stage *stage, const double point[3], double at[3])
{
    if (stage->light.type != SCENE_LIGHT_DIRECTIONAL)
        return;
    for (int k = 0; k < 3; k++)
        at[k] = point[k] - 49 * stage->light.direction[k];
}

bool area_stage_is_before_light(const struct area_stage *stage, const double point[3])
{
    double way[3];
    vec3_sub(point, stage->light.position, way);
    return !state_light_is_area(&stage->light) || vec3_dot(way, stage->light.direction) > 1e-5;
}

struct state_light area_stage_light(enum scene_light_type type, double height, double size)
{
    struct state_light light = {.type = type, .position = {0.1, height, -0.2}};
    double turned[3] = {0.2, -1, 0.1}, u[3], v[3];
    vec3_normalize(turned);
    memcpy(light.direction, turned, sizeof turned);
    vec3_cross(turned, (const double[3]){0.3, 0.2, 1}, u);
    vec3_normalize(u);
    vec3_cross(turned, u, v);
    for (int k = 0; k < 3; k++) {
        light.half_u[k] = size * u[k];
        light.half_v[k] = (type == SCENE_LIGHT_DISK ? 1 : 0.6) * size * v[k];
    }
    light.area_m2 = size * size;
    return light;
}

struct area_triangle *area_stage_add(struct area_stage *stage, double filter)
{
    stage->triangles = realloc(stage->triangles,
                               (stage->triangle_count + (size_t)1) * sizeof(struct area_triangle));
    assert_non_null(stage->triangles);
    struct area_triangle *t = &stage->triangles[stage->triangle_count++];
    *t = (struct area_triangle){.filter = filter};
    return t;
}

double area_answer_mean(const struct area_stage *stage, const struct area_answer *answer,
                        uint32_t point)
{
    double sum = 0;
    for (uint32_t s = 0; s < stage->samples; s++)
        sum += area_answer_filter(answer->filters[point * stage->samples + s]);
    return sum / stage->samples;
}

void area_stage_scatter(struct area_stage *stage, uint32_t count, double reach, uint64_t seed)
{
    stage->points = calloc(count, sizeof *stage->points);
    assert_non_null(stage->points);
    stage->point_count = count;
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            stage->points[i][c] = reach * (2 * rig_random(&seed) - 1);
}
