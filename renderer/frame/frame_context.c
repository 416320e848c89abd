/* SPDX-License-Identifier: MIT */
/* The life of a frame's context, and what it keeps from one frame to the next. */
#include "renderer/frame/frame_context.h"

#include "renderer/frame/renderer_internal.h"

bool frame_context_init(struct frame_context *context, struct renderer *renderer, bool is_urgent,
                        struct error *err)
{
    context->renderer = renderer;
    context->is_urgent = is_urgent;
    context->arena = draw_arena_create(gl_context_limits(renderer->gl), err);
    if (!context->arena)
        return false;
    context->lists = light_lists_create(renderer->programs, renderer->timeline, err);
    return context->lists;
}

void frame_context_finish(struct frame_context *context)
{
    traced_shadows_finish(&context->shadow_rays);
    feature_edges_finish(&context->feature_edges);
    aov_finish(&context->aov);
    shade_finish(&context->shade);
    smoke_finish(&context->smoke);
    layers_finish(&context->layers);
    targets_finish(&context->targets);
    light_lists_destroy(context->lists);
    plan_cache_clear(&context->plans);
    choice_cache_clear(&context->choices);
    scene_state_cache_drop(&context->state_cache);
    image_cache_drop(&context->image_cache);
    draw_arena_destroy(context->arena);
    *context = (struct frame_context){.renderer = NULL};
}

void frame_context_forget(struct frame_context *context)
{
    context->use.forgets_later = context->use.scene != NULL; /* its plan and state are in use */
    if (context->use.forgets_later)
        return;
    plan_cache_clear(&context->plans);
    choice_cache_clear(&context->choices);
    scene_state_cache_drop(&context->state_cache);
    image_cache_drop(&context->image_cache);
    context->cached = (struct window_cache_keys){0};
    if (context->lists)
        light_lists_forget(context->lists);
    feature_edges_finish(&context->feature_edges);
    smoke_finish(&context->smoke);
}

void frame_context_end_frame(struct frame_context *context)
{
    context->use.scene = NULL;
    if (context->use.forgets_later)
        frame_context_forget(context);
}

uint64_t frame_context_window_bytes(const struct frame_context *context)
{
    return layers_size_bytes(&context->layers) + targets_size_bytes(&context->targets) +
           (context->lists ? light_lists_size_bytes(context->lists) : 0) +
           traced_shadows_size_bytes(&context->shadow_rays) + context->aov.words.size_bytes;
}

uint64_t frame_context_size_bytes(const struct frame_context *context)
{
    return frame_context_window_bytes(context) + context->feature_edges.size_bytes +
           smoke_size_bytes(&context->smoke);
}

const struct yield_point *frame_context_yield(const struct frame_context *context)
{
    return context->is_urgent ? NULL : context->renderer->yield;
}

void frame_context_tell(const struct frame_context *context, enum frame_stage stage, double share)
{
    const struct frame_progress *progress = context->renderer->progress;
    if (progress && !context->is_urgent)
        progress->tell(progress->context, stage, share);
}

void frame_context_begin_span(struct frame_context *context, struct progress_span span)
{
    context->span = span;
    frame_context_tell(context, span.stage, span.first);
}
