/* SPDX-License-Identifier: MIT */
/* Names of requirements, apart from the planner so that a reply needs no renderer. */
#include "renderer/plan/plan.h"

const char *plan_need_name(int need)
{
    static const char *const names[PLAN_NEED_COUNT] = {
        [PLAN_NEED_TRACED] = "traced",
        [PLAN_NEED_OPAQUE_SHADOWS] = "opaque-shadows",
        [PLAN_NEED_FILTERED_SHADOWS] = "filtered-shadows",
        [PLAN_NEED_TRACED_SHADOWS] = "traced-shadows",
        [PLAN_NEED_VISIBILITY] = "environment-visibility",
        [PLAN_NEED_SURFACES] = "surfaces",
        [PLAN_NEED_LAYERS] = "layers",
        [PLAN_NEED_ANTIALIASING] = "antialiasing",
        [PLAN_NEED_LIGHTS] = "lights",
        [PLAN_NEED_ATMOSPHERE] = "atmosphere",
        [PLAN_NEED_SMOKE] = "smoke",
        [PLAN_NEED_REFRACTION] = "refraction",
        [PLAN_NEED_COLOR] = "color",
        [PLAN_NEED_DEEP] = "deep-image",
        [PLAN_NEED_AUXILIARY] = "auxiliary",
        [PLAN_NEED_OVERLAY] = "overlay",
    };
    return need >= 0 && need < PLAN_NEED_COUNT ? names[need] : NULL;
}
