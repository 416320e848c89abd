/* SPDX-License-Identifier: MIT */
/* The default techniques give the same bits: frame after frame, renderer after renderer, whatever
 * the number of threads of the software rasteriser and the order of the file's nodes. This process
 * has two threads, others have none and one. */
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "glb/demo_scene.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { SCENES = 3, HASHES_MAX = SCENES * SHADOWS_COUNT, PANES = 24 };

/* Scene i as GLB bytes, and how to look at it. */
static void make_scene(int i, void **glb, size_t *size, struct view *view)
{
    struct closed_form_scene scene = {0};
    struct error err = {0};
    *view = (struct view){.width_px = 96, .height_px = 72};
    if (i == 0) { /* tilted panes from below and, with the camera among them, from beside */
        random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = PANES, .seed = 5},
                                 &scene);
        view->camera = (struct view_camera){
            .kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}};
        view->quality.shadow_resolution = 512;
    } else if (i == 1) { /* many lights, glass spheres */
        room_scene_build(
            &(struct room_scene_desc){.light_count = 24, .seed = 7, .glass_spheres = 16}, &scene);
        view->quality.shadow_resolution = 64;
    } else {
        assert_true(demo_scene_build(
            &(struct demo_scene_desc){.texture_size_px = 128, .coarseness = 4}, glb, size, &err));
        view->quality.shadow_resolution = 128;
        return;
    }
    *size = scene.size_bytes;
    *glb = malloc(*size);
    memcpy(*glb, scene.glb, *size);
    closed_form_scene_finish(&scene);
}

/* The corrected linked lists sort by depth, too: their bits are as fixed. */
static int find_techniques(enum shadow_technique techniques[SHADOWS_COUNT])
{
    return (int)raster_techniques(SHADOW_CAN_FILTER, techniques);
}

static int count_hashes(void)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    return SCENES * find_techniques(techniques);
}

static void hash_scenes(struct renderer *renderer, uint64_t hashes[HASHES_MAX])
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    int count = find_techniques(techniques);
    for (int i = 0; i < SCENES; i++) {
        struct rig_scene rig;
        struct view view;
        void *glb;
        size_t size;
        make_scene(i, &glb, &size, &view);
        rig_scene_open(&rig, renderer, "hashed", glb, size);
        for (int t = 0; t < count; t++) {
            view.quality.shadows = techniques[t];
            struct image color = shoot_color(renderer, &rig, &view);
            assert_image_is_sound(&color, 1e6);
            hashes[t * SCENES + i] = image_hash(&color);
            image_finish(&color);
        }
        rig_scene_finish(&rig, renderer);
        free(glb);
    }
}

static uint64_t original[HASHES_MAX]; /* of the first renderer's first frames */

static int hash_first(void **state)
{
    *state = render_rig_create();
    hash_scenes(*state, original);
    return 0;
}

static void repeated_frames_and_fresh_renderers_give_the_same_bits(void **state)
{
    uint64_t again[HASHES_MAX] = {0};
    for (int i = 0; i < 2; i++) {
        if (i)
            *state = render_rig_create();
        hash_scenes(*state, again);
        assert_memory_equal(original, again, (size_t)count_hashes() * sizeof *original);
        renderer_destroy(*state);
    }
}

/* The hashes that this program prints when it is run with so many threads. */
static void hashes_of_child(const char *threads, uint64_t hashes[HASHES_MAX])
{
    char self[400], command[512];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    assert_true(length > 0);
    self[length] = 0;
    snprintf(command, sizeof command, "LP_NUM_THREADS=%s '%s' --hash", threads, self);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    for (int i = 0; i < count_hashes(); i++)
        assert_int_equal(fscanf(pipe, "%" SCNx64, &hashes[i]), 1);
    assert_int_equal(pclose(pipe), 0);
}

static void number_of_threads_does_not_change_a_bit(void **state)
{
    static const char *const threads[] = {"0", "1"};
    (void)state;
    for (int t = 0; t < 2; t++) {
        uint64_t hashes[HASHES_MAX] = {0};
        hashes_of_child(threads[t], hashes);
        for (int i = 0; i < count_hashes(); i++)
            if (hashes[i] != original[i])
                fail_msg("scene %d, technique %d: %s threads render other bits than 2", i % SCENES,
                         i / SCENES, threads[t]);
    }
}

/* The random panes with their nodes in another order; some lie in one plane. */
static void build_permuted(int step, struct closed_form_scene *out)
{
    struct closed_form_scene scene;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = PANES, .seed = 11},
                             &scene);
    struct glb_builder *builder = closed_form_begin(out, "Permuted", PANES);
    closed_form_floor(out, builder, 3);
    for (int i = 0; i < PANES; i++) {
        int k = i * step % PANES;
        struct closed_form_pane pane = scene.panes[k];
        if (k % 3 == 0) { /* eight stacked in one plane, over one another */
            pane = (struct closed_form_pane){.corner = {-1, 2, 1},
                                             .u = {2, 0, 0},
                                             .v = {0, 0, -2},
                                             .is_blend = scene.panes[k].is_blend};
            memcpy(pane.color, scene.panes[k].color, sizeof pane.color);
        }
        closed_form_add_pane(builder, &pane);
    }
    out->light = scene.light;
    closed_form_add_light(out, builder);
    closed_form_end(out, builder);
    closed_form_scene_finish(&scene);
}

static void order_of_nodes_does_not_change_a_bit(void **state)
{
    static const int steps[] = {1, 5, 7, 23}; /* coprime to PANES */
    struct renderer *renderer = render_rig_create();
    struct image first = {0};
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        build_permuted(steps[i], &scene);
        rig_scene_open(&rig, renderer, "permuted", scene.glb, scene.size_bytes);
        struct view view = {.width_px = 128,
                            .height_px = 128,
                            .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {0, 0.9, 0},
                                       .up = {0, 0, -1},
                                       .fov_y_deg = 120},
                            .quality.shadow_resolution = 512};
        struct image color = shoot_color(renderer, &rig, &view);
        if (i == 0) {
            first = color;
        } else {
            assert_same_bits(&first, &color);
            image_finish(&color);
        }
        rig_scene_finish(&rig, renderer);
        closed_form_scene_finish(&scene);
    }
    image_finish(&first);
    renderer_destroy(renderer);
}

static int print_hashes(void)
{
    uint64_t hashes[HASHES_MAX] = {0};
    struct renderer *renderer = render_rig_create();
    hash_scenes(renderer, hashes);
    renderer_destroy(renderer);
    for (int i = 0; i < count_hashes(); i++)
        printf("%" PRIx64 "\n", hashes[i]);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc > 1 && !strcmp(argv[1], "--hash"))
        return print_hashes();
    setenv("LP_NUM_THREADS", "2", true);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(repeated_frames_and_fresh_renderers_give_the_same_bits, hash_first),
        cmocka_unit_test(number_of_threads_does_not_change_a_bit),
        cmocka_unit_test(order_of_nodes_does_not_change_a_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
