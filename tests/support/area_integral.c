/* SPDX-License-Identifier: MIT */
/* Adaptive integration of transmittance over an area light. */
#include "tests/support/area_integral.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_math.h"

enum { LEVELS_MAX = 16, BISECTIONS = 16 };

static const double same = 1e-9; /* transmittances on one side of an edge */

struct area {
    struct rt_lighting *lighting;
    const struct state_light *light;
    const double *point;
    int levels_least;  /* halvings of every cell */
    double negligible; /* change of T in a cell times its area */
};

struct place { /* on the light's unit square */
    double xy[2];
    double t[3];
};

static void look(const struct area *area, struct place *place)
{
    struct rt_arrival arrival;
    double at[3];
    rt_light_place(area->light, place->xy, at);
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = at[k] - area->lighting->scene->origin[k] - area->point[k];
    arrival.distance_m = vec3_length(arrival.direction);
    vec3_normalize(arrival.direction);
    rt_transmittance(area->lighting, &arrival, area->point, NULL, place->t);
}

static struct place look_between(const struct area *area, const struct place *a,
                                 const struct place *b)
{
    struct place middle = {.xy = {0.5 * (a->xy[0] + b->xy[0]), 0.5 * (a->xy[1] + b->xy[1])}};
    look(area, &middle);
    return middle;
}

static double difference(const struct place *a, const struct place *b)
{
    double most = 0;
    for (int k = 0; k < 3; k++)
        most = rt_max(fabs(a->t[k] - b->t[k]), most);
    return most;
}

/* Where between two places, as a share of the way from `a`, the value stops being a's. */
static double find_edge(const struct area *area, const struct place *a, const struct place *b)
{
    struct place low = *a, high = *b;
    double from = 0, to = 1;
    for (int i = 0; i < BISECTIONS; i++) {
        struct place middle = look_between(area, &low, &high);
        if (difference(&middle, a) <= same) {
            low = middle;
            from = 0.5 * (from + to);
        } else {
            high = middle;
            to = 0.5 * (from + to);
        }
    }
    return 0.5 * (from + to);
}

/* Share of a cell that has the first corner's value, where the corners, in the order around it,
 * have two values and those of one lie together; negative where they do not. */
static double first_share(const struct area *area, const struct place *const corners[4])
{
    bool is_first[4];
    int count = 0, start = 0;
    const struct place *other = NULL;
    for (int i = 0; i < 4; i++) {
        is_first[i] = difference(corners[i], corners[0]) <= same;
        count += is_first[i];
        if (!is_first[i] && other && difference(corners[i], other) > same)
            return -1;
        if (!is_first[i])
            other = corners[i];
    }
    for (int i = 0; i < 4; i++)
        if (is_first[i] && !is_first[(i + 3) % 4])
            start = i; /* its run goes on from here */
    for (int i = 0; i < count; i++)
        if (!is_first[(start + i) % 4])
            return -1;
    int last = (start + count - 1) % 4;
    const struct place *before = corners[(start + 3) % 4], *after = corners[(last + 1) % 4];
    if (count == 3) /* the other corner's triangle is missing */
        return 1 - 0.5 * (1 - find_edge(area, corners[start], before)) *
                       (1 - find_edge(area, corners[last], after));
    double a = find_edge(area, corners[start], before);
    double b = find_edge(area, corners[last], after);
    return count == 1 ? 0.5 * a * b : 0.5 * (a + b);
}

static void add_cell(const struct area *area, const struct place *const corners[4],
                     const struct place *middle, double size, double spread, double sum[3])
{
    double share = spread > same ? first_share(area, corners) : 1;
    const struct place *other = corners[0];
    for (int i = 1; i < 4; i++)
        if (difference(corners[i], corners[0]) > same)
            other = corners[i];
    if (share > 0 && difference(middle, corners[0]) > same && difference(middle, other) > same)
        share = -1; /* a third value inside */
    for (int k = 0; k < 3; k++) {
        double mean = 0;
        for (int i = 0; i < 4; i++)
            mean += corners[i]->t[k] / 8;
        mean += middle->t[k] / 2;
        sum[k] +=
            size * size * (share < 0 ? mean : share * corners[0]->t[k] + (1 - share) * other->t[k]);
    }
}

static void add_square(const struct area *area, const struct place *const corners[4], double size,
                       int level, double sum[3])
{
    struct place middle = look_between(area, corners[0], corners[2]);
    double spread = 0;
    for (int i = 0; i < 4; i++) {
        spread = rt_max(difference(corners[i], &middle), spread);
        spread = rt_max(difference(corners[i], corners[(i + 1) % 4]), spread);
    }
    bool is_done = level >= area->levels_least && spread * size * size <= area->negligible;
    if (is_done || level == LEVELS_MAX) {
        add_cell(area, corners, &middle, size, spread, sum);
        return;
    }
    struct place sides[4]; /* the i-th between corners i and i + 1 */
    for (int i = 0; i < 4; i++)
        sides[i] = look_between(area, corners[i], corners[(i + 1) % 4]);
    for (int i = 0; i < 4; i++) {
        const struct place *const quarter[4] = {corners[i], &sides[i], &middle,
                                                &sides[(i + 3) % 4]};
        add_square(area, quarter, size / 2, level + 1, sum);
    }
}

void area_integral_transmittance(struct rt_lighting *lighting, const struct state_light *light,
                                 const double point[3], uint32_t samples, double out[3])
{
    struct area area = {.lighting = lighting, .light = light, .point = point, .negligible = 1};
    struct place places[4] = {{.xy = {0, 0}}, {.xy = {1, 0}}, {.xy = {1, 1}}, {.xy = {0, 1}}};
    const struct place *const corners[4] = {&places[0], &places[1], &places[2], &places[3]};
    for (uint32_t n = samples / 16; n >= 4; n /= 4)
        area.levels_least++; /* a quarter of the rays */
    for (uint32_t n = samples / 128; n >= 2; n /= 2)
        area.negligible /= 4; /* an edge crosses 2^levels cells, and costs about 50 rays in each */
    for (int i = 0; i < 4; i++)
        look(&area, &places[i]);
    out[0] = out[1] = out[2] = 0;
    add_square(&area, corners, 1, 0, out);
}
