/* SPDX-License-Identifier: MIT */
/* Reasons of shadow passes, for the report. */
#include "renderer/shadows/shadow_reason.h"

#include <stdio.h>
#include <string.h>

static const char *light_name(const struct scene_state *state, uint32_t light)
{
    switch (state->lights[light].type) {
    case SCENE_LIGHT_DIRECTIONAL:
        return "directional";
    case SCENE_LIGHT_POINT:
        return "point";
    case SCENE_LIGHT_SPOT:
        return "spot";
    case SCENE_LIGHT_RECT:
        return "rect";
    case SCENE_LIGHT_DISK:
        return "disk";
    }
    return "light";
}

enum { NAMED_LIGHTS = 4 }; /* of a reason; more would not fit its line */

/* Which lights have such casters, and how many. */
static void explain(const struct shadow_build *builds, size_t build_count,
                    const struct scene_state *state, bool transparent, char out[REPORT_TEXT_BYTES])
{
    const char *adjective = transparent ? "transparent" : "opaque";
    size_t lights = 0, casters = 0, used = 0;
    uint32_t only = 0;
    char list[REPORT_TEXT_BYTES] = "";
    for (size_t i = 0; i < build_count; i++) {
        const struct shadow_build *build = &builds[i];
        size_t count = transparent ? build->casters.transparent_count : build->casters.opaque_count;
        if (!count)
            continue;
        casters += count;
        only = build->light;
        if (lights++ < NAMED_LIGHTS)
            used += (size_t)snprintf(list + used, sizeof list - used, "%s%u (%s)",
                                     lights > 1 ? ", " : "", build->light,
                                     light_name(state, build->light));
    }
    if (lights == 0)
        snprintf(out, REPORT_TEXT_BYTES, "no new shadow has %s casters in reach", adjective);
    else if (lights == 1)
        snprintf(out, REPORT_TEXT_BYTES, "light %u (%s) has %zu %s caster%s in reach", only,
                 light_name(state, only), casters, adjective, casters == 1 ? "" : "s");
    else
        snprintf(out, REPORT_TEXT_BYTES, "%zu lights have %s casters in reach: %.120s%s", lights,
                 adjective, list, lights > NAMED_LIGHTS ? " and others" : "");
}

void shadow_reasons(const struct shadow_build *builds, size_t build_count,
                    const struct shadow_prepare_desc *desc, char opaque[REPORT_TEXT_BYTES],
                    char transparent[REPORT_TEXT_BYTES])
{
    if (desc->is_left_out) {
        snprintf(opaque, REPORT_TEXT_BYTES,
                 "lights cast shadows that do not fit the budget at once");
        memcpy(transparent, opaque, REPORT_TEXT_BYTES);
    } else {
        explain(builds, build_count, desc->state, false, opaque);
        explain(builds, build_count, desc->state, true, transparent);
    }
}
