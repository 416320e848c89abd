/* SPDX-License-Identifier: MIT */
/* Why shadow structures are being built, in a sentence. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_REASON_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_REASON_H

#include "renderer/shadows/shadow_map.h"
#include "renderer/shadows/shadows.h"

/* Of opaque depths and of lists: which lights have such casters, and how many; the same words for
 * each batch of lights, so that their lines are one. */
void shadow_reasons(const struct shadow_build *builds, size_t build_count,
                    const struct shadow_prepare_desc *desc, char opaque[REPORT_TEXT_BYTES],
                    char transparent[REPORT_TEXT_BYTES]);

#endif
