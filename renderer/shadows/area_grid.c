/* SPDX-License-Identifier: MIT */
/* The passes of one grid after the other. */
#include "renderer/shadows/area_grid.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/area_table.h"
#include "renderer/window/window.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    DEFINES_BYTES = 96,
    CELLS_MAX = AREA_FACES * AREA_FACE_SIDE * AREA_FACE_SIDE,
    SLOTS_MAX = AREA_FACES * 2 * AREA_SLOTS,
    BIN_PASSES = 3,           /* of area_bin.comp.glsl */
    LOOP_STEPS_BESIDES = 512, /* that a walk of a cell takes, whatever is in it */
};
_Static_assert(CELLS_MAX >= AREA_SIDE * AREA_SIDE, "cells of any grid");
_Static_assert(SLOTS_MAX >= CELLS_MAX, "counts of both");

static uint32_t cells_of(uint32_t kind)
{
    return kind == AREA_POINT ? CELLS_MAX : AREA_SIDE * AREA_SIDE;
}

/* ---- lights ---- */

static void find_area(const struct state_light *source, struct area_light *light)
{
    double(*axes)[3] = light->axes;
    memcpy(axes[2], source->direction, sizeof axes[2]);
    memcpy(axes[0], source->half_u, sizeof axes[0]);
    vec3_normalize(axes[0]);
    vec3_cross(axes[2], axes[0], axes[1]);
    vec3_normalize(axes[1]);
    for (int i = 0; i < 2; i++)
        light->half[i] =
            fabs(vec3_dot(axes[i], source->half_u)) + fabs(vec3_dot(axes[i], source->half_v));
    memcpy(light->half_u, source->half_u, sizeof light->half_u);
    memcpy(light->half_v, source->half_v, sizeof light->half_v);
    light->is_disk = source->type == SCENE_LIGHT_DISK;
    light->is_one_sided = true;
    light->behind_m = 4 * hypot(light->half[0], light->half[1]); /* two diagonals */
    light->kind = light->behind_m > 0 && isfinite(light->behind_m) ? AREA_RECTANGLE : AREA_POINT;
}

struct area_light area_light_of(const struct state_light *source, uint32_t index, uint32_t samples,
                                const struct area_casters *casters)
{
    struct area_light light = {.index = index,
                               .samples = samples,
                               .kind = AREA_POINT,
                               .axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if (source->type == SCENE_LIGHT_DIRECTIONAL) {
        light.kind = AREA_PARALLEL;
        memcpy(light.axes[2], source->direction, sizeof light.axes[2]);
        int least = 0;
        for (int k = 1; k < 3; k++)
            if (fabs(source->direction[k]) < fabs(source->direction[least]))
                least = k;
        double across[3] = {0};
        across[least] = 1;
        vec3_cross(across, light.axes[2], light.axes[0]);
        vec3_normalize(light.axes[0]);
        vec3_cross(light.axes[2], light.axes[0], light.axes[1]);
        return light;
    }
    vec3_sub(source->position, casters->origin, light.center);
    if (state_light_is_area(source))
        find_area(source, &light);
    return light;
}

/* The eye as a light that reaches every point: it asks for the triangles that they lie on. */
static struct area_light eye_of(const struct area_grid_desc *desc)
{
    const struct camera *camera = desc->camera;
    struct area_light eye = {.kind = camera->is_orthographic ? AREA_PARALLEL : AREA_POINT};
    vec3_sub(camera->eye, desc->casters->origin, eye.center);
    for (int k = 0; k < 3; k++) {
        eye.axes[0][k] = camera->right[k];
        eye.axes[1][k] = camera->up[k];
        eye.axes[2][k] = -camera->back[k];
    }
    return eye;
}

/* ---- programs ---- */

static void describe(struct program_desc *desc, const char *file, char defines[DEFINES_BYTES],
                     const char *format, ...) __attribute__((format(printf, 4, 5)));
static void describe(struct program_desc *desc, const char *file, char defines[DEFINES_BYTES],
                     const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(defines, DEFINES_BYTES, format, arguments);
    va_end(arguments);
    *desc = (struct program_desc){.label = file, .compute = file, .defines = defines};
}

static const char *const lists_define = "LIGHT_LIST=1";

static void describe_bin(struct program_desc *desc, char defines[DEFINES_BYTES], int pass,
                         uint32_t kind, bool has_lists)
{
    describe(desc, "area_bin.comp.glsl", defines, "PASS=%d AREA_KIND=%u%s%s", pass, kind,
             has_lists ? " " : "", has_lists ? lists_define : "");
}

static void describe_slots(struct program_desc *desc, char defines[DEFINES_BYTES], uint32_t kind)
{
    describe(desc, "area_slots.comp.glsl", defines, "AREA_KIND=%u", kind);
}

static void describe_assign(struct program_desc *desc, char defines[DEFINES_BYTES], int pass,
                            uint32_t kind)
{
    describe(desc, "area_assign.comp.glsl", defines, "PASS=%d AREA_KIND=%u", pass, kind);
}

struct find_variant {
    uint32_t kind, samples;
    bool has_filters, has_planes, is_software;
};

/* Sixteen samples do not fit into the registers of graphics hardware; our own processors read each
 * triangle of a cell a quarter as often with them. */
static uint32_t groups_of(const struct find_variant *variant)
{
    return variant->is_software && variant->samples > 4 ? 4 : 1;
}

static void describe_find(struct program_desc *desc, char defines[DEFINES_BYTES],
                          const struct find_variant *variant)
{
    describe(desc, "area_find.comp.glsl", defines, "GROUPS=%u%s%s%s%s", groups_of(variant),
             variant->has_filters ? " HAS_FILTERS" : "", variant->has_planes ? " HAS_PLANES" : "",
             variant->kind == AREA_PARALLEL ? " IS_PARALLEL" : "",
             variant->samples > 1 ? " HAS_AREA_SAMPLES" : "");
}

/* Of area_find.comp.glsl's variants, the one that tables do as well. */
static bool has_table(const struct find_variant *variant)
{
    return variant->kind == AREA_RECTANGLE && variant->samples > 1 && !variant->has_filters &&
           !variant->has_planes && area_table_vectors(variant->samples);
}

static void describe_mask(struct program_desc *desc, char defines[DEFINES_BYTES], uint32_t samples)
{
    describe(desc, "area_mask.comp.glsl", defines, "VECTORS=%u", area_table_vectors(samples));
}

static const struct gl_program *use(const struct area_grid_desc *desc,
                                    const struct program_desc *program, struct error *err)
{
    const struct gl_program *used = program_cache_get(desc->programs, program, err);
    if (used)
        gl_program_use(used);
    return used;
}

static void list_kind(const struct area_listing *listing, uint32_t kind, bool is_eye,
                      const char *pass, struct program_list *list)
{
    struct program_desc desc;
    char defines[DEFINES_BYTES];
    for (int i = 0; i < BIN_PASSES; i++) {
        describe_bin(&desc, defines, i, kind, !is_eye);
        program_list_add(list, pass, &desc, true);
    }
    describe_slots(&desc, defines, kind);
    program_list_add(list, pass, &desc, true);
    for (int i = 0; i < 2; i++) {
        describe_assign(&desc, defines, i, kind);
        program_list_add(list, pass, &desc, true);
    }
    if (is_eye)
        return;
    const struct find_variant variant = {.kind = kind,
                                         .samples = kind == AREA_RECTANGLE ? listing->samples : 1,
                                         .has_filters = listing->has_filters,
                                         .has_planes = listing->has_planes,
                                         .is_software = listing->is_software};
    if (listing->is_faithful && has_table(&variant))
        describe_mask(&desc, defines, variant.samples);
    else
        describe_find(&desc, defines, &variant);
    program_list_add(list, pass, &desc, true);
}

/* Which of them a frame needs depends on what its lights reach, which only drawing tells. */
void area_grid_list_programs(const struct area_listing *listing, const char *pass,
                             struct program_list *list)
{
    struct program_desc desc;
    char defines[DEFINES_BYTES];
    describe(&desc, "area_starts.comp.glsl", defines, "%s%s", lists_define,
             listing->is_orthographic ? " IS_ORTHOGRAPHIC" : "");
    program_list_add(list, pass, &desc, true);
    describe(&desc, "area_scan.comp.glsl", defines, "%s", "");
    desc.defines = NULL;
    program_list_add(list, pass, &desc, true);
    if (listing->has_curves) {
        list_kind(listing, listing->is_orthographic ? AREA_PARALLEL : AREA_POINT, true, pass, list);
        describe(&desc, "area_leave.comp.glsl", defines, "%s", "");
        desc.defines = NULL;
        program_list_add(list, pass, &desc, true);
    }
    for (uint32_t kind = 0; kind < 3; kind++)
        if (listing->has_kind[kind])
            list_kind(listing, kind, false, pass, list);
}

/* ---- uniforms and buffers ---- */

static void set_vector(const struct gl_program *program, const char *name, const double v[3])
{
    const float f[3] = {(float)v[0], (float)v[1], (float)v[2]};
    gl_program_set_f3(program, name, f);
}

static void set_camera(const struct gl_program *program, const struct area_grid_desc *desc)
{
    const struct camera *camera = desc->camera;
    double eye[3];
    vec3_sub(camera->eye, desc->casters->origin, eye);
    set_vector(program, "u_right", camera->right);
    set_vector(program, "u_up", camera->up);
    set_vector(program, "u_back", camera->back);
    set_vector(program, "u_eye", eye);
    gl_program_set_f(program, "u_pixel", (float)(2 * camera->half_height / desc->image_height_px));
    gl_program_set_f(program, "u_nudge_m", (float)desc->casters->nudge_m);
    gl_program_set_f(program, "u_is_orthographic", camera->is_orthographic ? 1 : 0);
    gl_program_set_u(program, "u_points", desc->points.count);
    gl_program_set_u(program, "u_width", desc->points.width);
}

/* What rounding may take of the places of the light's points. */
static double error_of(const struct area_grid_desc *desc, const struct area_light *light)
{
    const double ulps = 1.5e-7; /* of a sum in f32 */
    double largest = 0;
    for (int k = 0; k < 3; k++)
        largest = fmax(largest, fabs(light->center[k]));
    if (light->kind == AREA_RECTANGLE)
        return ulps * (largest + light->half[0] + light->half[1]);
    return light->kind == AREA_PARALLEL ? 1e-6 * desc->casters->radius_m + ulps * largest : 0;
}

static void set_light(const struct gl_program *program, const struct area_grid_desc *desc,
                      const struct area_light *light)
{
    const float half[2] = {(float)light->half[0], (float)light->half[1]};
    set_vector(program, "u_center", light->center);
    set_vector(program, "u_axis_x", light->axes[0]);
    set_vector(program, "u_axis_y", light->axes[1]);
    set_vector(program, "u_axis_z", light->axes[2]);
    gl_program_set_f2(program, "u_half", half);
    gl_program_set_f(program, "u_behind", (float)light->behind_m);
    gl_program_set_f(program, "u_error", (float)error_of(desc, light));
    gl_program_set_u(program, "u_light", light->index);
    gl_program_set_u(program, "u_points", desc->points.count);
    gl_program_set_u(program, "u_triangles", desc->casters->triangle_count);
    gl_program_set_u2(program, "u_light_chunk", desc->first, desc->count);
}

static void wait_for_writes(void)
{
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

static bool reserve(struct gl_buffer *buffer, const char *label, uint64_t bytes, struct error *err)
{
    return gl_buffer_reserve(
        buffer, &(struct gl_buffer_desc){.label = label, .size_bytes = bytes, .is_dynamic = true},
        false, err);
}

static bool reserve_all(struct area_grid *grid, const struct area_grid_desc *desc,
                        struct error *err)
{
    const uint64_t points = desc->points.count;
    return reserve(&grid->cells, "shadow.area.cells", (AREA_HEAD_WORDS + CELLS_MAX) * 4ull, err) &&
           reserve(&grid->counts, "shadow.area.counts", SLOTS_MAX * 4ull, err) &&
           reserve(&grid->firsts, "shadow.area.firsts", (CELLS_MAX + 1) * 4ull, err) &&
           reserve(&grid->starts, "shadow.area.starts", points * sizeof(struct area_start), err) &&
           reserve(&grid->places, "shadow.area.places", points * 8, err) &&
           reserve(&grid->pairs, "shadow.area.pairs", 4096, err) &&
           reserve(&grid->statistics, "shadow.area.statistics", sizeof(struct area_statistics),
                   err);
}

static void bind(const struct area_grid *grid, const struct area_grid_desc *desc)
{
    gl_buffer_bind_storage(&desc->casters->corners, BIND_AREA_CORNERS);
    gl_buffer_bind_storage(&desc->casters->owners, BIND_AREA_OWNERS);
    gl_buffer_bind_storage(&desc->casters->items, BIND_AREA_CASTERS);
    gl_buffer_bind_storage(&grid->cells, BIND_AREA_CELLS);
    gl_buffer_bind_storage(&grid->counts, BIND_AREA_COUNTS);
    gl_buffer_bind_storage(&grid->firsts, BIND_AREA_FIRSTS);
    gl_buffer_bind_storage(&grid->starts, BIND_AREA_STARTS);
    gl_buffer_bind_storage(&grid->places, BIND_AREA_PLACES);
    gl_buffer_bind_storage(&grid->pairs, BIND_AREA_PAIRS);
    gl_buffer_bind_storage(desc->table, BIND_AREA_TABLE);
    if (desc->filters)
        gl_buffer_bind_storage(desc->filters, BIND_AREA_FILTERS);
    if (grid->light_filters.name)
        gl_buffer_bind_storage(&grid->light_filters, BIND_AREA_LIGHTS);
    gl_buffer_bind_storage(desc->points.points, BIND_TRACED_POINTS);
    gl_buffer_bind_storage(&grid->statistics, BIND_STATISTICS);
}

/* ---- a grid ---- */

/* Which cell each slot belongs to, once points are counted. */
static bool divide(const struct area_grid_desc *desc, const struct area_light *light,
                   struct error *err)
{
    struct program_desc text;
    char defines[DEFINES_BYTES];
    describe_slots(&text, defines, light->kind);
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    glDispatchCompute(light->kind == AREA_POINT ? 2 * AREA_FACES : 2, 1, 1);
    wait_for_writes();
    return true;
}

static bool bin(const struct area_grid_desc *desc, const struct area_light *light, bool has_lists,
                double asides, struct error *err)
{
    struct program_desc text;
    char defines[DEFINES_BYTES];
    for (int pass = 0; pass < BIN_PASSES; pass++) {
        if (pass == BIN_PASSES - 1 && !divide(desc, light, err))
            return false;
        describe_bin(&text, defines, pass, light->kind, has_lists);
        const struct gl_program *program = use(desc, &text, err);
        if (!program)
            return false;
        set_light(program, desc, light);
        gl_program_set_f(program, "u_asides", (float)asides);
        if (has_lists)
            light_lists_bind(desc->lists, program);
        window_dispatch_items(desc->points.count);
        wait_for_writes();
    }
    return true;
}

static bool assign(const struct area_grid_desc *desc, const struct area_light *light, int pass,
                   const uint32_t cells[2], struct error *err)
{
    struct program_desc text;
    char defines[DEFINES_BYTES];
    describe_assign(&text, defines, pass, light->kind);
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    set_light(program, desc, light);
    gl_program_set_u2(program, "u_cells", cells[0], cells[1]);
    window_dispatch_items(desc->casters->triangle_count);
    wait_for_writes();
    return true;
}

static bool scan(const struct area_grid *grid, const struct area_grid_desc *desc, uint32_t cells,
                 struct area_statistics *statistics, struct error *err)
{
    const struct program_desc text = {.label = "area_scan.comp.glsl",
                                      .compute = "area_scan.comp.glsl"};
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    gl_program_set_u(program, "u_count", cells);
    glDispatchCompute(1, 1, 1);
    wait_for_writes();
    gl_buffer_read(&grid->statistics, 0, sizeof *statistics, statistics);
    return true;
}

/* What the pairs of a grid are found for: its points ask them. */
struct asking {
    bool (*run)(struct area_grid *grid, const struct area_grid_desc *desc,
                const struct area_light *light, const uint32_t cells[2], struct error *err);
    bool has_lists;
    double asides; /* rays begin so many offsets aside of their points */
};

static bool fill_and_ask(struct area_grid *grid, const struct area_grid_desc *desc,
                         const struct area_light *light, const struct asking *asking,
                         const uint32_t cells[2], uint64_t pairs, struct error *err)
{
    if (!reserve(&grid->pairs, "shadow.area.pairs", pairs * 4, err))
        return false;
    gl_buffer_bind_storage(&grid->pairs, BIND_AREA_PAIRS);
    grid->counts_of_frame.parts++;
    return (!pairs || assign(desc, light, 1, cells, err)) &&
           asking->run(grid, desc, light, cells, err);
}

/* Rows of cells whose pairs have room, one after the other. */
static bool ask_in_parts(struct area_grid *grid, const struct area_grid_desc *desc,
                         const struct area_light *light, const struct asking *asking,
                         uint32_t cell_count, uint64_t room, struct error *err)
{
    uint32_t *firsts = malloc((cell_count + (size_t)1) * sizeof *firsts);
    if (!firsts)
        return error_set(err, ERROR_NO_MEMORY, "%u cells of a light's grid", cell_count);
    gl_buffer_read(&grid->firsts, 0, (cell_count + (uint64_t)1) * 4, firsts);
    bool ok = true;
    for (uint32_t begin = 0, end; ok && begin < cell_count; begin = end) {
        uint64_t pairs = 0;
        for (end = begin; end < cell_count; end++) {
            uint32_t count = firsts[end + 1] - firsts[end];
            if (end > begin && pairs + count > room)
                break;
            pairs += count;
        }
        const uint32_t cells[2] = {begin, end - begin};
        ok = fill_and_ask(grid, desc, light, asking, cells, pairs, err);
    }
    free(firsts);
    return ok;
}

static bool check_longest(const struct area_grid_desc *desc, uint32_t longest, uint64_t room,
                          struct error *err)
{
    if (longest > room)
        return error_set(err, ERROR_OVER_BUDGET,
                         "shadows area: %u triangles may block the light of one place, limit is "
                         "%llu; raytraced-shadows has none",
                         longest, (unsigned long long)room);
    if (desc->loop_steps && (uint64_t)longest + LOOP_STEPS_BESIDES > desc->loop_steps)
        return error_set(
            err, ERROR_OVER_BUDGET,
            "shadows area: %u triangles may block the light of one place, and loops of "
            "the device end after %u steps; raytraced-shadows has none",
            longest, desc->loop_steps);
    return true;
}

static uint64_t most_pairs(const struct area_grid *grid, const struct area_grid_desc *desc)
{
    uint64_t most = gl_limits_block(desc->limits, 4);
    uint64_t wanted = grid->pairs_max ? grid->pairs_max : AREA_PAIRS_MAX;
    return most < wanted ? most : wanted;
}

/* Points and triangles to cells, and the points of all cells ask. */
static bool run_grid(struct area_grid *grid, const struct area_grid_desc *desc,
                     const struct area_light *light, const struct asking *asking, struct error *err)
{
    const uint32_t cell_count = cells_of(light->kind), all[2] = {0, cell_count};
    const uint64_t room = most_pairs(grid, desc);
    struct area_statistics statistics = {.longest = 0};
    bind(grid, desc);
    gl_buffer_clear_u32(&grid->cells, 0, (AREA_HEAD_WORDS + (uint64_t)cell_count) * 4, UINT32_MAX);
    gl_buffer_clear_u32(&grid->counts, 0, SLOTS_MAX * 4ull, 0);
    if (!bin(desc, light, asking->has_lists, asking->asides, err) ||
        !assign(desc, light, 0, all, err) || !scan(grid, desc, cell_count, &statistics, err) ||
        !check_longest(desc, statistics.longest, room, err))
        return false;
    uint64_t pairs = statistics.pairs[0] | (uint64_t)statistics.pairs[1] << 32;
    struct area_counts *counts = &grid->counts_of_frame;
    counts->pairs += pairs;
    counts->longest = statistics.longest > counts->longest ? statistics.longest : counts->longest;
    return pairs <= room ? fill_and_ask(grid, desc, light, asking, all, pairs, err)
                         : ask_in_parts(grid, desc, light, asking, cell_count, room, err);
}

/* ---- what points ask ---- */

static bool leave_surfaces(struct area_grid *grid, const struct area_grid_desc *desc,
                           const struct area_light *eye, const uint32_t cells[2], struct error *err)
{
    (void)grid;
    const struct program_desc text = {.label = "area_leave.comp.glsl",
                                      .compute = "area_leave.comp.glsl"};
    const struct gl_program *program = use(desc, &text, err);
    (void)eye;
    if (!program)
        return false;
    gl_program_set_u(program, "u_points", desc->points.count);
    gl_program_set_u(program, "u_first_point", desc->points.layer_count);
    gl_program_set_u2(program, "u_cells", cells[0], cells[1]);
    window_dispatch_items(desc->points.count);
    wait_for_writes();
    return true;
}

static void set_planes(const struct gl_program *program, const struct area_grid_desc *desc)
{
    _Static_assert(VIEW_CLIP_PLANES_MAX == 8, "u_plane of area_find.comp.glsl");
    static const double everything[4] = {0, 0, 0, 1};
    for (size_t i = 0; i < VIEW_CLIP_PLANES_MAX && desc->state->shadow_plane_count; i++) {
        const double *plane =
            i < desc->state->shadow_plane_count ? desc->state->shadow_planes[i] : everything;
        const float relative[4] = {(float)plane[0], (float)plane[1], (float)plane[2],
                                   (float)(plane[3] + vec3_dot(plane, desc->casters->origin))};
        char name[24];
        snprintf(name, sizeof name, "u_plane[%u]", (unsigned)i);
        gl_program_set_f4(program, name, relative);
    }
}

static void set_samples(const struct gl_program *program, const struct area_grid_desc *desc,
                        const struct area_light *light)
{
    static const double both_sides[3] = {0};
    const double *z = light->axes[2], toward[3] = {-z[0], -z[1], -z[2]};
    set_vector(program, "u_toward", toward);
    set_vector(program, "u_facing", light->is_one_sided ? z : both_sides);
    set_vector(program, "u_half_u", light->half_u);
    set_vector(program, "u_half_v", light->half_v);
    gl_program_set_u(program, "u_is_disk", light->is_disk);
    gl_program_set_u(program, "u_samples", light->samples);
    gl_program_set_u2(program, "u_origin", desc->points.image_x, desc->points.image_y_bottom);
    gl_program_set_f(program, "u_size_m", (float)desc->casters->size_m);
}

static struct find_variant variant_of(const struct area_grid_desc *desc,
                                      const struct area_light *light)
{
    return (struct find_variant){.kind = light->kind,
                                 .samples = light->samples,
                                 .has_filters = desc->casters->has_filters,
                                 .has_planes = desc->state->shadow_plane_count > 0,
                                 .is_software = desc->limits->is_software};
}

static bool find_filters(struct area_grid *grid, const struct area_grid_desc *desc,
                         const struct area_light *light, const uint32_t cells[2], struct error *err)
{
    (void)grid;
    struct program_desc text;
    char defines[DEFINES_BYTES];
    const struct find_variant variant = variant_of(desc, light);
    describe_find(&text, defines, &variant);
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    set_light(program, desc, light);
    set_camera(program, desc);
    set_planes(program, desc);
    set_samples(program, desc, light);
    gl_program_set_u2(program, "u_cells", cells[0], cells[1]);
    gl_program_set_u(program, "u_area_fixed", desc->is_faithful);
    for (uint32_t first = 0; first < light->samples; first += 4 * groups_of(&variant)) {
        gl_program_set_u(program, "u_first_sample", first);
        window_dispatch_items(desc->points.count);
        wait_for_writes();
    }
    return true;
}

/* ---- the same by tables ---- */

static bool make_table(struct area_grid *grid, const struct area_light *light, struct error *err)
{
    static const char *const labels[2] = {"shadow.area.rectangle", "shadow.area.disk"};
    struct gl_buffer *buffer = &grid->masks[light->is_disk];
    const uint64_t bytes = area_table_words(light->samples) * sizeof(uint32_t);
    if (grid->masks_samples[light->is_disk] == light->samples)
        return true;
    uint32_t *masks = malloc(bytes);
    if (!masks)
        return error_set(err, ERROR_NO_MEMORY, "masks of %u points of a light", light->samples);
    area_table_fill(light->is_disk, light->samples, masks);
    grid->masks_samples[light->is_disk] = 0;
    bool ok = gl_buffer_reserve(buffer,
                                &(struct gl_buffer_desc){.label = labels[light->is_disk],
                                                         .size_bytes = bytes,
                                                         .is_uploaded = true},
                                false, err);
    if (ok) {
        gl_buffer_write(buffer, 0, bytes, masks);
        grid->masks_samples[light->is_disk] = light->samples;
    }
    free(masks);
    return ok;
}

/* pack_filter of area_find.comp.glsl, of one in each channel. */
static void set_all(const struct gl_program *program)
{
    const uint32_t one = 1u << (TRACED_FILTER_BITS - 1);
    gl_program_set_u2(program, "u_all", one | one << TRACED_FILTER_BITS,
                      one >> (32 - TRACED_FILTER_BITS) | one << (2 * TRACED_FILTER_BITS - 32));
}

static bool find_masks(struct area_grid *grid, const struct area_grid_desc *desc,
                       const struct area_light *light, const uint32_t cells[2], struct error *err)
{
    struct program_desc text;
    char defines[DEFINES_BYTES];
    describe_mask(&text, defines, light->samples);
    if (!make_table(grid, light, err))
        return false;
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    gl_buffer_bind_storage(&grid->masks[light->is_disk], BIND_AREA_MASKS);
    set_light(program, desc, light);
    set_samples(program, desc, light);
    set_all(program);
    gl_program_set_f(program, "u_nudge_m", (float)desc->casters->nudge_m);
    gl_program_set_u2(program, "u_cells", cells[0], cells[1]);
    window_dispatch_items(desc->points.count);
    wait_for_writes();
    return true;
}

bool area_grid_find(struct area_grid *grid, const struct area_grid_desc *desc,
                    const struct area_light *light, struct error *err)
{
    const struct find_variant variant = variant_of(desc, light);
    const bool is_by_table = desc->is_faithful && has_table(&variant);
    const struct asking asking = {
        .run = is_by_table ? find_masks : find_filters, .has_lists = desc->lists, .asides = 1};
    return reserve_all(grid, desc, err) && run_grid(grid, desc, light, &asking, err);
}

/* ---- the starts ---- */

static bool find_starts(struct area_grid *grid, const struct area_grid_desc *desc,
                        struct error *err)
{
    struct program_desc text;
    char defines[DEFINES_BYTES];
    describe(&text, "area_starts.comp.glsl", defines, "%s%s", lists_define,
             desc->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "");
    const struct gl_program *program = use(desc, &text, err);
    if (!program)
        return false;
    bind(grid, desc);
    light_lists_bind(desc->lists, program);
    set_camera(program, desc);
    gl_program_set_f(program, "u_farthest_m", (float)desc->farthest_m);
    gl_program_set_u2(program, "u_light_chunk", desc->first, desc->count);
    gl_buffer_clear_u32(&grid->statistics, 0, sizeof(struct area_statistics), 0);
    window_dispatch_items(desc->points.count);
    wait_for_writes();
    return true;
}

bool area_grid_begin(struct area_grid *grid, const struct area_grid_desc *desc,
                     const uint32_t *light_filters, uint64_t *filter_count, struct error *err)
{
    const struct asking asking = {.run = leave_surfaces, .asides = 4};
    const uint64_t bytes = desc->state->light_count * sizeof *light_filters;
    struct area_statistics statistics = {.filters = 0};
    if (!reserve_all(grid, desc, err) ||
        !gl_buffer_reserve(&grid->light_filters,
                           &(struct gl_buffer_desc){.label = "shadow.area.lights",
                                                    .size_bytes = bytes,
                                                    .is_uploaded = true},
                           false, err))
        return false;
    if (bytes)
        gl_buffer_write(&grid->light_filters, 0, bytes, light_filters);
    if (!find_starts(grid, desc, err))
        return false;
    gl_buffer_read(&grid->statistics, 0, sizeof statistics, &statistics);
    *filter_count = statistics.filters;
    if (!desc->casters->has_curves || !desc->points.count)
        return true;
    const struct area_light eye = eye_of(desc);
    return run_grid(grid, desc, &eye, &asking, err);
}

uint64_t area_grid_size_bytes(const struct area_grid *grid)
{
    return grid->cells.size_bytes + grid->counts.size_bytes + grid->firsts.size_bytes +
           grid->starts.size_bytes + grid->places.size_bytes + grid->pairs.size_bytes +
           grid->statistics.size_bytes + grid->light_filters.size_bytes +
           grid->masks[0].size_bytes + grid->masks[1].size_bytes;
}

void area_grid_finish(struct area_grid *grid)
{
    struct gl_buffer *buffers[] = {
        &grid->cells, &grid->counts,     &grid->firsts,        &grid->starts,   &grid->places,
        &grid->pairs, &grid->statistics, &grid->light_filters, &grid->masks[0], &grid->masks[1]};
    for (size_t i = 0; i < sizeof buffers / sizeof *buffers; i++)
        gl_buffer_finish(buffers[i]);
    grid->masks_samples[0] = grid->masks_samples[1] = 0;
}
