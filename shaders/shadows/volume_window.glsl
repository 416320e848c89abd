// SPDX-License-Identifier: MIT
// Where points of view space are seen in a window, and how deep its tiles are. Needs:
// IS_ORTHOGRAPHIC, and a float u_eye (volume.glsl) before it.
uniform vec4 u_window; // view-plane x, y = xy + zw * (pixel of the image + sub-pixel offset)
uniform uvec2 u_window_first;

float height_of(vec4 a)
{
#ifdef IS_ORTHOGRAPHIC
    return a.w;
#else
    return -a.z;
#endif
}

vec2 pixel_of(vec4 a)
{
    return (a.xy / height_of(a) - u_window.xy) / u_window.zw - vec2(u_window_first);
}

// How far the way from the eye has come where it gets there.
float depth_of(vec4 a)
{
#ifdef IS_ORTHOGRAPHIC
    float z = a.z * u_eye;
#else
    float z = a.z;
#endif
    return a.w > 0.0 ? -z / a.w : 1e30;
}

// A number that rises with the depth, and is never 0.
uint volume_order(float depth)
{
    uint bits = floatBitsToUint(depth);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
