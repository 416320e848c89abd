// SPDX-License-Identifier: MIT
// A shadow caster as one face of a light sees it. Draw records are in the light's space.
// COLORS: the primitive has vertex colours; TEXTURES: bit mask of the sampled slots; ANGLED: the
// filter depends on the angle; CONSTANT: it does not, nor on anything else that varies over the
// surface, so it is evaluated here. MEDIUM: the primitive bounds a medium, its filter has no
// thickness. CUT_PLANES: clip planes that cut casters, at most 8. LAYERED: all faces in one pass.
// CHANCE: noise needs the primitive.
#include "draw/draw.glsl"
#ifdef LAYERED
#define FACE_INDEX a_instance.y
#endif
#include "shadows/shadow_face.glsl"
#ifdef CONSTANT
#include "material/material.glsl"
flat out vec3 v_t_enter;
flat out vec3 v_t_leave;
#endif

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
#ifdef CHANCE
flat out uint v_primitive;
#endif
#ifdef LAYERED
flat out uint v_face;
#endif
#endif

// Not as members of a block: Mesa 22.3 takes gl_Layer for one that is left out of it then.
invariant gl_Position;
#ifdef CUT_PLANES
out float gl_ClipDistance[CUT_PLANES];
#endif

void main()
{
    vec3 r = draw_position();
    precise vec3 at = vec3(dot(FACE.axis_x.xyz, r), dot(FACE.axis_y.xyz, r),
                           dot(FACE.axis_z.xyz, r));
    precise vec4 clip = vec4(at.x * FACE.clip.x, at.y * FACE.clip.y,
                             FACE.clip.z + at.z * FACE.clip.w,
                             1.0 - FACE.axis_z.w + at.z * FACE.axis_z.w);
    gl_Position = clip;
#ifdef LAYERED
    gl_Layer = int(FACE.layer);
#endif
#ifdef CUT_PLANES
    for (int i = 0; i < CUT_PLANES; i++) {
#if defined(MEDIUM) || defined(IS_CAP)
        gl_ClipDistance[i] = 1.0; // drawn whole: shadow_deep.frag.glsl moves its events
#else
        // as exact as the position: both passes over a list must cut alike
        precise float distance_m =
            dot(FACE.cut_planes[i].xyz, r * FACE.axis_x.w) + FACE.cut_planes[i].w;
        gl_ClipDistance[i] = distance_m;
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
    v_t_enter = material_filter(m, base, t.x, t.z, 1.0, true, FACE.blend_filter);
    v_t_leave = material_filter(m, base, t.x, t.z, 1.0, false, FACE.blend_filter);
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
    v_from_light = r * FACE.axis_x.w;
    v_draw = a_draw.xy;
#ifdef CHANCE
    v_primitive = a_draw.z;
#endif
#ifdef LAYERED
    v_face = FACE_INDEX;
#endif
#endif
}
