/* SPDX-License-Identifier: MIT */
/* Copies pixels, and what a report says of them. */
#include "renderer/frame/image_cache.h"

#include <string.h>

enum { KEPT_BYTES_MAX = 128 << 20 /* of 3840x2160 pixels with four floats each, 127 MiB */ };

static bool make_room(struct image_cache *cache, const struct image *color)
{
    struct error ignored = {0};
    if (cache->color.pixels && cache->color.width_px == color->width_px &&
        cache->color.height_px == color->height_px)
        return true;
    image_finish(&cache->color);
    return image_size_bytes(color) <= KEPT_BYTES_MAX &&
           image_init(&cache->color, color->width_px, color->height_px, 4, IMAGE_F32, &ignored);
}

static void keep_report(struct image_cache *cache, const struct frame_report *report)
{
    cache->report = (struct frame_report){.compression = report->compression,
                                          .textures = report->textures,
                                          .warning_count = report->warning_count,
                                          .error_is_exact = report->error_is_exact};
    cache->report.counts.light_batches = report->counts.light_batches;
    cache->report.counts.shadowed_lights = report->counts.shadowed_lights;
    cache->report.counts.unseen_lights = report->counts.unseen_lights;
    memcpy(cache->report.warnings, report->warnings, sizeof report->warnings);
}

void image_cache_store(struct image_cache *cache, struct content_key key, const struct image *color,
                       const struct frame_report *report)
{
    cache->key = (struct content_key){{0}};
    cache->is_on_device = false;
    if (color->component != IMAGE_F32 || color->channels != 4 || !make_room(cache, color))
        return;
    memcpy(cache->color.pixels, color->pixels, image_size_bytes(color));
    cache->key = key;
    keep_report(cache, report);
}

void image_cache_store_on_device(struct image_cache *cache, struct content_key key,
                                 const struct frame_report *report)
{
    image_cache_drop(cache);
    cache->key = key;
    cache->is_on_device = true;
    keep_report(cache, report);
}

void image_cache_confirm(struct image_cache *cache, struct content_key key, bool is_right)
{
    if (!cache->is_on_device || !content_key_equals(cache->key, key))
        return;
    cache->has_come = is_right;
    if (!is_right)
        image_cache_drop(cache);
}

bool image_cache_has(const struct image_cache *cache, struct content_key key)
{
    bool is_there = cache->is_on_device ? cache->has_come : cache->color.pixels != NULL;
    return is_there && content_key_equals(cache->key, key);
}

void image_cache_copy(const struct image_cache *cache, struct image *color)
{
    memcpy(color->pixels, cache->color.pixels, image_size_bytes(color));
}

void image_cache_report(const struct image_cache *cache, struct frame_report *report)
{
    report->compression = cache->report.compression;
    report->textures = cache->report.textures;
    report->error_is_exact = cache->report.error_is_exact;
    report->counts.light_batches = cache->report.counts.light_batches;
    report->counts.shadowed_lights = cache->report.counts.shadowed_lights;
    report->counts.unseen_lights = cache->report.counts.unseen_lights;
    for (int i = 0; i < cache->report.warning_count; i++)
        report_warn(report, "%s", cache->report.warnings[i]);
    report_add_reused(report, "picture");
    report->is_kept_picture = true;
}

void image_cache_drop(struct image_cache *cache)
{
    image_finish(&cache->color);
    *cache = (struct image_cache){0};
}
