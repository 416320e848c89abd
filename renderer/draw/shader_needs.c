/* SPDX-License-Identifier: MIT */
/* Kinds of materials and lights, as masks that shaders test their records against. */
#include "renderer/draw/shader_needs.h"

#include <stdio.h>

#include "renderer/draw/scene_gpu.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* The flags that shaders have code for; the others only sort drawables. */
static const uint32_t evaluated =
    MATERIAL_UNLIT | MATERIAL_BLEND | MATERIAL_TRANSMISSION | MATERIAL_PASS_SLAB |
    MATERIAL_PASS_EDGE | MATERIAL_NO_SELF_SHADOW | MATERIAL_SPECULAR | MATERIAL_CLEARCOAT |
    MATERIAL_SHEEN | MATERIAL_MORE_LOBES | MATERIAL_BENDS | MATERIAL_GROUND | MATERIAL_KIND_METAL;

static uint32_t kinds_of(const struct state_material *material)
{
    return (material_flags(material) | (material->base.metallic > 0 ? MATERIAL_KIND_METAL : 0u)) &
           evaluated;
}

static uint32_t kind_of_light(const struct state_light *light)
{
    switch (light->type) {
    case SCENE_LIGHT_DIRECTIONAL:
        return 1u << LIGHT_DIRECTIONAL;
    case SCENE_LIGHT_POINT:
        return 1u << LIGHT_POINT;
    default:
        return state_light_is_area(light) ? 1u << LIGHT_AREA : 1u << LIGHT_SPOT;
    }
}

struct shader_needs shader_needs_of(const struct scene_state *state)
{
    struct shader_needs needs = {0};
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        bool is_layer = item->is_medium || item->class_ == STATE_TRANSPARENT;
        uint32_t kinds = kinds_of(&state->materials[item->material]);
        *(is_layer ? &needs.layer_kinds : &needs.surface_kinds) |= kinds;
        needs.has_smooth |= !is_layer && state_geometry_of(state, item).primitive->flags &
                                             SCENE_PRIMITIVE_IS_SMOOTH;
    }
    for (size_t i = 0; i < state->light_count; i++) {
        needs.light_kinds |= kind_of_light(&state->lights[i]);
        needs.has_ranges |= state->lights[i].range > 0;
    }
    return needs;
}

uint32_t shader_needs_lobes(uint32_t kinds)
{
    return kinds & MATERIAL_MORE_LOBES ? 2 : kinds & MATERIAL_LOBES ? 1 : 0;
}

void shader_needs_material_defines(uint32_t kinds, char text[SHADER_NEEDS_TEXT_BYTES])
{
    snprintf(text, SHADER_NEEDS_TEXT_BYTES, " MATERIAL_KINDS=%uu%s%s%s", kinds,
             shader_needs_lobes(kinds) > 0 ? " HAS_LOBES" : "",
             shader_needs_lobes(kinds) > 1 ? " HAS_MORE_LOBES" : "",
             kinds & MATERIAL_GROUND ? " HAS_GROUND" : "");
}

void shader_needs_light_defines(const struct shader_needs *needs,
                                char text[SHADER_NEEDS_TEXT_BYTES])
{
    text[0] = 0;
    if (needs->light_kinds)
        snprintf(text, SHADER_NEEDS_TEXT_BYTES, " LIGHT_KINDS=%uu%s%s%s", needs->light_kinds,
                 needs->has_ranges ? " HAS_LIGHT_RANGES" : "",
                 needs->area_samples > 1 ? " HAS_AREA_SAMPLES" : "",
                 needs->has_area_form ? " HAS_AREA_FORM" : "");
}
