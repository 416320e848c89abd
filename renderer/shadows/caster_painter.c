/* SPDX-License-Identifier: MIT */
/* One pass over the faces of lights: what each face is goes to the device as a record, what it sees
 * as a list of draws, both for all lights at once. */
#include "renderer/shadows/caster_painter.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/fnv.h"
#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

_Static_assert(sizeof(struct face_record) == GL_BUFFER_ALIGNMENT, "records are bound one by one");
_Static_assert((int)FACE_PLANES_MAX == (int)VIEW_CLIP_PLANES_MAX, "any planes may cut casters");

enum {
    /* casters that are painted together: with six faces each, 11 MiB of draws */
    GROUP_CASTERS = 1 << 16,
    FACES_KEPT_BYTES = 1 << 20,
};

struct paint_face {
    uint32_t build;
    struct draw_range range; /* of the casters that it sees */
};

struct paint_job { /* lights that are painted together */
    struct caster_painter *painter;
    const struct caster_paint_desc *desc;
    struct shadow_build *const *builds;
    size_t build_count, face_count;
    bool is_layered;
    uint64_t faces_offset; /* of their records in the stream, bytes */
    size_t list_first;     /* of the painter's list: what is being described */
    struct draw_choice last;
    uint32_t last_item, last_build;
};

void caster_painter_finish(struct caster_painter *painter)
{
    free(painter->list.items);
    free(painter->list.records);
    free(painter->list.faces);
    free(painter->list.builds);
    free(painter->records);
    free(painter->faces);
    gl_stream_finish(&painter->face_stream);
    gl_vertex_array_finish(&painter->corners);
    *painter = (struct caster_painter){0};
}

/* ---- programs ---- */

static const struct gl_program *find_program(struct caster_painter *painter, uint32_t key,
                                             struct error *err)
{
    for (uint32_t i = 0; i < painter->variant_count; i++)
        if (painter->variants[i].key == key)
            return painter->variants[i].program;
    if (painter->variant_count == CASTER_VARIANTS_MAX)
        painter->variant_count = 0; /* the programs stay in their cache */
    char defines[CASTER_DEFINES_BYTES];
    const struct program_desc desc = caster_program(key, defines);
    const struct gl_program *program = program_cache_get(painter->programs, &desc, err);
    if (program)
        painter->variants[painter->variant_count++] = (struct caster_variant){key, program};
    return program;
}

static struct caster_view view_of(const struct paint_job *job, size_t build)
{
    return (struct caster_view){.pass = job->desc->pass,
                                .is_layered = job->is_layered,
                                .is_unlocked = job->desc->is_unlocked,
                                .map = job->builds[build]->map,
                                .scene = job->desc->scene};
}

static bool choose(void *opaque, size_t index, struct draw_choice *choice, struct error *err)
{
    struct paint_job *job = opaque;
    const struct paint_list *list = &job->painter->list;
    uint32_t item = list->items[job->list_first + index];
    uint32_t build = list->builds[job->list_first + index];
    if (!job->last.program || job->last_item != item || job->last_build != build) {
        const struct caster_view view = view_of(job, build);
        uint32_t key = caster_key(&view, &job->desc->scene->state->items[item]);
        job->last = (struct draw_choice){
            .program = find_program(job->painter, key, err),
            .samples_textures = caster_key_samples_textures(key),
            .texture_pass = 1 + (size_t)job->builds[build]->light,
        };
        job->last_item = item;
        job->last_build = build;
    }
    *choice = job->last;
    return choice->program != NULL;
}

/* ---- faces ---- */

static uint32_t faces_of(const struct shadow_map *map)
{
    return map->window.row_count ? 1 : map->frame.face_count;
}

static uint32_t layer_of(const struct shadow_build *build, uint32_t face)
{
    return build->target_layer + (build->map->window.row_count ? 0 : face);
}

static void fill_axes(const struct shadow_frame *frame, uint32_t face, struct face_record *r)
{
    double turn[3][3], unit = frame->unit_m;
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    double flat = is_flat ? unit : 1;
    vec4 *rows[3] = {&r->axis_x, &r->axis_y, &r->axis_z};
    shadow_frame_face_turn(frame, face, turn);
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            rows[k]->v[c] = (float)turn[k][c];
    r->axis_x.v[3] = (float)unit;
    r->axis_z.v[3] = is_flat ? 0.0f : 1.0f;
    r->clip = (vec4){{(float)(frame->scale[0] * flat), (float)(frame->scale[1] * flat),
                      is_flat ? 1.0f : (float)(frame->near_m / unit),
                      is_flat ? (float)(-unit / frame->depth_m) : 0}};
}

/* Of what stays as it is while casters move, so that the noise stands still: where the light is, or
 * where it shines. */
static uint32_t seed_of(const struct shadow_frame *frame, uint32_t face)
{
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    const double *place = is_flat ? frame->axis[2] : frame->origin;
    uint64_t digest = fnv_add(FNV_BEGIN, &face, sizeof face);
    digest = fnv_add(digest, place, 3 * sizeof *place);
    return (uint32_t)(digest ^ digest >> 32);
}

/* In the light's space, in metres. */
static void fill_planes(const struct shadow_map *map, struct face_record *r)
{
    const double(*axis)[3] = map->frame.axis;
    for (uint32_t i = 0; i < map->plane_count; i++) {
        const double *plane = map->planes[i];
        r->cut_planes[i] = (vec4){{(float)vec3_dot(axis[0], plane), (float)vec3_dot(axis[1], plane),
                                   (float)vec3_dot(axis[2], plane),
                                   (float)(plane[3] + vec3_dot(plane, map->frame.origin))}};
    }
}

static void fill_face(const struct paint_job *job, const struct shadow_build *build, uint32_t face,
                      struct face_record *r)
{
    const struct shadow_map *map = build->map;
    bool is_linked = job->desc->pass == CASTER_LINK || job->desc->pass == CASTER_LINK_FAITHFUL;
    uint64_t face_texels = (uint64_t)map->resolution * (uint64_t)map->resolution;
    const struct shadow_range *counts = is_linked ? &map->heads : &map->depths;
    uint64_t first = face * face_texels;
    if (map->window.row_count) /* modulo 2^32, as the shader adds */
        first = 0 - (uint64_t)map->window.first_row * (uint64_t)map->resolution;
    const struct shadow_range *room = is_linked ? &map->nodes : &map->events;
    *r = (struct face_record){
        .first_count = (uint32_t)(counts->first - job->desc->first_count + first),
        .first_end = (uint32_t)(map->heads.first + 1 + first),
        .event_base = (uint32_t)(room->first - job->desc->first_event),
        .event_count = (uint32_t)room->count,
        .slot = build->slot,
        .resolution = (uint32_t)map->resolution,
        .layer = layer_of(build, face),
        .scatters = job->desc->pass == CASTER_SCATTER,
        .blend_filter = job->desc->scene->blend_filter,
        .lock_tries = build->lock_tries,
        .seed = seed_of(&map->frame, map->window.row_count ? map->window.face : face),
        .part = job->desc->part,
        .depths = {{(float)map->nearest_m, (float)map->depths_per_m}},
    };
    fill_axes(&map->frame, map->window.row_count ? map->window.face : face, r);
    fill_planes(map, r);
    r->axis_y.v[3] = (float)build->casters.farthest_m;
}

static bool reserve_faces(struct caster_painter *painter, size_t count, struct error *err)
{
    if (count <= painter->face_capacity)
        return true;
    struct face_record *records = realloc(painter->records, count * sizeof *records);
    if (records)
        painter->records = records;
    struct paint_face *faces = records ? realloc(painter->faces, count * sizeof *faces) : NULL;
    if (!faces)
        return error_set(err, ERROR_NO_MEMORY, "%zu faces of lights", count);
    painter->faces = faces;
    painter->face_capacity = count;
    return true;
}

static bool upload_faces(struct paint_job *job, struct error *err)
{
    static const struct gl_stream_desc stream = {.label = "shadow.faces",
                                                 .kept_bytes = FACES_KEPT_BYTES,
                                                 .align_bytes = GL_BUFFER_ALIGNMENT};
    struct caster_painter *painter = job->painter;
    size_t count = 0;
    for (size_t b = 0; b < job->build_count; b++)
        count += faces_of(job->builds[b]->map);
    if (!reserve_faces(painter, count, err))
        return false;
    job->face_count = 0;
    for (size_t b = 0; b < job->build_count; b++)
        for (uint32_t face = 0; face < faces_of(job->builds[b]->map); face++) {
            painter->faces[job->face_count] = (struct paint_face){.build = (uint32_t)b};
            fill_face(job, job->builds[b], face, &painter->records[job->face_count++]);
        }
    return gl_stream_write(&painter->face_stream, &stream, painter->records,
                           count * sizeof *painter->records, &job->faces_offset, err);
}

/* ---- lists ---- */

static bool reserve_list(struct paint_list *list, size_t count, struct error *err)
{
    uint32_t **const arrays[4] = {&list->items, &list->records, &list->faces, &list->builds};
    if (count <= list->capacity)
        return true;
    for (int i = 0; i < 4; i++) {
        uint32_t *grown = realloc(*arrays[i], count * sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", count);
        *arrays[i] = grown;
    }
    list->capacity = count;
    return true;
}

static void add_to_list(struct paint_job *job, size_t build, size_t caster, uint32_t face)
{
    struct paint_list *list = &job->painter->list;
    const struct shadow_build *from = job->builds[build];
    list->items[list->count] = from->casters.items[caster];
    list->records[list->count] = from->placement.first_record + (uint32_t)caster;
    list->faces[list->count] = face;
    list->builds[list->count++] = (uint32_t)build;
}

static struct draw_desc draws_of(struct paint_job *job, bool has_faces)
{
    const struct paint_list *list = &job->painter->list;
    size_t first = job->list_first;
    return (struct draw_desc){.gpu = job->desc->scene->gpu,
                              .state = job->desc->scene->state,
                              .arena = job->desc->scene->arena,
                              .items = list->items + first,
                              .records = list->records + first,
                              .faces = has_faces ? list->faces + first : NULL,
                              .item_count = list->count - first,
                              .choose = choose,
                              .context = job};
}

static bool add_draws(struct paint_job *job, bool has_faces, struct draw_range *range,
                      struct error *err)
{
    const struct draw_desc draws = draws_of(job, has_faces);
    return draws_add(&draws, range, err);
}

/* Of one face, in the order of the state. */
static bool list_face(struct paint_job *job, uint32_t number, uint32_t first_face,
                      struct error *err)
{
    struct paint_face *face = &job->painter->faces[number];
    const struct caster_view view = view_of(job, face->build);
    const struct shadow_casters *casters = &job->builds[face->build]->casters;
    uint32_t bit = view.map->window.row_count ? view.map->window.face : number - first_face;
    job->list_first = job->painter->list.count;
    for (size_t i = 0; i < casters->count; i++)
        if (casters->faces[i] >> bit & 1 && caster_is_drawn(&view, casters->items[i]))
            add_to_list(job, face->build, i, number);
    return add_draws(job, false, &face->range, err);
}

static bool list_faces_apart(struct paint_job *job, struct error *err)
{
    uint32_t number = 0;
    for (size_t b = 0; b < job->build_count; b++) {
        uint32_t first = number;
        for (uint32_t face = 0; face < faces_of(job->builds[b]->map); face++, number++)
            if (!list_face(job, number, first, err))
                return false;
    }
    return true;
}

/* What one light's faces see of the item at its cursor. */
static void list_caster(struct paint_job *job, size_t build, size_t caster, uint32_t first_face)
{
    const struct shadow_map *map = job->builds[build]->map;
    uint32_t faces = job->builds[build]->casters.faces[caster];
    if (map->window.row_count)
        faces = faces >> map->window.face & 1;
    for (; faces; faces &= faces - 1)
        add_to_list(job, build, caster, first_face + (uint32_t)__builtin_ctz(faces));
}

/* Item by item, so that what lights and faces see of one can be its instances. */
static bool list_faces_together(struct paint_job *job, struct error *err)
{
    const struct scene_state *state = job->desc->scene->state;
    size_t *next = calloc(job->build_count, sizeof *next);
    if (!next)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", job->build_count);
    job->list_first = 0;
    for (size_t item = 0; item < state->item_count; item++) {
        uint32_t first_face = 0;
        for (size_t b = 0; b < job->build_count; b++) {
            const struct caster_view view = view_of(job, b);
            const struct shadow_casters *casters = &job->builds[b]->casters;
            if (next[b] < casters->count && casters->items[next[b]] == item) {
                if (caster_is_drawn(&view, (uint32_t)item))
                    list_caster(job, b, next[b], first_face);
                next[b]++;
            }
            first_face += faces_of(view.map);
        }
    }
    free(next);
    return add_draws(job, true, &job->painter->faces[0].range, err);
}

static bool has_around(const struct paint_job *job, const struct shadow_build *build)
{
    return build->map->around_count &&
           (job->desc->pass == CASTER_COUNT || job->desc->pass == CASTER_SCATTER);
}

/* An instance per face of each light that a medium is around. */
static bool list_around(const struct paint_job *job, struct error *err)
{
    uint32_t number;
    for (uint32_t face = 0; face < job->face_count; face++)
        if (has_around(job, job->builds[job->painter->faces[face].build]) &&
            !draws_add_instance(job->desc->scene->arena, 0, face, &number, err))
            return false;
    return true;
}

static bool place_casters(const struct paint_job *job, struct error *err)
{
    struct draw_place_desc *descs = calloc(job->build_count, sizeof *descs);
    struct draw_placement **placements = calloc(job->build_count, sizeof *placements);
    bool ok = descs && placements;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%zu lights", job->build_count);
    for (size_t i = 0; ok && i < job->build_count; i++) {
        const struct shadow_frame *frame = &job->builds[i]->map->frame;
        const struct shadow_casters *casters = &job->builds[i]->casters;
        struct draw_place_desc *place = &descs[i];
        *place = (struct draw_place_desc){.state = job->desc->scene->state,
                                          .items = casters->items,
                                          .item_count = casters->count};
        memcpy(place->space.origin, frame->origin, sizeof place->space.origin);
        memcpy(place->space.axes, frame->axis, sizeof place->space.axes);
        place->space.unit_m = frame->unit_m;
        placements[i] = &job->builds[i]->placement;
    }
    ok = ok &&
         draw_arena_place_all(job->desc->scene->arena, descs, placements, job->build_count, err);
    free(descs);
    free(placements);
    return ok;
}

static bool list_all(struct paint_job *job, struct error *err)
{
    size_t most = 0;
    for (size_t b = 0; b < job->build_count; b++)
        most += job->builds[b]->casters.count * faces_of(job->builds[b]->map);
    job->painter->list.count = 0;
    draws_begin(job->desc->scene->arena);
    return reserve_list(&job->painter->list, most, err) &&
           (job->is_layered ? list_faces_together(job, err) && list_around(job, err)
                            : list_faces_apart(job, err)) &&
           draws_upload(job->desc->scene->arena, err);
}

/* ---- drawing ---- */

static bool keeps_products(enum caster_pass pass)
{
    return pass == CASTER_PRODUCT || pass == CASTER_BLEND;
}

/* Filters multiply, and the nearest depth stays: both in any order of the casters. As published, in
 * their order, each adds its colour to what it lets through. Moments are sums; of the last part
 * alpha is the farthest depth. */
static void blend_texels(enum caster_pass pass, uint32_t part)
{
    bool is_sum = pass == CASTER_MOMENTS;
    GLenum alpha = !is_sum ? GL_MIN : part == SHADOW_PART_TOTAL ? GL_MAX : GL_FUNC_ADD;
    glEnable(GL_BLEND);
    glBlendEquationSeparate(is_sum || keeps_products(pass) ? GL_FUNC_ADD : GL_MIN, alpha);
    if (is_sum)
        glBlendFunc(GL_ONE, GL_ONE);
    else if (pass == CASTER_BLEND)
        glBlendFuncSeparate(GL_ONE, GL_SRC1_COLOR, GL_ONE, GL_ONE);
    else
        glBlendFuncSeparate(GL_ZERO, GL_SRC_COLOR, GL_ONE, GL_ONE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

/* llvmpipe loses side effects of fragments without a colour mask that is off and a depth
 * attachment. */
static void set_state(const struct paint_job *job)
{
    enum caster_pass pass = job->desc->pass;
    const struct shadow_map *map = job->builds[0]->map;
    gl_disable_fragment_stages();
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(pass == CASTER_LINK_FAITHFUL ? GL_ALWAYS : GL_GREATER);
    glDepthMask(pass == CASTER_DEPTH);
    glViewport(0, 0, map->resolution, map->resolution);
    if (map->window.row_count) { /* of the same picture, to the bit */
        glEnable(GL_SCISSOR_TEST);
        glScissor(0, map->window.first_row, map->resolution, map->window.row_count);
    }
    if (caster_pass_has_colors(pass))
        blend_texels(pass, job->desc->part);
}

static void unset_state(void)
{
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ZERO); /* of two colours it would refuse several targets, even unused */
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
}

/* Programs without planes write no distances: those of a light's planes must be off for them. */
static void cut_casters(uint32_t planes, bool is_on)
{
    for (uint32_t i = 0; i < planes; i++)
        (is_on ? glEnable : glDisable)(GL_CLIP_DISTANCE0 + i);
}

static void bind_face(const struct paint_job *job, uint32_t face)
{
    uint64_t size = sizeof(struct face_record);
    gl_buffer_bind_uniform(&job->painter->face_stream.buffer, job->faces_offset + face * size, size,
                           UNIFORM_FACE);
}

static void bind_faces(const struct paint_job *job)
{
    gl_buffer_bind_storage_range(&job->painter->face_stream.buffer, job->faces_offset,
                                 job->face_count * sizeof(struct face_record), BIND_SHADOW_FACES);
}

/* The media around a light that is cut away: an event of each texel whose ray enters what is kept.
 * first: the instance of its first face, where all are drawn at once; count: of its faces. */
static bool paint_around(const struct paint_job *job, uint32_t build, uint32_t first,
                         uint32_t count, struct error *err)
{
    struct caster_painter *painter = job->painter;
    const struct shadow_map *map = job->builds[build]->map;
    const struct shadow_scene *scene = job->desc->scene;
    const struct caster_view view = view_of(job, build);
    const struct gl_program *program = find_program(painter, caster_around_key(&view), err);
    if (!program)
        return false;
    if (!painter->corners.name) {
        gl_vertex_array_init(&painter->corners, "shadow.around");
        if (painter->is_layered)
            draws_format_instances(&painter->corners);
    }
    gl_program_use(program);
    glBindVertexArray(painter->corners.name);
    if (job->is_layered)
        draws_bind_instances(scene->arena, &painter->corners, true);
    for (uint32_t i = 0; i < map->around_count; i++) {
        const struct state_item *item = &scene->state->items[map->around[i].item];
        uint32_t once = scene->state->materials[item->material].cast_once ? 0x80000000u : 0u;
        uint32_t medium = 2 * draw_arena_material(scene->arena, map->around[i].item);
        gl_program_set_u2(program, "u_around", medium + (map->around[i].enters ? 3 : 2),
                          item->node | once);
        glDrawArraysInstancedBaseInstance(GL_TRIANGLES, 0, 3, (GLsizei)count, first);
    }
    if (job->is_layered)
        draws_bind_instances(scene->arena, &painter->corners, false);
    return true;
}

/* Of texels that no transparent caster covers. */
static const GLfloat *clear_texel(enum caster_pass pass)
{
    static const GLfloat sums[4] = {0}, products[4] = {1, 1, 1, (GLfloat)SHADOW_TEXEL_FAR},
                         depths[4] = {(GLfloat)SHADOW_TEXEL_FAR, (GLfloat)SHADOW_TEXEL_FAR,
                                      (GLfloat)SHADOW_TEXEL_FAR, (GLfloat)SHADOW_TEXEL_FAR};
    return pass == CASTER_MOMENTS ? sums : keeps_products(pass) ? products : depths;
}

static void clear_face(const struct gl_framebuffer *framebuffer, enum caster_pass pass)
{
    if (pass == CASTER_DEPTH)
        glClearNamedFramebufferfv(framebuffer->name, GL_DEPTH, 0, &(GLfloat){0});
    else if (caster_pass_has_colors(pass))
        glClearNamedFramebufferfv(framebuffer->name, GL_COLOR, 0, clear_texel(pass));
}

static bool is_cleared(const struct caster_paint_desc *desc)
{
    return desc->pass == CASTER_DEPTH ||
           (caster_pass_has_colors(desc->pass) && !desc->keeps_texels);
}

static bool paint_face(struct paint_job *job, uint32_t number, uint32_t first_face,
                       struct error *err)
{
    const struct paint_face *face = &job->painter->faces[number];
    const struct shadow_build *build = job->builds[face->build];
    const struct draw_desc draws = draws_of(job, false);
    const struct gl_framebuffer *framebuffer =
        shadow_store_face(job->desc->store, layer_of(build, number - first_face),
                          caster_pass_has_colors(job->desc->pass), err);
    if (!framebuffer)
        return false;
    bool has_medium = has_around(job, build);
    if (!is_cleared(job->desc) && !face->range.count && !has_medium)
        return true;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer->name);
    if (is_cleared(job->desc))
        clear_face(framebuffer, job->desc->pass);
    bind_face(job, number);
    cut_casters(build->map->plane_count, true);
    draws_run(&draws, &face->range);
    cut_casters(build->map->plane_count, false);
    if (!has_medium)
        return true;
    draws_end(draws.arena);
    return paint_around(job, face->build, 0, 1, err);
}

static bool paint_apart(struct paint_job *job, struct error *err)
{
    uint32_t number = 0;
    for (size_t b = 0; b < job->build_count; b++) {
        uint32_t first = number;
        for (uint32_t face = 0; face < faces_of(job->builds[b]->map); face++, number++)
            if (!paint_face(job, number, first, err))
                return false;
    }
    if (is_cleared(job->desc) && !job->painter->faces[number - 1].range.count)
        gl_framebuffer_apply_clears(); /* nothing was drawn to the last face */
    return true;
}

/* The layers of each run of lights that follow one another. */
static void clear_layers(const struct paint_job *job)
{
    bool has_colors = caster_pass_has_colors(job->desc->pass);
    const struct shadow_store *store = job->desc->store;
    const struct gl_texture *target = has_colors ? &store->colors : &store->target;
    for (uint32_t face = 0; face < job->face_count;) {
        uint32_t first = job->painter->records[face].layer, count = 0;
        while (face < job->face_count && job->painter->records[face].layer == first + count)
            face++, count++;
        glClearTexSubImage(target->name, 0, 0, 0, (GLint)first, target->width, target->height,
                           (GLsizei)count, has_colors ? GL_RGBA : GL_DEPTH_COMPONENT, GL_FLOAT,
                           has_colors ? clear_texel(job->desc->pass) : NULL);
    }
}

static bool paint_together(struct paint_job *job, struct error *err)
{
    const struct draw_desc draws = draws_of(job, true);
    const struct draw_range *range = &job->painter->faces[0].range;
    uint32_t planes = job->builds[0]->map->plane_count;
    uint32_t instance = (uint32_t)job->painter->list.count; /* those of casters are before */
    if (is_cleared(job->desc))
        clear_layers(job);
    const struct gl_framebuffer *framebuffer =
        shadow_store_layers(job->desc->store, caster_pass_has_colors(job->desc->pass), err);
    if (!framebuffer)
        return false;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer->name);
    bind_faces(job);
    cut_casters(planes, true);
    draws_run(&draws, range);
    cut_casters(planes, false);
    draws_end(draws.arena);
    for (uint32_t b = 0; b < job->build_count; b++) {
        uint32_t faces = faces_of(job->builds[b]->map);
        if (!has_around(job, job->builds[b]))
            continue;
        if (!paint_around(job, b, instance, faces, err))
            return false;
        instance += faces;
    }
    return true;
}

static bool paint_group(struct paint_job *job, struct error *err)
{
    if (!place_casters(job, err) || !upload_faces(job, err))
        return false;
    job->is_layered = job->painter->is_layered && !caster_pass_is_ordered(job->desc->pass) &&
                      draw_arena_has_block(job->desc->scene->arena);
    if (!list_all(job, err))
        return false;
    set_state(job);
    bool ok = job->is_layered ? paint_together(job, err) : paint_apart(job, err);
    draws_end(job->desc->scene->arena);
    unset_state();
    return ok;
}

/* Finds the lights from `first` on with so many planes that are painted together; *next: the first
 * one that is not. */
static size_t gather(const struct caster_paint_desc *desc, size_t first, uint32_t planes,
                     struct shadow_build **builds, size_t *next)
{
    size_t casters = 0, count = 0;
    for (*next = first; *next < desc->build_count; ++*next) {
        struct shadow_build *build = desc->builds[*next];
        if (build->map->plane_count != planes)
            continue;
        casters += build->casters.count;
        if (count && casters > GROUP_CASTERS)
            break;
        builds[count++] = build;
    }
    return count;
}

bool caster_painter_paint(struct caster_painter *painter, const struct caster_paint_desc *desc,
                          struct error *err)
{
    struct shadow_build **builds = calloc(desc->build_count + 1, sizeof *builds);
    bool ok = builds || error_set(err, ERROR_NO_MEMORY, "%zu lights", desc->build_count);
    for (uint32_t planes = 0; ok && planes <= VIEW_CLIP_PLANES_MAX; planes++)
        for (size_t first = 0; ok && first < desc->build_count;) {
            struct paint_job job = {.painter = painter, .desc = desc, .builds = builds};
            job.build_count = gather(desc, first, planes, builds, &first);
            ok = !job.build_count || paint_group(&job, err);
        }
    free(builds);
    return ok;
}
