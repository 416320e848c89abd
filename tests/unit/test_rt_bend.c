/* SPDX-License-Identifier: MIT */
/* Single rays at surfaces that bend them: Snell's law, the critical angle, dispersion, slabs, and
 * the spread of rough ones against the integral of their lobe. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_bend.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_reflect.h"

static const double pi = 3.14159265358979323846;

/* Met under an angle; its normal is +Z. */
static struct rt_bend bend_of(enum state_bend kind, bool enters, double angle, double ior)
{
    return (struct rt_bend){.kind = kind,
                            .enters = enters,
                            .way = {sin(angle), 0, -cos(angle)},
                            .normal = {0, 0, 1},
                            .facet = {0, 0, 1},
                            .ior = {ior, ior, ior}};
}

static void rays_follow_snell_and_are_reversible(void **state)
{
    (void)state;
    const double u[2] = {0.5, 0.5};
    for (int i = 0; i < 90; i++)
        for (int n = 0; n < 4; n++) {
            const double angle = i * pi / 180, ior = 1 + 0.4 * n;
            double in[3], out[3], shift[3];
            struct rt_bend bend = bend_of(STATE_BEND_SOLID, true, angle, ior);
            assert_true(rt_bend_ray(&bend, 1, u, in, shift));
            assert_true(fabs(in[0] * ior - sin(angle)) < 1e-12 && in[2] < 0);
            assert_true(fabs(vec3_length(in) - 1) < 1e-12);
            bend.enters = false;
            memcpy(bend.way, in, sizeof in);
            assert_true(rt_bend_ray(&bend, 1, u, out, shift));
            assert_true(fabs(out[0] - sin(angle)) < 1e-9);
        }
}

static void total_reflection_begins_at_the_critical_angle(void **state)
{
    (void)state;
    const double u[2] = {0.5, 0.5};
    for (int n = 1; n <= 10; n++) {
        const double ior = 1 + 0.1 * n, critical = asin(1 / ior);
        double out[3], shift[3];
        struct rt_bend below = bend_of(STATE_BEND_SOLID, false, critical - 1e-6, ior);
        struct rt_bend above = bend_of(STATE_BEND_SOLID, false, critical + 1e-6, ior);
        assert_true(rt_bend_ray(&below, 1, u, out, shift));
        assert_true(out[0] > 0.99 && out[2] < 0);
        assert_false(rt_bend_ray(&above, 1, u, out, shift));
        assert_true(fabs(out[0] - above.way[0]) < 1e-12);
        assert_true(fabs(out[2] + above.way[2]) < 1e-12);
    }
}

static void a_slab_shifts_by_less_than_its_thickness(void **state)
{
    (void)state;
    const double u[2] = {0.5, 0.5};
    for (int i = 0; i <= 89; i++) {
        const double angle = i * pi / 180, ior = 1.5, inside = asin(sin(angle) / ior);
        struct rt_bend bend = bend_of(STATE_BEND_SLAB, true, angle, ior);
        double out[3], shift[3];
        bend.thickness_m = 0.3;
        assert_true(rt_bend_ray(&bend, 1, u, out, shift));
        assert_memory_equal(out, bend.way, sizeof out);
        assert_true(fabs(vec3_dot(shift, bend.way)) < 1e-12);
        double expected = 0.3 * sin(angle - inside) / cos(inside);
        assert_true(fabs(vec3_length(shift) - expected) < 1e-9 && expected <= 0.3);
    }
}

/* A triangle that a bent normal would have the ray miss is crossed all the same. */
static void bent_normals_do_not_turn_rays_back(void **state)
{
    (void)state;
    for (int i = 0; i < 2000; i++) {
        double u[2], n[2], out[3], shift[3];
        rt_sequence_point((uint32_t)i, 3, u);
        rt_sequence_point((uint32_t)i, 4, n);
        struct rt_bend bend = bend_of(STATE_BEND_SOLID, i % 2, 1.5 * u[0], 1.5);
        bend.normal[0] = 1.8 * n[0] - 0.9, bend.normal[1] = 0.3 * n[1], bend.normal[2] = 0.3;
        vec3_normalize(bend.normal);
        if (vec3_dot(bend.normal, bend.way) >= 0)
            continue;
        bend.alpha = i % 3 ? u[1] : 0;
        bool passes = rt_bend_ray(&bend, 1, u, out, shift);
        assert_true(passes ? out[2] < 1e-12 : out[2] > -1e-12);
        assert_true(fabs(vec3_length(out) - 1) < 1e-9);
    }
}

/* Between parallel faces with bent normals, as at the rim of a vase. */
static void bent_normals_do_not_keep_rays_in_thin_walls(void **state)
{
    (void)state;
    const double u[2] = {0.5, 0.5}, critical = asin(1 / 1.5);
    for (int i = 0; i < 60; i++)
        for (int k = -3; k <= 3; k++) {
            const double angle = i * pi / 180, bent = 0.2 * k;
            struct rt_bend bend = bend_of(STATE_BEND_SOLID, false, angle, 1.5);
            double out[3], shift[3];
            bend.normal[0] = sin(bent), bend.normal[2] = cos(bent);
            if (vec3_dot(bend.normal, bend.way) >= 0)
                continue;
            bool passes = rt_bend_ray(&bend, 1, u, out, shift);
            double met = acos(fmin(1, -vec3_dot(bend.normal, bend.way)));
            assert_true(passes ? angle < critical || met < critical : angle > critical);
        }
}

/* Of the mirrored lobe, as lamps see it (rt_reflect.h), the share on one side of the plane x = 0:
 * what drawn directions have of it. G1 alone is taken from the draws (Heitz 2018, eq. 17), so that
 * they lose no light where the lobe does. */
static void thin_walls_spread_as_their_lobe(void **state)
{
    (void)state;
    enum { DRAWS = 1 << 14, STEPS = 400 };
    static const struct scene_material material = {.transmission = 1, .ior = 1.5f};
    for (int i = 1; i <= 4; i++)
        for (int a = 0; a < 3; a++) {
            const double roughness = 0.15 * i, angle = 0.3 * a, alpha = roughness * roughness;
            struct rt_bend bend = bend_of(STATE_BEND_THIN, true, angle, 1.5);
            struct rt_surface surface = {.material = &material,
                                         .normal = {0, 0, 1},
                                         .base = {1, 1, 1},
                                         .alpha = 1,
                                         .roughness = roughness,
                                         .transmission = 1};
            const double view[3] = {-bend.way[0], 0, -bend.way[2]}, line = sin(angle) + 0.5 * alpha;
            struct rt_reflector reflector;
            double drawn = 0, beyond = 0, all = 0, ones = 0;
            bend.alpha = alpha;
            for (uint32_t k = 0; k < DRAWS; k++) {
                double u[2], out[3], shift[3];
                rt_sequence_point(k, 5, u);
                assert_true(rt_bend_ray(&bend, 1, u, out, shift));
                double z = -out[2], c = rt_max(z, 1e-6), a2 = alpha * alpha;
                double g1 = 2 * c / (c + sqrt(a2 + (1 - a2) * c * c));
                drawn += out[0] > line ? g1 : 0;
                ones += g1;
            }
            rt_reflector_init(&reflector, &surface, view);
            for (int y = 0; y < STEPS; y++)
                for (int x = 0; x < STEPS; x++) {
                    double cosine = (y + 0.5) / STEPS, phi = 2 * pi * (x + 0.5) / STEPS, f[3];
                    cosine = 1 - (1 - cosine) * (1 - cosine); /* finer near the normal */
                    double width = 2 * (1 - (y + 0.5) / STEPS), sine = sqrt(1 - cosine * cosine);
                    const double l[3] = {sine * cos(phi), sine * sin(phi), -cosine};
                    if (!rt_reflect(&reflector, l, f))
                        continue;
                    all += f[0] * width;
                    beyond += l[0] > line ? f[0] * width : 0;
                }
            print_message("roughness %.2f, angle %.1f: %.4f, expected %.4f\n", roughness, angle,
                          drawn / ones, beyond / all);
            assert_true(fabs(drawn / ones - beyond / all) < 0.02);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_follow_snell_and_are_reversible),
        cmocka_unit_test(total_reflection_begins_at_the_critical_angle),
        cmocka_unit_test(a_slab_shifts_by_less_than_its_thickness),
        cmocka_unit_test(bent_normals_do_not_turn_rays_back),
        cmocka_unit_test(bent_normals_do_not_keep_rays_in_thin_walls),
        cmocka_unit_test(thin_walls_spread_as_their_lobe),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
