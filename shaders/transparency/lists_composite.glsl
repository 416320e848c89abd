// SPDX-License-Identifier: MIT
// Composites a pixel's sorted list front to back: the product of what the layers let through, and
// their light weighted by it (Porter, Duff 1984, "Compositing Digital Images", the operator over).
// Needs: SAMPLES, WALKS, u_size_px, u_depth_map, wide.glsl, those of media.glsl; AIR_ALONE: layers
// send nothing themselves, and light in the haze between them is a difference, of either sign.
#include "material/filter_unpack.glsl"
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_keys_offset; // of the sorted half
uniform uint u_list_room;   // entries
#include "material/media.glsl"

#ifdef AIR_ALONE
#define LAYER_LIGHT(entry, alpha) vec3(0.0)
#define AIR_BETWEEN(light, before) ((light) - (before))
#else
#define LAYER_LIGHT(entry, alpha) (colors[2u * (entry)].rgb * (alpha))
#define AIR_BETWEEN(light, before) max((light) - (before), 0.0)
#endif

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

#ifdef HAS_ATMOSPHERE
// The haze between two layers: in the picture without what bends, and in that of a walk until then.
bool bent_air(int i, vec3 air)
{
    plain_light[i] = light_add(plain_light[i], plain_share[i], air);
    return bent_layers[i].entry == NOT_BENT;
}
#define AIR_COUNTS(i, air) bent_air(i, air)
// What is seen behind the first that bends is looked up with the haze before it, which is there.
#define BENDS_FIRST(i, key) ((key.w & ENTRY_BENDS) != 0u && bent_layers[i].entry == NOT_BENT)
#endif

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
#define IS_BENT(i) (bent_layers[i].entry != NOT_BENT)
#define COUNTS(i, key, layer, filter_) bent_meet(i, key, layer, filter_)
#else
#define COUNTS(i, key, layer, filter_) true
#define AIR_COUNTS(i, air) true
#define BENDS_FIRST(i, key) false
#define IS_BENT(i) false
#endif

#ifdef HAS_ATMOSPHERE
// The haze between the layers, for each walk: its light up to the last surface that was met.
vec3 air_before[WALKS];

void air_begin()
{
    for (int i = 0; i < WALKS; i++)
        air_before[i] = vec3(0.0);
}

// The light between that surface and the one at hand. Of a walk: what comes through the layers.
void air_meet(int i, vec3 light, vec3 through_media, wide3 share, inout wide3 sum)
{
    vec3 air = AIR_BETWEEN(light, air_before[i]) * through_media;
    air_before[i] = light;
    if (AIR_COUNTS(i, air))
        sum = light_add(sum, share, air);
}
#endif

#ifdef HAS_MEDIA
#ifdef HAS_ATMOSPHERE
// What the media on the way of that light let through, in the mean: Simpson's rule of their fall.
void media_air(int i, vec3 light, wide3 share, inout vec3 media_before, inout wide3 sum)
{
    vec3 now = media_transmittance(i);
    vec3 mean = (media_before + 4.0 * sqrt(media_before * now) + now) * (1.0 / 6.0);
    media_before = now;
    air_meet(i, light, mean, share, sum);
}
#endif

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
#ifdef HAS_ATMOSPHERE
    vec2 middle = vec2(pixel) + 0.5;
    vec3 media_before[WALKS];
    atmosphere_begin(middle, depth[0]);
    air_begin();
    for (int i = 0; i < WALKS; i++)
        media_before[i] = media_transmittance(i);
#endif
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = LAYER_LIGHT(key.z, word.a);
        wide3 filter_ = filter_unpack(word.rgb);
        medium_event e = media_event(key.z, uintBitsToFloat(key.x));
        bool is_seen = (key.w & ENTRY_HIDDEN) == 0u;
#ifdef HAS_ATMOSPHERE
        atmosphere_seen air = atmosphere_look(middle, view_depth(uintBitsToFloat(key.x)));
        layer *= air.through;
#define CROSS_AIR(i) media_air(i, air.light, share[i], media_before[i], light[i]);
#define CROSS_BEND(i) if (is_seen && BENDS_FIRST(i, key)) \
            light[i] = light_add(light[i], share_filter(share[i], filter_), \
                                 -air.light * media_transmittance(i));
#else
#define CROSS_AIR(i)
#define CROSS_BEND(i)
#endif
#define CROSS(i) if ((key.w & 1u << (first_sample + i)) != 0u) { \
            media_meet(i, e); \
            CROSS_AIR(i) \
            media_cross(i, e); \
            CROSS_BEND(i) \
            if (is_seen && COUNTS(i, key, layer, filter_)) { \
                vec3 arriving = media_transmittance(i) * layer; \
                light[i] = light_add(light[i], share[i], arriving); \
                share[i] = share_filter(share[i], filter_); \
            } \
        }
        EACH_WALK(CROSS)
    }
#ifdef HAS_ATMOSPHERE
    atmosphere_seen ends[WALKS];
    atmosphere_look_at(middle, depth, ends);
#endif
    for (int i = 0; i < WALKS; i++) {
        media_end(i, depth[i]);
        through[i] = share_round(share[i]) * media_transmittance(i);
#ifdef HAS_ATMOSPHERE
        media_air(i, ends[i].light, share[i], media_before[i], light[i]);
        through[i] *= IS_BENT(i) ? air_share(1.0) : ends[i].through;
#endif
        radiance[i] = wide_round(light[i]);
    }
#ifdef HAS_REFRACTION
    bent_end();
#ifdef HAS_ATMOSPHERE
    for (int i = 0; i < WALKS; i++)
        bent_layers[i].through *= ends[i].through;
#endif
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
#ifdef HAS_ATMOSPHERE
    vec2 middle = vec2(pixel) + 0.5;
    atmosphere_begin(middle, texelFetch(u_depth_map, pixel, first_sample).x);
    air_begin();
#endif
    for (uint k = layers.first; k < layers.end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        vec4 word = colors[2u * key.z + 1u];
        vec3 layer = LAYER_LIGHT(key.z, word.a);
        wide3 filter_ = filter_unpack(word.rgb);
#ifdef HAS_ATMOSPHERE
        atmosphere_seen air = atmosphere_look(middle, view_depth(uintBitsToFloat(key.x)));
        layer *= air.through;
#endif
        for (int i = 0; i < WALKS; i++) {
            if ((key.w & 1u << (first_sample + i)) == 0u)
                continue;
#ifdef HAS_ATMOSPHERE
            air_meet(i, air.light, vec3(1.0), share[i], light[i]);
            if (BENDS_FIRST(i, key))
                light[i] = light_add(light[i], share_filter(share[i], filter_), -air.light);
#endif
            if (!COUNTS(i, key, layer, filter_))
                continue;
            light[i] = light_add(light[i], share[i], layer);
            share[i] = share_filter(share[i], filter_);
        }
    }
#ifdef HAS_ATMOSPHERE
    float depth[WALKS];
    atmosphere_seen ends[WALKS];
    for (int i = 0; i < WALKS; i++)
        depth[i] = texelFetch(u_depth_map, pixel, first_sample + i).x;
    atmosphere_look_at(middle, depth, ends);
    for (int i = 0; i < WALKS; i++)
        air_meet(i, ends[i].light, vec3(1.0), share[i], light[i]);
#endif
    for (int i = 0; i < WALKS; i++) {
        radiance[i] = wide_round(light[i]);
        through[i] = share_round(share[i]);
#ifdef HAS_ATMOSPHERE
        through[i] *= IS_BENT(i) ? air_share(1.0) : ends[i].through;
#endif
    }
#ifdef HAS_REFRACTION
    bent_end();
#ifdef HAS_ATMOSPHERE
    for (int i = 0; i < WALKS; i++)
        bent_layers[i].through *= ends[i].through;
#endif
#endif
}
#endif
