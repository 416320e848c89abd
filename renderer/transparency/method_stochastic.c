/* SPDX-License-Identifier: MIT */
/* `stochastic`: Enderton, Sintorn, Shirley and Luebke 2010, "Stochastic Transparency". The surfaces
 * are found, kept and lit as by `lists`, so that the picture alone is compared: its time and its
 * memory are those of `lists`. */
#include "renderer/transparency/pixel_lists.h"

const struct transparency_method transparency_method_stochastic = {
    .id = TRANSPARENCY_STOCHASTIC,
    PIXEL_LISTS_MEMBERS,
    .compositing = "stochastic_composite.glsl",
    .compositing_published = "stochastic_published.glsl",
    .approximates = "leaves it to chance which parts of a sample a layer covers",
};
