// SPDX-License-Identifier: MIT
// Opaque depth of masked casters: the texel is blocked where alpha reaches the cutoff.
#include "shadows/shadow_caster.glsl"

void main()
{
    uint m = v_draw.x;
    if (caster_base(m).a < materials[m].emissive_alpha_cutoff.w)
        discard;
}
