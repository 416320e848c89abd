/* SPDX-License-Identifier: MIT */
/* The overlay as a step of a frame: traces its rays, caches its edges between frames, reports. */
#include "renderer/frame/frame_overlay.h"

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_raytrace.h"
#include "renderer/overlay/overlay.h"

/* The view of the overlay, which is tone mapped as the picture was. */
static struct view overlay_view(const struct view *view)
{
    struct view own = *view;
    if (view->screen.has_backdrop) {
        tone_map_color(&view->screen.mapping, own.edges.color);
        tone_map_color(&view->screen.mapping, own.highlight.color);
    }
    return own;
}

bool frame_overlay(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    struct frame_report *report = &run->frame->report;
    const char *because = run->frame_plan->plan.requirements[PLAN_NEED_OVERLAY].because;
    const struct view view = overlay_view(run->view);
    const struct raytrace_desc rays = {
        .view = &view, .state = run->state, .camera = run->camera, .cache = renderer->traced};
    const struct overlay_desc desc = {.rays = &rays,
                                      .edges = &context->feature_edges,
                                      .color = &run->frame->outputs[VIEW_OUTPUT_COLOR]};
    struct overlay_stats stats = {0};
    frame_drop_other_traced(run->context, run->scene->key);
    double begin_ms = wall_ms();
    if (run->view->edges.is_drawn && !overlay_draw_edges(&desc, &stats, err))
        return false;
    double edges_ms = wall_ms();
    if (run->view->edges.is_drawn)
        report_add_pass(report, "overlay.edges", because, "", edges_ms - begin_ms, REPORT_SHADE);
    if (run->view->highlight.node_count && !overlay_draw_highlight(&desc, &stats, err))
        return false;
    if (run->view->highlight.node_count)
        report_add_pass(report, "overlay.highlight", because, "", wall_ms() - edges_ms,
                        REPORT_SHADE);
    report->counts.feature_edges = stats.edges;
    report->counts.outlined_pixels = stats.outlined;
    if (context->feature_edges.size_bytes)
        report_add_bytes(report, "overlay.edges", context->feature_edges.size_bytes);
    return true;
}
