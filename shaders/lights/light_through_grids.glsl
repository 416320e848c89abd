// SPDX-License-Identifier: MIT
// What density grids let through of a light on its way to a point.
// Needs: light_arriving.glsl, lights/density_grids.glsl.
vec3 light_through_grids(light_record r, vec3 position)
{
    if (r.dims_in_grids == 0u)
        return vec3(1.0);
    if (light_is(r, LIGHT_DIRECTIONAL))
        return grids_let_through(position, -r.direction_cone.xyz, GRID_FAR);
    vec3 to_light = r.position_range.xyz - position;
    float away = length(to_light);
    return grids_let_through(position, to_light / max(away, 1e-20), away);
}
