/* SPDX-License-Identifier: MIT */
/* Every program that frames may need links, also those that depend on what a frame counts. Nothing
 * is drawn, so this holds on devices that execute nothing; ./check-drivers has its programs from
 * here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_media.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { ALL_OUTPUTS = (1 << VIEW_OUTPUT_COUNT) - 1 };

struct warm_scene {
    struct renderer *renderer;
    struct rig_scene rig;
    const char *file; /* of a shader: looked for in what is listed */
    bool has_file;
};

static bool never(void *context)
{
    (void)context;
    return false;
}

static struct view view_by(enum shadow_technique shadows)
{
    return (struct view){.width_px = 48,
                         .height_px = 48,
                         .camera = {.kind = VIEW_CAMERA_FIT},
                         .quality = {.shadow_resolution = 64, .shadows = shadows}};
}

static bool is_file(const char *name, const char *file)
{
    return name && !strcmp(name, file);
}

static void look_for_file(struct warm_scene *scene, const struct listed_program *program)
{
    if (scene->file)
        scene->has_file |=
            is_file(program->compute, scene->file) || is_file(program->fragment, scene->file);
}

static void link_all(struct warm_scene *scene, const struct view *view)
{
    static const struct renderer_warm_up_desc desc = {.shall_stop = never};
    struct program_list list = {0};
    struct error err = {0};
    bool is_complete = false;
    if (!renderer_warm_up(scene->renderer, scene->rig.key, view, &desc, &is_complete, &err) ||
        !renderer_list_programs(scene->renderer, scene->rig.key, view, &list, &err))
        fail_msg("%s", err.message);
    assert_true(is_complete);
    assert_true(list.count > 0);
    for (size_t i = 0; i < list.count; i++) {
        const struct listed_program *program = &list.items[i];
        if (program->place != PROGRAM_IN_MEMORY)
            fail_msg("%s [%s] is not there", program->label, program->defines);
        look_for_file(scene, program);
    }
    program_list_finish(&list);
}

/* And the file is among them. */
static void link_all_with(struct warm_scene *scene, const struct view *view, const char *file)
{
    scene->file = file;
    scene->has_file = false;
    link_all(scene, view);
    if (!scene->has_file)
        fail_msg("%s is not listed", file);
}

static void link_techniques(struct warm_scene *scene, const struct view *view)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    size_t count = raster_techniques(0, techniques);
    for (size_t i = 0; i < count; i++) {
        struct view other = *view;
        other.quality.shadows = techniques[i];
        link_all(scene, &other);
    }
}

static void open_demo(struct warm_scene *scene)
{
    *scene = (struct warm_scene){.renderer = render_rig_create()};
    rig_demo_open(&scene->rig, scene->renderer, "demo", 64);
}

static void close_scene(struct warm_scene *scene)
{
    rig_scene_finish(&scene->rig, scene->renderer);
    renderer_destroy(scene->renderer);
}

static void programs_of_every_technique_link(void **state)
{
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_DEEP);
    open_demo(&scene);
    for (int samples = 1; samples <= 4; samples += 3) {
        view.quality.samples = samples;
        link_techniques(&scene, &view);
    }
    view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    view.quality.shadows = SHADOWS_DEEP_LINKED;
    link_all(&scene, &view);
    view.quality.faithful = true;
    link_all(&scene, &view);
    view.quality.shadows = SHADOWS_TRANSLUCENT;
    link_all(&scene, &view);
    view.quality.shadows = SHADOWS_STOCHASTIC;
    link_all(&scene, &view);
    close_scene(&scene);
}

static void programs_of_every_output_and_camera_link(void **state)
{
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_DEEP);
    open_demo(&scene);
    view.outputs = ALL_OUTPUTS;
    link_all(&scene, &view);
    view = view_by(SHADOWS_DEEP);
    view.camera.ortho_height = 2;
    link_all(&scene, &view);
    view.wants_deep = true;
    link_all(&scene, &view);
    close_scene(&scene);
}

/* Which lists are so long is counted by frames; a device that executes nothing counts none. */
static void programs_that_sort_long_lists_link_before_any_list_is_counted(void **state)
{
    static const char *const files[] = {"shadow_sort.comp.glsl", "shadow_merge.comp.glsl",
                                        "lists_sort.comp.glsl"};
    (void)state;
    struct warm_scene scene;
    open_demo(&scene);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        const struct view view = view_by(SHADOWS_DEEP);
        link_all_with(&scene, &view, files[i]);
    }
    close_scene(&scene);
}

static void programs_of_approximated_and_filtered_lists_link(void **state)
{
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_DEEP);
    open_demo(&scene);
    view.quality.shadow_compression = 0.01;
    link_all(&scene, &view);
    view.quality.shadow_prefilter = 2;
    link_all(&scene, &view);
    close_scene(&scene);
}

/* Open bodies fill themselves up, and what the plane cuts away is looked for in every program. */
static void programs_of_media_and_of_cuts_link(void **state)
{
    static const struct closed_form_body box = {
        .shape = BODY_BOX, .high = {1, 1, 1}, .remains = {0.5f, 0.25f, 0.0625f}, .distance = 0.25f};
    static const double plane[1][4] = {{0, -1, 0, 0.5}};
    (void)state;
    struct warm_scene scene = {.renderer = render_rig_create()};
    struct closed_form_scene body = {0};
    struct view view = view_by(SHADOWS_DEEP);
    media_scene_build(&(struct media_scene_desc){.bodies = &box, .count = 1}, &body);
    rig_scene_open(&scene.rig, scene.renderer, "medium", body.glb, body.size_bytes);
    link_techniques(&scene, &view);
    view.clip_plane_count = 1;
    view.clip_planes = plane;
    link_all(&scene, &view);
    view.wants_deep = true;
    view.quality.refraction = VIEW_REFRACTION_OFF;
    link_all(&scene, &view);
    close_scene(&scene);
    closed_form_scene_finish(&body);
}

/* Lobes of one word: clearcoat, sheen, specular; and of two: film, grain, leaf. */
static const struct glb_material_desc lobes[2] = {
    {.base_color = {0.6, 0.1, 0.1, 1},
     .roughness = 0.7,
     .clearcoat = 1,
     .clearcoat_roughness = 0.2,
     .sheen_color = {0.9, 0.6, 0.3},
     .sheen_roughness = 0.4,
     .has_specular = true,
     .specular = 0.5,
     .specular_color = {1, 1, 1}},
    {.base_color = {0.2, 0.5, 0.1, 1},
     .metallic = 0.5,
     .roughness = 0.5,
     .is_double_sided = true,
     .clearcoat = 1,
     .sheen_color = {0.5, 0.5, 0.5},
     .iridescence = 1,
     .film_most_nm = 400,
     .anisotropy = 0.6,
     .diffuse_transmission = 0.5,
     .diffuse_transmission_color = {0.5, 0.9, 0.1}},
};

/* An opaque sphere, and one of glass. */
static void open_lobes(struct warm_scene *scene, const struct glb_material_desc *material)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Lobes", &err);
    struct shape shape = {0};
    size_t size_bytes;
    void *glb;
    for (int i = 0; i < 2; i++) {
        struct glb_material_desc own = *material;
        own.transmission = i ? 0.8 : 0;
        shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 16, 8);
        const struct glb_node_desc node = {
            .mesh =
                shape_give_mesh(&shape, builder, "Sphere", glb_builder_add_material(builder, &own)),
            .translation = {2.2 * i, 0, 0}};
        glb_builder_add_node(builder, &node);
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    *scene = (struct warm_scene){.renderer = render_rig_create()};
    rig_scene_open(&scene->rig, scene->renderer, "lobes", glb, size_bytes);
    free(glb);
}

static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {1, 3, 5}, .color = {1, 1, 1}, .intensity = 90};

static void programs_of_lobes_link(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct warm_scene scene;
        struct view view = view_by(SHADOWS_DEEP);
        open_lobes(&scene, &lobes[i]);
        view.lights = &lamp;
        view.light_count = 1;
        for (int samples = 1; samples <= 4; samples += 3) {
            view.quality.samples = samples;
            link_all(&scene, &view);
        }
        close_scene(&scene);
    }
}

static void programs_of_every_form_of_silhouettes_link(void **state)
{
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_SILHOUETTE);
    const struct glb_material_desc plain = {.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1};
    open_lobes(&scene, &plain);
    view.lights = &lamp;
    view.light_count = 1;
    for (int form = 0; form < VIEW_SILHOUETTE_FORMS; form++) {
        bool is_drawn = form != VIEW_SILHOUETTE_COMPUTE;
        view.quality.silhouette_form = (enum view_silhouette_form)form;
        link_all_with(&scene, &view,
                      form == VIEW_SILHOUETTE_STENCIL ? "volume_tally.comp.glsl"
                      : is_drawn                      ? "volume_counted.frag.glsl"
                                                      : "volume_cover.comp.glsl");
    }
    close_scene(&scene);
}

/* Integers, and half floats of both kinds; orthographic eyes, too. */
static void programs_of_every_form_of_volumes_link(void **state)
{
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_VOLUME);
    const struct glb_material_desc plain = {.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1};
    open_lobes(&scene, &plain);
    view.lights = &lamp;
    view.light_count = 1;
    for (int i = 0; i < 6; i++) {
        view.camera.ortho_height = i % 2 ? 4 : 0;
        view.quality.faithful = i >= 2;
        view.quality.volume_map = i >= 4 ? VIEW_VOLUME_FACTORS : VIEW_VOLUME_LOGARITHMS;
        link_all_with(&scene, &view, i >= 2 ? "volume_drawn.frag.glsl" : "volume_cover.comp.glsl");
    }
    close_scene(&scene);
}

/* With few points of a light and with many, whole casters and cut ones. */
static void programs_of_area_shadows_link(void **state)
{
    static const struct view_light panel = {.type = SCENE_LIGHT_RECT,
                                            .position = {1, 3, 5},
                                            .direction = {0, -1, -1},
                                            .color = {1, 1, 1},
                                            .intensity = 90,
                                            .width_m = 1,
                                            .height_m = 0.5};
    static const double plane[1][4] = {{0, -1, 0, 0.5}};
    (void)state;
    struct warm_scene scene;
    struct view view = view_by(SHADOWS_AREA);
    const struct glb_material_desc plain = {.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1};
    open_lobes(&scene, &plain);
    view.lights = &panel;
    view.light_count = 1;
    view.clip_planes = plane;
    for (int i = 0; i < 4; i++) {
        view.clip_plane_count = i % 2;
        view.quality.area_samples = i >= 2 ? 16 : 4;
        link_all_with(&scene, &view, "area_find.comp.glsl");
    }
    close_scene(&scene);
}

static struct environment *attach_studio(struct renderer *renderer)
{
    struct error err = {0};
    struct environment *studio = environment_create_studio(&err);
    const struct renderer_environment_desc desc = {.key = "studio", .environment = studio};
    if (!studio || !renderer_attach_environment(renderer, &desc, &err))
        fail_msg("%s", err.message);
    return studio;
}

/* Beside a lamp, seen behind the scene. */
static void link_under_the_studio(struct warm_scene *scene, int samples)
{
    struct environment *studio = attach_studio(scene->renderer);
    struct view view = view_by(SHADOWS_DEEP);
    view.quality.samples = samples;
    view.lights = &lamp;
    view.light_count = 1;
    view.environment_key = "studio";
    view.environment_intensity = 1;
    view.environment_is_background = true;
    link_all(scene, &view);
    renderer_detach_environment(scene->renderer, "studio");
    environment_destroy(studio);
}

static void programs_of_environments_link(void **state)
{
    struct warm_scene scene;
    (void)state;
    open_demo(&scene);
    link_under_the_studio(&scene, 1);
    close_scene(&scene);
    for (int i = 0; i < 2; i++) {
        open_lobes(&scene, &lobes[i]);
        link_under_the_studio(&scene, 4);
        close_scene(&scene);
    }
}

/* The light of slices, its sums, lamps along the ways of pixels, and pictures that look them up. */
static void programs_of_haze_link(void **state)
{
    static const char *const files[] = {"atmosphere_light.comp.glsl", "atmosphere_sum.comp.glsl",
                                        "atmosphere_glow.comp.glsl",
                                        "atmosphere_glow_add.comp.glsl"};
    (void)state;
    struct warm_scene scene;
    open_demo(&scene);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct view view = view_by(i % 2 ? SHADOWS_DEEP : SHADOWS_MAP);
        view.atmosphere = (struct view_atmosphere){.density_per_m = 0.05, .color = {1, 1, 1}};
        view.quality.samples = i < 2 ? 1 : 4;
        link_all_with(&scene, &view, files[i]);
    }
    close_scene(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(programs_of_every_technique_link),
        cmocka_unit_test(programs_of_every_output_and_camera_link),
        cmocka_unit_test(programs_that_sort_long_lists_link_before_any_list_is_counted),
        cmocka_unit_test(programs_of_approximated_and_filtered_lists_link),
        cmocka_unit_test(programs_of_media_and_of_cuts_link),
        cmocka_unit_test(programs_of_lobes_link),
        cmocka_unit_test(programs_of_every_form_of_silhouettes_link),
        cmocka_unit_test(programs_of_every_form_of_volumes_link),
        cmocka_unit_test(programs_of_area_shadows_link),
        cmocka_unit_test(programs_of_environments_link),
        cmocka_unit_test(programs_of_haze_link),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
