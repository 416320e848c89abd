/* SPDX-License-Identifier: MIT */
/* Which settings a trade-off measures: server/tradeoffs/tradeoff_sweep, with and without media. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/quality_defaults.h"
#include "server/tradeoffs/tradeoff_sweep.h"

struct swept {
    struct quality_setting settings[TRADEOFF_ROWS_MAX];
    int count;
    struct tradeoff tradeoff;
    struct request_quality fixed;
};

/* On the heap; nothing is said of quality, and a light shines through glass. */
static int create(void **state)
{
    struct render_request request;
    struct swept *swept = calloc(1, sizeof *swept);
    assert_non_null(swept);
    render_request_init_defaults(&request);
    swept->fixed = request.quality;
    render_request_finish(&request);
    *state = swept;
    return 0;
}

static int destroy(void **state)
{
    free(*state);
    return 0;
}

static struct sweep_desc desc_of(const struct swept *swept, unsigned needs, int max_settings)
{
    return (struct sweep_desc){.fixed = &swept->fixed,
                               .has_shadows = true,
                               .has_transparent_casters = true,
                               .has_lights = true,
                               .needs = needs,
                               .max_samples = 4,
                               .reference_samples = 16,
                               .max_settings = max_settings};
}

static void sweep(struct swept *swept, const struct sweep_desc *desc)
{
    memset(&swept->tradeoff, 0, sizeof swept->tradeoff);
    swept->count = tradeoff_sweep(desc, swept->settings, &swept->tradeoff);
}

static bool is_same(const struct quality_setting *a, const struct quality_setting *b)
{
    return a->shadows == b->shadows && a->samples == b->samples &&
           a->shadow_resolution == b->shadow_resolution && a->shadow_taps == b->shadow_taps &&
           a->shadow_compression == b->shadow_compression &&
           a->shadow_prefilter == b->shadow_prefilter &&
           a->atmosphere_samples == b->atmosphere_samples && a->transparency == b->transparency;
}

static int find(const struct swept *swept, struct quality_setting wanted)
{
    for (int i = 0; i < swept->count; i++)
        if (is_same(&swept->settings[i], &wanted))
            return i;
    return -1;
}

static const struct quality_setting usual = {.shadows = SHADOWS_DEEP,
                                             .shadow_resolution = SHADOW_RESOLUTION_DEFAULT,
                                             .shadow_taps = SHADOW_TAPS_DEFAULT,
                                             .samples = 4,
                                             .shadow_prefilter = 1};

static struct quality_setting in_media(struct quality_setting setting, int atmosphere_samples)
{
    setting.atmosphere_samples = atmosphere_samples;
    return setting;
}

static void without_media_nothing_of_them_is_swept(void **state)
{
    struct swept *swept = *state, *said = NULL;
    const struct sweep_desc desc = desc_of(swept, 0, TRADEOFF_ROWS_MAX);
    sweep(swept, &desc);
    assert_int_equal(find(swept, usual), 0);
    for (int i = 0; i < swept->count; i++)
        assert_int_equal(swept->settings[i].atmosphere_samples, 0);
    said = malloc(sizeof *said); /* what is said of them changes nothing there */
    assert_non_null(said);
    *said = *swept;
    swept->fixed.atmosphere_samples = 16;
    sweep(swept, &desc);
    assert_int_equal(swept->count, said->count);
    for (int i = 0; i < swept->count; i++)
        assert_true(is_same(&swept->settings[i], &said->settings[i]));
    free(said);
}

static void haze_adds_fewer_and_more_slices_near_the_default(void **state)
{
    struct swept *swept = *state;
    const struct sweep_desc desc = desc_of(swept, SHADOW_CAN_ATMOSPHERE, 32);
    const struct quality_setting rays = {.shadows = SHADOWS_RAYTRACED, .samples = 4};
    sweep(swept, &desc);
    assert_int_equal(swept->count, 32);
    assert_int_equal(find(swept, usual), 0);
    assert_true(find(swept, in_media(usual, 16)) > 0);
    assert_true(find(swept, in_media(usual, 256)) > find(swept, in_media(usual, 16)));
    assert_true(find(swept, rays) > 0);
    assert_true(find(swept, in_media(rays, 16)) > 0 && find(swept, in_media(rays, 256)) > 0);
    for (int i = 0; i < swept->count; i++)
        assert_true(shadow_technique_can(swept->settings[i].shadows, SHADOW_CAN_ATMOSPHERE));
}

/* Each setting without media stays, and is there with fewer and with more. */
static void all_settings_have_the_axis(void **state)
{
    struct swept *swept = *state;
    swept->fixed.shadows = SHADOWS_DEEP;
    struct sweep_desc desc = desc_of(swept, SHADOW_CAN_ATMOSPHERE, TRADEOFF_ROWS_MAX);
    swept->fixed.shadow_taps = 4;
    swept->fixed.says_shadow_taps = true;
    sweep(swept, &desc);
    int hazy = swept->count, defaults = 0;
    for (int i = 0; i < hazy; i++)
        if (!swept->settings[i].atmosphere_samples) {
            defaults++;
            assert_true(find(swept, in_media(swept->settings[i], 16)) >= 0);
            assert_true(find(swept, in_media(swept->settings[i], 256)) >= 0);
        }
    assert_int_equal(3 * defaults, hazy);
    desc.needs = 0;
    sweep(swept, &desc);
    assert_int_equal(swept->count, defaults);
}

static void rays_in_smoke_take_points(void **state)
{
    struct swept *swept = *state;
    swept->fixed.shadows = SHADOWS_RAYTRACED;
    const struct quality_setting rays = {.shadows = SHADOWS_RAYTRACED, .samples = 4};
    struct sweep_desc desc = desc_of(swept, SHADOW_CAN_GRIDS, TRADEOFF_ROWS_MAX);
    sweep(swept, &desc);
    assert_true(find(swept, rays) >= 0 && find(swept, in_media(rays, 4)) >= 0 &&
                find(swept, in_media(rays, 32)) >= 0);
    desc.needs |= SHADOW_CAN_ATMOSPHERE;
    sweep(swept, &desc);
    assert_true(find(swept, in_media(rays, 16)) >= 0 && find(swept, in_media(rays, 64)) >= 0);
    swept->fixed.shadows = SHADOWS_DEEP; /* whose nodes are cells of columns in both */
    sweep(swept, &desc);
    assert_true(find(swept, in_media(usual, 16)) >= 0 && find(swept, in_media(usual, 256)) >= 0);
}

static void what_was_said_is_held_fixed_and_told(void **state)
{
    struct swept *swept = *state;
    const struct sweep_desc desc = desc_of(swept, SHADOW_CAN_ATMOSPHERE, TRADEOFF_ROWS_MAX);
    swept->fixed.atmosphere_samples = 48;
    sweep(swept, &desc);
    assert_int_equal(find(swept, in_media(usual, 48)), 0);
    for (int i = 0; i < swept->count; i++)
        assert_int_equal(swept->settings[i].atmosphere_samples, 48);
}

static void without_a_light_there_is_nothing_to_find(void **state)
{
    struct swept *swept = *state;
    struct sweep_desc desc = desc_of(swept, SHADOW_CAN_ATMOSPHERE, TRADEOFF_ROWS_MAX);
    desc.has_shadows = desc.has_lights = false;
    bool is_told = false;
    sweep(swept, &desc);
    for (int i = 0; i < swept->count; i++)
        assert_int_equal(swept->settings[i].atmosphere_samples, 0);
    for (int i = 0; i < swept->tradeoff.skip_count; i++)
        is_told |= strcmp(swept->tradeoff.skips[i].what, "atmosphere_samples") == 0;
    assert_true(is_told);
}

static struct quality_setting drawn_by(struct quality_setting setting, enum transparency method)
{
    setting.transparency = method;
    return setting;
}

static int count_methods(const struct swept *swept)
{
    int count = 0;
    for (int i = 0; i < swept->count; i++)
        count += swept->settings[i].transparency != TRANSPARENCY_AUTO;
    return count;
}

static void transparent_surfaces_are_drawn_by_each_method_once(void **state)
{
    struct swept *swept = *state;
    struct sweep_desc desc = desc_of(swept, 0, TRADEOFF_ROWS_MAX);
    sweep(swept, &desc);
    assert_int_equal(count_methods(swept), 0); /* none is in view */
    desc.has_layers = true;
    sweep(swept, &desc);
    assert_int_equal(find(swept, usual), 0);
    for (int i = TRANSPARENCY_LISTS + 1; i < TRANSPARENCIES_COUNT; i++)
        assert_true(find(swept, drawn_by(usual, (enum transparency)i)) > 0);
    assert_int_equal(count_methods(swept), TRANSPARENCIES_COUNT - TRANSPARENCY_LISTS - 1);
}

static void methods_that_cannot_draw_the_view_are_left_out(void **state)
{
    struct swept *swept = *state;
    struct sweep_desc desc = desc_of(swept, 0, TRADEOFF_ROWS_MAX);
    const struct quality_setting traced = {.shadows = SHADOWS_RAYTRACED_SHADOWS, .samples = 4};
    desc.has_layers = true;
    desc.layer_needs = TRANSPARENCY_CAN_MEDIA;
    sweep(swept, &desc);
    assert_int_equal(count_methods(swept), 0);
    desc.layer_needs = TRANSPARENCY_CAN_OUTPUTS;
    sweep(swept, &desc);
    assert_true(find(swept, drawn_by(usual, TRANSPARENCY_MOMENT_BASED)) > 0);
    assert_int_equal(find(swept, drawn_by(usual, TRANSPARENCY_DEPTH_PEELING)), -1);
    desc.layer_needs = 0;
    swept->fixed.shadows = SHADOWS_RAYTRACED_SHADOWS;
    sweep(swept, &desc);
    assert_true(find(swept, drawn_by(traced, TRANSPARENCY_SORTED)) > 0);
    assert_int_equal(find(swept, drawn_by(traced, TRANSPARENCY_DEPTH_PEELING)), -1);
    swept->fixed.shadows = SHADOWS_RAYTRACED; /* draws all layers itself */
    sweep(swept, &desc);
    assert_int_equal(count_methods(swept), 0);
    swept->fixed.shadows = SHADOWS_AUTO;
    swept->fixed.transparency = TRANSPARENCY_SORTED; /* said, so that all settings have it */
    sweep(swept, &desc);
    assert_int_equal(count_methods(swept), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(without_media_nothing_of_them_is_swept, create, destroy),
        cmocka_unit_test_setup_teardown(haze_adds_fewer_and_more_slices_near_the_default, create,
                                        destroy),
        cmocka_unit_test_setup_teardown(all_settings_have_the_axis, create, destroy),
        cmocka_unit_test_setup_teardown(rays_in_smoke_take_points, create, destroy),
        cmocka_unit_test_setup_teardown(what_was_said_is_held_fixed_and_told, create, destroy),
        cmocka_unit_test_setup_teardown(transparent_surfaces_are_drawn_by_each_method_once, create,
                                        destroy),
        cmocka_unit_test_setup_teardown(methods_that_cannot_draw_the_view_are_left_out, create,
                                        destroy),
        cmocka_unit_test_setup_teardown(without_a_light_there_is_nothing_to_find, create, destroy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
