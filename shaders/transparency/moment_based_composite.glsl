// SPDX-License-Identifier: MIT
// Composites a pixel's layers by Muenstermann, Krumpen, Klein and Peters 2018, "Moment-Based
// Order-Independent Transparency", with six power moments. A first walk sums the absorbance of
// the layers, -ln of their filter, times the powers 0 to 6 of their depth. A second one tells from
// these sums alone what absorbs in front of a layer: of all distributions of absorbance over depth
// that have the moments, the one with as much as can be at the layer's own depth has three more
// depths, and those in front of it count (Peters and Klein 2015, "Moment Shadow Mapping").
// Light is then scaled to what all layers cover, which is known exactly.
// The depth is the logarithm of the distance (orthographic: the distance), from -1 to 1 between the
// pixel's own nearest and farthest layer. Of what is at the layer's depth its own absorbance does
// not dim it, and half of the rest does: the middle of what the moments leave open, with which
// three to nine random panes are off by half as much in the mean as with a quarter. AS_PUBLISHED:
// with four moments, the fastest of the paper's, and a quarter of all that is at the layer's depth
// dims it, its own absorbance included.
// Not with HAS_MEDIA, HAS_REFRACTION, HAS_ATMOSPHERE: the row lacks them.
// Needs: WALKS, IS_ORTHOGRAPHIC, view_ray.glsl, those of listed_layers.glsl.
#include "base/absorbance.glsl"
#ifdef AS_PUBLISHED
#include "base/moments.glsl"
#else
#include "base/six_moments.glsl"
#endif
#include "transparency/listed_layers.glsl"

#ifdef AS_PUBLISHED
const float OVERESTIMATION = 0.25;
#else
const float OVERESTIMATION = 0.5;
#endif

float warped_depth(uint depth)
{
    float z = view_depth(uintBitsToFloat(depth));
#ifdef IS_ORTHOGRAPHIC
    return z;
#else
    return log(clamp(z, 1e-30, 1e30));
#endif
}

vec3 absorbance(vec3 word)
{
    vec3 thin = word * (1.0 + 0.5 * word); // where 1 - word has lost its bits
    vec3 of_opacity = mix(-log(max(1.0 - word, 1e-30)), thin, lessThan(word, vec3(1e-3)));
    vec3 of_filter = -log(max(-word, 1e-30));
    return clamp(mix(of_opacity, of_filter, lessThan(word, vec3(0.0))), 0.0, ABSORBANCE_MOST);
}

// What is visible of a layer at z, of absorbance tau.
vec3 visible_at(moments m, float z, vec3 tau)
{
    vec3 front, at;
    masses_at(m, z, front, at);
    vec3 absorbed = m.m0 * at;
#ifndef AS_PUBLISHED
    absorbed = max(absorbed - tau, 0.0);
#endif
    return exp(-m.m0 * front - OVERESTIMATION * absorbed);
}

void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    moments sums[WALKS];
    vec3 light[WALKS], reached[WALKS], covered[WALKS]; // as the moments have it, and exactly
    wide3 share[WALKS];
    for (int i = 0; i < WALKS; i++) {
        moments_clear(sums[i]);
        light[i] = reached[i] = covered[i] = vec3(0.0);
        share[i] = share_all();
    }
    float nearest = 0.0, unit = 0.0; // z is -1 + unit * (depth - nearest)
    if (layers.first < layers.end) {
        nearest = warped_depth(keys[u_keys_offset + layers.first].x);
        float extent = warped_depth(keys[u_keys_offset + layers.end - 1u].x) - nearest;
        unit = extent > 0.0 ? 2.0 / extent : 0.0;
    }
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec3 word = colors[2u * key.z + 1u].rgb;
        vec3 tau = absorbance(word);
        float z = unit * (warped_depth(key.x) - nearest) - 1.0;
        for (int i = 0; i < WALKS; i++)
            if ((key.w & 1u << (first_sample + i)) != 0u) {
                moments_add(sums[i], tau, z);
                share[i] = share_filter(share[i], filter_unpack(word));
            }
    }
    for (int i = 0; i < WALKS; i++)
        sums[i] = moments_normalize(sums[i]);
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = colors[2u * key.z].rgb * word.a, tau = absorbance(word.rgb);
        vec3 opacity = listed_opacity(word.rgb);
        float z = unit * (warped_depth(key.x) - nearest) - 1.0;
        for (int i = 0; i < WALKS; i++) {
            if ((key.w & 1u << (first_sample + i)) == 0u)
                continue;
            vec3 visible = visible_at(sums[i], z, tau);
            light[i] += visible * layer;
            reached[i] += visible * opacity;
            covered[i] += opacity * (1.0 - covered[i]);
        }
    }
    for (int i = 0; i < WALKS; i++) {
        bool has_any = reached[i].r > 0.0; // opacities have a least
        radiance[i] = has_any ? light[i] / reached[i] * covered[i] : vec3(0.0);
        through[i] = share_round(share[i]);
    }
}
