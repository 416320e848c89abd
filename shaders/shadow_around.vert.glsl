// SPDX-License-Identifier: MIT
// All texels of one face of a perspective light: a triangle about them, nearer than any caster.
uniform vec3 u_axis_x, u_axis_y, u_axis_z; // rows of face_from_light, of 0, 1 and -1
uniform vec4 u_clip;                       // x' = x * u_clip.x, y' = y * u_clip.y
uniform vec4 u_clip_w;                     // w' = z * u_clip_w.y

out vec3 v_from_light; // on a plane 1 m before the light; the light's axes
flat out uvec2 v_draw; // nobody's

void main()
{
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    vec2 at = corner / u_clip.xy;
    v_from_light = u_axis_x * at.x + u_axis_y * at.y + u_axis_z / u_clip_w.y;
    v_draw = uvec2(0u);
    gl_Position = vec4(corner, 1.0, 1.0);
}
