/* SPDX-License-Identifier: MIT */
/* `vitrail-bench generate`: a generated scene as a file, for who measures over HTTP. */
#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/generated_scene.h"

static json_t *write_light(const struct view_light *light)
{
    bool is_spot = light->type == SCENE_LIGHT_SPOT;
    const double *at = light->position, *to = light->direction;
    json_t *json =
        json_pack("{s:s,s:[f,f,f],s:[f,f,f],s:f}", "type", is_spot ? "spot" : "point", "position",
                  at[0], at[1], at[2], "color", (double)light->color[0], (double)light->color[1],
                  (double)light->color[2], "intensity", (double)light->intensity);
    if (light->range > 0)
        json_object_set_new(json, "range", json_real((double)light->range));
    if (!is_spot)
        return json;
    json_object_set_new(json, "direction", json_pack("[f,f,f]", to[0], to[1], to[2]));
    json_object_set_new(json, "inner_cone_deg", json_real((double)light->inner_cone_deg));
    json_object_set_new(json, "outer_cone_deg", json_real((double)light->outer_cone_deg));
    return json;
}

/* Of a render, but its scene and quality. */
static json_t *write_request(const struct generated_scene *scene)
{
    const struct view_camera *camera = &scene->view.camera;
    json_t *lights = json_array();
    for (size_t i = 0; i < scene->view.light_count; i++)
        json_array_append_new(lights, write_light(&scene->lights[i]));
    return json_pack("{s:s,s:i,s:i,s:{s:[f,f,f],s:[f,f,f],s:f},s:o}", "name", scene->name, "width",
                     scene->view.width_px, "height", scene->view.height_px, "camera", "eye",
                     camera->eye[0], camera->eye[1], camera->eye[2], "target", camera->target[0],
                     camera->target[1], camera->target[2], "fov_y_deg", (double)camera->fov_y_deg,
                     "lights", lights);
}

int bench_generate(int count, char **arguments)
{
    struct error err = {0};
    char *end = NULL;
    bool is_smoky = count == 3 && strcmp(arguments[2], "--smoke") == 0;
    unsigned long seed = count == 2 || is_smoky ? strtoul(arguments[0], &end, 10) : 0;
    struct generated_scene *scene = calloc(1, sizeof *scene);
    if (!seed || *end || !scene) {
        fputs("usage: vitrail-bench generate SEED FILE.glb [--smoke]\n", stderr);
        free(scene);
        return 2;
    }
    bool ok = is_smoky ? generated_scene_make_smoky(scene, seed, &err)
                       : generated_scene_make(scene, seed, &err);
    FILE *file = ok ? fopen(arguments[1], "wbe") : NULL;
    if (ok && (!file || fwrite(scene->glb, 1, scene->glb_bytes, file) != scene->glb_bytes))
        ok = error_set(&err, ERROR_INTERNAL, "%s: %s", arguments[1], strerror(errno));
    if (file && fclose(file) != 0)
        ok = error_set(&err, ERROR_INTERNAL, "%s: %s", arguments[1], strerror(errno));
    json_t *request = ok ? write_request(scene) : NULL;
    if (request)
        json_dumpf(request, stdout, JSON_INDENT(1));
    else
        fprintf(stderr, "vitrail-bench: generate: %s\n", err.message);
    json_decref(request);
    generated_scene_finish(scene);
    free(scene);
    return ok ? 0 : 1;
}
