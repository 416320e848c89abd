// SPDX-License-Identifier: MIT
// All texels of one face of a perspective light: a triangle about them, nearer than any caster.
// LAYERED: an instance for each face.
#include "shared/bindings.h"
#ifdef LAYERED
layout(location = ATTRIBUTE_INSTANCE) in uvec2 a_instance; // nobody's, face
flat out uint v_face;
#define FACE_INDEX a_instance.y
#endif
#include "shadows/shadow_face.glsl"

out vec3 v_from_light; // on a plane 1 m before the light; the light's axes
flat out uvec2 v_draw; // nobody's

void main()
{
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    vec2 at = corner / FACE.clip.xy;
    v_from_light =
        FACE.axis_x.xyz * at.x + FACE.axis_y.xyz * at.y + FACE.axis_z.xyz / FACE.axis_z.w;
    v_draw = uvec2(0u);
    gl_Position = vec4(corner, 1.0, 1.0);
#ifdef LAYERED
    v_face = FACE_INDEX;
    gl_Layer = int(FACE.layer);
#endif
}
