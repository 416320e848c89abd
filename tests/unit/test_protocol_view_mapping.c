/* SPDX-License-Identifier: MIT */
/* Requests arrive in views whole; reports, scenes and devices arrive in their replies whole. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/mapping/format_mapping.h"
#include "server/mapping/scene_mapping.h"
#include "server/mapping/view_mapping.h"

#define ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
#define BODY(members) "{\"scene\":\"" ID "\"" members "}"

static struct render_request parse(const char *json)
{
    struct render_request request;
    struct error err = {0};
    if (!render_request_parse(json, strlen(json), &request, &err))
        fail_msg("%s: %s", err.pointer, err.message);
    return request;
}

static void every_member_of_a_request_reaches_the_view(void **state)
{
    (void)state;
    struct render_request request =
        parse(BODY(",\"width\":640,\"height\":360,\"camera\":{\"eye\":[10000000.25,2,3],"
                   "\"target\":[0,0,1],\"up\":[0,0,2],\"fov_y_deg\":60,\"ortho_height\":12.5},"
                   "\"lights\":[{\"type\":\"spot\",\"position\":[0,4,0.1],\"direction\":[0,-1,0],"
                   "\"color\":[1,0.5,0.25],\"intensity\":800,\"inner_cone_deg\":20,"
                   "\"outer_cone_deg\":35,\"range\":9,\"shadow\":false}],\"scene_lights\":false,"
                   "\"studio\":\"off\",\"ground_plane\":{\"height\":2.5},"
                   "\"atmosphere\":{\"density\":0.25,\"color\":[1,0.5,0.25],"
                   "\"anisotropy\":0.75,\"falloff_m\":8,\"base_m\":1},"
                   "\"overrides\":{\"nodes\":{\"N\":{\"visible\":false,"
                   "\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1]}},"
                   "\"materials\":{\"M\":{\"base_color\":[1,0,0,0.5],\"metallic\":0.25,"
                   "\"roughness\":0.5,\"emissive\":[1,2,3],\"transmission\":0.75,\"ior\":1.5,"
                   "\"thickness\":0.125,\"attenuation_color\":[0.5,0.25,0.125],"
                   "\"attenuation_distance\":2,\"alpha_mode\":\"mask\",\"pass_through\":{"
                   "\"model\":\"edge\",\"edge_color\":[0.5,0.25,1],\"edge_exponent\":3},"
                   "\"self_shadow\":false,\"cast_once\":true}}},"
                   "\"clip_planes\":[{\"plane\":[0,1,0,-2],\"shadows\":false}],\"background\":[0.5,"
                   "0.25,0.125,1],"
                   "\"environment\":{\"sky\":[1,2,3],\"ground\":[4,5,6],\"image\":\"studio\","
                   "\"rotation_deg\":45,\"intensity\":3,\"background\":true},"
                   "\"quality\":{\"shadows\":\"map\",\"transparency\":\"lists\","
                   "\"light_lists\":\"linked\",\"blend_filter\":\"kim\",\"shadow_resolution\":256,"
                   "\"shadow_taps\":9,\"samples\":1,\"faithful\":true,\"volume_map\":\"factors\","
                   "\"silhouette_form\":\"geometry\",\"environment_samples\":8,"
                   "\"environment_visibility\":\"rays\",\"refraction\":\"off\","
                   "\"refraction_samples\":6,\"atmosphere_samples\":9},"
                   "\"outputs\":[\"color\",\"node\"]"));
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_int_equal(view.width_px, 640);
    assert_int_equal(view.height_px, 360);
    assert_int_equal(view.outputs, 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_NODE);
    assert_int_equal(view.camera.kind, VIEW_CAMERA_LOOK_AT);
    assert_true(view.camera.eye[0] == 10000000.25 && view.camera.target[2] == 1);
    assert_true(view.camera.up[2] == 2 && view.camera.fov_y_deg == 60);
    assert_true(view.camera.ortho_height == 12.5);

    assert_int_equal(view.light_count, 1);
    const struct view_light *light = view.lights;
    assert_int_equal(light->type, SCENE_LIGHT_SPOT);
    assert_true(light->position[2] == 0.1 && light->direction[1] == -1);
    assert_true(light->color[2] == 0.25f && light->intensity == 800 && light->range == 9);
    assert_true(light->inner_cone_deg == 20 && light->outer_cone_deg == 35);
    assert_true(light->casts_no_shadow && view.ignore_scene_lights);
    assert_int_equal(view.studio, VIEW_STUDIO_OFF);
    assert_true(view.ground_plane.is_shown && view.ground_plane.has_height);
    assert_true(view.ground_plane.height_m == 2.5);
    assert_true(view.atmosphere.density_per_m == 0.25 && view.atmosphere.color[2] == 0.25f);
    assert_true(view.atmosphere.anisotropy == 0.75 && view.atmosphere.falloff_m == 8);
    assert_true(view.atmosphere.base_m == 1);

    assert_int_equal(view.node_override_count, 1);
    assert_string_equal(view.nodes->node, "N");
    assert_true(view.nodes->has_visible && !view.nodes->visible && view.nodes->has_matrix);
    assert_true(view.nodes->matrix[13] == 6);

    assert_int_equal(view.material_override_count, 1);
    const struct view_material_override *m = view.materials;
    assert_string_equal(m->material, "M");
    assert_true(m->has_base_color && m->base_color[3] == 0.5f);
    assert_true(m->has_metallic && m->metallic == 0.25f && m->has_emissive && m->emissive[2] == 3);
    assert_true(m->has_roughness && m->roughness == 0.5f);
    assert_true(m->has_transmission && m->transmission == 0.75f && m->has_ior && m->ior == 1.5f);
    assert_true(m->has_thickness && m->thickness == 0.125f);
    assert_true(m->has_attenuation && m->attenuation_color[2] == 0.125f);
    assert_true(m->attenuation_distance == 2);
    assert_true(m->has_alpha_mode && m->alpha_mode == SCENE_MASK);
    assert_true(m->has_pass_through && m->pass_through == SCENE_PASS_EDGE);
    assert_true(m->edge_color[2] == 1 && m->edge_exponent == 3);
    assert_true(m->has_self_shadow && !m->self_shadow && m->has_cast_once && m->cast_once);

    assert_int_equal(view.clip_plane_count, 1);
    assert_true(view.cuts[0].spares_shadows);
    assert_true(view.clip_planes[0][3] == -2 && view.background[2] == 0.125f);
    assert_true(view.has_environment && view.sky[2] == 3 && view.ground[1] == 5);
    assert_string_equal(view.environment_key, "studio");
    assert_true(view.environment_rotation_deg == 45 && view.environment_intensity == 3);
    assert_true(view.environment_is_background);
    assert_false(view_screen_from_request(&request, IMAGE_FORMAT_PNG).has_backdrop);
    assert_int_equal(view.quality.environment_samples, 8);
    assert_int_equal(view.quality.refraction, VIEW_REFRACTION_OFF);
    assert_int_equal(view.quality.refraction_samples + view.quality.atmosphere_samples, 6 + 9);
    assert_int_equal(view.quality.environment_visibility, VIEW_VISIBILITY_RAYS);
    assert_true(view.quality.shadows == SHADOWS_MAP &&
                view.quality.transparency == TRANSPARENCY_LISTS);
    assert_int_equal(view.quality.light_lists, VIEW_LIGHT_LISTS_LINKED);
    assert_int_equal(view.quality.blend_filter, VIEW_BLEND_KIM);
    assert_true(view.quality.shadow_resolution == 256 && view.quality.shadow_taps == 9 &&
                view.quality.samples == 1);
    assert_true(view.quality.faithful && view.quality.volume_map == VIEW_VOLUME_FACTORS &&
                view.quality.silhouette_form == VIEW_SILHOUETTE_GEOMETRY);
    view_storage_finish(&storage);
    render_request_finish(&request);
}

static void a_format_makes_the_view_deep(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct render_request request =
            parse(i ? BODY(",\"format\":\"exr-deep\",\"quality\":{\"shadows\":\"map\"}")
                    : BODY(",\"format\":\"exr\",\"quality\":{\"shadows\":\"map\"}"));
        struct view_storage storage;
        struct view view;
        struct error err = {0};
        assert_true(view_from_request(&request, &storage, &view, &err));
        assert_int_equal(view.wants_deep, i);
        view_storage_finish(&storage);
        render_request_finish(&request);
    }
}

/* What is said of haze that is not there makes no other view. */
static void haze_without_density_is_none(void **state)
{
    (void)state;
    struct render_request request =
        parse(BODY(",\"atmosphere\":{\"density\":0,\"anisotropy\":0.5,\"base_m\":3}"));
    struct view_atmosphere none = {0};
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_memory_equal(&view.atmosphere, &none, sizeof none);
    view_storage_finish(&storage);
    render_request_finish(&request);
}

static void what_is_said_of_deep_lists_arrives(void **state)
{
    (void)state;
    struct render_request request =
        parse(BODY(",\"quality\":{\"shadows\":\"deep\",\"shadow_compression\":0.02,"
                   "\"shadow_prefilter\":3,\"shadow_fallback\":0.05}"));
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    char *text = render_request_to_json(&request);
    render_request_finish(&request);
    assert_non_null(text);
    if (!render_request_parse(text, strlen(text), &request, &err))
        fail_msg("%s", err.message);
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_true(view.quality.shadow_compression == 0.02);
    assert_true(view.quality.shadow_error_allowed == 0.05);
    assert_int_equal(view.quality.shadow_prefilter, 3);
    free(text);
    view_storage_finish(&storage);
    render_request_finish(&request);
}

static void default_request_gives_the_default_view(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(""));
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_int_equal(view.camera.kind, VIEW_CAMERA_DEFAULT);
    assert_null(view.camera.node);
    assert_int_equal(view.light_count + view.node_override_count + view.material_override_count, 0);
    assert_false(view.ignore_scene_lights || view.has_environment);
    assert_int_equal(image_format_from_request(&request), IMAGE_FORMAT_PNG);
    struct tone_map_desc tone;
    tone_map_from_request(&request, &tone);
    assert_int_equal(tone.operator_, TONE_MAPPING_NEUTRAL);
    assert_true(tone.exposure_ev == 0);
    view_storage_finish(&storage);
    view_storage_finish(&storage);
    render_request_finish(&request);
}

static void formats_of_eight_bits_take_the_picture_of_a_screen(void **state)
{
    (void)state;
    static const struct {
        enum image_format format;
        int channels;
    } cases[] = {{IMAGE_FORMAT_PNG, 4},
                 {IMAGE_FORMAT_JPEG, 3},
                 {IMAGE_FORMAT_WEBP, 4},
                 {IMAGE_FORMAT_EXR, 0}};
    struct render_request request = parse(BODY(",\"exposure_ev\":2,\"tone_mapping\":\"none\""));
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_int_equal(0, view.screen.channels); /* what is measured is linear */
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct view_screen screen = view_screen_from_request(&request, cases[i].format);
        assert_int_equal(cases[i].channels, screen.channels);
        assert_int_equal(TONE_MAPPING_NONE, screen.mapping.operator_);
        assert_true(screen.mapping.exposure_ev == 2);
    }
    view_storage_finish(&storage);
    render_request_finish(&request);
}

/* The ends of the ranges in docs/reference/requests.md must not become inf, nor "0 means default",
 * in f32. */
static void ends_of_ranges_survive_the_way_to_f32(void **state)
{
    (void)state;
    struct render_request request = parse(
        BODY(",\"lights\":[{\"type\":\"spot\",\"position\":[0,0,0],\"direction\":[0,0,1],"
             "\"intensity\":1e12,\"outer_cone_deg\":0.001,\"range\":1e12}],"
             "\"overrides\":{\"materials\":{\"M\":{\"thickness\":1e12,\"emissive\":[1e12,0,0],"
             "\"attenuation_color\":[1,1,1],\"attenuation_distance\":1e-9,"
             "\"pass_through\":{\"model\":\"edge\",\"edge_exponent\":0.01}}}}"));
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    assert_true(view_from_request(&request, &storage, &view, &err));
    assert_true(isfinite(view.lights->intensity) && isfinite(view.lights->range));
    assert_true(view.lights->outer_cone_deg > 0);
    assert_true(isfinite(view.materials->thickness) && isfinite(view.materials->emissive[0]));
    assert_true(view.materials->attenuation_distance > 0 && view.materials->edge_exponent > 0);
    view_storage_finish(&storage);
    render_request_finish(&request);
}

static void formats_map_by_name(void **state)
{
    (void)state;
    static const char *const names[] = {"png", "jpeg", "webp", "exr"};
    for (int i = 0; i < 4; i++) {
        char json[160];
        snprintf(json, sizeof json, BODY(",\"format\":\"%s\""), names[i]);
        struct render_request request = parse(json);
        assert_int_equal(image_format_from_request(&request), IMAGE_FORMAT_PNG + i);
        render_request_finish(&request);
    }
}

/* Where each count is on both sides. */
#define COUNT(name)                                                                           \
    {                                                                                         \
        offsetof(struct frame_report, counts.name), offsetof(struct frame_stats, counts.name) \
    }
static const struct {
    size_t report, stats;
} counted[] = {
    COUNT(lights),
    COUNT(shadowed_lights),
    COUNT(unseen_lights),
    COUNT(draw_calls),
    COUNT(culled),
    COUNT(shadow_draws),
    COUNT(shadow_culled),
    COUNT(light_batches),
    COUNT(light_chunks),
    COUNT(rounds),
    COUNT(split_pixels),
    COUNT(draws),
    COUNT(triangles),
    COUNT(events),
    COUNT(longest_list),
    COUNT(lookups),
    COUNT(shadow_rays),
    COUNT(transparent_fragments),
    COUNT(longest_pixel_list),
    COUNT(peeled_layers),
    COUNT(dropped_layers),
    COUNT(light_list_entries),
    COUNT(shadow_maps_built),
    COUNT(shadow_maps_reused),
    COUNT(states_reused),
    COUNT(gbuffers_drawn),
    COUNT(gbuffers_reused),
    COUNT(light_lists_built),
    COUNT(light_lists_reused),
    COUNT(pixel_lists_built),
    COUNT(pixel_lists_reused),
    COUNT(plans_made),
    COUNT(plans_reused),
    COUNT(programs_built),
    COUNT(programs_reused),
    COUNT(programs_loaded),
};
enum { COUNTED = sizeof counted / sizeof *counted };

/* A full report: nothing overflows, everything arrives. */
static void reports_reach_the_stats_whole(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(",\"width\":64,\"height\":32"));
    struct frame_report *report = calloc(1, sizeof *report);
    struct frame_stats *stats = calloc(1, sizeof *stats);
    assert_non_null(report);
    assert_non_null(stats);
    report->pass_count = REPORT_PASSES_MAX;
    for (int i = 0; i < REPORT_PASSES_MAX; i++)
        snprintf(report->passes[i].pass, sizeof report->passes[i].pass, "pass.%d", i);
    memset(report->passes[3].because, 'b', sizeof report->passes[3].because - 1);
    strcpy(report->passes[3].technique, "deep");
    report->passes[3].ms = 4.5;
    report->stage_ms[REPORT_SHADOW] = 1;
    report->stage_ms[REPORT_LIGHT_LIST] = 2;
    report->stage_ms[REPORT_SHADE] = 3;
    report->stage_ms[REPORT_READBACK] = 4;
    report->total_ms = 11;
    report->paused_ms = 7;
    /* Each count a different number, found again under the same name. */
    for (size_t i = 0; i < COUNTED; i++)
        *(uint64_t *)((char *)report + counted[i].report) = i + 1;
    report->counts.mean_list = 2.5;
    report->compression = (struct report_compression){1, 2, 3, 4, 5, 6, 7, 0.125};
    report->textures = (struct report_textures){1, 2, 3, 4, 5, 6, 7, 8, 9, 0.5, 8.5};
    report->byte_count = REPORT_BYTES_MAX;
    strcpy(report->bytes[REPORT_BYTES_MAX - 1].structure, "scene");
    report->bytes[REPORT_BYTES_MAX - 1].bytes = 99;
    report->reused_count = REPORT_REUSED_MAX;
    strcpy(report->reused[REPORT_REUSED_MAX - 1], "shadow.deep");
    report->warning_count = REPORT_WARNINGS_MAX;
    strcpy(report->warnings[REPORT_WARNINGS_MAX - 1], "last");

    frame_stats_from_report(&request, report, "llvmpipe", stats);
    assert_string_equal(stats->scene, ID);
    assert_string_equal(stats->device, "llvmpipe");
    assert_int_equal(stats->width, 64);
    assert_int_equal(stats->height, 32);
    assert_int_equal(stats->plan_count, REPORT_PASSES_MAX);
    assert_string_equal(stats->plan[REPORT_PASSES_MAX - 1].pass, "pass.63");
    assert_string_equal(stats->plan[3].because, report->passes[3].because);
    assert_string_equal(stats->plan[3].technique, "deep");
    assert_true(stats->plan[3].ms == 4.5);
    static const double expected_ms[FRAME_TIMING_COUNT] = {0, 7, 1, 1, 2, 3, 4, 0, 0, 11};
    for (int i = 0; i < FRAME_TIMING_COUNT; i++)
        assert_true(stats->timings_ms[i] == expected_ms[i]);
    for (size_t i = 0; i < COUNTED; i++)
        assert_int_equal(*(uint64_t *)((char *)stats + counted[i].stats), i + 1);
    assert_true(stats->counts.mean_list == 2.5);
    const struct report_compression *c = &stats->compression;
    assert_true(c->maps == 1 && c->events == 2 && c->nodes == 3 && c->exact_bytes == 4);
    assert_true(c->node_bytes == 5 && c->windows == 6 && c->prefilter == 7);
    assert_true(c->max_error == 0.125);
    const struct report_textures *t = &stats->textures;
    assert_true(t->budget_bytes == 1 && t->resident_bytes == 2 && t->wanted_bytes == 3);
    assert_true(t->pending_bytes == 4 && t->written_bytes == 5 && t->coarse_count == 6);
    assert_int_equal(t->level_bias, 7);
    assert_true(t->compressed_count == 8 && t->compressed_bytes == 9);
    assert_true(t->compressed_rmse == 0.5 && t->upload_ms == 8.5);
    assert_int_equal(stats->bytes[REPORT_BYTES_MAX - 1].bytes, 99);
    assert_string_equal(stats->reused[REPORT_REUSED_MAX - 1], "shadow.deep");
    assert_int_equal(stats->warning_count, REPORT_WARNINGS_MAX);
    assert_string_equal(stats->warnings[REPORT_WARNINGS_MAX - 1], "last");
    assert_false(stats->has_error);
    free(report);
    free(stats);
    render_request_finish(&request);
}

static void exact_techniques_state_no_error(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(",\"quality\":{\"max_error\":0.01}"));
    struct frame_report report = {.error_is_exact = true};
    struct frame_stats stats;
    frame_stats_from_report(&request, &report, "d", &stats);
    assert_true(stats.has_error && stats.error_value == 0);
    assert_int_equal(stats.error_source, FRAME_ERROR_EXACT);
    assert_int_equal(stats.warning_count, 0);
    render_request_finish(&request);
}

static void what_auto_chose_is_told_by_its_technique(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(""));
    for (int i = SHADOWS_MAP; i < SHADOWS_COUNT; i++) {
        struct frame_report report = {
            .chosen = {.because = "auto", .shadows = (enum shadow_technique)i}};
        struct frame_stats stats;
        /* pieces of names tell nothing */
        report_add_pass(&report, "shadow.deep.count", "", "deep", 1, REPORT_SHADOW);
        frame_stats_from_report(&request, &report, "d", &stats);
        assert_string_equal(stats.chosen.shadows, shadow_technique_name(i));
        assert_int_equal(stats.chosen.shadow_taps > 0,
                         request.quality.shadow_taps > 0 &&
                             shadow_technique_has((enum shadow_technique)i, SHADOW_HAS_MAP));
    }
    render_request_finish(&request);
}

static void a_promise_goes_into_the_report_of_its_frame(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(""));
    struct frame_report report = {.error_is_exact = true};
    struct frame_stats stats;
    const struct frame_promise promise = {
        .chosen = {.shadows = "raytraced", .samples = 4, .expected_ms = 12},
        .has_error = true,
        .rmse = 0.25,
        .source = FRAME_ERROR_MEASURED,
        .warning = "max_error 0.1 is not kept",
    };
    frame_stats_from_report(&request, &report, "d", &stats);
    frame_stats_promise(&stats, &promise);
    assert_string_equal(stats.chosen.shadows, "raytraced");
    assert_string_equal(stats.error_metric, "rmse");
    assert_true(stats.error_value == 0.25 && stats.error_source == FRAME_ERROR_MEASURED);
    assert_int_equal(stats.warning_count, 1);
    assert_string_equal(stats.warnings[0], "max_error 0.1 is not kept");
    frame_stats_from_report(&request, &report, "d", &stats);
    frame_stats_promise(&stats, &(struct frame_promise){0});
    assert_true(stats.error_source == FRAME_ERROR_EXACT && stats.warning_count == 0);
    assert_string_equal(stats.chosen.shadows, "");
    render_request_finish(&request);
}

static void a_frame_far_beyond_what_was_expected_tells_why(void **state)
{
    (void)state;
    struct frame_stats stats = {.chosen = {.shadows = "deep", .samples = 4, .expected_ms = 48},
                                .counts = {.programs_built = 2}};
    double *took_ms = &stats.timings_ms[FRAME_TIMING_TOTAL];
    *took_ms = 71;
    frame_stats_judge(&stats, 0);
    assert_true(stats.chosen.took_ms == 71);
    assert_string_equal(stats.chosen.missed, "");
    *took_ms = 184;
    frame_stats_judge(&stats, 60);
    assert_string_equal(stats.chosen.missed,
                        "asked for 60 ms, expected 48, took 184: 2 programs were compiled");
    frame_stats_judge(&stats, 150); /* within half as much again of what was asked for */
    assert_string_equal(stats.chosen.missed, "");
    stats.counts.programs_built = 0;
    frame_stats_judge(&stats, 0);
    assert_non_null(strstr(stats.chosen.missed, "forecast was off, or the machine busy"));
    json_t *json = frame_stats_to_json(&stats);
    struct frame_stats read = {0};
    struct error err = {0};
    assert_true(json && frame_stats_from_json(json, &read, &err));
    assert_string_equal(read.chosen.missed, stats.chosen.missed);
    assert_true(read.chosen.took_ms == 184);
    json_decref(json);
    stats.chosen.expected_ms = 1;
    *took_ms = 3; /* nobody sees it */
    frame_stats_judge(&stats, 0);
    assert_string_equal(stats.chosen.missed, "");
    stats.chosen = (struct frame_stats_chosen){.expected_ms = 1};
    *took_ms = 100; /* nothing was chosen */
    frame_stats_judge(&stats, 0);
    assert_string_equal(stats.chosen.missed, "");
}

/* ---- scenes ---- */

static const char strings[] = "\0Glass\0Lamp\0Camera\0KHR_lights_punctual\0odd file\0default";
enum { GLASS = 1, LAMP = 7, CAMERA = 12, EXTENSION = 19, WARNING = 39, DEFAULT = 48 };

/* Of the scene below: a quarter turn about Y, twice as large, moved. */
static void assert_outline(const struct scene_outline *outline)
{
    assert_int_equal(outline->node_count, 3);
    const struct outline_node *mesh = &outline->nodes[1];
    assert_int_equal(outline->nodes[0].parent, -1);
    assert_int_equal(outline->nodes[2].parent, 1);
    assert_int_equal(mesh->material_count, 1); /* the default material has no name */
    assert_int_equal(mesh->materials[0], 0);
    assert_true(mesh->has_bounds && !outline->nodes[0].has_bounds);
    const double bounds[] = {4, 16, 28, 18, 24, 32};
    assert_memory_equal(mesh->bounds, bounds, sizeof bounds);
    assert_int_equal(outline->material_count, 1);
    assert_string_equal(outline->materials[0].name, "Glass");
    assert_true(outline->materials[0].base_color[2] == 0.25);
    assert_int_equal(outline->materials[0].alpha_mode, SCENE_BLEND);
    assert_int_equal(outline->light_count, 2);
    assert_int_equal(outline->lights[1].node, 2);
    assert_float_equal(outline->lights[1].outer_cone_deg, 28.6479, 1e-4);
    assert_int_equal(outline->camera_count, 1);
    assert_true(outline->cameras[0].ortho_height == 6 && outline->cameras[0].fov_y_deg == 0);
    assert_true(outline->cameras[0].aspect == 2);
    const double matrix[] = {0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 10, 20, 30, 1};
    assert_memory_equal(outline->cameras[0].matrix, matrix, sizeof matrix);
}

static void scenes_reach_their_summary(void **state)
{
    (void)state;
    struct scene_header header = {
        .size_bytes = 4096,
        .bounds_min = {-1, -2, -3},
        .bounds_max = {1, 2, 3},
        .triangle_count = 24,
    };
    const struct scene_node nodes[] = {
        {.name = LAMP, .parent = -1, .mesh = -1, .camera = -1, .light = 0},
        {.name = CAMERA,
         .mesh = 0,
         .camera = 0,
         .light = -1,
         .world_matrix = {0, 0, -2, 0, 0, 2, 0, 0, 2, 0, 0, 0, 10, 20, 30, 1}},
        {.name = LAMP, .parent = 1, .mesh = -1, .camera = -1, .light = 0},
    };
    const struct scene_material materials[] = {
        {.name = GLASS, .base_color = {1, 0.5, 0.25, 1}, .alpha_mode = SCENE_BLEND},
        {.name = DEFAULT}};
    const struct scene_mesh meshes[] = {{.primitive_count = 2}};
    const struct scene_primitive primitives[] = {
        {.material = 0, .bounds_min = {-1, -2, -3}, .bounds_max = {1, 2, 3}},
        {.material = 1, .bounds_min = {0, 0, 0}, .bounds_max = {1, 2, 4}}};
    const struct scene_light lights[] = {
        {.type = SCENE_LIGHT_SPOT, .name = LAMP, .outer_cone_rad = 0.5F}};
    const struct scene_camera cameras[] = {{.is_orthographic = 1, .x_mag = 6, .y_mag = 3}};
    const struct scene_animation animations[] = {{.name = LAMP, .duration_s = 1.5F}};
    const uint32_t extensions[] = {EXTENSION}, warnings[] = {WARNING};
    const struct scene scene = {
        .header = &header,
        .strings = strings,
        .nodes = nodes,
        .node_count = 3,
        .meshes = meshes,
        .mesh_count = 1,
        .primitives = primitives,
        .primitive_count = 2,
        .materials = materials,
        .material_count = 2,
        .texture_count = 7,
        .image_count = 8,
        .lights = lights,
        .light_count = 1,
        .cameras = cameras,
        .camera_count = 1,
        .vertex_count = 36,
        .extensions_used = extensions,
        .extension_used_count = 1,
        .warnings = warnings,
        .warning_count = 1,
        .animations = animations,
        .animation_count = 1,
    };
    struct scene_summary summary = {0};
    struct error err = {0};
    assert_true(scene_summary_from_scene(&scene, &summary, &err));
    assert_int_equal(summary.triangles, 24);
    assert_int_equal(summary.vertices, 36);
    assert_int_equal(summary.nodes, 3);
    assert_int_equal(summary.meshes, 1);
    assert_int_equal(summary.primitives, 2);
    assert_int_equal(summary.textures, 7);
    assert_int_equal(summary.images, 8);
    assert_int_equal(summary.animation_count, 1);
    assert_string_equal(summary.animations[0].name, "Lamp");
    assert_true(summary.animations[0].duration_s == 1.5);
    assert_int_equal(summary.decoded_bytes, 4096);
    assert_true(summary.has_bounds && summary.bounds_min[2] == -3 && summary.bounds_max[0] == 1);
    /* The default material of glTF belongs to no file. */
    assert_int_equal(summary.material_count, 1);
    assert_int_equal(summary.materials.count, 1);
    assert_string_equal(summary.materials.names[0], "Glass");
    /* One light record on two nodes shines twice. */
    assert_int_equal(summary.light_count, 2);
    assert_string_equal(summary.lights[1].name, "Lamp");
    assert_string_equal(summary.lights[1].type, "spot");
    assert_int_equal(summary.camera_count, 1);
    assert_string_equal(summary.cameras[0].name, "Camera");
    assert_string_equal(summary.cameras[0].type, "orthographic");
    assert_outline(&summary.outline);
    assert_int_equal(summary.node_names.count, 3);
    assert_string_equal(summary.extensions_used.names[0], "KHR_lights_punctual");
    assert_int_equal(summary.extensions_ignored.count, 0);
    assert_string_equal(summary.warnings.names[0], "odd file");
    scene_summary_finish(&summary);
}

static void long_lists_of_names_are_cut_but_counted(void **state)
{
    (void)state;
    enum { COUNT = SCENE_SUMMARY_NAMES_MAX + 5 };
    struct scene_header header = {.bounds_min = {1, 1, 1}, .bounds_max = {-1, -1, -1}};
    struct scene_node *nodes = calloc(COUNT, sizeof *nodes);
    const struct scene_material material = {.name = 0};
    const struct scene_light light = {.type = SCENE_LIGHT_POINT};
    assert_non_null(nodes);
    for (int i = 0; i < COUNT; i++)
        nodes[i] = (struct scene_node){.name = LAMP, .mesh = -1, .camera = -1, .light = 0};
    const struct scene scene = {.header = &header,
                                .strings = strings,
                                .nodes = nodes,
                                .node_count = COUNT,
                                .materials = &material,
                                .material_count = 1,
                                .lights = &light,
                                .light_count = 1};
    struct scene_summary summary = {0};
    struct error err = {0};
    assert_true(scene_summary_from_scene(&scene, &summary, &err));
    assert_int_equal(summary.nodes, COUNT);
    assert_int_equal(summary.node_names.count, SCENE_SUMMARY_NAMES_MAX);
    assert_int_equal(summary.light_count, COUNT);
    assert_int_equal(summary.light_list_count, SCENE_SUMMARY_NAMES_MAX);
    assert_false(summary.has_bounds);
    scene_summary_finish(&summary);
    free(nodes);
}

static void long_names_are_cut_at_a_character(void **state)
{
    (void)state;
    static const char euro[] = "\xE2\x82\xAC";
    char long_strings[4096] = "";
    while (strlen(long_strings) < 3000)
        strcat(long_strings, euro);
    struct scene_header header = {0};
    const struct scene_material materials[2] = {0};
    const struct scene scene = {
        .header = &header, .strings = long_strings, .materials = materials, .material_count = 2};
    struct scene_summary summary = {0};
    struct error err = {0};
    assert_true(scene_summary_from_scene(&scene, &summary, &err));
    assert_int_equal(strlen(summary.materials.names[0]), 1023);
    assert_string_equal(summary.materials.names[0] + 1020, euro);
    scene_summary_finish(&summary);
}

static void expect_vectors_of_the_processor(int bits)
{
    assert_true(bits == 128 || bits == 256 || bits == 512);
#ifdef __x86_64__
    assert_true(bits < 256 || __builtin_cpu_supports("avx2"));
    assert_true(bits < 512 || __builtin_cpu_supports("avx512bw"));
#endif
}

static void device_info_reaches_the_capabilities(void **state)
{
    (void)state;
    struct renderer_info info = {.vendor = "Mesa",
                                 .renderer = "llvmpipe",
                                 .version = "4.5",
                                 .driver = "surfaceless",
                                 .device_count = 2,
                                 .max_texture_size = 16384,
                                 .max_samples = 4,
                                 .max_storage_block_bytes = 1,
                                 .has_true_timers = true,
                                 .is_robust = true,
                                 .program_formats = 1,
                                 .wide_floats = {WIDE_FLOATS_PAIRS_SPLIT, 0.5},
                                 .budget_bytes = 3,
                                 .used_bytes = 2,
                                 .compresses_textures = true,
                                 .upload_bytes_per_ms = 4};
    struct device_capabilities device;
    device_capabilities_from_info(&info, &device);
    assert_string_equal(device.vendor, "Mesa");
    assert_string_equal(device.renderer, "llvmpipe");
    assert_string_equal(device.version, "4.5");
    assert_string_equal(device.driver, "surfaceless");
    assert_int_equal(device.device_count, 2);
    assert_int_equal(device.max_texture_size, 16384);
    assert_int_equal(device.max_samples, 4);
    assert_int_equal(device.max_storage_block_bytes, 1);
    expect_vectors_of_the_processor(device.vector_bits);
    assert_int_equal(device.gpu_budget_bytes, 3);
    assert_int_equal(device.gpu_used_bytes, 2);
    assert_int_equal(device.upload_bytes_per_ms, 4);
    assert_true(device.compresses_textures);
    assert_true(device.has_true_timers && device.is_robust && !device.has_post_depth_coverage);
    assert_true(device.has_program_binaries);
    assert_string_equal(device.wide_floats, "pairs-split");
    assert_true(device.pairs_over_f64 == 0.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_member_of_a_request_reaches_the_view),
        cmocka_unit_test(a_format_makes_the_view_deep),
        cmocka_unit_test(haze_without_density_is_none),
        cmocka_unit_test(what_is_said_of_deep_lists_arrives),
        cmocka_unit_test(default_request_gives_the_default_view),
        cmocka_unit_test(formats_of_eight_bits_take_the_picture_of_a_screen),
        cmocka_unit_test(ends_of_ranges_survive_the_way_to_f32),
        cmocka_unit_test(formats_map_by_name),
        cmocka_unit_test(reports_reach_the_stats_whole),
        cmocka_unit_test(exact_techniques_state_no_error),
        cmocka_unit_test(what_auto_chose_is_told_by_its_technique),
        cmocka_unit_test(a_promise_goes_into_the_report_of_its_frame),
        cmocka_unit_test(a_frame_far_beyond_what_was_expected_tells_why),
        cmocka_unit_test(scenes_reach_their_summary),
        cmocka_unit_test(long_lists_of_names_are_cut_but_counted),
        cmocka_unit_test(long_names_are_cut_at_a_character),
        cmocka_unit_test(device_info_reaches_the_capabilities),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
