// SPDX-License-Identifier: MIT
// moment_based_composite.glsl, with what a layer absorbs itself in the way of its light.
#define AS_PUBLISHED
#include "transparency/moment_based_composite.glsl"
