// SPDX-License-Identifier: MIT
// peeled_add.comp.glsl from both sides at once.
#define DUAL
#include "transparency/peeled_add.comp.glsl"
