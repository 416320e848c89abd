// SPDX-License-Identifier: MIT
// Provides: depths at which a tile's beam may meet a light. Needs: light_linked_list_light.glsl.
// The f32 twin of light_bound_interval (renderer/lights/light_bounds.c), whose comments give the
// reasoning.
struct light_linked_list_beam {
    vec2 origin, slope;
    float spread, spread_per_m;
};

light_linked_list_beam light_linked_list_tile_beam(vec2 tile)
{
    vec2 size = (u_window.zw - u_window.xy) / u_tiles.xy;
    vec2 middle = u_window.xy + tile * size;
    float spread = 0.5 * length(size);
    return u_tiles.z > 0.0 ? light_linked_list_beam(middle, vec2(0.0), spread, 0.0)
                           : light_linked_list_beam(vec2(0.0), middle, 0.0, spread);
}

bool light_linked_list_sphere_interval(light_linked_list_light light, light_linked_list_beam beam,
                                       inout vec2 span)
{
    vec3 q = vec3(beam.slope, 1.0);
    vec3 to_center = light.center - vec3(beam.origin, 0.0);
    float qq = dot(q, q), w1 = beam.spread_per_m, a = qq - w1 * w1;
    if (a < 0.25 * qq)
        return true;
    float z = dot(q, to_center) / qq;
    vec3 m = z * q - to_center;
    float rho = light.radius + beam.spread + w1 * z;
    float discriminant = rho * rho * w1 * w1 + a * (rho * rho - dot(m, m));
    if (discriminant < 0.0)
        return false;
    float root = sqrt(discriminant);
    span.x = max(span.x, z + (rho * w1 - root) / a - light.slack);
    span.y = min(span.y, z + (rho * w1 + root) / a + light.slack);
    return span.x <= span.y;
}

// x: the gap, y: its slope in z.
vec2 light_linked_list_cone_gap(light_linked_list_light light, light_linked_list_beam beam, float z)
{
    vec3 q = vec3(beam.slope, 1.0);
    vec3 v = vec3(beam.origin, 0.0) + z * q - light.apex;
    float v_axial = dot(v, light.axis), q_axial = dot(q, light.axis);
    vec3 vp = v - v_axial * light.axis, qp = q - q_axial * light.axis;
    float rho = length(vp);
    float rho_slope = rho > 0.0 ? dot(vp, qp) / rho : 0.0;
    return vec2(light.cos_outer * rho - light.sin_outer * v_axial - beam.spread -
                    z * beam.spread_per_m - light.slack,
                light.cos_outer * rho_slope - light.sin_outer * q_axial - beam.spread_per_m);
}

bool light_linked_list_cone_interval(light_linked_list_light light, light_linked_list_beam beam,
                                     inout vec2 span)
{
    for (int i = 0; i < 3; i++) {
        vec2 gap = light_linked_list_cone_gap(light, beam, span.x);
        if (gap.x <= 0.0)
            break;
        if (gap.y >= 0.0)
            return false;
        span.x -= 0.999 * gap.x / gap.y; // short of the root by more than rounding
        if (span.x > span.y)
            return false;
    }
    for (int i = 0; i < 3; i++) {
        vec2 gap = light_linked_list_cone_gap(light, beam, span.y);
        if (gap.x <= 0.0)
            break;
        if (gap.y <= 0.0)
            return false;
        span.y -= 0.999 * gap.x / gap.y;
        if (span.y < span.x)
            return false;
    }
    return true;
}

bool light_linked_list_interval(light_linked_list_light light, light_linked_list_beam beam,
                                out vec2 span)
{
    span = vec2(light.z_lo, light.z_hi);
    if (!light_linked_list_sphere_interval(light, beam, span))
        return false;
    return light.cos_outer < -1.0 || light_linked_list_cone_interval(light, beam, span);
}
