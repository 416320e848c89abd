/* SPDX-License-Identifier: MIT */
/* Shadow volumes of more triangles than a storage block takes: on a device with blocks of 1 MiB,
 * 32,768 faces, pictures have the bits that they have where all casters are in one. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"

enum { WIDTH_PX = 32, HEIGHT_PX = 24, FACES = 32768, LIGHTS = 2 };
enum { SOUP = FACES / 2 - 2, FAN = 200 }; /* with the floor two chunks of 8192 triangles */

static const struct shot {
    const char *name;
    struct view_quality quality;
    bool is_rounded; /* half floats, which are added up in another order */
} shots[] = {
    /* of all scenes, under both lights */
    {"volume", {.shadows = SHADOWS_VOLUME}, false},
    {"compute", {.shadows = SHADOWS_SILHOUETTE}, false},
    /* of some, under the first: those of single triangles take 40 s for so many in one pass */
    {"volume, four samples", {.shadows = SHADOWS_VOLUME, .samples = 4}, false},
    {"geometry",
     {.shadows = SHADOWS_SILHOUETTE, .silhouette_form = VIEW_SILHOUETTE_GEOMETRY},
     false},
    {"tessellation",
     {.shadows = SHADOWS_SILHOUETTE, .silhouette_form = VIEW_SILHOUETTE_TESSELLATION},
     false},
    {"two passes",
     {.shadows = SHADOWS_SILHOUETTE, .silhouette_form = VIEW_SILHOUETTE_TRIANGLES_TWO_PASS},
     false},
    {"stencil", {.shadows = SHADOWS_SILHOUETTE, .silhouette_form = VIEW_SILHOUETTE_STENCIL}, false},
    {"logarithms", {.shadows = SHADOWS_VOLUME, .faithful = true}, true},
    {"factors",
     {.shadows = SHADOWS_VOLUME, .faithful = true, .volume_map = VIEW_VOLUME_FACTORS},
     true},
};
enum { SHOTS = sizeof shots / sizeof *shots, QUICK = 2 * LIGHTS, PICTURES = SHOTS + QUICK - 2 };
enum { FOR_SPHERES = 4 }; /* the last ones */

static int add_material(struct glb_builder *builder, int color)
{
    return glb_builder_add_material(
        builder, &(struct glb_material_desc){
                     .base_color = {0.9 - 0.2 * (color % 4), 0.95 - 0.1 * color, 0.8, 1},
                     .transmission = color == 2 ? 0 : 1,
                     .has_ior = true,
                     .ior = 1,
                     .is_double_sided = true});
}

static void add_mesh(struct glb_builder *builder, int mesh)
{
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Caster", .mesh = mesh});
}

/* Closed bodies, all but one of which light passes; the first chunk ends within the first one. */
static void build_spheres(struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Spheres", 0);
    closed_form_floor(scene, builder, 4);
    for (int i = 0; i < 3; i++) {
        static const int stacks[] = {45, 38, 20}; /* 7920, 5624 and 1520 triangles */
        struct shape ball = {0};
        const double center[3] = {0.9 * (i - 1), 0.9 + 0.15 * i, 0.4 * (i % 2)};
        shape_add_sphere(&ball, center, 0.6, 2 * stacks[i], stacks[i]);
        add_mesh(builder, shape_give_mesh(&ball, builder, "Ball", add_material(builder, i)));
    }
    closed_form_end(scene, builder);
}

static void build_soup(struct closed_form_scene *scene, int fan)
{
    enum { ROW = 128 };
    const int first = (SOUP - fan) / 2;
    const float ends[2][3] = {{-0.9f, 1, -0.1f}, {0.8f, 1.1f, 0.2f}};
    struct glb_builder *builder = closed_form_begin(scene, "Soup", 0);
    float(*triangles)[9] = calloc(SOUP, sizeof *triangles);
    assert_non_null(triangles);
    closed_form_floor(scene, builder, 4);
    for (int i = 0; i < SOUP; i++) {
        const int row = i / ROW, column = i % ROW;
        float x = 0.02f * (float)column - 1.28f, z = 0.02f * (float)row - 1.28f;
        float y = 0.8f + 0.001f * (float)(i % 97), angle = 0.7f * (float)i;
        const float apart[9] = {x, y, z, x + 0.017f, y, z + 0.004f, x, y + 0.01f, z + 0.015f};
        const float out[3] = {0.001f * (float)(i % 400) - 0.2f, 1.05f + 0.6f * sinf(angle),
                              0.6f * cosf(angle)};
        if (i < first || i >= first + fan) {
            memcpy(triangles[i], apart, sizeof apart);
            continue;
        }
        memcpy(triangles[i], ends[i % 2], sizeof *ends);
        memcpy(triangles[i] + 3, ends[(i + 1) % 2], sizeof *ends);
        memcpy(triangles[i] + 6, out, sizeof out);
    }
    const struct glb_primitive_desc primitive = {.material = add_material(builder, 0),
                                                 .vertex_count = 3 * (size_t)SOUP,
                                                 .positions = triangles[0]};
    add_mesh(builder, glb_builder_add_mesh(builder, "Soup", &primitive, 1));
    closed_form_end(scene, builder);
    free(triangles);
}

/* Triangles about one edge, in the middle of others. */
static void build_fan(struct closed_form_scene *scene)
{
    build_soup(scene, FAN);
}

/* Those of the second chunk have 32,768 faces. */
static void build_apart(struct closed_form_scene *scene)
{
    build_soup(scene, 0);
}

static const struct view_light lights[LIGHTS] = {
    {.type = SCENE_LIGHT_POINT, .position = {0.4, 4, 0.9}, .color = {1, 1, 1}, .intensity = 60},
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {0.5, -1, 0.3},
     .color = {1, 1, 1},
     .intensity = 3},
};

static const struct shot *shot_of(int at)
{
    return &shots[at < QUICK ? at / LIGHTS : at - QUICK + 2];
}

/* Forms of silhouettes have the picture of the default one, of which the first light's comes first.
 */
static int same_as(int at)
{
    return shot_of(at)->quality.silhouette_form == VIEW_SILHOUETTE_COMPUTE ? at : LIGHTS;
}

/* Empty where it was refused. */
static void shoot_by(struct renderer *renderer, const struct rig_scene *rig,
                     const struct shot *shot, const struct view_light *light, struct image *picture)
{
    struct frame frame = {0};
    struct error err = {0};
    struct view view = {.width_px = WIDTH_PX,
                        .height_px = HEIGHT_PX,
                        .outputs = 1u << VIEW_OUTPUT_COLOR,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {1.5, 2.2, 3.5},
                                   .target = {0, 0.5, 0},
                                   .fov_y_deg = 50},
                        .lights = light,
                        .light_count = 1,
                        .ignore_scene_lights = true,
                        .quality = shot->quality};
    view.quality.samples = view.quality.samples ? view.quality.samples : 1;
    if (renderer_render(renderer, rig->key, &view, &frame, &err)) {
        *picture = frame.outputs[VIEW_OUTPUT_COLOR];
        frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    } else if (!strstr(err.message, "a stencil counts no further")) {
        fail_msg("%s: %s", shot->name, err.message);
    }
    frame_finish(&frame);
}

static void shoot_one(struct renderer *renderer, const struct rig_scene *rig, int at,
                      struct image *picture)
{
    shoot_by(renderer, rig, shot_of(at), &lights[at < QUICK ? at % LIGHTS : 0], picture);
}

static void shoot_all(bool has_small_blocks, const struct closed_form_scene *scene, int count,
                      struct image pictures[PICTURES])
{
    struct rig_scene rig;
    char text[1024];
    gl_hooks_install(&(struct gl_hooks_desc){.hostility = {.has_small_blocks = has_small_blocks}});
    struct renderer *renderer = render_rig_create();
    rig_scene_open(&rig, renderer, "casters", scene->glb, scene->size_bytes);
    for (int i = 0; i < count; i++)
        if (has_small_blocks || same_as(i) == i)
            shoot_one(renderer, &rig, i, &pictures[i]);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    if (gl_faults_take(text, sizeof text))
        fail_msg("%s", text);
    gl_hooks_install(&(struct gl_hooks_desc){.counts = false});
}

static void compare(const char *scene, int at, const struct image *ours, const struct image *small)
{
    const struct shot *shot = shot_of(at);
    double share = image_share_differing(ours, small, shot->is_rounded ? 2e-2 : 0, 0);
    if (share > (shot->is_rounded ? 0.03 : 0))
        fail_msg("%s, %s, picture %d: %g of the pixels differ", scene, shot->name, at, share);
    if (!shot->is_rounded)
        assert_same_bits(ours, small);
}

/* Returns how many of so many pictures there are. A stencil may be refused: it counts what chunks
 * share in each. */
static int check(void (*build)(struct closed_form_scene *), const char *name, int count)
{
    struct closed_form_scene scene;
    struct image ours[PICTURES] = {{0}}, small[PICTURES] = {{0}};
    int compared = 0;
    build(&scene);
    shoot_all(false, &scene, count, ours);
    shoot_all(true, &scene, count, small);
    for (int i = 0; i < count; i++) {
        if (small[i].pixels) {
            compare(name, i, &ours[same_as(i)], &small[i]);
            compared++;
        }
    }
    for (int i = 0; i < count; i++) {
        image_finish(&ours[i]);
        image_finish(&small[i]);
    }
    closed_form_scene_finish(&scene);
    printf("%s: %d pictures are the same\n", name, compared);
    return compared;
}

static void chunks_end_within_bodies(void **state)
{
    (void)state;
    assert_int_equal(check(build_spheres, "spheres", PICTURES), PICTURES);
}

static void chunks_end_within_the_triangles_of_an_edge(void **state)
{
    (void)state;
    assert_int_equal(check(build_fan, "fan", PICTURES - FOR_SPHERES), PICTURES - FOR_SPHERES);
}

static void chunks_may_be_full(void **state)
{
    (void)state;
    assert_int_equal(check(build_apart, "apart", QUICK), QUICK);
}

/* 3024 patches of 32 vertices, of which llvmpipe loses some where a draw has more than 65,536. */
static void build_ball(struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Ball", 0);
    struct shape ball = {0};
    closed_form_floor(scene, builder, 4);
    shape_add_sphere(&ball, (double[]){0, 1, 0}, 0.7, 56, 28);
    add_mesh(builder, shape_give_mesh(&ball, builder, "Ball", add_material(builder, 0)));
    closed_form_end(scene, builder);
}

static void one_pass_may_have_more_vertices_than_a_draw(void **state)
{
    (void)state;
    static const enum view_silhouette_form forms[] = {VIEW_SILHOUETTE_COMPUTE,
                                                      VIEW_SILHOUETTE_TRIANGLES_ONE_PASS};
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct image pictures[2] = {{0}};
    build_ball(&scene);
    struct renderer *renderer = render_rig_create();
    rig_scene_open(&rig, renderer, "ball", scene.glb, scene.size_bytes);
    for (int i = 0; i < 2; i++) {
        const struct shot shot = {
            "ball", {.shadows = SHADOWS_SILHOUETTE, .silhouette_form = forms[i]}, false};
        shoot_by(renderer, &rig, &shot, &lights[0], &pictures[i]);
    }
    assert_same_bits(&pictures[0], &pictures[1]);
    for (int i = 0; i < 2; i++)
        image_finish(&pictures[i]);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    setenv("VITRAIL_WIDE_FLOATS", "f64", false); /* or busy processors decide between the forms */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chunks_end_within_bodies),
        cmocka_unit_test(chunks_end_within_the_triangles_of_an_edge),
        cmocka_unit_test(chunks_may_be_full),
        cmocka_unit_test(one_pass_may_have_more_vertices_than_a_draw),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
