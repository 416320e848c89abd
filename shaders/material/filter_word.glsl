// SPDX-License-Identifier: MIT
// A transmittance in 32 bits, as precise next to 1 as next to 0: ten thousand layers of 1 - 1e-7
// multiply to what they should. Up to one half it is stored negated; above, as the opacity 1 - t.

vec3 filter_pack(vec3 t, vec3 opacity)
{
    bvec3 is_dark = bvec3(uvec3(lessThan(t, vec3(0.5))) & uvec3(greaterThan(t, vec3(0.0))));
    return mix(opacity, -t, is_dark);
}
