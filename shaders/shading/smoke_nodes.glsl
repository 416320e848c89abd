// SPDX-License-Identifier: MIT
// Where in the window the light in density grids is found: in columns as those of haze
// (atmosphere_slices.glsl), at nodes along their middles, from the nearest grid to the farthest
// (renderer/shading/smoke.h).
uniform vec4 u_smoke_nodes; // first depth [m]; farthest less that [m]; growth; cells between nodes

float smoke_node_depth(float node)
{
    float u = node / u_smoke_nodes.w, growth = u_smoke_nodes.z;
    return u_smoke_nodes.x +
           u_smoke_nodes.y * (exp2(growth * u) - 1.0) / (exp2(growth) - 1.0);
}

// The place of a depth among the nodes.
float smoke_node_at(float view_z)
{
    float growth = u_smoke_nodes.z, u = (view_z - u_smoke_nodes.x) / u_smoke_nodes.y;
    float at = log2(1.0 + clamp(u, 0.0, 1.0) * (exp2(growth) - 1.0)) / growth;
    return clamp(at, 0.0, 1.0) * u_smoke_nodes.w;
}
