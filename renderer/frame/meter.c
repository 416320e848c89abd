/* SPDX-License-Identifier: MIT */
/* The exposure of a view, from a small picture of its own. */
#include "renderer/frame/renderer_internal.h"
#include "renderer/image/exposure.h"
#include "renderer/plan/view_key.h"

enum { METER_SIDE_PX = 192 }; /* 20,000 pixels of 16:9, whose log-average is within 0.02 stops */

/* Of the metered picture: all that has no light is left out, and it has the same size whatever that
 * of the view is. */
static struct view metered_view(const struct view *view)
{
    struct view own = *view;
    int64_t longer = view->width_px > view->height_px ? view->width_px : view->height_px;
    int64_t width = (view->width_px * (int64_t)METER_SIDE_PX + longer / 2) / longer;
    int64_t height = (view->height_px * (int64_t)METER_SIDE_PX + longer / 2) / longer;
    own.width_px = width > 0 ? (int)width : 1;
    own.height_px = height > 0 ? (int)height : 1;
    own.first_row_px = own.row_count_px = 0;
    own.tile = (struct view_tile){0}; /* all tiles have the exposure of the whole */
    own.outputs = 1u << VIEW_OUTPUT_COLOR;
    own.highlight = (struct view_highlight){0};
    own.edges = (struct view_edges){0};
    own.screen = (struct view_screen){0};
    own.environment_is_background = false;
    for (int k = 0; k < 4; k++)
        own.background[k] = 0;
    if (own.quality.reference)
        own.quality.shadows = SHADOWS_RAYTRACED;
    else if (view->choice && view->choice->is_open && own.quality.shadows == SHADOWS_AUTO)
        own.quality.shadows = view->choice->technique;
    own.choice = NULL;
    own.quality.samples = 1;
    own.quality.reference = own.quality.may_be_coarse = false;
    return own;
}

static struct content_key key_of(const struct renderer *renderer, const char *scene_key,
                                 const struct view *view)
{
    struct content_key key = view_picture_key(view_state_key(scene_key, view), view);
    content_key_add_word(&key, renderer->automatic.learned_print);
    return key;
}

/* Reports no progress: a picture follows. */
static bool draw(struct renderer *renderer, const char *scene_key, const struct view *view,
                 struct frame *frame, struct error *err)
{
    const struct frame_progress *progress = renderer->progress;
    renderer->progress = NULL;
    bool is_good = renderer_render(renderer, scene_key, view, frame, err);
    renderer->progress = progress;
    return is_good;
}

bool renderer_meter(struct renderer *renderer, const char *scene_key, const struct view *view,
                    struct exposure_reading *reading, struct error *err)
{
    struct meter_readings *kept = &renderer->readings;
    *reading = (struct exposure_reading){0};
    if (view->width_px < 1 || view->height_px < 1)
        return error_set(err, ERROR_INVALID_REQUEST, "image size %dx%d", view->width_px,
                         view->height_px);
    const struct view own = metered_view(view);
    struct frame frame;
    const struct content_key key = key_of(renderer, scene_key, &own);
    for (int i = 0; i < METER_READINGS_MAX; i++)
        if (content_key_equals(kept->items[i].key, key)) {
            *reading = (struct exposure_reading){.ev = kept->items[i].ev, .is_kept = true};
            return true;
        }
    if (!draw(renderer, scene_key, &own, &frame, err))
        return false;
    *reading = (struct exposure_reading){.ev = exposure_meter(&frame.outputs[VIEW_OUTPUT_COLOR]),
                                         .ms = frame.report.total_ms,
                                         .paused_ms = frame.report.paused_ms};
    frame_finish(&frame);
    kept->items[kept->next] = (struct meter_reading){.key = key, .ev = reading->ev};
    kept->next = (kept->next + 1) % METER_READINGS_MAX;
    return true;
}
