// SPDX-License-Identifier: MIT
// Haze in all of the space (docs/explanation/media.md): how much of the light passes it. Points are
// those of view space [m].
// Provides: atmosphere_depth, atmosphere_depth_without_end, atmosphere_transmittance,
// atmosphere_extinction, atmosphere_loss.
// Extinction at the base [1/m]; 1 / falloff, 0: even [1/m]; height of the eye above the base, in
// falloffs; mean cosine of what is scattered.
uniform vec4 u_atmosphere;
uniform vec3 u_atmosphere_up; // +Y of the world

const float ATMOSPHERE_SAME_HEIGHT = 1e-6; // falloffs: above it, differences are exact enough

float atmosphere_height(vec3 p) // above the base, in falloffs
{
    return u_atmosphere.z + u_atmosphere.y * dot(u_atmosphere_up, p);
}

float atmosphere_density(float height) { return exp(-max(height, 0.0)); }

// 1 - exp(-x) for x >= 0, as exact where it is small.
float atmosphere_loss(float x)
{
    return x < 0.02 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}

float atmosphere_extinction(vec3 p)
{
    return u_atmosphere.x * atmosphere_density(atmosphere_height(p));
}

// Optical depth between two points.
float atmosphere_depth(vec3 p, vec3 q)
{
    float way = u_atmosphere.x * distance(p, q);
    if (u_atmosphere.y == 0.0)
        return way;
    float p_height = atmosphere_height(p), q_height = atmosphere_height(q);
    float low = min(p_height, q_height), high = max(p_height, q_height), rise = high - low;
    if (rise < ATMOSPHERE_SAME_HEIGHT)
        return way * atmosphere_density(low);
    float even = min(high, 0.0) - min(low, 0.0);
    float thin = atmosphere_density(low) * atmosphere_loss(max(high, 0.0) - max(low, 0.0));
    return way * (even + thin) / rise;
}

// Of a way [unit] from a point on, which may be infinite.
float atmosphere_depth_without_end(vec3 p, vec3 way)
{
    float climb = u_atmosphere.y * dot(u_atmosphere_up, way), height = atmosphere_height(p);
    if (u_atmosphere.x == 0.0)
        return 0.0;
    if (climb <= 0.0)
        return uintBitsToFloat(0x7f800000u);
    return u_atmosphere.x * (atmosphere_density(height) - min(height, 0.0)) / climb;
}

float atmosphere_transmittance(vec3 p, vec3 q) { return exp(-atmosphere_depth(p, q)); }
