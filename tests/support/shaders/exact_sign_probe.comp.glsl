// SPDX-License-Identifier: MIT
// Signs of determinants and of differences of products: tests/gpu/test_exact_sign.c.
#include "shared/bindings.h"
#include "shadows/exact_sign.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_ENTRY_KEYS) readonly buffer point_buffer { vec4 points[]; };
layout(std430, binding = BIND_ENTRY_COLORS) writeonly buffer sign_buffer { int signs[]; };
uniform uint u_count;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= u_count)
        return;
    vec4 p = points[4u * i], q = points[4u * i + 1u];
    signs[2u * i] = exact_sign_of_products(vec4[](p, q, points[4u * i + 2u], points[4u * i + 3u]));
    signs[2u * i + 1u] = exact_sign_of_difference(p.x, q.y, p.y, q.x);
}
