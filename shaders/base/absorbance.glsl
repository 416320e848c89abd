// SPDX-License-Identifier: MIT
// The absorbance of a filter: -ln of it, up to the most. Provides: absorbance_of_filter.
const float ABSORBANCE_MOST = 10.0; // of a layer: one that covers all lets through 5e-5

vec3 absorbance_of_filter(vec3 t)
{
    return clamp(-log(max(t, 1e-30)), 0.0, ABSORBANCE_MOST);
}
