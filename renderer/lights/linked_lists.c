/* SPDX-License-Identifier: MIT */
/* Building light linked lists on the GPU, as published and corrected. */
#include "renderer/lights/linked_lists.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/buffer_fill.h"
#include "renderer/lights/light_mesh.h"
#include "shaders/shared/bindings.h"

enum { RECORD_FLOATS = 24 }; /* light_linked_list_light.glsl: six texels */

struct linked_draw {
    const struct light_bound *bound;
    struct tile_rect rect;
};

struct element {
    float front, back;
    uint32_t light, next;
};

/* Far lights first: each insertion then walks few elements, because most are behind the new one. */
static int compare_far_first(const void *a, const void *b)
{
    const struct light_bound *x = ((const struct linked_draw *)a)->bound;
    const struct light_bound *y = ((const struct linked_draw *)b)->bound;
    if (x->z_lo != y->z_lo)
        return x->z_lo < y->z_lo ? 1 : -1;
    return (x->light > y->light) - (x->light < y->light);
}

static bool reserve_draws(struct linked_lists *lists, size_t count, struct error *err)
{
    if (count <= lists->draw_capacity)
        return true;
    free(lists->draws);
    lists->draw_capacity = 0;
    lists->draws = calloc(count, sizeof *lists->draws);
    if (!lists->draws)
        return error_set(err, ERROR_NO_MEMORY, "light linked lists of %zu lights", count);
    lists->draw_capacity = count;
    return true;
}

bool linked_lists_collect(struct linked_lists *lists, const struct linked_desc *desc,
                          struct error *err)
{
    uint64_t block = desc->limits ? gl_limits_block(desc->limits, LINKED_ELEMENT_BYTES) : 0;
    lists->draw_count = 0;
    lists->tile_sum = 0;
    lists->elements_most =
        block && block < LINKED_ELEMENTS_MAX ? (uint32_t)block : (uint32_t)LINKED_ELEMENTS_MAX;
    lists->bounds = desc->bounds ? desc->bounds : &lists->own_bounds;
    if ((!desc->bounds && !light_bounds_collect(&lists->own_bounds, desc->lights, desc->light_count,
                                                desc->camera, err)) ||
        !tile_grid_init(&lists->grid, desc->camera, desc->window, LINKED_TILE_PX, err) ||
        !reserve_draws(lists, lists->bounds->count, err))
        return false;
    lists->prefix_count = lists->bounds->global_count;
    for (size_t i = 0; i < lists->bounds->count; i++) {
        struct linked_draw draw = {.bound = &lists->bounds->items[i]};
        if (!tile_grid_cover(&lists->grid, draw.bound, &draw.rect))
            continue;
        lists->tile_sum += (uint64_t)(draw.rect.x1 - draw.rect.x0 + 1) *
                           (uint64_t)(draw.rect.y1 - draw.rect.y0 + 1);
        lists->draws[lists->draw_count++] = draw;
    }
    if (lists->draw_count > LINKED_LIGHTS_MAX)
        return error_set(err, ERROR_OVER_BUDGET,
                         "%zu lights with a range in view, light list technique 'linked' takes %d; "
                         "'clustered' takes any number",
                         lists->draw_count, LINKED_LIGHTS_MAX);
    if (!desc->faithful && lists->draw_count > 1)
        qsort(lists->draws, lists->draw_count, sizeof *lists->draws, compare_far_first);
    return true;
}

static void put3(float *out, const double in[3], double w)
{
    for (int i = 0; i < 3; i++)
        out[i] = (float)in[i];
    out[3] = (float)w;
}

static void write_record(const struct linked_draw *draw, float record[RECORD_FLOATS])
{
    const struct light_bound *bound = draw->bound;
    const float rest[12] = {
        (float)bound->z_lo,         (float)bound->z_hi,
        (float)bound->slack_m,      (float)bound->light,
        (float)draw->rect.x0,       (float)draw->rect.y0,
        (float)(draw->rect.x1 + 1), (float)(draw->rect.y1 + 1),
        (float)bound->range_m,      (float)atan2(bound->sin_outer, bound->cos_outer),
    };
    put3(record, bound->center, bound->radius_m);
    put3(record + 4, bound->apex, bound->is_cone ? bound->cos_outer : -2);
    put3(record + 8, bound->axis, bound->sin_outer);
    memcpy(record + 12, rest, sizeof rest);
    /* nearest depths: f32 rounding must not cut them */
    record[12] -= (float)bound->slack_m;
    record[13] += (float)bound->slack_m;
}

static bool upload_records(struct linked_lists *lists, struct error *err)
{
    size_t size_bytes = lists->draw_count * RECORD_FLOATS * sizeof(float);
    float *records = calloc(lists->draw_count + 1, RECORD_FLOATS * sizeof(float));
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "records of %zu lights", lists->draw_count);
    for (size_t i = 0; i < lists->draw_count; i++)
        write_record(&lists->draws[i], records + i * RECORD_FLOATS);
    bool ok = gl_buffer_reserve(&lists->records,
                                &(struct gl_buffer_desc){.label = "lights.linked.records",
                                                         .size_bytes = size_bytes,
                                                         .is_uploaded = true},
                                false, err);
    if (ok)
        gl_buffer_write(&lists->records, 0, size_bytes, records);
    free(records);
    return ok && gl_texture_follow_buffer(&lists->records_view, "lights.linked.records", GL_RGBA32F,
                                          &lists->records, err);
}

static bool make_mesh(struct linked_lists *lists, struct error *err)
{
    static_assert(LIGHT_MESH_VERTICES * 16 < 65536, "the mesh fits on the stack");
    float vertices[LIGHT_MESH_VERTICES][4];
    if (lists->mesh.name)
        return true;
    light_mesh_make(vertices);
    return gl_buffer_init(&lists->mesh,
                          &(struct gl_buffer_desc){.label = "lights.linked.mesh",
                                                   .size_bytes = sizeof vertices,
                                                   .data = vertices},
                          err) &&
           gl_texture_follow_buffer(&lists->mesh_view, "lights.linked.mesh", GL_RGBA32F,
                                    &lists->mesh, err);
}

/* The insert pass has no attachment: llvmpipe drops side effects of fragments that fill a tile of a
 * colour target. */
static bool make_targets(struct linked_lists *lists, struct error *err)
{
    int columns = lists->grid.columns, rows = lists->grid.rows;
    if (!lists->vertex_array.name)
        gl_vertex_array_init(&lists->vertex_array, "lights.linked");
    if (lists->front.name && lists->target_columns == columns && lists->target_rows == rows)
        return true;
    gl_framebuffer_finish(&lists->front_target);
    gl_framebuffer_finish(&lists->insert_target);
    gl_texture_finish(&lists->front);
    lists->target_columns = columns;
    lists->target_rows = rows;
    return gl_texture_init(&lists->front,
                           &(struct gl_texture_desc){.label = "lights.linked.front",
                                                     .format = GL_R32F,
                                                     .width = columns,
                                                     .height = rows},
                           err) &&
           gl_framebuffer_init(&lists->front_target,
                               &(struct gl_framebuffer_desc){.label = "lights.linked.front",
                                                             .colors = {&lists->front}},
                               err) &&
           gl_framebuffer_init(&lists->insert_target,
                               &(struct gl_framebuffer_desc){.label = "lights.linked.insert",
                                                             .width = columns,
                                                             .height = rows},
                               err);
}

static bool reserve_elements(struct linked_lists *lists, uint64_t count, struct error *err)
{
    if (count > lists->elements_most)
        return error_set(err, ERROR_OVER_BUDGET,
                         "light linked lists need %llu elements of %d bytes, the limit is %u; "
                         "'clustered' needs less",
                         (unsigned long long)count, LINKED_ELEMENT_BYTES, lists->elements_most);
    return gl_buffer_reserve(&lists->elements,
                             &(struct gl_buffer_desc){.label = "lights.linked.elements",
                                                      .size_bytes = count * LINKED_ELEMENT_BYTES,
                                                      .is_dynamic = true},
                             false, err);
}

static uint32_t capacity_of(const struct linked_lists *lists)
{
    uint64_t capacity = lists->elements.size_bytes / LINKED_ELEMENT_BYTES;
    return capacity > lists->elements_most ? lists->elements_most : (uint32_t)capacity;
}

static bool empty_heads(struct linked_lists *lists, const struct linked_desc *desc,
                        struct program_cache *programs, uint64_t bytes, struct error *err)
{
    bool is_software = !desc->limits || desc->limits->is_software;
    return buffer_fill_u32(&(struct buffer_fill_desc){.programs = programs,
                                                      .limits = desc->limits,
                                                      .buffer = &lists->heads,
                                                      .size_bytes = bytes,
                                                      .value = UINT32_MAX,
                                                      .by_gl = is_software},
                           err);
}

/* Empty lists; the prefix takes the first elements. */
static bool clear_lists(struct linked_lists *lists, const struct linked_desc *desc,
                        struct program_cache *programs, struct error *err)
{
    uint64_t words =
        LINKED_HEADER_WORDS + (uint64_t)lists->grid.columns * (uint64_t)lists->grid.rows;
    uint32_t header[LINKED_HEADER_WORDS] = {(uint32_t)lists->prefix_count};
    if (!gl_buffer_reserve(&lists->heads,
                           &(struct gl_buffer_desc){.label = "lights.linked.heads",
                                                    .size_bytes = words * 4,
                                                    .is_dynamic = true},
                           false, err) ||
        !empty_heads(lists, desc, programs, words * 4, err))
        return false;
    gl_buffer_write(&lists->heads, 0, sizeof header, header);
    struct element *prefix = calloc(lists->prefix_count + 1, sizeof *prefix);
    if (!prefix)
        return error_set(err, ERROR_NO_MEMORY, "%zu global lights", lists->prefix_count);
    for (size_t i = 0; i < lists->prefix_count; i++)
        prefix[i] = (struct element){-FLT_MAX, FLT_MAX, lists->bounds->global[i], UINT32_MAX};
    gl_buffer_write(&lists->elements, 0, lists->prefix_count * sizeof *prefix, prefix);
    free(prefix);
    return true;
}

static void set_tile_uniforms(const struct linked_lists *lists, const struct gl_program *program)
{
    const struct tile_grid *grid = &lists->grid;
    const float window[4] = {(float)grid->x_first, (float)grid->y_first,
                             (float)(grid->x_first + grid->columns * grid->x_step),
                             (float)(grid->y_first + grid->rows * grid->y_step)};
    const float tiles[4] = {(float)grid->columns, (float)grid->rows,
                            grid->is_orthographic ? 1.0f : 0.0f, 0};
    gl_program_set_f4(program, "u_window", window);
    gl_program_set_f4(program, "u_tiles", tiles);
    gl_program_set_u(program, "u_capacity", capacity_of(lists));
    gl_program_set_f(program, "u_inside_front", grid->is_orthographic ? -FLT_MAX : 0.0f);
}

static void set_state(const struct linked_lists *lists)
{
    gl_disable_fragment_stages();
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    for (unsigned i = 0; i < 8; i++)
        glDisable(GL_CLIP_DISTANCE0 + i);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glViewport(0, 0, lists->grid.columns, lists->grid.rows);
    glBindVertexArray(lists->vertex_array.name);
    gl_buffer_bind_storage(&lists->heads, BIND_LIGHT_HEADS);
    gl_buffer_bind_storage_range(
        &lists->elements, 0, (uint64_t)capacity_of(lists) * LINKED_ELEMENT_BYTES, BIND_LIST_NODES);
    gl_texture_bind(&lists->records_view, UNIT_LIGHT_RECORDS);
    gl_texture_bind(&lists->mesh_view, UNIT_LIGHT_MESH);
    gl_texture_bind(&lists->front, UNIT_LIGHT_FRONT);
}

static void draw_light_mesh(const struct linked_draw *draw, size_t instance)
{
    bool is_cone = draw->bound->is_cone;
    glDrawArraysInstancedBaseInstance(
        GL_TRIANGLES, is_cone ? LIGHT_MESH_SPHERE_VERTICES : 0,
        is_cone ? LIGHT_MESH_CONE_VERTICES : LIGHT_MESH_SPHERE_VERTICES, 1, (GLuint)instance);
}

static const struct program_desc front_program = {.label = "lights.linked.front",
                                                  .vertex = "light_linked_list_mesh.vert.glsl",
                                                  .fragment = "light_linked_list_front.frag.glsl"};
static const struct program_desc insert_program = {.label = "lights.linked.insert",
                                                   .vertex = "light_linked_list_mesh.vert.glsl",
                                                   .fragment =
                                                       "light_linked_list_insert.frag.glsl"};
static const struct program_desc interval_program = {.label = "lights.linked.interval",
                                                     .vertex = "light_linked_list_rect.vert.glsl",
                                                     .fragment =
                                                         "light_linked_list_interval.frag.glsl"};

void linked_lists_list_programs(bool is_faithful, bool is_software, const char *pass,
                                struct program_list *list)
{
    if (!is_software)
        buffer_fill_list_programs(pass, list);
    if (is_faithful) {
        program_list_add(list, pass, &front_program, true);
        program_list_add(list, pass, &insert_program, true);
    } else {
        program_list_add(list, pass, &interval_program, true);
    }
}

/* Draws both passes of every light in turn, as published, within the light's own tiles. */
static bool draw_faithful(struct linked_lists *lists, struct program_cache *programs,
                          struct error *err)
{
    const struct gl_program *front = program_cache_get(programs, &front_program, err);
    const struct gl_program *insert = program_cache_get(programs, &insert_program, err);
    if (!front || !insert)
        return false;
    const float far_away = FLT_MAX;
    set_state(lists);
    set_tile_uniforms(lists, front);
    set_tile_uniforms(lists, insert);
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CW); /* view space with z forward is left-handed */
    for (size_t i = 0; i < lists->draw_count; i++) {
        const struct tile_rect *rect = &lists->draws[i].rect;
        glScissor(rect->x0, rect->y0, rect->x1 - rect->x0 + 1, rect->y1 - rect->y0 + 1);
        glBindFramebuffer(GL_FRAMEBUFFER, lists->front_target.name);
        glClearNamedFramebufferfv(lists->front_target.name, GL_COLOR, 0, &far_away);
        gl_program_use(front);
        glCullFace(GL_BACK);
        draw_light_mesh(&lists->draws[i], i);
        glBindFramebuffer(GL_FRAMEBUFFER, lists->insert_target.name);
        gl_program_use(insert);
        glCullFace(GL_FRONT);
        draw_light_mesh(&lists->draws[i], i);
    }
    glFrontFace(GL_CCW);
    glCullFace(GL_BACK);
    glDisable(GL_CULL_FACE);
    glDisable(GL_SCISSOR_TEST);
    return true;
}

static bool draw_corrected(struct linked_lists *lists, struct program_cache *programs,
                           struct error *err)
{
    const struct gl_program *program = program_cache_get(programs, &interval_program, err);
    if (!program)
        return false;
    set_state(lists);
    set_tile_uniforms(lists, program);
    glBindFramebuffer(GL_FRAMEBUFFER, lists->insert_target.name);
    gl_program_use(program);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)lists->draw_count);
    return true;
}

/* How many elements were asked for, once the GPU is done. */
static bool read_counter(struct linked_lists *lists, uint32_t *wanted, struct error *err)
{
    uint32_t header[LINKED_HEADER_WORDS] = {0}; /* a lost context reads nothing */
    gl_buffer_read(&lists->heads, 0, sizeof header, header);
    *wanted = header[0];
    if (header[1])
        return error_set(err, ERROR_INTERNAL,
                         "light linked lists: %u insertions did not get their list's lock",
                         header[1]);
    return true;
}

static bool build_once(struct linked_lists *lists, const struct linked_desc *desc,
                       struct program_cache *programs, uint32_t *wanted, struct error *err)
{
    if (!clear_lists(lists, desc, programs, err))
        return false;
    lists->builds++;
    *wanted = (uint32_t)lists->prefix_count;
    if (lists->draw_count == 0)
        return true;
    if (!(desc->faithful ? draw_faithful(lists, programs, err)
                         : draw_corrected(lists, programs, err)))
        return false;
    return read_counter(lists, wanted, err);
}

bool linked_lists_build(struct linked_lists *lists, const struct linked_desc *desc,
                        struct program_cache *programs, struct error *err)
{
    uint64_t first = desc->elements_first ? desc->elements_first : LINKED_ELEMENTS_FIRST;
    if (first > lists->tile_sum)
        first = lists->tile_sum;
    first += lists->prefix_count;
    if (first > lists->elements_most && lists->prefix_count <= lists->elements_most)
        first = lists->elements_most;
    lists->builds = 0;
    if (!make_mesh(lists, err) || !make_targets(lists, err) || !upload_records(lists, err) ||
        !reserve_elements(lists, first, err))
        return false;
    uint32_t wanted;
    while (true) {
        if (!build_once(lists, desc, programs, &wanted, err))
            return false;
        if (wanted <= capacity_of(lists))
            break;
        if (!reserve_elements(lists, wanted, err))
            return false;
    }
    lists->element_count = wanted;
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return gl_texture_follow_buffer(&lists->heads_view, "lights.linked.heads", GL_R32UI,
                                    &lists->heads, err) &&
           gl_texture_follow_buffer(&lists->elements_view, "lights.linked.elements", GL_RGBA32UI,
                                    &lists->elements, err);
}

uint64_t linked_lists_used_bytes(const struct linked_lists *lists)
{
    uint64_t tiles = (uint64_t)lists->grid.columns * (uint64_t)lists->grid.rows;
    return (LINKED_HEADER_WORDS + tiles) * sizeof(uint32_t) +
           (uint64_t)lists->element_count * LINKED_ELEMENT_BYTES +
           lists->draw_count * RECORD_FLOATS * sizeof(float);
}

void linked_lists_finish(struct linked_lists *lists)
{
    tile_grid_finish(&lists->grid);
    light_bounds_finish(&lists->own_bounds);
    free(lists->draws);
    gl_texture_finish(&lists->heads_view);
    gl_texture_finish(&lists->elements_view);
    gl_texture_finish(&lists->records_view);
    gl_texture_finish(&lists->mesh_view);
    gl_framebuffer_finish(&lists->front_target);
    gl_framebuffer_finish(&lists->insert_target);
    gl_texture_finish(&lists->front);
    gl_buffer_finish(&lists->heads);
    gl_buffer_finish(&lists->elements);
    gl_buffer_finish(&lists->records);
    gl_buffer_finish(&lists->mesh);
    gl_vertex_array_finish(&lists->vertex_array);
    *lists = (struct linked_lists){0};
}
