// SPDX-License-Identifier: MIT
// Corrected light linked lists: the tiles that a light can touch, as one rectangle on tile borders
// per instance.
#include "lights/light_linked_list_light.glsl"

flat out int v_at;

void main()
{
    v_at = gl_BaseInstanceARB + gl_InstanceID;
    vec4 rect = texelFetch(u_lights, 6 * v_at + 4);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(mix(rect.xy, rect.zw, corner) / u_tiles.xy * 2.0 - 1.0, 0.5, 1.0);
}
