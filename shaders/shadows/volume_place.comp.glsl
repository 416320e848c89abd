// SPDX-License-Identifier: MIT
// Gives each point its cluster and room for the filters of the chunk's lights. Needs: those of
// volume_points.glsl.
#include "shadows/volume_points.glsl"
layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_VOLUME_FILTERS) writeonly buffer filter_buffer { uvec2 filters[]; };
uniform uint u_width_px;
uniform uint u_stride; // filters of a point
#include "shadows/pack_filter.glsl"

void main()
{
    uint i;
    if (!volume_point(i))
        return;
    shadow_point p = points[i];
    uint pixel = p.pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1u);
    table[i] = uvec2(i * u_stride, light_cluster(uvec2(pixel % u_width_px, pixel / u_width_px),
                                                 light_slice(-p.position_offset.z)));
    for (uint k = 0u; k < u_stride; k++)
        filters[i * u_stride + k] = pack_filter(vec3(1.0));
}
