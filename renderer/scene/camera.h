/* SPDX-License-Identifier: MIT */
/* The view's camera resolved against a scene: eye, axes, projection, and the window of one tile.
 * f64, CPU only. */
#ifndef VITRAIL_RENDERER_SCENE_CAMERA_H
#define VITRAIL_RENDERER_SCENE_CAMERA_H

#include "renderer/scene/scene_state.h"

/* View space: +x right, +y up, looks along -z. view_z in shaders is the positive distance along the
 * view direction. */
struct camera {
    double eye[3];
    double right[3], up[3], back[3]; /* world, orthonormal */
    bool is_orthographic;
    /* Perspective: tangents of the half angles; orthographic: metres. */
    double half_width, half_height;
    double z_near; /* perspective: m; infinite far, reversed Z: ndc z = z_near / view_z */
    double z_far;  /* orthographic only; ndc z = (z_far - view_z) / (z_far - z_near), z_near >= 0 */
};

/* A rectangle of the image that is rendered at once, first row on top. */
struct camera_window {
    int x, y, width, height, image_width, image_height;
    /* How far the picture is shifted in it, right and up (renderer/base/sample_pattern.h). */
    double shift_px[2];
    /* Lists of lights for the window hold for every shift by no more than this along an axis. */
    double reach_px;
};

static inline struct camera_window camera_window_whole(int width_px, int height_px)
{
    return (struct camera_window){
        .width = width_px, .height = height_px, .image_width = width_px, .image_height = height_px};
}

static inline uint64_t camera_window_pixels(const struct camera_window *window)
{
    return (uint64_t)window->width * (uint64_t)window->height;
}

MUST_CHECK bool camera_resolve(struct camera *camera, const struct view *view,
                               const struct scene_state *state, struct error *err);

/* Rows right, up, back: view_from_world. */
void camera_axes(const struct camera *camera, double axes[3][3]);

/* Right, up and the depth along the view direction [m] of a point of the world. */
void camera_to_view(const struct camera *camera, const double world[3], double view[3]);

/* A sphere against the sides of the frustum, which is `wider` times as wide and high (1: as it is),
 * and the plane of the eye; true is no promise. */
bool camera_may_see(const struct camera *camera, const double center[3], double radius_m,
                    double wider);

/* The part of the image that a viewport covers: all of it, but of images that are larger than the
 * viewports of devices a part of CAMERA_PART_PX that holds the window. First row on top. */
enum { CAMERA_PART_PX = 16384 /* GL_MAX_VIEWPORT_DIMS is at least as much on GL 4.5 devices */ };
struct camera_part {
    int x, y, width, height, image_width, image_height;
};
struct camera_part camera_part_of(const struct camera_window *window);

/* From view space in units of unit_m to clip space of the part, whatever the window in it (GL
 * convention: y up; the renderer flips rows on readback), which is what
 * shaders/draw/geometry.vert.glsl takes:
 *
 *   w' = depth[2] + depth[3] * z, z' = depth[0] + depth[1] * z,
 *   x' = across[0] * x + across[2] * w', y' = across[1] * y + across[3] * w'
 *
 * where across[2] and across[3] are 0 in a part that is the whole image. */
void camera_clip(const struct camera *camera, const struct camera_part *part, double unit_m,
                 float across[4], float depth[4]);

#endif
