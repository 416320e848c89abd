// SPDX-License-Identifier: MIT
// What a light sends to a point. Needs: LIGHT_KINDS, HAS_LIGHT_RANGES, struct light_record;
// shading/atmosphere.glsl where HAS_ATMOSPHERE.

// LIGHT_KINDS: the kinds of light that there are, bit 1 << LIGHT_*. The test of a kind is decided
// when the program is compiled where no other is there, or not this one.
bool light_is(light_record r, uint kind)
{
    return (LIGHT_KINDS & 1u << kind) != 0u && (LIGHT_KINDS == 1u << kind || r.type == kind);
}

// The share that the cone of a spot lets through, by the cosine off its axis: KHR_lights_punctual.
float light_cone(light_record r, float cos_off_axis)
{
    float cone = clamp(cos_off_axis * r.direction_cone.w + r.spot_offset, 0.0, 1.0);
    return cone * cone;
}

// Luminous intensity towards the point over squared distance [lx], with the range window of
// KHR_lights_punctual.
vec3 light_arriving(light_record r, vec3 position, out vec3 l)
{
    if (light_is(r, LIGHT_DIRECTIONAL)) {
        l = -r.direction_cone.xyz;
        return r.color.rgb;
    }
    vec3 to_light = r.position_range.xyz - position;
    float d2 = dot(to_light, to_light);
    l = to_light * inversesqrt(max(d2, 1e-37));
    float gain = 1.0 / max(d2, 1e-24);
#ifdef HAS_LIGHT_RANGES
    float range = r.position_range.w;
    if (range > 0.0) {
        float q = d2 / (range * range);
        gain *= clamp(1.0 - q * q, 0.0, 1.0);
    }
#endif
    float cos_off_axis = dot(r.direction_cone.xyz, -l);
    if (light_is(r, LIGHT_AREA))
        gain *= max(cos_off_axis, 0.0); // Lambert 1760: I = L A cos
    if (light_is(r, LIGHT_SPOT))
        gain *= light_cone(r, cos_off_axis);
#ifdef HAS_ATMOSPHERE
    gain *= atmosphere_transmittance(position, r.position_range.xyz);
#endif
    return r.color.rgb * gain;
}
