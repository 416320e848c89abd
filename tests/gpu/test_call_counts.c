/* SPDX-License-Identifier: MIT */
/* What standard frames ask of GL on a device that is not our own processors and whose timers are
 * true: calls, waits for the device, syncs with the driver, bytes. The numbers are those of the
 * frames as they are and a twentieth more, and may only fall: a change that lowers one lowers its
 * line here. Calls do not depend on the size of the picture or of the shadow maps, which are small
 * here. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/gl_counts.h"
#include "tests/support/image_checks.h"

enum {
    LAMPS = 25,
    STEPS = 4, /* until a moving frame knows the sizes of the one before */
    TRIES = 20,
};

enum kind { AT_REST, CAMERA_MOVES, LAMP_MOVES, LAMPS_MOVE, ONE_SHOT, KINDS };

struct most {
    uint64_t calls, waits, syncs, bytes_up, bytes_down;
};

static const struct {
    const char *name;
    struct most most;
} frames[KINDS] = {
    [AT_REST] = {"a view at rest", {105, 1, 2, 14000, 200000}},
    [CAMERA_MOVES] = {"a moving camera", {275, 1, 2, 22000, 200000}},
    [LAMP_MOVES] = {"one moving lamp of 25", {390, 2, 2, 34000, 200000}},
    [LAMPS_MOVE] = {"25 moving lamps", {400, 2, 4, 385000, 210000}},
    [ONE_SHOT] = {"one render of everything", {530, 2, 4, 500000, 210000}},
};

static struct {
    struct renderer *renderer;
    struct rig_scene demo;
    struct view_light lamps[LAMPS];
    struct view view;
} stage;

/* All with six faces, among the glass of the demo scene. */
static void place_lamps(double turn, int count)
{
    for (int i = 0; i < count; i++) {
        double angle = 2 * M_PI * i / LAMPS + turn;
        stage.lamps[i] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                             .position = {2.5 * cos(angle), 2.2, 2.5 * sin(angle)},
                                             .color = {1, 0.9, 0.8},
                                             .intensity = 5};
    }
}

static void move(enum kind kind, int step)
{
    if (kind == CAMERA_MOVES)
        stage.view.camera.eye[0] += 0.05;
    if (kind == LAMP_MOVES)
        place_lamps(0.01 * (step + 1), 1);
    if (kind == LAMPS_MOVE)
        place_lamps(0.01 * (step + 1), LAMPS);
    if (kind == ONE_SHOT)
        renderer_drop_structures(stage.renderer, stage.demo.key);
}

/* As live views do it: the first half, then, when the picture is there, the second. */
static void show(void)
{
    struct frame frame = {0};
    struct error err = {0};
    bool is_done;
    if (!renderer_submit(stage.renderer, stage.demo.key, &stage.view, &frame, &is_done, &err))
        fail_msg("%s", err.message);
    if (!is_done && !renderer_collect(stage.renderer, &err))
        fail_msg("%s", err.message);
    frame_finish(&frame);
}

static void shoot_once(void)
{
    struct frame frame;
    shoot(stage.renderer, &stage.demo, &stage.view, &frame);
    frame_finish(&frame);
}

static struct gl_counts count(enum kind kind)
{
    struct gl_counts before, after;
    for (int step = 0; step < STEPS; step++) {
        move(kind, step);
        gl_counts_get(&before);
        kind == ONE_SHOT ? shoot_once() : show();
        gl_counts_get(&after);
    }
    return gl_counts_between(&before, &after);
}

static void expect_at_most(const char *frame, const char *what, uint64_t found, uint64_t most)
{
    if (found > most)
        fail_msg("%s: %llu %s, at most %llu so far", frame, (unsigned long long)found, what,
                 (unsigned long long)most);
}

static void frames_ask_no_more_of_gl_than_they_did(void **state)
{
    struct gl_counts counts[KINDS];
    (void)state;
    show(); /* programs, textures */
    for (int kind = 0; kind < KINDS; kind++) {
        counts[kind] = count((enum kind)kind);
        gl_counts_show(frames[kind].name, &counts[kind], 8);
    }
    for (int kind = 0; kind < KINDS; kind++) {
        const struct most *most = &frames[kind].most;
        const struct gl_counts *c = &counts[kind];
        expect_at_most(frames[kind].name, "calls", c->calls, most->calls);
        expect_at_most(frames[kind].name, "waits", gl_counts_waits(c), most->waits);
        expect_at_most(frames[kind].name, "syncs", c->syncs, most->syncs);
        expect_at_most(frames[kind].name, "bytes up", c->bytes_up, most->bytes_up);
        expect_at_most(frames[kind].name, "bytes down", c->bytes_down, most->bytes_down);
    }
}

/* On busy processors the self-test may doubt true timers. */
static void open_renderer(void)
{
    struct renderer_info info = {.has_true_timers = false};
    for (int i = 0; i < TRIES && !info.has_true_timers; i++) {
        renderer_destroy(stage.renderer);
        stage.renderer =
            render_rig_create_as(&(struct renderer_desc){.is_strict = true, .defers_frames = true});
        renderer_get_info(stage.renderer, &info);
    }
}

int main(void)
{
    gl_hooks_install(&(struct gl_hooks_desc){
        .counts = true, .hostility = {.is_not_software = true, .timers = GL_TIMERS_TRUE}});
    open_renderer();
    rig_demo_open(&stage.demo, stage.renderer, "demo", 64);
    place_lamps(0, LAMPS);
    stage.view = (struct view){
        .width_px = 128,
        .height_px = 96,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .lights = stage.lamps,
        .light_count = LAMPS,
        .quality = {.shadow_resolution = 64},
    };
    const struct CMUnitTest tests[] = {cmocka_unit_test(frames_ask_no_more_of_gl_than_they_did)};
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rig_scene_finish(&stage.demo, stage.renderer);
    renderer_destroy(stage.renderer);
    return failed;
}
