// SPDX-License-Identifier: MIT
// peeled_tie.frag.glsl from both sides at once.
#define DUAL
#include "transparency/peeled_tie.frag.glsl"
