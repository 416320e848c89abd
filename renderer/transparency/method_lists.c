/* SPDX-License-Identifier: MIT */
/* `lists`: every transparent surface of each pixel, in one contiguous list that is sorted by depth
 * (renderer/transparency/pixel_lists.h). Exact for any number of layers. */
#include "renderer/transparency/pixel_lists.h"

const struct transparency_method transparency_method_lists = {
    .id = TRANSPARENCY_LISTS,
    .passes = pixel_lists_passes,
    .surfaces = &pixel_lists_surfaces,
    .compositing = "lists_composite.glsl",
    .list_programs = pixel_lists_list_programs,
    .count = pixel_lists_count,
    .find = pixel_lists_find,
    .light = pixel_lists_light,
    .count_sets = pixel_lists_count_sets,
    .bind = pixel_lists_bind,
    .ends = pixel_lists_ends,
    .report = pixel_lists_report,
    .clear = pixel_lists_clear,
    .finish = pixel_lists_finish,
    .size_bytes = pixel_lists_size_bytes,
};
