/* SPDX-License-Identifier: MIT */
/* What a deep image needs of its request. */
#include <stdio.h>

#include "protocol/render_request.h"

bool render_request_deep_fault(const struct render_request *request, uint32_t outputs,
                               char why[DEEP_FAULT_BYTES])
{
    const struct request_quality *quality = &request->quality;
    char others[SHADOW_TECHNIQUES_TEXT_BYTES];
    shadow_techniques_rasterised_text(others);
    why[0] = 0;
    if (outputs != 1u << REQUEST_OUTPUT_COLOR)
        snprintf(why, DEEP_FAULT_BYTES, "which holds the color output alone");
    else if (quality->reference || quality->shadows == SHADOWS_AUTO ||
             shadow_technique_is_renderer(quality->shadows))
        snprintf(why, DEEP_FAULT_BYTES,
                 "but deep images are rasterised: quality.shadows must be %s", others);
    else if (request_quality_asks(quality))
        snprintf(why, DEEP_FAULT_BYTES,
                 "but deep images are made as quality says: leave max_error and budget_ms out");
    else if (quality->samples > 1)
        snprintf(why, DEEP_FAULT_BYTES,
                 "but deep images have one sample per pixel: quality.samples must be 1");
    else if (request->atmosphere.density > 0)
        snprintf(why, DEEP_FAULT_BYTES, "but deep images have no haze: leave atmosphere out");
    else if (request->highlight.node_count || request->edges.is_given)
        snprintf(why, DEEP_FAULT_BYTES,
                 "but edges and highlights have no depth: leave them out of deep images");
    return why[0];
}
