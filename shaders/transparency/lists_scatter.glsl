// SPDX-License-Identifier: MIT
// Writes each transparent fragment's surface into its pixel's range of the lists. Needs: those of
// entry_scatter.glsl.
#include "shared/bindings.h"
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer end_buffer { uint ends[]; };
layout(std430, binding = BIND_PIXEL_LEFT) buffer left_buffer { uint left[]; };
uniform uint u_list_room; // entries
const uint NO_ENTRY = 0xffffffffu;

uint take_place(uint pixel)
{
    int places = int(atomicAdd(left[pixel], 0xffffffffu));
    uint entry = ends[pixel] - uint(places);
    // more than were counted: none is written beyond the pixel's own list; and of those without
    // room the host hears (renderer/transparency/list_sizes.h)
    return places > 0 && entry < u_list_room ? entry : NO_ENTRY;
}
#define TAKE_ENTRY(pixel, depth, tie) take_place(pixel)
#include "transparency/entry_scatter.glsl"
