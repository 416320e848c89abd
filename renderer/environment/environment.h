/* SPDX-License-Identifier: MIT */
/* Light that comes from everywhere around a scene: an equirectangular map of radiance, with what is
 * needed to draw samples of it and to light without samples. Immutable after creation. Thread: any.
 *
 * Directions are unit vectors of the world, towards the light, before the view's rotation. Row 0 is
 * at +Y. The centre of the map is -Z, where a camera without a transform looks; to its right lies
 * +X: u = 1/2 + atan2(x, -z) / (2 pi), v = acos(y) / pi. */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_H
#define VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum {
    ENVIRONMENT_WIDTH_MAX = 8192, /* fits an 8k panorama: 700 MB with its tables */
    ENVIRONMENT_HEIGHT_MAX = 4096,
    ENVIRONMENT_LEVELS = 6,        /* of specular reflection: roughness 0, 0.2 ... 1 */
    ENVIRONMENT_LEVEL_WIDTH = 512, /* texels of the level of roughness 0, half as many high; each
                                      further level has half of both */
    ENVIRONMENT_IRRADIANCE_WIDTH = 64, /* texels, half as many high */
};
#define ENVIRONMENT_RADIANCE_MAX 1e10f /* nt; the sun's disc has 1.6e9 */

struct environment;

struct environment_desc {
    const float *pixels; /* required, borrowed during create: RGB, linear Rec.709 [nt], row by row.
                            Below 0 counts as 0: filters of other programs leave such. NaN,
                            infinity and more than ENVIRONMENT_RADIANCE_MAX are refused */
    int width, height;   /* texels; [2, ENVIRONMENT_WIDTH_MAX], [1, ENVIRONMENT_HEIGHT_MAX] */
};

/* NULL with ERROR_INVALID_REQUEST, which names the texel, or ERROR_NO_MEMORY. */
struct environment *environment_create(const struct environment_desc *desc, struct error *err);
void environment_destroy(struct environment *environment); /* accepts NULL */

/* A neutral studio, computed: a grey room with soft boxes above, left, right and behind. White;
 * its mean radiance is 1 nt. */
struct environment *environment_create_studio(struct error *err);

/* How a view has it. A direction of the world is that of the map turned about +Y,
 * counter-clockwise seen from above. */
struct environment_light {
    const struct environment *environment; /* NULL: none */
    double cosine, sine;                   /* of the rotation */
    double intensity;                      /* factor */
    bool is_background;
};
struct environment_light environment_light_make(const struct environment *environment,
                                                double rotation_deg, double intensity);

/* Radiance that arrives from there [nt]: linear between the middles of texels. */
void environment_light_radiance(const struct environment_light *light, const double direction[3],
                                double radiance[3]);

/* Its mean over all directions [nt]. */
void environment_light_mean(const struct environment_light *light, double mean[3]);

/* Draws a direction in proportion to luminance, by two numbers in [0, 1). Returns its density
 * [1/sr]; > 0. */
double environment_light_sample(const struct environment_light *light, const double u[2],
                                double direction[3]);
/* The density with which a direction is drawn [1/sr]; > 0 where the radiance is. */
double environment_light_density(const struct environment_light *light, const double direction[3]);

/* Maps in RGB as a device samples them, row 0 at +Y; before rotation and intensity. */
struct environment_map {
    const float *pixels;
    int width, height;
};
struct environment_map environment_radiance_map(const struct environment *environment);
/* Irradiance over pi: the radiance of a white diffuse surface. */
struct environment_map environment_diffuse_map(const struct environment *environment);
/* Means of the radiance over the GGX lobe of a mirror direction, weighted by n.l, for the roughness
 * level / (ENVIRONMENT_LEVELS - 1), with the viewer along the normal (Karis 2013, "Real Shading in
 * Unreal Engine 4"). Level 0 is the map itself. */
struct environment_map environment_specular_map(const struct environment *environment, int level);

#endif
