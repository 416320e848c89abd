// SPDX-License-Identifier: MIT
// Adds the picture of a round of samples to those of the rounds before it; the last one is replaced
// by the mean of all (renderer/shading/accumulation.h).
// Needs: HAS_BACKDROP (rounds leave radiance and what is seen behind it, of which the mean is
// mapped to the screen here; TONE_HAS_CHOICE of image/tone_operators.glsl).
#ifdef HAS_BACKDROP
#include "shading/backdrop.glsl"
#endif
layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f, binding = 0) uniform image2D u_image;
layout(rgba32f, binding = 1) uniform image2D u_sum;
#ifdef HAS_BACKDROP
layout(rgba32f, binding = 2) uniform readonly image2D u_behind;
layout(rgba32f, binding = 3) uniform image2D u_behind_sum;
#endif
uniform uvec2 u_size_px;
uniform float u_share; // of a round: 1 over their number
uniform uint u_is_first, u_is_last;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    vec4 sum = u_share * imageLoad(u_image, pixel);
    if (u_is_first == 0u)
        sum += imageLoad(u_sum, pixel);
#ifdef HAS_BACKDROP
    vec4 behind = u_share * imageLoad(u_behind, pixel);
    if (u_is_first == 0u)
        behind += imageLoad(u_behind_sum, pixel);
    if (u_is_last != 0u)
        sum = map_over_backdrop(pixel, sum.rgb, behind);
    else
        imageStore(u_behind_sum, pixel, behind);
#endif
    if (u_is_last == 0u)
        imageStore(u_sum, pixel, sum);
    else
        imageStore(u_image, pixel, sum);
}
