// SPDX-License-Identifier: MIT
// Third pass of peeling a layer: writes the surface of the fragment that the first two have found,
// as the entry of its pixel. Needs: those of entry_scatter.glsl.
#include "shared/bindings.h"
#define PEELED_ACCESS readonly
#define PEELS_FRAGMENTS
#include "transparency/peeled_state.glsl"
const uint NO_ENTRY = 0xffffffffu;

uint take_layer(uint pixel, uint depth, uint tie)
{
    bool is_it = depth == NEAREST_DEPTH(pixel) && tie == NEAREST_TIE(pixel) &&
                 is_behind_peeled(pixel, depth, tie);
    return is_it ? pixel : NO_ENTRY;
}
#define TAKE_ENTRY(pixel, depth, tie) take_layer(pixel, depth, peeled_tie(tie))
#include "transparency/entry_scatter.glsl"
