// SPDX-License-Identifier: MIT
// Composites a pixel's layers by Enderton, Sintorn, Shirley and Luebke 2010, "Stochastic
// Transparency". A sample has PARTS parts (the paper's samples), and a layer covers as many of them
// as its opacity says in the mean, chosen by chance for each layer: floor(PARTS * opacity + xi), so
// that their number is stratified. A layer is seen in those parts that no nearer one covers.
// Opacity and parts are per channel; channels share their chance, so that grey layers stay grey.
// Parts are bits: 8 of red, then of green, then of blue. Chance comes from the pixel of the image,
// the sample and the triangle: noise stands still.
// By default the light of a layer counts by the share of the parts in which it is seen, if only in
// part (the paper's accumulation pass), and the sum is scaled to what all layers cover, which is
// known exactly (its alpha correction). AS_PUBLISHED: a part shows the nearest layer that covers
// it, and nothing is corrected.
// Not with HAS_MEDIA, HAS_REFRACTION, HAS_ATMOSPHERE: the row lacks them.
// Needs: WALKS, view_ray.glsl, those of listed_layers.glsl.
#include "transparency/listed_layers.glsl"
#include "base/hash_words.glsl"
uniform uint u_round; // of samples
const uint PARTS = 8u, ALL_PARTS = 0xffffffu;

// Parts of each channel.
vec3 count_parts(uint parts)
{
    return vec3(bitCount(parts & 0xffu), bitCount(parts & 0xff00u), bitCount(parts >> 16u)) *
           (1.0 / float(PARTS));
}

// Each part goes to any place with the same chance: one of two halves, of quarters, of neighbours.
uint shuffle_parts(uint parts, uint chance)
{
    uint t = (parts >> 4u ^ parts) & (chance & 0xfu) * 0x010101u;
    parts ^= t ^ t << 4u;
    t = (parts >> 2u ^ parts) & (chance >> 4u & 0x33u) * 0x010101u;
    parts ^= t ^ t << 2u;
    t = (parts >> 1u ^ parts) & (chance >> 10u & 0x55u) * 0x010101u;
    return parts ^ t ^ t << 1u;
}

// place: of the sample in the image. tie: of the triangle.
uint parts_covered(uvec3 place, uint tie, vec3 opacity)
{
    uvec4 chance = pcg4d(uvec4(place, tie));
    uvec3 count = uvec3(opacity * float(PARTS) + float(chance.x >> 8u) * (1.0 / 16777216.0));
    uvec3 parts = (uvec3(1u) << min(count, uvec3(PARTS))) - 1u;
    return shuffle_parts(parts.r | parts.g << 8u | parts.b << 16u, chance.y >> 8u);
}

void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    vec3 light[WALKS];
    uint open_[WALKS]; // parts that no layer covers yet
#ifndef AS_PUBLISHED
    vec3 reached[WALKS], covered[WALKS]; // by the parts, and exactly
    wide3 share[WALKS];
#endif
    uvec2 place = u_window_first + uvec2(pixel);
    for (int i = 0; i < WALKS; i++) {
        light[i] = vec3(0.0);
        open_[i] = ALL_PARTS;
#ifndef AS_PUBLISHED
        reached[i] = covered[i] = vec3(0.0);
        share[i] = share_all();
#endif
    }
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = colors[2u * key.z].rgb * word.a;
        wide3 filter_ = filter_unpack(word.rgb);
        vec3 opacity = listed_opacity(word.rgb);
        for (int i = 0; i < WALKS; i++) {
            if ((key.w & 1u << (first_sample + i)) == 0u)
                continue;
            uint sample_ = u_round << 8u | uint(first_sample + i);
            uint covers = parts_covered(uvec3(place, sample_), key.y, opacity);
#ifdef AS_PUBLISHED
            light[i] += count_parts(open_[i] & covers) * (layer / opacity);
#else
            vec3 visible = count_parts(open_[i]);
            light[i] += visible * layer;
            reached[i] += visible * opacity;
            covered[i] += opacity * (1.0 - covered[i]);
            share[i] = share_filter(share[i], filter_);
#endif
            open_[i] &= ~covers;
        }
    }
    for (int i = 0; i < WALKS; i++) {
#ifdef AS_PUBLISHED
        radiance[i] = light[i];
        through[i] = count_parts(open_[i]);
#else
        bool has_any = reached[i].r > 0.0; // opacities have a least
        radiance[i] = has_any ? light[i] / reached[i] * covered[i] : vec3(0.0);
        through[i] = share_round(share[i]);
#endif
    }
}
