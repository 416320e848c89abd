/* SPDX-License-Identifier: MIT */
/* What light an alpha-blended surface without transmission lets through, by the laws of
 * docs/explanation/shading.md, section 1; shaders/material/material.glsl has them, too. */
#ifndef VITRAIL_RENDERER_SCENE_BLEND_LAW_H
#define VITRAIL_RENDERER_SCENE_BLEND_LAW_H

#include "renderer/view.h"

/* Of a channel. alpha and base: of the base colour, 0 to 1. Thread: any. */
static inline double blend_law_filter(enum view_blend_filter law, double alpha, double base)
{
    switch (law) {
    case VIEW_BLEND_COVERAGE:
        return 1 - alpha;
    case VIEW_BLEND_KIM:
        return (1 - alpha) * base;
    case VIEW_BLEND_MODISETT:
        return (1 - alpha) * (base / 2);
    default:
        return (1 - alpha) * (1 - alpha * (1 - base));
    }
}

#endif
