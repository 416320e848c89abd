// SPDX-License-Identifier: MIT
// The number of an edge, of a part of it, or of a triangle; the stages behind find where it is.
out uint v_patch;

void main()
{
    v_patch = uint(gl_VertexID);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
