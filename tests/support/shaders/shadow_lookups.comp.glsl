// SPDX-License-Identifier: MIT
// The lookups of a frame and nothing else, to be measured: each point that the frame shades asks
// for the lights that shading asks for, and answers with their sum.
// Needs: those of lighting.glsl. LOOKUPS_LEFT_OUT: all but the lookups themselves.
#include "shading/lighting.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_ENTRY_COLORS) writeonly buffer result_buffer { vec4 results[]; };
uniform uint u_count;
uniform uint u_width_px;

vec3 ask_lights(shadow_point p, vec3 position, vec3 normal, vec3 geo_normal)
{
    uint without = p.flags >> SHADOW_POINT_EXCLUDED_NODE; // the object and one
    light_tolerance = vec2(1.0, clamp(8.0 * length(cross(normal, geo_normal)), 0.0, 1.0));
    light_object = without > 0u ? without - 1u : NO_OBJECT;
    brdf_input b;
    b.normal = normal;
    b.transmission = (p.flags & SHADOW_POINT_TRANSMITS) != 0u ? 1.0 : 0.0;
    vec3 sum = vec3(0.0);
    uint pixel = bitfieldExtract(p.pixel_roughness, 0, SHADOW_POINT_PIXEL_BITS);
    light_cursor cursor =
        light_list_first(uvec2(pixel % u_width_px, pixel / u_width_px), -position.z);
    do { // as lighting_evaluate does
        light_cursor choice = cursor;
        uint chosen = 0u, bit = 1u;
        do {
            uint index;
            if (light_list_next(cursor, index) && lights[index].shadow != NO_SHADOW)
                chosen |= light_may_be_sent(lights[index], index, b, position) ? bit : 0u;
            bit <<= 1;
        } while (bit != 0u && light_list_count(cursor) > 0u);
        do {
            if (chosen != 0u) {
                uint shadow = lights[light_list_item(choice, uint(findLSB(chosen)))].shadow;
#ifdef LOOKUPS_LEFT_OUT
                sum += vec3(float(shadow));
#else
                sum += shadow_transmittance(shadow, position, geo_normal, light_tolerance,
                                            light_object);
#endif
                light_lookups++;
                chosen &= chosen - 1u;
            }
        } while (chosen != 0u);
    } while (light_list_count(cursor) > 0u);
    return sum;
}

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_count)
        return;
    shadow_point p = points[i];
    vec3 sum = vec3(0.0);
    if ((p.flags & SHADOW_POINT_UNLIT) == 0u)
        sum = ask_lights(p, p.position_offset.xyz, unpack_unit(p.normal),
                         unpack_unit(p.geo_normal));
    results[i] = vec4(sum, 1.0);
    atomicAdd(statistics[STATISTICS_LOOKUPS + (i & 63u)], light_lookups);
}
