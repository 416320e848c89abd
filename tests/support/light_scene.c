/* SPDX-License-Identifier: MIT */
/* Random light scenes and brute force. */
#include "tests/support/light_scene.h"

#include <math.h>

#include "renderer/base/matrix.h"

uint64_t random_next(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

double random_uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * (double)(random_next(state) >> 11) * 0x1p-53;
}

double random_log_uniform(uint64_t *state, double low, double high)
{
    return exp(random_uniform(state, log(low), log(high)));
}

static void random_direction(uint64_t *state, double out[3])
{
    do {
        for (int i = 0; i < 3; i++)
            out[i] = random_uniform(state, -1, 1);
    } while (vec3_length(out) > 1 || !vec3_normalize(out));
}

static struct camera random_camera(uint64_t *state, bool is_orthographic, double scale)
{
    struct camera camera = {.is_orthographic = is_orthographic};
    double up[3];
    random_direction(state, camera.back);
    do {
        random_direction(state, up);
        vec3_cross(up, camera.back, camera.right);
    } while (!vec3_normalize(camera.right));
    vec3_cross(camera.back, camera.right, camera.up);
    for (int i = 0; i < 3; i++)
        camera.eye[i] = random_uniform(state, -3, 3) * scale;
    camera.half_height = is_orthographic ? random_uniform(state, 0.5, 6) * scale
                                         : tan(random_uniform(state, 2, 80) * M_PI / 180);
    camera.half_width = camera.half_height * random_uniform(state, 0.5, 2);
    camera.z_near = is_orthographic ? random_uniform(state, -8, 1) * scale : 1e-3 * scale;
    camera.z_far = camera.z_near + random_uniform(state, 4, 30) * scale;
    return camera;
}

static struct camera_window random_window(uint64_t *state)
{
    struct camera_window window = {
        .image_width = (int)random_uniform(state, 1, 900),
        .image_height = (int)random_uniform(state, 1, 700),
    };
    window.width = (int)random_uniform(state, 1, window.image_width + 1);
    window.height = (int)random_uniform(state, 1, window.image_height + 1);
    window.x = (int)random_uniform(state, 0, window.image_width - window.width + 1);
    window.y = (int)random_uniform(state, 0, window.image_height - window.height + 1);
    return window;
}

/* Every fourth light sits at the eye, and ranges span three decades, so that cameras are inside and
 * outside. */
static struct state_light random_light(uint64_t *state, const struct camera *camera, int index,
                                       double scale)
{
    struct state_light light = {.range = (float)(random_log_uniform(state, 0.01, 20) * scale)};
    light.type = index % 2 ? SCENE_LIGHT_SPOT : SCENE_LIGHT_POINT;
    if (index % 16 == 5)
        light.type = SCENE_LIGHT_DIRECTIONAL;
    if (index % 16 == 6)
        light.range = 0;
    random_direction(state, light.direction);
    light.outer_cone_rad = (float)random_log_uniform(state, 1e-3, M_PI / 2);
    for (int i = 0; i < 3; i++)
        light.position[i] =
            camera->eye[i] + (index % 4 ? random_uniform(state, -12, 12) * scale : 0);
    return light;
}

void light_scene_make(struct light_scene *scene, uint64_t seed, bool is_orthographic, double scale)
{
    uint64_t state = 0x9e3779b97f4a7c15u * (seed + 1);
    scene->scale = scale;
    scene->camera = random_camera(&state, is_orthographic, scale);
    scene->window = random_window(&state);
    for (int i = 0; i < LIGHT_SCENE_LIGHTS; i++)
        scene->lights[i] = random_light(&state, &scene->camera, i, scale);
}

void light_scene_point(const struct light_scene *scene, double x, double y, double z,
                       double world[3])
{
    const struct camera *camera = &scene->camera;
    const struct camera_window *w = &scene->window;
    double depth_scale = camera->is_orthographic ? 1 : z;
    double image_y = w->image_height - w->y - w->height + y;
    double vx = ((w->x + x) / w->image_width * 2 - 1) * camera->half_width * depth_scale;
    double vy = (image_y / w->image_height * 2 - 1) * camera->half_height * depth_scale;
    for (int i = 0; i < 3; i++)
        world[i] =
            camera->eye[i] + camera->right[i] * vx + camera->up[i] * vy - camera->back[i] * z;
}

double light_scene_depth(const struct light_scene *scene, uint64_t *state)
{
    const struct camera *camera = &scene->camera;
    const struct state_light *light = &scene->lights[random_next(state) % LIGHT_SCENE_LIGHTS];
    double relative[3];
    vec3_sub(light->position, camera->eye, relative);
    double z = random_next(state) % 2
                   ? random_uniform(state, -1, 1) * light->range - vec3_dot(camera->back, relative)
                   : random_log_uniform(state, 1e-3, 40) * scene->scale;
    return camera->is_orthographic ? z : fmax(z, camera->z_near);
}

bool light_reaches(const struct state_light *light, const double point[3])
{
    double to_point[3];
    vec3_sub(point, light->position, to_point);
    double distance = vec3_length(to_point);
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        return true;
    if (light->range > 0 && distance >= light->range)
        return false;
    return light->type == SCENE_LIGHT_POINT ||
           vec3_dot(to_point, light->direction) >= cos(light->outer_cone_rad) * distance;
}
