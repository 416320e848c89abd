/* SPDX-License-Identifier: MIT */
/* What `shadows: auto` becomes: counts of work, forecasts, and the choice. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/quality_defaults.h"
#include "renderer/cost/auto_technique.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/cost/workload.h"
#include "renderer/plan/traced.h"
#include "renderer/shadows/technique.h"
#include "tests/support/import_support.h"

/* A square of 2 m in the plane z = 0, seen from the front; its material is the argument. */
static const char SQUARE[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"
    "'materials':[{'doubleSided':true,%s}],"
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1,'material':0}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3',"
    "'min':[-1,-1,0],'max':[1,1,0]},{'bufferView':1,'componentType':5123,'count':6,"
    "'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':12}],"
    "'buffers':[{'byteLength':60}]}";

struct rig {
    struct imported_scene imported;
    struct scene_state state;
    struct camera camera;
    struct view view;
    struct view_light light;
    uint64_t shadow_budget_bytes;
    struct workload_kept *kept;
};

static void rig_open(struct rig *rig, const char *material)
{
    struct {
        float positions[12];
        uint16_t indices[6];
    } bin = {{-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0}, {0, 1, 2, 2, 1, 3}};
    char json[2048];
    struct error err = {0};
    *rig = (struct rig){
        .view = {.width_px = 100,
                 .height_px = 100,
                 .outputs = 1u << VIEW_OUTPUT_COLOR,
                 .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 5}, .ortho_height = 4},
                 .light_count = 1,
                 .quality = {.shadow_resolution = 1024, .shadow_taps = 4}},
        .light = {.type = SCENE_LIGHT_POINT,
                  .position = {0, 0, 3},
                  .color = {1, 1, 1},
                  .intensity = 10},
    };
    snprintf(json, sizeof json, SQUARE, material);
    if (!imported_scene_make(&rig->imported, json, &bin, 60, &err))
        fail_msg("%s", err.message);
}

static void rig_close(struct rig *rig)
{
    imported_scene_finish(&rig->imported);
}

static struct workload measure(struct rig *rig)
{
    struct workload workload = {0};
    struct error err = {0};
    struct content_key key = content_key_begin();
    content_key_add(&key, &rig->light, sizeof rig->light);
    rig->view.lights = &rig->light;
    if (!scene_state_init(&rig->state, &rig->imported.scene, &rig->view, &err) ||
        !camera_resolve(&rig->camera, &rig->view, &rig->state, &err) ||
        !workload_measure(&workload,
                          &(struct workload_desc){.view = &rig->view,
                                                  .state = &rig->state,
                                                  .camera = &rig->camera,
                                                  .kept = rig->kept,
                                                  .state_key = key},
                          &err))
        fail_msg("%s", err.message);
    scene_state_finish(&rig->state);
    return workload;
}

/* The square fills the middle of the view; a point light shines on all of the way. */
static void haze_is_counted_by_slices_and_lights(void **state)
{
    (void)state;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    assert_true(measure(&rig).haze_slices == 0);
    rig.view.atmosphere.density_per_m = 0.1;
    struct workload hazy = measure(&rig);
    assert_true(hazy.haze_slices > 0 && fabs(hazy.haze_lit - 1) < 1e-9);
    rig.view.quality.atmosphere_samples = 256;
    struct workload fine = measure(&rig);
    assert_true(fine.haze_slices > 3 * hazy.haze_slices);
    rig.light.range = 1e-3f;
    assert_true(measure(&rig).haze_lit == 0);
    rig_close(&rig);
}

/* A box of smoke that fills a quarter of the picture, and casts its shadow on nothing. */
static void smoke_is_counted_by_rays_lights_and_cells(void **state)
{
    (void)state;
    static const char json[] =
        "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],"
        "'extensionsUsed':['VITRAIL_density_grids'],"
        "'nodes':[{'extensions':{'VITRAIL_density_grids':{'grid':0}}}],"
        "'extensions':{'VITRAIL_density_grids':{'grids':[{'name':'smoke','size':[1,1,1],"
        "'values':0,'min':[-1,-1,-1],'max':[1,1,1]}]}},"
        "'accessors':[{'bufferView':0,'componentType':5126,'count':1,'type':'SCALAR'}],"
        "'bufferViews':[{'buffer':0,'byteLength':4}],'buffers':[{'byteLength':4}]}";
    static const struct view_grid_override none[1] = {{.grid = "smoke", .has_density = true}};
    const float value = 1;
    struct rig rig;
    struct error err = {0};
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    assert_true(measure(&rig).grid_cells == 0);
    imported_scene_finish(&rig.imported);
    if (!imported_scene_make(&rig.imported, json, &value, 4, &err))
        fail_msg("%s", err.message);
    struct workload smoky = measure(&rig), narrow;
    assert_true(fabs(smoky.grid_lights - 0.25) < 0.06);
    assert_true(smoky.grid_cells >= 2 * smoky.grid_lights);
    assert_true(smoky.grid_lit_cells >= smoky.grid_lights && smoky.grid_shadow_cells == 0);
    assert_true(smoky.grid_nodes > 0 && smoky.grid_node_lights == smoky.grid_nodes);
    assert_true(smoky.grid_node_cells >= smoky.grid_node_lights);
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct forecast_setting few = {.samples = 1, .has_shadows = true},
                                  many = {.samples = 4, .has_shadows = true};
    double bare[FORECAST_TERM_COUNT] = {0}, one[FORECAST_TERM_COUNT] = {0},
           four[FORECAST_TERM_COUNT] = {0};
    forecast_add_rays(&(struct forecast_frame){&smoky, &few, &speed}, one);
    forecast_add_rays(&(struct forecast_frame){&smoky, &many, &speed}, four);
    double ratio = four[FORECAST_TERM_GRIDS] / one[FORECAST_TERM_GRIDS];
    assert_true(ratio > 2.2 && ratio < 2.8); /* 12 points of four samples, 20 of one */
    double rasterised[FORECAST_TERM_COUNT] = {0}, again[FORECAST_TERM_COUNT] = {0};
    forecast_add_surfaces(&(struct forecast_frame){&smoky, &few, &speed}, rasterised);
    forecast_add_surfaces(&(struct forecast_frame){&smoky, &many, &speed}, again);
    assert_true(rasterised[FORECAST_TERM_GRIDS] > 0); /* samples of a round share the ray */
    assert_true(rasterised[FORECAST_TERM_GRIDS] == again[FORECAST_TERM_GRIDS]);
    rig.view.grids = none;
    rig.view.grid_override_count = 1;
    narrow = measure(&rig);
    forecast_add_rays(&(struct forecast_frame){&narrow, &few, &speed}, bare);
    assert_true(bare[FORECAST_TERM_GRIDS] == 0);
    rig.view.grid_override_count = 0;
    rig.light.range = 1;
    narrow = measure(&rig);
    assert_true(narrow.grid_lights == 0 && narrow.grid_cells == smoky.grid_cells);
    assert_true(narrow.grid_nodes == smoky.grid_nodes && narrow.grid_node_lights == 0);
    rig_close(&rig);
}

/* A fold of two triangles before a wall. */
static void faces_of_volumes_count_before_what_is_seen(void **state)
{
    (void)state;
    static const char json[] =
        "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0,1]}],"
        "'nodes':[{'mesh':0},{'mesh':1}],'materials':[{'doubleSided':true}],"
        "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'material':0}]},"
        "{'primitives':[{'attributes':{'POSITION':1},'material':0}]}],"
        "'accessors':[{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3',"
        "'min':[-2,-2,0],'max':[2,2,0]},{'bufferView':0,'byteOffset':72,'componentType':5126,"
        "'count':6,'type':'VEC3','min':[-1.5,-0.5,0.5],'max':[-1,0.5,1]}],"
        "'bufferViews':[{'buffer':0,'byteLength':144}],'buffers':[{'byteLength':144}]}";
    static const float points[36] = {-2,    -2, 0, 2,  -2,  0, -2, 2,    0, -2, 2,   0,
                                     2,     -2, 0, 2,  2,   0, -1, -.5f, 1, -1, .5f, 1,
                                     -1.5f, 0,  1, -1, .5f, 1, -1, -.5f, 1, -1, 0,   .5f};
    struct rig rig;
    struct error err = {0};
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    imported_scene_finish(&rig.imported);
    if (!imported_scene_make(&rig.imported, json, points, sizeof points, &err))
        fail_msg("%s", err.message);
    rig.light = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                    .direction = {1, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 1};
    struct workload folded = measure(&rig);
    assert_true(folded.face_pixels > 64);
    rig.light = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                    .position = {-1, 0, 3},
                                    .direction = {0, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 1,
                                    .outer_cone_deg = 30};
    assert_true(measure(&rig).face_pixels > 64);
    rig.light.direction[0] = 10; /* past all that is seen */
    assert_true(measure(&rig).face_pixels == 0);
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct forecast_setting one = {.samples = 1, .has_shadows = true};
    double terms[2][FORECAST_TERM_COUNT] = {{0}};
    forecast_add_volumes(&(struct forecast_frame){&folded, &one, &speed}, terms[0]);
    folded.face_pixels += 1e6;
    forecast_add_volumes(&(struct forecast_frame){&folded, &one, &speed}, terms[1]);
    double more_ms = forecast_sum_ms(terms[1]) - forecast_sum_ms(terms[0]);
    assert_true(fabs(more_ms - forecast_costs.volume_pixel) < 1e-6);
    rig_close(&rig);
}

/* A rasterised surface pays for an area once, rays to it for each sample. */
static void areas_count_once_and_by_their_samples(void **state)
{
    (void)state;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    rig.light = (struct view_light){.type = SCENE_LIGHT_RECT,
                                    .position = {0, 0, 3},
                                    .direction = {0, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 1,
                                    .width_m = 1,
                                    .height_m = 1};
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct forecast_setting setting = {.samples = 1, .has_shadows = true};
    double ms[2][3];
    for (int i = 0; i < 2; i++) {
        rig.view.quality.area_samples = i ? 64 : 16;
        const struct workload w = measure(&rig);
        const struct forecast_frame frame = {&w, &setting, &speed};
        assert_true(w.lit_areas == 1 && w.area_rays == rig.view.quality.area_samples);
        assert_true(w.lit == w.area_rays);
        ms[i][0] = technique_forecast_ms(SHADOWS_NONE, &frame);
        ms[i][1] = technique_forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &frame);
        ms[i][2] = technique_forecast_ms(SHADOWS_RAYTRACED, &frame);
    }
    assert_true(ms[0][0] == ms[1][0]);
    assert_true(ms[1][1] > ms[0][1] && ms[1][2] > ms[0][2]);
    rig_close(&rig);
}

static struct auto_choice choose(struct rig *rig, const struct auto_settings *settings)
{
    struct auto_choice choice = {0};
    struct error err = {0};
    rig->view.lights = &rig->light;
    if (!scene_state_init(&rig->state, &rig->imported.scene, &rig->view, &err) ||
        !camera_resolve(&rig->camera, &rig->view, &rig->state, &err) ||
        !auto_choose(&choice,
                     &(struct auto_desc){.view = &rig->view,
                                         .state = &rig->state,
                                         .camera = &rig->camera,
                                         .settings = settings,
                                         .shadow_budget_bytes = rig->shadow_budget_bytes,
                                         .raster_samples = 4},
                     &err))
        fail_msg("%s", err.message);
    scene_state_finish(&rig->state);
    return choice;
}

static void counts_are_those_of_the_picture(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    struct workload w = measure(&rig);
    assert_true(fabs(w.covered - 0.25) < 0.03);
    assert_true(w.layers == 0 && w.textures == 0);
    assert_true(w.triangles == 2 && w.triangles_in_view == 2 && w.pixels == 10000);
    assert_true(w.lit == 1 && w.lights == 1 && w.shadowed_lights == 1 && w.deep_lights == 0);
    rig.light.position[2] = -3; /* behind */
    assert_true(measure(&rig).lit == 0);
    rig.light = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                    .position = {0, 0, 3},
                                    .direction = {0, 0, 1},
                                    .color = {1, 1, 1},
                                    .intensity = 10};
    w = measure(&rig);
    assert_true(w.lit == 0 && w.listed == 1); /* shines away, and every surface asks it */
    rig.light.direction[2] = -1;
    assert_true(measure(&rig).lit > 0.9);
    rig.light.range = 1;
    w = measure(&rig);
    assert_true(w.lit == 0 && w.listed == 0); /* too far */
    rig.light.range = 4;
    assert_true(measure(&rig).listed == 1);
    rig.view.camera.eye[0] = 100; /* looks at the square from aside, which is edge on */
    assert_true(measure(&rig).covered < 0.1);
    rig_close(&rig);
    rig_open(&rig, "'alphaMode':'BLEND','pbrMetallicRoughness':{'baseColorFactor':[1,1,1,0.5]}");
    w = measure(&rig);
    assert_true(w.covered == 0 && fabs(w.layers - 0.25) < 0.01);
    assert_true(w.deep_lights == 1 && w.deep_share > 0);
    assert_true(w.directions == 0);
    rig.view.environment_key = "map";
    assert_true(measure(&rig).directions == ENVIRONMENT_SAMPLES_DEFAULT);
    rig.view.quality.environment_samples = 100;
    assert_true(measure(&rig).directions == 100);
    rig_close(&rig);
}

/* The stack lies before the camera, each square smaller than the one behind it. */
static void rig_open_stack(struct rig *rig, int count, const char *material)
{
    struct {
        float positions[12];
        uint16_t indices[6];
    } bin = {{-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0}, {0, 1, 2, 2, 1, 3}};
    char json[16384], nodes[4096] = "", list[1024] = "", square[2048];
    struct error err = {0};
    rig_open(rig, material);
    imported_scene_finish(&rig->imported);
    for (int i = 0; i < count; i++) {
        double scale = 1 - 0.5 * i / count;
        snprintf(nodes + strlen(nodes), sizeof nodes - strlen(nodes),
                 "%s{'mesh':0,'scale':[%g,%g,1],'translation':[0,0,%g]}", i ? "," : "", scale,
                 scale, 0.02 * i);
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%d", i ? "," : "", i);
    }
    snprintf(square, sizeof square, SQUARE, material);
    const char *meshes = strstr(square, ",'materials'");
    snprintf(json, sizeof json,
             "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[%s]}],'nodes':[%s]%s", list,
             nodes, meshes);
    if (!imported_scene_make(&rig->imported, json, &bin, 60, &err))
        fail_msg("%s", err.message);
}

#define HALF_LIGHT "'alphaMode':'BLEND','pbrMetallicRoughness':{'baseColorFactor':[1,1,1,0.5]}"

static struct workload measure_anew(struct rig *rig)
{
    struct workload_kept *kept = rig->kept;
    rig->kept = NULL;
    const struct workload fresh = measure(rig);
    rig->kept = kept;
    return fresh;
}

static void assert_counts_equal(const struct workload *a, const struct workload *b)
{
    assert_true(a->map_triangles == b->map_triangles && a->deep_triangles == b->deep_triangles);
    assert_true(a->map_faces == b->map_faces && a->deep_share == b->deep_share);
    assert_true(a->shadowed_lights == b->shadowed_lights && a->deep_layers == b->deep_layers);
    assert_true(a->face_pixels == b->face_pixels && a->lit == b->lit && a->layers == b->layers);
}

/* A stack before moving cameras, one of which looks away; then from beside another light. */
static void what_is_kept_from_view_to_view_counts_as_if_it_were_not(void **unused)
{
    (void)unused;
    struct rig rig;
    struct workload_kept kept = {0};
    rig_open_stack(&rig, 5, HALF_LIGHT);
    rig.kept = &kept;
    for (int i = 0; i < 16; i++) {
        rig.view.quality.may_be_coarse = i / 8;
        rig.light.position[0] = i / 4 % 2 ? 2 : 0;
        rig.light.position[2] = 1;
        rig.light.range = 2;
        rig.view.camera.eye[0] = i % 4;
        rig.view.camera.eye[2] = i % 4 == 2 ? -50 : 5;
        rig.view.camera.target[2] = i % 4 == 2 ? -90 : 0;
        const struct workload fresh = measure_anew(&rig), again = measure(&rig);
        assert_counts_equal(&fresh, &again);
        assert_int_equal(i % 4 == 2 ? 0 : 1, fresh.shadowed_lights);
    }
    assert_int_equal(25, kept.edge_count); /* five of each square */
    kept.loads[0].transparent += 100;
    assert_true(measure(&rig).deep_triangles == measure_anew(&rig).deep_triangles + 100);
    rig.view.quality.faithful = true; /* which may divide maps in another way */
    assert_true(measure(&rig).deep_triangles == measure_anew(&rig).deep_triangles);
    workload_kept_finish(&kept);
    assert_null(kept.loads);
    rig_close(&rig);
}

static void peels_are_the_most_layers_before_one_another(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open_stack(&rig, 5, HALF_LIGHT);
    rig.view.quality.samples = 1;
    assert_true(measure(&rig).peels == 0 && measure(&rig).peeled_sides == 0);
    rig.view.quality.transparency = TRANSPARENCY_DEPTH_PEELING;
    struct workload single = measure(&rig);
    assert_true(single.peels == 5 && single.peeled_sides == 1 && single.peeled_triangles == 10);
    /* a quarter of the picture, in squares of 1, 0.9, ... 0.6; each is drawn in the bounds of all
     * that are left */
    double bounds = 0.25 * (1 + 0.81 + 0.64 + 0.49 + 0.36);
    assert_true(fabs(single.peeled_pixels - bounds) < 0.1 * bounds);
    rig.view.quality.transparency = TRANSPARENCY_DUAL_DEPTH_PEELING;
    struct workload dual = measure(&rig);
    assert_true(dual.peels == 3 && dual.peeled_sides == 2);
    assert_true(dual.peeled_pixels < single.peeled_pixels);
    rig.view.quality.samples = 4; /* the diagonals of all squares, whose sides are layers each */
    assert_true(measure(&rig).peels == 5);
    rig.view.atmosphere.density_per_m = 0.1; /* haze takes lists */
    assert_true(measure(&rig).peels == 0 && measure(&rig).peeled_sides == 0);
    rig_close(&rig);
}

static void peels_end_at_what_is_opaque_and_where_nothing_is_let_through(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open_stack(&rig, 40, HALF_LIGHT);
    rig.view.quality.samples = 1;
    rig.view.quality.transparency = TRANSPARENCY_DEPTH_PEELING;
    /* 25 layers leave 2^-25, and the 32nd is followed by a look */
    assert_true(measure(&rig).peels == 32);
    rig.view.quality.transparency = TRANSPARENCY_DUAL_DEPTH_PEELING;
    assert_true(measure(&rig).peels == 16);
    rig_close(&rig);
    rig_open_stack(&rig, 40, "'alphaMode':'OPAQUE'");
    rig.view.quality.transparency = TRANSPARENCY_DEPTH_PEELING;
    assert_true(measure(&rig).peels == 0);
    rig_close(&rig);
}

static void partitions_are_the_casters_before_one_another(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open_stack(&rig, 5, HALF_LIGHT);
    assert_true(measure(&rig).deep_layers == 0);
    rig.view.quality.shadows = SHADOWS_COMPOSITED;
    assert_true(measure(&rig).deep_layers == 5);
    rig_close(&rig);
}

/* The events of a square under a light straight above: its share of the map. */
static void events_are_the_share_of_the_map_that_casters_cover(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'BLEND','pbrMetallicRoughness':{'baseColorFactor':[1,1,1,0.5]}");
    rig.light = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                    .direction = {0, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 1};
    double along = measure(&rig).deep_share;
    assert_true(along > 0.4 && along <= 1); /* the map is as wide as the square, and turned */
    rig.light.direction[0] = 1;             /* 45 degrees */
    assert_true(measure(&rig).deep_share < along);
    rig_close(&rig);
}

static double forecast_ms(enum shadow_technique technique, const struct workload *workload,
                          const struct forecast_setting *setting, const struct device_speed *speed)
{
    return technique_forecast_ms(technique, &(struct forecast_frame){workload, setting, speed});
}

static void forecasts_grow_with_the_work(void **unused)
{
    (void)unused;
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct workload base = {.pixels = 1e5,
                                  .covered = 0.5,
                                  .layers = 0.1,
                                  .lit = 2,
                                  .textures = 1,
                                  .triangles = 1e4,
                                  .triangles_in_view = 5e3,
                                  .lights = 4,
                                  .shadowed_lights = 4,
                                  .deep_lights = 2,
                                  .map_faces = 8,
                                  .deep_faces = 4,
                                  .map_triangles = 1e4,
                                  .deep_triangles = 1e3,
                                  .deep_share = 0.5};
    const size_t grown[] = {offsetof(struct workload, pixels), offsetof(struct workload, covered),
                            offsetof(struct workload, layers), offsetof(struct workload, lit),
                            offsetof(struct workload, textures)};
    struct forecast_setting setting = {
        .samples = 4, .shadow_resolution = 1024, .shadow_taps = 4, .has_shadows = true};
    double raster = forecast_ms(SHADOWS_DEEP, &base, &setting, &speed);
    double traced = forecast_ms(SHADOWS_RAYTRACED, &base, &setting, &speed);
    double shadows = forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &base, &setting, &speed);
    for (size_t i = 0; i < sizeof grown / sizeof *grown; i++) {
        struct workload more = base;
        *(double *)((char *)&more + grown[i]) *= 2;
        assert_true(forecast_ms(SHADOWS_DEEP, &more, &setting, &speed) > raster);
        assert_true(forecast_ms(SHADOWS_RAYTRACED, &more, &setting, &speed) > traced);
        assert_true(forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &more, &setting, &speed) > shadows);
    }
    struct workload sky = base;
    sky.directions = 16; /* rays of whole pictures alone go there */
    assert_true(forecast_ms(SHADOWS_RAYTRACED, &sky, &setting, &speed) > traced);
    assert_true(forecast_ms(SHADOWS_DEEP, &sky, &setting, &speed) == raster);
    assert_true(forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &sky, &setting, &speed) == shadows);
    setting.is_warm = true;
    /* The tree stands. */
    assert_true(forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &base, &setting, &speed) < shadows);
    assert_true(forecast_ms(SHADOWS_DEEP, &base, &setting, &speed) < raster);
    assert_true(forecast_ms(SHADOWS_RAYTRACED, &base, &setting, &speed) < traced);
    double warm = forecast_ms(SHADOWS_DEEP, &base, &setting, &speed);
    setting.shadow_resolution = 4096; /* of maps that are there */
    assert_true(forecast_ms(SHADOWS_DEEP, &base, &setting, &speed) == warm);
    setting.samples = 1;
    assert_true(forecast_ms(SHADOWS_DEEP, &base, &setting, &speed) < warm);
    const struct device_speed slow = {1, 10, 10, 1, 1};
    assert_true(forecast_ms(SHADOWS_DEEP, &base, &setting, &slow) >
                9 * forecast_shade_ms(&base, &setting));
}

static void peels_and_partitions_take_time_where_they_are_drawn(void **unused)
{
    (void)unused;
    const struct device_speed speed = {1, 1, 1, 1, 1};
    struct workload lists = {.pixels = 1e5,
                             .covered = 0.5,
                             .layers = 0.5,
                             .lit = 1,
                             .triangles = 1e4,
                             .triangles_in_view = 1e4,
                             .lights = 1,
                             .shadowed_lights = 1,
                             .deep_lights = 1,
                             .map_faces = 1,
                             .deep_faces = 1,
                             .deep_triangles = 1e4,
                             .deep_share = 0.5};
    struct workload peeled = lists;
    struct forecast_setting setting = {
        .samples = 1, .shadow_resolution = 1024, .shadow_taps = 1, .has_shadows = true};
    peeled.peeled_sides = 1;
    peeled.peels = 10; /* 6 ms */
    peeled.peeled_pixels = 4;
    peeled.peeled_triangles = 5e3;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        enum shadow_technique technique = (enum shadow_technique)i;
        bool has_rays = shadow_technique_is_renderer(technique) || shadow_is_per_window(technique);
        double more = forecast_ms(technique, &peeled, &setting, &speed) -
                      forecast_ms(technique, &lists, &setting, &speed);
        assert_true(has_rays ? more == 0 : more > 66); /* 26 of triangles, 40 of pixels */
    }
    lists.deep_layers = 4;
    double few = forecast_ms(SHADOWS_COMPOSITED, &lists, &setting, &speed);
    double deep = forecast_ms(SHADOWS_DEEP, &lists, &setting, &speed);
    lists.deep_layers = 40;
    assert_true(forecast_ms(SHADOWS_COMPOSITED, &lists, &setting, &speed) > few + 36);
    assert_true(forecast_ms(SHADOWS_DEEP, &lists, &setting, &speed) == deep);
    setting.is_warm = true; /* the maps stand */
    assert_true(forecast_ms(SHADOWS_COMPOSITED, &lists, &setting, &speed) < few);
    /* four moments of several casters say less than a map's texels (test_shadow_moments.c) */
    assert_true(technique_forecast_error(SHADOWS_MOMENTS, &setting) > 0.042 &&
                technique_forecast_error(SHADOWS_COMPOSITED, &setting) < 0.042);
}

/* Without lights that cast there is nothing to trace, and no tree is built. */
static void traced_shadows_without_casters_cost_nothing(void **unused)
{
    (void)unused;
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct workload bare = {
        .pixels = 1e5, .covered = 0.5, .lit = 2, .triangles = 1e6, .triangles_in_view = 5e3};
    struct forecast_setting setting = {.samples = 4, .has_shadows = true};
    double shadows = forecast_ms(SHADOWS_RAYTRACED_SHADOWS, &bare, &setting, &speed);
    assert_true(shadows == forecast_ms(SHADOWS_DEEP, &bare, &setting, &speed));
}

static enum shadow_technique fastest(double maps_ms, double rays_ms, double points_ms)
{
    double ms[SHADOWS_COUNT];
    for (int i = 0; i < SHADOWS_COUNT; i++)
        ms[i] = i == SHADOWS_DEEP                ? maps_ms
                : i == SHADOWS_RAYTRACED         ? rays_ms
                : i == SHADOWS_RAYTRACED_SHADOWS ? points_ms
                                                 : INFINITY;
    return auto_fastest(ms);
}

static void a_gain_within_the_error_of_forecasts_is_none(void **unused)
{
    (void)unused;
    assert_int_equal(fastest(100, 95, 99), SHADOWS_RASTER_DEFAULT);
    assert_int_equal(fastest(100, 80, 85), SHADOWS_RAYTRACED);
    assert_int_equal(fastest(100, 85, 80), SHADOWS_RAYTRACED_SHADOWS);
    assert_int_equal(fastest(100, 200, 50), SHADOWS_RAYTRACED_SHADOWS);
    assert_int_equal(fastest(0, 0, 0), SHADOWS_RASTER_DEFAULT);
}

/* The same device but for how fast it rasterises or traces. */
static const struct auto_settings fast_raster = {.policy = AUTO_MEASURED,
                                                 .speed = {0.01, 0.01, 0.01, 1, 1}};
static const struct auto_settings fast_rays = {.policy = AUTO_MEASURED,
                                               .speed = {1, 1, 1, 0.01, 0.01}};
/* Surfaces cost it nothing, maps and camera rays much. */
static const struct auto_settings slow_maps = {.policy = AUTO_MEASURED,
                                               .speed = {0.01, 0.01, 100, 1, 1}};

static void the_faster_is_taken_and_the_reason_told(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    struct auto_choice choice = choose(&rig, &fast_rays), again = choose(&rig, &fast_rays);
    assert_true(choice.is_open && choice.technique == SHADOWS_RAYTRACED &&
                choice.ms[SHADOWS_RAYTRACED] < choice.ms[SHADOWS_DEEP]);
    assert_non_null(strstr(choice.because, "calibrated"));
    assert_true(choice.ms[SHADOWS_RAYTRACED] == again.ms[SHADOWS_RAYTRACED] &&
                choice.ms[SHADOWS_DEEP] == again.ms[SHADOWS_DEEP]);
    choice = choose(&rig, &fast_raster); /* edges of a square are fewer than texels */
    assert_true(choice.is_open && choice.technique == SHADOWS_SILHOUETTE &&
                choice.ms[SHADOWS_DEEP] < choice.ms[SHADOWS_RAYTRACED]);
    assert_non_null(strstr(choice.because, "by silhouettes"));
    double built = choice.ms[SHADOWS_DEEP];
    choice = choose(&rig, &slow_maps);
    assert_true(choice.technique == SHADOWS_AREA); /* which has surfaces alone */
    assert_true(strstr(choice.because, "ms ray traced, ") <
                strstr(choice.because, "ms rasterised, "));
    assert_true(choice.ms[SHADOWS_RAYTRACED_SHADOWS] < choice.ms[SHADOWS_RAYTRACED] &&
                choice.ms[SHADOWS_RAYTRACED_SHADOWS] < choice.ms[SHADOWS_DEEP]);
    assert_non_null(strstr(choice.because, "with traced shadows"));
    rig.view.quality.expects_reuse = true;
    choice = choose(&rig, &fast_raster);
    assert_true(choice.ms[SHADOWS_DEEP] < built); /* shadow maps are there */
    double kept_ms = choice.ms[SHADOWS_DEEP];
    struct workload w = measure(&rig);
    assert_true(w.map_faces > 0 && w.deep_faces == 0);
    rig.shadow_budget_bytes = (uint64_t)(w.map_faces * 1024 * 1024 * 4); /* they fit */
    assert_true(choose(&rig, &fast_raster).ms[SHADOWS_DEEP] == kept_ms);
    rig.shadow_budget_bytes--;
    choice = choose(&rig, &fast_raster);
    assert_true(choice.ms[SHADOWS_DEEP] > kept_ms &&
                strstr(choice.because, "too many maps to keep"));
    rig_close(&rig);
}

/* What only some casters fit is taken where it is forecast to take half of the others' time, and
 * the scene has no others. */
static void finders_are_taken_where_they_gain_much(void **unused)
{
    (void)unused;
    static const struct auto_settings faster = {.policy = AUTO_MEASURED,
                                                .speed = {0.01, 0.005, 0.005, 1, 1}};
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    struct auto_choice choice = choose(&rig, &faster), even = choose(&rig, &fast_rays);
    assert_true(choice.technique == SHADOWS_SILHOUETTE);
    assert_true(even.technique == SHADOWS_RAYTRACED && even.ms[SHADOWS_SILHOUETTE] < 0 &&
                even.ms[SHADOWS_VOLUME] < 0 && even.ms[SHADOWS_AREA] < 0);
    rig.view.quality.expects_reuse = true; /* maps stand, and looking into them is cheap */
    assert_true(choose(&rig, &faster).technique == SHADOWS_DEEP);
    rig.view.quality.expects_reuse = false;
    rig.view.atmosphere.density_per_m = 0.1; /* which it cannot draw */
    assert_true(choose(&rig, &faster).technique == SHADOWS_DEEP);
    rig.view.atmosphere.density_per_m = 0;
    rig.light = (struct view_light){.type = SCENE_LIGHT_DISK,
                                    .position = {0, 0, 3},
                                    .direction = {0, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 10,
                                    .radius_m = 1};
    choice = choose(&rig, &faster);
    assert_true(choice.is_open && choice.technique == SHADOWS_AREA);
    assert_non_null(strstr(choice.because, "by grids"));
    assert_true(choice.ms[SHADOWS_SILHOUETTE] < 0 && choice.ms[SHADOWS_DEEP] < 0);
    char because[REPORT_TEXT_BYTES];
    struct error err = {0};
    struct auto_choice none = choose(&rig, &(struct auto_settings){.policy = AUTO_RAYTRACED});
    assert_true(scene_state_init(&rig.state, &rig.imported.scene, &rig.view, &err));
    assert_false(plan_is_raytraced(&rig.view, &rig.state, &choice, because));
    assert_true(!none.is_open && plan_is_raytraced(&rig.view, &rig.state, &none, because));
    scene_state_finish(&rig.state);
    rig_close(&rig);
    rig_open(&rig, "'alphaMode':'MASK'"); /* filters by place */
    assert_true(choose(&rig, &faster).technique == SHADOWS_DEEP);
    rig_close(&rig);
}

static void policies_need_no_numbers(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    assert_false(choose(&rig, NULL).is_open);
    assert_false(choose(&rig, &(struct auto_settings){.policy = AUTO_RASTER}).is_open);
    assert_false(choose(&rig, &(struct auto_settings){.policy = AUTO_MEASURED}).is_open);
    struct auto_choice choice = choose(&rig, &(struct auto_settings){.policy = AUTO_RAYTRACED});
    assert_true(choice.is_open && choice.technique == SHADOWS_RAYTRACED && choice.because[0]);
    rig_close(&rig);
}

static void what_was_said_is_not_open(void **unused)
{
    (void)unused;
    struct rig rig;
    rig_open(&rig, "'alphaMode':'OPAQUE'");
    const struct view_quality open = rig.view.quality;
    const struct view_quality closed[] = {
        {.shadows = SHADOWS_DEEP},
        {.shadows = SHADOWS_NONE},
        {.shadow_resolution = 512},
        {.shadow_taps = 9},
        {.light_lists = VIEW_LIGHT_LISTS_LINKED},
        {.faithful = true},
        {.reference = true},
    };
    for (size_t i = 0; i < sizeof closed / sizeof *closed; i++) {
        rig.view.quality = closed[i];
        assert_false(choose(&rig, &fast_rays).is_open);
    }
    rig.view.quality = open;
    rig.view.quality.shadow_taps = 1; /* a view that moves */
    assert_true(choose(&rig, &fast_rays).is_open);
    rig.view.outputs = 1u << VIEW_OUTPUT_DEPTH;
    assert_false(choose(&rig, &fast_rays).is_open);
    rig.view.outputs = 1u << VIEW_OUTPUT_COLOR;
    rig.light = (struct view_light){.type = SCENE_LIGHT_DISK,
                                    .position = {0, 0, 3},
                                    .direction = {0, 0, -1},
                                    .color = {1, 1, 1},
                                    .intensity = 10,
                                    .radius_m = 1};
    assert_false(choose(&rig, &fast_rays).is_open); /* whole pictures by rays, without a choice */
    rig_close(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_are_those_of_the_picture),
        cmocka_unit_test(haze_is_counted_by_slices_and_lights),
        cmocka_unit_test(smoke_is_counted_by_rays_lights_and_cells),
        cmocka_unit_test(faces_of_volumes_count_before_what_is_seen),
        cmocka_unit_test(areas_count_once_and_by_their_samples),
        cmocka_unit_test(what_is_kept_from_view_to_view_counts_as_if_it_were_not),
        cmocka_unit_test(peels_are_the_most_layers_before_one_another),
        cmocka_unit_test(peels_end_at_what_is_opaque_and_where_nothing_is_let_through),
        cmocka_unit_test(partitions_are_the_casters_before_one_another),
        cmocka_unit_test(peels_and_partitions_take_time_where_they_are_drawn),
        cmocka_unit_test(events_are_the_share_of_the_map_that_casters_cover),
        cmocka_unit_test(forecasts_grow_with_the_work),
        cmocka_unit_test(traced_shadows_without_casters_cost_nothing),
        cmocka_unit_test(a_gain_within_the_error_of_forecasts_is_none),
        cmocka_unit_test(the_faster_is_taken_and_the_reason_told),
        cmocka_unit_test(finders_are_taken_where_they_gain_much),
        cmocka_unit_test(policies_need_no_numbers),
        cmocka_unit_test(what_was_said_is_not_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
