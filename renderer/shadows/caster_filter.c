/* SPDX-License-Identifier: MIT */
/* Asks the ray tracer's definition of filters, so that all that is drawn by triangles has the light
 * of rays. */
#include "renderer/shadows/caster_filter.h"

#include "renderer/raytrace/rt_surface.h"

/* What the ray tracer knows of the item, as far as its filter goes. */
static struct rt_mesh mesh_of(const struct scene_state *state, const struct state_item *item)
{
    const uint32_t uv = SCENE_PRIMITIVE_HAS_TEXCOORDS_0 | SCENE_PRIMITIVE_HAS_TEXCOORDS_1;
    struct rt_mesh mesh = {.item = item,
                           .class_ = item->class_,
                           .is_medium = item->is_medium,
                           .material = &state->materials[item->material].base,
                           .primitive = state_geometry_of(state, item).primitive};
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        int32_t texture = mesh.material->textures[slot].texture;
        if (texture >= 0 && state->scene->textures[texture].image >= 0 &&
            (mesh.primitive->flags & uv))
            mesh.slots |= 1u << slot;
    }
    return mesh;
}

bool caster_filter_is_even(const struct scene_state *state, const struct state_item *item,
                           enum view_blend_filter blend)
{
    double filter[3];
    if (!item->casts_shadow || item->class_ == STATE_OPAQUE)
        return true;
    const struct rt_mesh mesh = mesh_of(state, item);
    return !item->is_medium && !state->materials[item->material].cast_once &&
           rt_surface_plain_filter(&mesh, blend, filter);
}

void caster_filter_of(const struct scene_state *state, const struct state_item *item,
                      enum view_blend_filter blend, double filter[3])
{
    const struct rt_mesh mesh = mesh_of(state, item);
    if (!rt_surface_plain_filter(&mesh, blend, filter))
        filter[0] = filter[1] = filter[2] = 0;
}
