/* SPDX-License-Identifier: MIT */
/* Lobes over a base: what they send of light from everywhere (the furnace), at normal incidence,
 * and the sheen's table against integrals of its lobe. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_film.h"
#include "renderer/raytrace/rt_reflect.h"

static const double pi = 3.14159265358979323846;

static void direction(double cosine, double angle, double out[3])
{
    double sine = sqrt(1 - cosine * cosine);
    out[0] = sine * cos(angle);
    out[1] = sine * sin(angle);
    out[2] = cosine;
}

/* The integral of the sheen's lobe times the cosine over the hemisphere; the square of x makes room
 * for grazing light. */
static double sheen_integral(double n_dot_v, double roughness)
{
    enum { STEPS = 300 };
    double view[3], sum = 0, alpha = roughness * roughness;
    direction(n_dot_v, 0, view);
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < STEPS; j++) {
            double x = (i + 0.5) / STEPS, light[3], n_dot_l = x * x;
            direction(n_dot_l, pi * (j + 0.5) / STEPS, light);
            double h[3] = {light[0] + view[0], light[1] + view[1], light[2] + view[2]};
            double n_dot_h = h[2] / sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
            sum += rt_sheen_lobe(alpha, n_dot_h, n_dot_l, n_dot_v) * n_dot_l * 2 * x;
        }
    return 2 * pi * sum / (STEPS * STEPS);
}

static void the_table_of_sheen_is_the_integral_of_its_lobe(void **state)
{
    (void)state;
    static const double roughnesses[] = {0.1, 0.17, 0.25, 0.33, 0.5, 0.66, 0.8, 1};
    static const double cosines[] = {0.01, 0.05, 0.12, 0.3, 0.45, 0.7, 1};
    double worst = 0;
    for (size_t i = 0; i < sizeof roughnesses / sizeof *roughnesses; i++)
        for (size_t k = 0; k < sizeof cosines / sizeof *cosines; k++) {
            double expected = sheen_integral(cosines[k], roughnesses[i]);
            double off = fabs(rt_sheen_albedo(cosines[k], roughnesses[i]) - expected);
            worst = fmax(worst, off);
            if (off > 0.03)
                fail_msg("roughness %g, cosine %g: off by %g of %g", roughnesses[i], cosines[k],
                         off, expected);
        }
    print_message("largest difference of the table: %.4f\n", worst);
}

static struct rt_surface surface_of(const struct scene_material *material)
{
    return (struct rt_surface){
        .material = material,
        .normal = {0, 0, 1},
        .base = {(double)material->base_color[0], (double)material->base_color[1],
                 (double)material->base_color[2]},
        .alpha = 1,
        .metallic = (double)material->metallic,
        .roughness = (double)material->roughness,
        .occlusion = 1,
        .f0 = 0.04,
        .specular = (double)material->specular,
        .specular_color = {(double)material->specular_color[0], (double)material->specular_color[1],
                           (double)material->specular_color[2]},
        .coat = (double)material->clearcoat,
        .coat_roughness = (double)material->clearcoat_roughness,
        .coat_normal = {0, 0, 1},
        .sheen_color = {(double)material->sheen_color[0], (double)material->sheen_color[1],
                        (double)material->sheen_color[2]},
        .sheen_roughness = (double)material->sheen_roughness,
        .film = (double)material->iridescence,
        .film_nm = (double)material->film_nm[1],
        .translucence = (double)material->diffuse_transmission,
        .translucent = {(double)material->diffuse_transmission_color[0],
                        (double)material->diffuse_transmission_color[1],
                        (double)material->diffuse_transmission_color[2]},
        .grain = (double)material->anisotropy,
        .along = {cos((double)material->anisotropy_rad), sin((double)material->anisotropy_rad),
                  0.3}};
}

/* What a uniform light from everywhere sends to the viewer by way of the surface. */
static void furnace(const struct scene_material *material, double n_dot_v, double out[3])
{
    enum { STEPS = 500 };
    struct rt_surface surface = surface_of(material);
    struct rt_reflector reflector;
    double view[3];
    direction(n_dot_v, 0, view);
    rt_reflector_init(&reflector, &surface, view);
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < STEPS; j++) {
            double light[3], sent[3];
            double x = (i + 0.5) / STEPS; /* x^2 (3 - 2 x): finer at both ends */
            direction(x * x * (3 - 2 * x), pi * (j + 0.5) / STEPS, light);
            if (rt_reflect(&reflector, light, sent))
                for (int k = 0; k < 3; k++)
                    out[k] += sent[k] * 6 * x * (1 - x) * 2 * pi / (STEPS * STEPS);
        }
}

/* A white base under any lobes sends no more than arrives, or than the base alone, which by glTF's
 * mix of diffuse part and lobe is up to a half more at grazing angles. It loses no more than single
 * bounces between microfacets do. */
static void no_lobes_add_light(void **state)
{
    (void)state;
    static const double cosines[] = {0.08, 0.3, 0.6, 1};
    for (int kind = 0; kind < 8; kind++)
        for (int rough = 0; rough < 3; rough++)
            for (size_t c = 0; c < 4; c++) {
                struct scene_material m = {.base_color = {1, 1, 1, 1},
                                           .roughness = 0.3f + 0.3f * (float)rough};
                double out[3], bare[3];
                furnace(&m, cosines[c], bare);
                if (kind & 1) {
                    m.clearcoat = 1;
                    m.clearcoat_roughness = 0.3f;
                }
                if (kind & 2) {
                    m.sheen_color[0] = m.sheen_color[1] = m.sheen_color[2] = 1;
                    m.sheen_roughness = 0.2f + 0.4f * (float)rough;
                }
                if (kind & 4) {
                    m.flags = SCENE_MATERIAL_SPECULAR;
                    m.specular = 1;
                    m.specular_color[0] = 20;
                }
                furnace(&m, cosines[c], out);
                for (int k = 0; k < 3; k++)
                    if (!(out[k] < fmax(1, bare[k]) + 0.02 && out[k] > (kind & 4 ? 0.1 : 0.75)))
                        fail_msg("lobes %d, roughness %g, cosine %g: channel %d sends %g", kind,
                                 (double)m.roughness, cosines[c], k, out[k]);
            }
}

/* Head on, from the viewer's own direction: D = 1 / (pi alpha^2), V = 1 / 4. */
static void lobes_add_up_head_on(void **state)
{
    (void)state;
    struct scene_material m = {.base_color = {0.5f, 0.5f, 0.5f, 1},
                               .roughness = 0.5f,
                               .flags = SCENE_MATERIAL_SPECULAR,
                               .specular = 0.5f,
                               .specular_color = {1, 2, 0},
                               .clearcoat = 0.8f,
                               .clearcoat_roughness = 0.4f};
    struct rt_surface surface = surface_of(&m);
    struct rt_reflector reflector;
    double ahead[3] = {0, 0, 1}, out[3];
    rt_reflector_init(&reflector, &surface, ahead);
    assert_true(rt_reflect(&reflector, ahead, out));
    double base_lobe = 1 / (4 * pi * pow(0.25, 2)), coat_lobe = 1 / (4 * pi * pow(0.16, 2));
    double coat = (double)m.clearcoat * 0.04, largest = 0.5 * 0.08;
    for (int k = 0; k < 3; k++) {
        double fresnel = 0.5 * 0.04 * (double)m.specular_color[k];
        double base = 0.5 / pi * (1 - largest) + fresnel * base_lobe;
        assert_true(fabs(out[k] - (base * (1 - coat) + coat * coat_lobe)) < 1e-7);
    }
    surface.emissive[0] = 10;
    rt_reflector_emission(&reflector, &surface, out);
    assert_true(fabs(out[0] - 10 * (1 - coat)) < 1e-6);
}

/* A base that neither reflects nor sheds light shows its fibres alone. */
static void black_cloth_shows_its_fibres(void **state)
{
    (void)state;
    struct scene_material m = {.base_color = {0, 0, 0, 1},
                               .roughness = 1,
                               .flags = SCENE_MATERIAL_SPECULAR,
                               .sheen_color = {0.25f, 0.5f, 1},
                               .sheen_roughness = 0.5f};
    double out[3];
    furnace(&m, 0.3, out);
    double expected = sheen_integral(0.3, 0.5);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(out[k] - expected * (double)m.sheen_color[k]) < 2e-3);
}

/* Of one wave length, without an eye: the Airy sum over both sides of the film, as amplitudes, each
 * side with the reflectance that our model gives it. */
static double airy(double f0, double ior, double nm, double wave_nm)
{
    double root = sqrt(f0), base = (1 + root) / (1 - root);
    double first = (1 - ior) / (1 + ior), second = (ior - base) / (ior + base);
    double phase = 4 * pi * ior * nm / wave_nm, both = first * second;
    double numerator = first * first + second * second + 2 * both * cos(phase);
    return numerator / (1 + both * both + 2 * both * cos(phase));
}

/* Head on, where the fringe is widest: no film at all, and one of a quarter wave of green. */
static void films_interfere(void **state)
{
    (void)state;
    static const double f0s[] = {0.02, 0.04, 0.2}, iors[] = {1.2, 1.38, 2};
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) {
            double f0[3] = {f0s[i], f0s[i], f0s[i]}, none[3], quarter[3];
            double quarter_nm = 550 / 4.0 / iors[k];
            rt_film_fresnel(f0, iors[k], 0, 1, none);
            rt_film_fresnel(f0, iors[k], quarter_nm, 1, quarter);
            for (int c = 0; c < 3; c++)
                assert_true(fabs(none[c] - f0s[i]) < 0.02 * f0s[i]);
            double expected = airy(f0s[i], iors[k], quarter_nm, 550);
            if (fabs(quarter[1] - expected) > 0.1 * fmax(expected, f0s[i]))
                fail_msg("f0 %g, film of %g: %g instead of %g", f0s[i], iors[k], quarter[1],
                         expected);
        }
}

/* Thick films mix all colours: the incoherent sum of both sides. */
static void thick_films_have_no_colour(void **state)
{
    (void)state;
    double f0[3] = {0.04, 0.2, 0.9}, out[3];
    rt_film_fresnel(f0, 1.6, 1e5, 1, out);
    for (int k = 0; k < 3; k++) {
        double root = sqrt(f0[k]), base = (1 + root) / (1 - root);
        double first = pow(0.6 / 2.6, 2), second = pow((base - 1.6) / (base + 1.6), 2);
        double expected = first + (1 - first) * (1 - first) * second / (1 - first * second);
        assert_true(fabs(out[k] - expected) < 1e-6);
    }
}

static void films_add_no_light(void **state)
{
    (void)state;
    static const double cosines[] = {0.08, 0.3, 0.6, 1};
    static const float thicknesses[] = {0, 150, 300, 450, 900};
    for (int metal = 0; metal < 2; metal++)
        for (size_t t = 0; t < 5; t++)
            for (size_t c = 0; c < 4; c++) {
                struct scene_material m = {
                    .base_color = {1, 1, 1, 1}, .roughness = 0.5f, .metallic = (float)metal};
                double out[3], bare[3], f0[3] = {0.04, 0.5, 1}, film[3];
                furnace(&m, cosines[c], bare);
                m.iridescence = 1;
                m.film_ior = 1.7f;
                m.film_nm[1] = thicknesses[t];
                furnace(&m, cosines[c], out);
                rt_film_fresnel(f0, 1.7, (double)thicknesses[t], cosines[c], film);
                for (int k = 0; k < 3; k++) {
                    assert_true(film[k] >= 0 && film[k] <= 1);
                    if (!(out[k] < fmax(1, bare[k]) + 0.02 && out[k] > (metal ? 0.4 : 0.75)))
                        fail_msg("metal %d, %g nm, cosine %g: channel %d sends %g of %g", metal,
                                 (double)thicknesses[t], cosines[c], k, out[k], bare[k]);
                }
            }
}

/* A white mirror whose lobe has a grain sends no more than arrives, and loses no more than single
 * bounces between microfacets do; turned by half a turn it is the same. */
static void grains_add_no_light(void **state)
{
    (void)state;
    static const double cosines[] = {0.08, 0.3, 0.6, 1};
    static const float turns[] = {0, 0.8f, 1.5707964f};
    for (int strong = 1; strong <= 3; strong++)
        for (size_t t = 0; t < 3; t++)
            for (size_t c = 0; c < 4; c++) {
                struct scene_material m = {.base_color = {1, 1, 1, 1},
                                           .roughness = 0.5f,
                                           .metallic = 1,
                                           .anisotropy = (float)strong / 3,
                                           .anisotropy_rad = turns[t]};
                double out[3], mirrored[3], sent;
                furnace(&m, cosines[c], out); /* by twice one half of the light */
                m.anisotropy_rad = -turns[t];
                furnace(&m, cosines[c], mirrored);
                sent = (out[1] + mirrored[1]) / 2;
                if (!(sent < 1.02 && sent > 0.4))
                    fail_msg("strength %d/3, turn %g, cosine %g: sends %g", strong,
                             (double)turns[t], cosines[c], sent);
            }
}

static void reflect(const struct scene_material *m, const double view[3], const double light[3],
                    double out[3])
{
    struct rt_surface surface = surface_of(m);
    struct rt_reflector reflector;
    rt_reflector_init(&reflector, &surface, view);
    assert_true(rt_reflect(&reflector, light, out));
}

/* D = 1 / (pi a b), V = 1 / 4 head on; light and viewer may change places; and the lobe is wide
 * along its direction, narrow across it. */
static void a_grain_is_wide_along_its_direction(void **state)
{
    (void)state;
    const struct scene_material m = {
        .base_color = {1, 1, 1, 1}, .roughness = 0.4f, .metallic = 1, .anisotropy = 0.7f};
    double ahead[3] = {0, 0, 1}, view[3], light[3], out[3], back[3], across[3];
    double b = 0.16, a = b + (1 - b) * 0.49;
    reflect(&m, ahead, ahead, out);
    assert_true(fabs(out[0] - 1 / (4 * pi * a * b)) < 1e-6);
    direction(0.5, 0.3, view);
    direction(0.8, 2, light);
    reflect(&m, view, light, out);
    reflect(&m, light, view, back);
    assert_true(fabs(out[0] / light[2] - back[0] / view[2]) < 1e-9);
    direction(0.8, 0, light);
    reflect(&m, ahead, light, out);
    direction(0.8, pi / 2, light);
    reflect(&m, ahead, light, across);
    assert_true(out[0] > 2 * across[0]);
}

/* Of roughness 1 both directions are as rough: the round lobe. */
static void without_a_difference_a_grain_is_round(void **state)
{
    (void)state;
    struct scene_material m = {
        .base_color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1, .anisotropy = 1};
    double view[3], light[3], out[3], round[3];
    direction(0.4, 1, view);
    direction(0.7, 3, light);
    reflect(&m, view, light, out);
    m.anisotropy = 0;
    reflect(&m, view, light, round);
    assert_true(fabs(out[0] - round[0]) < 1e-9);
}

/* Straight from behind, Lambert's term less what the interface reflects. */
static void leaves_diffuse_light_from_behind(void **state)
{
    (void)state;
    const struct scene_material m = {.base_color = {1, 1, 1, 1},
                                     .roughness = 0.5f,
                                     .diffuse_transmission = 0.5f,
                                     .diffuse_transmission_color = {1, 0.25f, 0}};
    double ahead[3] = {0, 0, 1}, behind[3] = {0, 0, -1}, out[3], lobe = 1 / (4 * pi * 0.0625);
    reflect(&m, ahead, behind, out);
    for (int k = 0; k < 3; k++) {
        double color = (double)m.diffuse_transmission_color[k];
        assert_true(fabs(out[k] - color * 0.5 * 0.96 / pi) < 1e-9);
    }
    reflect(&m, ahead, ahead, out);
    assert_true(fabs(out[0] - (0.5 * 0.96 / pi + 0.04 * lobe)) < 1e-9);
}

/* Of a uniform light on both sides, a white leaf sends what a white wall sends of one. */
static void leaves_share_the_light_of_both_sides(void **state)
{
    (void)state;
    static const double cosines[] = {0.08, 0.3, 0.6, 1};
    enum { STEPS = 300 };
    for (int share = 1; share <= 3; share++)
        for (size_t c = 0; c < 4; c++) {
            struct scene_material m = {.base_color = {1, 1, 1, 1}, .roughness = 0.5f};
            struct rt_reflector reflector;
            double view[3], bare[3], out[3], behind = 0;
            furnace(&m, cosines[c], bare);
            m.diffuse_transmission = (float)share / 3;
            m.diffuse_transmission_color[0] = 1;
            furnace(&m, cosines[c], out);
            struct rt_surface surface = surface_of(&m);
            direction(cosines[c], 0, view);
            rt_reflector_init(&reflector, &surface, view);
            for (int i = 0; i < STEPS; i++)
                for (int j = 0; j < STEPS; j++) {
                    double light[3], sent[3];
                    direction((i + 0.5) / STEPS, pi * (j + 0.5) / STEPS, light);
                    light[2] = -light[2];
                    if (rt_reflect(&reflector, light, sent))
                        behind += sent[0] * 2 * pi / (STEPS * STEPS);
                }
            if (fabs(out[0] + behind - bare[0]) > 0.003)
                fail_msg("share %d/3, cosine %g: %g and %g from behind, not %g", share, cosines[c],
                         out[0], behind, bare[0]);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_of_sheen_is_the_integral_of_its_lobe),
        cmocka_unit_test(no_lobes_add_light),
        cmocka_unit_test(lobes_add_up_head_on),
        cmocka_unit_test(black_cloth_shows_its_fibres),
        cmocka_unit_test(films_interfere),
        cmocka_unit_test(thick_films_have_no_colour),
        cmocka_unit_test(films_add_no_light),
        cmocka_unit_test(grains_add_no_light),
        cmocka_unit_test(a_grain_is_wide_along_its_direction),
        cmocka_unit_test(without_a_difference_a_grain_is_round),
        cmocka_unit_test(leaves_diffuse_light_from_behind),
        cmocka_unit_test(leaves_share_the_light_of_both_sides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
