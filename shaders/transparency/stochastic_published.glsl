// SPDX-License-Identifier: MIT
// stochastic_composite.glsl without what corrects it.
#define AS_PUBLISHED
#include "transparency/stochastic_composite.glsl"
