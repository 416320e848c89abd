/* SPDX-License-Identifier: MIT */
/* The programs of a frame are known before it is drawn: it builds those that are listed and no
 * others, and all that are not conditional. Held with counters, on caches that know nothing. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_media.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { SIDE = 48 };

struct program_case {
    struct renderer *renderer; /* its own: no program stands */
    struct rig_scene rig;
    struct closed_form_scene closed_form;
};

static void open_demo(struct program_case *c)
{
    *c = (struct program_case){.renderer = render_rig_create()};
    rig_demo_open_fine(&c->rig, c->renderer, "demo", 64);
}

/* With little memory, or few steps of loops; 0: as usual. */
static void open_short(struct program_case *c, uint64_t gpu_budget_bytes, uint64_t loop_steps)
{
    struct error err = {0};
    *c = (struct program_case){
        .renderer = renderer_create(&(struct renderer_desc){.is_strict = true,
                                                            .gpu_budget_bytes = gpu_budget_bytes,
                                                            .hooks.loop_steps = loop_steps},
                                    &err)};
    if (!c->renderer)
        fail_msg("%s", err.message);
    rig_demo_open_fine(&c->rig, c->renderer, "demo", 64);
}

static void open_panes(struct program_case *c, int count)
{
    static const double colors[2][4] = {{0.8, 0.5, 0.25, 1}, {0.5, 1, 0.5, 1}};
    *c = (struct program_case){.renderer = render_rig_create()};
    panes_scene_build(&(struct panes_scene_desc){.pane_count = count, .colors = colors},
                      &c->closed_form);
    rig_scene_open(&c->rig, c->renderer, "panes", c->closed_form.glb, c->closed_form.size_bytes);
}

static void open_medium(struct program_case *c)
{
    static const struct closed_form_body box = {
        .shape = BODY_BOX, .high = {1, 1, 1}, .remains = {0.5f, 0.25f, 0.0625f}, .distance = 0.25f};
    *c = (struct program_case){.renderer = render_rig_create()};
    media_scene_build(&(struct media_scene_desc){.bodies = &box, .count = 1}, &c->closed_form);
    rig_scene_open(&c->rig, c->renderer, "medium", c->closed_form.glb, c->closed_form.size_bytes);
}

static void close_case(struct program_case *c)
{
    rig_scene_finish(&c->rig, c->renderer);
    closed_form_scene_finish(&c->closed_form);
    renderer_destroy(c->renderer);
}

static struct view small_view(void)
{
    return (struct view){.width_px = SIDE,
                         .height_px = SIDE,
                         .camera = {.kind = VIEW_CAMERA_FIT},
                         .quality = {.shadow_resolution = 64, .shadows = SHADOWS_DEEP}};
}

static bool is_first_of_its_kind(const struct program_list *list, size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (program_list_is_same(&list->items[i], &list->items[index]))
            return false;
    return true;
}

static void list_programs(const struct program_case *c, const struct view *view,
                          struct program_list *list)
{
    struct error err = {0};
    struct renderer_info before, after;
    renderer_get_info(c->renderer, &before);
    if (!renderer_list_programs(c->renderer, c->rig.key, view, list, &err))
        fail_msg("%s", err.message);
    renderer_get_info(c->renderer, &after);
    assert_int_equal(before.programs_built, after.programs_built); /* listing compiles nothing */
}

static bool plan_has_pass(const struct plan *plan, const char *pass)
{
    for (int i = 0; i < plan->pass_count; i++)
        if (!strcmp(plan->passes[i].pass, pass))
            return true;
    return false;
}

/* Draws the view, and holds what it built against what was listed before and after. Returns how
 * many it built. */
static uint64_t check_programs(const struct program_case *c, const struct view *view)
{
    struct program_list before = {0}, after = {0};
    struct plan plan;
    struct frame frame;
    struct error err = {0};
    size_t missing = 0, made = 0;
    list_programs(c, view, &before);
    assert_true(renderer_explain(c->renderer, c->rig.key, view, &plan, &err));
    shoot(c->renderer, &c->rig, view, &frame);
    list_programs(c, view, &after);
    assert_int_equal(before.count, after.count);
    for (size_t i = 0; i < after.count; i++) {
        const struct listed_program *is = &after.items[i], *was = &before.items[i];
        assert_true(plan_has_pass(&plan, is->pass));
        if (!is->is_conditional && is->place != PROGRAM_IN_MEMORY)
            fail_msg("%s [%s] is listed for %s, but the frame did not need it", is->label,
                     is->defines, is->pass);
        if (!is_first_of_its_kind(&after, i))
            continue;
        missing += was->place == PROGRAM_ABSENT;
        made += was->place == PROGRAM_ABSENT && is->place == PROGRAM_IN_MEMORY;
    }
    uint64_t built = frame.report.counts.programs_built;
    if (built != made)
        fail_msg("the frame built %d programs, %zu of them were listed", (int)built, made);
    assert_true(built <= missing);
    frame_finish(&frame);
    program_list_finish(&before);
    program_list_finish(&after);
    return built;
}

/* Whether another technique answers for casters that the view's own cannot answer for. */
static bool is_replaced(const struct program_case *c, const struct view *view)
{
    struct plan plan;
    struct error err = {0};
    assert_true(renderer_explain(c->renderer, c->rig.key, view, &plan, &err));
    return plan.unfit_casters > 0;
}

static void every_technique_builds_what_is_listed(void **state)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    size_t count = raster_techniques(0, techniques);
    (void)state;
    struct program_case c;
    open_demo(&c);
    for (size_t i = 0; i < count; i++) {
        for (int samples = 1; samples <= 4; samples += 3) {
            struct view view = small_view();
            view.quality.shadows = techniques[i];
            view.quality.samples = samples;
            assert_true(check_programs(&c, &view) > 0 || is_replaced(&c, &view));
            assert_int_equal(check_programs(&c, &view), 0);
        }
    }
    close_case(&c);
}

static void smoke_builds_what_is_listed(void **state)
{
    (void)state;
    static const double plane[4] = {1, 0, 0, 0.2};
    struct program_case c = {.renderer = render_rig_create()};
    random_panes_scene_build(
        &(struct random_panes_scene_desc){
            .pane_count = 3, .seed = 9, .light = GLB_LIGHT_POINT, .has_smoke = true},
        &c.closed_form);
    rig_scene_open(&c.rig, c.renderer, "smoke", c.closed_form.glb, c.closed_form.size_bytes);
    for (int i = 0; i < 6; i++) { /* alone, behind a cut, in haze, without shadows; as published */
        struct view view = small_view();
        view.quality.shadows = i > 3 ? SHADOWS_DEEP_LINKED : i == 3 ? SHADOWS_NONE : SHADOWS_DEEP;
        view.quality.faithful = i > 3;
        view.clip_planes = &plane;
        view.clip_plane_count = i == 1 || i == 5;
        view.atmosphere = (struct view_atmosphere){.density_per_m = i == 2 ? 0.05 : 0};
        assert_true(check_programs(&c, &view) > 0);
        assert_int_equal(check_programs(&c, &view), 0);
    }
    close_case(&c);
}

/* The demo scene has textured glass, which leaves grids of triangles to rays. */
static void grids_of_triangles_build_what_is_listed(void **state)
{
    (void)state;
    static const struct view_light lights[] = {
        {.type = SCENE_LIGHT_RECT,
         .position = {0, 4, 0},
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 10,
         .width_m = 1,
         .height_m = 1},
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {0, -1, 0.1},
         .color = {1, 1, 1},
         .intensity = 1},
    };
    static const double plane[4] = {1, 0, 0, 0.2};
    struct program_case c;
    open_panes(&c, 2);
    for (int i = 0; i < 4; i++) {
        struct view view = small_view();
        view.quality.shadows = SHADOWS_AREA;
        view.quality.samples = i % 2 ? 4 : 1;
        view.quality.area_samples = i < 2 ? 3 : 16;
        view.lights = lights;
        view.light_count = i > 0 ? 2 : 1;
        view.clip_planes = &plane;
        view.clip_plane_count = i == 3;
        assert_false(is_replaced(&c, &view));
        assert_true(check_programs(&c, &view) > 0);
        assert_int_equal(check_programs(&c, &view), 0);
    }
    close_case(&c);
    open_panes(&c, 0); /* all is opaque: as published, masks are those of a table */
    struct view view = small_view();
    view.quality.shadows = SHADOWS_AREA;
    view.quality.area_samples = 16;
    view.quality.faithful = true;
    view.lights = lights;
    view.light_count = 2;
    assert_true(check_programs(&c, &view) > 0);
    assert_int_equal(check_programs(&c, &view), 0);
    close_case(&c);
}

static void lists_outputs_and_cameras_build_what_is_listed(void **state)
{
    (void)state;
    struct program_case c;
    open_demo(&c);
    struct view view = small_view();
    view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    assert_true(check_programs(&c, &view) > 0);
    view.quality.faithful = true;
    view.quality.shadows = SHADOWS_DEEP_LINKED;
    assert_true(check_programs(&c, &view) > 0);
    view.quality.light_lists = VIEW_LIGHT_LISTS_CLUSTERED;
    view.quality.shadows = SHADOWS_TRANSLUCENT;
    assert_true(check_programs(&c, &view) > 0);
    view.quality.shadows = SHADOWS_STOCHASTIC;
    assert_true(check_programs(&c, &view) > 0);
    view = small_view();
    view.outputs = 0x3ff; /* all */
    assert_true(check_programs(&c, &view) > 0);
    view.outputs = 1u << VIEW_OUTPUT_DEPTH;
    assert_true(check_programs(&c, &view) > 0);
    view = small_view();
    view.camera.ortho_height = 2;
    assert_true(check_programs(&c, &view) > 0);
    close_case(&c);
}

static void pictures_for_a_screen_build_what_is_listed(void **state)
{
    struct program_case c = {.renderer = render_rig_create_as(&(struct renderer_desc){
                                 .is_strict = true, .hooks.poses_as_hardware = true})};
    struct view view = small_view();
    (void)state;
    rig_demo_open_fine(&c.rig, c.renderer, "demo", 64);
    view.quality.shadows = SHADOWS_NONE;
    assert_true(check_programs(&c, &view) > 0);
    view.screen.channels = 3;
    assert_int_equal(check_programs(&c, &view), 1);
    view.screen = (struct view_screen){.channels = 4, .mapping = {.operator_ = TONE_MAPPING_NONE}};
    assert_int_equal(check_programs(&c, &view), 0);
    close_case(&c);
}

static void cuts_and_compression_build_what_is_listed(void **state)
{
    (void)state;
    struct program_case c;
    open_demo(&c);
    static const double plane[1][4] = {{0, -1, 0, 0.4}};
    struct view view = small_view();
    view.clip_plane_count = 1;
    view.clip_planes = plane;
    assert_true(check_programs(&c, &view) > 0);
    view = small_view();
    view.quality.shadow_compression = 0.01;
    assert_true(check_programs(&c, &view) > 0);
    view.quality.shadow_prefilter = 2;
    assert_true(check_programs(&c, &view) > 0);
    close_case(&c);
}

static void media_and_bare_floors_build_what_is_listed(void **state)
{
    (void)state;
    struct program_case c;
    open_medium(&c);
    struct view view = small_view();
    assert_true(check_programs(&c, &view) > 0);
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {0.5, 0.5, 0.5}, .target = {0.5, 0.5, -5}};
    assert_true(check_programs(&c, &view) > 0); /* from within */
    static const double plane[1][4] = {{0, -1, 0, 0.5}};
    static const struct view_light buried = {.type = SCENE_LIGHT_POINT,
                                             .position = {0.5, 0.75, 0.5},
                                             .color = {1, 1, 1},
                                             .intensity = 10};
    view = small_view();
    view.clip_plane_count = 1;
    view.clip_planes = plane;
    view.lights = &buried;
    view.light_count = 1;
    assert_true(check_programs(&c, &view) > 0); /* its lamp cut away, inside of it */
    close_case(&c);
    open_panes(&c, 0);
    assert_true(check_programs(&c, &view) > 0);
    close_case(&c);
    open_panes(&c, 2);
    assert_true(check_programs(&c, &view) > 0);
    close_case(&c);
}

/* Whether some listed program has the define and, in_memory, was needed. */
static bool lists(const struct program_case *c, const struct view *view, const char *define,
                  bool in_memory)
{
    struct program_list list = {0};
    bool has = false;
    list_programs(c, view, &list);
    for (size_t i = 0; i < list.count; i++)
        has |= strstr(list.items[i].defines, define) &&
               (!in_memory || list.items[i].place == PROGRAM_IN_MEMORY);
    program_list_finish(&list);
    return has;
}

/* Of the demo's lights, spots, points and a sun, a batch has some kinds or others. */
static void batches_build_what_is_listed(void **state)
{
    (void)state;
    for (int mib = 4; mib <= 8; mib++) { /* of the GPU, half of it for shadows */
        struct program_case c;
        open_short(&c, (uint64_t)mib << 20, 0);
        for (int samples = 1; samples <= 4; samples += 3) {
            struct view view = small_view();
            view.quality.shadow_resolution = 128;
            view.quality.samples = samples;
            bool was_listed = lists(&c, &view, "HAS_LIGHT_PARTS", false);
            if (was_listed) /* else how much is too much is only known from then on */
                assert_true(check_programs(&c, &view) > 0);
            struct frame frame;
            shoot(c.renderer, &c.rig, &view, &frame);
            assert_int_in_range(frame.report.counts.light_batches, 2, 100);
            frame_finish(&frame);
            assert_true(lists(&c, &view, "HAS_LIGHT_PARTS", true));
            assert_int_equal(check_programs(&c, &view), 0);
        }
        close_case(&c);
    }
}

/* More lights at a point than the steps of a dispatch are enough for; and too few steps only where
 * layers are many. */
static void slices_build_what_is_listed(void **state)
{
    static const uint64_t steps[] = {400, 1000, 2000, 3000, 4500};
    int sliced = 0;
    (void)state;
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        struct program_case c;
        open_short(&c, 0, steps[i]);
        for (int samples = 1; samples <= 4; samples += 3) {
            static const enum shadow_technique techniques[] = {SHADOWS_NONE, SHADOWS_DEEP,
                                                               SHADOWS_RAYTRACED_SHADOWS};
            for (int t = 0; t < 3; t++) {
                struct view view = small_view();
                view.quality.samples = samples;
                view.quality.shadows = techniques[t];
                struct frame frame;
                struct error err = {0};
                if (!renderer_render(c.renderer, c.rig.key, &view, &frame, &err))
                    continue; /* not one light has room */
                sliced += frame.report.counts.light_chunks > 1;
                assert_int_equal(frame.report.counts.light_chunks > 1,
                                 lists(&c, &view, "HAS_LIGHT_CHUNK", true));
                frame_finish(&frame);
                assert_int_equal(check_programs(&c, &view), 0);
            }
        }
        close_case(&c);
    }
    assert_int_in_range(sliced, 4, 20);
    struct program_case c;
    open_short(&c, 0, 2000);
    struct view view = small_view();
    assert_true(check_programs(&c, &view) > 0);
    close_case(&c);
    open_demo(&c);
    assert_false(lists(&c, &view, "HAS_LIGHT_CHUNK", false)); /* 12 lights never are too many */
    close_case(&c);
}

/* ---- warm scenes ---- */

static bool never(void *context)
{
    (void)context;
    return false;
}

static bool at_once(void *context)
{
    ++*(int *)context;
    return true;
}

static uint64_t programs_built(const struct program_case *c)
{
    struct renderer_info info;
    renderer_get_info(c->renderer, &info);
    return info.programs_built;
}

static void warm_up(const struct program_case *c, int samples)
{
    static const struct renderer_warm_up_desc desc = {.shall_stop = never};
    struct error err = {0};
    bool is_complete = false;
    struct view view = small_view();
    view.quality = (struct view_quality){.samples = samples};
    if (!renderer_warm_up(c->renderer, c->rig.key, &view, &desc, &is_complete, &err))
        fail_msg("%s", err.message);
    assert_true(is_complete);
}

/* Numbers in [0, 1), the same on every run. */
static double next_number(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u; /* Knuth, "The Art of Computer Programming" 2, 3.3.4 */
    return (double)(*seed >> 8) / (1 << 24);
}

/* From anywhere around and inside of what is `reach_m` wide, in pictures of any size. */
static void fly_through(const struct program_case *c, double reach_m, bool expects_both)
{
    uint32_t seed = 20;
    uint64_t least_built = UINT64_MAX, unseen = 0, bare = 0;
    uint64_t before = programs_built(c);
    for (int i = 0; i < 16; i++) {
        struct frame frame;
        struct view view = {.width_px = 16 + 8 * (i % 5),
                            .height_px = 16 + 8 * (i % 3),
                            .camera = {.kind = VIEW_CAMERA_LOOK_AT},
                            .quality = {.samples = i % 2 ? 1 : 0,
                                        .shadow_taps = i % 2,
                                        .shadow_resolution = 32 << i % 3}};
        for (int k = 0; k < 3; k++) {
            view.camera.eye[k] = reach_m * (next_number(&seed) - 0.5);
            view.camera.target[k] = reach_m * (next_number(&seed) - 0.5);
        }
        shoot(c->renderer, &c->rig, &view, &frame);
        if (frame.report.counts.programs_built)
            fail_msg("picture %d built %d programs", i, (int)frame.report.counts.programs_built);
        unseen += frame.report.counts.unseen_lights > 0;
        bare += frame.report.counts.transparent_fragments == 0;
        if (frame.report.counts.programs_reused < least_built)
            least_built = frame.report.counts.programs_reused;
        frame_finish(&frame);
    }
    assert_int_equal(programs_built(c), before);
    assert_true(least_built > 0);
    if (expects_both) { /* the cameras make the differences that decide about programs */
        assert_true(unseen > 0 && unseen < 16);
        assert_true(bare > 0 && bare < 16);
    }
}

static void no_picture_of_a_warm_scene_compiles(void **state)
{
    (void)state;
    struct program_case c;
    open_demo(&c);
    uint64_t cold = programs_built(&c);
    warm_up(&c, 0);
    assert_true(programs_built(&c) > cold + 10);
    warm_up(&c, 1);
    fly_through(&c, 12, true);
    close_case(&c);
    open_medium(&c);
    warm_up(&c, 0);
    warm_up(&c, 1);
    fly_through(&c, 2, false);
    close_case(&c);
}

static void warming_up_gives_way_and_goes_on(void **state)
{
    (void)state;
    int asked = 0, calls = 0;
    bool is_complete = false;
    const struct renderer_warm_up_desc desc = {.shall_stop = at_once, .context = &asked};
    struct program_case c;
    struct view view = small_view();
    open_panes(&c, 1);
    for (; !is_complete; calls++) {
        uint64_t before = programs_built(&c);
        struct error err = {0};
        assert_true(renderer_warm_up(c.renderer, c.rig.key, &view, &desc, &is_complete, &err));
        assert_int_equal(programs_built(&c) - before, 1); /* each call one */
    }
    assert_int_equal(asked, calls - 1);
    assert_true(calls > 5);
    close_case(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_technique_builds_what_is_listed),
        cmocka_unit_test(grids_of_triangles_build_what_is_listed),
        cmocka_unit_test(smoke_builds_what_is_listed),
        cmocka_unit_test(lists_outputs_and_cameras_build_what_is_listed),
        cmocka_unit_test(pictures_for_a_screen_build_what_is_listed),
        cmocka_unit_test(cuts_and_compression_build_what_is_listed),
        cmocka_unit_test(media_and_bare_floors_build_what_is_listed),
        cmocka_unit_test(batches_build_what_is_listed),
        cmocka_unit_test(slices_build_what_is_listed),
        cmocka_unit_test(no_picture_of_a_warm_scene_compiles),
        cmocka_unit_test(warming_up_gives_way_and_goes_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
