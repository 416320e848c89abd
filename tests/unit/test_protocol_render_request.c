/* SPDX-License-Identifier: MIT */
/* Good render requests: defaults, every member, and canonical JSON that reads back as itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "protocol/limits.h"
#include "protocol/render_request.h"

#define ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
#define BODY(members) "{\"scene\":\"" ID "\"" members "}"

static struct render_request parse(const char *json)
{
    struct render_request request;
    struct error err = {0};
    if (!render_request_parse(json, strlen(json), &request, &err))
        fail_msg("%s\n  refused at '%s': %s", json, err.pointer, err.message);
    return request;
}

/* Every member, with values that are not the defaults. */
static const char full[] = BODY(
    ",\"width\":640,\"height\":360,"
    "\"camera\":{\"eye\":[10000000.25,2,3],\"target\":[0.1,0,-1e-3],\"up\":[0,0,2],"
    "\"fov_y_deg\":60,\"ortho_height\":12.5},"
    "\"lights\":[{\"type\":\"spot\",\"position\":[0,4,0],\"direction\":[0,-1,0],"
    "\"color\":[1,0.5,0.25],\"intensity\":800,\"inner_cone_deg\":20,\"outer_cone_deg\":35,"
    "\"range\":9,\"shadow\":false},"
    "{\"type\":\"directional\",\"direction\":[1,-2,3],\"intensity\":3},"
    "{\"type\":\"point\",\"position\":[1,2,3]},"
    "{\"type\":\"rect\",\"position\":[1,2,3],\"direction\":[0,0,1],\"width\":0.5,\"height\":0.25,"
    "\"up\":[1,0,0]},"
    "{\"type\":\"disk\",\"position\":[1,2,3],\"direction\":[0,0,1],\"radius\":0.75}],"
    "\"scene_lights\":false,\"studio\":\"on\",\"ground_plane\":{\"height\":-0.25},"
    "\"atmosphere\":{\"density\":0.05,\"color\":[1,0.5,0.1],\"anisotropy\":-0.3,"
    "\"falloff_m\":12,\"base_m\":-2.5},"
    "\"overrides\":{\"nodes\":{\"Z\":{\"visible\":true},\"Curtain\":{\"visible\":false,"
    "\"matrix\":[2,0,0,0,0,3,0,0,0,0,-4,0,5,6,7,1]}},"
    "\"materials\":{\"Glass \\u00e9/~\":{\"base_color\":[1,0,0,0.4],\"metallic\":0.1,"
    "\"roughness\":0.2,\"emissive\":[1,2,3],\"transmission\":0.9,\"ior\":1.33,\"thickness\":0.01,"
    "\"attenuation_color\":[0.1,0.2,0.3],\"attenuation_distance\":0.5,\"alpha_mode\":\"blend\","
    "\"pass_through\":{\"model\":\"edge\",\"edge_color\":[0.5,0.6,0.7],\"edge_exponent\":3},"
    "\"self_shadow\":false,\"cast_once\":true}},"
    "\"grids\":{\"Smoke\":{\"density\":2.5,\"extinction\":[1,2,3],\"color\":[0.5,0.25,1],"
    "\"anisotropy\":-0.75},\"Fog\":{\"density\":0}}},"
    "\"clip_planes\":[{\"plane\":[0,1,0,-2],\"cap\":[1,0.5,0]},{\"plane\":[1,0,0,3],\"shadows\":"
    "false}],"
    "\"highlight\":{\"nodes\":[\"Door\",\"#3\"],\"color\":[0,1,0.5],\"width_px\":4,\"hidden\":0.25}"
    ","
    "\"edges\":{\"crease_deg\":20,\"borders\":false,\"color\":[1,0,0],\"hidden\":0.5},"
    "\"background\":[0.1,0.2,"
    "0.3,1],\"exposure_ev\":-1.5,"
    "\"tone_mapping\":\"none\",\"environment\":{\"sky\":[1,2,3],\"ground\":[4,5,6],"
    "\"image\":\"" ID "\",\"rotation_deg\":-30,\"intensity\":2.5,\"background\":true},"
    "\"quality\":{\"shadows\":\"deep-linked\",\"transparency\":\"lists\","
    "\"light_lists\":\"linked\",\"blend_filter\":\"kim\",\"shadow_resolution\":2048,"
    "\"volume_map\":\"factors\",\"silhouette_form\":\"triangles-one-pass\","
    "\"shadow_taps\":9,\"samples\":1,\"faithful\":true,"
    "\"area_samples\":64,\"environment_samples\":32,\"atmosphere_samples\":33,\"environment_"
    "visibility\":\"rays\","
    "\"refraction\":\"off\",\"refraction_samples\":24,\"max_error\":0.01,\"budget_ms\":250},"
    "\"outputs\":[\"depth\",\"color\"],\"format\":\"exr\"");

static void scene_alone_gives_the_documented_defaults(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(""));
    assert_string_equal(request.scene, ID);
    assert_int_equal(request.width, 1280);
    assert_int_equal(request.height, 720);
    assert_int_equal(request.camera.kind, REQUEST_CAMERA_DEFAULT);
    assert_int_equal(request.light_count + request.node_count + request.material_count, 0);
    assert_false(request.ignore_scene_lights);
    assert_int_equal(request.studio, REQUEST_STUDIO_AUTO);
    assert_false(request.ground_plane.is_given);
    assert_false(request.atmosphere.is_given);
    assert_false(request.has_environment);
    assert_int_equal(request.clip_plane_count, 0);
    assert_true(request.background[3] == 0);
    assert_true(request.exposure_ev == 0);
    assert_int_equal(request.tone_mapping, REQUEST_TONE_NEUTRAL);
    assert_int_equal(request.quality.shadows, SHADOWS_AUTO);
    assert_int_equal(request.quality.blend_filter, REQUEST_BLEND_TINT);
    assert_true(request.quality.shadow_compression == 0 && request.quality.shadow_fallback == 0);
    assert_int_equal(request.quality.shadow_prefilter, 1);
    assert_int_equal(request.quality.shadow_resolution, 1024);
    assert_int_equal(request.quality.shadow_taps, 4);
    assert_int_equal(request.quality.samples, 0);
    assert_int_equal(request.outputs, 1u << REQUEST_OUTPUT_COLOR);
    assert_int_equal(request.format, REQUEST_FORMAT_ANY);
    render_request_finish(&request);
}

static void null_is_the_same_as_absent(void **state)
{
    (void)state;
    static const char *const members[] = {
        "width",        "height",          "camera",       "lights",     "scene_lights",
        "overrides",    "clip_planes",     "animation",    "background", "exposure_ev",
        "tone_mapping", "environment",     "quality",      "output",     "outputs",
        "format",       "quality_percent", "highlight",    "edges",      "parts",
        "variant",      "studio",          "ground_plane", "tile",       "atmosphere"};
    struct render_request plain = parse(BODY(""));
    char *expected = render_request_to_json(&plain);
    for (size_t i = 0; i < sizeof members / sizeof *members; i++) {
        char json[256];
        snprintf(json, sizeof json, BODY(",\"%s\":null"), members[i]);
        struct render_request request = parse(json);
        char *text = render_request_to_json(&request);
        assert_string_equal(text, expected);
        free(text);
        render_request_finish(&request);
    }
    free(expected);
    render_request_finish(&plain);
}

static void nulls_inside_members_are_absent_too(void **state)
{
    (void)state;
    struct render_request request =
        parse(BODY(",\"camera\":{\"node\":null,\"fit\":\"iso\",\"fov_y_deg\":null},"
                   "\"quality\":{\"shadows\":null,\"max_error\":null,\"budget_ms\":null},"
                   "\"overrides\":{\"nodes\":{\"A\":null,\"B\":{\"visible\":null}}}"));
    assert_int_equal(request.camera.kind, REQUEST_CAMERA_FIT);
    assert_int_equal(request.camera.fit, REQUEST_FIT_ISO);
    assert_int_equal(request.node_count, 1);
    assert_string_equal(request.nodes[0].node, "B");
    assert_false(request.nodes[0].has_visible);
    render_request_finish(&request);
}

static void camera_light_and_picture_members_arrive(void **state)
{
    (void)state;
    struct render_request r = parse(full);
    assert_int_equal(r.camera.kind, REQUEST_CAMERA_LOOK_AT);
    assert_true(r.camera.eye[0] == 10000000.25 && r.camera.target[2] == -1e-3);
    assert_true(r.camera.up[2] == 2 && r.camera.fov_y_deg == 60 && r.camera.ortho_height == 12.5);
    assert_int_equal(r.light_count, 5);
    assert_int_equal(r.lights[0].type, REQUEST_LIGHT_SPOT);
    assert_true(r.lights[0].color[1] == 0.5 && r.lights[0].intensity == 800);
    assert_true(r.lights[0].inner_cone_deg == 20 && r.lights[0].outer_cone_deg == 35);
    assert_true(r.lights[0].range == 9 && r.lights[0].casts_no_shadow);
    assert_int_equal(r.lights[1].type, REQUEST_LIGHT_DIRECTIONAL);
    assert_true(r.lights[1].direction[1] == -2 && !r.lights[1].casts_no_shadow);
    assert_int_equal(r.lights[2].type, REQUEST_LIGHT_POINT);
    assert_int_equal(r.lights[3].type, REQUEST_LIGHT_RECT);
    assert_true(r.lights[3].width == 0.5 && r.lights[3].height == 0.25 && r.lights[3].up[0] == 1);
    assert_int_equal(r.lights[4].type, REQUEST_LIGHT_DISK);
    assert_true(r.lights[4].radius == 0.75);
    assert_true(r.lights[2].position[2] == 3 && r.lights[2].intensity == 1);
    assert_true(r.ignore_scene_lights);
    assert_int_equal(r.studio, REQUEST_STUDIO_ON);
    assert_true(r.ground_plane.is_given && r.ground_plane.has_height);
    assert_true(r.ground_plane.height == -0.25);
    assert_true(r.atmosphere.is_given && r.atmosphere.density == 0.05);
    assert_true(r.atmosphere.color[2] == 0.1 && r.atmosphere.anisotropy == -0.3);
    assert_true(r.atmosphere.falloff == 12 && r.atmosphere.base == -2.5);
    assert_int_equal(r.clip_plane_count, 2);
    assert_true(r.clip_planes[0][3] == -2 && r.clip_planes[1][0] == 1);
    assert_true(!r.cuts[0].spares_shadows && r.cuts[1].spares_shadows);
    assert_true(r.cuts[0].has_cap && r.cuts[0].cap_color[1] == 0.5 && !r.cuts[1].has_cap);
    assert_int_equal(r.highlight.node_count, 2);
    assert_string_equal(r.highlight.nodes[1], "#3");
    assert_true(r.highlight.width_px == 4 && r.highlight.hidden == 0.25);
    assert_true(r.edges.is_given && r.edges.crease_deg == 20 && r.edges.omits_borders);
    assert_true(!r.edges.omits_silhouettes && r.edges.width_px == 1 && r.edges.hidden == 0.5);
    assert_true(r.background[2] == 0.3 && r.exposure_ev == -1.5);
    assert_int_equal(r.tone_mapping, REQUEST_TONE_NONE);
    assert_true(r.has_environment && r.sky[2] == 3 && r.ground[0] == 4);
    assert_string_equal(r.environment.image, ID);
    assert_true(r.environment.rotation_deg == -30 && r.environment.intensity == 2.5);
    assert_true(r.environment.is_background);
    assert_int_equal(r.outputs, 1u << REQUEST_OUTPUT_COLOR | 1u << REQUEST_OUTPUT_DEPTH);
    assert_int_equal(r.format, REQUEST_FORMAT_EXR);
    render_request_finish(&r);
}

/* The canonical text of a request, parsed again. */
static void cameras_that_look_straight_up_or_down_have_an_up(void **state)
{
    (void)state;
    static const struct {
        const char *camera;
        double up[3];
    } cases[] = {
        {"{\"eye\":[0,5,0],\"target\":[0,0,0]}", {0, 0, -1}},
        {"{\"eye\":[3,-5,2],\"target\":[3,7,2]}", {0, 0, 1}},
        {"{\"eye\":[0,5,1],\"target\":[0,0,0]}", {0, 1, 0}},
        {"{\"eye\":[0,5,0],\"target\":[0,0,0],\"up\":[1,0,0]}", {1, 0, 0}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[256];
        snprintf(text, sizeof text, "{\"scene\":\"%064d\",\"camera\":%s}", 0, cases[i].camera);
        struct render_request request = parse(text);
        assert_memory_equal(request.camera.up, cases[i].up, sizeof cases[i].up);
        char *canonical = render_request_to_json(&request);
        render_request_finish(&request);
        assert_non_null(canonical);
        assert_int_equal(strstr(canonical, "\"up\"") != NULL, i > 1);
        request = parse(canonical);
        assert_memory_equal(request.camera.up, cases[i].up, sizeof cases[i].up);
        render_request_finish(&request);
        free(canonical);
    }
}

static void a_background_of_three_numbers_is_opaque(void **state)
{
    (void)state;
    char text[160];
    snprintf(text, sizeof text, "{\"scene\":\"%064d\",\"background\":[1,0.5,0]}", 0);
    struct render_request request = parse(text);
    assert_true(request.background[0] == 1 && request.background[1] == 0.5);
    assert_true(request.background[2] == 0 && request.background[3] == 1);
    render_request_finish(&request);
}

static void override_and_quality_members_arrive(void **state)
{
    (void)state;
    struct render_request r = parse(full);
    assert_int_equal(r.node_count, 2);
    assert_string_equal(r.nodes[0].node, "Curtain");
    assert_true(r.nodes[0].has_visible && !r.nodes[0].visible && r.nodes[0].has_matrix);
    assert_true(r.nodes[0].matrix[10] == -4 && r.nodes[0].matrix[13] == 6);
    assert_true(r.nodes[1].has_visible && r.nodes[1].visible && !r.nodes[1].has_matrix);
    assert_int_equal(r.material_count, 1);
    const struct request_material_override *m = &r.materials[0];
    assert_string_equal(m->material, "Glass \xC3\xA9/~");
    assert_true(m->has_base_color && m->base_color[3] == 0.4);
    assert_true(m->has_metallic && m->metallic == 0.1 && m->has_roughness && m->roughness == 0.2);
    assert_true(m->has_emissive && m->emissive[2] == 3);
    assert_true(m->has_transmission && m->transmission == 0.9 && m->has_ior && m->ior == 1.33);
    assert_true(m->has_thickness && m->thickness == 0.01);
    assert_true(m->has_attenuation && m->attenuation_color[1] == 0.2);
    assert_true(m->attenuation_distance == 0.5);
    assert_true(m->has_alpha_mode && m->alpha_mode == REQUEST_ALPHA_BLEND);
    assert_true(m->has_pass_through && m->pass_through == REQUEST_PASS_EDGE);
    assert_true(m->edge_color[2] == 0.7 && m->edge_exponent == 3);
    assert_true(m->has_self_shadow && !m->self_shadow && m->has_cast_once && m->cast_once);
    const struct request_quality *q = &r.quality;
    assert_int_equal(q->shadows, SHADOWS_DEEP_LINKED);
    assert_int_equal(q->transparency, TRANSPARENCY_LISTS);
    assert_int_equal(q->light_lists, REQUEST_LIGHT_LISTS_LINKED);
    assert_int_equal(q->blend_filter, REQUEST_BLEND_KIM);
    assert_int_equal(q->volume_map, REQUEST_VOLUME_FACTORS);
    assert_int_equal(q->silhouette_form, REQUEST_SILHOUETTE_TRIANGLES_ONE_PASS);
    assert_int_equal(q->shadow_resolution, 2048);
    assert_int_equal(q->shadow_taps, 9);
    assert_int_equal(q->samples, 1);
    assert_true(!q->reference && q->area_samples == 64);
    assert_int_equal(q->environment_samples, 32);
    assert_int_equal(q->atmosphere_samples, 33);
    assert_int_equal(q->refraction, REQUEST_REFRACTION_OFF);
    assert_int_equal(q->refraction_samples, 24);
    assert_int_equal(q->environment_visibility, REQUEST_VISIBILITY_RAYS);
    assert_true(q->faithful && q->max_error == 0.01 && q->budget_ms == 250);
    render_request_finish(&r);
}

static void canonical_json_reads_back_as_itself(void **state)
{
    (void)state;
    static const char *const bodies[] = {
        full,
        BODY(""),
        BODY(",\"camera\":{\"node\":\"Cam #1\"},\"format\":\"png\",\"output\":\"normal\""),
        BODY(",\"camera\":{\"fit\":\"top\",\"ortho_height\":3}"),
        BODY(",\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,1e7,-0.1,3.3333333333333335,1]}"),
        BODY(",\"camera\":{\"fov_y_deg\":178.999}"),
        BODY(",\"camera\":{\"eye\":[0,0,5],\"target\":[0,0,0]}"),
        BODY(",\"format\":\"jpeg\",\"quality_percent\":75"),
        BODY(",\"width\":40000,\"tile\":{\"x\":39999,\"width\":1,\"height\":2}"),
        BODY(",\"format\":\"webp\",\"environment\":{}"),
        BODY(",\"environment\":{\"image\":\"studio\",\"rotation_deg\":360}"),
        BODY(",\"outputs\":[\"color\",\"depth\",\"normal\",\"albedo\",\"node\",\"material\"]"),
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct render_request first = parse(bodies[i]);
        char *text = render_request_to_json(&first);
        assert_non_null(text);
        struct render_request second = parse(text);
        char *again = render_request_to_json(&second);
        assert_string_equal(again, text);
        assert_memory_equal(&second.camera.eye, &first.camera.eye, sizeof first.camera.eye);
        assert_memory_equal(second.camera.matrix, first.camera.matrix, sizeof first.camera.matrix);
        assert_memory_equal(&second.quality, &first.quality, sizeof first.quality);
        free(text);
        free(again);
        render_request_finish(&first);
        render_request_finish(&second);
    }
}

static void a_map_is_needed_unless_it_is_built_in(void **state)
{
    (void)state;
    static const struct {
        const char *body, *image;
        bool is_uploaded;
    } rows[] = {
        {BODY(""), "", false},
        {BODY(",\"environment\":{\"sky\":[1,1,1]}"), "", false},
        {BODY(",\"environment\":{\"image\":null,\"rotation_deg\":5}"), "", false},
        {BODY(",\"environment\":{\"image\":\"studio\"}"), "studio", false},
        {BODY(",\"environment\":{\"image\":\"" ID "\"}"), ID, true},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct render_request request = parse(rows[i].body);
        struct request_resources resources;
        assert_true(render_request_resources(&request, &resources));
        assert_string_equal(rows[i].image, request.environment.image);
        assert_string_equal(rows[i].image, resources.environment);
        assert_int_equal(rows[i].is_uploaded,
                         request_environment_is_uploaded(resources.environment));
        assert_true(request.environment.intensity == 1);
        render_request_finish(&request);
    }
}

static void an_exposure_may_be_metered(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(",\"exposure_ev\":\"auto\""));
    assert_true(request.meters_exposure && request.exposure_ev == 0);
    char *text = render_request_to_json(&request);
    assert_non_null(strstr(text, "\"exposure_ev\":\"auto\""));
    render_request_finish(&request);
    request = parse(text);
    assert_true(request.meters_exposure);
    render_request_finish(&request);
    free(text);
    request = parse(BODY(",\"exposure_ev\":null"));
    assert_false(request.meters_exposure);
    render_request_finish(&request);
}

static void canonical_json_does_not_depend_on_how_it_was_said(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {BODY(",\"width\":64,\"height\":32"),
         "{\"height\":32.0,\"width\":6.4e1, \"scene\" : \"" ID "\"}"},
        {BODY(",\"outputs\":[\"color\",\"depth\"]"), BODY(",\"outputs\":[\"depth\",\"color\"]")},
        {BODY(",\"output\":\"depth\""), BODY(",\"outputs\":[\"depth\"]")},
        {BODY(",\"exposure_ev\":0"), BODY(",\"exposure_ev\":-0.0")},
        {BODY(",\"quality\":{}"), BODY(",\"quality\":{\"shadow_resolution\":1024}")},
        {BODY(",\"overrides\":{\"nodes\":{\"a\":{},\"b\":{}}}"),
         BODY(",\"overrides\":{\"nodes\":{\"b\":{},\"a\":{}}}")},
        {BODY(",\"overrides\":{\"materials\":{\"\\u0061\":{},\"b\":{}}}"),
         BODY(",\"overrides\":{\"materials\":{\"b\":{},\"a\":{}},\"nodes\":{}}")},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        struct render_request a = parse(pairs[i][0]), b = parse(pairs[i][1]);
        char *text_a = render_request_to_json(&a), *text_b = render_request_to_json(&b);
        assert_string_equal(text_a, text_b);
        free(text_a);
        free(text_b);
        render_request_finish(&a);
        render_request_finish(&b);
    }
}

static void outputs_without_a_format_leave_it_to_accept(void **state)
{
    (void)state;
    struct render_request request = parse(BODY(",\"outputs\":[\"color\",\"depth\"]"));
    assert_int_equal(request.format, REQUEST_FORMAT_ANY);
    render_request_finish(&request);
    request = parse(BODY(",\"outputs\":[\"depth\"]"));
    assert_int_equal(request.format, REQUEST_FORMAT_ANY);
    render_request_finish(&request);
}

static void ends_of_ranges_are_allowed(void **state)
{
    (void)state;
    static const char *const bodies[] = {
        BODY(",\"width\":1,\"height\":16384"),
        BODY(",\"width\":65536,\"height\":65536,\"tile\":{\"x\":65535,\"width\":1,\"height\":"
             "16384}"),
        BODY(",\"camera\":{\"eye\":[1e12,-1e12,0],\"target\":[0,0,0]}"),
        BODY(",\"camera\":{\"eye\":[0,0,1e-9],\"target\":[0,0,0]}"),
        BODY(",\"camera\":{\"eye\":[1e7,0,0],\"target\":[1e7,0,-1e-3]}"),
        BODY(",\"camera\":{\"eye\":[0,5,0],\"target\":[0,0,0],\"up\":[0,0,-1]}"),
        BODY(",\"camera\":{\"fov_y_deg\":0.001}"),
        BODY(",\"lights\":[]"),
        BODY(",\"lights\":[{\"type\":\"point\",\"position\":[0,0,0],\"intensity\":1e12}]"),
        BODY(",\"lights\":[{\"type\":\"point\",\"position\":[0,0,0],\"intensity\":0}]"),
        BODY(",\"lights\":[{\"type\":\"spot\",\"position\":[0,0,0],\"direction\":[0,0,1e-12],"
             "\"inner_cone_deg\":90,\"outer_cone_deg\":90}]"),
        BODY(",\"overrides\":{\"materials\":{\"G\":{\"transmission\":1,\"ior\":0}}}"),
        BODY(",\"overrides\":{\"materials\":{\"G\":{\"transmission\":0,\"ior\":1}}}"),
        BODY(",\"background\":[1e12,0,0,1],\"exposure_ev\":-64"),
        BODY(",\"quality\":{\"shadow_resolution\":16384,\"shadow_taps\":16,\"samples\":4}"),
        BODY(",\"quality_percent\":1"),
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct render_request request = parse(bodies[i]);
        render_request_finish(&request);
    }
}

static void lights_at_their_cap_are_read_in_order(void **state)
{
    (void)state;
    enum { COUNT = 65536 };
    char *json = malloc(COUNT * 100 + 200), *at = json;
    assert_non_null(json);
    at = stpcpy(at, "{\"scene\":\"" ID "\",\"lights\":[");
    for (int i = 0; i < COUNT; i++)
        at += sprintf(at, "%s{\"type\":\"point\",\"position\":[%d,0,0]}", i ? "," : "", i);
    strcpy(at, "]}");
    struct render_request request = parse(json);
    assert_int_equal(request.light_count, COUNT);
    for (int i = 0; i < COUNT; i++)
        assert_true(request.lights[i].position[0] == i);
    free(json);
    render_request_finish(&request);
}

/* The front forwards canonical texts: whatever it takes, the worker must be able to read. */
static void canonical_json_of_the_largest_bodies_reads_back(void **state)
{
    (void)state;
    enum { COUNT = 65536 };
    char *json = malloc((size_t)COUNT * 500 + 200), *at = json;
    assert_non_null(json);
    at = stpcpy(at, "{\"scene\":\"" ID "\",\"lights\":[");
    for (int i = 0; i < COUNT; i++)
        at += sprintf(at,
                      "%s{\"type\":\"spot\",\"position\":[0.1,0.1,0.1],\"direction\":[0.1,0.1,0.1],"
                      "\"color\":[0.1,0.1,0.1],\"intensity\":0.1,\"range\":0.1}",
                      i ? "," : "");
    at = stpcpy(at, "],\"overrides\":{\"nodes\":{");
    for (int i = 0; i < COUNT; i++)
        at += sprintf(
            at,
            "%s\"%d\":{\"visible\":true,\"matrix\":[0.1,0.2,0.3,0,0.2,0.1,0.3,0,0.3,0.2,0.1,"
            "0,0.1,0.1,0.1,1]}",
            i ? "," : "", i);
    at = stpcpy(at, "},\"materials\":{");
    for (int i = 0; i < COUNT; i++)
        at += sprintf(at,
                      "%s\"%d\":{\"base_color\":[0.1,0.1,0.1,0.1],\"emissive\":[0.1,0.1,0.1],"
                      "\"attenuation_color\":[0.1,0.1,0.1],\"attenuation_distance\":0.1,"
                      "\"pass_through\":{\"model\":\"edge\"}}",
                      i ? "," : "", i);
    strcpy(at, "}}}");
    assert_true(strlen(json) < LIMIT_REQUEST_JSON_BYTES);
    struct render_request first = parse(json);
    free(json);
    char *text = render_request_to_json(&first);
    assert_non_null(text);
    assert_true(strlen(text) > LIMIT_REQUEST_JSON_BYTES);
    struct render_request second = parse(text);
    assert_int_equal(second.light_count, COUNT);
    assert_int_equal(second.node_count, COUNT);
    assert_int_equal(second.material_count, COUNT);
    free(text);
    render_request_finish(&first);
    render_request_finish(&second);
}

/* ---- allocations that fail, in turn ---- */

/* jansson's allocator has no user pointer, so the countdown of this one test is a global. */
static long allocations_left = -1;

static void *failing_malloc(size_t size)
{
    if (allocations_left == 0)
        return NULL;
    if (allocations_left > 0)
        allocations_left--;
    return malloc(size);
}

static void failed_allocations_are_reported_and_leak_nothing(void **state)
{
    (void)state;
    json_set_alloc_funcs(failing_malloc, free);
    bool is_read = false, has_told_memory = false;
    long failures = 0;
    for (; !is_read; failures++) {
        struct render_request request;
        struct error err = {0};
        allocations_left = failures;
        is_read = render_request_parse(full, strlen(full), &request, &err);
        allocations_left = -1;
        /* While it reads a token, jansson takes a failed allocation for a syntax error. */
        bool is_told = err.code == ERROR_NO_MEMORY || err.code == ERROR_INVALID_REQUEST;
        assert_int_equal(is_told, !is_read);
        has_told_memory = has_told_memory || err.code == ERROR_NO_MEMORY;
        render_request_finish(&request);
    }
    assert_true(failures > 50);
    assert_true(has_told_memory);

    struct render_request request = parse(full);
    char *text = NULL;
    for (failures = 0; !text; failures++) {
        allocations_left = failures;
        text = render_request_to_json(&request);
        allocations_left = -1;
    }
    assert_true(failures > 50);
    free(text);
    render_request_finish(&request);
    json_set_alloc_funcs(malloc, free);
}

static void finish_accepts_zeroed_and_finished_requests(void **state)
{
    (void)state;
    struct render_request request = {0};
    render_request_finish(&request);
    request = parse(full);
    render_request_finish(&request);
    render_request_finish(&request);
    assert_null(request.lights);
}

static void name_tables_end_with_null(void **state)
{
    (void)state;
    const char *(*const tables[])(int) = {request_fit_name,          request_light_type_name,
                                          request_alpha_mode_name,   request_pass_through_name,
                                          request_tone_mapping_name, shadow_technique_name,
                                          transparency_name,         request_light_lists_name,
                                          request_blend_filter_name, request_output_name,
                                          request_format_name,       request_refraction_name,
                                          request_studio_name,       request_visibility_name,
                                          request_volume_map_name,   request_silhouette_form_name};
    static const int counts[] = {
        8, 5, 3, 3, 4, SHADOWS_COUNT, TRANSPARENCIES_COUNT, 3, 4, REQUEST_OUTPUT_COUNT, 6,
        2, 3, 2, 2, 7};
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
        assert_null(tables[i](-1));
        assert_non_null(tables[i](counts[i] - 1));
        assert_null(tables[i](counts[i]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scene_alone_gives_the_documented_defaults),
        cmocka_unit_test(null_is_the_same_as_absent),
        cmocka_unit_test(nulls_inside_members_are_absent_too),
        cmocka_unit_test(camera_light_and_picture_members_arrive),
        cmocka_unit_test(cameras_that_look_straight_up_or_down_have_an_up),
        cmocka_unit_test(a_background_of_three_numbers_is_opaque),
        cmocka_unit_test(override_and_quality_members_arrive),
        cmocka_unit_test(canonical_json_reads_back_as_itself),
        cmocka_unit_test(a_map_is_needed_unless_it_is_built_in),
        cmocka_unit_test(an_exposure_may_be_metered),
        cmocka_unit_test(canonical_json_does_not_depend_on_how_it_was_said),
        cmocka_unit_test(outputs_without_a_format_leave_it_to_accept),
        cmocka_unit_test(ends_of_ranges_are_allowed),
        cmocka_unit_test(lights_at_their_cap_are_read_in_order),
        cmocka_unit_test(canonical_json_of_the_largest_bodies_reads_back),
        cmocka_unit_test(failed_allocations_are_reported_and_leak_nothing),
        cmocka_unit_test(finish_accepts_zeroed_and_finished_requests),
        cmocka_unit_test(name_tables_end_with_null),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
