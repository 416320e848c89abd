/* SPDX-License-Identifier: MIT */
/* What tests of whole images ask of them: rays through pixels, differences, sound values, names in
 * reports. A failed check fails the cmocka test that called. Thread: the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_IMAGE_CHECKS_H
#define VITRAIL_TESTS_SUPPORT_IMAGE_CHECKS_H

#include "tests/support/render_support.h"

/* Renders, by what is chosen where the view says `auto`, or fails the test with the renderer's
 * message. The frame is the caller's to finish. */
void shoot(struct renderer *renderer, const struct rig_scene *scene, const struct view *view,
           struct frame *frame);
/* The color output alone, to be finished by the caller. */
struct image shoot_color(struct renderer *renderer, const struct rig_scene *scene,
                         const struct view *view);
/* Attaches a closed-form or other GLB, or fails the test. */
void rig_scene_open(struct rig_scene *scene, struct renderer *renderer, const char *key,
                    const void *glb, size_t size_bytes);
/* The demo scene with textures of this size and few triangles, or fails the test. */
void rig_demo_open(struct rig_scene *scene, struct renderer *renderer, const char *key,
                   int texture_size_px);
/* With all of its triangles, 90,000. */
void rig_demo_open_fine(struct rig_scene *scene, struct renderer *renderer, const char *key,
                        int texture_size_px);
void rig_asset_open(struct rig_scene *scene, struct renderer *renderer, const char *path);

/* Ray through the centre of pixel (x, y), first row on top, of a LOOK_AT view. The
 * direction has length 1 along the view axis. */
void view_ray(const struct view *view, int x, int y, double origin[3], double direction[3]);
/* Where it meets the plane dot(normal, p) = offset; false when it does not, in front of the eye. */
bool view_meet_plane(const struct view *view, int x, int y, const double normal[3], double offset,
                     double point[3]);

/* F32 pixel under a world point of a LOOK_AT view; fails the test when it is outside. */
const float *image_at(const struct image *image, const struct view *view, const double world[3]);
uint32_t image_id_at(const struct image *ids, const struct view *view, const double world[3]);

/* Mean absolute error of the linear colour over the mean of the reference. */
double mean_error(const struct image *image, const struct image *reference);

/* Share of pixels with a channel that differs by more than tolerance * (least + its value in b). */
double image_share_differing(const struct image *a, const struct image *b, double tolerance,
                             double least);

/* Largest difference between two F32 images over channels 0 to 2: absolute, and relative to the
 * larger value where that is above `dark`. */
struct image_difference {
    double absolute, relative;
    int x, y; /* of the largest relative one */
};
struct image_difference image_compare(const struct image *a, const struct image *b, double dark);
void assert_images_close(const struct image *a, const struct image *b, double dark,
                         double relative);
void assert_same_bits(const struct image *a, const struct image *b);
uint64_t image_hash(const struct image *image); /* FNV-1a of size and pixels */

/* Finite, not negative, alpha within [0, 1], and no more radiance than `brightest`. */
void assert_image_is_sound(const struct image *color, double brightest);

/* Means of channels 0 to 2 over the rectangle [x0, x1) x [y0, y1) in fractions of the image. */
void image_mean(const struct image *color, const double rectangle[4], double mean[3]);
/* The same over pixels whose id (node or material output) is `id`; returns how many there are. */
size_t image_mean_of(const struct image *color, const struct image *ids, uint32_t id,
                     double mean[3]);

/* Id in the node or material output; fails the test when there is no such name. */
uint32_t scene_node_id(const struct rig_scene *scene, const char *name);
uint32_t scene_material_id(const struct rig_scene *scene, const char *name);
size_t image_count_id(const struct image *ids, uint32_t id);

/* Whether a pass whose name begins so ran, with this technique (NULL: any). */
bool report_has_pass(const struct frame_report *report, const char *pass, const char *technique);
bool report_has_reused(const struct frame_report *report, const char *what);
/* Sum over the structures whose name begins so. */
uint64_t report_bytes_of(const struct frame_report *report, const char *prefix);
/* Whether some warning contains the text. */
bool report_has_warning(const struct frame_report *report, const char *text);

#endif
