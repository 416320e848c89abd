// SPDX-License-Identifier: MIT
// The list of a pixel for compositing that does without its order. It is read in its order
// nevertheless, for the same bits each time. Needs: u_size_px, wide.glsl. Provides: the buffers of
// lists_composite.glsl, pixel_layers, layers_begin; listed_opacity, of a layer's filter word.
#include "material/filter_unpack.glsl"
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_COLORS) readonly buffer color_buffer { vec4 colors[]; };
uniform uint u_keys_offset; // of the sorted half
uniform uint u_list_room;   // entries

// The light of a layer that lets everything through is shared out as if it covered this much.
const float OPACITY_LEAST = 1e-4;

struct pixel_layers {
    uint first, end; // of the pixel's list
};

pixel_layers layers_begin(ivec2 pixel)
{
    uint index = uint(pixel.y) * u_size_px.x + uint(pixel.x);
    uint first = index == 0u ? 0u : ends[index - 1u];
    return pixel_layers(first, min(ends[index], u_list_room));
}

// A part per channel: 1 less the filter.
vec3 listed_opacity(vec3 word)
{
    return max(mix(word, 1.0 + word, lessThan(word, vec3(0.0))), vec3(OPACITY_LEAST));
}
