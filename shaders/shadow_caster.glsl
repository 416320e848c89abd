// SPDX-License-Identifier: MIT
// What a caster does to light at the centre of a texel: its depth in the light's list and its
// transmittance. Provides: caster_depth(), caster_base(), caster_transmittance(). Fragment stage.
// Needs the defines of shadow_caster.vert.glsl.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "material.glsl"

uniform vec3 u_axis_z;     // row of face_from_light along the light's view
uniform vec4 u_clip_w;     // y is 0 for orthographic faces
uniform uint u_blend_filter;

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
#ifdef SUBTEXELS
#include "shadow_subtexel.glsl"
#else
// A point on the way of the light, about its origin; perspective: its unit direction.
vec3 caster_ray()
{
    return u_clip_w.y != 0.0 ? normalize(v_from_light) : v_from_light;
}

float caster_depth()
{
    return u_clip_w.y != 0.0 ? length(v_from_light) : dot(u_axis_z, v_from_light);
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
    vec3 l = u_clip_w.y != 0.0 ? normalize(v_from_light) : u_axis_z;
    float squared = dot(v_normal, v_normal);
    if (squared > 0.0)
        n_dot_l = abs(dot(v_normal, l)) * inversesqrt(squared);
#endif
    vec4 base = caster_base(m);
    vec3 t = abs(material_filter(m, base, transmission, thickness_m, n_dot_l,
                                 gl_FrontFacing, u_blend_filter));
    bool is_cut = (materials[m].flags & MATERIAL_MASK) != 0u &&
                  base.a < materials[m].emissive_alpha_cutoff.w;
    return is_cut ? vec3(1.0) : t;
}
#endif
