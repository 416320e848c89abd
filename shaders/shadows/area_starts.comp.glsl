// SPDX-License-Identifier: MIT
// Where the shadow rays of each point begin, as renderer/raytrace/rt_shadow_points.c has it, and
// where its filters lie.
// Needs: LIGHT_LIST, optionally IS_ORTHOGRAPHIC.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/pack.glsl"
#include "lights/light_list.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_AREA_STARTS) writeonly buffer start_buffer { area_start starts[]; };
layout(std430, binding = BIND_AREA_TABLE) writeonly buffer table_buffer { uvec2 table[]; };
layout(std430, binding = BIND_AREA_LIGHTS) readonly buffer light_buffer { uint light_filters[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { area_statistics statistics; };

uniform uint u_points, u_width; // of the window [px]
uniform uvec2 u_light_chunk;    // entries of each list: first, count
uniform vec3 u_right, u_up, u_back, u_eye;
uniform float u_pixel;      // a pixel's size, over the distance where the eye is a point
uniform float u_farthest_m; // from the eye: nothing is farther
uniform float u_nudge_m;

// What rasterised positions are off by: rt_shadow_points.c.
const float EYE_ROUNDING = 5e-7, SNAPPING = 1.0 / 256.0;

vec3 to_world(vec3 v)
{
    return u_right * v.x + u_up * v.y + u_back * v.z;
}

uint count_filters(uint cluster)
{
    light_cursor cursor = light_list_at(cluster);
    light_list_chunk(cursor, u_light_chunk.x, u_light_chunk.y);
    uint count = 0u, light;
    while (light_list_next(cursor, light))
        count += light_filters[light];
    return count;
}

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_points)
        return;
    shadow_point p = points[index];
    table[index] = uvec2(0u);
    if ((p.flags & SHADOW_POINT_UNLIT) != 0u)
        return;
    vec3 from_eye = to_world(p.position_offset.xyz), normal = to_world(unpack_unit(p.geo_normal));
    float far = length(from_eye);
    if (!(far <= u_farthest_m)) {
        from_eye *= u_farthest_m / far;
        far = u_farthest_m;
    }
#ifdef IS_ORTHOGRAPHIC
    float footprint = u_pixel, facing = dot(u_back, normal);
#else
    float footprint = u_pixel * -dot(from_eye, u_back);
    float facing = dot(from_eye, normal) / max(far, 1e-30);
#endif
    float leaning = sqrt(max(1.0 - facing * facing, 0.0));
    float offset = u_nudge_m + EYE_ROUNDING * far + SNAPPING * footprint * leaning +
                   min(p.position_offset.w, footprint);
    starts[index].origin_offset = vec4(u_eye + from_eye, offset);
    starts[index].normal_x = normal.x;
    starts[index].normal_y = normal.y;
    starts[index].normal_z = normal.z;
    starts[index].skip = AREA_NOWHERE;
    uint pixel = p.pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1u);
    uint cluster = light_cluster(uvec2(pixel % u_width, pixel / u_width),
                                 light_slice(-p.position_offset.z));
    uint count = count_filters(cluster);
    uint first = count > 0u ? atomicAdd(statistics.filters, count) : 0u;
    table[index] = uvec2(first, cluster);
}
