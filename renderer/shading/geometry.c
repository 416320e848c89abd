/* SPDX-License-Identifier: MIT */
/* Culling against the camera, shader variants by material, and the camera's draw passes. */
#include "renderer/shading/geometry.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/scene/matrix.h"

enum { VARIANT_BYTES = 256 };

struct sort_key {
    double distance;
    uint32_t item;
};

static int compare_keys(const void *a, const void *b)
{
    const struct sort_key *x = a, *y = b;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return x->item < y->item ? -1 : x->item > y->item;
}

/* Bounding sphere against the whole image's frustum; the window is a part of it. */
static bool is_in_view(const struct camera *camera, const struct state_item *item)
{
    double v[3];
    vec3_sub(item->center, camera->eye, v);
    double x = vec3_dot(v, camera->right), y = vec3_dot(v, camera->up);
    double z = -vec3_dot(v, camera->back);
    double radius = item->radius_m * 1.0001;
    double wx = camera->half_width, wy = camera->half_height;
    if (camera->is_orthographic)
        return fabs(x) <= wx + radius && fabs(y) <= wy + radius;
    if (z < -radius)
        return false;
    return fabs(x) - z * wx <= radius * sqrt(1 + wx * wx) &&
           fabs(y) - z * wy <= radius * sqrt(1 + wy * wy);
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

bool geometry_cull(const struct window_frame *frame, struct geometry_items *items,
                   struct error *err)
{
    const struct scene_state *state = frame->state;
    *items = (struct geometry_items){0};
    struct sort_key *keys = calloc(state->item_count + 1, sizeof *keys);
    items->opaque = calloc(state->item_count + 1, sizeof *items->opaque);
    items->transparent = calloc(state->item_count + 1, sizeof *items->transparent);
    items->media = calloc(state->medium_count + 1, sizeof *items->media);
    if (!keys || !items->opaque || !items->transparent || !items->media) {
        free(keys);
        geometry_items_finish(items);
        return error_set(err, ERROR_NO_MEMORY, "%zu drawables", state->item_count);
    }
    size_t count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        if (!is_in_view(frame->camera, &state->items[i]))
            continue;
        double v[3];
        vec3_sub(state->items[i].center, frame->camera->eye, v);
        keys[count++] = (struct sort_key){vec3_length(v) - state->items[i].radius_m, (uint32_t)i};
    }
    qsort(keys, count, sizeof *keys, compare_keys);
    for (size_t i = 0; i < count; i++) {
        const struct state_item *item = &state->items[keys[i].item];
        if (item->is_medium) {
            items->media[items->medium_count++] = keys[i].item;
            items->may_surround |= reaches_eye(frame->camera, item);
        } else if (item->class_ == STATE_TRANSPARENT)
            items->transparent[items->transparent_count++] = keys[i].item;
        else
            items->opaque[items->opaque_count++] = keys[i].item;
    }
    free(keys);
    return true;
}

void geometry_items_finish(struct geometry_items *items)
{
    free(items->opaque);
    free(items->transparent);
    free(items->media);
    *items = (struct geometry_items){0};
}

struct variant_context {
    const struct window_frame *frame;
    const char *fragment;
    bool evaluates;
    bool is_hidden; /* of media: the part behind the opaque depth */
    float clip_from_relative[16];
};

static uint32_t texture_mask(const struct scene *scene, const struct scene_material *m)
{
    uint32_t mask = 0;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (m->textures[slot].texture >= 0 && scene->textures[m->textures[slot].texture].image >= 0)
            mask |= 1u << slot;
    return mask;
}

/* The requirements of one item on its shaders, in canonical order. */
static void describe_variant(const struct variant_context *context, const struct state_item *item,
                             char text[VARIANT_BYTES])
{
    const struct scene *scene = context->frame->state->scene;
    const struct scene_primitive *p = &scene->primitives[item->primitive];
    const struct scene_material *m = &context->frame->state->materials[item->material].base;
    size_t planes = context->frame->view->clip_plane_count;
    int used = 0;
    text[0] = 0;
    if (planes)
        used += snprintf(text + used, VARIANT_BYTES - (size_t)used, "%s_PLANES=%zu ",
                         item->is_medium ? "CUT" : "CLIP", planes);
    if (!context->evaluates)
        return;
    uint32_t mask = texture_mask(scene, m);
    bool has_uv = (p->flags & (SCENE_PRIMITIVE_HAS_TEXCOORDS_0 | SCENE_PRIMITIVE_HAS_TEXCOORDS_1));
    if (!has_uv)
        mask = 0;
    bool is_lit = !(m->flags & SCENE_MATERIAL_UNLIT);
    bool has_normal_map = is_lit && (mask & 1u << SCENE_TEXTURE_NORMAL);
    if (!has_normal_map)
        mask &= ~(1u << SCENE_TEXTURE_NORMAL);
    bool is_masked = item->class_ == STATE_MASKED || m->alpha_mode == SCENE_MASK;
    bool has_coverage = context->frame->targets->samples > 1;
    snprintf(text + used, VARIANT_BYTES - (size_t)used, "TEXTURES=%u%s%s%s%s%s%s%s%s%s", mask,
             mask ? " HAS_TEXCOORDS" : "",
             has_normal_map && (p->flags & SCENE_PRIMITIVE_HAS_TANGENTS) ? " HAS_TANGENT" : "",
             p->flags & SCENE_PRIMITIVE_HAS_COLORS ? " HAS_COLOR" : "",
             has_normal_map ? " HAS_NORMAL_MAP" : "", is_masked ? " IS_MASKED" : "",
             context->frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "",
             has_coverage ? " HAS_COVERAGE" : "", item->is_medium ? " IS_MEDIUM" : "",
             context->is_hidden ? " IS_HIDDEN" : "");
}

static void set_variant_uniforms(const struct variant_context *context,
                                 const struct gl_program *program)
{
    const struct window_frame *frame = context->frame;
    const struct camera *camera = frame->camera;
    gl_program_set_m4(program, "u_clip_from_relative", context->clip_from_relative);
    gl_program_set_u(program, "u_width_px", (uint32_t)frame->window.width);
    if (camera->is_orthographic)
        gl_program_set_f3(program, "u_view_direction",
                          (const float[3]){(float)-camera->back[0], (float)-camera->back[1],
                                           (float)-camera->back[2]});
    window_set_clip_planes(frame, program);
}

static const struct gl_program *program_for(void *context, const struct state_item *item,
                                            struct error *err)
{
    const struct variant_context *variant = context;
    char defines[VARIANT_BYTES];
    describe_variant(variant, item, defines);
    const struct gl_program *program = program_cache_get(variant->frame->programs,
                                                         &(struct program_desc){
                                                             .label = variant->fragment,
                                                             .vertex = "geometry.vert.glsl",
                                                             .fragment = variant->fragment,
                                                             .defines = defines,
                                                         },
                                                         err);
    if (program)
        set_variant_uniforms(variant, program);
    return program;
}

struct pass { /* one submission */
    const uint32_t *items;
    size_t count;
    const char *fragment;
    bool evaluates, clips, is_hidden;
};

static void enable_clipping(const struct window_frame *frame, bool is_on)
{
    for (size_t i = 0; i < frame->view->clip_plane_count; i++)
        (is_on ? glEnable : glDisable)(GL_CLIP_DISTANCE0 + (GLenum)i);
}

static bool submit(const struct window_frame *frame, const struct pass *pass, struct error *err)
{
    struct variant_context context = {.frame = frame,
                                      .fragment = pass->fragment,
                                      .evaluates = pass->evaluates,
                                      .is_hidden = pass->is_hidden};
    camera_clip_matrix(frame->camera, &frame->window, context.clip_from_relative);
    struct draw_desc desc = {
        .gpu = frame->gpu,
        .state = frame->state,
        .arena = frame->arena,
        .items = pass->items,
        .item_count = pass->count,
        .cull_back_faces = true,
        .needs_textures = pass->evaluates,
        .program_for = program_for,
        .context = &context,
    };
    for (int k = 0; k < 3; k++)
        desc.origin[k] = frame->camera->eye[k];
    struct draw_counts counts = {0};
    if (pass->clips)
        enable_clipping(frame, true);
    bool ok = draws_submit(&desc, &counts, err);
    enable_clipping(frame, false);
    frame->report->counts.draws += counts.draws;
    frame->report->counts.triangles += counts.triangles;
    return ok;
}

static void set_depth_state(const struct window_frame *frame, bool writes)
{
    glViewport(0, 0, frame->window.width, frame->window.height);
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
    bool ok = submit(frame,
                     &(struct pass){.items = items->opaque,
                                    .count = items->opaque_count,
                                    .fragment = "gbuffer.frag.glsl",
                                    .evaluates = true,
                                    .clips = true},
                     err);
    gpu_scope_end(frame->timeline);
    return ok;
}

bool geometry_draw_transparent(const struct window_frame *frame, const struct geometry_items *items,
                               const char *fragment, bool evaluates, struct error *err)
{
    set_depth_state(frame, false);
    glBindFramebuffer(GL_FRAMEBUFFER, frame->targets->depth_only.name);
    struct pass pass = {.items = items->transparent,
                        .count = items->transparent_count,
                        .fragment = fragment,
                        .evaluates = evaluates,
                        .clips = true};
    bool ok = submit(frame, &pass, err);
    pass.items = items->media;
    pass.count = items->medium_count;
    pass.clips = false;
    ok = ok && submit(frame, &pass, err);
    if (ok && items->may_surround) {
        pass.is_hidden = true;
        glDepthFunc(GL_LESS);     /* what the draw before did not pass */
        glEnable(GL_DEPTH_CLAMP); /* and what lies beyond the far plane */
        ok = submit(frame, &pass, err);
        glDisable(GL_DEPTH_CLAMP);
        glDepthFunc(GL_GEQUAL);
    }
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    return ok;
}
