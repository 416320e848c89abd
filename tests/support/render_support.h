/* SPDX-License-Identifier: MIT */
/* Whole renders for tests and benchmarks: GLB bytes or a file in, linear images out. Thread: one,
 * it becomes the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_RENDER_SUPPORT_H
#define VITRAIL_TESTS_SUPPORT_RENDER_SUPPORT_H

#include "renderer/gl/context.h"
#include "renderer/renderer.h"
#include "tests/support/import_support.h"

struct glb_builder;

/* A strict renderer (a GL error aborts). Exits the test program with 77 when the machine has no GL
 * device. */
struct renderer *render_rig_create(void);
/* One as described, with the same exit. */
struct renderer *render_rig_create_as(const struct renderer_desc *desc);

/* A context alone, with the same exit. */
struct gl_context *render_rig_context(bool is_strict);

/* For cmocka_run_group_tests: *state is such a renderer. */
int render_rig_setup(void **state);
int render_rig_teardown(void **state);

/* A scene resident on the renderer under `key`, with the memory behind it. Zeroed = empty. */
struct rig_scene {
    struct imported_scene imported;
    char key[65];
};
MUST_CHECK bool rig_scene_from_glb(struct rig_scene *scene, struct renderer *renderer,
                                   const char *key, const void *glb, size_t size_bytes,
                                   struct error *err);
/* builder: taken, and destroyed whatever becomes of it. */
MUST_CHECK bool rig_scene_from_builder(struct rig_scene *scene, struct renderer *renderer,
                                       const char *key, struct glb_builder *builder,
                                       struct error *err);
/* A path below the asset folder; see imported_asset_load. */
MUST_CHECK bool rig_scene_from_asset(struct rig_scene *scene, struct renderer *renderer,
                                     const char *path, struct error *err);
void rig_scene_finish(struct rig_scene *scene, struct renderer *renderer);

/* The view with what `auto` becomes for it, in `choice`, which must outlive it; or as it is, where
 * nothing can be chosen: what draws it says why. */
struct view rig_choose(struct renderer *renderer, const char *scene_key, const struct view *view,
                       struct auto_choice *choice);

/* The pixel (x, y), first row on top, of an F32 image. */
const float *image_pixel_f32(const struct image *image, int x, int y);

/* Projects a world point to pixel coordinates of a LOOK_AT view (continuous, y down); false when
 * behind the eye. */
bool view_project(const struct view *view, const double world[3], double pixel[2]);

/* Tone-maps a color output and writes it as PNG below the build folder's images/, for people to
 * look at. */
void save_picture(const struct image *color, const char *name);

#endif
