/* SPDX-License-Identifier: MIT */
/* Shadow volumes, silhouettes and grids of triangles in closed form: what is left of a light on a
 * floor is the product of the filters of the triangles on its way, whatever their edges have in
 * common, wherever the eye is. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/shadow_rig.h"

enum { SIDE_PX = 48, TRIANGLES_MAX = 320 };

struct triangle {
    double corners[3][3];
    int color; /* of `colors` */
};

static const double colors[][3] = {
    {0.5, 0.25, 1}, {0.75, 0.5, 0.125}, {0.3, 1, 0.6}, {0, 0, 0}, {0.96, 0.9, 1}};
enum { COLORS = 5, OPAQUE = 3, FAINT = 4 };

/* Of one picture after the other. */
static const struct {
    enum shadow_technique shadows;
    const char *pass;
} techniques[] = {{SHADOWS_VOLUME, "shadow.volumes"},
                  {SHADOWS_SILHOUETTE, "shadow.volumes"},
                  {SHADOWS_AREA, "shadow.area"}};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

/* Likewise, as published: half floats, and masks by a table. What they are off by is told. */
static const struct {
    const char *name;
    struct view_quality quality;
} published[] = {
    {"logarithms", {.shadows = SHADOWS_VOLUME, .faithful = true}},
    {"factors", {.shadows = SHADOWS_VOLUME, .faithful = true, .volume_map = VIEW_VOLUME_FACTORS}},
    {"masks by a table", {.shadows = SHADOWS_AREA, .faithful = true}}};
enum { PUBLISHED = sizeof published / sizeof *published };

struct soup {
    struct triangle triangles[TRIANGLES_MAX];
    int count;
};

static void add(struct soup *soup, int color, const double a[3], const double b[3],
                const double c[3])
{
    assert_true(soup->count < TRIANGLES_MAX);
    struct triangle *t = &soup->triangles[soup->count++];
    memcpy(t->corners[0], a, sizeof t->corners[0]);
    memcpy(t->corners[1], b, sizeof t->corners[1]);
    memcpy(t->corners[2], c, sizeof t->corners[2]);
    t->color = color;
}

/* Level, half a metre around the axis, a little askew. */
static void add_sheet(struct soup *soup, int color, double y)
{
    const double p[4][3] = {{-0.5, y, -0.45}, {0.55, y, -0.5}, {0.5, y, 0.48}, {-0.52, y, 0.5}};
    add(soup, color, p[0], p[1], p[2]);
    add(soup, color, p[0], p[2], p[3]);
}

static void add_box(struct soup *soup, int color, const double low[3], const double high[3])
{
    static const int faces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                    {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    double p[8][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            p[i][k] = i >> k & 1 ? high[k] : low[k];
    for (int i = 0; i < 6; i++) {
        add(soup, color, p[faces[i][0]], p[faces[i][1]], p[faces[i][2]]);
        add(soup, color, p[faces[i][0]], p[faces[i][2]], p[faces[i][3]]);
    }
}

/* A mesh and a material for each colour; all triangles have vertices of their own. */
static void build(const struct soup *soup, struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Soup", 0);
    closed_form_floor(scene, builder, 4);
    for (int color = 0; color < COLORS; color++) {
        float positions[TRIANGLES_MAX][9];
        size_t count = 0;
        for (int i = 0; i < soup->count; i++) {
            const struct triangle *t = &soup->triangles[i];
            for (int k = 0; t->color == color && k < 9; k++)
                positions[count][k] = (float)t->corners[k / 3][k % 3];
            count += t->color == color;
        }
        if (!count)
            continue;
        struct glb_material_desc material = {.name = "Filter",
                                             .base_color = {0, 0, 0, 1},
                                             .transmission = color == OPAQUE ? 0 : 1,
                                             .has_ior = true,
                                             .ior = 1,
                                             .is_double_sided = true};
        for (int k = 0; k < 3; k++)
            material.base_color[k] = colors[color][k];
        const struct glb_primitive_desc primitive = {
            .material = glb_builder_add_material(builder, &material),
            .vertex_count = 3 * count,
            .positions = positions[0]};
        struct glb_node_desc node = {.name = "Soup",
                                     .mesh = glb_builder_add_mesh(builder, "Soup", &primitive, 1)};
        glb_builder_add_node(builder, &node);
    }
    closed_form_end(scene, builder);
}

static double volume_of(const double a[3], const double b[3], const double c[3], const double d[3])
{
    double u[3], v[3], w[3], n[3];
    vec3_sub(b, a, u);
    vec3_sub(c, a, v);
    vec3_sub(d, a, w);
    vec3_cross(u, v, n);
    return vec3_dot(n, w);
}

/* Whether the triangle is between two points: 1, 0, or -1 where that hangs on a hair. */
static int is_between(const struct triangle *t, const double p[3], const double q[3])
{
    const double hair = 2e-4;
    const double(*c)[3] = t->corners;
    double inside[3], ends[2] = {volume_of(c[0], c[1], c[2], p), volume_of(c[0], c[1], c[2], q)};
    double u[3], v[3], n[3], length = vec3_length((vec3_sub(q, p, u), u));
    vec3_sub(c[1], c[0], u);
    vec3_sub(c[2], c[0], v);
    vec3_cross(u, v, n);
    if (vec3_length(n) < 1e-9) /* a line */
        return 0;
    int sign = 0;
    bool is_near = false;
    for (int i = 0; i < 3; i++) {
        vec3_sub(c[(i + 1) % 3], c[i], u);
        inside[i] = volume_of(p, q, c[i], c[(i + 1) % 3]) / length / vec3_length(u);
        is_near |= fabs(inside[i]) < hair;
        sign += inside[i] > 0 ? 1 : -1;
    }
    if (fabs(ends[0]) < hair * vec3_length(n) || fabs(ends[1]) < 1e-9)
        return fabs(ends[1]) < 1e-9 ? 0 : -1;
    return (ends[0] > 0) == (ends[1] > 0) ? 0 : is_near ? -1 : abs(sign) == 3;
}

struct answer {
    int compared, counts[64]; /* by the number of triangles on the way */
    int views;
    double off[PUBLISHED]; /* at most, where no caster is before the floor */
};

/* Whether triangles are before the point as the eye sees it. */
static bool is_seen_through(const struct soup *soup, const struct view_camera *camera,
                            const double point[3])
{
    double from[3], back[3];
    vec3_sub(camera->eye, camera->target, back);
    for (int k = 0; k < 3; k++)
        from[k] = camera->ortho_height > 0 ? point[k] + 100 * back[k] : camera->eye[k];
    for (int i = 0; i < soup->count; i++)
        if (is_between(&soup->triangles[i], point, from))
            return true;
    return false;
}

/* Through panes the floor is seen with what they reflect, which is little where light does not
 * graze them. */
static void expect(const struct soup *soup, const struct view *view, const double point[3],
                   const float ratio[3], const char *name, struct answer *answer, double *off)
{
    const struct view_light *light = view->lights;
    bool is_dim = is_seen_through(soup, &view->camera, point);
    double tolerance = is_dim ? 2e-3 : 2e-5;
    if (is_dim && (off || (light->type == SCENE_LIGHT_DIRECTIONAL && light->direction[1] > -0.5)))
        return;
    double expected[3] = {1, 1, 1}, at[3];
    int count = 0;
    for (int k = 0; k < 3; k++)
        at[k] = light->type == SCENE_LIGHT_DIRECTIONAL ? point[k] - 1000 * light->direction[k]
                                                       : light->position[k];
    for (int i = 0; i < soup->count; i++) {
        int found = is_between(&soup->triangles[i], point, at);
        if (found < 0)
            return;
        count += found;
        for (int k = 0; found && k < 3; k++)
            expected[k] *= colors[soup->triangles[i].color][k];
    }
    for (int k = 0; off && k < 3; k++)
        *off = fmax(*off, fabs((double)ratio[k] - expected[k]));
    if (off)
        return;
    answer->compared++;
    answer->counts[count < 63 ? count : 63]++;
    for (int k = 0; k < 3; k++)
        if (fabs((double)ratio[k] - expected[k]) > tolerance)
            fail_msg("%s: channel %d at (%g, %g) is %.7g instead of %.7g", name, k, point[0],
                     point[2], (double)ratio[k], expected[k]);
}

/* From below the casters, which is in their shadow; from beside; from above, through them; and the
 * same at infinity. */
static const struct view_camera cameras[] = {
    {.eye = {0.02, 0.4, 0.03}, .target = {0, 0, 0}, .up = {0, 0, -1}, .fov_y_deg = 100},
    {.eye = {3, 1.3, 2}, .target = {0, 0, 0}, .fov_y_deg = 50},
    {.eye = {0.4, 6, 1}, .target = {0, 0, 0}, .up = {0, 0, -1}, .fov_y_deg = 30},
    {.eye = {0, 0.4, 0}, .target = {0, 0, 0}, .up = {0, 0, -1}, .ortho_height = 3},
    {.eye = {2, 3, 2}, .target = {0, 0, 0}, .ortho_height = 3},
};

/* The last one leans towards eyes that look down, so that its volumes go where their way begins. */
static const struct view_light lights[] = {
    {.type = SCENE_LIGHT_POINT, .position = {0.13, 4, -0.21}},
    {.type = SCENE_LIGHT_SPOT,
     .position = {1.1, 3, 0.7},
     .direction = {-0.3, -1, -0.2},
     .inner_cone_deg = 70,
     .outer_cone_deg = 80},
    {.type = SCENE_LIGHT_DIRECTIONAL, .direction = {0.31, -1, 0.12}},
    {.type = SCENE_LIGHT_DIRECTIONAL, .direction = {0.9, -0.2, 0.8}},
};

/* Cone and range end among what is seen, where casters are. */
static const struct view_light narrow[] = {
    {.type = SCENE_LIGHT_SPOT,
     .position = {0.3, 3.2, -0.4},
     .direction = {-0.1, -1, 0.15},
     .range = 3.6f,
     .inner_cone_deg = 8,
     .outer_cone_deg = 14},
};

/* off: NULL: each point is right; else the most that one is off by. */
static void compare(const struct soup *soup, const struct view *view, const struct image *open,
                    const struct image *dark, const char *name, struct answer *answer, double *off)
{
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        double point[3];
        int x = i % SIDE_PX, y = i / SIDE_PX;
        const float *before = image_pixel_f32(open, x, y);
        const float *after = image_pixel_f32(dark, x, y);
        if (!view_meet_plane(view, x, y, (double[]){0, 1, 0}, 0, point) || fabs(point[0]) > 3 ||
            fabs(point[2]) > 3 || before[0] < 1e-2f)
            continue;
        float ratio[3];
        for (int k = 0; k < 3; k++)
            ratio[k] = before[k] > 0 ? after[k] / before[k] : 0;
        expect(soup, view, point, ratio, name, answer, off);
    }
}

/* Other stages of the device draw the same faces: each point is behind the same casters. A stencil
 * takes them many times over. */
static void compare_forms(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                          const struct image *computed, bool has_stencil, const char *name)
{
    const int end = has_stencil ? VIEW_SILHOUETTE_FORMS : VIEW_SILHOUETTE_STENCIL;
    for (int form = VIEW_SILHOUETTE_COMPUTE + 1; form < end; form++) {
        view.quality.silhouette_form = (enum view_silhouette_form)form;
        struct image drawn = shoot_color(renderer, rig, &view);
        for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
            const float *a = image_pixel_f32(computed, i % SIDE_PX, i / SIDE_PX);
            const float *b = image_pixel_f32(&drawn, i % SIDE_PX, i / SIDE_PX);
            if (memcmp(a, b, 4 * sizeof *a) != 0)
                fail_msg("%s: form %d has (%.9g, %.9g, %.9g) at %d, %d instead of (%.9g, %.9g, "
                         "%.9g)",
                         name, form, (double)b[0], (double)b[1], (double)b[2], i % SIDE_PX,
                         i / SIDE_PX, (double)a[0], (double)a[1], (double)a[2]);
        }
        image_finish(&drawn);
    }
}

static void compare_published(struct renderer *renderer, const struct rig_scene *rig,
                              const struct soup *soup, struct view view, const struct image *open,
                              const char *name, struct answer *answer)
{
    for (int i = 0; i < PUBLISHED; i++) {
        view.quality = published[i].quality;
        view.quality.samples = 1;
        struct image dark = shoot_color(renderer, rig, &view);
        compare(soup, &view, open, &dark, name, answer, &answer->off[i]);
        image_finish(&dark);
    }
}

static void check_view(struct renderer *renderer, const struct rig_scene *rig,
                       const struct soup *soup, struct view *view, const char *name,
                       struct answer *answer)
{
    view->quality.shadows = SHADOWS_NONE;
    struct image open = shoot_color(renderer, rig, view);
    for (int i = 0; i < TECHNIQUES; i++) {
        struct frame dark;
        view->quality.shadows = techniques[i].shadows;
        shoot(renderer, rig, view, &dark);
        assert_true(report_has_pass(&dark.report, techniques[i].pass,
                                    shadow_technique_name((int)techniques[i].shadows)));
        compare(soup, view, &open, &dark.outputs[VIEW_OUTPUT_COLOR], name, answer, NULL);
        if (techniques[i].shadows == SHADOWS_SILHOUETTE && answer->views++ % 3 == 0)
            compare_forms(renderer, rig, *view, &dark.outputs[VIEW_OUTPUT_COLOR],
                          answer->views % 9 == 1, name);
        frame_finish(&dark);
    }
    if (answer->views % 3 == 1)
        compare_published(renderer, rig, soup, *view, &open, name, answer);
    image_finish(&open);
}

/* The same of all eyes; returns how many points had so many triangles before them. */
static struct answer check_lights(struct renderer *renderer, const struct soup *soup,
                                  const char *name, const struct view_light *from, size_t count)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct answer answer = {0};
    build(soup, &scene);
    rig_scene_open(&rig, renderer, name, scene.glb, scene.size_bytes);
    for (size_t c = 0; c < sizeof cameras / sizeof *cameras; c++)
        for (size_t l = 0; l < count; l++) {
            struct view_light light = from[l];
            struct view view = {.width_px = SIDE_PX,
                                .height_px = SIDE_PX,
                                .camera = cameras[c],
                                .lights = &light,
                                .light_count = 1,
                                .ignore_scene_lights = true,
                                .quality = {.samples = 1}};
            view.camera.kind = VIEW_CAMERA_LOOK_AT;
            light.intensity = light.type == SCENE_LIGHT_DIRECTIONAL ? 3 : 40;
            for (int k = 0; k < 3; k++)
                light.color[k] = 1;
            check_view(renderer, &rig, soup, &view, name, &answer);
        }
    printf("%s: %d points; %d, %d, %d, %d behind 0, 1, 2, 3 triangles\n", name, answer.compared,
           answer.counts[0], answer.counts[1], answer.counts[2], answer.counts[3]);
    for (int i = 0; i < PUBLISHED; i++)
        printf("    %s: off by %.2g at most\n", published[i].name, answer.off[i]);
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&scene);
    return answer;
}

static struct answer check(struct renderer *renderer, const struct soup *soup, const char *name)
{
    return check_lights(renderer, soup, name, lights, sizeof lights / sizeof *lights);
}

/* How far half floats are off, at most; factors of 1 lose the light behind an opaque caster. */
static void expect_published(const struct answer *answer, double logarithms, double factors)
{
    assert_true(answer->off[0] <= logarithms);
    assert_true(answer->off[1] <= factors && (factors < 1 || answer->off[1] > 0.9));
    assert_true(answer->off[2] <= 2e-5);
}

static void a_triangle_counts_once(void **state)
{
    struct soup soup = {.count = 0};
    add(&soup, 0, (double[]){-0.5, 1, -0.4}, (double[]){0.6, 1.2, -0.1}, (double[]){0, 0.9, 0.6});
    struct answer answer = check(*state, &soup, "triangle");
    assert_true(answer.counts[1] > 500 && answer.counts[2] == 0);
}

static void sheets_multiply_in_two_colors(void **state)
{
    struct soup soup = {.count = 0};
    add_sheet(&soup, 0, 0.8);
    add_sheet(&soup, 1, 1);
    add_sheet(&soup, 0, 1.2);
    add_sheet(&soup, 2, -0.5); /* below the floor: on no way */
    struct answer answer = check(*state, &soup, "sheets");
    assert_true(answer.counts[3] > 500);
}

static void a_spot_ends_among_its_shadows(void **state)
{
    struct soup soup = {.count = 0};
    for (int i = 0; i < 4; i++)
        add_box(&soup, i % 3, (double[]){0.4 * i - 0.9, 0.3, -0.5},
                (double[]){0.4 * i - 0.7, 0.5 + 0.2 * i, 0.5});
    struct answer answer = check_lights(*state, &soup, "narrow spot", narrow, 1);
    assert_true(answer.counts[0] > 500 && answer.counts[2] > 500);
}

static void a_box_counts_twice_from_within_too(void **state)
{
    struct soup soup = {.count = 0};
    add_box(&soup, 2, (double[]){-0.5, 0.7, -0.4}, (double[]){0.45, 1.3, 0.5});
    struct answer answer = check(*state, &soup, "box");
    assert_true(answer.counts[2] > 500 && answer.counts[1] == 0);
    soup.count = 0; /* about the first eye and the floor */
    add_box(&soup, 2, (double[]){-0.7, -0.3, -0.6}, (double[]){0.65, 0.8, 0.7});
    answer = check(*state, &soup, "box about the eye");
    expect_published(&answer, 2e-3, 1e-3);
    assert_true(answer.counts[1] > 500);
}

/* Three triangles and more on an edge, the same twice, and such that are no more than a line. */
static void edges_may_have_any_triangles(void **state)
{
    struct soup soup = {.count = 0};
    const double a[3] = {-0.6, 1, -0.1}, b[3] = {0.6, 1.1, 0.1};
    for (int i = 0; i < 5; i++) {
        double angle = 1.1 * i;
        add(&soup, i % 3, a, b, (double[]){0.1, 1 + 0.5 * sin(angle), 0.6 * cos(angle)});
    }
    add(&soup, 0, b, a, (double[]){0.1, 1, 0.6}); /* once more, turned */
    add(&soup, 1, a, b, a);                       /* a line */
    add(&soup, 1, a, b, (double[]){0, 1.05, 0});  /* likewise */
    add(&soup, OPAQUE, b, (double[]){0.9, 1, 0.1}, (double[]){0.8, 1, -0.3});
    struct answer answer = check(*state, &soup, "edge of many");
    expect_published(&answer, 5e-3, 1);
    assert_true(answer.counts[1] > 500 && answer.counts[2] > 500);
}

/* More than a counter of 32 coincident faces could tell, some of them turned. */
static void an_edge_may_have_forty_triangles(void **state)
{
    struct soup soup = {.count = 0};
    const double a[3] = {-0.6, 1, -0.1}, b[3] = {0.6, 1.1, 0.1};
    for (int i = 0; i < 40; i++) {
        const double c[3] = {0.01 * i - 0.2, 1 + 0.002 * i, 0.6};
        add(&soup, FAINT, i % 3 ? a : b, i % 3 ? b : a, c);
    }
    struct answer answer = check(*state, &soup, "edge of forty");
    expect_published(&answer, 0.06, 0.04);
    int many = 0;
    for (int i = 33; i <= 40; i++)
        many += answer.counts[i];
    assert_true(many > 500);
}

/* Half a turn along the strip, so that no side of it is the outer one. */
static void a_strip_of_moebius_casts_its_shadow(void **state)
{
    struct soup soup = {.count = 0};
    enum { STEPS = 24 };
    double rims[STEPS + 1][2][3];
    for (int i = 0; i <= STEPS; i++)
        for (int side = 0; side < 2; side++) {
            double turn = 6.283185307179586 * i / STEPS, half = side ? 0.2 : -0.2;
            double out = 0.6 + half * cos(turn / 2);
            const double at[3] = {out * cos(turn), 1.2 + half * sin(turn / 2), out * sin(turn)};
            memcpy(rims[i][side], at, sizeof at);
        }
    memcpy(rims[STEPS][0], rims[0][1], sizeof rims[0][1]); /* to the bit */
    memcpy(rims[STEPS][1], rims[0][0], sizeof rims[0][0]);
    for (int i = 0; i < STEPS; i++) {
        add(&soup, i % 5 ? 1 : OPAQUE, rims[i][0], rims[i][1], rims[i + 1][0]);
        add(&soup, i % 5 ? 1 : OPAQUE, rims[i][1], rims[i + 1][1], rims[i + 1][0]);
    }
    struct answer answer = check(*state, &soup, "strip of Moebius");
    expect_published(&answer, 0.08, 1);
    assert_true(answer.counts[1] > 500);
}

/* Neighbours whose edges are not shared: what is beside the seams is counted as ever. */
static void edges_may_end_within_others(void **state)
{
    struct soup soup = {.count = 0};
    const double a[3] = {-0.5, 1, 0}, b[3] = {0.5, 1, 0}, between[3] = {0.1, 1, 0};
    add(&soup, 0, a, b, (double[]){0, 1.1, -0.6});
    add(&soup, 0, a, between, (double[]){-0.2, 0.9, 0.5});
    add(&soup, 0, between, b, (double[]){0.3, 0.9, 0.5});
    struct answer answer = check(*state, &soup, "T-junction");
    expect_published(&answer, 1e-6, 1e-6);
    assert_true(answer.counts[1] > 500 && answer.counts[2] == 0);
}

static void add_sphere(struct soup *soup, const double center[3], double radius)
{
    enum { AROUND = 6, RINGS = 3 };
    double p[RINGS + 1][AROUND][3];
    for (int ring = 0; ring <= RINGS; ring++)
        for (int i = 0; i < AROUND; i++) {
            double up = 3.141592653589793 * ring / RINGS, turn = 6.283185307179586 * i / AROUND;
            double out = ring % RINGS ? radius * sin(up) : 0;
            const double at[3] = {center[0] + out * cos(turn), center[1] + radius * cos(up),
                                  center[2] + out * sin(turn)};
            memcpy(p[ring][i], at, sizeof at);
        }
    for (int ring = 0; ring < RINGS; ring++)
        for (int i = 0; i < AROUND; i++) {
            int next = (i + 1) % AROUND;
            if (ring > 0)
                add(soup, OPAQUE, p[ring][i], p[ring][next], p[ring + 1][i]);
            if (ring < RINGS - 1)
                add(soup, OPAQUE, p[ring][next], p[ring + 1][next], p[ring + 1][i]);
        }
}

/* Closed bodies, and a light that moves over them: each point of the floor is lit or dark. */
static void a_grid_of_spheres_has_no_cracks(void **state)
{
    enum { FRAMES = 24 };
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct soup soup = {.count = 0};
    struct answer answer = {0};
    for (int i = 0; i < 9; i++)
        add_sphere(&soup, (double[]){0.6 * (i % 3 - 1), 0.7, 0.6 * (i / 3 - 1)}, 0.25);
    build(&soup, &scene);
    rig_scene_open(&rig, *state, "spheres", scene.glb, scene.size_bytes);
    for (int i = 0; i < FRAMES; i++) {
        double turn = 6.283185307179586 * i / FRAMES;
        struct view_light light = {.type = i % 2 ? SCENE_LIGHT_POINT : SCENE_LIGHT_DIRECTIONAL,
                                   .position = {1.5 * cos(turn), 2.5, 1.5 * sin(turn)},
                                   .direction = {cos(turn), -1.2, sin(turn)},
                                   .color = {1, 1, 1},
                                   .intensity = i % 2 ? 40 : 3};
        struct view view = {.width_px = SIDE_PX,
                            .height_px = SIDE_PX,
                            .camera = cameras[i % 3],
                            .lights = &light,
                            .light_count = 1,
                            .ignore_scene_lights = true,
                            .quality = {.samples = 1}};
        view.camera.kind = VIEW_CAMERA_LOOK_AT;
        check_view(*state, &rig, &soup, &view, "grid of spheres", &answer);
    }
    int dark = answer.compared - answer.counts[0];
    printf("grid of spheres: %d points, %d of them in shadow\n", answer.compared, dark);
    assert_true(answer.counts[0] > 5000 && dark > 5000);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* Its plane runs through the first light, where it casts no shadow. */
static void a_triangle_in_the_plane_of_the_light_casts_none(void **state)
{
    struct soup soup = {.count = 0};
    const double *at = lights[0].position;
    add(&soup, 1, (double[]){at[0], 1, -0.8}, (double[]){at[0], 1, 0.5}, (double[]){at[0], 2, 0});
    add_sheet(&soup, 0, 0.9);
    struct answer answer = check(*state, &soup, "plane of the light");
    expect_published(&answer, 1e-3, 1e-3);
}

static void a_soup_of_triangles_is_exact(void **state)
{
    struct soup soup = {.count = 0};
    uint64_t seed = 11;
    double points[24][3];
    for (int i = 0; i < 24; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = rig_random(&seed) * (k == 1 ? 1.2 : 1.6) + (k == 1 ? 0.6 : -0.8);
    for (int i = 0; i < 60; i++) {
        int a = (int)(24 * rig_random(&seed)), b = (a + 1 + (int)(23 * rig_random(&seed))) % 24;
        int c = (int)(24 * rig_random(&seed));
        if (c != a && c != b)
            add(&soup, i % 19 ? i % 3 : OPAQUE, points[a], points[b], points[c]);
    }
    check(*state, &soup, "soup");
}

/* A counter for each of 24 filters is all that there is; silhouettes by compute then add up
 * logarithms. The plan tells both before anything is drawn. */
static void filters_without_counters_are_refused_where_stages_draw(void **state)
{
    enum { FILTERS = 25 };
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct glb_builder *builder = closed_form_begin(&scene, "Filters", 0);
    closed_form_floor(&scene, builder, 4);
    for (int i = 0; i < FILTERS; i++) {
        const float x = 0.1f * (float)i - 1.2f, positions[9] = {x, 1, 0, x + 0.09f, 1, 0, x, 1, 1};
        const struct glb_material_desc material = {.base_color = {0.02 + 0.03 * i, 0.5, 0.5, 1},
                                                   .transmission = 1,
                                                   .has_ior = true,
                                                   .ior = 1,
                                                   .is_double_sided = true};
        const struct glb_primitive_desc primitive = {
            .material = glb_builder_add_material(builder, &material),
            .vertex_count = 3,
            .positions = positions};
        struct glb_node_desc node = {.mesh = glb_builder_add_mesh(builder, "", &primitive, 1)};
        glb_builder_add_node(builder, &node);
    }
    closed_form_end(&scene, builder);
    rig_scene_open(&rig, *state, "filters", scene.glb, scene.size_bytes);
    struct view_light light = lights[0];
    struct view view = {.width_px = SIDE_PX,
                        .height_px = SIDE_PX,
                        .camera = cameras[1],
                        .outputs = 1u << VIEW_OUTPUT_COLOR,
                        .lights = &light,
                        .light_count = 1,
                        .ignore_scene_lights = true,
                        .quality = {.samples = 1, .shadows = SHADOWS_SILHOUETTE}};
    view.camera.kind = VIEW_CAMERA_LOOK_AT;
    light.intensity = 40;
    light.color[0] = light.color[1] = light.color[2] = 1;
    struct frame summed;
    struct plan plan;
    struct error none = {0};
    const char *instead = "logarithms of their filters are added in place of counts";
    shoot(*state, &rig, &view, &summed);
    assert_true(report_has_warning(&summed.report, instead));
    assert_true(renderer_explain(*state, rig.key, &view, &plan, &none));
    assert_int_equal(plan.lacks.count, 1);
    assert_non_null(strstr(plan.lacks.texts[0], instead));
    frame_finish(&summed);
    for (int form = 1; form < VIEW_SILHOUETTE_FORMS; form++) {
        struct frame frame = {0};
        struct error err = {0}, told = {0};
        view.quality.silhouette_form = (enum view_silhouette_form)form;
        assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_UNSUPPORTED);
        assert_non_null(strstr(err.message, "more than 24 filters"));
        assert_false(renderer_explain(*state, rig.key, &view, &plan, &told));
        assert_int_equal(told.code, err.code);
        assert_string_equal(told.message, err.message);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* A file with such a vertex is refused before a technique sees it, by the vertex. */
static void expect_refused_file(struct renderer *renderer, const struct closed_form_scene *scene,
                                const float *vertex, float value)
{
    unsigned char *glb = malloc(scene->size_bytes), *at;
    struct rig_scene rig = {0};
    struct error err = {0};
    assert_non_null(glb);
    memcpy(glb, scene->glb, scene->size_bytes);
    at = memmem(glb, scene->size_bytes, vertex, 3 * sizeof *vertex);
    assert_non_null(at);
    memcpy(at + sizeof value, &value, sizeof value);
    assert_false(rig_scene_from_glb(&rig, renderer, "no number", glb, scene->size_bytes, &err));
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    assert_non_null(strstr(err.message, "element 1 is not finite"));
    rig_scene_finish(&rig, renderer);
    free(glb);
}

/* Files, matrices of requests, and what these make of vertices. */
static void positions_that_are_no_numbers_are_refused(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct soup soup = {.count = 0};
    const double second[3] = {0.6, 1.2, -0.1};
    const float vertex[3] = {0.6f, 1.2f, -0.1f}, bad[] = {NAN, INFINITY, -INFINITY};
    add(&soup, 0, (double[]){-0.5, 1, -0.4}, second, (double[]){0, 0.9, 0.6});
    build(&soup, &scene);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        expect_refused_file(*state, &scene, vertex, bad[i]);

    static const struct {
        double scale;
        enum error_code code; /* ERROR_NONE: drawn */
        const char *text;
    } matrices[] = {{NAN, ERROR_INVALID_REQUEST, "matrix of node 'Soup' is not finite"},
                    {INFINITY, ERROR_INVALID_REQUEST, "matrix of node 'Soup' is not finite"},
                    {1e300, ERROR_INVALID_REQUEST, "node 'Soup' is"},
                    {-1e13, ERROR_INVALID_REQUEST, "more than 1e+12 m from the origin"},
                    {1.5e12, ERROR_NONE, ""}};
    struct view_light light = lights[0];
    struct view view = {.width_px = SIDE_PX,
                        .height_px = SIDE_PX,
                        .outputs = 1u << VIEW_OUTPUT_COLOR,
                        .camera = cameras[1],
                        .lights = &light,
                        .light_count = 1,
                        .ignore_scene_lights = true,
                        .node_override_count = 1,
                        .quality = {.samples = 1}};
    view.camera.kind = VIEW_CAMERA_LOOK_AT;
    light.intensity = 40;
    light.color[0] = light.color[1] = light.color[2] = 1;
    rig_scene_open(&rig, *state, "numbers", scene.glb, scene.size_bytes);
    for (size_t i = 0; i < TECHNIQUES * sizeof matrices / sizeof *matrices; i++) {
        size_t m = i / TECHNIQUES;
        struct view_node_override moved = {.node = "Soup", .has_matrix = true};
        struct frame frame = {0};
        struct error err = {0};
        mat4_identity(moved.matrix);
        moved.matrix[0] = matrices[m].scale;
        view.nodes = &moved;
        view.quality.shadows = techniques[i % TECHNIQUES].shadows;
        bool is_drawn = renderer_render(*state, rig.key, &view, &frame, &err);
        assert_int_equal(err.code, matrices[m].code);
        assert_true(is_drawn ? matrices[m].code == ERROR_NONE
                             : strstr(err.message, matrices[m].text) != NULL);
        for (int p = 0; is_drawn && p < SIDE_PX * SIDE_PX; p++)
            assert_true(isfinite((double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR],
                                                         p % SIDE_PX, p / SIDE_PX)[0]));
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

static struct view view_from_beside(const struct view_light *light)
{
    struct view view = {.width_px = SIDE_PX,
                        .height_px = SIDE_PX,
                        .outputs = 1u << VIEW_OUTPUT_COLOR,
                        .camera = cameras[1],
                        .lights = light,
                        .light_count = 1,
                        .ignore_scene_lights = true,
                        .quality = {.samples = 1, .shadows = SHADOWS_SILHOUETTE}};
    view.camera.kind = VIEW_CAMERA_LOOK_AT;
    return view;
}

/* More triangles of one filter than eight bits count, but not on one way; and on one way. */
static void a_stencil_counts_as_far_as_it_can(void **state)
{
    enum { MANY = 300 };
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct view_light light = lights[0];
    light.intensity = 40;
    light.color[0] = light.color[1] = light.color[2] = 1;
    struct view view = view_from_beside(&light);
    view.quality.samples = 4;
    for (int is_stack = 0; is_stack < 2; is_stack++) {
        struct soup soup = {.count = 0};
        for (int i = 0; i < MANY; i++) {
            double x = is_stack ? -0.5 : 0.1 * (i % 20) - 1,
                   z = is_stack ? -0.5 : 0.1 * (i / 20) - 0.75;
            double size = is_stack ? 1 : 0.15;
            add(&soup, FAINT, (double[]){x, 1, z}, (double[]){x + size, 1.01, z},
                (double[]){x, 1, z + size});
        }
        build(&soup, &scene);
        rig_scene_open(&rig, *state, is_stack ? "stack" : "many", scene.glb, scene.size_bytes);
        view.quality.silhouette_form = VIEW_SILHOUETTE_COMPUTE;
        struct image computed = shoot_color(*state, &rig, &view);
        if (!is_stack)
            compare_forms(*state, &rig, view, &computed, true, "many");
        else {
            struct frame frame = {0};
            struct error err = {0};
            view.quality.silhouette_form = VIEW_SILHOUETTE_STENCIL;
            assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
            assert_int_equal(err.code, ERROR_UNSUPPORTED);
            assert_non_null(strstr(err.message, "a way crosses 255 faces"));
        }
        image_finish(&computed);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_triangle_counts_once),
        cmocka_unit_test(sheets_multiply_in_two_colors),
        cmocka_unit_test(a_spot_ends_among_its_shadows),
        cmocka_unit_test(a_box_counts_twice_from_within_too),
        cmocka_unit_test(edges_may_have_any_triangles),
        cmocka_unit_test(an_edge_may_have_forty_triangles),
        cmocka_unit_test(a_strip_of_moebius_casts_its_shadow),
        cmocka_unit_test(edges_may_end_within_others),
        cmocka_unit_test(a_grid_of_spheres_has_no_cracks),
        cmocka_unit_test(a_triangle_in_the_plane_of_the_light_casts_none),
        cmocka_unit_test(a_soup_of_triangles_is_exact),
        cmocka_unit_test(positions_that_are_no_numbers_are_refused),
        cmocka_unit_test(a_stencil_counts_as_far_as_it_can),
        cmocka_unit_test(filters_without_counters_are_refused_where_stages_draw),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
