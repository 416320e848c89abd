// SPDX-License-Identifier: MIT
// Vertices of the camera's passes. Needs: HAS_TANGENT, HAS_TEXCOORDS, HAS_COLOR, HAS_NORMAL_OFFSET,
// CLIP_PLANES (count).
#include "draw/draw.glsl"

layout(location = 1) in vec3 a_normal;
layout(location = 0) out vec3 v_position; // view space [the scene's unit]
layout(location = 1) out vec3 v_normal;   // not normalised
layout(location = 2) flat out uvec4 v_ids; // material, node, primitive, determinant is positive
#ifdef HAS_TANGENT
layout(location = 2) in vec4 a_tangent;
layout(location = 3) out vec4 v_tangent;
#endif
#ifdef HAS_TEXCOORDS
layout(location = 3) in vec2 a_texcoord_0;
layout(location = 4) in vec2 a_texcoord_1;
layout(location = 4) out vec4 v_texcoords;
#endif
#ifdef HAS_COLOR
layout(location = 5) in vec4 a_color;
layout(location = 5) out vec4 v_color;
#endif
#ifdef HAS_NORMAL_OFFSET
// height of the tangent plane over the eye, its scale
layout(location = 6) out vec2 v_normal_offset;
#endif
#ifdef CLIP_PLANES
uniform vec4 u_clip_planes[CLIP_PLANES]; // for v_position
out float gl_ClipDistance[CLIP_PLANES];
#endif

uniform vec4 u_clip_across; // camera_clip of renderer/scene/camera.h
uniform vec4 u_clip_depth;

invariant gl_Position; // the count and the scatter pass must agree on every fragment

void main()
{
    v_position = draw_position();
    v_normal = draw_normal(a_normal);
    v_ids = uvec4(a_draw.xyz, a_normal_0.w > 0.0 ? 1u : 0u);
#ifdef HAS_TANGENT
    v_tangent = vec4(dot(a_row_0.xyz, a_tangent.xyz), dot(a_row_1.xyz, a_tangent.xyz),
                     dot(a_row_2.xyz, a_tangent.xyz), a_tangent.w);
#endif
#ifdef HAS_TEXCOORDS
    v_texcoords = vec4(a_texcoord_0, a_texcoord_1);
#endif
#ifdef HAS_COLOR
    v_color = a_color;
#endif
#ifdef HAS_NORMAL_OFFSET
    bool is_smooth = a_normal_1.w > 0.0;
    v_normal_offset = is_smooth ? vec2(dot(v_normal, v_position), length(v_normal)) : vec2(0.0);
#endif
#ifdef CLIP_PLANES
    for (int i = 0; i < CLIP_PLANES; i++)
#ifdef IS_CAP
        gl_ClipDistance[i] = 1.0; // it lies on its plane, and the others have cut it
#else
    { // both passes over the lists must cut alike
        precise float height = dot(u_clip_planes[i].xyz, v_position) + u_clip_planes[i].w;
        gl_ClipDistance[i] = height;
    }
#endif
#endif
    precise float w = u_clip_depth.z + u_clip_depth.w * v_position.z;
    precise vec2 across = u_clip_across.xy * v_position.xy + u_clip_across.zw * w;
    gl_Position = vec4(across, u_clip_depth.x + u_clip_depth.y * v_position.z, w);
}
