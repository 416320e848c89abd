/* SPDX-License-Identifier: MIT */
/* vitrail orbit: images from all around a scene, of one view, so that it is loaded once. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/view_client.h"

enum { IMAGES_MAX = 10000, IMAGES_DEFAULT = 24 };
static const double PI = 3.14159265358979323846;
static const double FOV_Y_DEG = 45, ELEVATION_DEG = 20, MARGIN = 1.05;

struct orbit_options {
    struct common_options common;
    struct request_options request;
    struct scene_wish file;
    const char *pattern;
    struct option_number count, elevation_deg;
};

/* Where the camera goes round. */
struct orbit {
    double center[3], radius_m, distance_m, elevation_rad;
    int count;
};

/* "view_%02d.png": one %d, which may have a width, and nothing else that printf reads. */
static bool check_pattern(const char *pattern, struct failure *failure)
{
    const char *percent = strchr(pattern, '%');
    const char *end = percent ? percent + 1 + strspn(percent + 1, "0123456789") : NULL;

    if (percent && end - percent <= 3 && *end == 'd' && !strchr(end, '%'))
        return view_client_format(pattern, failure) != NULL;
    return fail(failure, EXIT_CODE_USAGE, "'%s' must hold one %%d, such as view_%%02d.png",
                pattern);
}

/* The number in place of the %d. malloc'ed; NULL: no memory. */
static char *path_of(const char *pattern, int number)
{
    const char *percent = strchr(pattern, '%');
    int width = atoi(percent + 1);
    char *path;

    if (asprintf(&path, "%.*s%0*d%s", (int)(percent - pattern), pattern, width, number,
                 strchr(percent, 'd') + 1) < 0)
        return NULL;
    return path;
}

static bool read_vector(const json_t *array, double out[3])
{
    for (size_t i = 0; i < 3; i++) {
        const json_t *number = json_array_get(array, i);
        if (!json_is_number(number))
            return false;
        out[i] = json_number_value(number);
    }
    return true;
}

/* A sphere around the scene, seen whole; narrow pictures need more distance. */
static bool measure(struct session *session, const json_t *view, struct orbit *orbit,
                    struct failure *failure)
{
    char path[128];
    double low[3], high[3], square = 0;
    const char *scene = json_string_value(json_object_get(view, "scene"));
    double width = json_number_value(json_object_get(view, "width"));
    double height = json_number_value(json_object_get(view, "height"));

    snprintf(path, sizeof path, "/v1/scenes/%s", scene ? scene : "");
    json_t *summary = session_get_json(session, path, "the scene", failure);
    const json_t *bounds = json_object_get(summary, "bounds");
    bool is_ok = read_vector(json_object_get(bounds, "min"), low) &&
                 read_vector(json_object_get(bounds, "max"), high);
    json_decref(summary);
    if (!is_ok)
        return fail(failure, EXIT_CODE_REFUSED, "the scene has nothing to go round");
    for (int k = 0; k < 3; k++) {
        orbit->center[k] = 0.5 * (low[k] + high[k]);
        square += 0.25 * (high[k] - low[k]) * (high[k] - low[k]);
    }
    orbit->radius_m = sqrt(square) > 0 ? sqrt(square) : 1;
    double half = 0.5 * FOV_Y_DEG * PI / 180;
    if (width > 0 && width < height)
        half = atan(tan(half) * width / height);
    orbit->distance_m = MARGIN * orbit->radius_m / sin(half);
    return true;
}

static json_t *camera_of(const struct orbit *orbit, int number)
{
    double around = 2 * PI * number / orbit->count, flat = cos(orbit->elevation_rad);
    const double *c = orbit->center;

    return json_pack("{s:{s:[f,f,f],s:[f,f,f],s:f}}", "camera", "eye",
                     c[0] + orbit->distance_m * flat * sin(around),
                     c[1] + orbit->distance_m * sin(orbit->elevation_rad),
                     c[2] + orbit->distance_m * flat * cos(around), "target", c[0], c[1], c[2],
                     "fov_y_deg", FOV_Y_DEG);
}

static bool take_image(struct session *session, const struct orbit_options *options, const char *id,
                       const struct orbit *orbit, int number, struct failure *failure)
{
    json_t *patch = camera_of(orbit, number);
    char *path = path_of(options->pattern, number);
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
        options->elevation_deg.is_given ? options->elevation_deg.value : ELEVATION_DEG;
    struct session session = {0};
    struct orbit orbit = {.elevation_rad = elevation * PI / 180};

    if (!options->pattern)
        return fail(failure, EXIT_CODE_USAGE, "orbit needs an output: -o 'view_%%02d.png'");
    if (!(count >= 1 && count <= IMAGES_MAX) || count != floor(count))
        return fail(failure, EXIT_CODE_USAGE, "--count: a whole number from 1 to %d", IMAGES_MAX);
    if (!(fabs(elevation) <= 89))
        return fail(failure, EXIT_CODE_USAGE, "--elevation: degrees, from -89 to 89");
    orbit.count = (int)count;
    json_t *members = request_json_build(&options->request, failure);
    bool is_ok = members && check_pattern(options->pattern, failure) &&
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
