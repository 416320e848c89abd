// SPDX-License-Identifier: MIT
// One level of the picture without what bends light, from the level before: a mean of four texels,
// or of as many as there are at odd borders. docs/explanation/shading.md, section 8.
#include "shared/bindings.h"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = UNIT_REFRACTION_LEVELS) uniform sampler2D u_levels;
layout(rgba32f, binding = 0) uniform writeonly image2D u_next;
uniform uint u_level; // that is read

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(u_next);
    if (any(greaterThanEqual(at, size)))
        return;
    ivec2 last = textureSize(u_levels, int(u_level)) - 1;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++)
        sum += texelFetch(u_levels, min(2 * at + ivec2(i & 1, i >> 1), last), int(u_level));
    imageStore(u_next, at, sum * 0.25);
}
