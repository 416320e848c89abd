// SPDX-License-Identifier: MIT
// How long samples of a texture take: every group of 8 x 8 reads neighbours, sixteen times, each
// time somewhere else, as the surfaces of a picture do. Host: renderer/frame/texture_speed.c.
#include "shared/bindings.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = BIND_STATISTICS) buffer speed_sums { float sums[]; };
layout(binding = UNIT_MATERIAL_0) uniform sampler2D u_texture;

void main()
{
    uint word = (gl_WorkGroupID.x + 7u) * 747796405u + 2891336453u;
    vec2 texel = 1.0 / vec2(textureSize(u_texture, 0));
    vec4 sum = vec4(0);
    for (int i = 0; i < 16; i++) {
        word = word * 747796405u + 2891336453u;
        vec2 at = vec2(float(word >> 20), float(word >> 8 & 4095u)) / 4096.0;
        sum += textureLod(u_texture, at + vec2(gl_LocalInvocationID.xy) * texel, 0.0);
    }
    if (dot(sum, vec4(1)) < 0.0) // it never is, which no compiler knows
        sums[0] = sum.x;
}
