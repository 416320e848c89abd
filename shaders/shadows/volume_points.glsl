// SPDX-License-Identifier: MIT
// The points of a window, an invocation each, with a chunk of the list of each. Needs: LIGHT_LIST.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "lights/light_list.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_VOLUME_TABLE) buffer table_buffer { uvec2 table[]; };
uniform uint u_points;
uniform uvec2 u_light_chunk; // entries of each list: the first, their number

bool volume_point(out uint i)
{
    i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    return i < u_points;
}
