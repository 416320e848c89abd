/* SPDX-License-Identifier: MIT */
/* Checks on whole images. */
#include "tests/support/image_checks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/demo_scene.h"
#include "renderer/accuracy/metrics.h"
#include "renderer/base/matrix.h"

static const double pi = 3.14159265358979323846;

void shoot(struct renderer *renderer, const struct rig_scene *scene, const struct view *view,
           struct frame *frame)
{
    struct error err = {0};
    struct auto_choice choice;
    const struct view chosen = rig_choose(renderer, scene->key, view, &choice);
    if (!renderer_render(renderer, scene->key, &chosen, frame, &err))
        fail_msg("scene '%s': %s", scene->key, err.message);
}

struct image shoot_color(struct renderer *renderer, const struct rig_scene *scene,
                         const struct view *view)
{
    struct frame frame;
    shoot(renderer, scene, view, &frame);
    struct image color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    frame_finish(&frame);
    return color;
}

void rig_scene_open(struct rig_scene *scene, struct renderer *renderer, const char *key,
                    const void *glb, size_t size_bytes)
{
    struct error err = {0};
    renderer_detach_scene(renderer, key); /* of a test that failed */
    if (!rig_scene_from_glb(scene, renderer, key, glb, size_bytes, &err))
        fail_msg("scene '%s': %s", key, err.message);
}

static void open_demo(struct rig_scene *scene, struct renderer *renderer, const char *key,
                      const struct demo_scene_desc *desc)
{
    struct error err = {0};
    void *glb = NULL;
    size_t size_bytes = 0;
    if (!demo_scene_build(desc, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    rig_scene_open(scene, renderer, key, glb, size_bytes);
    free(glb);
}

void rig_demo_open(struct rig_scene *scene, struct renderer *renderer, const char *key,
                   int texture_size_px)
{
    open_demo(scene, renderer, key,
              &(struct demo_scene_desc){.texture_size_px = texture_size_px, .coarseness = 4});
}

void rig_demo_open_fine(struct rig_scene *scene, struct renderer *renderer, const char *key,
                        int texture_size_px)
{
    open_demo(scene, renderer, key, &(struct demo_scene_desc){.texture_size_px = texture_size_px});
}

void rig_asset_open(struct rig_scene *scene, struct renderer *renderer, const char *path)
{
    struct error err = {0};
    if (!rig_scene_from_asset(scene, renderer, path, &err))
        fail_msg("asset '%s': %s", path, err.message);
}

void view_ray(const struct view *view, int x, int y, double origin[3], double direction[3])
{
    const struct view_camera *camera = &view->camera;
    double up[3] = {camera->up[0], camera->up[1], camera->up[2]}, forward[3], right[3];
    assert_int_equal(camera->kind, VIEW_CAMERA_LOOK_AT);
    if (vec3_dot(up, up) <= 0)
        up[1] = 1;
    vec3_sub(camera->target, camera->eye, forward);
    assert_true(vec3_normalize(forward));
    vec3_cross(forward, up, right);
    assert_true(vec3_normalize(right));
    vec3_cross(right, forward, up);
    bool is_flat = camera->ortho_height > 0;
    double half = is_flat ? camera->ortho_height / 2
                          : tan((camera->fov_y_deg > 0 ? camera->fov_y_deg : 45) * pi / 360);
    double s = ((x + 0.5) * 2 / view->width_px - 1) * half * view->width_px / view->height_px;
    double t = (1 - (y + 0.5) * 2 / view->height_px) * half;
    for (int i = 0; i < 3; i++) {
        double aside = s * right[i] + t * up[i];
        origin[i] = camera->eye[i] + (is_flat ? aside : 0);
        direction[i] = forward[i] + (is_flat ? 0 : aside);
    }
}

bool view_meet_plane(const struct view *view, int x, int y, const double normal[3], double offset,
                     double point[3])
{
    double origin[3], direction[3];
    view_ray(view, x, y, origin, direction);
    double facing = vec3_dot(normal, direction);
    double at = facing != 0 ? (offset - vec3_dot(normal, origin)) / facing : -1;
    for (int i = 0; i < 3; i++)
        point[i] = origin[i] + at * direction[i];
    return at > 0;
}

static size_t pixel_index(const struct image *image, const struct view *view, const double world[3])
{
    double p[2];
    if (!view_project(view, world, p) || p[0] < 0 || p[1] < 0 || p[0] >= image->width_px ||
        p[1] >= image->height_px)
        fail_msg("(%g, %g, %g) is not in the picture", world[0], world[1], world[2]);
    return (size_t)p[1] * (size_t)image->width_px + (size_t)p[0];
}

const float *image_at(const struct image *image, const struct view *view, const double world[3])
{
    assert_int_equal(image->component, IMAGE_F32);
    return (const float *)image->pixels + pixel_index(image, view, world) * (size_t)image->channels;
}

uint32_t image_id_at(const struct image *ids, const struct view *view, const double world[3])
{
    assert_int_equal(ids->component, IMAGE_U32);
    return ((const uint32_t *)ids->pixels)[pixel_index(ids, view, world)];
}

struct image_difference image_compare(const struct image *a, const struct image *b, double dark)
{
    struct image_difference worst = {0};
    assert_int_equal(a->width_px, b->width_px);
    assert_int_equal(a->height_px, b->height_px);
    for (int y = 0; y < a->height_px; y++) {
        for (int x = 0; x < a->width_px; x++) {
            const float *p = image_pixel_f32(a, x, y), *q = image_pixel_f32(b, x, y);
            for (int c = 0; c < 3; c++) {
                double apart = fabs((double)p[c] - q[c]), large = (double)fmaxf(p[c], q[c]);
                worst.absolute = fmax(worst.absolute, isnan(apart) ? INFINITY : apart);
                if (!(apart / fmax(large, dark) <= worst.relative))
                    worst =
                        (struct image_difference){worst.absolute, apart / fmax(large, dark), x, y};
            }
        }
    }
    return worst;
}

void assert_images_close(const struct image *a, const struct image *b, double dark, double relative)
{
    struct image_difference worst = image_compare(a, b, dark);
    if (!(worst.relative <= relative)) {
        const float *p = image_pixel_f32(a, worst.x, worst.y),
                    *q = image_pixel_f32(b, worst.x, worst.y);
        fail_msg("pixel %d,%d: (%.8g %.8g %.8g) against (%.8g %.8g %.8g), relative %.3g above %.3g",
                 worst.x, worst.y, (double)p[0], (double)p[1], (double)p[2], (double)q[0],
                 (double)q[1], (double)q[2], worst.relative, relative);
    }
}

void assert_same_bits(const struct image *a, const struct image *b)
{
    assert_int_equal(image_size_bytes(a), image_size_bytes(b));
    if (memcmp(a->pixels, b->pixels, image_size_bytes(a)) == 0)
        return;
    struct image_difference worst = image_compare(a, b, 1e-30);
    fail_msg("bits differ: worst at pixel %d,%d, relative %.3g, absolute %.3g", worst.x, worst.y,
             worst.relative, worst.absolute);
}

uint64_t image_hash(const struct image *image)
{
    uint64_t hash = 14695981039346656037u;
    const unsigned char *bytes = image->pixels;
    for (size_t i = 0; i < image_size_bytes(image); i++)
        hash = (hash ^ bytes[i]) * 1099511628211u;
    return (hash ^ (uint64_t)image->width_px) * 1099511628211u;
}

void assert_image_is_sound(const struct image *color, double brightest)
{
    assert_int_equal(color->channels, 4);
    for (int y = 0; y < color->height_px; y++) {
        for (int x = 0; x < color->width_px; x++) {
            const float *p = image_pixel_f32(color, x, y);
            for (int c = 0; c < 3; c++)
                if (!(p[c] >= 0 && (double)p[c] <= brightest))
                    fail_msg("pixel %d,%d channel %d is %g", x, y, c, (double)p[c]);
            if (!(p[3] >= 0 && p[3] <= 1))
                fail_msg("pixel %d,%d: alpha is %.9g", x, y, (double)p[3]);
        }
    }
}

void image_mean(const struct image *color, const double rectangle[4], double mean[3])
{
    int x0 = (int)(rectangle[0] * color->width_px), y0 = (int)(rectangle[1] * color->height_px);
    int x1 = (int)(rectangle[2] * color->width_px), y1 = (int)(rectangle[3] * color->height_px);
    mean[0] = mean[1] = mean[2] = 0;
    assert_true(x1 > x0 && y1 > y0);
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
            for (int c = 0; c < 3; c++)
                mean[c] += (double)image_pixel_f32(color, x, y)[c] / ((x1 - x0) * (y1 - y0));
}

size_t image_mean_of(const struct image *color, const struct image *ids, uint32_t id,
                     double mean[3])
{
    size_t count = 0, pixels = (size_t)color->width_px * (size_t)color->height_px;
    const uint32_t *id_of = ids->pixels;
    const float *p = color->pixels;
    mean[0] = mean[1] = mean[2] = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (id_of[i] != id)
            continue;
        count++;
        for (int c = 0; c < 3; c++)
            mean[c] += (double)p[4 * i + (size_t)c];
    }
    for (int c = 0; c < 3 && count; c++)
        mean[c] /= (double)count;
    return count;
}

uint32_t scene_node_id(const struct rig_scene *scene, const char *name)
{
    int32_t index = scene_find_node(&scene->imported.scene, name);
    if (index < 0)
        fail_msg("no node '%s'", name);
    return (uint32_t)index + 1;
}

uint32_t scene_material_id(const struct rig_scene *scene, const char *name)
{
    int32_t index = scene_find_material(&scene->imported.scene, name);
    if (index < 0)
        fail_msg("no material '%s'", name);
    return (uint32_t)index + 1;
}

size_t image_count_id(const struct image *ids, uint32_t id)
{
    size_t count = 0, pixels = (size_t)ids->width_px * (size_t)ids->height_px;
    for (size_t i = 0; i < pixels; i++)
        count += ((const uint32_t *)ids->pixels)[i] == id;
    return count;
}

bool report_has_pass(const struct frame_report *report, const char *pass, const char *technique)
{
    for (int i = 0; i < report->pass_count; i++)
        if (!strncmp(report->passes[i].pass, pass, strlen(pass)) &&
            (!technique || !strcmp(report->passes[i].technique, technique)))
            return true;
    return false;
}

bool report_has_warning(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text))
            return true;
    return false;
}

bool report_has_reused(const struct frame_report *report, const char *what)
{
    for (int i = 0; i < report->reused_count; i++)
        if (!strcmp(report->reused[i], what))
            return true;
    return false;
}

uint64_t report_bytes_of(const struct frame_report *report, const char *prefix)
{
    uint64_t bytes = 0;
    for (int i = 0; i < report->byte_count; i++)
        if (!strncmp(report->bytes[i].structure, prefix, strlen(prefix)))
            bytes += report->bytes[i].bytes;
    return bytes;
}

double image_share_differing(const struct image *a, const struct image *b, double tolerance,
                             double least)
{
    int differing = 0;
    for (int y = 0; y < a->height_px; y++) {
        for (int x = 0; x < a->width_px; x++) {
            const float *p = image_pixel_f32(a, x, y), *q = image_pixel_f32(b, x, y);
            bool differs = false;
            for (int k = 0; k < 4; k++)
                differs |=
                    !(fabs((double)p[k] - (double)q[k]) <= tolerance * (least + (double)q[k]));
            differing += differs;
        }
    }
    return (double)differing / (a->width_px * a->height_px);
}

double mean_error(const struct image *image, const struct image *reference)
{
    struct error err = {0};
    struct image_metrics metrics;
    if (!image_metrics_measure(
            &(struct image_metrics_desc){.image = image, .reference = reference, .channels = 7},
            &metrics, &err))
        fail_msg("%s", err.message);
    return metrics.overall.mae / metrics.overall.mean_reference;
}
