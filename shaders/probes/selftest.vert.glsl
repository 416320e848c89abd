// SPDX-License-Identifier: MIT
// One large triangle: at scale 1 it covers the target, below it leaves a slanted edge inside.
uniform float u_z, u_scale;

void main()
{
    vec2 corner = vec2((gl_VertexID & 1) << 2, (gl_VertexID & 2) << 1) * u_scale - 1.0;
    gl_Position = vec4(corner, u_z, 1.0);
}
