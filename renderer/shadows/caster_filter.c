/* SPDX-License-Identifier: MIT */
/* Asks the ray tracer's definition of filters, so that all that is drawn by triangles has the light
 * of rays. */
#include "renderer/shadows/caster_filter.h"

#include "renderer/raytrace/rt_surface.h"

/* What the ray tracer knows of the item, as far as its filter goes. */
static struct rt_mesh mesh_of(const struct scene_state *state, const struct state_item *item)
{
    const struct scene_material *material = &state->materials[item->material].base;
    const struct scene_primitive *primitive = state_geometry_of(state, item).primitive;
    return (struct rt_mesh){
        .item = item,
        .class_ = item->class_,
        .is_medium = item->is_medium,
        .material = material,
        .primitive = primitive,
        .slots = rt_surface_sampled_slots(state->scene, material, primitive),
    };
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
