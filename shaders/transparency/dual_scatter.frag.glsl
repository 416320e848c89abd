// SPDX-License-Identifier: MIT
// peeled_scatter.frag.glsl from both sides at once.
#define DUAL
#include "transparency/peeled_scatter.frag.glsl"
