// SPDX-License-Identifier: MIT
// What a transparent caster does to a texel that keeps four floats instead of a list.
//   otherwise     blending multiplies the filter into rgb, and leaves the nearest depth in alpha
//   BLENDED       as published, from the light on: a caster adds its colour to the share that it
//                 lets through of what is there. Of its filter t the share is the least channel
//                 and the colour the rest, so that a single caster is right; of alpha-blended
//                 surfaces by BLEND_MODISETT the share is 1 - alpha and the colour alpha t
//   CHANCE        blending leaves the nearest of the depths that casters take by chance: four of
//                 one opacity, that of the filter's luminance
//   ONE_CHANCE    (CHANCE, too) all four are one
//   COLOR_CHANCE  (CHANCE, too) of each colour one; alpha is the nearest of the three
//   WAVELENGTH    (CHANCE, too) likewise, but of the colour FACE.part alone
//   MOMENTS       blending adds up the absorbance a times powers of the depth z, from -1 to 1: of
//                 colour FACE.part a (z, z^2, z^3, z^4); of the part SHADOW_PART_TOTAL a of all
//                 colours, and in alpha it leaves 2 + z of the farthest caster
// Casters behind the nearest opaque one fail the depth test.
#include "shadows/shadow_caster.glsl"

#ifdef BLENDED
layout(location = 0, index = 0) out vec4 o_texel;
layout(location = 0, index = 1) out vec4 o_share;
#else
layout(location = 0) out vec4 o_texel;
#endif

#ifdef MOMENTS
#include "base/absorbance.glsl"
#endif
#ifdef CHANCE
flat in uint v_primitive;
#include "shadows/shadow_noise.glsl"
#ifdef ONE_CHANCE
#define GRAY_NOISE(at) vec4(shadow_noise_alone(at, 0u))
#else
#define GRAY_NOISE(at) shadow_noise(at, 4u)
#endif
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722); // Rec. 709

// As much of the light as the filter takes stops here: the chance alpha (1 - t) of McGuire and
// Enderton 2011 is 1 less the filter.
bvec4 caster_stops(vec3 t)
{
    uvec2 at = uvec2(gl_FragCoord.xy);
#ifdef COLOR_CHANCE
    bvec3 stops = lessThan(shadow_noise(at, 1u).rgb, 1.0 - t);
    return bvec4(stops, any(stops));
#elif defined WAVELENGTH
    uint part = FACE.part;
    bool is_stopped = shadow_noise_alone(at, part) < 1.0 - t[part];
    return bvec4(uvec4(equal(uvec4(0u, 1u, 2u, part), uvec4(part))) * uint(is_stopped));
#else
    return lessThan(GRAY_NOISE(at), vec4(1.0 - dot(t, LUMINANCE)));
#endif
}
#endif

void main()
{
    vec3 t = caster_transmittance();
    if (t == vec3(1.0))
        discard;
#ifdef CHANCE
    bvec4 stops = caster_stops(t);
    if (!any(stops))
        discard;
    o_texel = mix(vec4(SHADOW_TEXEL_FAR), vec4(caster_depth()), stops);
#elif defined BLENDED
    uint flags = materials[v_draw.x].flags;
    bool is_modified = FACE.blend_filter == BLEND_MODISETT &&
                       MATERIAL_IS(flags, MATERIAL_BLEND) &&
                       !MATERIAL_IS(flags, MATERIAL_TRANSMISSION);
    float alpha = caster_base(v_draw.x).a;
    float share = is_modified ? 1.0 - alpha : min(t.r, min(t.g, t.b));
    o_texel = vec4(is_modified ? alpha * t : t - share, caster_depth());
    o_share = vec4(share);
#elif defined MOMENTS
    float z = (caster_depth() - FACE.depths.x) * FACE.depths.y - 1.0;
    vec3 a = absorbance_of_filter(t);
    if (FACE.part == SHADOW_PART_TOTAL)
        o_texel = vec4(a, 2.0 + z);
    else
        o_texel = a[FACE.part] * vec4(z, z * z, z * z * z, z * z * z * z);
#else
    o_texel = vec4(t, caster_depth());
#endif
}
