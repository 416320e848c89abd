/* SPDX-License-Identifier: MIT */
/* Claims about the CPU light clusters: they never miss a light, and every build gives the same
 * bits. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/lights/clusters.h"
#include "tests/support/light_scene.h"

enum { SEEDS = 200, LIGHTS = LIGHT_SCENE_LIGHTS, POINTS = 400 };

static struct light_scene scene;

static bool holds(const struct clusters *clusters, size_t cluster, uint32_t light)
{
    for (size_t i = 0; i < clusters->prefix_count; i++)
        if (clusters->items[i] == light)
            return true;
    const uint32_t *head = &clusters->heads[2 * cluster];
    for (uint32_t i = 0; i < head[1]; i++)
        if (clusters->items[head[0] + i] == light)
            return true;
    return false;
}

static int count_misses(const struct clusters *clusters, uint64_t seed, int *reached)
{
    uint64_t state = 0xd1342543de82ef95u * (seed + 7);
    int misses = 0;
    for (int i = 0; i < POINTS; i++) {
        double x = random_uniform(&state, 0, scene.window.width),
               y = random_uniform(&state, 0, scene.window.height);
        double z = light_scene_depth(&scene, &state), world[3];
        double reach = scene.window.reach_px;
        light_scene_point(&scene, x + (reach > 0 ? random_uniform(&state, -reach, reach) : 0),
                          y + (reach > 0 ? random_uniform(&state, -reach, reach) : 0), z, world);
        size_t cluster = clusters_find(clusters, (int)x, (int)y, (float)z);
        for (uint32_t light = 0; light < LIGHTS; light++) {
            if (!light_reaches(&scene.lights[light], world))
                continue;
            ++*reached;
            misses += !holds(clusters, cluster, light);
        }
    }
    return misses;
}

static void build(struct clusters *clusters)
{
    struct error err = {0};
    bool ok = clusters_build(clusters,
                             &(struct clusters_desc){.lights = scene.lights,
                                                     .light_count = LIGHTS,
                                                     .camera = &scene.camera,
                                                     .window = &scene.window},
                             &err);
    assert_string_equal(err.message, "");
    assert_true(ok);
}

static void clusters_never_miss_a_light(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    int reached = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        light_scene_make(&scene, seed, seed % 2, 1);
        build(&clusters);
        assert_int_equal(count_misses(&clusters, seed, &reached), 0);
    }
    assert_true(reached > SEEDS * POINTS); /* the comparison saw light */
    clusters_finish(&clusters);
}

/* Pictures that are shifted by parts of a pixel, or by many pixels, share the lists of one. */
static void clusters_never_miss_a_light_of_a_shifted_picture(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    int reached = 0, missed_without = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        light_scene_make(&scene, seed, seed % 2, 1);
        double reach = seed % 3 ? 0.2 : 40;
        build(&clusters); /* with no reach some would be missed */
        scene.window.reach_px = reach;
        missed_without += count_misses(&clusters, seed, &reached);
        build(&clusters);
        assert_int_equal(count_misses(&clusters, seed, &reached), 0);
    }
    assert_true(reached > SEEDS * POINTS && missed_without > 0);
    clusters_finish(&clusters);
}

static void clusters_never_miss_a_light_at_extreme_scales(void **unused)
{
    (void)unused;
    static const double scales[] = {1e-3, 1e-2, 1e3, 1e6};
    struct clusters clusters = {0};
    int reached = 0;
    for (uint64_t seed = 0; seed < 80; seed++) {
        double scale = scales[seed % 4];
        light_scene_make(&scene, seed, seed / 4 % 2, scale);
        build(&clusters);
        assert_true(isfinite(clusters.slice_scale) && isfinite(clusters.slice_offset));
        assert_int_equal(count_misses(&clusters, seed, &reached), 0);
    }
    assert_true(reached > 80 * POINTS);
    clusters_finish(&clusters);
}

static void check_order(const struct clusters *clusters)
{
    size_t count = (size_t)clusters->columns * (size_t)clusters->rows * (size_t)clusters->slices;
    size_t expected_offset = clusters->prefix_count;
    for (size_t i = 1; i < clusters->prefix_count; i++)
        assert_true(clusters->items[i - 1] < clusters->items[i]);
    for (size_t c = 0; c < count; c++) {
        const uint32_t *head = &clusters->heads[2 * c];
        assert_int_equal(head[0], expected_offset);
        for (uint32_t i = 1; i < head[1]; i++)
            assert_true(clusters->items[head[0] + i - 1] < clusters->items[head[0] + i]);
        expected_offset += head[1];
        assert_true(head[1] + clusters->prefix_count <= clusters->longest);
    }
    assert_int_equal(expected_offset, clusters->item_count);
}

static void lists_are_contiguous_and_ascending_and_repeat_bit_for_bit(void **unused)
{
    (void)unused;
    struct clusters kept = {0};
    for (uint64_t seed = 0; seed < 20; seed++) {
        light_scene_make(&scene, seed, seed % 2, 1);
        struct clusters fresh = {0};
        build(&kept); /* with the arrays of the last seed */
        build(&fresh);
        check_order(&kept);
        size_t count = (size_t)kept.columns * (size_t)kept.rows * (size_t)kept.slices;
        assert_int_equal(kept.item_count, fresh.item_count);
        assert_memory_equal(kept.heads, fresh.heads, count * 2 * sizeof *kept.heads);
        if (kept.item_count)
            assert_memory_equal(kept.items, fresh.items, kept.item_count * sizeof *kept.items);
        clusters_finish(&fresh);
    }
    clusters_finish(&kept);
}

static void make_plain_scene(int width, int height)
{
    scene.camera = (struct camera){.right = {1, 0, 0},
                                   .up = {0, 1, 0},
                                   .back = {0, 0, 1},
                                   .half_width = 0.8,
                                   .half_height = 0.6,
                                   .z_near = 0.01};
    scene.window = camera_window_whole(width, height);
    for (int i = 0; i < LIGHTS; i++)
        scene.lights[i] = (struct state_light){.type = SCENE_LIGHT_DIRECTIONAL};
}

static bool is_listed_anywhere(const struct clusters *clusters, uint32_t light)
{
    for (size_t i = 0; i < clusters->item_count; i++)
        if (clusters->items[i] == light)
            return true;
    return false;
}

static struct state_light point_light(double x, double y, double z, double range)
{
    return (struct state_light){
        .type = SCENE_LIGHT_POINT, .position = {x, y, z}, .range = (float)range};
}

static void lights_at_the_eye_around_it_behind_and_on_the_near_plane_are_placed(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    make_plain_scene(640, 480);
    scene.lights[0] = point_light(0, 0, 0, 0.5);       /* at the eye */
    scene.lights[1] = point_light(0, 0, 3, 4);         /* behind, but reaches past the eye */
    scene.lights[2] = point_light(0, 0, 3, 2);         /* behind: lights nothing in view */
    scene.lights[3] = point_light(0, 0, -0.01, 0.005); /* on the near plane */
    scene.lights[4] = point_light(0, 0, -5, 100);      /* encloses eye and view */
    scene.lights[5] = point_light(50, 0, -5, 1);       /* beside the view */
    build(&clusters);
    size_t at_near = clusters_find(&clusters, 320, 240, 0.011f);
    assert_true(holds(&clusters, at_near, 0));
    assert_true(holds(&clusters, at_near, 1));
    assert_true(holds(&clusters, at_near, 3));
    assert_true(holds(&clusters, at_near, 4));
    assert_false(is_listed_anywhere(&clusters, 2));
    assert_false(is_listed_anywhere(&clusters, 5));
    assert_false(holds(&clusters, clusters_find(&clusters, 320, 240, 90), 0));
    clusters_finish(&clusters);
}

static void lights_that_fill_the_view_are_stored_once(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    make_plain_scene(1280, 720);
    scene.lights[0] = point_light(0, 0, -5, 1000);
    scene.lights[1] = point_light(0, 0, -5, 1);
    build(&clusters);
    assert_int_equal(clusters.prefix_count, LIGHTS - 1); /* all but light 1 */
    assert_true(clusters.item_count > clusters.prefix_count);
    clusters_finish(&clusters);
}

static void a_cone_is_listed_in_fewer_clusters_than_its_sphere(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    make_plain_scene(1280, 720);
    scene.lights[0] = point_light(0, 2, -8, 4);
    build(&clusters);
    size_t of_sphere = clusters.item_count;
    scene.lights[0].type = SCENE_LIGHT_SPOT;
    scene.lights[0].direction[1] = -1;
    scene.lights[0].outer_cone_rad = 0.35f;
    build(&clusters);
    /* volume of a 20 degree sector over its sphere: 3 %; tiles and slices blur that */
    assert_true(clusters.item_count - clusters.prefix_count <
                (of_sphere - clusters.prefix_count) / 4);
    clusters_finish(&clusters);
}

static void no_lights_give_one_empty_cluster_per_tile(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    struct error err = {0};
    make_plain_scene(33, 31);
    assert_true(clusters_build(
        &clusters, &(struct clusters_desc){.camera = &scene.camera, .window = &scene.window},
        &err));
    assert_int_equal(clusters.columns, 2);
    assert_int_equal(clusters.rows, 1);
    assert_int_equal(clusters.slices, 1);
    assert_int_equal(clusters.item_count, 0);
    assert_int_equal(clusters.longest, 0);
    assert_int_equal(clusters.heads[2 * clusters_find(&clusters, 32, 30, 1e30f) + 1], 0);
    clusters_finish(&clusters);
}

static struct state_light *many_lights(size_t count, double range)
{
    struct state_light *lights = calloc(count, sizeof *lights);
    assert_non_null(lights);
    uint64_t state = 42;
    for (size_t i = 0; i < count; i++)
        lights[i] = point_light(random_uniform(&state, -40, 40), random_uniform(&state, -30, 30),
                                random_uniform(&state, -60, -1), range);
    return lights;
}

static void sixty_five_thousand_lights_fit(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    struct error err = {0};
    make_plain_scene(1280, 720);
    struct state_light *lights = many_lights(65536, 0.7);
    assert_true(clusters_build(&clusters,
                               &(struct clusters_desc){.lights = lights,
                                                       .light_count = 65536,
                                                       .camera = &scene.camera,
                                                       .window = &scene.window},
                               &err));
    assert_true(clusters.item_count > 65536);
    check_order(&clusters);
    clusters_finish(&clusters);
    free(lights);
}

static void more_entries_than_allowed_are_refused_by_number(void **unused)
{
    (void)unused;
    struct clusters clusters = {0};
    struct error err = {0};
    make_plain_scene(1280, 720);
    struct state_light *lights = many_lights(4096, 10);
    assert_false(clusters_build(&clusters,
                                &(struct clusters_desc){.lights = lights,
                                                        .light_count = 4096,
                                                        .camera = &scene.camera,
                                                        .window = &scene.window,
                                                        .entries_max = 100000},
                                &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "4096 lights"));
    assert_non_null(strstr(err.message, "100000 entries"));
    clusters_finish(&clusters);
    free(lights);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clusters_never_miss_a_light),
        cmocka_unit_test(clusters_never_miss_a_light_of_a_shifted_picture),
        cmocka_unit_test(clusters_never_miss_a_light_at_extreme_scales),
        cmocka_unit_test(lists_are_contiguous_and_ascending_and_repeat_bit_for_bit),
        cmocka_unit_test(lights_at_the_eye_around_it_behind_and_on_the_near_plane_are_placed),
        cmocka_unit_test(lights_that_fill_the_view_are_stored_once),
        cmocka_unit_test(a_cone_is_listed_in_fewer_clusters_than_its_sphere),
        cmocka_unit_test(no_lights_give_one_empty_cluster_per_tile),
        cmocka_unit_test(sixty_five_thousand_lights_fit),
        cmocka_unit_test(more_entries_than_allowed_are_refused_by_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
