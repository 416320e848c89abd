/* SPDX-License-Identifier: MIT */
/* Claims about light lists as a shader reads them: against brute force, between runs, and against
 * each other. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "renderer/lights/light_lists.h"
#include "renderer/lights/linked_lists.h"
#include "shaders/shared/bindings.h"
#include "tests/support/light_scene.h"

enum { SEEDS = 60, POINTS = 256, STRIDE = 300, SKIPPED = 77 };

static struct rig {
    struct gl_context *context;
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct light_lists *lists;
} rig;

static struct light_scene scene;

struct point { /* as light_list_probe.comp.glsl reads it */
    uint32_t x, y;
    float z;
    uint32_t corner; /* where in the pixel: 0..15, for brute force; the shader ignores it */
};

static int finish_rig(void **unused)
{
    (void)unused;
    light_lists_destroy(rig.lists);
    gpu_timeline_destroy(rig.timeline);
    program_cache_destroy(rig.programs);
    gl_context_destroy(rig.context);
    return 0;
}

static bool init_rig(void)
{
    struct error err = {0};
    rig.context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!rig.context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return false;
    }
    rig.programs = program_cache_create(NULL, &err);
    rig.timeline = gpu_timeline_create(rig.context, &err);
    rig.lists = light_lists_create(rig.programs, rig.timeline, &err);
    return rig.programs && rig.timeline && rig.lists;
}

static bool is_global(uint32_t light)
{
    return scene.lights[light].type == SCENE_LIGHT_DIRECTIONAL || scene.lights[light].range == 0;
}

static void in_window(const struct point *point, double *x, double *y)
{
    *x = point->x + (point->corner % 4) / 3.0;
    *y = point->y + (point->corner / 4) / 3.0;
}

static struct point random_point(uint64_t *state)
{
    return (struct point){
        .x = (uint32_t)random_uniform(state, 0, scene.window.width),
        .y = (uint32_t)random_uniform(state, 0, scene.window.height),
        .z = (float)light_scene_depth(&scene, state),
        .corner = (uint32_t)random_next(state) % 16,
    };
}

static bool is_lit(const struct point *point, uint32_t light, double z)
{
    double x, y, world[3];
    in_window(point, &x, &y);
    light_scene_point(&scene, x, y, z, world);
    return light_reaches(&scene.lights[light], world);
}

/* Moves the point along its line of sight to the very border of some light's reach, from inside. */
static void move_to_border(struct point *point, uint64_t *state)
{
    double dark = light_scene_depth(&scene, state);
    for (uint32_t light = 0; light < LIGHT_SCENE_LIGHTS; light++) {
        double lit = point->z;
        if (is_global(light) || !is_lit(point, light, lit) || is_lit(point, light, dark))
            continue;
        for (int i = 0; i < 40; i++)
            *(is_lit(point, light, (lit + dark) / 2) ? &lit : &dark) = (lit + dark) / 2;
        point->z = (float)lit;
        return;
    }
}

static void make_points(uint64_t seed, struct point points[POINTS])
{
    uint64_t state = 0xd1342543de82ef95u * (seed + 7);
    for (int i = 0; i < POINTS; i++) {
        points[i] = random_point(&state);
        if (i % 4 == 1) { /* the corner of a 4x4 tile: the farthest that its beam must reach */
            points[i].x &= ~3u;
            points[i].y &= ~3u;
            points[i].corner = 0;
        }
        if (i % 2)
            move_to_border(&points[i], &state);
    }
}

static struct light_lists_desc describe(enum view_light_lists technique, bool faithful,
                                        size_t light_count)
{
    return (struct light_lists_desc){.technique = technique,
                                     .faithful = faithful,
                                     .lights = scene.lights,
                                     .light_count = light_count,
                                     .camera = &scene.camera,
                                     .window = &scene.window};
}

static void assert_ok(bool ok, const struct error *err)
{
    assert_string_equal(err->message, "");
    assert_true(ok);
}

/* Runs the shader's cursor at every point. lists: STRIDE words per point, count first. */
static void probe(const struct point points[POINTS], uint32_t *lists)
{
    struct error err = {0};
    struct gl_buffer in = {0}, out = {0};
    const struct gl_program *program =
        program_cache_get(rig.programs,
                          &(struct program_desc){.label = "light_list_probe",
                                                 .compute = "light_list_probe.comp.glsl",
                                                 .defines = light_lists_defines(rig.lists)},
                          &err);
    assert_ok(program != NULL, &err);
    assert_true(gl_buffer_init(&in,
                               &(struct gl_buffer_desc){.label = "probe.points",
                                                        .size_bytes = POINTS * 16,
                                                        .data = points},
                               &err));
    assert_true(gl_buffer_init(&out,
                               &(struct gl_buffer_desc){.label = "probe.lists",
                                                        .size_bytes = POINTS * STRIDE * 4,
                                                        .is_dynamic = true},
                               &err));
    gl_buffer_clear_u32(&out, 0, POINTS * STRIDE * 4, 0);
    gl_program_use(program);
    gl_program_set_u(program, "u_point_count", POINTS);
    gl_program_set_u(program, "u_stride", STRIDE);
    light_lists_bind(rig.lists, program);
    gl_buffer_bind_storage(&in, BIND_STATISTICS);
    gl_buffer_bind_storage(&out, BIND_LIST_NODES);
    glDispatchCompute((POINTS + 63) / 64, 1, 1);
    gl_buffer_read(&out, 0, POINTS * STRIDE * 4, lists);
    gl_buffer_finish(&in);
    gl_buffer_finish(&out);
    assert_ok(gl_context_check(rig.context, "probing light lists", &err), &err);
}

static void prepare(const struct light_lists_desc *desc, struct frame_report *report)
{
    struct error err = {0};
    assert_ok(light_lists_prepare(rig.lists, desc, report, &err), &err);
    gpu_timeline_collect(rig.timeline, report);
    assert_ok(gl_context_check(rig.context, "building light lists", &err), &err);
}

static void list_lights(const struct light_lists_desc *desc, const struct point points[POINTS],
                        uint32_t *lists)
{
    struct frame_report report = {0};
    prepare(desc, &report);
    probe(points, lists);
}

static bool holds(const uint32_t *list, uint32_t light)
{
    for (uint32_t i = 1; i <= list[0]; i++)
        if (list[i] == light)
            return true;
    return false;
}

struct tally {
    int reached, missed, listed;
};

/* Compares with brute force anywhere in the pixels. */
static void tally_points(const struct point points[POINTS], const uint32_t *lists,
                         struct tally *tally)
{
    for (int i = 0; i < POINTS; i++) {
        tally->listed += (int)lists[i * STRIDE];
        for (uint32_t light = 0; light < LIGHT_SCENE_LIGHTS; light++) {
            if (!is_lit(&points[i], light, (double)points[i].z))
                continue;
            tally->reached++;
            tally->missed += !holds(lists + i * STRIDE, light);
        }
    }
}

static struct tally tally_scenes(enum view_light_lists technique, bool faithful, double scale)
{
    static struct point points[POINTS];
    static uint32_t lists[POINTS * STRIDE];
    struct tally tally = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        light_scene_make(&scene, seed, seed % 2, scale);
        make_points(seed, points);
        const struct light_lists_desc desc = describe(technique, faithful, LIGHT_SCENE_LIGHTS);
        list_lights(&desc, points, lists);
        tally_points(points, lists, &tally);
    }
    assert_true(tally.reached > SEEDS * POINTS); /* the comparison saw light */
    return tally;
}

static void clustered_lists_name_every_light_that_reaches_a_point(void **unused)
{
    (void)unused;
    static const double scales[] = {1e-3, 1, 1e6};
    for (int i = 0; i < 3; i++)
        assert_int_equal(tally_scenes(VIEW_LIGHT_LISTS_AUTO, false, scales[i]).missed, 0);
}

static void corrected_linked_lists_never_miss_a_light(void **unused)
{
    (void)unused;
    static const double scales[] = {1e-3, 1, 1e6};
    for (int i = 0; i < 3; i++)
        assert_int_equal(tally_scenes(VIEW_LIGHT_LISTS_LINKED, false, scales[i]).missed, 0);
}

/* Lindbeck's lists sample the middle of 4x4 pixels: lights whose outline or faces cross a tile are
 * lost in parts of it. This states how many, so that nobody takes the faithful mode for a
 * reference. */
static void faithful_linked_lists_lose_some_lights_but_few(void **unused)
{
    (void)unused;
    struct tally faithful = tally_scenes(VIEW_LIGHT_LISTS_LINKED, true, 1);
    struct tally corrected = tally_scenes(VIEW_LIGHT_LISTS_LINKED, false, 1);
    print_message(
        "faithful: %d of %d lit (point, light) pairs lost, %d listed; corrected: %d listed\n",
        faithful.missed, faithful.reached, faithful.listed, corrected.listed);
    assert_true(faithful.missed > 0);
    assert_true(faithful.missed < faithful.reached / 50);
    assert_true(faithful.listed < corrected.listed);
}

static void lists_repeat_between_runs(void **unused)
{
    (void)unused;
    static struct point points[POINTS];
    static uint32_t first[POINTS * STRIDE], again[POINTS * STRIDE];
    static const struct {
        enum view_light_lists technique;
        bool faithful;
    } forms[] = {{VIEW_LIGHT_LISTS_CLUSTERED, false},
                 {VIEW_LIGHT_LISTS_LINKED, false},
                 {VIEW_LIGHT_LISTS_LINKED, true}};
    for (int form = 0; form < 3; form++) {
        light_scene_make(&scene, 77, false, 1);
        make_points(77, points);
        const struct light_lists_desc desc =
            describe(forms[form].technique, forms[form].faithful, LIGHT_SCENE_LIGHTS);
        list_lights(&desc, points, first);
        for (int run = 0; run < 4; run++) {
            list_lights(&desc, points, again);
            assert_memory_equal(first, again, sizeof first);
        }
    }
}

/* Two ascending runs: the prefix (with lights that fill the view), and the cluster's own. */
static void global_lights_come_first_and_clustered_lists_ascend_twice(void **unused)
{
    (void)unused;
    static struct point points[POINTS];
    static uint32_t lists[POINTS * STRIDE];
    light_scene_make(&scene, 3, false, 1);
    make_points(3, points);
    for (int linked = 0; linked < 2; linked++) {
        const struct light_lists_desc desc =
            describe(linked ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED, false,
                     LIGHT_SCENE_LIGHTS);
        list_lights(&desc, points, lists);
        int longest_tail = 0;
        for (int i = 0; i < POINTS; i++) {
            const uint32_t *list = lists + i * STRIDE;
            int globals = is_global(list[1]), runs = 1, tail = 0;
            for (uint32_t at = 2; at <= list[0]; at++) {
                globals += is_global(list[at]);
                runs += list[at] < list[at - 1];
                tail += runs > 1;
                assert_false(is_global(list[at]) && runs > 1);
            }
            assert_int_equal(globals, 6);
            assert_true(linked || runs <= 2);
            longest_tail = tail > longest_tail ? tail : longest_tail;
        }
        assert_true(longest_tail > 3); /* some list has a part of its own */
    }
}

struct list_element {
    float front, back;
    uint32_t light, next;
};

/* Reads the lists back; checks that every element is reached once and sorted. Returns the longest
 * list. */
static int check_elements(const struct linked_lists *linked, bool faithful)
{
    size_t tiles = (size_t)linked->grid.columns * (size_t)linked->grid.rows;
    uint32_t *heads = calloc(tiles + LINKED_HEADER_WORDS, 4);
    struct list_element *elements = calloc(linked->element_count + 1, sizeof *elements);
    assert_non_null(heads);
    assert_non_null(elements);
    gl_buffer_read(&linked->heads, 0, (tiles + LINKED_HEADER_WORDS) * 4, heads);
    gl_buffer_read(&linked->elements, 0, linked->element_count * sizeof *elements, elements);
    uint32_t reached = 0;
    int longest = 0;
    for (size_t tile = 0; tile < tiles; tile++) {
        int length = 0;
        const struct list_element *before = NULL;
        for (uint32_t at = heads[LINKED_HEADER_WORDS + tile]; at != UINT32_MAX;) {
            assert_true(at >= linked->prefix_count && at < linked->element_count);
            const struct list_element *element = &elements[at];
            assert_true(element->front <= element->back);
            assert_true(
                !before || before->front < element->front ||
                (before->front == element->front && (faithful || before->light < element->light)));
            before = element;
            at = element->next;
            length++;
            reached++;
            assert_true(reached <= linked->element_count);
        }
        longest = length > longest ? length : longest;
    }
    assert_int_equal(reached + linked->prefix_count, linked->element_count);
    free(heads);
    free(elements);
    return longest;
}

static struct linked_desc linked_desc_of(const struct state_light *lights, size_t count)
{
    return (struct linked_desc){
        .lights = lights, .light_count = count, .camera = &scene.camera, .window = &scene.window};
}

static void build_linked(struct linked_lists *linked, const struct linked_desc *desc)
{
    struct error err = {0};
    assert_ok(linked_lists_collect(linked, desc, &err), &err);
    assert_ok(linked_lists_build(linked, desc, rig.programs, &err), &err);
    assert_ok(gl_context_check(rig.context, "building linked lists", &err), &err);
}

static void every_element_is_linked_once_in_order(void **unused)
{
    (void)unused;
    struct linked_lists linked = {0};
    for (uint64_t seed = 0; seed < 24; seed++) {
        light_scene_make(&scene, seed, seed % 2, 1);
        struct linked_desc desc = linked_desc_of(scene.lights, LIGHT_SCENE_LIGHTS);
        desc.faithful = seed % 4 < 2;
        build_linked(&linked, &desc);
        check_elements(&linked, desc.faithful);
    }
    linked_lists_finish(&linked);
}

static void make_plain_view(int width, int height)
{
    scene.camera = (struct camera){.right = {1, 0, 0},
                                   .up = {0, 1, 0},
                                   .back = {0, 0, 1},
                                   .half_width = 0.4 * width / height,
                                   .half_height = 0.4,
                                   .z_near = 0.01};
    scene.window = camera_window_whole(width, height);
}

/* 256 lights before one 4x4 tile; pairs have equal fronts, and every fourth pair holds the eye. */
static void a_tile_holds_256_lights_with_equal_fronts(void **unused)
{
    (void)unused;
    static struct state_light lights[256];
    struct linked_lists linked = {0};
    make_plain_view(4, 4);
    for (int i = 0; i < 256; i++) {
        int pair = i / 2 * 97 % 128;
        lights[i] = (struct state_light){.type = SCENE_LIGHT_POINT,
                                         .position = {0, 0, pair % 4 ? -3 - pair * 0.05 : -1},
                                         .range = 2};
    }
    for (int faithful = 0; faithful < 2; faithful++) {
        struct linked_desc desc = linked_desc_of(lights, 256);
        desc.faithful = faithful;
        build_linked(&linked, &desc);
        assert_int_equal(linked.element_count, 256);
        assert_int_equal(check_elements(&linked, faithful), 256);
    }
    linked_lists_finish(&linked);
}

static void a_full_pool_grows_and_loses_nothing(void **unused)
{
    (void)unused;
    for (int faithful = 0; faithful < 2; faithful++) {
        struct linked_lists roomy = {0}, tight = {0};
        light_scene_make(&scene, 8, false, 1);
        struct linked_desc desc = linked_desc_of(scene.lights, LIGHT_SCENE_LIGHTS);
        desc.faithful = faithful;
        build_linked(&roomy, &desc);
        desc.elements_first = 16;
        build_linked(&tight, &desc);
        assert_int_equal(roomy.builds, 1);
        assert_int_equal(tight.builds, 2);
        assert_true(roomy.element_count > 100);
        assert_int_equal(tight.element_count, roomy.element_count);
        assert_int_equal(check_elements(&tight, faithful), check_elements(&roomy, faithful));
        linked_lists_finish(&roomy);
        linked_lists_finish(&tight);
    }
}

static void windows_that_are_no_multiple_of_a_tile_are_covered_to_their_edge(void **unused)
{
    (void)unused;
    static const int sizes[][2] = {{1, 1}, {5, 3}, {33, 31}, {130, 67}};
    static struct point points[POINTS];
    static uint32_t lists[POINTS * STRIDE];
    for (int form = 0; form < 3 * 4; form++) {
        int width = sizes[form / 3][0], height = sizes[form / 3][1];
        make_plain_view(width, height);
        scene.camera.half_width *= 0.1; /* so that even the middle of the last tile is lit */
        scene.camera.half_height *= 0.1;
        scene.lights[0] =
            (struct state_light){.type = SCENE_LIGHT_POINT, .position = {0, 0, -20}, .range = 15};
        for (int i = 0; i < POINTS; i++) /* along the upper and right edge first */
            points[i] = (struct point){.x = (uint32_t)(i % 2 ? width - 1 : i / 2 % width),
                                       .y = (uint32_t)(i % 2 ? i / 2 % height : height - 1),
                                       .z = 20};
        const struct light_lists_desc desc = describe(
            form % 3 ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED, form % 3 == 2, 1);
        list_lights(&desc, points, lists);
        for (int i = 0; i < POINTS; i++) {
            assert_int_equal(lists[i * STRIDE], 1);
            assert_int_equal(lists[i * STRIDE + 1], 0);
        }
    }
}

static void no_lights_give_empty_lists(void **unused)
{
    (void)unused;
    static struct point points[POINTS];
    static uint32_t lists[POINTS * STRIDE];
    make_plain_view(100, 50);
    for (int form = 0; form < 3; form++) {
        const struct light_lists_desc desc =
            describe(form ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED, form == 2, 0);
        list_lights(&desc, points, lists);
        for (int i = 0; i < POINTS; i++)
            assert_int_equal(lists[i * STRIDE], 0);
        assert_int_equal(light_lists_longest(rig.lists), 0);
    }
}

static void the_report_says_what_was_built_and_why(void **unused)
{
    (void)unused;
    light_scene_make(&scene, 1, false, 1);
    make_plain_view(320, 200);
    struct frame_report report = {0};
    const struct light_lists_desc desc = describe(VIEW_LIGHT_LISTS_AUTO, false, LIGHT_SCENE_LIGHTS);
    prepare(&desc, &report);
    assert_int_equal(report.pass_count, 1);
    assert_string_equal(report.passes[0].pass, "light_list");
    assert_string_equal(report.passes[0].technique, "clustered");
    assert_string_equal(report.passes[0].because, "48 lights of the scene in 10x7x24 clusters");
    double ms = report.passes[0].ms, stage_ms = report.stage_ms[REPORT_LIGHT_LIST];
    assert_true(isnan(ms) ? isnan(stage_ms) : ms > 0 && stage_ms == ms);
    assert_true(report.counts.light_list_entries >= 6);
    assert_true(report.byte_count == 1 && report.bytes[0].bytes >= 10 * 7 * 24 * 8);
}

static void too_many_lights_for_linked_lists_are_refused_by_number(void **unused)
{
    (void)unused;
    size_t count = LINKED_LIGHTS_MAX + 1;
    struct state_light *lights = calloc(count, sizeof *lights);
    assert_non_null(lights);
    make_plain_view(64, 64);
    for (size_t i = 0; i < count; i++)
        lights[i] =
            (struct state_light){.type = SCENE_LIGHT_POINT, .position = {0, 0, -5}, .range = 1};
    struct linked_lists linked = {0};
    struct error err = {0};
    const struct linked_desc desc = linked_desc_of(lights, count);
    assert_false(linked_lists_collect(&linked, &desc, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "16385 lights"));
    linked_lists_finish(&linked);
    free(lights);
}

int main(void)
{
    if (!init_rig())
        return SKIPPED;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clustered_lists_name_every_light_that_reaches_a_point),
        cmocka_unit_test(corrected_linked_lists_never_miss_a_light),
        cmocka_unit_test(faithful_linked_lists_lose_some_lights_but_few),
        cmocka_unit_test(lists_repeat_between_runs),
        cmocka_unit_test(global_lights_come_first_and_clustered_lists_ascend_twice),
        cmocka_unit_test(every_element_is_linked_once_in_order),
        cmocka_unit_test(a_tile_holds_256_lights_with_equal_fronts),
        cmocka_unit_test(a_full_pool_grows_and_loses_nothing),
        cmocka_unit_test(windows_that_are_no_multiple_of_a_tile_are_covered_to_their_edge),
        cmocka_unit_test(no_lights_give_empty_lists),
        cmocka_unit_test(the_report_says_what_was_built_and_why),
        cmocka_unit_test(too_many_lights_for_linked_lists_are_refused_by_number),
    };
    return cmocka_run_group_tests(tests, NULL, finish_rig);
}
