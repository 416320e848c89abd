// SPDX-License-Identifier: MIT
// Provides: the results that the start-up self-test counts (renderer/gl/selftest.c reads them by
// name there).
#include "shared/bindings.h"

layout(std430, binding = BIND_STATISTICS) buffer selftest_results {
    uint fragments;    // fragment shader invocations that wrote
    uint sum;          // of all values, read back to front by a second dispatch
    uint mask_errors;  // pixels whose coverage mask disagrees with their samples
    uint partly;       // pixels with some samples of either triangle
    uint texels;       // f32: sum over an RGB32F buffer texture
    uint pad;
    uint masks[];      // gl_SampleMaskIn of the last fragment per pixel
};
uniform uint u_width;  // of the target, for masks
