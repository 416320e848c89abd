// SPDX-License-Identifier: MIT
// What a caster does to light at the centre of a texel: its depth in the light's list and its
// transmittance. Provides: caster_depth(), caster_base(), caster_transmittance(). Fragment stage.
// Needs the defines of shadow_caster.vert.glsl.
#ifdef LAYERED
flat in uint v_face;
#define FACE_INDEX v_face
#endif
#include "shadows/shadow_face.glsl"
#include "material/material.glsl"

in vec3 v_from_light;
flat in uvec2 v_draw; // material, node
#ifdef COLORS
in vec4 v_color;
#else
const vec4 v_color = vec4(1.0);
#endif
#if TEXTURES != 0
in vec2 v_texcoord_0;
in vec2 v_texcoord_1;
#else
const vec2 v_texcoord_0 = vec2(0.0);
const vec2 v_texcoord_1 = vec2(0.0);
#endif
#ifdef ANGLED
in vec3 v_normal;
#endif
#ifdef CONSTANT
flat in vec3 v_t_enter;
flat in vec3 v_t_leave;
#endif

// Depth in lists: distance from the light; along the light for orthographic faces. Never
// post-projection z.
bool face_is_perspective()
{
    return FACE.axis_z.w != 0.0;
}

#ifdef SUBTEXELS
#include "shadows/shadow_subtexel.glsl"
#else
// A point on the way of the light, about its origin; perspective: its unit direction.
vec3 caster_ray()
{
    return face_is_perspective() ? normalize(v_from_light) : v_from_light;
}

float caster_depth()
{
    return face_is_perspective() ? length(v_from_light) : dot(FACE.axis_z.xyz, v_from_light);
}
#endif

vec4 caster_base(uint m)
{
    vec4 texel = material_texel(m, SLOT_BASE_COLOR, v_texcoord_0, v_texcoord_1, vec4(1.0));
    return clamp(materials[m].base_color * v_color * texel, 0.0, 1.0);
}

// Samples textures with implicit derivatives: call it before any helper-lane guard.
// Exactly 0 or positive, so that the bits sort like the values.
#ifdef CONSTANT
vec3 caster_transmittance()
{
    return abs(gl_FrontFacing ? v_t_enter : v_t_leave);
}
#else
vec3 caster_transmittance()
{
    uint m = v_draw.x;
    float transmission = materials[m].transmission_f0_thickness.x *
        material_texel(m, SLOT_TRANSMISSION, v_texcoord_0, v_texcoord_1, vec4(1.0)).r;
#ifdef MEDIUM
    float thickness_m = 0.0;
#else
    float thickness_m = materials[m].transmission_f0_thickness.z *
        material_texel(m, SLOT_THICKNESS, v_texcoord_0, v_texcoord_1, vec4(1.0)).g;
#endif
    float n_dot_l = 1.0;
#ifdef ANGLED
    vec3 l = face_is_perspective() ? normalize(v_from_light) : FACE.axis_z.xyz;
    float squared = dot(v_normal, v_normal);
    if (squared > 0.0)
        n_dot_l = abs(dot(v_normal, l)) * inversesqrt(squared);
#endif
    vec4 base = caster_base(m);
    vec3 t = abs(material_filter(m, base, transmission, thickness_m, n_dot_l,
                                 gl_FrontFacing, FACE.blend_filter));
    bool is_cut = (materials[m].flags & MATERIAL_MASK) != 0u &&
                  base.a < materials[m].emissive_alpha_cutoff.w;
    return is_cut ? vec3(1.0) : t;
}
#endif
