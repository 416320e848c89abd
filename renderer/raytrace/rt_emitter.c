/* SPDX-License-Identifier: MIT */
/* Falloff of the lights, and points on those that have an area. */
#include "renderer/raytrace/rt_emitter.h"

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"

uint32_t rt_light_sample_count(const struct state_light *light, const struct view_quality *quality)
{
    if (!state_light_is_area(light))
        return 1;
    if (quality->area_samples)
        return (uint32_t)quality->area_samples;
    return quality->reference ? AREA_SAMPLES_DEFAULT_REFERENCE : AREA_SAMPLES_DEFAULT;
}

/* Finaliser of Murmur3 (Appleby 2008): every bit of the seed reaches every bit of the result. */
static uint32_t scatter_bits(uint32_t x)
{
    x = (x ^ x >> 16) * 0x85ebca6bu;
    x = (x ^ x >> 13) * 0xc2b2ae35u;
    return x ^ x >> 16;
}

static uint32_t reverse_bits(uint32_t x)
{
    x = x << 16 | x >> 16;
    x = (x & 0x00ff00ffu) << 8 | (x & 0xff00ff00u) >> 8;
    x = (x & 0x0f0f0f0fu) << 4 | (x & 0xf0f0f0f0u) >> 4;
    x = (x & 0x33333333u) << 2 | (x & 0xccccccccu) >> 2;
    return (x & 0x55555555u) << 1 | (x & 0xaaaaaaaau) >> 1;
}

/* Second dimension of Sobol's sequence: the direction numbers of the polynomial x + 1. */
static uint32_t sobol_second(uint32_t index)
{
    uint32_t x = 0;
    for (uint32_t v = 1u << 31; index; index >>= 1, v ^= v >> 1)
        if (index & 1)
            x ^= v;
    return x;
}

/* To the middle of the 2^-32 interval: never 0 or 1. */
static double unit_interval(uint32_t x)
{
    return (x + 0.5) * 0x1p-32;
}

void rt_sequence_point(uint32_t index, uint32_t seed, double xy[2])
{
    uint32_t turn = scatter_bits(seed + 0x9e3779b9u);
    xy[0] = unit_interval(reverse_bits(index) ^ turn);
    xy[1] = unit_interval(sobol_second(index) ^ scatter_bits(turn));
}

static void square_to_disk(double xy[2])
{
    double a = 2 * xy[0] - 1, b = 2 * xy[1] - 1;
    bool is_wide = fabs(a) > fabs(b);
    double radius = is_wide ? a : b;
    double angle = is_wide ? M_PI_4 * (b / a) : M_PI_2 - M_PI_4 * (a / b);
    if (radius == 0)
        angle = 0;
    xy[0] = radius * cos(angle);
    xy[1] = radius * sin(angle);
}

void rt_light_place(const struct state_light *light, const double unit[2], double point[3])
{
    double xy[2] = {unit[0], unit[1]};
    if (light->type == SCENE_LIGHT_DISK)
        square_to_disk(xy);
    else
        xy[0] = 2 * xy[0] - 1, xy[1] = 2 * xy[1] - 1;
    for (int k = 0; k < 3; k++)
        point[k] = light->position[k] + light->half_u[k] * xy[0] + light->half_v[k] * xy[1];
}

/* The sample-th point of an area light (world); the centre of another. */
static void sample_point(const struct state_light *light, const struct rt_light_sample *sample,
                         double point[3])
{
    memcpy(point, light->position, 3 * sizeof *point);
    if (!state_light_is_area(light) || sample->count <= 1)
        return;
    double xy[2];
    rt_sequence_point(sample->index, sample->seed, xy);
    rt_light_place(light, xy, point);
}

/* KHR_lights_punctual, range and "Inner and Outer Cone Angles". */
static double point_gain(const struct state_light *light, double distance, const double l[3])
{
    double gain = 1 / fmax(distance * distance, 1e-24);
    if (light->range > 0) {
        double q = distance / (double)light->range;
        gain *= fmax(0, 1 - q * q * q * q);
    }
    if (light->type == SCENE_LIGHT_SPOT) {
        double outer = cos((double)light->outer_cone_rad);
        double scale = 1 / fmax(cos((double)light->inner_cone_rad) - outer, 1e-3);
        double cone = fmin(fmax((-vec3_dot(light->direction, l) - outer) * scale, 0), 1);
        gain *= cone * cone;
    }
    return gain;
}

void rt_light_arrive(const struct state_light *light, const struct rt_light_sample *sample,
                     const double origin[3], const double point[3], struct rt_arrival *arrival)
{
    double *l = arrival->direction;
    if (light->type == SCENE_LIGHT_DIRECTIONAL) {
        for (int k = 0; k < 3; k++)
            l[k] = -light->direction[k];
        arrival->distance_m = INFINITY;
        arrival->gain = 1;
        return;
    }
    double at[3];
    sample_point(light, sample, at);
    for (int k = 0; k < 3; k++)
        l[k] = at[k] - origin[k] - point[k];
    arrival->distance_m = vec3_length(l);
    vec3_normalize(l);
    arrival->gain = point_gain(light, arrival->distance_m, l);
    if (state_light_is_area(light)) /* Lambert 1760, "Photometria": dE = L cos dA / d^2 */
        arrival->gain *= fmax(-vec3_dot(light->direction, l), 0) * light->area_m2 / sample->count;
}
