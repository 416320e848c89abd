/* SPDX-License-Identifier: MIT */
/* Area lights of the ray tracer against closed forms: penumbrae (A7, A8) and irradiance (A12). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/scene/camera.h"
#include "tests/support/accuracy_log.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/import_support.h"
#include "tests/support/render_support.h"
#include "tests/support/raytrace_probe.h"

enum { SAMPLES = 4096, POINTS = 201, DISC_CORNERS = 4096 };

static const double light_height_m = 3, blocker_height_m = 1;

static void import_blocker(struct closed_form_scene *scene, struct glb_builder *builder,
                           struct imported_scene *imported)
{
    struct error err = {0};
    closed_form_end(scene, builder);
    struct scene_file file = {.name = "", .bytes = scene->glb, .size_bytes = scene->size_bytes};
    if (!imported_scene_init(imported, &file, 1, &err))
        fail_msg("%s", err.message);
}

static struct view view_under(const struct view_light *light)
{
    return (struct view){.width_px = 64,
                         .height_px = 64,
                         .lights = light,
                         .light_count = 1,
                         .quality = {.reference = true, .area_samples = SAMPLES}};
}

/* How a probe asks the light. */
struct asking {
    int samples, points;
    bool follows_edges;
    uint64_t shadow_rays; /* out, of one point in the mean */
};

static const struct asking as_pictures_do = {.samples = SAMPLES, .points = POINTS};

/* Visible share of the light at floor points (x, 0, 0). */
static void probe_line(const struct imported_scene *imported, const struct view_light *light,
                       double x0, double x1, struct asking *asking, double (*t)[3])
{
    static double points[POINTS][3];
    struct view view = view_under(light);
    view.quality.area_samples = asking->samples;
    struct scene_state state;
    struct error err = {0};
    for (int i = 0; i < asking->points; i++)
        points[i][0] = x0 + (x1 - x0) * i / (asking->points - 1);
    assert_true(scene_state_init(&state, &imported->scene, &view, &err));
    struct raytrace_probe_desc desc = {.view = &view,
                                       .state = &state,
                                       .points = (const double(*)[3])points,
                                       .point_count = (size_t)asking->points,
                                       .follows_edges = asking->follows_edges,
                                       .shadow_rays = &asking->shadow_rays};
    if (!raytrace_probe(&desc, t, &err))
        fail_msg("%s", err.message);
    asking->shadow_rays /= (uint64_t)asking->points;
    scene_state_finish(&state);
}

/* Not a number counts as infinite, and stays. */
static double larger(double worst, double error)
{
    return isnan(error) ? INFINITY : fmax(worst, error);
}

/* Into the report, and fails the test beyond the tolerance. */
static void judge(const char *scene, const char *metric, double worst, double tolerance)
{
    accuracy_log(&(struct accuracy_result){.suite = "closed_forms",
                                           .scene = scene,
                                           .technique = "raytraced",
                                           .metric = metric,
                                           .error = worst,
                                           .tolerance = tolerance,
                                           .is_pass = worst <= tolerance});
    if (!(worst <= tolerance))
        fail_msg("%s: %s is %g, more than %g", scene, metric, worst, tolerance);
}

/* Share of the rectangle (in its plane: x, z) on the side x > edge; Sutherland and Hodgman 1974. */
static double share_beyond(const struct state_light *light, double edge)
{
    double area2 = 0, first[2] = {0}, last[2] = {0};
    int count = 0;
    for (int i = 0; i < 8; i++) { /* even: a corner; odd: where the side after it meets the edge */
        double corner[2][2], at[2];
        for (int c = 0; c < 2; c++) {
            int n = (i / 2 + c) % 4;
            for (int k = 0; k < 2; k++)
                corner[c][k] = light->position[2 * k] +
                               light->half_u[2 * k] * (n == 0 || n == 3 ? -1 : 1) +
                               light->half_v[2 * k] * (n < 2 ? -1 : 1);
        }
        double from = corner[0][0] - edge, to = corner[1][0] - edge;
        if (i % 2 ? (from > 0) == (to > 0) : from <= 0)
            continue;
        for (int k = 0; k < 2; k++)
            at[k] = i % 2 ? corner[0][k] + (corner[1][k] - corner[0][k]) * from / (from - to)
                          : corner[0][k];
        if (count++)
            area2 += last[0] * at[1] - last[1] * at[0];
        else
            memcpy(first, at, sizeof first);
        memcpy(last, at, sizeof last);
    }
    area2 += last[0] * first[1] - last[1] * first[0];
    return fabs(area2) / 2 / light->area_m2;
}

static struct state_light state_light_of(const struct imported_scene *imported,
                                         const struct view_light *light);

/* Largest error under a half-plane y = 1, x < 0 and a rectangle. */
static double half_plane_error(double width_m, const double up[3], struct asking *asking)
{
    static double t[POINTS][3];
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Half-plane", 0);
    closed_form_quad(builder, "Blocker", closed_form_receiver(&scene, builder),
                     (double[]){-4, blocker_height_m, -4}, (double[]){4, 0, 0},
                     (double[]){0, 0, 8});
    import_blocker(&scene, builder, &imported);
    struct view_light light = {.type = SCENE_LIGHT_RECT,
                               .position = {0, light_height_m, 0},
                               .direction = {0, -1, 0},
                               .color = {1, 1, 1},
                               .intensity = 1,
                               .width_m = (float)width_m,
                               .height_m = 1};
    memcpy(light.up, up, sizeof light.up);
    struct state_light placed = state_light_of(&imported, &light);
    double distance = light_height_m - blocker_height_m, worst = 0;
    double reach = fmax(width_m, 1) * blocker_height_m / distance;
    probe_line(&imported, &light, -reach, reach, asking, t);
    for (int i = 0; i < asking->points; i++) {
        double x = -reach + 2 * reach * i / (asking->points - 1);
        double expected = share_beyond(&placed, -x * distance / blocker_height_m);
        worst = larger(worst, fabs(t[i][0] - expected));
    }
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
    return worst;
}

/* A7: the penumbra is linear, and light width * distance blocker to receiver / distance light to
 * blocker wide. Of the 4096 points each 1/4096 of the width holds one, so a share is right to one
 * point. */
static void penumbra_of_a_half_plane_is_linear(void **unused)
{
    (void)unused;
    static const double widths[] = {0.05, 0.4, 2};
    for (int w = 0; w < 3; w++) {
        char name[80];
        struct asking asking = as_pictures_do;
        double worst = half_plane_error(widths[w], (double[]){0, 0, 1}, &asking);
        snprintf(name, sizeof name, "A7 half-plane, light %g m wide", widths[w]);
        judge(name, "error of T", worst, 1.01 / SAMPLES);
    }
}

static void add_disc(struct glb_builder *builder, int material, double radius)
{
    static float positions[DISC_CORNERS + 1][3];
    static uint32_t indices[DISC_CORNERS][3];
    positions[DISC_CORNERS][1] = (float)blocker_height_m;
    for (uint32_t i = 0; i < DISC_CORNERS; i++) {
        double angle = 2 * M_PI * i / DISC_CORNERS;
        positions[i][0] = (float)(radius * cos(angle));
        positions[i][1] = (float)blocker_height_m;
        positions[i][2] = (float)(radius * sin(angle));
        indices[i][0] = DISC_CORNERS;
        indices[i][1] = i;
        indices[i][2] = (i + 1) % DISC_CORNERS;
    }
    struct glb_primitive_desc primitive = {.material = material,
                                           .vertex_count = DISC_CORNERS + 1,
                                           .positions = &positions[0][0],
                                           .indices = &indices[0][0],
                                           .index_count = 3 * DISC_CORNERS};
    int mesh = glb_builder_add_mesh(builder, "Disc", &primitive, 1);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Disc", .mesh = mesh});
}

/* Area common to two circles, d apart. */
static double overlap(double r, double s, double d)
{
    if (d >= r + s)
        return 0;
    if (d <= fabs(r - s))
        return M_PI * fmin(r, s) * fmin(r, s);
    double a = acos((d * d + r * r - s * s) / (2 * d * r));
    double b = acos((d * d + s * s - r * r) / (2 * d * s));
    return r * r * (a - sin(2 * a) / 2) + s * s * (b - sin(2 * b) / 2);
}

struct disc_error {
    double worst, rms;
};

/* Errors under a disc at a height of 1 m and a light of another radius. */
static struct disc_error disc_errors(double light_m, double disc_m, struct asking *asking)
{
    static double t[POINTS][3];
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Disc", 0);
    add_disc(builder, closed_form_receiver(&scene, builder), disc_m);
    import_blocker(&scene, builder, &imported);
    struct view_light light = {.type = SCENE_LIGHT_DISK,
                               .position = {0, light_height_m, 0},
                               .direction = {0, -1, 0},
                               .color = {1, 1, 1},
                               .intensity = 1,
                               .radius_m = (float)light_m};
    double scale = light_height_m / blocker_height_m; /* blocker to the light's plane */
    double reach = (light_m + scale * disc_m) / (scale - 1) * 1.1;
    struct disc_error error = {0};
    probe_line(&imported, &light, 0, reach, asking, t);
    for (int i = 0; i < asking->points; i++) {
        double x = reach * i / (asking->points - 1), radius = (double)light.radius_m;
        double covered = overlap(radius, scale * disc_m, x * (scale - 1));
        double off = t[i][0] - (1 - covered / (M_PI * radius * radius));
        error.worst = larger(error.worst, fabs(off));
        error.rms += off * off / asking->points;
    }
    error.rms = sqrt(error.rms);
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
    return error;
}

static const double disc_radii[][2] = {{0.5, 0.1}, {0.5, 0.3}, {0.2, 0.6}}; /* light, blocker */

/* A8. A boundary curve through N points of the sequence leaves an error of order N^(-3/4): 2e-3 of
 * 4096, and three times that for the worst of the points compared. */
static void shadow_of_a_disc_is_the_overlap_of_circles(void **unused)
{
    (void)unused;
    for (int c = 0; c < 3; c++) {
        struct asking asking = as_pictures_do;
        struct disc_error error = disc_errors(disc_radii[c][0], disc_radii[c][1], &asking);
        char name[80];
        snprintf(name, sizeof name, "A8 disc of %g m, light of %g m", disc_radii[c][1],
                 disc_radii[c][0]);
        judge(name, "error of T", error.worst, 6e-3);
    }
}

/* The reference's own integral: 1e-5 of both closed forms, with edges along the light's sides,
 * across them and round. */
static void followed_edges_are_right_to_a_hundred_thousandth(void **unused)
{
    (void)unused;
    static const double ups[][3] = {{0, 0, 1}, {1, 0, 1}, {0.3, 0, 1}};
    char name[80];
    for (int i = 0; i < 3; i++) {
        struct asking asking = {.samples = 1 << 16, .points = 31, .follows_edges = true};
        double worst = half_plane_error(0.4, ups[i], &asking);
        snprintf(name, sizeof name, "A7 half-plane at %.0f degrees, edges followed",
                 atan2(ups[i][0], ups[i][2]) * 180 / M_PI);
        printf("%s: %.2g with %llu rays\n", name, worst, (unsigned long long)asking.shadow_rays);
        judge(name, "error of T", worst, 1e-5);
    }
    for (int c = 0; c < 3; c++) {
        struct asking asking = {.samples = 1 << 16, .points = 31, .follows_edges = true};
        struct disc_error error = disc_errors(disc_radii[c][0], disc_radii[c][1], &asking);
        snprintf(name, sizeof name, "A8 disc of %g m, light of %g m, edges followed",
                 disc_radii[c][1], disc_radii[c][0]);
        printf("%s: %.2g with %llu rays\n", name, error.worst,
               (unsigned long long)asking.shadow_rays);
        judge(name, "error of T", error.worst, 1e-5);
    }
}

/* Slope of ln(error) over ln(samples) by least squares. */
static double exponent(const double *errors, int first_log2, int count)
{
    double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
    for (int i = 0; i < count; i++) {
        mean_x += (first_log2 + 2 * i) * M_LN2 / count;
        mean_y += log(errors[i]) / count;
    }
    for (int i = 0; i < count; i++) {
        double x = (first_log2 + 2 * i) * M_LN2 - mean_x;
        xy += x * (log(errors[i]) - mean_y);
        xx += x * x;
    }
    return xy / xx;
}

/* A ladder of sample counts. Any set of N points chosen beforehand errs by about N^(-3/4) on some
 * shape (Beck 1987, "Irregularities of distribution"), so the sequence cannot do better: 1e-5 would
 * take 2^23 points. Following the edge of a smooth shape errs by its square of the cell's side. */
static void errors_fall_with_the_samples_as_they_must(void **unused)
{
    (void)unused;
    enum { FIRST = 8, STEPS = 7, FOLLOWED_STEPS = 5 };
    double sequence[STEPS], followed[FOLLOWED_STEPS];
    for (int i = 0; i < STEPS; i++) {
        struct asking asking = {.samples = 1 << (FIRST + 2 * i), .points = 5};
        sequence[i] = disc_errors(0.5, 0.3, &asking).rms;
        printf("2^%d samples: rms %.2g", FIRST + 2 * i, sequence[i]);
        if (i < FOLLOWED_STEPS) {
            asking.follows_edges = true;
            followed[i] = disc_errors(0.5, 0.3, &asking).rms;
            printf(", edges followed %.2g with %llu rays", followed[i],
                   (unsigned long long)asking.shadow_rays);
        }
        printf("\n");
    }
    double slopes[2] = {exponent(sequence, FIRST, STEPS),
                        exponent(followed, FIRST, FOLLOWED_STEPS)};
    printf("exponents %.2f, edges followed %.2f\n", slopes[0], slopes[1]);
    judge("A8 ladder 2^8 to 2^20", "exponent of the error, over -3/4", fabs(slopes[0] / -0.75 - 1),
          0.25);
    judge("A8 ladder 2^8 to 2^16, edges followed", "exponent of the error + 1.5", slopes[1] + 1.5,
          0);
}

static struct state_light state_light_of(const struct imported_scene *imported,
                                         const struct view_light *light)
{
    struct view view = view_under(light);
    struct scene_state state;
    struct error err = {0};
    assert_true(scene_state_init(&state, &imported->scene, &view, &err));
    struct state_light copy = state.lights[0];
    scene_state_finish(&state);
    return copy;
}

static double irradiance(const struct state_light *light, const double point[3],
                         const double normal[3])
{
    static const double origin[3] = {0};
    struct rt_light_sample sample = {.count = SAMPLES, .seed = 11};
    double sum = 0;
    for (; sample.index < SAMPLES; sample.index++) {
        struct rt_arrival arrival;
        rt_light_arrive(light, &sample, origin, point, &arrival);
        sum += arrival.gain * fmax(vec3_dot(arrival.direction, normal), 0);
    }
    return sum * (double)light->color[0];
}

/* Lambert 1760: L / 2 * sum over edges of the angle they span times the cosine of their plane. */
static double polygon_irradiance(const double (*corners)[3], int count, const double point[3],
                                 const double normal[3])
{
    double sum = 0;
    for (int i = 0; i < count; i++) {
        double a[3], b[3], across[3];
        vec3_sub(corners[i], point, a);
        vec3_sub(corners[(i + 1) % count], point, b);
        vec3_normalize(a);
        vec3_normalize(b);
        vec3_cross(a, b, across);
        vec3_normalize(across);
        sum += acos(fmin(fmax(vec3_dot(a, b), -1), 1)) * vec3_dot(across, normal);
    }
    return fabs(sum) / 2;
}

/* A12 of area lights. A smooth integrand over a scrambled net of N points errs by less than 1/N of
 * its range, which at these distances is about the integral itself. */
static void irradiance_equals_lamberts_formula(void **unused)
{
    (void)unused;
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Empty", 0);
    closed_form_floor(&scene, builder, 1);
    import_blocker(&scene, builder, &imported);
    static const double up[3] = {0, 1, 0};
    struct view_light rect = {.type = SCENE_LIGHT_RECT,
                              .position = {0.3, 2, -0.4},
                              .direction = {0.3, -1, 0.2},
                              .up = {0.1, 0.2, 1},
                              .color = {1, 1, 1},
                              .intensity = 5,
                              .width_m = 1.4,
                              .height_m = 0.6};
    struct state_light light = state_light_of(&imported, &rect);
    double worst = 0;
    for (int i = 0; i < 50; i++) {
        double point[3] = {0.05 * (i - 25), 0, 0.03 * i - 0.5}, corners[4][3];
        for (int c = 0; c < 4; c++)
            for (int k = 0; k < 3; k++)
                corners[c][k] = light.position[k] + light.half_u[k] * (c == 0 || c == 3 ? -1 : 1) +
                                light.half_v[k] * (c < 2 ? -1 : 1);
        double expected = 5 * polygon_irradiance((const double(*)[3])corners, 4, point, up);
        worst = larger(worst, fabs(irradiance(&light, point, up) / expected - 1));
    }
    judge("A12 rectangle", "relative error of irradiance", worst, 1.0 / SAMPLES);
    worst = 0;
    struct view_light disk = {.type = SCENE_LIGHT_DISK,
                              .position = {0, 2, 0},
                              .direction = {0, -3, 0},
                              .color = {1, 1, 1},
                              .intensity = 7,
                              .radius_m = 0.8};
    light = state_light_of(&imported, &disk);
    for (int i = 0; i < 20; i++) { /* on the axis: pi L R^2 / (R^2 + d^2) */
        double point[3] = {0, -0.4 * i, 0}, d = 2 + 0.4 * i;
        double expected = M_PI * 7 * 0.64 / (0.64 + d * d);
        worst = larger(worst, fabs(irradiance(&light, point, up) / expected - 1));
    }
    judge("A12 disk, on its axis", "relative error of irradiance", worst, 1.0 / SAMPLES);
    double behind[3] = {0, 2.5, 0}, down[3] = {0, -1, 0};
    assert_true(irradiance(&light, behind, down) == 0);
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

static struct frame shoot(struct renderer *renderer, const char *key, const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    if (!renderer_render(renderer, key, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

static bool has_text(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text))
            return true;
    for (int i = 0; i < report->pass_count; i++)
        if (strstr(report->passes[i].because, text))
            return true;
    return false;
}

/* A floor under a half-plane and a small disk: traced by auto. A map draws the same light from its
 * centre, which ten radii away differs by a quarter of a hundredth, and says so. */
static void auto_traces_area_lights_and_maps_draw_their_centre(void **unused)
{
    (void)unused;
    struct renderer *renderer = render_rig_create();
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct error err = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Floor", 0);
    closed_form_floor(&scene, builder, 4);
    closed_form_quad(builder, "Blocker", closed_form_receiver(&scene, builder),
                     (double[]){-4, 0.5, -4}, (double[]){4, 0, 0}, (double[]){0, 0, 8});
    closed_form_end(&scene, builder);
    assert_true(rig_scene_from_glb(&rig, renderer, "floor", scene.glb, scene.size_bytes, &err));
    struct view_light light = {.type = SCENE_LIGHT_DISK,
                               .position = {0, 2, 0},
                               .direction = {0, -1, 0},
                               .color = {1, 1, 1},
                               .intensity = 20,
                               .radius_m = 0.2};
    struct view view = view_under(&light);
    view.quality = (struct view_quality){.samples = 1, .area_samples = 64};
    view.camera =
        (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.45, 0.001}, .fov_y_deg = 90};
    struct frame traced = shoot(renderer, rig.key, &view);
    assert_true(has_text(&traced.report, "1 area light: soft shadows are ray traced"));
    assert_false(traced.report.error_is_exact);
    view.quality.shadows = SHADOWS_MAP;
    struct frame mapped = shoot(renderer, rig.key, &view);
    assert_true(has_text(&mapped.report, "hard shadow, from the centre"));
    save_picture(&traced.outputs[VIEW_OUTPUT_COLOR], "area_raytraced");
    save_picture(&mapped.outputs[VIEW_OUTPUT_COLOR], "area_map");
    int shadowed = 0, penumbra = 0;
    for (int y = 0; y < 64; y++) {
        for (int x = 0; x < 64; x++) {
            double soft = (double)image_pixel_f32(&traced.outputs[VIEW_OUTPUT_COLOR], x, y)[0];
            double hard = (double)image_pixel_f32(&mapped.outputs[VIEW_OUTPUT_COLOR], x, y)[0];
            shadowed += hard == 0;
            if (fabs(soft - hard) > 0.02 * soft)
                penumbra++;
        }
    }
    printf("%d pixels in shadow, %d of another value\n", shadowed, penumbra);
    /* 0.4 m * 0.5 m / 1.5 m wide in a picture of 0.9 m: 9.5 columns, less those that differ little
     */
    assert_int_in_range(penumbra, 64 * 7, 64 * 12);
    assert_int_in_range(shadowed, 64 * 31, 64 * 33);
    frame_finish(&traced);
    frame_finish(&mapped);
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&scene);
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(penumbra_of_a_half_plane_is_linear),
        cmocka_unit_test(shadow_of_a_disc_is_the_overlap_of_circles),
        cmocka_unit_test(followed_edges_are_right_to_a_hundred_thousandth),
        cmocka_unit_test(errors_fall_with_the_samples_as_they_must),
        cmocka_unit_test(irradiance_equals_lamberts_formula),
        cmocka_unit_test(auto_traces_area_lights_and_maps_draw_their_centre),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
