// SPDX-License-Identifier: MIT
// Haze in all of the space (docs/explanation/media.md): how much of the light passes it. Points are
// those of view space [m].
// Provides: atmosphere_depth, atmosphere_transmittance, atmosphere_extinction.
// Extinction at the base [1/m]; 1 / falloff, 0: even [1/m]; height of the eye above the base, in
// falloffs; mean cosine of what is scattered.
uniform vec4 u_atmosphere;
uniform vec3 u_atmosphere_up; // +Y of the world

const float ATMOSPHERE_SAME_HEIGHT = 1e-3; // falloffs: above it, differences are exact enough

float atmosphere_height(vec3 p) // above the base, in falloffs
{
    return u_atmosphere.z + u_atmosphere.y * dot(u_atmosphere_up, p);
}

float atmosphere_density(float height) { return exp(-max(height, 0.0)); }

// Its integral from the base up, below which it is 1.
float atmosphere_column(float height)
{
    return height < 0.0 ? height : 1.0 - exp(-height);
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
    float low = atmosphere_height(p), high = atmosphere_height(q), rise = high - low;
    float middle = atmosphere_density(low + 0.5 * rise);
    float mean = abs(rise) < ATMOSPHERE_SAME_HEIGHT
                     ? (atmosphere_density(low) + 4.0 * middle + atmosphere_density(high)) / 6.0
                     : (atmosphere_column(high) - atmosphere_column(low)) / rise;
    return way * mean;
}

float atmosphere_transmittance(vec3 p, vec3 q) { return exp(-atmosphere_depth(p, q)); }

// 1 - exp(-x) for x >= 0, as exact where it is small.
float atmosphere_loss(float x)
{
    return x < 0.02 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}
