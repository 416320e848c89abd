/* SPDX-License-Identifier: MIT */
/* Draws towards an environment: their sums are the integrals of every lobe's light, nothing is
 * gained in a furnace, and more of them err less. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_environment.h"

static const double pi = 3.14159265358979323846;

enum { WIDTH = 64, HEIGHT = 32, DRAWS = 1 << 16, MATERIALS = 8 };

static const struct scene_material materials[MATERIALS] = {
    {.base_color = {0.8f, 0.5f, 0.2f, 1}, .roughness = 1},
    {.base_color = {0.9f, 0.6f, 0.3f, 1}, .metallic = 1, .roughness = 0.5f},
    {.base_color = {1, 1, 1, 1}, .metallic = 1, .roughness = 1},
    {.base_color = {0.9f, 0.5f, 0.7f, 1}, .roughness = 0.6f, .transmission = 0.7f},
    {.base_color = {0.2f, 0.2f, 0.6f, 1},
     .roughness = 0.8f,
     .clearcoat = 1,
     .clearcoat_roughness = 0.4f},
    {.base_color = {0.1f, 0.1f, 0.1f, 1},
     .roughness = 0.9f,
     .sheen_color = {0.9f, 0.6f, 0.3f},
     .sheen_roughness = 0.5f},
    {.base_color = {0.6f, 0.4f, 0.8f, 1},
     .metallic = 0.5f,
     .roughness = 0.4f,
     .transmission = 0.5f,
     .clearcoat = 0.5f,
     .clearcoat_roughness = 0.6f,
     .sheen_color = {0.3f, 0.3f, 0.3f},
     .sheen_roughness = 0.7f},
    {.base_color = {0.2f, 0.6f, 0.1f, 1},
     .roughness = 0.7f,
     .transmission = 0.3f,
     .diffuse_transmission = 0.6f,
     .diffuse_transmission_color = {0.5f, 0.9f, 0.1f}},
};

/* is_sunny: a bright texel in a sky that is brighter on one side. */
static struct environment *make_map(bool is_sunny)
{
    float pixels[3 * WIDTH * HEIGHT];
    struct error err = {0};
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double u = (i % WIDTH + 0.5) / WIDTH;
        for (int k = 0; k < 3; k++)
            pixels[3 * i + k] = is_sunny ? (float)(0.5 + 0.1 * k + 0.4 * cos(2 * pi * u)) : 1;
    }
    for (int k = 0; is_sunny && k < 3; k++)
        pixels[3 * (9 * WIDTH + 37) + k] = 400;
    struct environment *map =
        environment_create(&(struct environment_desc){pixels, WIDTH, HEIGHT}, &err);
    assert_non_null(map);
    return map;
}

static void make_reflector(const struct scene_material *m, double cosine,
                           struct rt_reflector *reflector)
{
    struct rt_surface surface = {.material = m,
                                 .normal = {0.6, 0.64, 0.48},
                                 .alpha = 1,
                                 .metallic = (double)m->metallic,
                                 .roughness = (double)m->roughness,
                                 .occlusion = 1,
                                 .f0 = 0.04,
                                 .transmission = (double)m->transmission,
                                 .translucence = (double)m->diffuse_transmission,
                                 .specular = 1,
                                 .specular_color = {1, 1, 1},
                                 .coat = (double)m->clearcoat,
                                 .coat_roughness = (double)m->clearcoat_roughness,
                                 .coat_normal = {0.64, 0.6, 0.48},
                                 .sheen_roughness = (double)m->sheen_roughness};
    const double across[3] = {0.8, -0.48, -0.36}; /* of the normal */
    double sine = sqrt(1 - cosine * cosine), view[3];
    for (int k = 0; k < 3; k++) {
        surface.base[k] = (double)m->base_color[k];
        surface.translucent[k] = (double)m->diffuse_transmission_color[k];
        surface.sheen_color[k] = (double)m->sheen_color[k];
        view[k] = cosine * surface.normal[k] + sine * across[k];
    }
    rt_reflector_init(reflector, &surface, view);
}

static void draw_all(const struct environment_light *light, const struct rt_reflector *reflector,
                     uint32_t count, uint32_t seed, double sum[3])
{
    struct rt_environment_sampler sampler;
    rt_environment_begin(&sampler, light, reflector, count, seed);
    sum[0] = sum[1] = sum[2] = 0;
    for (uint32_t i = 0; i < count; i++) {
        double l[3], arriving[3], reflected[3];
        if (!rt_environment_draw(&sampler, i, l, arriving) ||
            !rt_reflect(sampler.reflector, l, reflected))
            continue;
        for (int k = 0; k < 3; k++)
            sum[k] += reflected[k] * arriving[k];
    }
}

/* Over a grid of the map's texels, on the side of the viewer, and of what diffuses light from
 * behind on both. */
static void integrate(const struct environment_light *light, const struct rt_reflector *reflector,
                      double sum[3])
{
    enum { FINE = 8 };
    struct rt_environment_sampler sampler;
    rt_environment_begin(&sampler, light, reflector, 1, 0);
    sum[0] = sum[1] = sum[2] = 0;
    for (int y = 0; y < HEIGHT * FINE; y++) {
        double theta = pi * (y + 0.5) / (HEIGHT * FINE);
        double area = sin(theta) * 2 * pi / (WIDTH * FINE) * pi / (HEIGHT * FINE);
        for (int x = 0; x < WIDTH * FINE; x++) {
            double phi = 2 * pi * (x + 0.5) / (WIDTH * FINE), radiance[3], reflected[3];
            const double l[3] = {sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)};
            double cosine = 0;
            for (int k = 0; k < 3; k++)
                cosine += l[k] * reflector->normal[k];
            if ((cosine <= 0 && !sampler.has_behind) ||
                !rt_reflect(sampler.reflector, l, reflected))
                continue;
            environment_light_radiance(light, l, radiance);
            for (int k = 0; k < 3; k++)
                sum[k] += reflected[k] * radiance[k] * area;
        }
    }
}

static void sums_of_draws_are_the_integrals(void **state)
{
    (void)state;
    double worst = 0;
    for (int is_sunny = 0; is_sunny < 2; is_sunny++) {
        struct environment *map = make_map(is_sunny);
        const struct environment_light light = environment_light_make(map, 70, 2);
        for (int i = 0; i < MATERIALS; i++)
            for (int step = 0; step < 3; step++) {
                const double cosine = 0.2 + 0.35 * step;
                struct rt_reflector reflector;
                double expected[3], sum[3];
                make_reflector(&materials[i], cosine, &reflector);
                integrate(&light, &reflector, expected);
                draw_all(&light, &reflector, DRAWS, 5, sum);
                for (int k = 0; k < 3; k++) {
                    double off = fabs(sum[k] / expected[k] - 1);
                    worst = fmax(worst, off);
                    if (!(off <= 0.001))
                        fail_msg("material %d, cosine %g, channel %d: %g, expected %g", i, cosine,
                                 k, sum[k], expected[k]);
                }
            }
        environment_destroy(map);
    }
    print_message("largest relative difference: %.5f\n", worst);
}

/* A white metal sends all light on where it is smooth, and never more; a white diffuse surface
 * without reflection sends all. */
static void a_furnace_gains_nothing(void **state)
{
    (void)state;
    struct environment *map = make_map(false);
    const struct environment_light light = environment_light_make(map, 0, 1);
    for (int step = 0; step <= 10; step++)
        for (int angle = 0; angle < 4; angle++) {
            const double cosine = 0.1 + 0.3 * angle;
            struct scene_material metal = {
                .base_color = {1, 1, 1, 1}, .metallic = 1, .roughness = (float)(step / 10.0)};
            struct rt_reflector reflector;
            double sum[3];
            make_reflector(&metal, cosine, &reflector);
            draw_all(&light, &reflector, 1 << 14, 9, sum);
            assert_true(sum[0] <= 1.001);
            assert_true(step > 0 || sum[0] >= 0.999);
        }
    environment_destroy(map);
}

/* The root mean square error over seeds falls at least as the inverse root of their number. */
static void more_draws_err_less(void **state)
{
    (void)state;
    enum { SEEDS = 64, FIRST = 4, LAST = 10 };
    struct environment *map = make_map(true);
    const struct environment_light light = environment_light_make(map, 70, 1);
    for (int i = 0; i < MATERIALS; i++) {
        struct rt_reflector reflector;
        double exact[3], sum[3], sx = 0, sy = 0, sxx = 0, sxy = 0;
        make_reflector(&materials[i], 0.7, &reflector);
        draw_all(&light, &reflector, 1 << 18, 1, exact);
        for (int power = FIRST; power <= LAST; power++) {
            double square = 0;
            for (uint32_t seed = 0; seed < SEEDS; seed++) {
                draw_all(&light, &reflector, 1u << power, 1000 * seed + 7, sum);
                square += (sum[1] / exact[1] - 1) * (sum[1] / exact[1] - 1) / SEEDS;
            }
            double y = 0.5 * log2(square);
            sx += power, sy += y, sxx += power * power, sxy += power * y;
            if (power == FIRST)
                print_message("material %d: error %.4f of %d draws, ", i, sqrt(square), 1 << power);
        }
        const int count = LAST - FIRST + 1;
        double slope = (count * sxy - sx * sy) / (count * sxx - sx * sx);
        print_message("slope %.2f\n", slope);
        assert_true(slope <= -0.45);
    }
    environment_destroy(map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_of_draws_are_the_integrals),
        cmocka_unit_test(a_furnace_gains_nothing),
        cmocka_unit_test(more_draws_err_less),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
