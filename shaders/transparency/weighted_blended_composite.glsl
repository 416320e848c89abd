// SPDX-License-Identifier: MIT
// Composites a pixel's layers by McGuire and Bavoil 2013, "Weighted Blended Order-Independent
// Transparency", equations 6 and 7: what all let through is exact, and their light is a mean by
// weights of opacity and distance, as much of it as they cover. One layer is exact. Opacity has a
// part per channel, 1 less the filter. Lists are read in their order, for the same bits each time.
// Not with HAS_MEDIA, HAS_REFRACTION, HAS_ATMOSPHERE: the row lacks them.
// Needs: WALKS, view_ray.glsl, those of listed_layers.glsl.
#include "transparency/listed_layers.glsl"

// Equation 7, without the opacity: made for distances from 0.1 to 500 m.
float distance_weight(float z)
{
    float near = z / 5.0, far = min(abs(z), 1e6) / 200.0;
    float far_3 = far * far * far;
    return clamp(10.0 / (1e-5 + near * near + far_3 * far_3), 1e-2, 3e3);
}

void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    vec3 light[WALKS], weights[WALKS], covered[WALKS];
    wide3 share[WALKS];
    for (int i = 0; i < WALKS; i++) {
        light[i] = weights[i] = covered[i] = vec3(0.0);
        share[i] = share_all();
    }
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = colors[2u * key.z].rgb * word.a;
        wide3 filter_ = filter_unpack(word.rgb);
        vec3 opacity = listed_opacity(word.rgb);
        float weight = dot(opacity, vec3(1.0 / 3.0)) *
                       distance_weight(view_depth(uintBitsToFloat(key.x)));
        for (int i = 0; i < WALKS; i++) {
            if ((key.w & 1u << (first_sample + i)) == 0u)
                continue;
            light[i] += weight * layer;
            weights[i] += weight * opacity;
            covered[i] += opacity * (1.0 - covered[i]);
            share[i] = share_filter(share[i], filter_);
        }
    }
    for (int i = 0; i < WALKS; i++) {
        bool has_any = weights[i].r > 0.0; // opacities and weights have a least
        radiance[i] = has_any ? light[i] / weights[i] * covered[i] : vec3(0.0);
        through[i] = share_round(share[i]);
    }
}
