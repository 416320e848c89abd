/* SPDX-License-Identifier: MIT */
/* The renderer's other public functions, and its end. It begins in renderer_start.c; rendering one
 * frame is in frame.c, and what a frame has of its own in frame_context.c. */
#include "renderer/renderer.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/proofs.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/frame/scene_parts.h"

struct frame_context *renderer_context(struct renderer *renderer)
{
    bool is_made = renderer->current->renderer != NULL;
    return is_made ? renderer->current : &renderer->frames;
}

struct frame_context *renderer_next_context(struct renderer *renderer, struct error *err)
{
    struct frame_context *urgent = &renderer->urgent;
    if (renderer_context(renderer) == renderer->current)
        return renderer->current;
    if (!frame_context_init(urgent, renderer, true, err)) {
        frame_context_finish(urgent);
        return NULL;
    }
    urgent->shade.loop_steps = renderer->frames.shade.loop_steps;
    return urgent;
}

bool renderer_is_yielding(const struct renderer *renderer)
{
    return renderer->current == &renderer->urgent;
}

void renderer_finish_parts(struct renderer *renderer)
{
    frame_context_finish(&renderer->urgent);
    raytrace_cache_destroy(renderer->traced); /* borrows a scene */
    scene_cache_finish(&renderer->scenes);
    environment_cache_finish(&renderer->environments);
    frame_context_finish(&renderer->frames);
    shadow_system_destroy(renderer->shadows);
    frame_in_flight_finish(renderer);
    frame_observations_destroy(renderer->observations);
    readback_destroy(renderer->readback);
    gpu_timeline_destroy(renderer->timeline);
}

void renderer_destroy(struct renderer *renderer)
{
    if (!renderer)
        return;
    renderer_finish_parts(renderer);
    proofs_destroy(renderer->proofs);
    program_cache_destroy(renderer->programs);
    program_store_close(renderer->program_store);
    gl_context_destroy(renderer->gl);
    free(renderer);
}

void renderer_set_auto(struct renderer *renderer, const struct auto_settings *settings)
{
    renderer->automatic.policy = settings->policy;
    renderer->automatic.speed = settings->speed;
    renderer_set_learned(renderer, settings->learned);
    choice_cache_clear(&renderer->frames.choices);
    choice_cache_clear(&renderer->urgent.choices);
}

static void follow_observations(struct renderer *renderer)
{
    renderer->automatic.learned = frame_observations_published(renderer->observations);
    renderer->automatic.learned_print = frame_observations_print(renderer->observations);
}

void renderer_set_learned(struct renderer *renderer, const struct learning *learned)
{
    frame_observations_set(renderer->observations, learned);
    follow_observations(renderer);
}

void renderer_publish_observations(struct renderer *renderer)
{
    frame_observations_publish(renderer->observations);
    follow_observations(renderer);
}

bool renderer_take_lesson(struct renderer *renderer, struct frame_lesson *lesson)
{
    return frame_observations_pop(renderer->observations, lesson);
}

void renderer_learn(struct renderer *renderer, const struct frame_lesson *lesson)
{
    frame_observations_learn(renderer->observations, lesson);
    renderer_publish_observations(renderer);
}

const struct learning *renderer_get_learned(const struct renderer *renderer, uint64_t *print)
{
    *print = renderer->automatic.learned_print;
    return renderer->automatic.learned;
}

void renderer_set_yield_point(struct renderer *renderer, const struct yield_point *yield)
{
    renderer->yield = yield;
}

void renderer_set_progress(struct renderer *renderer, const struct frame_progress *progress)
{
    renderer->progress = progress;
}

void renderer_set_texture_compression(struct renderer *renderer, uint32_t from_levels)
{
    texture_pool_set_compression(renderer->scenes.textures, from_levels);
}

bool renderer_samples_blocks(const struct renderer *renderer)
{
    return texture_pool_samples_blocks(renderer->scenes.textures);
}

static void tell_devices(const struct gl_context *context, struct renderer_info *info)
{
    static_assert((int)GL_DEVICE_TEXT_BYTES <= (int)RENDERER_TEXT_BYTES, "lines fit");
    const struct gl_device_list *list = gl_context_devices(context);
    for (uint32_t i = 0; i < (uint32_t)list->count && i < RENDERER_DEVICES_TOLD; i++) {
        const struct gl_device *device = &list->items[i];
        gl_device_describe(device, info->devices[i]);
        info->passed_over |= (uint32_t)(!device->is_taken && *device->reason) << i;
    }
    snprintf(info->warning, sizeof info->warning, "%s", gl_context_warning(context));
}

void renderer_get_info(const struct renderer *renderer, struct renderer_info *info)
{
    const struct gl_limits *limits = gl_context_limits(renderer->gl);
    *info = (struct renderer_info){
        .device_count = limits->device_count,
        .max_texture_size = limits->max_texture_size,
        .max_samples = limits->max_samples < limits->max_integer_samples
                           ? limits->max_samples
                           : limits->max_integer_samples,
        .max_storage_block_bytes = (uint64_t)limits->max_storage_block_bytes,
        .has_true_timers = limits->has_true_timers,
        .has_post_depth_coverage = limits->has_post_depth_coverage,
        .is_robust = limits->is_robust,
        .is_software = limits->is_software,
        .wide_floats = renderer->wide_floats,
        .loop_end = renderer->loop_end,
        .budget_bytes = renderer->budget_bytes,
        .budget_source = renderer->budget_source,
        .used_bytes = renderer_used_bytes(renderer),
        .compresses_textures = texture_pool_compresses(renderer->scenes.textures),
        .upload_bytes_per_ms = (uint64_t)texture_pool_bytes_per_ms(renderer->scenes.textures),
    };
    tell_devices(renderer->gl, info);
    struct program_cache_stats programs;
    program_cache_get_stats(renderer->programs, &programs);
    info->programs_built = programs.misses;
    info->programs_reused = programs.hits;
    info->programs_loaded = programs.loaded;
    info->program_formats = limits->program_formats;
    if (renderer->program_store) {
        struct program_store_totals kept;
        program_store_get_totals(renderer->program_store, &kept);
        info->programs_kept = kept.files;
        info->programs_kept_bytes = kept.bytes;
    }
    snprintf(info->vendor, sizeof info->vendor, "%s", limits->vendor);
    snprintf(info->renderer, sizeof info->renderer, "%s", limits->renderer);
    snprintf(info->version, sizeof info->version, "%s", limits->version);
    snprintf(info->driver, sizeof info->driver, "%s", limits->platform);
}

uint64_t renderer_used_bytes(const struct renderer *renderer)
{
    return scene_cache_size_bytes(&renderer->scenes) +
           environment_cache_size_bytes(&renderer->environments) +
           shadow_system_size_bytes(renderer->shadows) +
           raytrace_cache_size_bytes(renderer->traced) + readback_size_bytes(renderer->readback) +
           frame_context_size_bytes(&renderer->frames) +
           frame_context_size_bytes(&renderer->urgent);
}

static bool is_traced(const struct renderer *renderer, const char *key)
{
    return !strcmp(renderer->frames.traced_key, key) || !strcmp(renderer->urgent.traced_key, key);
}

void renderer_forget_traced(struct renderer *renderer, const char *key)
{
    bool is_its = !key;
    for (size_t i = 0; key && i < renderer->scenes.count; i++) {
        const struct resident_scene *scene = renderer->scenes.entries[i];
        if (!strcmp(scene->key, key) || !strcmp(resident_scene_shadow_key(scene), key))
            is_its |= is_traced(renderer, scene->key);
    }
    if (is_its)
        raytrace_cache_clear(renderer->traced);
}

void renderer_forget_kept(struct renderer *renderer, const char *key)
{
    shadow_system_forget(renderer->shadows, key);
    renderer_forget_traced(renderer, key);
    frame_context_forget(&renderer->frames);
    frame_context_forget(&renderer->urgent);
}

bool renderer_has_scene(const struct renderer *renderer, const char *key)
{
    for (size_t i = 0; i < renderer->scenes.count; i++)
        if (!strcmp(renderer->scenes.entries[i]->key, key))
            return true;
    return false;
}

void renderer_evict_scenes(struct renderer *renderer, const char *const *keep, size_t keep_count)
{
    while (renderer_used_bytes(renderer) > renderer->budget_bytes) {
        const char *oldest = scene_cache_oldest(&renderer->scenes, keep, keep_count);
        if (!oldest)
            return;
        renderer_remove_scene(renderer, oldest);
    }
}

bool renderer_attach_scene(struct renderer *renderer, const struct renderer_scene_desc *desc,
                           struct error *err)
{
    if (scene_cache_find(&renderer->scenes, desc->key)) {
        if (desc->release)
            desc->release(desc->context);
        return true;
    }
    if (!scene_cache_add(&renderer->scenes, desc, err)) {
        gl_context_blame(renderer->gl, "uploading a scene", err);
        return false;
    }
    frame_budget_reserve(renderer, 0); /* what is kept of views goes before scenes do */
    if (desc->keep_count)
        renderer_evict_scenes(renderer, desc->keep, desc->keep_count);
    else
        renderer_evict_scenes(renderer, &desc->key, 1);
    if (renderer_used_bytes(renderer) > renderer->budget_bytes) {
        uint64_t needed = renderer_used_bytes(renderer);
        renderer_detach_scene(renderer, desc->key);
        return error_set(err, ERROR_OVER_BUDGET,
                         "the scene brings GPU memory to %llu bytes, the budget is %llu",
                         (unsigned long long)needed, (unsigned long long)renderer->budget_bytes);
    }
    return gl_context_check(renderer->gl, "uploading a scene", err);
}

void renderer_detach_scene(struct renderer *renderer, const char *key)
{
    if (!renderer_has_scene(renderer, key))
        return;
    renderer_remove_scene(renderer, key);
}

void renderer_drop_structures(struct renderer *renderer, const char *key)
{
    if (renderer_has_scene(renderer, key))
        renderer_forget_kept(renderer, key);
}

void renderer_trim(struct renderer *renderer)
{
    shadow_system_trim_unused(renderer->shadows);
    image_cache_drop(&renderer->frames.image_cache);
}

void frame_finish(struct frame *frame)
{
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        image_finish(&frame->outputs[i]);
    deep_image_finish(&frame->deep);
    memset(frame, 0, sizeof *frame);
}
