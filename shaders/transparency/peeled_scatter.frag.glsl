// SPDX-License-Identifier: MIT
// Third pass of peeling a layer: writes the surface of the fragment that the first two have found,
// as the entry of its pixel; DUAL: the farthest, where it is another one, as a second entry. Needs:
// those of entry_scatter.glsl.
#include "shared/bindings.h"
#define PEELED_ACCESS readonly
#define PEELS_FRAGMENTS
#include "transparency/peeled_state.glsl"
const uint NO_ENTRY = 0xffffffffu;

uint take_layer(uint pixel, uint depth, uint tie)
{
    if (!is_left(pixel, depth, tie))
        return NO_ENTRY;
    if (depth == NEAREST_DEPTH(pixel) && tie == NEAREST_TIE(pixel))
        return PEELED_ENTRY(pixel);
#ifdef DUAL
    if (depth == FARTHEST_DEPTH(pixel) && tie == FARTHEST_TIE(pixel))
        return PEELED_ENTRY(pixel) + 1u;
#endif
    return NO_ENTRY;
}
#define TAKE_ENTRY(pixel, depth, tie) take_layer(pixel, depth, peeled_tie(tie))
#include "transparency/entry_scatter.glsl"
