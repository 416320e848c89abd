/* SPDX-License-Identifier: MIT */
/* Culling against the camera, shader variants by material, and the camera's draw passes. */
#include "renderer/window/geometry.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/frustum.h"
#include "shaders/shared/bindings.h"

enum { VARIANT_BYTES = 256 };

enum { LIST_OPAQUE, LIST_TRANSPARENT, LIST_MEDIA };

struct sort_key {
    double distance;
    uint32_t item, list;
};

static int compare_keys(const void *a, const void *b)
{
    const struct sort_key *x = a, *y = b;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return x->item < y->item ? -1 : x->item > y->item;
}

/* The bounding box reaches the eye, up to the near plane's corners; an orthographic camera's near
 * plane. */
static bool reaches_eye(const struct camera *camera, const struct state_item *item)
{
    double wx = camera->half_width, wy = camera->half_height, nearest = 0;
    double margin = camera->z_near * sqrt(1 + wx * wx + wy * wy) * 1.0001;
    bool is_inside = true;
    for (int k = 0; k < 3; k++) {
        double low = item->bounds_min[k] - camera->eye[k];
        double high = item->bounds_max[k] - camera->eye[k];
        nearest += fmin(-camera->back[k] * low, -camera->back[k] * high);
        is_inside = is_inside && low <= margin && high >= -margin;
    }
    return camera->is_orthographic ? nearest <= camera->z_near * 1.0001 : is_inside;
}

/* Opaque items, then transparent ones, then media, each near to far. */
static void list_items(const struct window_frame *frame, const struct sort_key *keys, size_t count,
                       struct geometry_items *items)
{
    uint32_t *next[3];
    size_t counts[3] = {0, 0, 0};
    for (size_t i = 0; i < count; i++)
        counts[keys[i].list]++;
    for (int list = 0; list < 3; list++)
        next[list] = list ? next[list - 1] + counts[list - 1] : items->drawn;
    items->opaque = next[0], items->opaque_count = counts[0];
    items->transparent = next[1], items->transparent_count = counts[1];
    items->media = next[2], items->medium_count = counts[2];
    for (size_t i = 0; i < count; i++) {
        *next[keys[i].list]++ = keys[i].item;
        if (keys[i].list == LIST_MEDIA)
            items->may_surround |= reaches_eye(frame->camera, &frame->state->items[keys[i].item]);
    }
}

static bool sort_items(const struct window_frame *frame, bool takes_all,
                       struct geometry_items *items, struct error *err)
{
    const struct scene_state *state = frame->state;
    struct frustum frustum;
    *items = (struct geometry_items){0};
    struct sort_key *keys = malloc((state->item_count + 1) * sizeof *keys);
    if (!keys)
        return error_set(err, ERROR_NO_MEMORY, "%zu drawables", state->item_count);
    frustum_init(&frustum, frame->camera, &frame->window);
    size_t count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        double v[3];
        if (!takes_all && !frustum_meets(&frustum, item))
            continue;
        vec3_sub(item->center, frame->camera->eye, v);
        keys[count++] = (struct sort_key){vec3_length(v) - item->radius_m, (uint32_t)i,
                                          item->is_medium                     ? LIST_MEDIA
                                          : item->class_ == STATE_TRANSPARENT ? LIST_TRANSPARENT
                                                                              : LIST_OPAQUE};
    }
    items->culled_count = state->item_count - count;
    items->drawn = malloc((count + 1) * sizeof *items->drawn);
    if (items->drawn) {
        qsort(keys, count, sizeof *keys, compare_keys);
        list_items(frame, keys, count, items);
    }
    free(keys);
    return items->drawn || error_set(err, ERROR_NO_MEMORY, "%zu drawables", count);
}

bool geometry_cull(const struct window_frame *frame, struct geometry_items *items,
                   struct error *err)
{
    return sort_items(frame, false, items, err);
}

bool geometry_take_all(const struct window_frame *frame, struct geometry_items *items,
                       struct error *err)
{
    return sort_items(frame, true, items, err);
}

void geometry_items_finish(struct geometry_items *items)
{
    free(items->drawn);
    *items = (struct geometry_items){0};
}

/* Bits of a variant above the mask of its textures. */
enum {
    VARIANT_TEXTURES = (1 << SCENE_TEXTURE_SLOT_COUNT) - 1,
    VARIANT_TANGENT = 1 << 22,
    VARIANT_COLOR = 1 << 23,
    VARIANT_NORMAL_MAP = 1 << 24,
    VARIANT_MASKED = 1 << 25,
    VARIANT_MEDIUM = 1 << 26,
    VARIANT_CAP = 1 << 27,
    VARIANT_LOBES = 1 << 28,
    VARIANT_MORE_LOBES = 1 << 29,
    VARIANT_GRAIN = 1 << 30,
    KNOWN_VARIANTS = 256, /* a power of two */
};
static_assert(SCENE_TEXTURE_SLOT_COUNT <= 22, "the other bits of a variant are above");

/* A program in use, its uniforms set. */
struct known_variant {
    uint32_t variant;
    const struct gl_program *program; /* NULL: the place is free */
};

static const uint32_t NORMAL_MAPS =
    1u << SCENE_TEXTURE_NORMAL | 1u << SCENE_TEXTURE_CLEARCOAT_NORMAL;

struct variant_context {
    const struct window_frame *frame;
    const char *fragment;
    const uint32_t *items; /* of a submission */
    bool evaluates;
    bool is_layer;
    bool has_normal_offset;                     /* smooth surfaces say how far */
    bool is_hidden;                             /* of media: the part behind the opaque depth */
    float across[4], depth[4];                  /* camera_clip */
    struct known_variant known[KNOWN_VARIANTS]; /* of two with one place the last */
};

/* A texture without its lobe changes nothing. */
static bool slot_matters(const struct scene_material *m, int slot)
{
    switch (slot) {
    case SCENE_TEXTURE_CLEARCOAT:
    case SCENE_TEXTURE_CLEARCOAT_ROUGHNESS:
    case SCENE_TEXTURE_CLEARCOAT_NORMAL:
        return m->clearcoat > 0;
    case SCENE_TEXTURE_SHEEN_COLOR:
    case SCENE_TEXTURE_SHEEN_ROUGHNESS:
        return scene_material_has_sheen(m);
    case SCENE_TEXTURE_IRIDESCENCE:
    case SCENE_TEXTURE_IRIDESCENCE_THICKNESS:
        return m->iridescence > 0;
    case SCENE_TEXTURE_ANISOTROPY:
        return m->anisotropy > 0;
    case SCENE_TEXTURE_DIFFUSE_TRANSMISSION:
    case SCENE_TEXTURE_DIFFUSE_TRANSMISSION_COLOR:
        return m->diffuse_transmission > 0;
    default:
        return true;
    }
}

static uint32_t texture_mask(const struct scene *scene, const struct scene_material *m)
{
    uint32_t mask = 0;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (m->textures[slot].texture >= 0 && slot_matters(m, slot) &&
            scene->textures[m->textures[slot].texture].image >= 0)
            mask |= 1u << slot;
    return mask;
}

/* Whether the primitive says which way along the surface is which, for an anisotropic material. */
static bool has_grain(const struct scene_primitive *p, const struct scene_material *m)
{
    uint32_t set = m->textures[SCENE_TEXTURE_ANISOTROPY].texcoord ? SCENE_PRIMITIVE_HAS_TEXCOORDS_1
                                                                  : SCENE_PRIMITIVE_HAS_TEXCOORDS_0;
    return m->anisotropy > 0 && !(m->flags & SCENE_MATERIAL_UNLIT) &&
           (p->flags & (set | SCENE_PRIMITIVE_HAS_TANGENTS));
}

/* What one item requires of its shaders. */
static uint32_t variant_of(const struct variant_context *context, const struct state_item *item)
{
    const struct scene *scene = context->frame->state->scene;
    const struct scene_primitive *p = state_geometry_of(context->frame->state, item).primitive;
    const struct state_material *material = &context->frame->state->materials[item->material];
    const struct scene_material *m = &material->base;
    uint32_t variant = item->is_medium ? VARIANT_MEDIUM : item->cap ? VARIANT_CAP : 0;
    if (!context->evaluates)
        return variant;
    if (p->flags & (SCENE_PRIMITIVE_HAS_TEXCOORDS_0 | SCENE_PRIMITIVE_HAS_TEXCOORDS_1))
        variant |= texture_mask(scene, m);
    if (m->flags & SCENE_MATERIAL_UNLIT)
        variant &= ~NORMAL_MAPS;
    if (variant & NORMAL_MAPS)
        variant |= VARIANT_NORMAL_MAP;
    if (has_grain(p, m))
        variant |= VARIANT_GRAIN;
    if ((variant & (VARIANT_NORMAL_MAP | VARIANT_GRAIN)) &&
        (p->flags & SCENE_PRIMITIVE_HAS_TANGENTS))
        variant |= VARIANT_TANGENT;
    if (p->flags & SCENE_PRIMITIVE_HAS_COLORS)
        variant |= VARIANT_COLOR;
    uint32_t lobes = context->is_layer ? 0 : shader_needs_lobes(material_flags(material));
    variant |= (lobes > 0 ? (uint32_t)VARIANT_LOBES : 0u) |
               (lobes > 1 ? (uint32_t)VARIANT_MORE_LOBES : 0u);
    if (item->class_ == STATE_MASKED || m->alpha_mode == SCENE_MASK)
        variant |= VARIANT_MASKED;
    return variant;
}

/* The variant's definitions, in canonical order. */
static void describe_variant(const struct variant_context *context, uint32_t variant,
                             char text[VARIANT_BYTES])
{
    size_t planes = context->frame->view->clip_plane_count;
    int used = 0;
    text[0] = 0;
    if (planes)
        used += snprintf(text + used, VARIANT_BYTES - (size_t)used, "%s_PLANES=%zu%s ",
                         variant & VARIANT_MEDIUM ? "CUT" : "CLIP", planes,
                         variant & VARIANT_CAP ? " IS_CAP" : "");
    bool has_coverage = context->frame->targets->samples > 1;
    bool is_by_depth =
        has_coverage && context->is_layer && !context->frame->limits->has_post_depth_coverage;
    if (!context->evaluates) {
        snprintf(text + used, VARIANT_BYTES - (size_t)used, "%s%s",
                 has_coverage ? "HAS_COVERAGE" : "", is_by_depth ? " COVERAGE_BY_DEPTH" : "");
        return;
    }
    uint32_t mask = variant & VARIANT_TEXTURES;
    const bool needs_coordinates = (variant & (VARIANT_GRAIN | VARIANT_TANGENT)) == VARIANT_GRAIN;
    char kinds[SHADER_NEEDS_TEXT_BYTES] = "";
    if (context->is_layer)
        shader_needs_material_defines(context->frame->needs->layer_kinds, kinds);
    snprintf(text + used, VARIANT_BYTES - (size_t)used, "TEXTURES=%u%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s",
             mask, mask || needs_coordinates ? " HAS_TEXCOORDS" : "",
             variant & VARIANT_LOBES ? " HAS_LOBES" : "",
             variant & VARIANT_MORE_LOBES ? " HAS_MORE_LOBES" : "",
             variant & VARIANT_GRAIN ? " HAS_GRAIN" : "",
             variant & VARIANT_TANGENT ? " HAS_TANGENT" : "",
             variant & VARIANT_COLOR ? " HAS_COLOR" : "",
             variant & VARIANT_NORMAL_MAP ? " HAS_NORMAL_MAP" : "",
             variant & VARIANT_MASKED ? " IS_MASKED" : "",
             context->frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "",
             has_coverage ? " HAS_COVERAGE" : "",
             context->has_normal_offset ? " HAS_NORMAL_OFFSET" : "",
             is_by_depth ? " COVERAGE_BY_DEPTH" : "", variant & VARIANT_MEDIUM ? " IS_MEDIUM" : "",
             context->is_hidden ? " IS_HIDDEN" : "", kinds);
}

static void set_variant_uniforms(const struct variant_context *context,
                                 const struct gl_program *program)
{
    const struct window_frame *frame = context->frame;
    gl_program_set_f4(program, "u_clip_across", context->across);
    gl_program_set_f4(program, "u_clip_depth", context->depth);
    gl_program_set_u(program, "u_width_px", (uint32_t)frame->window.width);
    gl_program_set_u(program, "u_list_room", frame->list_room);
    gl_program_set_u(program, "u_object_rank", frame->object_rank);
    window_set_samples(frame, program);
    window_set_clip_planes(frame, frame->state->unit_m, program);
}

/* The program of a variant; its defines are written to the caller's text. */
static struct program_desc variant_program(const struct variant_context *context, uint32_t variant,
                                           char defines[VARIANT_BYTES])
{
    describe_variant(context, variant, defines);
    return (struct program_desc){.label = context->fragment,
                                 .vertex = "geometry.vert.glsl",
                                 .fragment = context->fragment,
                                 .defines = defines};
}

static const struct gl_program *prepare_variant(const struct variant_context *context,
                                                uint32_t variant, struct error *err)
{
    char defines[VARIANT_BYTES];
    const struct program_desc desc = variant_program(context, variant, defines);
    const struct gl_program *program = program_cache_get(context->frame->programs, &desc, err);
    if (program)
        set_variant_uniforms(context, program);
    return program;
}

static uint32_t place_of(uint32_t variant)
{
    return variant * 0x9e3779b9u >> 24;
}

static bool choose(void *opaque, size_t index, struct draw_choice *choice, struct error *err)
{
    struct variant_context *context = opaque;
    uint32_t variant = variant_of(context, &context->frame->state->items[context->items[index]]);
    struct known_variant *known = &context->known[place_of(variant)];
    if (!known->program || known->variant != variant)
        *known = (struct known_variant){.variant = variant,
                                        .program = prepare_variant(context, variant, err)};
    choice->program = known->program;
    choice->samples_textures = (variant & VARIANT_TEXTURES) != 0;
    return choice->program != NULL;
}

struct pass { /* one submission */
    const uint32_t *items;
    size_t count;
    const char *fragment;
    bool evaluates, clips, is_layer, is_hidden;
};

static struct variant_context context_of(const struct window_frame *frame, const struct pass *pass)
{
    return (struct variant_context){.frame = frame,
                                    .fragment = pass->fragment,
                                    .evaluates = pass->evaluates,
                                    .is_layer = pass->is_layer,
                                    .has_normal_offset = pass->evaluates && !pass->is_layer &&
                                                         frame->needs->has_normal_offset,
                                    .is_hidden = pass->is_hidden};
}

static void enable_clipping(const struct window_frame *frame, bool is_on)
{
    for (size_t i = 0; i < frame->view->clip_plane_count; i++)
        (is_on ? glEnable : glDisable)(GL_CLIP_DISTANCE0 + (GLenum)i);
}

static size_t drawn_count(const struct geometry_items *items)
{
    return items->opaque_count + items->transparent_count + items->medium_count;
}

/* The pass's items that the window sees, and their records; the lists are those of the image. */
struct selection {
    uint32_t *items, *records; /* owned */
    size_t count;
};

static bool select_items(const struct window_frame *frame, const struct pass *pass,
                         uint32_t first_record, struct selection *selection, struct error *err)
{
    struct frustum frustum;
    *selection = (struct selection){.items = malloc((pass->count + 1) * sizeof(uint32_t)),
                                    .records = malloc((pass->count + 1) * sizeof(uint32_t))};
    if (!selection->items || !selection->records)
        return error_set(err, ERROR_NO_MEMORY, "%zu drawables", pass->count);
    frustum_init(&frustum, frame->camera, &frame->window);
    bool is_whole = frame->window.width == frame->window.image_width &&
                    frame->window.height == frame->window.image_height;
    for (size_t i = 0; i < pass->count; i++) {
        if (!is_whole && !frustum_meets(&frustum, &frame->state->items[pass->items[i]]))
            continue;
        selection->items[selection->count] = pass->items[i];
        selection->records[selection->count++] = first_record + (uint32_t)i;
    }
    return true;
}

static void selection_finish(struct selection *selection)
{
    free(selection->items);
    free(selection->records);
}

/* Where the records of the image's items are; they stand for all passes and windows. */
static bool place_items(const struct window_frame *frame, const struct geometry_items *items,
                        uint32_t *first_record, struct error *err)
{
    struct draw_placement placement = {0};
    struct draw_place_desc place = {
        .state = frame->state, .items = items->drawn, .item_count = drawn_count(items)};
    memcpy(place.space.origin, frame->camera->eye, sizeof place.space.origin);
    camera_axes(frame->camera, place.space.axes);
    place.space.unit_m = frame->state->unit_m;
    bool ok = draw_arena_place(frame->arena, &place, &placement, err);
    *first_record = placement.first_record;
    return ok;
}

static bool draw_selection(const struct window_frame *frame, const struct selection *selection,
                           const struct pass *pass, struct error *err)
{
    struct variant_context context = context_of(frame, pass);
    context.items = selection->items;
    const struct camera_part part = camera_part_of(&frame->window);
    camera_clip(frame->camera, &part, frame->state->unit_m, context.across, context.depth);
    struct draw_desc desc = {
        .gpu = frame->gpu,
        .state = frame->state,
        .arena = frame->arena,
        .items = selection->items,
        .records = selection->records,
        .item_count = selection->count,
        .cull_back_faces = true,
        .choose = choose,
        .context = &context,
    };
    struct draw_counts counts = {0};
    if (pass->clips)
        enable_clipping(frame, true);
    bool ok = draws_submit(&desc, &counts, err);
    enable_clipping(frame, false);
    frame->report->counts.draws += counts.draws;
    frame->report->counts.draw_calls += counts.calls;
    frame->report->counts.triangles += counts.triangles;
    return ok;
}

static bool submit(const struct window_frame *frame, const struct geometry_items *items,
                   const struct pass *pass, struct error *err)
{
    uint32_t first_record;
    struct selection selection = {0};
    bool ok = place_items(frame, items, &first_record, err) &&
              select_items(frame, pass, first_record + (uint32_t)(pass->items - items->drawn),
                           &selection, err) &&
              draw_selection(frame, &selection, pass, err);
    selection_finish(&selection);
    return ok;
}

static void set_depth_state(const struct window_frame *frame, bool writes)
{
    const struct camera_window *w = &frame->window;
    const struct camera_part part = camera_part_of(w);
    /* the part's, so that vertices are where they are in any window, but for rounding */
    glViewportIndexedf(0, (float)(w->shift_px[0] + part.x - w->x),
                       (float)(w->shift_px[1] + w->y + w->height - part.y - part.height),
                       (float)part.width, (float)part.height);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
    /* reversed Z; equal passes for transparent layers on an opaque surface, as for equal opaque
     * ones */
    glDepthFunc(GL_GEQUAL);
    glDepthMask(writes);
    glColorMask(writes, writes, writes, writes);
    if (frame->targets->samples > 1)
        glEnable(GL_MULTISAMPLE);
    else
        glDisable(GL_MULTISAMPLE);
    glPointSize(3);
}

static struct pass opaque_pass(const struct geometry_items *items)
{
    return (struct pass){.items = items->opaque,
                         .count = items->opaque_count,
                         .fragment = "gbuffer.frag.glsl",
                         .evaluates = true,
                         .clips = true};
}

static struct pass transparent_pass(const struct geometry_items *items, const char *fragment,
                                    bool evaluates)
{
    return (struct pass){.items = items->transparent,
                         .count = items->transparent_count,
                         .fragment = fragment,
                         .is_layer = true,
                         .evaluates = evaluates,
                         .clips = true};
}

/* Not cut: media are drawn whole. */
static struct pass medium_pass(const struct geometry_items *items, const char *fragment,
                               bool evaluates)
{
    return (struct pass){.items = items->media,
                         .count = items->medium_count,
                         .fragment = fragment,
                         .is_layer = true,
                         .evaluates = evaluates};
}

bool geometry_draw_opaque(const struct window_frame *frame, const struct geometry_items *items,
                          struct error *err)
{
    static const GLuint zero[4] = {0};
    static const GLfloat far_ = 0;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = "gbuffer",
                                         .because = "opaque and masked surfaces are in view",
                                         .stage = REPORT_SHADE,
                                     });
    set_depth_state(frame, true);
    glBindFramebuffer(GL_FRAMEBUFFER, frame->targets->gbuffer.name);
    glClearNamedFramebufferuiv(frame->targets->gbuffer.name, GL_COLOR, 0, zero);
    glClearNamedFramebufferuiv(frame->targets->gbuffer.name, GL_COLOR, 1, zero);
    if (frame->targets->samples > 1)
        glClearNamedFramebufferuiv(frame->targets->gbuffer.name, GL_COLOR, 2, zero);
    glClearNamedFramebufferfv(frame->targets->gbuffer.name, GL_DEPTH, 0, &far_);
    frame->report->counts.culled = items->culled_count;
    const struct pass pass = opaque_pass(items);
    uint64_t calls = frame->report->counts.draw_calls;
    bool ok = submit(frame, items, &pass, err);
    if (calls == frame->report->counts.draw_calls)
        gl_framebuffer_apply_clears();
    gpu_scope_end(frame->timeline);
    return ok;
}

/* Layers find the samples that they cover by the depth map of their own target, which they do not
 * write. */
static bool begin_layers(const struct window_frame *frame)
{
    const struct window_bounds *bounds = &frame->layer_bounds;
    set_depth_state(frame, false);
    if (bounds->width) {
        glEnable(GL_SCISSOR_TEST);
        glScissor(bounds->x, bounds->y, bounds->width, bounds->height);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, frame->targets->depth_only.name);
    if (frame->targets->samples == 1 || frame->limits->has_post_depth_coverage)
        return false;
    gl_texture_bind(&frame->targets->depth, UNIT_GBUFFER_DEPTH);
    glBindSampler(UNIT_GBUFFER_DEPTH, 0);
    glTextureBarrier();
    return true;
}

static void end_layers(void)
{
    glDisable(GL_SCISSOR_TEST);
    glDepthFunc(GL_GEQUAL);
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

bool geometry_draw_transparent(const struct window_frame *frame, const struct geometry_items *items,
                               const char *fragment, bool evaluates, struct error *err)
{
    bool finds_coverage = begin_layers(frame);
    struct pass pass = transparent_pass(items, fragment, evaluates);
    bool ok = submit(frame, items, &pass, err);
    pass = medium_pass(items, fragment, evaluates);
    if (finds_coverage && items->may_surround) /* the shader alone says which of the two draws of a
                                                  medium has a sample: none is lost between them */
        glDepthFunc(GL_ALWAYS);
    ok = ok && submit(frame, items, &pass, err);
    if (ok && items->may_surround) {
        pass.is_hidden = true;
        if (!finds_coverage)
            glDepthFunc(GL_LESS); /* what the draw before did not pass */
        glEnable(GL_DEPTH_CLAMP); /* and what lies beyond the far plane */
        ok = submit(frame, items, &pass, err);
        glDisable(GL_DEPTH_CLAMP);
    }
    end_layers();
    return ok;
}

bool geometry_draw_transparent_item(const struct window_frame *frame,
                                    const struct geometry_items *items, size_t place,
                                    const char *fragment, bool evaluates, struct error *err)
{
    begin_layers(frame);
    struct pass pass = transparent_pass(items, fragment, evaluates);
    pass.items += place;
    pass.count = 1;
    bool ok = submit(frame, items, &pass, err);
    end_layers();
    return ok;
}

/* ---- programs ---- */

struct listing { /* of the programs of one pass of the plan */
    const struct window_frame *frame;
    const char *pass;
    bool is_conditional;
    struct program_list *list;
};

static void list_variants(const struct listing *listing, const struct pass *pass)
{
    uint64_t listed[KNOWN_VARIANTS] = {0}; /* variant + 1 of each place, the last of two */
    const struct variant_context context = context_of(listing->frame, pass);
    for (size_t i = 0; i < pass->count; i++) {
        uint32_t variant = variant_of(&context, &listing->frame->state->items[pass->items[i]]);
        char defines[VARIANT_BYTES];
        if (listed[place_of(variant)] == (uint64_t)variant + 1)
            continue;
        listed[place_of(variant)] = (uint64_t)variant + 1;
        const struct program_desc desc = variant_program(&context, variant, defines);
        program_list_add(listing->list, listing->pass, &desc, listing->is_conditional);
    }
}

void geometry_list_opaque(const struct window_frame *frame, const struct geometry_items *items,
                          struct program_list *list)
{
    const struct listing listing = {.frame = frame, .pass = "gbuffer", .list = list};
    const struct pass pass = opaque_pass(items);
    list_variants(&listing, &pass);
}

void geometry_list_transparent(const struct window_frame *frame, const struct geometry_items *items,
                               const struct geometry_layer_pass *layers, struct program_list *list)
{
    const struct listing listing = {.frame = frame,
                                    .pass = layers->pass,
                                    .is_conditional = layers->is_conditional,
                                    .list = list};
    struct pass pass = transparent_pass(items, layers->fragment, layers->evaluates);
    list_variants(&listing, &pass);
    pass = medium_pass(items, layers->fragment, layers->evaluates);
    list_variants(&listing, &pass);
    pass.is_hidden = true;
    if (items->may_surround)
        list_variants(&listing, &pass);
}
