// SPDX-License-Identifier: MIT
// peeled_nearest.frag.glsl from both sides at once.
#define DUAL
#include "transparency/peeled_nearest.frag.glsl"
