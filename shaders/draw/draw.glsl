// SPDX-License-Identifier: MIT
// The draw record of this instance (struct draw_record), and positions in its space.
// LAYERED: instances are numbers of a record and of a face. Vertex stage.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

layout(location = 0) in vec3 a_position;
#ifdef LAYERED
layout(location = ATTRIBUTE_INSTANCE) in uvec2 a_instance; // record, face
layout(std430, binding = BIND_DRAWS) readonly buffer draw_buffer { draw_record draws[]; };
#define a_row_0 draws[a_instance.x].row_0
#define a_row_1 draws[a_instance.x].row_1
#define a_row_2 draws[a_instance.x].row_2
#define a_normal_0 draws[a_instance.x].normal_0
#define a_normal_1 draws[a_instance.x].normal_1
#define a_normal_2 draws[a_instance.x].normal_2
#define a_draw uvec3(draws[a_instance.x].material, draws[a_instance.x].node, \
                     draws[a_instance.x].primitive)
#else
layout(location = ATTRIBUTE_DRAW + 0) in vec4 a_row_0;
layout(location = ATTRIBUTE_DRAW + 1) in vec4 a_row_1;
layout(location = ATTRIBUTE_DRAW + 2) in vec4 a_row_2;
layout(location = ATTRIBUTE_DRAW + 3) in vec4 a_normal_0; // w: sign of the determinant
layout(location = ATTRIBUTE_DRAW + 4) in vec4 a_normal_1;
layout(location = ATTRIBUTE_DRAW + 5) in vec4 a_normal_2;
layout(location = ATTRIBUTE_DRAW + 6) in uvec4 a_draw; // material, node, primitive, object
#endif

// Both camera and light passes use this one expression, so that depths of equal geometry are equal.
vec3 draw_position()
{
    precise vec4 p = vec4(a_position, 1.0);
    precise vec3 r = vec3(dot(a_row_0, p), dot(a_row_1, p), dot(a_row_2, p));
    return r;
}

vec3 draw_normal(vec3 normal)
{
    return vec3(dot(a_normal_0.xyz, normal), dot(a_normal_1.xyz, normal),
                dot(a_normal_2.xyz, normal));
}
