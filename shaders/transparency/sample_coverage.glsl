// SPDX-License-Identifier: MIT
// Which samples of a fragment are in front of the opaque depth, where the device does not tell
// (GL_ARB_post_depth_coverage is absent). A fragment's depth is linear over the pixel. Provides:
// coverage_in_front. Fragment stage, of a target with four samples whose depth is not written.
layout(binding = UNIT_GBUFFER_DEPTH) uniform sampler2DMS u_depth_map;
uniform vec2 u_sample_positions[4]; // in the pixel, y up

// depth: reversed, in the middle of the pixel; slope: its change per pixel. Depths that differ by
// rounding are equal, and equal passes: four units in the last place, and what the depth changes by
// over a quarter of the grid of 1/256 pixel on which rasterisers place vertices.
uint coverage_in_front(float depth, vec2 slope)
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float slack = (abs(slope.x) + abs(slope.y)) * (1.0 / 1024.0);
    uint in_front = 0u;
    for (int i = 0; i < 4; i++) {
        float opaque = texelFetch(u_depth_map, pixel, i).x;
        float at = max(depth + dot(slope, u_sample_positions[i] - 0.5), 0.0);
        if (at >= opaque - slack - opaque * (1.0 / 2097152.0))
            in_front |= 1u << i;
    }
    return in_front;
}
