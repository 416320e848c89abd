// SPDX-License-Identifier: MIT
// A shadow caster as one face of a light sees it. Draw records are in the light's space.
// COLORS: the primitive has vertex colours; TEXTURES: bit mask of the sampled slots; ANGLED: the
// filter depends on the angle; CONSTANT: it does not, nor on anything else that varies over the
// surface, so it is evaluated here. MEDIUM: the primitive bounds a medium, its filter has no
// thickness. CUT_PLANES: clip planes that cut casters, at most 8.
#include "draw.glsl"
#ifdef CONSTANT
#include "material.glsl"
uniform uint u_blend_filter;
flat out vec3 v_t_enter;
flat out vec3 v_t_leave;
#endif

uniform vec3 u_axis_x, u_axis_y, u_axis_z; // rows of face_from_light, of 0, 1 and -1
uniform float u_unit_m;
uniform vec4 u_clip;   // x' = x * u_clip.x, y' = y * u_clip.y, z' = u_clip.z + z * u_clip.w
uniform vec4 u_clip_w; // w' = u_clip_w.x + z * u_clip_w.y

#ifdef COLORS
layout(location = 5) in vec4 a_color;
out vec4 v_color;
#endif
#if TEXTURES != 0
layout(location = 3) in vec2 a_texcoord_0;
layout(location = 4) in vec2 a_texcoord_1;
out vec2 v_texcoord_0;
out vec2 v_texcoord_1;
#endif
#ifdef ANGLED
layout(location = 1) in vec3 a_normal;
out vec3 v_normal;
#endif
#ifndef DEPTH_ONLY
out vec3 v_from_light; // the light's axes [m]
flat out uvec2 v_draw; // material, node
#endif

#ifdef CUT_PLANES
uniform vec4 u_cut_planes[CUT_PLANES]; // the light's axes [m]
out gl_PerVertex { invariant vec4 gl_Position; float gl_ClipDistance[CUT_PLANES]; };
#else
out gl_PerVertex { invariant vec4 gl_Position; };
#endif

void main()
{
    vec3 r = draw_position();
    precise vec3 face = vec3(dot(u_axis_x, r), dot(u_axis_y, r), dot(u_axis_z, r));
    precise vec4 clip = vec4(face.x * u_clip.x, face.y * u_clip.y, u_clip.z + face.z * u_clip.w,
                             u_clip_w.x + face.z * u_clip_w.y);
    gl_Position = clip;
#ifdef CUT_PLANES
    for (int i = 0; i < CUT_PLANES; i++) {
#if defined(MEDIUM) || defined(IS_CAP)
        gl_ClipDistance[i] = 1.0; // drawn whole: shadow_deep.frag.glsl moves its events
#else
        gl_ClipDistance[i] = dot(u_cut_planes[i].xyz, r * u_unit_m) + u_cut_planes[i].w;
#endif
    }
#endif
#ifdef CONSTANT
    uint m = a_draw.x;
    vec4 base = clamp(materials[m].base_color, 0.0, 1.0);
    vec4 t = materials[m].transmission_f0_thickness;
#ifdef MEDIUM
    t.z = 0.0;
#endif
    v_t_enter = material_filter(m, base, t.x, t.z, 1.0, true, u_blend_filter);
    v_t_leave = material_filter(m, base, t.x, t.z, 1.0, false, u_blend_filter);
#endif
#ifdef COLORS
    v_color = a_color;
#endif
#if TEXTURES != 0
    v_texcoord_0 = a_texcoord_0;
    v_texcoord_1 = a_texcoord_1;
#endif
#ifdef ANGLED
    v_normal = draw_normal(a_normal);
#endif
#ifndef DEPTH_ONLY
    v_from_light = r * u_unit_m;
    v_draw = a_draw.xy;
#endif
}
