/* SPDX-License-Identifier: MIT */
/* Draws feature edges and the outline of selected nodes over a finished picture. Camera rays find
 * which of them are hidden, so that rasterised and traced pictures get the same lines. Thread: GL
 * (it uses the ray tracer's cache). */
#ifndef VITRAIL_RENDERER_OVERLAY_OVERLAY_H
#define VITRAIL_RENDERER_OVERLAY_OVERLAY_H

#include "renderer/image/image.h"
#include "renderer/overlay/feature_edges.h"
#include "renderer/raytrace/raytrace.h"

struct overlay_desc {
    const struct raytrace_desc *rays; /* required: view, state, camera, cache */
    struct feature_edges *edges;      /* required; of the state's scene */
    struct image *color;              /* required; F32 RGBA of the view's size, or of its tile,
                                         which gets what the whole picture has there; drawn over */
};

struct overlay_stats {
    uint64_t edges;    /* feature edges in the image, at least in part */
    uint64_t outlined; /* pixels that the outline touches */
};

/* Errors: ERROR_NOT_FOUND for a node that the scene does not have, ERROR_NO_MEMORY. */
MUST_CHECK bool overlay_draw_edges(const struct overlay_desc *desc, struct overlay_stats *stats,
                                   struct error *err);
MUST_CHECK bool overlay_draw_highlight(const struct overlay_desc *desc, struct overlay_stats *stats,
                                       struct error *err);

/* Lays a colour over a pixel of associated alpha. */
static inline void overlay_blend(float pixel[4], const float color[3], float alpha)
{
    for (int k = 0; k < 3; k++)
        pixel[k] = color[k] * alpha + pixel[k] * (1 - alpha);
    pixel[3] = alpha + pixel[3] * (1 - alpha);
}

#endif
