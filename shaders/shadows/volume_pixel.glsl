// SPDX-License-Identifier: MIT
// The points of a pixel: those of its layers, and those of its samples after them.
layout(std430, binding = BIND_TRACED_HEADS) readonly buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_VOLUME_ENDS) readonly buffer end_buffer { uint layer_ends[]; };
uniform uint u_layers; // points of layers, which come first; 0: there are no ends

struct pixel_points {
    uint first_layer, layers, first_sample, count;
};

pixel_points points_of(uint pixel)
{
    pixel_points p;
    uint head = heads[pixel];
    p.first_layer = u_layers > 0u && pixel > 0u ? layer_ends[pixel - 1u] : 0u;
    p.layers = u_layers > 0u ? layer_ends[pixel] - p.first_layer : 0u;
    p.first_sample = u_layers + (head >> 3);
    p.count = p.layers + (head & 7u);
    return p;
}

uint point_at(pixel_points p, uint k)
{
    return k < p.layers ? p.first_layer + k : p.first_sample + k - p.layers;
}
