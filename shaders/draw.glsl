// SPDX-License-Identifier: MIT
// The draw record of the current submission, and positions relative to its origin. Vertex stage.
#extension GL_ARB_shader_draw_parameters : require
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

layout(std430, binding = BIND_DRAWS) readonly buffer draw_buffer { draw_record draws[]; };

layout(location = 0) in vec3 a_position;

// Both camera and light passes use this one expression, so that depths of equal geometry are equal.
vec3 draw_position(uint slot)
{
    precise vec4 p = vec4(a_position, 1.0);
    precise vec3 r = vec3(dot(draws[slot].row_0, p), dot(draws[slot].row_1, p),
                          dot(draws[slot].row_2, p));
    return r;
}
