/* SPDX-License-Identifier: MIT */
/* Random lights, cameras and windows for tests of light lists, and brute force to compare them
 * with. */
#ifndef VITRAIL_TESTS_SUPPORT_LIGHT_SCENE_H
#define VITRAIL_TESTS_SUPPORT_LIGHT_SCENE_H

#include "renderer/scene/camera.h"

enum { LIGHT_SCENE_LIGHTS = 48 };

struct light_scene {
    struct state_light lights[LIGHT_SCENE_LIGHTS]; /* points and spots at, around, behind, before
                                                      the eye; some global */
    struct camera camera;
    struct camera_window window;
    double scale; /* m: size of everything */
};

/* Xorshift; the state must not be 0. */
uint64_t random_next(uint64_t *state);
double random_uniform(uint64_t *state, double low, double high);
double random_log_uniform(uint64_t *state, double low, double high);

/* The same scene for the same seed. */
void light_scene_make(struct light_scene *scene, uint64_t seed, bool is_orthographic, double scale);

/* World position of a point of the window, y counted from its bottom. */
void light_scene_point(const struct light_scene *scene, double x, double y, double z,
                       double world[3]);

/* A depth where something may go wrong: inside some light, or anywhere in view. */
double light_scene_depth(const struct light_scene *scene, uint64_t *state);

/* Brute force: is there any light at the point? */
bool light_reaches(const struct state_light *light, const double point[3]);

#endif
