/* SPDX-License-Identifier: MIT */
/* `moment-based`: Muenstermann, Krumpen, Klein and Peters 2018, "Moment-Based Order-Independent
 * Transparency". The surfaces are found, kept and lit as by `lists`, so that the picture alone is
 * compared: its time and its memory are those of `lists`. */
#include "renderer/transparency/pixel_lists.h"

const struct transparency_method transparency_method_moment_based = {
    .id = TRANSPARENCY_MOMENT_BASED,
    PIXEL_LISTS_MEMBERS,
    .compositing = "moment_based_composite.glsl",
    .compositing_published = "moment_based_published.glsl",
    .walks_twice = true,
    .approximates = "tells from moments what absorbs before a layer",
};
