// SPDX-License-Identifier: MIT
// Provides: the lights of a light linked list under construction, in view space (x right, y up, z
// forward). Written by renderer/lights/linked_lists.c; texels of one light follow each other.
#include "shared/bindings.h"
#include "lights/light_linked_list_tiles.glsl"

layout(binding = UNIT_LIGHT_RECORDS) uniform samplerBuffer u_lights;

struct light_linked_list_light {
    vec3 center;
    float radius;            // bounding sphere, grown
    vec3 apex;
    float cos_outer;         // below -1: a sphere, not a cone
    vec3 axis;
    float sin_outer;
    float z_lo, z_hi, slack;
    float index;             // of the light; exact to 2^24
    vec4 rect;               // tiles, x0 y0 x1 y1, the upper ones exclusive
    float range, angle;      // as given, but for the rounding of a cosine
};

light_linked_list_light light_linked_list_fetch(int at)
{
    vec4 a = texelFetch(u_lights, 6 * at), b = texelFetch(u_lights, 6 * at + 1);
    vec4 c = texelFetch(u_lights, 6 * at + 2), d = texelFetch(u_lights, 6 * at + 3);
    vec4 f = texelFetch(u_lights, 6 * at + 5);
    return light_linked_list_light(a.xyz, a.w, b.xyz, b.w, c.xyz, c.w, d.x, d.y, d.z, d.w,
                     texelFetch(u_lights, 6 * at + 4), f.x, f.y);
}
