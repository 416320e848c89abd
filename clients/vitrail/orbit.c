/* SPDX-License-Identifier: MIT */
/* vitrail orbit: images from all around a scene, of one view, so that it is loaded once. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/numbered_path.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/view_client.h"
#include "protocol/turntable.h"

enum { IMAGES_MAX = 10000, IMAGES_DEFAULT = 24 };

struct orbit_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    const char *pattern;
    struct option_number count, elevation_deg;
};

/* Where the camera goes round. */
struct orbit {
    struct turntable table;
    double elevation_deg;
    int count;
};

static bool measure(struct session *session, const json_t *view, struct orbit *orbit,
                    struct failure *failure)
{
    char path[128];
    const char *scene = json_string_value(json_object_get(view, "scene"));

    snprintf(path, sizeof path, "/v1/scenes/%s", scene ? scene : "");
    json_t *summary = session_get_json(session, path, "the scene", failure);
    bool is_ok =
        turntable_init(&orbit->table, summary, json_number_value(json_object_get(view, "width")),
                       json_number_value(json_object_get(view, "height")));
    json_decref(summary);
    return is_ok || fail(failure, EXIT_CODE_REFUSED, "the scene has nothing to go round");
}

static json_t *camera_of(const struct orbit *orbit, int number)
{
    const double *c = orbit->table.center;
    double eye[3];

    turntable_eye(&orbit->table, orbit->elevation_deg, (double)number / orbit->count, eye);
    return json_pack("{s:{s:[f,f,f],s:[f,f,f],s:f}}", "camera", "eye", eye[0], eye[1], eye[2],
                     "target", c[0], c[1], c[2], "fov_y_deg", TURNTABLE_FOV_Y_DEG);
}

static bool take_image(struct session *session, const struct orbit_options *options, const char *id,
                       const struct orbit *orbit, int number, struct failure *failure)
{
    json_t *patch = camera_of(orbit, number);
    char *path = numbered_path_make(options->pattern, number);
    bool is_ok = (patch && path) || fail_no_memory(failure);

    is_ok = is_ok && view_client_patch(session, id, patch, failure) &&
            view_client_save(session, id, "", path, failure);
    progress_hide(&session->progress);
    if (is_ok && !options->common.quiet)
        puts(path);
    fflush(stdout);
    free(path);
    json_decref(patch);
    return is_ok;
}

/* Takes members. */
static bool go_round(struct session *session, const struct orbit_options *options,
                     const char *scene, json_t *members, struct orbit *orbit,
                     struct failure *failure)
{
    json_t *view = view_client_make(session, scene, &options->file, false, members, failure);
    const char *id = json_string_value(json_object_get(view, "id"));
    struct failure ignored = {0};
    bool is_ok = id && measure(session, view, orbit, failure);

    for (int i = 0; is_ok && i < orbit->count; i++)
        is_ok = take_image(session, options, id, orbit, i, failure);
    if (id)
        view_client_delete(session, id, &ignored);
    json_decref(view);
    return is_ok;
}

static bool orbit_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct orbit_options *options = context;
    const char *scene = operands->items[0];
    double count = options->count.is_given ? options->count.value : IMAGES_DEFAULT;
    double elevation =
        options->elevation_deg.is_given ? options->elevation_deg.value : TURNTABLE_ELEVATION_DEG;
    struct session session = {0};
    struct orbit orbit = {.elevation_deg = elevation};

    if (!options->pattern)
        return fail(failure, EXIT_CODE_USAGE, "orbit needs an output: -o 'view_%%02d.png'");
    if (!(count >= 1 && count <= IMAGES_MAX) || count != floor(count))
        return fail(failure, EXIT_CODE_USAGE, "--count: a whole number from 1 to %d", IMAGES_MAX);
    if (!(fabs(elevation) <= 89))
        return fail(failure, EXIT_CODE_USAGE, "--elevation: degrees, from -89 to 89");
    orbit.count = (int)count;
    json_t *members = request_json_build(&options->request, failure);
    bool is_ok = members && numbered_path_check(options->pattern, failure) &&
                 view_client_format(options->pattern, failure) &&
                 scene_source_check_all(scene, &options->file, members, failure) &&
                 session_begin(&session, &options->common, failure) &&
                 go_round(&session, options, scene, json_incref(members), &orbit, failure);
    json_decref(members);
    session_end(&session);
    return is_ok;
}

#define AT(member) offsetof(struct orbit_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "PATTERN", "such as view_%02d.png, counted from 0",
     AT(pattern)},
    {OPTION_NUMBER, "count", 'n', "N", "images; default 24", AT(count)},
    {OPTION_NUMBER, "elevation", 0, "DEGREES", "of the camera above the horizon; default 20",
     AT(elevation_deg)},
    SCENE_FILE_OPTIONS(struct orbit_options),
    REQUEST_LOOK_OPTIONS(struct orbit_options),
    {0},
};

const struct command COMMAND_ORBIT = {
    .name = "orbit",
    .synopsis = "FILE|SCENE -o PATTERN",
    .summary = "Images from all around a scene, which is loaded once",
    .details = REQUEST_HELP
    "The camera goes round the vertical axis through the middle of the scene,\n"
    "counter-clockwise seen from above, beginning in front (+Z), and sees it whole.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct orbit_options),
    .run = orbit_run,
};
