// SPDX-License-Identifier: MIT
// First pass of a light linked list: depth of the front faces (Lindbeck 2015, 2.1.1).
in float v_view_z;
layout(location = 0) out float o_front;

void main()
{
    o_front = v_view_z;
}
