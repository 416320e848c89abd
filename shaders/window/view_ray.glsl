// SPDX-License-Identifier: MIT
// From a point of the window and a stored depth back to the position in view space.
uniform vec4 u_window;  // view-plane x, y = xy + zw * (pixel of the image + sub-pixel offset)
uniform uvec2 u_window_first; // pixel of the image where the window begins: the lower left corners
uniform vec3 u_depth;   // perspective: x = near; orthographic: y = far, z = far - near

vec2 view_plane(vec2 at) { return u_window.xy + u_window.zw * (vec2(u_window_first) + at); }

#ifdef IS_ORTHOGRAPHIC
float view_depth(float depth) { return u_depth.y - depth * u_depth.z; }
vec3 view_position(vec2 at, float view_z)
{
    return vec3(view_plane(at), -view_z);
}
vec3 view_direction(vec3 position) { return vec3(0.0, 0.0, 1.0); }
#else
float view_depth(float depth) { return u_depth.x / max(depth, 1e-37); }
vec3 view_position(vec2 at, float view_z)
{
    return vec3(view_plane(at) * view_z, -view_z);
}
vec3 view_direction(vec3 position) { return normalize(-position); }
#endif
