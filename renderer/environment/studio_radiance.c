/* SPDX-License-Identifier: MIT */
/* A studio for products: a grey room, lighter above, with four soft boxes. */
#include <math.h>
#include <stdlib.h>

#include "renderer/environment/studio_levels.h"

static const double pi = 3.14159265358979323846;

enum { STUDIO_WIDTH = ENVIRONMENT_LEVEL_WIDTH, STUDIO_HEIGHT = STUDIO_WIDTH / 2 };

struct box {                   /* a rectangle of angles with soft edges, in degrees */
    double azimuth, elevation; /* of its middle; azimuth 0 is -Z, 90 is +X */
    double half_width, half_height;
    double radiance;
};

static const struct box boxes[] = {
    {180, 84, 180, 20, 6},  /* above */
    {-125, 35, 24, 22, 12}, /* the key, to the left behind the camera of a front view */
    {115, 25, 14, 28, 5},   /* a fill, to the right */
    {20, 30, 30, 8, 6},     /* a strip behind what is shown */
};

static double soft_edge(double distance_deg, double half_deg)
{
    const double width_deg = 4;
    double t = fmin(fmax((half_deg - fabs(distance_deg)) / width_deg + 0.5, 0), 1);
    return t * t * (3 - 2 * t);
}

static double studio_radiance(double u, double v)
{
    double azimuth = (u - 0.5) * 360, elevation = 90 - v * 180;
    double up = sin(elevation * pi / 180), room = 0.35 + 0.25 * up;
    for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
        const struct box *box = &boxes[i];
        double aside = remainder(azimuth - box->azimuth, 360);
        double share = soft_edge(elevation - box->elevation, box->half_height);
        if (box->half_width < 180)
            share *= soft_edge(aside, box->half_width);
        room += share * (box->radiance - room);
    }
    return room;
}

bool studio_radiance_init(struct environment_texels *map, struct error *err)
{
    if (!environment_texels_init(map, STUDIO_WIDTH, STUDIO_HEIGHT, err))
        return false;
    double sum = 0, weights = 0;
    for (int y = 0; y < STUDIO_HEIGHT; y++)
        for (int x = 0; x < STUDIO_WIDTH; x++) {
            double v = (y + 0.5) / STUDIO_HEIGHT, weight = sin(pi * v);
            double radiance = studio_radiance((x + 0.5) / STUDIO_WIDTH, v);
            float *texel = map->pixels + 3 * ((size_t)y * STUDIO_WIDTH + (size_t)x);
            texel[0] = texel[1] = texel[2] = (float)radiance;
            sum += weight * radiance;
            weights += weight;
        }
    for (size_t i = 0; i < (size_t)3 * STUDIO_WIDTH * STUDIO_HEIGHT; i++)
        map->pixels[i] *= (float)(weights / sum);
    return true;
}
