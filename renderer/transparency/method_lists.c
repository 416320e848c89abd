/* SPDX-License-Identifier: MIT */
/* `lists`: every transparent surface of each pixel, in one contiguous list that is sorted by depth
 * (renderer/transparency/pixel_lists.h). Exact for any number of layers. */
#include "renderer/transparency/pixel_lists.h"

const struct transparency_method transparency_method_lists = {
    .id = TRANSPARENCY_LISTS,
    PIXEL_LISTS_MEMBERS,
    .compositing = "lists_composite.glsl",
};
