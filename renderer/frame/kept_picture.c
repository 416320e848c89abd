/* SPDX-License-Identifier: MIT */
/* A copy of pixels, and of what a report says of them. */
#include "renderer/frame/kept_picture.h"

#include <string.h>

enum { KEPT_BYTES_MAX = 128 << 20 /* of 3840x2160 pixels with four floats each, 127 MiB */ };

static bool make_room(struct kept_picture *kept, const struct image *color)
{
    struct error ignored = {0};
    if (kept->color.pixels && kept->color.width_px == color->width_px &&
        kept->color.height_px == color->height_px)
        return true;
    image_finish(&kept->color);
    return image_size_bytes(color) <= KEPT_BYTES_MAX &&
           image_init(&kept->color, color->width_px, color->height_px, 4, IMAGE_F32, &ignored);
}

static void keep_report(struct kept_picture *kept, const struct frame_report *report)
{
    kept->report = (struct frame_report){.compression = report->compression,
                                         .textures = report->textures,
                                         .warning_count = report->warning_count,
                                         .error_is_exact = report->error_is_exact};
    kept->report.counts.light_batches = report->counts.light_batches;
    kept->report.counts.shadowed_lights = report->counts.shadowed_lights;
    kept->report.counts.unseen_lights = report->counts.unseen_lights;
    memcpy(kept->report.warnings, report->warnings, sizeof report->warnings);
}

void kept_picture_note(struct kept_picture *kept, struct content_key key, const struct image *color,
                       const struct frame_report *report)
{
    kept->key = (struct content_key){{0}};
    kept->is_on_device = false;
    if (color->component != IMAGE_F32 || color->channels != 4 || !make_room(kept, color))
        return;
    memcpy(kept->color.pixels, color->pixels, image_size_bytes(color));
    kept->key = key;
    keep_report(kept, report);
}

void kept_picture_note_on_device(struct kept_picture *kept, struct content_key key,
                                 const struct frame_report *report)
{
    kept_picture_drop(kept);
    kept->key = key;
    kept->is_on_device = true;
    keep_report(kept, report);
}

void kept_picture_arrive(struct kept_picture *kept, struct content_key key, bool is_right)
{
    if (!kept->is_on_device || !content_key_equals(kept->key, key))
        return;
    kept->has_come = is_right;
    if (!is_right)
        kept_picture_drop(kept);
}

bool kept_picture_is(const struct kept_picture *kept, struct content_key key)
{
    bool is_there = kept->is_on_device ? kept->has_come : kept->color.pixels != NULL;
    return is_there && content_key_equals(kept->key, key);
}

void kept_picture_copy(const struct kept_picture *kept, struct image *color)
{
    memcpy(color->pixels, kept->color.pixels, image_size_bytes(color));
}

void kept_picture_report(const struct kept_picture *kept, struct frame_report *report)
{
    report->compression = kept->report.compression;
    report->textures = kept->report.textures;
    report->error_is_exact = kept->report.error_is_exact;
    report->counts.light_batches = kept->report.counts.light_batches;
    report->counts.shadowed_lights = kept->report.counts.shadowed_lights;
    report->counts.unseen_lights = kept->report.counts.unseen_lights;
    for (int i = 0; i < kept->report.warning_count; i++)
        report_warn(report, "%s", kept->report.warnings[i]);
    report_add_reused(report, "picture");
    report->is_kept_picture = true;
}

void kept_picture_drop(struct kept_picture *kept)
{
    image_finish(&kept->color);
    *kept = (struct kept_picture){0};
}
