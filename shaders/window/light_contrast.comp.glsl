// SPDX-License-Identifier: MIT
// Lists the pixels that may be in other light than the one to the left, right, above or below
// (shared/contrast.h), or have several lights: few of a picture. light_apart.comp.glsl looks into
// these; processors would take its branches for all pixels.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "window/light_word.glsl"
#define LIST_BINDING BIND_CANDIDATES
#include "window/apart_lists.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = UNIT_LIGHT) uniform usampler2DArray u_light;
uniform uvec2 u_size_px;
uniform uint u_goes_on; // bit set, by the ways: the picture does beyond the window

void main()
{
    const ivec2 ways[4] = {ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1)};
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    uint word = texelFetch(u_light, ivec3(pixel, 0), 0).x, mixed = word;
    bool differs = false, is_unknown = false;
    for (int k = 0; k < 4; k++) {
        ivec2 at = clamp(pixel + ways[k], ivec2(0), ivec2(u_size_px) - 1);
        is_unknown = is_unknown || (at == pixel && (u_goes_on >> k & 1u) != 0u);
        uint other = texelFetch(u_light, ivec3(at, 0), 0).x;
        mixed |= other;
        differs = differs || light_words_differ(word, other);
    }
    if (differs || is_unknown || (mixed & LIGHT_MIXED) != 0u)
        list_append(apart_word(pixel, is_unknown ? CANDIDATE_UNKNOWN : CANDIDATE));
}
