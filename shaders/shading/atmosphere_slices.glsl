// SPDX-License-Identifier: MIT
// The grid over a window in which the light of the haze is found: columns of pixels, each cut into
// slices by depth, the last of which has no end. It lies fast in the image, so that tiles have the
// same light (renderer/shading/atmosphere_light.h).
// Needs: window/view_ray.glsl.
uniform uvec3 u_atmosphere_grid;    // columns, rows of them, slices
uniform ivec2 u_atmosphere_first;   // of the image: the grid's first column
uniform float u_atmosphere_side_px; // of a column
uniform vec4 u_atmosphere_slices;   // see atmosphere_border

const float ATMOSPHERE_FAR = 1e15; // [m]: where the last slice ends
const float SLICE_GROWTH = 3.0;    // log2 of how much thicker the last finite slice is

// View depth at which slice k begins [m]. Up to a depth (x), where the scene begins, a share (z) of
// the slices are alike; over the depth of the scene (y) the others grow.
float atmosphere_border(uint k)
{
    uint finite = u_atmosphere_grid.z - 1u;
    if (k > finite)
        return ATMOSPHERE_FAR;
    float at = float(k) / float(finite), front = u_atmosphere_slices.z;
    if (at < front)
        return u_atmosphere_slices.x * at / front;
    float u = (at - front) / (1.0 - front);
    float grown = (exp2(SLICE_GROWTH * u) - 1.0) / (exp2(SLICE_GROWTH) - 1.0);
    return u_atmosphere_slices.x + u_atmosphere_slices.y * grown;
}

// The slice at a view depth.
uint atmosphere_slice(float view_z)
{
    float finite = float(u_atmosphere_grid.z - 1u), front = u_atmosphere_slices.z;
    float z = max(view_z, 0.0), behind = z - u_atmosphere_slices.x;
    float grown = max(behind, 0.0) / u_atmosphere_slices.y * (exp2(SLICE_GROWTH) - 1.0);
    float at = behind < 0.0 ? front * z / u_atmosphere_slices.x
                            : front + (1.0 - front) * log2(1.0 + grown) / SLICE_GROWTH;
    return uint(clamp(at * finite, 0.0, finite));
}

// Of the window, where a column is looked along.
vec2 atmosphere_pixel(uvec2 column)
{
    return (vec2(u_atmosphere_first + ivec2(column)) + 0.5) * u_atmosphere_side_px -
           vec2(u_window_first);
}
