/* SPDX-License-Identifier: MIT */
/* Texture lookups of rays: levels, filters and wraps by the numbers of OpenGL's specification, and
 * footprints against rays that are shot beside. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_footprint.h"

/* Numbers of glTF. */
enum {
    NEAREST = 9728,
    LINEAR = 9729,
    NEAREST_MIPMAP_NEAREST = 9984,
    LINEAR_MIPMAP_NEAREST = 9985,
    NEAREST_MIPMAP_LINEAR = 9986,
    LINEAR_MIPMAP_LINEAR = 9987,
    CLAMP = 33071,
    MIRROR = 33648,
    REPEAT = 10497,
    SIDE = 8,
    LEVELS = 4,
};

/* Level k is grey of 10 * (k + 1) steps; texel (x, y) of level 0 has alpha 8 y + x. */
struct picture {
    uint8_t texels[LEVELS][4 * SIDE * SIDE];
    struct rt_image image;
    struct rt_texel_tables tables;
};

static void paint(struct picture *picture)
{
    *picture =
        (struct picture){.image = {.width_px = SIDE, .height_px = SIDE, .level_count = LEVELS}};
    for (int k = 0; k < LEVELS; k++) {
        memset(picture->texels[k], 10 * (k + 1), sizeof picture->texels[k]);
        picture->image.levels[0][k] = picture->image.levels[1][k] = picture->texels[k];
    }
    for (int i = 0; i < SIDE * SIDE; i++)
        picture->texels[0][4 * i + 3] = (uint8_t)i;
    rt_texel_tables_fill(&picture->tables);
}

static void sample(const struct rt_texture_lookup *lookup, const struct picture *picture,
                   double out[4])
{
    struct rt_texel_sum sum;
    rt_texture_find(lookup, &sum);
    rt_texture_add_up(&sum, &picture->tables, out);
}

static double grey_of(const struct picture *picture, uint32_t min, uint32_t mag, double lambda)
{
    const struct scene_texture texture = {
        .min_filter = min, .mag_filter = mag, .wrap_s = REPEAT, .wrap_t = REPEAT};
    struct rt_texture_lookup lookup = {
        .image = &picture->image, .texture = &texture, .at = {0.3, 0.6}};
    double out[4], side = exp2(lambda) / SIDE;
    lookup.per_pixel[0][0] = 0.6 * side; /* across by 3 : 4, the other side is shorter */
    lookup.per_pixel[0][1] = -0.8 * side;
    lookup.per_pixel[1][1] = 0.5 * side;
    sample(&lookup, picture, out);
    return out[0] * 255 / 10 - 1;
}

static void the_longer_side_of_the_footprint_chooses_the_level(void **state)
{
    (void)state;
    struct picture p;
    paint(&p);
    static const double lambdas[] = {-3, -0.1, 0.25, 0.49, 0.51, 1, 1.49, 1.6, 2.25, 2.9, 3, 9};
    static const double nearest[] = {0, 0, 0, 0, 1, 1, 1, 2, 2, 3, 3, 3};
    for (size_t i = 0; i < sizeof lambdas / sizeof *lambdas; i++) {
        double l = lambdas[i], blended = fmin(fmax(l, 0), LEVELS - 1);
        assert_float_equal(grey_of(&p, LINEAR_MIPMAP_LINEAR, LINEAR, l), blended, 1e-6);
        assert_float_equal(grey_of(&p, NEAREST_MIPMAP_LINEAR, NEAREST, l), blended, 1e-6);
        /* begins half a level later: 8.15 */
        assert_float_equal(grey_of(&p, NEAREST_MIPMAP_LINEAR, LINEAR, l), l <= 0.5 ? 0 : blended,
                           1e-6);
        assert_float_equal(grey_of(&p, LINEAR_MIPMAP_NEAREST, LINEAR, l), nearest[i], 1e-6);
        assert_float_equal(grey_of(&p, NEAREST_MIPMAP_NEAREST, NEAREST, l), nearest[i], 1e-6);
        assert_float_equal(grey_of(&p, LINEAR, LINEAR, l), 0, 1e-6);
        assert_float_equal(grey_of(&p, NEAREST, LINEAR, l), 0, 1e-6);
    }
}

static double alpha_at(const struct picture *picture, uint32_t filter, uint32_t wrap, double x,
                       double y)
{
    const struct scene_texture texture = {
        .min_filter = filter, .mag_filter = filter, .wrap_s = wrap, .wrap_t = wrap};
    const struct rt_texture_lookup lookup = {.image = &picture->image,
                                             .texture = &texture,
                                             .is_finest = true,
                                             .at = {x / SIDE, y / SIDE}};
    double out[4];
    sample(&lookup, picture, out);
    return out[3] * 255;
}

static void texels_are_weighted_and_wrapped(void **state)
{
    (void)state;
    struct picture p;
    paint(&p);
    assert_float_equal(alpha_at(&p, NEAREST, REPEAT, 2.9, 1.2), 10, 1e-9);
    assert_float_equal(alpha_at(&p, LINEAR, REPEAT, 2.75, 1.5), 8 + 2.25, 1e-9);
    assert_float_equal(alpha_at(&p, LINEAR, REPEAT, 3.5, 2.25), 8 * 1.75 + 3, 1e-9);
    assert_float_equal(alpha_at(&p, NEAREST, REPEAT, -0.5, 8.5), 7, 1e-9);
    assert_float_equal(alpha_at(&p, NEAREST, CLAMP, -3, 20), 56, 1e-9);
    assert_float_equal(alpha_at(&p, NEAREST, MIRROR, -1.5, 9.5), 8 * 6 + 1, 1e-9);
    assert_float_equal(alpha_at(&p, LINEAR, REPEAT, 8, 0.5), 3.5, 1e-9);
    assert_float_equal(alpha_at(&p, LINEAR, REPEAT, -1e9 - 5, 0.5), 2.5, 1e-6);
    p.image.width_px = 5; /* no power of two */
    assert_float_equal(alpha_at(&p, NEAREST, REPEAT, 8.0 / 5 * -1.5, 0.5), 3, 1e-9);
}

/* u and v where a ray meets the triangle. */
static void meet(const double corners[3][3], const double origin[3], const double direction[3],
                 double uv[2])
{
    double e1[3], e2[3], from[3], across[3], q[3];
    vec3_sub(corners[1], corners[0], e1);
    vec3_sub(corners[2], corners[0], e2);
    vec3_sub(origin, corners[0], from);
    vec3_cross(direction, e2, across);
    vec3_cross(from, e1, q);
    double determinant = vec3_dot(e1, across);
    uv[0] = vec3_dot(from, across) / determinant;
    uv[1] = vec3_dot(direction, q) / determinant;
}

/* Rays of neighbouring pixels differ by `step`, in direction through a pinhole, else in origin. */
static void check_footprint(bool is_pinhole)
{
    static double corners[3][3] = {{-3, -1, -4}, {5, -1.5, -9}, {-1, 0.5, -7}};
    static const uint32_t triangle[3] = {0, 1, 2};
    static const double direction[3] = {0.1, -0.06, -1},
                        steps[2][3] = {{1e-6, 2e-7, 0}, {-2e-7, 1e-6, 3e-7}};
    struct rt_mesh mesh = {.positions = corners, .triangles = triangle};
    const struct rt_scene scene = {.meshes = &mesh, .mesh_count = 1};
    const struct rt_hit hit = {0};
    double here[2], e1[3], e2[3], way[2][3], origin[3] = {0};
    struct rt_footprint footprint;
    meet(corners, origin, direction, here);
    vec3_sub(corners[1], corners[0], e1);
    vec3_sub(corners[2], corners[0], e2);
    double t = -(corners[0][2] + here[0] * e1[2] + here[1] * e2[2]); /* direction[2] is -1 */
    for (int i = 0; i < 6; i++)
        way[i / 3][i % 3] = steps[i / 3][i % 3] * (is_pinhole ? t : 1);
    rt_footprint_find(&scene, &hit, (const double(*)[3])way, direction, &footprint);
    for (int step = 0; step < 2; step++) {
        const double *found = step ? footprint.down : footprint.right;
        double beside[3], there[2];
        for (int k = 0; k < 3; k++)
            beside[k] = (is_pinhole ? direction[k] : origin[k]) + steps[step][k];
        meet(corners, is_pinhole ? origin : beside, is_pinhole ? beside : direction, there);
        for (int k = 0; k < 2; k++)
            assert_true(fabs(found[k] - (there[k] - here[k])) < 1e-5 * fabs(found[k]));
    }
}

static void footprints_are_where_the_next_rays_go(void **state)
{
    (void)state;
    check_footprint(true);
    check_footprint(false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_longer_side_of_the_footprint_chooses_the_level),
        cmocka_unit_test(texels_are_weighted_and_wrapped),
        cmocka_unit_test(footprints_are_where_the_next_rays_go),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
