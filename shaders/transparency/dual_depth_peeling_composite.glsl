// SPDX-License-Identifier: MIT
// depth_peeling_composite.glsl, of layers that were composited from both sides.
#define DUAL
#include "transparency/depth_peeling_composite.glsl"
