/* SPDX-License-Identifier: MIT */
/* The self-test takes this device, by every structure, and refuses one on which views of buffers
 * show a storage of before: at the start, where the next device is taken, or before the first
 * picture that such a view would be wrong in. What was right once is not tested again. */
#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/frame/proof_file.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"

enum { SKIPPED = 77, PATH_BYTES = 96 };

/* Of views with one label those after the first show no more than the first one did, as if they
 * were still of its storage; or all show no more than so many bytes. */
static struct {
    PFNGLTEXTUREBUFFERPROC make_view;
    const char *label;
    GLint first_bytes, shown_bytes;
    int stale;
    bool spares_the_next; /* only the first renderer has it: its first storage is made once more */
} defect;

static void make_stale_view(GLuint texture, GLenum format, GLuint buffer)
{
    char label[64] = "";
    GLint bytes = 0;
    defect.make_view(texture, format, buffer);
    glGetObjectLabel(GL_TEXTURE, texture, sizeof label, NULL, label);
    if (!defect.label || strcmp(label, defect.label) != 0)
        return;
    glGetNamedBufferParameteriv(buffer, GL_BUFFER_SIZE, &bytes);
    if (defect.shown_bytes)
        defect.first_bytes = defect.shown_bytes;
    if (!defect.first_bytes)
        defect.first_bytes = bytes;
    else if (defect.spares_the_next && defect.stale && bytes == defect.first_bytes)
        defect.label = NULL;
    if (!defect.label || bytes <= defect.first_bytes)
        return;
    glTextureBufferRange(texture, format, buffer, 0, defect.first_bytes);
    defect.stale++;
}

/* A list that another surface has is wrong and has an end, unlike what elements that are not shown
 * make of it. */
static const char heads[] = "lights.linked.heads";
enum { HEADS_SHOWN = 4 };

static void break_views(const char *label)
{
    defect.label = label;
    defect.first_bytes = defect.stale = 0;
    defect.shown_bytes = strcmp(label ? label : "", heads) ? 0 : 4 * HEADS_SHOWN;
    defect.spares_the_next = false;
    GL_SPY_BEGIN(TextureBuffer, defect.make_view, make_stale_view);
}

static void mend_views(void)
{
    GL_SPY_END(TextureBuffer, defect.make_view);
}

static bool starts(const char *label, const struct renderer_desc *desc, struct error *err)
{
    *err = (struct error){0};
    break_views(label);
    struct renderer *renderer = renderer_create(desc, err);
    mend_views();
    renderer_destroy(renderer);
    return renderer != NULL;
}

static void this_device_draws_right_by_every_structure(void **state)
{
    struct error err;
    (void)state;
    for (int poses = 0; poses < 2; poses++) { /* with scans on processors, and on devices */
        const struct renderer_desc desc = {.is_strict = true,
                                           .hooks.poses_as_hardware = poses,
                                           .self_test = RENDERER_SELFTEST_ALWAYS};
        if (!starts(NULL, &desc, &err))
            fail_msg("%s", err.message);
    }
}

static void a_device_with_stale_views_is_refused(void **state)
{
    static const char *const labels[] = {"shadow.records", "shadow.heads", "shadow.deep.events",
                                         "lights.clusters.items"};
    (void)state;
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++) {
        const struct renderer_desc desc = {
            .device = "software", .is_strict = true, .hooks.poses_as_hardware = i % 2};
        struct error err;
        bool ok = starts(labels[i], &desc, &err);
        if (!defect.stale)
            fail_msg("no view of %s was made again", labels[i]);
        if (ok)
            fail_msg("stale views of %s are not noticed", labels[i]);
        assert_int_equal(err.code, ERROR_NO_DEVICE);
        if (strstr(err.message, "self-test 'deep under 150 lights'") != err.message)
            fail_msg("%s: %s", labels[i], err.message);
    }
}

static void every_other_structure_is_looked_at_too(void **state)
{
    static const char *const labels[][2] = {{heads, "linked light lists under"},
                                            {"shadow.traced.filters", "raytraced-shadows under"}};
    (void)state;
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++) {
        const struct renderer_desc desc = {
            .device = "software", .is_strict = true, .self_test = RENDERER_SELFTEST_ALWAYS};
        struct error err;
        bool ok = starts(labels[i][0], &desc, &err);
        if (!defect.stale)
            fail_msg("no view of %s was made wrong", labels[i][0]);
        if (ok)
            fail_msg("wrong views of %s are not noticed", labels[i][0]);
        if (!strstr(err.message, labels[i][1]))
            fail_msg("%s: %s", labels[i][0], err.message);
    }
}

static void a_device_that_fails_is_passed_over_for_the_next(void **state)
{
    struct error err = {0};
    struct renderer_info info;
    int passed_over = 0, taken = 0;
    (void)state;
    break_views("shadow.records");
    defect.spares_the_next = true;
    struct renderer *renderer = renderer_create(&(struct renderer_desc){.is_strict = true}, &err);
    mend_views();
    if (!renderer && strstr(err.message, "no device can be taken"))
        skip(); /* there is one alone */
    if (!renderer)
        fail_msg("%s", err.message);
    renderer_get_info(renderer, &info);
    for (int i = 0; i < RENDERER_DEVICES_TOLD && *info.devices[i]; i++) {
        const char *reason = strstr(info.devices[i], ": passed over: self-test 'deep under 150");
        passed_over += reason && strstr(reason, "expected");
        taken += strstr(info.devices[i], ": taken") != NULL;
    }
    assert_int_equal(passed_over, 1);
    assert_int_equal(taken, 1);
    renderer_destroy(renderer);
}

static bool draws(struct renderer *renderer, const struct rig_scene *scene,
                  enum view_light_lists lists, struct error *err)
{
    struct frame frame;
    const struct view view = {.width_px = 32,
                              .height_px = 24,
                              .quality = {.shadow_resolution = 32, .light_lists = lists}};
    *err = (struct error){0};
    bool ok = renderer_render(renderer, scene->key, &view, &frame, err);
    frame_finish(&frame);
    return ok;
}

static void what_is_wrong_is_refused_and_the_rest_is_served(void **state)
{
    const struct renderer_desc desc = {.is_strict = true, .self_test = RENDERER_SELFTEST_KEPT};
    struct rig_scene demo;
    struct error err = {0};
    (void)state;
    break_views(heads);
    struct renderer *renderer = renderer_create(&desc, &err);
    if (!renderer)
        fail_msg("%s", err.message);
    rig_demo_open(&demo, renderer, "demo", 64);
    assert_int_equal(defect.stale, 0); /* such lists are not tested at a start */
    assert_true(draws(renderer, &demo, VIEW_LIGHT_LISTS_CLUSTERED, &err));
    assert_false(draws(renderer, &demo, VIEW_LIGHT_LISTS_LINKED, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "linked light lists under"));
    const int stale = defect.stale;
    assert_true(stale > 0);
    assert_false(draws(renderer, &demo, VIEW_LIGHT_LISTS_LINKED, &err)); /* without a second test */
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_int_equal(defect.stale, stale);
    assert_true(draws(renderer, &demo, VIEW_LIGHT_LISTS_CLUSTERED, &err));
    mend_views();
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

static void software_is_tested_before_its_first_picture(void **state)
{
    const struct renderer_desc desc = {
        .device = "software", .is_strict = true, .self_test = RENDERER_SELFTEST_KEPT};
    struct rig_scene demo;
    struct error err = {0};
    (void)state;
    struct renderer_info info;
    struct renderer *renderer = renderer_create(&desc, &err);
    if (!renderer)
        fail_msg("%s", err.message);
    renderer_get_info(renderer, &info);
    if (!info.is_software) { /* the device hides it */
        renderer_destroy(renderer);
        skip();
    }
    break_views("shadow.records");
    rig_demo_open(&demo, renderer, "demo", 64);
    assert_int_equal(defect.stale, 0);
    assert_false(draws(renderer, &demo, VIEW_LIGHT_LISTS_CLUSTERED, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "deep under 150 lights"));
    mend_views();
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

static struct renderer_info start(enum renderer_selftest policy, const char *path,
                                  const char *build)
{
    struct error err = {0};
    struct renderer_info info;
    struct renderer *renderer =
        renderer_create(&(struct renderer_desc){.is_strict = true,
                                                .hooks.poses_as_hardware = true, /* else a start
                                                                              tests nothing */
                                                .self_test = policy,
                                                .proof_file = path,
                                                .build = build},
                        &err);
    if (!renderer)
        fail_msg("%s", err.message);
    renderer_get_info(renderer, &info);
    renderer_destroy(renderer);
    return info;
}

static uint64_t programs_of_start(enum renderer_selftest policy, const char *path,
                                  const char *build)
{
    return start(policy, path, build).programs_built;
}

static void what_was_right_is_not_tested_again(void **state)
{
    char folder[] = "/tmp/vitrail-selftest-XXXXXX", path[PATH_BYTES];
    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/proof", folder);
    uint64_t first = programs_of_start(RENDERER_SELFTEST_KEPT, path, "a");
    uint64_t again = programs_of_start(RENDERER_SELFTEST_KEPT, path, "a");
    uint64_t always = programs_of_start(RENDERER_SELFTEST_ALWAYS, path, "a");
    uint64_t after = programs_of_start(RENDERER_SELFTEST_KEPT, path, "a");
    uint64_t other = programs_of_start(RENDERER_SELFTEST_KEPT, path, "b");
    setenv("LP_OF_THE_TEST", "1", 1); /* as if it told the driver something */
    uint64_t told = programs_of_start(RENDERER_SELFTEST_KEPT, path, "b");
    unsetenv("LP_OF_THE_TEST");
    assert_true(again + 8 < first);
    assert_true(always > first);
    assert_int_equal(after, again);
    assert_int_equal(other, first);
    assert_int_equal(told, first);
    assert_int_equal(0, truncate(path, 20));
    assert_int_equal(first, programs_of_start(RENDERER_SELFTEST_KEPT, path, "b"));
    assert_int_equal(0, unlink(path));
    assert_int_equal(0, rmdir(folder));
}

/* The key under which the file was written, from its text. */
static struct content_key key_of_file(const char *path)
{
    struct content_key key = {0};
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_int_equal(
        2, fscanf(file, "vitrail-proof %*d %16" SCNx64 "%16" SCNx64, &key.words[0], &key.words[1]));
    fclose(file);
    return key;
}

/* Another form than a start takes here, written as if the start before had measured it. */
static void the_form_of_sums_is_kept_for_the_next_start(void **state)
{
    char folder[] = "/tmp/vitrail-selftest-XXXXXX", path[PATH_BYTES];
    struct error err = {0};
    struct proof proof;
    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/proof", folder);
    struct renderer_info info = start(RENDERER_SELFTEST_KEPT, path, "a");
    const struct content_key key = key_of_file(path);
    const struct wide_floats_choice chosen = info.wide_floats;
    assert_true(proof_file_load(path, key, (int64_t)time(NULL), &proof));
    assert_int_equal(chosen.form, proof.wide_floats.form);
    proof.wide_floats = (struct wide_floats_choice){
        chosen.form == WIDE_FLOATS_F64 ? WIDE_FLOATS_PAIRS_SPLIT : WIDE_FLOATS_F64, 1.5};
    assert_true(proof_file_save(path, key, &proof, &err));
    info = start(RENDERER_SELFTEST_KEPT, path, "a");
    assert_int_equal(proof.wide_floats.form, info.wide_floats.form);
    assert_true(info.wide_floats.pairs_over_f64 == 1.5);
    info = start(RENDERER_SELFTEST_ALWAYS, path, "a");
    assert_true(info.wide_floats.pairs_over_f64 != 1.5);
    assert_int_equal(0, unlink(path));
    assert_int_equal(0, rmdir(folder));
}

int main(void)
{
    struct error err = {0};
    struct renderer *renderer = renderer_create(&(struct renderer_desc){.is_strict = true}, &err);
    if (!renderer && strstr(err.message, "self-test") == NULL) {
        print_message("skipped: %s\n", err.message);
        return SKIPPED;
    }
    renderer_destroy(renderer);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(this_device_draws_right_by_every_structure),
        cmocka_unit_test(a_device_with_stale_views_is_refused),
        cmocka_unit_test(every_other_structure_is_looked_at_too),
        cmocka_unit_test(a_device_that_fails_is_passed_over_for_the_next),
        cmocka_unit_test(what_is_wrong_is_refused_and_the_rest_is_served),
        cmocka_unit_test(software_is_tested_before_its_first_picture),
        cmocka_unit_test(what_was_right_is_not_tested_again),
        cmocka_unit_test(the_form_of_sums_is_kept_for_the_next_start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
