// SPDX-License-Identifier: MIT
// The depth of a caster that is sampled SUBTEXELS * SUBTEXELS times in a texel: that of its plane
// on the ray through the texel's middle, where a query compares (shadow_query.glsl). So a pane that
// covers the texel is one step, and does not shadow itself. A plane so steep that it would leave
// the sample's own depth by SUBTEXEL_REACH texel widths is followed up to there.
// Needs what shadow_caster.glsl declares, and u_resolution, that of the samples.
uniform vec4 u_axis_x, u_axis_y;
uniform vec4 u_clip;

const float SUBTEXEL_REACH = 4.0;

// From the sample to the middle, along the face's axes, on a plane 1 m before a perspective light.
vec3 subtexel_shift()
{
    ivec2 sample_at = ivec2(gl_FragCoord.xy) % SUBTEXELS;
    vec2 shift = 0.5 * float(SUBTEXELS) - (vec2(sample_at) + 0.5);
    vec2 metres = shift * 2.0 / (float(u_resolution) * u_clip.xy);
    return u_axis_x.xyz * metres.x + u_axis_y.xyz * metres.y;
}

vec3 caster_ray()
{
    vec3 shift = subtexel_shift();
    float z = dot(u_axis_z.xyz, v_from_light) + u_axis_z.w;
    return u_clip_w.y != 0.0 ? normalize(v_from_light + shift * z) : v_from_light + shift;
}

float caster_depth()
{
    vec3 n = cross(dFdx(v_from_light), dFdy(v_from_light)), shift = subtexel_shift();
    float texel_m = float(SUBTEXELS) * 2.0 / (float(u_resolution) * min(u_clip.x, u_clip.y));
    float z = dot(u_axis_z.xyz, v_from_light) + u_axis_z.w;
    if (u_clip_w.y == 0.0) {
        float along = dot(n, u_axis_z.xyz), off = -dot(n, shift), reach = SUBTEXEL_REACH * texel_m;
        return z + (abs(off) < reach * abs(along) ? off / along : 0.0);
    }
    vec3 ray = v_from_light + shift * z; // as deep as the sample
    float toward = dot(n, v_from_light), along = dot(n, ray);
    bool is_near = abs(toward - along) < SUBTEXEL_REACH * texel_m * abs(along);
    return length(ray) * (is_near ? toward / along : 1.0);
}
