/* SPDX-License-Identifier: MIT */
/* Whole renders for tests and benchmarks. */
#include "tests/support/render_support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "glb/glb_builder.h"
#include "renderer/base/matrix.h"
#include "renderer/image/tone_map.h"
#include "renderer/scene/camera.h"

struct renderer *render_rig_create_as(const struct renderer_desc *desc)
{
    struct error err = {0};
    struct renderer *renderer = renderer_create(desc, &err);
    if (!renderer && err.code == ERROR_NO_DEVICE) {
        fprintf(stderr, "skipped: %s\n", err.message);
        exit(77);
    }
    if (!renderer) {
        fprintf(stderr, "renderer_create: %s\n", err.message);
        exit(1);
    }
    return renderer;
}

struct renderer *render_rig_create(void)
{
    return render_rig_create_as(&(struct renderer_desc){.is_strict = true});
}

struct gl_context *render_rig_context(bool is_strict)
{
    struct error err = {0};
    struct gl_context *context =
        gl_context_create(&(struct gl_context_desc){.is_strict = is_strict}, &err);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        exit(77);
    }
    return context;
}

int render_rig_setup(void **state)
{
    *state = render_rig_create();
    return 0;
}

int render_rig_teardown(void **state)
{
    renderer_destroy(*state);
    return 0;
}

static bool attach(struct rig_scene *scene, struct renderer *renderer, const char *key,
                   struct error *err)
{
    snprintf(scene->key, sizeof scene->key, "%s", key);
    return renderer_attach_scene(
        renderer, &(struct renderer_scene_desc){.key = scene->key, .scene = &scene->imported.scene},
        err);
}

bool rig_scene_from_glb(struct rig_scene *scene, struct renderer *renderer, const char *key,
                        const void *glb, size_t size_bytes, struct error *err)
{
    struct scene_file file = {.name = "", .bytes = glb, .size_bytes = size_bytes};
    *scene = (struct rig_scene){0};
    return imported_scene_init(&scene->imported, &file, 1, err) &&
           attach(scene, renderer, key, err);
}

bool rig_scene_from_builder(struct rig_scene *scene, struct renderer *renderer, const char *key,
                            struct glb_builder *builder, struct error *err)
{
    void *glb = NULL;
    size_t size_bytes;
    bool ok = glb_builder_finish(builder, &glb, &size_bytes, err);
    glb_builder_destroy(builder);
    ok = ok && rig_scene_from_glb(scene, renderer, key, glb, size_bytes, err);
    free(glb);
    return ok;
}

bool rig_scene_from_asset(struct rig_scene *scene, struct renderer *renderer, const char *path,
                          struct error *err)
{
    *scene = (struct rig_scene){0};
    char key[65];
    size_t length = strlen(path);
    snprintf(key, sizeof key, "%s", length > 60 ? path + length - 60 : path);
    return imported_asset_load(&scene->imported, path, err) && attach(scene, renderer, key, err);
}

void rig_scene_finish(struct rig_scene *scene, struct renderer *renderer)
{
    if (scene->key[0])
        renderer_detach_scene(renderer, scene->key);
    imported_scene_finish(&scene->imported);
    *scene = (struct rig_scene){0};
}

struct view rig_choose(struct renderer *renderer, const char *scene_key, const struct view *view,
                       struct auto_choice *choice)
{
    struct view chosen = *view;
    struct error ignored = {0};
    if (view->quality.shadows == SHADOWS_AUTO &&
        renderer_choose(renderer, scene_key, view, choice, &ignored))
        chosen.choice = choice;
    return chosen;
}

const float *image_pixel_f32(const struct image *image, int x, int y)
{
    const float *pixels = image->pixels;
    return pixels + ((size_t)y * (size_t)image->width_px + (size_t)x) * (size_t)image->channels;
}

bool view_project(const struct view *view, const double world[3], double pixel[2])
{
    struct scene_header header = {.default_camera_node = -1};
    struct scene scene = {.header = &header};
    struct scene_state state = {.scene = &scene, .bounds_min = {1}, .bounds_max = {-1}};
    struct camera camera;
    struct error err = {0};
    if (!camera_resolve(&camera, view, &state, &err))
        return false;
    double v[3];
    vec3_sub(world, camera.eye, v);
    double z = camera.is_orthographic ? 1 : -vec3_dot(v, camera.back);
    if (z <= 0)
        return false;
    double x = vec3_dot(v, camera.right) / (z * camera.half_width);
    double y = vec3_dot(v, camera.up) / (z * camera.half_height);
    pixel[0] = (0.5 + 0.5 * x) * view->width_px;
    pixel[1] = (0.5 - 0.5 * y) * view->height_px;
    return true;
}

void save_picture(const struct image *color, const char *name)
{
    struct image ldr = {0};
    struct error err = {0};
    void *bytes = NULL;
    size_t size = 0;
    char path[512];
    snprintf(path, sizeof path, "%s/images", VITRAIL_BINARY_DIR);
    mkdir(path, 0777);
    snprintf(path, sizeof path, "%s/images/%s.png", VITRAIL_BINARY_DIR, name);
    if (!tone_map(color, &(struct tone_map_desc){0}, &ldr, &err) ||
        !image_encode(&ldr, &(struct image_encode_desc){.format = IMAGE_FORMAT_PNG}, &bytes, &size,
                      &err)) {
        fprintf(stderr, "save_picture '%s': %s\n", name, err.message);
    } else {
        FILE *file = fopen(path, "wb");
        if (file) {
            fwrite(bytes, 1, size, file);
            fclose(file);
        }
    }
    image_finish(&ldr);
    free(bytes);
}
