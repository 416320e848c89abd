/* SPDX-License-Identifier: MIT */
/* `weighted-blended`: McGuire and Bavoil 2013, "Weighted Blended Order-Independent Transparency".
 * The surfaces are found, kept and lit as by `lists`, so that the picture alone is compared: its
 * time and its memory are those of `lists`. */
#include "renderer/transparency/pixel_lists.h"

const struct transparency_method transparency_method_weighted_blended = {
    .id = TRANSPARENCY_WEIGHTED_BLENDED,
    PIXEL_LISTS_MEMBERS,
    .compositing = "weighted_blended_composite.glsl",
    .approximates = "averages layers that lie behind one another by weights of their distance",
};
