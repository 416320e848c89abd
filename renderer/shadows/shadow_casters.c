/* SPDX-License-Identifier: MIT */
/* Casters of a light: selection, program variants, and one pass over the faces of a map. */
#include "renderer/shadows/shadow_casters.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool reserve_casters(struct shadow_casters *casters, struct error *err)
{
    if (casters->count < casters->capacity)
        return true;
    size_t capacity = casters->capacity ? 2 * casters->capacity : 64;
    uint32_t *items = realloc(casters->items, capacity * sizeof *items);
    if (items)
        casters->items = items;
    uint8_t *faces = items ? realloc(casters->faces, capacity) : NULL;
    if (!faces)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", capacity);
    casters->faces = faces;
    casters->capacity = capacity;
    return true;
}

/* At least as far as any point of the item, in the depth that events have. */
static double farthest_depth(const struct shadow_frame *frame, const struct state_item *item)
{
    double offset[3];
    vec3_sub(item->center, frame->origin, offset);
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    return item->radius_m + (is_flat ? vec3_dot(frame->axis[2], offset) : vec3_length(offset));
}

/* Caps are cut already. */
static bool meets_planes(const struct scene_state *state, const struct state_item *item,
                         uint32_t *through)
{
    *through = 0;
    return item->cap || state_planes_meet(state->shadow_planes, state->shadow_plane_count,
                                          item->bounds_min, item->bounds_max, through);
}

bool shadow_casters_collect(struct shadow_casters *casters, const struct shadow_frame *frame,
                            const struct scene_state *state, struct error *err)
{
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        uint32_t faces = item->casts_shadow ? shadow_frame_faces(frame, item) : 0, planes;
        if (!faces || !meets_planes(state, item, &planes))
            continue;
        if (!reserve_casters(casters, err))
            return false;
        casters->items[casters->count] = (uint32_t)i;
        casters->faces[casters->count++] = (uint8_t)faces;
        if (item->class_ != STATE_TRANSPARENT) {
            casters->opaque_count++;
            casters->opaque_planes |= planes;
            continue;
        }
        const struct state_material *material = &state->materials[item->material];
        casters->transparent_count++;
        casters->transparent_planes |= planes;
        casters->farthest_m = fmax(casters->farthest_m, farthest_depth(frame, item));
        if (material->no_self_shadow || material->cast_once)
            casters->has_exclusions = true;
        casters->has_media |= item->is_medium;
    }
    return true;
}

void shadow_casters_count(const struct shadow_casters *casters, uint32_t face_count,
                          const struct scene_state *state, uint64_t *drawn, uint64_t *culled)
{
    uint64_t seen = 0, all = 0;
    for (size_t i = 0; i < casters->count; i++)
        seen += (uint64_t)__builtin_popcount(casters->faces[i]);
    for (size_t i = 0; i < state->item_count; i++)
        all += state->items[i].casts_shadow;
    *drawn += seen;
    *culled += all * face_count - seen;
}

void shadow_casters_cut(const struct shadow_casters *casters, const struct scene_state *state,
                        struct shadow_map *map)
{
    uint32_t through =
        casters->opaque_planes | (map->kind == SHADOW_MAP ? 0 : casters->transparent_planes);
    for (size_t i = 0; i < state->shadow_plane_count; i++)
        if (through >> i & 1)
            memcpy(map->planes[map->plane_count++], state->shadow_planes[i], sizeof *map->planes);
}

bool shadow_casters_kind(const struct shadow_casters *casters, const struct view_quality *quality,
                         uint32_t *kind)
{
    bool is_linked = quality->shadows == VIEW_SHADOWS_DEEP_LINKED;
    bool has_filters = casters->transparent_count > 0 && quality->shadows != VIEW_SHADOWS_MAP;
    *kind = has_filters ? (is_linked ? SHADOW_LINKED : SHADOW_DEEP) : SHADOW_MAP;
    if (is_linked && quality->faithful && casters->count > 0)
        *kind = SHADOW_LINKED; /* as published: opaque casters are elements too */
    return has_filters || casters->opaque_count > 0;
}

void shadow_casters_finish(struct shadow_casters *casters)
{
    free(casters->items);
    free(casters->faces);
    *casters = (struct shadow_casters){0};
}

bool shadow_casters_copy(const struct shadow_casters *casters, struct shadow_casters *copy,
                         struct error *err)
{
    size_t count = casters->count;
    *copy = *casters;
    copy->capacity = count;
    copy->items = malloc((count + 1) * sizeof *copy->items);
    copy->faces = malloc(count + 1);
    if (!copy->items || !copy->faces) {
        shadow_casters_finish(copy);
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", count);
    }
    memcpy(copy->items, casters->items, count * sizeof *copy->items);
    memcpy(copy->faces, casters->faces, count);
    return true;
}

void caster_painter_finish(struct caster_painter *painter)
{
    free(painter->selected);
    free(painter->records);
    gl_vertex_array_finish(&painter->corners);
    *painter = (struct caster_painter){0};
}

enum { DEFINES_BYTES = 192 };

/* The key of a variant: bits 0..6 sampled texture slots, then these. */
enum {
    VARIANT_TEXTURES = (1 << 7) - 1,
    VARIANT_COLORS = 1 << 7,
    VARIANT_ANGLED = 1 << 8,
    VARIANT_CERTAIN = 1 << 9, /* every fragment makes an event */
    VARIANT_OPAQUE = 1 << 10,
    VARIANT_MASKED = 1 << 11,
    VARIANT_IDS = 1 << 12,
    VARIANT_CONSTANT = 1 << 13,  /* the filter is evaluated per vertex */
    VARIANT_MEDIA = 1 << 14,     /* keep the medium of each event */
    VARIANT_MEDIUM = 1 << 15,    /* the caster is one */
    VARIANT_PASS = 1 << 16,      /* times enum caster_pass, which has three bits */
    VARIANT_SUBTEXELS = 1 << 19, /* times sub-texel samples per side, at most 4 */
    VARIANT_PLANES = 1 << 22,    /* times clip planes, at most 8 */
    VARIANT_CAP = 1 << 26,       /* the caster closes a cut */
    VARIANT_AROUND = 1 << 27,    /* a medium that begins at the cut: no caster is drawn */
};

static uint32_t variant_pass(uint32_t key)
{
    return key / VARIANT_PASS & 7;
}

/* Whether the filter darkens some channel wherever the surface is and at every angle: textures and
 * vertex colours only darken transmission, and coverage is no less than the least alpha. */
static bool filters_everywhere(const struct scene_material *m, float least_alpha,
                               uint32_t blend_filter)
{
    const float darkens = 0.999f;
    float a = m->base_color[3] * least_alpha;
    float least = 1;
    for (int k = 0; k < 3; k++) {
        float base = m->base_color[k]; /* at most */
        float t = m->transmission > 0 ? m->transmission * base : 0;
        if (m->alpha_mode == SCENE_BLEND) {
            if (m->transmission > 0)
                t = 1 - a * (1 - t);
            else if (blend_filter == VIEW_BLEND_TINT)
                t = (1 - a) * (1 - a * (1 - base));
            else
                t = blend_filter == VIEW_BLEND_COVERAGE ? 1 - a : (1 - a) * base;
        }
        least = fminf(least, t);
    }
    return least < darkens;
}

static uint32_t sampled_slots(const struct scene *scene, const struct scene_material *m)
{
    static const int slots[] = {SCENE_TEXTURE_BASE_COLOR, SCENE_TEXTURE_TRANSMISSION,
                                SCENE_TEXTURE_THICKNESS};
    uint32_t mask = 0;
    for (int i = 0; i < 3; i++) {
        int32_t texture = m->textures[slots[i]].texture;
        bool is_used = i == 0 || (m->transmission > 0 && (i == 1 || m->thickness > 0));
        if (is_used && texture >= 0 && scene->textures[texture].image >= 0)
            mask |= 1u << slots[i];
    }
    return mask;
}

static float least_alpha(const struct caster_paint_desc *desc, const struct scene_material *m)
{
    return scene_gpu_least_alpha(desc->scene->gpu, m->textures[SCENE_TEXTURE_BASE_COLOR].texture);
}

struct paint_context {
    struct caster_painter *painter;
    const struct caster_paint_desc *desc;
    uint32_t face;
};

static uint32_t variant_key(const struct caster_paint_desc *desc, const struct state_item *item)
{
    const struct scene *scene = desc->scene->state->scene;
    const struct scene_material *m = &desc->scene->state->materials[item->material].base;
    bool has_colors =
        state_geometry_of(desc->scene->state, item).primitive->flags & SCENE_PRIMITIVE_HAS_COLORS;
    uint32_t key = (uint32_t)desc->pass * VARIANT_PASS +
                   desc->build->map->plane_count * (uint32_t)VARIANT_PLANES +
                   (item->cap && desc->build->map->plane_count ? VARIANT_CAP : 0u);
    uint32_t slots = sampled_slots(scene, m) | (has_colors ? VARIANT_COLORS : 0u);
    if (item->class_ == STATE_OPAQUE)
        return key | VARIANT_OPAQUE;
    if (item->class_ == STATE_MASKED)
        return key | VARIANT_MASKED | (slots & (VARIANT_COLORS | 1u));
    bool is_linked = desc->pass == CASTER_LINK || desc->pass == CASTER_LINK_FAITHFUL;
    bool has_media = !is_linked && (desc->build->map->flags & SHADOW_FLAG_MEDIA);
    bool is_certain =
        !is_linked &&
        ((has_media && item->is_medium) ||
         (m->alpha_mode != SCENE_MASK &&
          filters_everywhere(m, has_colors ? 0 : least_alpha(desc, m), desc->scene->blend_filter)));
    if (is_certain && desc->pass == CASTER_COUNT) /* a medium counts where it is cut away, too */
        return key | VARIANT_CERTAIN |
               (has_media && item->is_medium && desc->build->map->plane_count
                    ? VARIANT_MEDIA | VARIANT_MEDIUM
                    : 0u);
    if (!is_certain && desc->pass == CASTER_SCATTER) /* one program for both passes: they must
                                                        decide alike */
        key -= (uint32_t)(CASTER_SCATTER - CASTER_COUNT) * VARIANT_PASS;
    if (!is_linked && desc->build->map->prefilter > 1)
        key |= (uint32_t)desc->build->map->prefilter * VARIANT_SUBTEXELS;
    key |= slots | (is_certain ? VARIANT_CERTAIN : 0u);
    if (m->pass_through != SCENE_PASS_CONSTANT)
        key |= VARIANT_ANGLED;
    else if (!slots && m->alpha_mode != SCENE_MASK)
        key |= VARIANT_CONSTANT;
    if (!is_linked && (desc->build->map->flags & SHADOW_FLAG_RAW))
        key |= VARIANT_IDS;
    if (has_media)
        key |= VARIANT_MEDIA | (item->is_medium ? VARIANT_MEDIUM : 0u);
    return key;
}

static void write_defines(uint32_t key, char *out, size_t size)
{
    uint32_t pass = variant_pass(key);
    bool is_flat = pass == CASTER_DEPTH && (key & VARIANT_OPAQUE);
    char subtexels[24] = "", planes[32] = "";
    if (key / VARIANT_SUBTEXELS & 7)
        snprintf(subtexels, sizeof subtexels, " SUBTEXELS=%u", key / VARIANT_SUBTEXELS & 7);
    if (key / VARIANT_PLANES & 15)
        snprintf(planes, sizeof planes, " CUT_PLANES=%u%s", key / VARIANT_PLANES & 15,
                 key & VARIANT_CAP ? " IS_CAP" : "");
    snprintf(
        out, size, "TEXTURES=%u%s%s%s%s%s%s%s%s%s%s%s%s%s", key & 127u,
        key & VARIANT_COLORS ? " COLORS" : "", key & VARIANT_CONSTANT ? " CONSTANT" : "",
        key & VARIANT_ANGLED ? " ANGLED" : "", key & VARIANT_IDS ? " IDS" : "",
        key & VARIANT_MEDIA ? " MEDIA" : "", key & VARIANT_MEDIUM ? " MEDIUM" : "",
        key & VARIANT_CERTAIN ? (pass == CASTER_SCATTER ? " CERTAIN PASS=1" : " CERTAIN PASS=0")
                              : "",
        pass == CASTER_LINK_FAITHFUL && (key & (VARIANT_OPAQUE | VARIANT_MASKED)) ? " OPAQUE" : "",
        pass == CASTER_LINK_FAITHFUL ? " SHADOW_FAITHFUL" : "", is_flat ? " DEPTH_ONLY" : "",
        subtexels, planes, key & VARIANT_AROUND ? " AROUND" : "");
}

static struct program_desc variant_program(uint32_t key, char defines[DEFINES_BYTES])
{
    uint32_t pass = variant_pass(key);
    const char *fragment =
        pass == CASTER_DEPTH ? (key & VARIANT_MASKED ? "shadow_depth.frag.glsl" : NULL)
        : pass == CASTER_COUNT || pass == CASTER_SCATTER ? "shadow_deep.frag.glsl"
                                                         : "shadow_linked.frag.glsl";
    write_defines(key, defines, DEFINES_BYTES);
    return (struct program_desc){.label = "shadow.caster",
                                 .vertex = key & VARIANT_AROUND ? "shadow_around.vert.glsl"
                                                                : "shadow_caster.vert.glsl",
                                 .fragment = fragment,
                                 .defines = defines};
}

static struct caster_variant *find_variant(struct caster_painter *painter, uint32_t key,
                                           struct error *err)
{
    for (uint32_t i = 0; i < painter->variant_count; i++)
        if (painter->variants[i].key == key)
            return &painter->variants[i];
    if (painter->variant_count == CASTER_VARIANTS_MAX)
        painter->variant_count = 0; /* the programs stay in their cache */
    char defines[DEFINES_BYTES];
    const struct program_desc desc = variant_program(key, defines);
    const struct gl_program *program = program_cache_get(painter->programs, &desc, err);
    if (!program)
        return NULL;
    struct caster_variant *variant = &painter->variants[painter->variant_count++];
    *variant = (struct caster_variant){.key = key, .program = program};
    return variant;
}

static void set_frame(const struct gl_program *program, const struct shadow_frame *frame,
                      uint32_t face)
{
    static const char *const names[] = {"u_axis_x", "u_axis_y", "u_axis_z"};
    double turn[3][3];
    shadow_frame_face_turn(frame, face, turn);
    for (int k = 0; k < 3; k++)
        gl_program_set_f3(program, names[k],
                          (float[3]){(float)turn[k][0], (float)turn[k][1], (float)turn[k][2]});
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    double unit = frame->unit_m, flat = is_flat ? unit : 1;
    float clip[4] = {(float)(frame->scale[0] * flat), (float)(frame->scale[1] * flat),
                     is_flat ? 1.0f : (float)(frame->near_m / unit),
                     is_flat ? (float)(-unit / frame->depth_m) : 0};
    gl_program_set_f(program, "u_unit_m", (float)unit);
    gl_program_set_f4(program, "u_clip", clip);
    gl_program_set_f4(program, "u_clip_w",
                      (float[4]){is_flat ? 1.0f : 0.0f, is_flat ? 0.0f : 1.0f});
}

/* In the light's space, in metres. */
static void set_planes(const struct gl_program *program, const struct shadow_map *map)
{
    const double(*axis)[3] = map->frame.axis;
    for (uint32_t i = 0; i < map->plane_count; i++) {
        const double *plane = map->planes[i];
        char name[32];
        snprintf(name, sizeof name, "u_cut_planes[%u]", i);
        gl_program_set_f4(program, name,
                          (float[4]){(float)vec3_dot(axis[0], plane),
                                     (float)vec3_dot(axis[1], plane),
                                     (float)vec3_dot(axis[2], plane),
                                     (float)(plane[3] + vec3_dot(plane, map->frame.origin))});
    }
}

static void set_uniforms(const struct paint_context *context, const struct gl_program *program)
{
    const struct caster_paint_desc *desc = context->desc;
    const struct shadow_map *map = desc->build->map;
    bool is_linked = map->kind == SHADOW_LINKED;
    uint64_t face_texels = (uint64_t)map->resolution * (uint64_t)map->resolution;
    /* counts are one ahead of heads: after the scatter, the place of a count holds the end of its
     * list */
    uint64_t first = map->heads.first + (is_linked ? 0u : 1u);
    if (map->window.row_count) /* modulo 2^32, as the shader adds */
        first -= (uint64_t)map->window.first_row * (uint64_t)map->resolution;
    else
        first += context->face * face_texels;
    const struct shadow_range *room = is_linked ? &map->nodes : &map->events;
    set_frame(program, &map->frame, context->face);
    set_planes(program, map);
    if (map->plane_count)
        gl_program_set_f(program, "u_farthest", (float)desc->build->casters.farthest_m);
    gl_program_set_u(program, "u_blend_filter", desc->scene->blend_filter);
    gl_program_set_u(program, "u_first_count", (uint32_t)first);
    gl_program_set_u(program, "u_resolution", (uint32_t)map->resolution);
    gl_program_set_u(program, "u_event_base", (uint32_t)room->first);
    gl_program_set_u(program, "u_event_count", (uint32_t)room->count);
    gl_program_set_u(program, "u_slot", desc->slot);
    gl_program_set_i(program, "u_scatter", desc->pass == CASTER_SCATTER);
}

static const struct gl_program *program_for(void *opaque, const struct state_item *item,
                                            bool *samples_textures, struct error *err)
{
    struct paint_context *context = opaque;
    struct caster_painter *painter = context->painter;
    struct caster_variant *variant = find_variant(painter, variant_key(context->desc, item), err);
    if (!variant)
        return NULL;
    if (variant->prepared != painter->face_number)
        set_uniforms(context, variant->program);
    variant->prepared = painter->face_number;
    *samples_textures = (variant->key & VARIANT_TEXTURES) != 0 && !(variant->key & VARIANT_OPAQUE);
    return variant->program;
}

/* One program counts and scatters: both decide alike which rays enter what is kept. */
static uint32_t around_key(const struct shadow_map *map)
{
    uint32_t key = (uint32_t)CASTER_COUNT * VARIANT_PASS + VARIANT_AROUND + VARIANT_MEDIA +
                   VARIANT_MEDIUM + map->plane_count * (uint32_t)VARIANT_PLANES;
    if (map->prefilter > 1)
        key |= (uint32_t)map->prefilter * VARIANT_SUBTEXELS;
    return key | (map->flags & SHADOW_FLAG_RAW ? VARIANT_IDS : 0u);
}

static bool is_drawn(const struct caster_paint_desc *desc, uint32_t item)
{
    bool is_transparent = desc->scene->state->items[item].class_ == STATE_TRANSPARENT;
    return desc->pass == CASTER_LINK_FAITHFUL || is_transparent == (desc->pass != CASTER_DEPTH);
}

void caster_list_programs(const struct caster_paint_desc *desc, const char *pass,
                          bool is_conditional, struct program_list *list)
{
    const struct shadow_casters *casters = &desc->build->casters;
    uint32_t listed[64]; /* of many casters few have a key of their own */
    size_t listed_count = 0;
    for (size_t i = 0; i < casters->count; i++) {
        char defines[DEFINES_BYTES];
        if (!is_drawn(desc, casters->items[i]))
            continue;
        uint32_t key = variant_key(desc, &desc->scene->state->items[casters->items[i]]);
        size_t at = 0;
        while (at < listed_count && listed[at] != key)
            at++;
        if (at < listed_count)
            continue;
        if (listed_count < sizeof listed / sizeof *listed)
            listed[listed_count++] = key;
        const struct program_desc program = variant_program(key, defines);
        program_list_add(list, pass, &program, is_conditional);
    }
    if (desc->build->map->around_count &&
        (desc->pass == CASTER_COUNT || desc->pass == CASTER_SCATTER)) {
        char defines[DEFINES_BYTES];
        const struct program_desc program = variant_program(around_key(desc->build->map), defines);
        program_list_add(list, pass, &program, is_conditional);
    }
}

static bool select_items(struct caster_painter *painter, const struct caster_paint_desc *desc,
                         uint32_t face, size_t *count, struct error *err)
{
    const struct shadow_casters *casters = &desc->build->casters;
    if (painter->selected_capacity < casters->count) {
        uint32_t *grown = realloc(painter->selected, casters->count * sizeof *grown);
        if (grown)
            painter->selected = grown;
        uint32_t *records =
            grown ? realloc(painter->records, casters->count * sizeof *records) : NULL;
        if (!records)
            return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", casters->count);
        painter->records = records;
        painter->selected_capacity = casters->count;
    }
    *count = 0;
    for (size_t i = 0; i < casters->count; i++) {
        if (!(casters->faces[i] >> face & 1) || !is_drawn(desc, casters->items[i]))
            continue;
        painter->selected[*count] = casters->items[i];
        painter->records[(*count)++] = desc->build->placement.first_record + (uint32_t)i;
    }
    return true;
}

/* Colour mask off and a depth attachment: without either, llvmpipe loses side effects of fragments.
 */
static void set_state(const struct caster_paint_desc *desc)
{
    static const GLenum disabled[] = {GL_BLEND,
                                      GL_SCISSOR_TEST,
                                      GL_STENCIL_TEST,
                                      GL_POLYGON_OFFSET_FILL,
                                      GL_DEPTH_CLAMP,
                                      GL_SAMPLE_ALPHA_TO_COVERAGE,
                                      GL_RASTERIZER_DISCARD};
    for (size_t i = 0; i < sizeof disabled / sizeof *disabled; i++)
        glDisable(disabled[i]);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(desc->pass == CASTER_LINK_FAITHFUL ? GL_ALWAYS : GL_GREATER);
    glDepthMask(desc->pass == CASTER_DEPTH);
    int side = desc->build->map->resolution;
    const struct shadow_window *window = &desc->build->map->window;
    glViewport(0, 0, side, side);
    if (window->row_count) { /* of the same picture, to the bit */
        glEnable(GL_SCISSOR_TEST);
        glScissor(0, window->first_row, side, window->row_count);
    }
}

/* The media around a light that is cut away: an event of each texel whose ray enters what is kept.
 */
static bool paint_around(const struct paint_context *context, struct error *err)
{
    struct caster_painter *painter = context->painter;
    const struct caster_paint_desc *desc = context->desc;
    const struct shadow_map *map = desc->build->map;
    const struct scene_state *state = desc->scene->state;
    struct caster_variant *variant = find_variant(painter, around_key(map), err);
    if (!variant)
        return false;
    if (!painter->corners.name)
        gl_vertex_array_init(&painter->corners, "shadow.around");
    set_uniforms(context, variant->program);
    gl_program_use(variant->program);
    glBindVertexArray(painter->corners.name);
    for (uint32_t i = 0; i < map->around_count; i++) {
        const struct state_item *item = &state->items[map->around[i].item];
        uint32_t once = state->materials[item->material].cast_once ? 0x80000000u : 0u;
        uint32_t medium = 2 * draw_arena_material(desc->scene->arena, map->around[i].item);
        gl_program_set_u2(variant->program, "u_around", medium + (map->around[i].enters ? 3 : 2),
                          item->node | once);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    return true;
}

static void cut_casters(const struct shadow_map *map, bool is_on)
{
    for (uint32_t i = 0; i < map->plane_count; i++)
        (is_on ? glEnable : glDisable)(GL_CLIP_DISTANCE0 + i);
}

static bool paint_face(struct caster_painter *painter, const struct caster_paint_desc *desc,
                       uint32_t face, struct error *err)
{
    const struct shadow_map *map = desc->build->map;
    uint32_t layer = desc->build->target_layer + (map->window.row_count ? 0 : face);
    size_t count = 0;
    if (!select_items(painter, desc, face, &count, err))
        return false;
    struct gl_framebuffer framebuffer = {0};
    if (!gl_framebuffer_init(&framebuffer,
                             &(struct gl_framebuffer_desc){.label = "shadow.face",
                                                           .depth = &desc->store->target,
                                                           .depth_layer = (int)layer},
                             err))
        return false;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name);
    set_state(desc);
    cut_casters(map, true);
    if (desc->pass == CASTER_DEPTH)
        glClearNamedFramebufferfv(framebuffer.name, GL_DEPTH, 0, &(GLfloat){0});
    painter->face_number++;
    struct paint_context context = {painter, desc, face};
    struct draw_desc draw = {
        .gpu = desc->scene->gpu,
        .state = desc->scene->state,
        .arena = desc->scene->arena,
        .items = painter->selected,
        .records = painter->records,
        .item_count = count,
        .texture_pass = 1 + (size_t)desc->build->light,
        .program_for = program_for,
        .context = &context,
    };
    bool ok = draws_submit(&draw, NULL, err);
    cut_casters(map, false);
    if (ok && map->around_count && (desc->pass == CASTER_COUNT || desc->pass == CASTER_SCATTER))
        ok = paint_around(&context, err);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_framebuffer_finish(&framebuffer);
    glDisable(GL_SCISSOR_TEST);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    return ok;
}

bool caster_painter_paint(struct caster_painter *painter, const struct caster_paint_desc *desc,
                          struct error *err)
{
    const struct shadow_map *map = desc->build->map;
    assert(desc->store->target.width == map->resolution);
    struct draw_place_desc place = {.state = desc->scene->state,
                                    .items = desc->build->casters.items,
                                    .item_count = desc->build->casters.count};
    memcpy(place.space.origin, map->frame.origin, sizeof place.space.origin);
    memcpy(place.space.axes, map->frame.axis, sizeof place.space.axes);
    place.space.unit_m = map->frame.unit_m;
    if (!draw_arena_place(desc->scene->arena, &place, &desc->build->placement, err))
        return false;
    if (map->window.row_count)
        return paint_face(painter, desc, map->window.face, err);
    for (uint32_t face = 0; face < map->frame.face_count; face++)
        if (!paint_face(painter, desc, face, err))
            return false;
    return true;
}
