// SPDX-License-Identifier: MIT
// Lamps in view in the haze: squares of pixels around them (renderer/shading/atmosphere_glow.h).
// The slices of their columns lie over one another as if they were one grid, that of
// u_atmosphere_grid. Needs: shading/atmosphere_slices.glsl; GLOW_ACCESS: readonly, or nothing.
// Provides the light along the ways of pixels up to their farthest sample, at GLOW_PARTS equal
// angles as the lamp sees the way.
layout(std430, binding = BIND_ATMOSPHERE_GLOW) GLOW_ACCESS buffer glow_buffer { float glow[]; };
uniform uvec2 u_glow;          // columns of a square a side, lamps
uniform vec4 u_glow_lamps[16]; // first column of the image; index of the light

const uint GLOW_PARTS = 16u;
const uint GLOW_WORDS = 4u + 3u * GLOW_PARTS; // of a pixel

ivec2 glow_first(uint lamp) { return ivec2(u_glow_lamps[lamp].xy); }

// Pixels are all but those in the columns at the sides, whose corners have fewer columns around.
uint glow_side_px() { return (u_glow.x - 2u) * uint(u_atmosphere_side_px); }

ivec2 glow_pixel(uint lamp, uvec2 place) // of the window
{
    return (glow_first(lamp) + 1) * int(u_atmosphere_side_px) - ivec2(u_window_first) +
           ivec2(place);
}

// Word k of a pixel: where the way begins to be looked along, ends, and is nearest to the lamp, all
// in metres from there but for the last, which is from the eye; then its distance from the lamp;
// then three a part: the light up to its end.
uint glow_at(uint lamp, uvec2 place, uint k)
{
    uint side = glow_side_px();
    return (lamp * GLOW_WORDS + k) * side * side + place.y * side + place.x;
}
