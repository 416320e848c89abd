/* SPDX-License-Identifier: MIT */
/* Environment maps: what they refuse, how they are sampled, and their irradiance in closed form. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/environment/environment.h"

static const double pi = 3.14159265358979323846;

enum { WIDTH = 32, HEIGHT = 16, DRAWS = 1 << 16 };

static struct environment *make(float (*radiance)(int x, int y))
{
    float pixels[3 * WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        for (int k = 0; k < 3; k++)
            pixels[3 * i + k] = radiance(i % WIDTH, i / WIDTH);
    struct error err = {0};
    struct environment *map =
        environment_create(&(struct environment_desc){pixels, WIDTH, HEIGHT}, &err);
    assert_non_null(map);
    return map;
}

static float constant(int x, int y)
{
    (void)x, (void)y;
    return 2;
}

static float upper_half(int x, int y)
{
    (void)x;
    return y < HEIGHT / 2;
}

static float sun(int x, int y)
{
    return x == 20 && y == 3 ? 1e6f : (float)(1 + (x + 2 * y) % 5);
}

static float black(int x, int y)
{
    (void)x, (void)y;
    return 0;
}

static void refuses_what_is_no_radiance(void **state)
{
    (void)state;
    const float bad[] = {NAN, INFINITY, -INFINITY, 2e10f};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        float pixels[3 * 4 * 2] = {0};
        pixels[3 * 5 + 2] = bad[i];
        struct error err = {0};
        assert_null(environment_create(&(struct environment_desc){pixels, 4, 2}, &err));
        assert_int_equal(ERROR_INVALID_REQUEST, err.code);
        assert_non_null(strstr(err.message, "channel 2 of the texel in column 1 of row 1"));
    }
    const int sizes[][2] = {{1, 1}, {2, 0}, {8193, 1}, {2, 4097}, {-2, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct error err = {0};
        const float pixel[3] = {0};
        assert_null(
            environment_create(&(struct environment_desc){pixel, sizes[i][0], sizes[i][1]}, &err));
        assert_int_equal(ERROR_INVALID_REQUEST, err.code);
    }
}

static void negative_values_count_as_zero(void **state)
{
    (void)state;
    const float pixels[3 * 2] = {-1, -2, -3, -4, -5, -6};
    struct environment *map = environment_create(&(struct environment_desc){pixels, 2, 1}, NULL);
    struct environment_light light = environment_light_make(map, 0, 1);
    double radiance[3];
    environment_light_radiance(&light, (const double[3]){1, 0, 0}, radiance);
    assert_true(radiance[0] == 0 && radiance[1] == 0 && radiance[2] == 0);
    environment_destroy(map);
}

/* The density over the whole sphere, at the middles of parts of texels, which it is constant in. */
static void expect_density_of_one(struct environment *map)
{
    struct environment_light light = environment_light_make(map, 30, 1);
    double sum = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double v = (i / WIDTH + 0.5) / HEIGHT, phi = 2 * pi * ((i % WIDTH + 0.5) / WIDTH) - pi;
        double turned = phi - pi / 6; /* counter-clockwise seen from above is left */
        const double d[3] = {sin(pi * v) * sin(turned), cos(pi * v), -sin(pi * v) * cos(turned)};
        double area =
            2 * pi / WIDTH * (cos(pi * (i / WIDTH) / HEIGHT) - cos(pi * (i / WIDTH + 1) / HEIGHT));
        sum += area * environment_light_density(&light, d);
    }
    assert_true(fabs(sum - 1) < 1e-9);
    environment_destroy(map);
}

static void density_integrates_to_one(void **state)
{
    (void)state;
    expect_density_of_one(make(constant));
    expect_density_of_one(make(upper_half));
    expect_density_of_one(make(sun));
    expect_density_of_one(make(black));
}

/* Draws fall into each octant as often as the density says, and come with that density. */
static void draws_follow_the_density(void **state)
{
    (void)state;
    struct environment *map = make(upper_half);
    struct environment_light light = environment_light_make(map, 70, 1);
    double below = 0, sum[3] = {0}, power = 0;
    for (int i = 0; i < DRAWS; i++) {
        const double u[2] = {(i % 256 + 0.5) / 256, (i / 256 + 0.5) / 256};
        double d[3], radiance[3], density = environment_light_sample(&light, u, d);
        assert_true(density > 0);
        assert_true(fabs(density / environment_light_density(&light, d) - 1) < 1e-6);
        environment_light_radiance(&light, d, radiance);
        power += radiance[1] / density / DRAWS;
        below += d[1] < 0;
        for (int k = 0; k < 3; k++)
            sum[k] += d[k] / DRAWS;
    }
    assert_true(fabs(power - 2 * pi) < 0.02);
    assert_true(below / DRAWS < 0.03); /* of the row at the horizon, whose light is blurred */
    assert_true(fabs(sum[0]) < 1e-3 && fabs(sum[2]) < 1e-3 && fabs(sum[1] - 0.5) < 0.03);
    environment_destroy(map);
}

/* The share of all draws that come before a direction: above its place, and in its row to the left
 * of it. By densities alone. */
static void find_shares(const struct environment_light *light, const int size[2],
                        const double direction[3], double shares[2])
{
    const double v = acos(direction[1]) / pi;
    const double u = atan2(direction[0], -direction[2]) / (2 * pi) + 0.5;
    const int row = (int)(v * size[1]), column = (int)(u * size[0]);
    double whole_row = 0;
    shares[0] = shares[1] = 0;
    for (int y = 0; y <= row; y++) {
        const double top = cos(pi * y / size[1]), bottom = cos(pi * (y + 1) / size[1]);
        const double down = y < row ? 1 : (top - direction[1]) / (top - bottom);
        for (int x = 0; x < size[0]; x++) {
            const double theta = pi * (y + 0.5) / size[1];
            const double phi = 2 * pi * ((x + 0.5) / size[0] - 0.5);
            const double d[3] = {sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
            const double chance =
                environment_light_density(light, d) * 2 * pi / size[0] * (top - bottom);
            shares[1] += down * chance;
            whole_row += y == row ? chance : 0;
            if (y == row && x <= column)
                shares[0] += chance * (x < column ? 1 : u * size[0] - column);
        }
    }
    shares[0] /= whole_row;
}

static float one_of_many(int x, int y)
{
    return x * 7919 % 101 == 3 ? 1e4f : y % 5 == 2 ? 0 : (float)(x % 3);
}

/* Each number finds its step among steps of very different chances, as many as are no power of two,
 * some of them none; 0 and what rounds to 1 lie in the first and in the last. */
static void draws_are_found_by_their_numbers(void **state)
{
    (void)state;
    const int sizes[][2] = {{100, 37}, {2, 1}, {67, 5}, {8, 64}};
    for (int s = 0; s < 4; s++) {
        const int *size = sizes[s];
        float pixels[3 * 100 * 64];
        for (int i = 0; i < size[0] * size[1]; i++)
            for (int k = 0; k < 3; k++)
                pixels[3 * i + k] = one_of_many(i % size[0], i / size[0]);
        struct environment *map =
            environment_create(&(struct environment_desc){pixels, size[0], size[1]}, NULL);
        const struct environment_light light = environment_light_make(map, 0, 1);
        for (int i = 1; i < 2000; i++) { /* at the pole all columns are one */
            const double u[2] = {fmod(0.31830988618 * i, 1), fmod(0.0072973525 * i, 1)};
            double d[3], shares[2];
            assert_true(environment_light_sample(&light, u, d) > 0);
            find_shares(&light, size, d, shares);
            assert_true(fabs(shares[0] - u[0]) < 1e-6 && fabs(shares[1] - u[1]) < 1e-6);
        }
        double d[3];
        assert_true(environment_light_sample(&light, (const double[2]){1, 1}, d) > 0);
        assert_true(fabs(d[1] + 1) < 1e-12);
        environment_destroy(map);
    }
}

/* By a fine grid, to compare with. */
static double power_of(const struct environment_light *light)
{
    const int side = 1024;
    double sum = 0;
    for (int i = 0; i < side * side / 2; i++) {
        double theta = pi * (i / side + 0.5) / (side / 2), phi = 2 * pi * (i % side + 0.5) / side;
        const double d[3] = {sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi)};
        double radiance[3];
        environment_light_radiance(light, d, radiance);
        sum += radiance[0] * sin(theta) * (pi / (side / 2)) * (2 * pi / side);
    }
    return sum;
}

/* A texel's light reaches into the near halves of its neighbours, which have an eighth of the
 * chances each way: (3/4 + 1/8)^2 of the draws see it. */
static void a_sun_is_drawn_by_its_light(void **state)
{
    (void)state;
    struct environment *map = make(sun);
    struct environment_light light = environment_light_make(map, 0, 1);
    double power = 0, hits = 0;
    for (int i = 0; i < DRAWS; i++) {
        const double u[2] = {(i % 256 + 0.5) / 256, (i / 256 + 0.5) / 256};
        double d[3], radiance[3], density = environment_light_sample(&light, u, d);
        environment_light_radiance(&light, d, radiance);
        power += radiance[0] / density / DRAWS;
        hits += (radiance[0] > 100) / (double)DRAWS;
    }
    assert_true(fabs(hits - 0.875 * 0.875) < 0.02);
    assert_true(fabs(power / power_of(&light) - 1) < 0.01);
    environment_destroy(map);
}

/* Irradiance over pi. Constant: L. White above: (1 + n.y) / 2. */
static void irradiance_is_that_of_closed_forms(void **state)
{
    (void)state;
    struct environment *maps[2] = {make(constant), make(upper_half)};
    struct environment_map even = environment_diffuse_map(maps[0]);
    struct environment_map half = environment_diffuse_map(maps[1]);
    assert_int_equal(even.height, half.height);
    for (int y = 0; y < even.height; y++)
        for (int x = 0; x < even.width; x++) {
            size_t at = 3 * ((size_t)y * (size_t)even.width + (size_t)x);
            double up = cos(pi * (y + 0.5) / even.height);
            assert_true(fabs((double)even.pixels[at] / 2 - 1) < 1e-5);
            assert_true(fabs((double)half.pixels[at] - (1 + up) / 2) < 0.02 / pi);
        }
    environment_destroy(maps[0]);
    environment_destroy(maps[1]);
}

static void specular_levels_keep_a_constant_map(void **state)
{
    (void)state;
    struct environment *map = make(constant);
    for (int level = 0; level < ENVIRONMENT_LEVELS; level++) {
        struct environment_map texels = environment_specular_map(map, level);
        assert_int_equal(ENVIRONMENT_LEVEL_WIDTH >> level, texels.width);
        for (int i = 0; i < 3 * texels.width * texels.height; i++)
            assert_true(fabsf(texels.pixels[i] - 2) < 1e-4f);
    }
    environment_destroy(map);
}

/* Seen from above, a quarter turn counter-clockwise brings what was at -Z to -X. */
static void rotation_turns_the_map_counter_clockwise(void **state)
{
    (void)state;
    float pixels[3 * 4] = {0};
    pixels[3 * 2] = 1; /* columns are at +Z ... -Z; the third begins at -Z */
    struct environment *map = environment_create(&(struct environment_desc){pixels, 4, 1}, NULL);
    struct environment_light light = environment_light_make(map, 0, 1);
    const double at = sqrt(0.5);
    double radiance[3];
    environment_light_radiance(&light, (const double[3]){at, 0, -at}, radiance);
    assert_true(fabs(radiance[0] - 1) < 1e-6);
    light = environment_light_make(map, 90, 1);
    environment_light_radiance(&light, (const double[3]){-at, 0, -at}, radiance);
    assert_true(fabs(radiance[0] - 1) < 1e-6);
    environment_destroy(map);
}

static void the_studio_is_neutral_and_of_mean_radiance_1(void **state)
{
    (void)state;
    struct environment *studio = environment_create_studio(NULL);
    struct environment_map map = environment_radiance_map(studio);
    double sum = 0, weights = 0;
    for (int i = 0; i < map.width * map.height; i++) {
        const float *texel = map.pixels + 3 * (size_t)i;
        double weight = sin(pi * (i / map.width + 0.5) / map.height);
        assert_true(texel[0] > 0 && texel[0] == texel[1] && texel[1] == texel[2]);
        sum += weight * (double)texel[0];
        weights += weight;
    }
    assert_true(fabs(sum / weights - 1) < 1e-4);
    environment_destroy(studio);
}

/* The sum over a map of its radiance by n.l and the density of l where n.h is drawn by D n.h, with
 * the viewer along the normal; over the same sum without the radiance. */
static double mean_over_lobe(const struct environment_map *map, double roughness, const double n[3])
{
    double sum = 0, weights = 0, a2 = pow(roughness, 4);
    for (int y = 0; y < map->height; y++) {
        double theta = pi * (y + 0.5) / map->height;
        for (int x = 0; x < map->width; x++) {
            double phi = 2 * pi * ((x + 0.5) / map->width - 0.5);
            double cosine = sin(theta) * (n[0] * sin(phi) - n[2] * cos(phi)) + n[1] * cos(theta);
            if (cosine <= 0)
                continue;
            double square = 0.5 * (1 + cosine), f = square * (a2 - 1) + 1; /* of n.h */
            double weight = cosine * sin(theta) / (f * f);
            size_t texel = 3 * ((size_t)y * (size_t)map->width + (size_t)x);
            sum += weight * (double)map->pixels[texel];
            weights += weight;
        }
    }
    return sum / weights;
}

/* Between the middles of four texels of a level, where devices look as well. */
static double level_at(const struct environment_map *level, int x, int y)
{
    return (double)level->pixels[3 * ((size_t)y * (size_t)level->width + (size_t)x)];
}

static void specular_levels_are_means_over_lobes(void **state)
{
    (void)state;
    struct environment *studio = environment_create_studio(NULL);
    struct environment_map map = environment_radiance_map(studio);
    for (int i = 1; i < ENVIRONMENT_LEVELS; i++) {
        struct environment_map level = environment_specular_map(studio, i);
        double square = 0, worst = 0, mean = 0;
        int step = level.width / 8, count = 0;
        for (int y = step / 2; y < level.height; y += step)
            for (int x = step / 2; x < level.width; x += step) {
                double phi = 2 * pi * ((x + 0.5) / level.width - 0.5);
                double theta = pi * (y + 0.5) / level.height;
                const double n[3] = {sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)};
                double expected = mean_over_lobe(&map, i / (ENVIRONMENT_LEVELS - 1.0), n);
                double off = level_at(&level, x, y) - expected;
                square += off * off;
                worst = fmax(worst, fabs(off));
                mean += expected;
                count++;
            }
        print_message("level %d: off by %.3f of the mean, at most %.3f\n", i,
                      sqrt(square / count) / (mean / count), worst / (mean / count));
        assert_true(sqrt(square / count) <= 0.03 * mean / count);
    }
    environment_destroy(studio);
}

static void check_equal(const struct environment_map *a, const struct environment_map *b)
{
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    for (int i = 0; i < 3 * a->width * a->height; i++)
        assert_true(fabsf(a->pixels[i] - b->pixels[i]) <= 1e-5f * b->pixels[i]);
}

/* The levels that are built in are those that its radiance has where they are summed up anew. */
static void the_built_in_levels_are_those_of_the_studio(void **state)
{
    (void)state;
    struct environment *studio = environment_create_studio(NULL);
    struct environment_map map = environment_radiance_map(studio);
    struct environment *anew =
        environment_create(&(struct environment_desc){map.pixels, map.width, map.height}, NULL);
    struct environment_map built = environment_diffuse_map(studio);
    struct environment_map summed = environment_diffuse_map(anew);
    check_equal(&built, &summed);
    for (int i = 0; i < ENVIRONMENT_LEVELS; i++) {
        built = environment_specular_map(studio, i);
        summed = environment_specular_map(anew, i);
        check_equal(&built, &summed);
    }
    environment_destroy(studio);
    environment_destroy(anew);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(refuses_what_is_no_radiance),
        cmocka_unit_test(negative_values_count_as_zero),
        cmocka_unit_test(density_integrates_to_one),
        cmocka_unit_test(draws_follow_the_density),
        cmocka_unit_test(draws_are_found_by_their_numbers),
        cmocka_unit_test(a_sun_is_drawn_by_its_light),
        cmocka_unit_test(irradiance_is_that_of_closed_forms),
        cmocka_unit_test(specular_levels_keep_a_constant_map),
        cmocka_unit_test(specular_levels_are_means_over_lobes),
        cmocka_unit_test(rotation_turns_the_map_counter_clockwise),
        cmocka_unit_test(the_studio_is_neutral_and_of_mean_radiance_1),
        cmocka_unit_test(the_built_in_levels_are_those_of_the_studio),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
