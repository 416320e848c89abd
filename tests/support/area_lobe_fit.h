/* SPDX-License-Identifier: MIT */
/* Finds the linear transforms of the cosine lobe that are nearest to the project's GGX lobes
 * (Heitz, Dupuy, Hill, Neubelt 2016, "Real-Time Polygonal-Light Shading with Linearly Transformed
 * Cosines", section 4). They make renderer/shading/area_lobes.c. Deterministic. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_AREA_LOBE_FIT_H
#define VITRAIL_TESTS_SUPPORT_AREA_LOBE_FIT_H

/* The cosine lobe o goes to turn_y(turn) * (along * o.x + skew * o.z, across * o.y, o.z), of which
 * only what lies above the horizon counts. */
struct area_lobe_shape {
    double along, across, skew, turn;
};

struct area_lobe_fit {
    double alpha, view[3]; /* unit, in the plane of x and z, above z = 0 */
    double energy;         /* integral of D V cos over all directions of light */
    double fresnel_cosine; /* at which Schlick's weight is its mean over them */
    double diffuse_cosine; /* likewise over the cosine lobe */
    struct area_lobe_shape shape;
};

double area_lobe_roughness(int row);
double area_lobe_view_cosine(int column);

/* D V cos of shaders/material/brdf.glsl; *weight: Schlick's. */
double area_lobe_ggx(double alpha, const double v[3], const double l[3], double *weight);
/* A direction of light from two places in [0, 1), denser where the lobe is stronger; D V cos over
 * its density is 0 below the horizon. */
double area_lobe_sample(double alpha, const double v[3], const double u[2], double l[3],
                        double *weight);
/* The density that the shape stands for; integrates to 1 over the directions above the horizon. */
double area_lobe_density(const struct area_lobe_shape *shape, const double l[3]);

/* All but the shape, from alpha and view. */
void area_lobe_integrate(struct area_lobe_fit *fit);
/* Half the integral of what a shape is off by, over the lobe's: [0, 1]. */
double area_lobe_distance(const struct area_lobe_fit *fit, const struct area_lobe_shape *shape);
/* The shape, by the least squares of what it is off by, near a start. */
void area_lobe_find(struct area_lobe_fit *fit, const struct area_lobe_shape *start);
/* A row's cell: starts from the cell of the row before, which is less rough, or NULL. */
void area_lobe_fit_cell(int row, int column, const struct area_lobe_fit *before,
                        struct area_lobe_fit *fit);

#endif
