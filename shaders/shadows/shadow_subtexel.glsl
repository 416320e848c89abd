// SPDX-License-Identifier: MIT
// The depth of a caster that is sampled SUBTEXELS * SUBTEXELS times in a texel: that of its plane
// on the ray through the texel's middle, where a query compares (shadow_query.glsl). So a pane that
// covers the texel is one step, and does not shadow itself. A plane so steep that it would leave
// the sample's own depth by SUBTEXEL_REACH texel widths is followed up to there.
// Needs what shadow_caster.glsl declares; the face's resolution is that of the samples.

const float SUBTEXEL_REACH = 4.0;

// Width and height of a sample [m], on a plane 1 m before a perspective light.
vec2 subtexel_sides()
{
    float distance_m = face_is_perspective() ? 1.0 : FACE.axis_x.w;
    return distance_m * 2.0 / (float(FACE.resolution) * FACE.clip.xy);
}

// From the sample to the middle, along the face's axes, on a plane 1 m before a perspective light.
vec3 subtexel_shift()
{
    ivec2 sample_at = ivec2(gl_FragCoord.xy) % SUBTEXELS;
    vec2 shift = 0.5 * float(SUBTEXELS) - (vec2(sample_at) + 0.5);
    vec2 metres = shift * subtexel_sides();
    return FACE.axis_x.xyz * metres.x + FACE.axis_y.xyz * metres.y;
}

vec3 caster_ray()
{
    vec3 shift = subtexel_shift();
    float z = dot(FACE.axis_z.xyz, v_from_light);
    return face_is_perspective() ? normalize(v_from_light + shift * z) : v_from_light + shift;
}

float caster_depth()
{
    vec3 n = cross(dFdx(v_from_light), dFdy(v_from_light)), shift = subtexel_shift();
    vec2 sides = subtexel_sides();
    float texel_m = float(SUBTEXELS) * max(sides.x, sides.y);
    vec3 axis = FACE.axis_z.xyz;
    float z = dot(axis, v_from_light);
    if (!face_is_perspective()) {
        float along = dot(n, axis), off = -dot(n, shift), reach = SUBTEXEL_REACH * texel_m;
        return z + (abs(off) < reach * abs(along) ? off / along : 0.0);
    }
    vec3 ray = v_from_light + shift * z; // as deep as the sample
    float toward = dot(n, v_from_light), along = dot(n, ray);
    bool is_near = abs(toward - along) < SUBTEXEL_REACH * texel_m * abs(along);
    return length(ray) * (is_near ? toward / along : 1.0);
}
