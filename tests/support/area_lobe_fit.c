/* SPDX-License-Identifier: MIT */
/* Sums over samples of both lobes, and Nelder and Mead's simplex. */
#include "tests/support/area_lobe_fit.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum {
    FIT_SIDE = 20,   /* squared: samples of each lobe while the shape is sought */
    SUM_SIDE = 256,  /* likewise of integrals */
    PARAMETERS = 4,  /* of a shape */
    STEPS_MAX = 200, /* of the simplex */
};

double area_lobe_roughness(int row)
{
    return AREA_LOBE_LEAST + (1 - AREA_LOBE_LEAST) * row / (AREA_LOBE_SIDE - 1);
}

double area_lobe_view_cosine(int column)
{
    double at = column / (double)(AREA_LOBE_SIDE - 1);
    return fmax(1 - at * at, 1e-4);
}

/* ---- lobes ---- */

static void half_vector(const double v[3], const double l[3], double h[3])
{
    for (int k = 0; k < 3; k++)
        h[k] = v[k] + l[k];
    vec3_normalize(h);
}

static double ggx_d(double alpha, const double h[3])
{
    double a2 = alpha * alpha, f = h[2] * h[2] * a2 + h[0] * h[0] + h[1] * h[1];
    return a2 / (M_PI * f * f);
}

/* sqrt(cos^2 (1 - a2) + a2): of Smith's masking. */
static double masking_root(double alpha, double cosine)
{
    return sqrt(cosine * cosine * (1 - alpha * alpha) + alpha * alpha);
}

double area_lobe_ggx(double alpha, const double v[3], const double l[3], double *weight)
{
    double h[3];
    half_vector(v, l, h);
    *weight = pow(fmax(1 - vec3_dot(v, h), 0), 5);
    if (l[2] <= 0)
        return 0;
    double sum = v[2] * masking_root(alpha, l[2]) + l[2] * masking_root(alpha, v[2]);
    return ggx_d(alpha, h) * 0.5 / sum * l[2];
}

/* Density of the directions that sample_ggx gives. */
static double density_ggx(double alpha, const double v[3], const double l[3])
{
    double h[3];
    half_vector(v, l, h);
    double g1_over_cosine = 2 / (v[2] + masking_root(alpha, v[2]));
    return h[2] > 0 ? g1_over_cosine * ggx_d(alpha, h) / 4 : 0;
}

/* Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps". */
static void sample_ggx(double alpha, const double v[3], double u1, double u2, double l[3])
{
    double w[3] = {alpha * v[0], alpha * v[1], v[2]};
    vec3_normalize(w);
    double z = (1 - u2) * (1 + w[2]) - w[2], sine = sqrt(fmax(1 - z * z, 0));
    double h[3] = {alpha * (sine * cos(2 * M_PI * u1) + w[0]),
                   alpha * (sine * sin(2 * M_PI * u1) + w[1]), fmax(z + w[2], 1e-12)};
    vec3_normalize(h);
    double v_dot_h = vec3_dot(v, h);
    for (int k = 0; k < 3; k++)
        l[k] = 2 * v_dot_h * h[k] - v[k];
}

double area_lobe_sample(double alpha, const double v[3], const double u[2], double l[3],
                        double *weight)
{
    sample_ggx(alpha, v, u[0], u[1], l);
    double f = area_lobe_ggx(alpha, v, l, weight), density = density_ggx(alpha, v, l);
    return density > 0 ? f / density : 0;
}

/* What of the lobe lies above the horizon: a lune between two planes. */
static double share_above(const struct area_lobe_shape *shape)
{
    double x = -sin(shape->turn) * shape->along;
    double z = cos(shape->turn) - sin(shape->turn) * shape->skew;
    return 0.5 * (1 + z / sqrt(x * x + z * z));
}

double area_lobe_density(const struct area_lobe_shape *shape, const double l[3])
{
    double s = sin(shape->turn), c = cos(shape->turn);
    double z = s * l[0] + c * l[2], x = (c * l[0] - s * l[2] - shape->skew * z) / shape->along;
    double y = l[1] / shape->across, r2 = x * x + y * y + z * z;
    if (l[2] <= 0 || z <= 0)
        return 0;
    return z / (M_PI * r2 * r2) / (shape->along * shape->across) / share_above(shape);
}

static void sample_shape(const struct area_lobe_shape *shape, double u1, double u2, double l[3])
{
    double radius = sqrt(u2), z = sqrt(1 - u2), s = sin(shape->turn), c = cos(shape->turn);
    double x = shape->along * radius * cos(2 * M_PI * u1) + shape->skew * z;
    l[0] = c * x + s * z;
    l[1] = shape->across * radius * sin(2 * M_PI * u1);
    l[2] = c * z - s * x;
    vec3_normalize(l);
}

/* ---- integrals ---- */

void area_lobe_integrate(struct area_lobe_fit *fit)
{
    const double share = 1.0 / (SUM_SIDE * SUM_SIDE);
    double energy = 0, reflected = 0, diffused = 0;
    for (int i = 0; i < SUM_SIDE * SUM_SIDE; i++) {
        double u1 = (i % SUM_SIDE + 0.5) / SUM_SIDE, u2 = (i / SUM_SIDE + 0.5) / SUM_SIDE;
        double l[3], weight;
        double sent = area_lobe_sample(fit->alpha, fit->view, (double[]){u1, u2}, l, &weight);
        energy += share * sent;
        reflected += share * weight * sent;
        double of_cosine[3] = {sqrt(u2) * cos(2 * M_PI * u1), sqrt(u2) * sin(2 * M_PI * u1),
                               sqrt(1 - u2)};
        area_lobe_ggx(fit->alpha, fit->view, of_cosine, &weight);
        diffused += share * weight;
    }
    fit->energy = energy;
    fit->fresnel_cosine = 1 - pow(reflected / energy, 0.2);
    fit->diffuse_cosine = 1 - pow(diffused, 0.2);
}

/* The integral of |lobe - shape|^power, with samples of both lobes, each counting by the sum of
 * their densities. */
static double distance(const struct area_lobe_fit *fit, const struct area_lobe_shape *shape,
                       int side, int power)
{
    double sum = 0, above = share_above(shape);
    for (int i = 0; i < 2 * side * side; i++) {
        double u1 = (i % side + 0.5) / side, u2 = (i / side % side + 0.5) / side, l[3], weight;
        if (i < side * side)
            sample_ggx(fit->alpha, fit->view, u1, u2, l);
        else
            sample_shape(shape, u1, u2, l);
        if (l[2] <= 0)
            continue;
        double f = area_lobe_ggx(fit->alpha, fit->view, l, &weight) / fit->energy;
        double p = area_lobe_density(shape, l);
        double off = fabs(f - p), density = density_ggx(fit->alpha, fit->view, l) + p * above;
        sum += (power == 2 ? off * off : off) / density;
    }
    return sum / (side * side);
}

double area_lobe_distance(const struct area_lobe_fit *fit, const struct area_lobe_shape *shape)
{
    return 0.5 * distance(fit, shape, 8 * FIT_SIDE, 1);
}

/* ---- the simplex ---- */

static struct area_lobe_shape shape_of(const double x[PARAMETERS])
{
    return (struct area_lobe_shape){
        .along = exp(x[0]), .across = exp(x[1]), .skew = x[2], .turn = x[3]};
}

static double judge(const struct area_lobe_fit *fit, const double x[PARAMETERS])
{
    const struct area_lobe_shape shape = shape_of(x);
    return distance(fit, &shape, FIT_SIDE, 2);
}

struct simplex {
    double x[PARAMETERS + 1][PARAMETERS], value[PARAMETERS + 1];
    int least, most, next; /* corners: of the least value, the greatest, and the one below */
};

static void rank(struct simplex *simplex)
{
    simplex->least = simplex->most = 0;
    for (int i = 1; i <= PARAMETERS; i++) {
        simplex->least = simplex->value[i] < simplex->value[simplex->least] ? i : simplex->least;
        simplex->most = simplex->value[i] > simplex->value[simplex->most] ? i : simplex->most;
    }
    simplex->next = simplex->least;
    for (int i = 0; i <= PARAMETERS; i++)
        if (i != simplex->most && simplex->value[i] > simplex->value[simplex->next])
            simplex->next = i;
}

/* A point on the line from the worst corner through the middle of the others, or between. */
static double look(const struct area_lobe_fit *fit, const struct simplex *simplex, double way,
                   double x[PARAMETERS])
{
    for (int k = 0; k < PARAMETERS; k++) {
        double middle = 0;
        for (int i = 0; i <= PARAMETERS; i++)
            middle += i == simplex->most ? 0 : simplex->x[i][k] / PARAMETERS;
        x[k] = middle + way * (middle - simplex->x[simplex->most][k]);
    }
    return judge(fit, x);
}

static void put(struct simplex *simplex, const double x[PARAMETERS], double value)
{
    memcpy(simplex->x[simplex->most], x, sizeof simplex->x[0]);
    simplex->value[simplex->most] = value;
}

static void shrink(const struct area_lobe_fit *fit, struct simplex *simplex)
{
    for (int i = 0; i <= PARAMETERS; i++) {
        for (int k = 0; k < PARAMETERS; k++)
            simplex->x[i][k] = 0.5 * (simplex->x[i][k] + simplex->x[simplex->least][k]);
        simplex->value[i] = judge(fit, simplex->x[i]);
    }
}

static void step(const struct area_lobe_fit *fit, struct simplex *simplex)
{
    double reflected[PARAMETERS], other[PARAMETERS];
    double value = look(fit, simplex, 1, reflected), worst = simplex->value[simplex->most];
    if (value < simplex->value[simplex->least]) {
        double further = look(fit, simplex, 2, other);
        put(simplex, further < value ? other : reflected, fmin(further, value));
    } else if (value < simplex->value[simplex->next]) {
        put(simplex, reflected, value);
    } else {
        double nearer = look(fit, simplex, value < worst ? 0.5 : -0.5, other);
        if (nearer < fmin(value, worst))
            put(simplex, other, nearer);
        else
            shrink(fit, simplex);
    }
}

static void descend(const struct area_lobe_fit *fit, double size, struct area_lobe_shape *shape)
{
    struct simplex simplex;
    const double start[PARAMETERS] = {log(shape->along), log(shape->across), shape->skew,
                                      shape->turn};
    for (int i = 0; i <= PARAMETERS; i++) {
        memcpy(simplex.x[i], start, sizeof start);
        if (i > 0) /* directions change within the lobe, however narrow */
            simplex.x[i][i - 1] += i > 2 ? size * fmin(1, 2 * fit->alpha + 0.02) : size;
        simplex.value[i] = judge(fit, simplex.x[i]);
    }
    rank(&simplex);
    for (int i = 0; i < STEPS_MAX; i++) {
        double least = simplex.value[simplex.least];
        if (simplex.value[simplex.most] - least < 1e-7 * least)
            break;
        step(fit, &simplex);
        rank(&simplex);
    }
    *shape = shape_of(simplex.x[simplex.least]);
}

void area_lobe_find(struct area_lobe_fit *fit, const struct area_lobe_shape *start)
{
    fit->shape = *start;
    descend(fit, 0.05, &fit->shape);
    descend(fit, 0.02, &fit->shape);
    if (fit->view[0] < 0.02) { /* along the normal: the same all around */
        fit->shape.along = fit->shape.across = sqrt(fit->shape.along * fit->shape.across);
        fit->shape.skew = fit->shape.turn = 0;
    }
}

void area_lobe_fit_cell(int row, int column, const struct area_lobe_fit *before,
                        struct area_lobe_fit *fit)
{
    double roughness = area_lobe_roughness(row), cosine = area_lobe_view_cosine(column);
    *fit = (struct area_lobe_fit){.alpha = roughness * roughness,
                                  .view = {sqrt(1 - cosine * cosine), 0, cosine}};
    area_lobe_integrate(fit);
    double root = masking_root(fit->alpha, cosine);
    struct area_lobe_shape start = {/* about the mirrored view */
                                    .along = 2 * fit->alpha,
                                    .across = 2 * fit->alpha * root,
                                    .turn = -0.98 * acos(cosine)};
    if (before) {
        start = before->shape;
        start.along *= fit->alpha / before->alpha;
        start.across *= fit->alpha * root / (before->alpha * masking_root(before->alpha, cosine));
    }
    area_lobe_find(fit, &start);
}
