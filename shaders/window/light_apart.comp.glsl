// SPDX-License-Identifier: MIT
// Lists the pixels in which a surface that has several samples is in other light than the same
// surface in the pixel to the left, right, above or below (shared/contrast.h): edges of shadows and
// highlights, and what curves. shade_pixels.comp.glsl then shades their samples apart. Edges
// between faces, which samples have anyway, are not taken for those of light (signatures_are_near
// of surface.glsl). A thread for each pixel that light_contrast.comp.glsl lists. Needs: SAMPLES, 4.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "window/light_word.glsl"
#include "draw/surface.glsl"
#include "window/apart.glsl"
#define LIST_BINDING BIND_APART_FOUND
#include "window/apart_lists.glsl"
layout(local_size_x = 64) in;
#include "window/gbuffer.glsl"
layout(binding = UNIT_LIGHT) uniform usampler2DArray u_light;
uniform uvec2 u_size_px;

uint light_at(ivec2 pixel, int i)
{
    return texelFetch(u_light, ivec3(pixel, i), 0).x;
}

uint signature_at(ivec2 pixel, int i)
{
    return texelFetch(u_signature, pixel, i).x;
}

// Whether all samples of the other pixel that show the surface of sample i are in other light, and
// some do. words: of the other's first sample.
bool is_in_other_light(uint word, ivec2 pixel, int i, ivec2 other, uint words)
{
    uint signature = signature_at(pixel, i);
    if ((words & LIGHT_MIXED) == 0u) // one surface
        return light_words_differ(word, words) &&
               signatures_are_near(signature, signature_at(other, 0));
    bool shows = false, is_near = false;
    for (int j = 0; j < SAMPLES; j++) {
        bool is_same = signatures_are_near(signature, signature_at(other, j));
        shows = shows || is_same;
        is_near = is_near || (is_same && !light_words_differ(word, light_at(other, j)));
    }
    return shows && !is_near;
}

ivec2 neighbour(ivec2 pixel, int k)
{
    ivec2 way = (k & 2) == 0 ? ivec2(1 - 2 * (k & 1), 0) : ivec2(0, 1 - 2 * (k & 1));
    return clamp(pixel + way, ivec2(0), ivec2(u_size_px) - 1);
}

// The samples of those that share a light, where it is not that of the neighbours.
uint find_apart(ivec2 pixel, uint first_word, bool is_unknown)
{
    uvec4 words = uvec4(first_word);
    if ((first_word & LIGHT_MIXED) != 0u)
        words.yzw = uvec3(light_at(pixel, 1), light_at(pixel, 2), light_at(pixel, 3));
    words.x &= ~LIGHT_MIXED;
    uvec4 neighbours;
    for (int k = 0; k < 4; k++)
        neighbours[k] = light_at(neighbour(pixel, k), 0);
    uint apart = 0u, asked = 0u;
    for (uint remaining = 15u; remaining != 0u;) {
        int first = findLSB(remaining);
        bvec4 is_same = equal(words, uvec4(words[first]));
        uint members = remaining & (uint(is_same.x) | uint(is_same.y) << 1 | uint(is_same.z) << 2 |
                                    uint(is_same.w) << 3);
        remaining &= ~members;
        bool is_shared = (members & (members - 1u)) != 0u; // else the sample has its own light
        bool is_split = false;
        if (is_shared)
            for (int k = 0; k < 4 && !is_split; k++)
                is_split = is_in_other_light(words[first], pixel, first, neighbour(pixel, k),
                                             neighbours[k]);
        apart |= is_split ? members : 0u;
        asked |= is_shared ? members : 0u;
    }
    return apart == 0u && is_unknown && asked != 0u ? asked | APART_UNKNOWN : apart;
}

void main()
{
    uvec2 at;
    uint candidate = apart_take(at);
    if (candidate == 0u)
        return;
    ivec2 pixel = ivec2(at);
    uint apart = find_apart(pixel, light_at(pixel, 0), candidate == CANDIDATE_UNKNOWN);
    if (apart != 0u)
        list_append(apart_word(pixel, apart));
}
