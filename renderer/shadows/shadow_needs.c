/* SPDX-License-Identifier: MIT */
/* The decision which lights have a shadow structure, and of which kind. */
#include "renderer/shadows/shadow_needs.h"

#include <stdlib.h>

#include "renderer/shadows/shadow_casters.h"
#include "renderer/shadows/technique.h"

static bool look_at_scene(const struct shadow_needs_desc *desc, const struct state_light *light,
                          struct shadow_frame *frame)
{
    return shadow_quality_holds_grids(desc->quality)
               ? shadow_frame_init_with_grids(frame, light, desc->state, desc->resolution)
               : shadow_frame_init(frame, light, desc->state, desc->resolution);
}

static bool decide(struct shadow_need *need, const struct shadow_needs_desc *desc, size_t light,
                   struct error *err)
{
    const struct state_light *source = &desc->state->lights[light];
    need->is_unseen = desc->is_in_view && !desc->is_in_view[light];
    if (need->is_unseen || !source->casts_shadow || desc->quality->shadows == SHADOWS_NONE ||
        !look_at_scene(desc, source, &need->frame))
        return true;
    if (!shadow_casters_collect(&need->casters, &need->frame, desc->state, err))
        return false;
    need->method = shadow_method_choose(&need->casters, desc->quality);
    need->has_structure = need->method && need->method->structure->scope == SHADOW_PER_LIGHT;
    need->is_traced = need->method && need->method->structure->scope == SHADOW_PER_WINDOW;
    return true;
}

bool shadow_needs_init(struct shadow_needs *needs, const struct shadow_needs_desc *desc,
                       struct error *err)
{
    size_t count = desc->state->light_count;
    *needs = (struct shadow_needs){.lights = calloc(count + 1, sizeof *needs->lights)};
    if (!needs->lights)
        return error_set(err, ERROR_NO_MEMORY, "shadows of %zu lights", count);
    needs->light_count = count;
    for (size_t i = 0; i < count; i++) {
        if (!decide(&needs->lights[i], desc, i, err)) {
            shadow_needs_finish(needs);
            return false;
        }
    }
    return true;
}

bool shadow_need_may_compress(const struct shadow_need *need)
{
    return need->has_structure && shadow_technique_has(need->method->id, SHADOW_HAS_COMPRESSION) &&
           !need->casters.has_exclusions;
}

uint64_t shadow_need_least_bytes(const struct shadow_need *need, int resolution)
{
    return need->has_structure
               ? need->method->structure->texel_bytes * (uint64_t)need->frame.face_count *
                     (uint64_t)resolution * (uint64_t)resolution
               : 0;
}

size_t shadow_needs_least_batches(const struct shadow_needs *needs, int resolution,
                                  uint64_t budget_bytes)
{
    size_t batches = 0;
    uint64_t used = 0;
    for (size_t i = 0; i < needs->light_count; i++) {
        uint64_t bytes = shadow_need_least_bytes(&needs->lights[i], resolution);
        if (!bytes)
            continue;
        if (!batches || used + bytes > budget_bytes) {
            batches++;
            used = 0;
        }
        used += bytes;
    }
    return batches;
}

void shadow_needs_finish(struct shadow_needs *needs)
{
    for (size_t i = 0; i < needs->light_count; i++)
        shadow_casters_finish(&needs->lights[i].casters);
    free(needs->lights);
    *needs = (struct shadow_needs){0};
}

uint64_t shadow_needs_size_bytes(const struct shadow_needs *needs)
{
    uint64_t bytes = needs->light_count * sizeof *needs->lights;
    for (size_t i = 0; i < needs->light_count; i++)
        bytes += needs->lights[i].casters.capacity * (sizeof(uint32_t) + sizeof(uint8_t));
    return bytes;
}
