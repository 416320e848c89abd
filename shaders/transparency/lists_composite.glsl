// SPDX-License-Identifier: MIT
// Composites a pixel's sorted list front to back: the product of what the layers let through, and
// their light weighted by it (Porter, Duff 1984, "Compositing Digital Images", the operator over).
// Needs: SAMPLES, WALKS, u_size_px, u_depth_map, wide.glsl, those of media.glsl.
#include "material/filter_unpack.glsl"
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_keys_offset; // of the sorted half
uniform uint u_list_room;   // entries
#include "material/media.glsl"

struct pixel_layers {
    uint first, end; // of the pixel's list
};

pixel_layers layers_begin(ivec2 pixel)
{
    uint index = uint(pixel.y) * u_size_px.x + uint(pixel.x);
    uint first = index == 0u ? 0u : ends[index - 1u];
    return pixel_layers(first, min(ends[index], u_list_room));
}

// Of each walk: what its layers send, and what they let through of what is behind them. Both are
// wide: no layer is lost among ten thousand, and products do not depend on their order.
#ifdef HAS_REFRACTION
// Of each walk: the nearest entry of its samples that bends, behind which only others of that kind
// count, because the rest is seen elsewhere; and all but those, without media.
const uint NOT_BENT = 0xffffffffu;
struct layers_bent {
    uint entry;
    vec3 radiance, through;
};
layers_bent bent_layers[WALKS];
wide3 plain_light[WALKS], plain_share[WALKS];

void bent_begin()
{
    for (int i = 0; i < WALKS; i++) {
        bent_layers[i].entry = NOT_BENT;
        plain_light[i] = wide_of(vec3(0.0));
        plain_share[i] = share_all();
    }
}

// Whether the layer counts for the walk.
bool bent_meet(int i, uvec4 key, vec3 layer, wide3 filter_)
{
    if ((key.w & ENTRY_BENDS) != 0u) {
        bent_layers[i].entry = bent_layers[i].entry == NOT_BENT ? key.z : bent_layers[i].entry;
        return true;
    }
    plain_light[i] = light_add(plain_light[i], plain_share[i], layer);
    plain_share[i] = share_filter(plain_share[i], filter_);
    return bent_layers[i].entry == NOT_BENT;
}

void bent_end()
{
    for (int i = 0; i < WALKS; i++) {
        bent_layers[i].radiance = wide_round(plain_light[i]);
        bent_layers[i].through = share_round(plain_share[i]);
    }
}
#define COUNTS(i, key, layer, filter_) bent_meet(i, key, layer, filter_)
#else
#define COUNTS(i, key, layer, filter_) true
#endif

#ifdef HAS_MEDIA
// With the media between the layers.
void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    float depth[WALKS];
    wide3 light[WALKS], share[WALKS];
    for (int i = 0; i < WALKS; i++) {
        depth[i] = texelFetch(u_depth_map, pixel, first_sample + i).x;
        light[i] = wide_of(vec3(0.0));
        share[i] = share_all();
    }
#ifdef HAS_REFRACTION
    bent_begin();
#endif
    media_first = first_sample;
    media_begin_list(pixel, depth, layers.first, layers.end);
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = colors[2u * key.z].rgb * word.a;
        wide3 filter_ = filter_unpack(word.rgb);
        medium_event e = media_event(key.z, uintBitsToFloat(key.x));
        bool is_seen = (key.w & ENTRY_HIDDEN) == 0u;
#define CROSS(i) if ((key.w & 1u << (first_sample + i)) != 0u) { \
            media_meet(i, e); \
            media_cross(i, e); \
            if (is_seen && COUNTS(i, key, layer, filter_)) { \
                vec3 arriving = media_transmittance(i) * layer; \
                light[i] = light_add(light[i], share[i], arriving); \
                share[i] = share_filter(share[i], filter_); \
            } \
        }
        EACH_WALK(CROSS)
    }
    for (int i = 0; i < WALKS; i++) {
        media_end(i, depth[i]);
        through[i] = share_round(share[i]) * media_transmittance(i);
        radiance[i] = wide_round(light[i]);
    }
#ifdef HAS_REFRACTION
    bent_end();
#endif
}
#else
void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    wide3 light[WALKS], share[WALKS];
    for (int i = 0; i < WALKS; i++) {
        light[i] = wide_of(vec3(0.0));
        share[i] = share_all();
    }
#ifdef HAS_REFRACTION
    bent_begin();
#endif
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = colors[2u * key.z].rgb * word.a;
        wide3 filter_ = filter_unpack(word.rgb);
        for (int i = 0; i < WALKS; i++) {
            if ((key.w & 1u << (first_sample + i)) == 0u)
                continue;
            if (!COUNTS(i, key, layer, filter_))
                continue;
            light[i] = light_add(light[i], share[i], layer);
            share[i] = share_filter(share[i], filter_);
        }
    }
    for (int i = 0; i < WALKS; i++) {
        radiance[i] = wide_round(light[i]);
        through[i] = share_round(share[i]);
    }
#ifdef HAS_REFRACTION
    bent_end();
#endif
}
#endif
