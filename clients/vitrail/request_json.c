/* SPDX-License-Identifier: MIT */
/* Builds render requests. Values pass through unjudged, so that a newer server's techniques can be
 * named. */
#include "clients/vitrail/request_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/vitrail/specs.h"

json_t *json_object_load(const char *path, const char *option, struct failure *failure)
{
    json_error_t problem;
    json_t *root;

    if (access(path, R_OK) != 0) {
        fail(failure, EXIT_CODE_NO_INPUT, "--%s: cannot read '%s'", option, path);
        return NULL;
    }
    root = json_load_file(path, JSON_REJECT_DUPLICATES, &problem);
    if (root && json_is_object(root))
        return root;
    if (root)
        fail(failure, EXIT_CODE_USAGE, "--%s: '%s' is not a JSON object", option, path);
    else
        fail(failure, EXIT_CODE_USAGE, "--%s: '%s', line %d: %s", option, path, problem.line,
             problem.text);
    json_decref(root);
    return NULL;
}

/* The object `name` of `root`, made when it is not there. NULL: no memory. */
static json_t *member_object(json_t *root, const char *name)
{
    json_t *object = json_object_get(root, name);

    if (json_is_object(object))
        return object;
    json_object_set_new(root, name, json_object());
    return json_object_get(root, name);
}

/* Takes `value`; NULL means that parsing it has failed already. */
static bool put(json_t *object, const char *name, json_t *value, struct failure *failure)
{
    if (!value || json_object_set_new(object, name, value) != 0)
        return fail_no_memory(failure); /* unless parsing has said more */
    return true;
}

static bool put_text(json_t *object, const char *name, const char *text, struct failure *failure)
{
    json_t *value;

    if (!text)
        return true;
    value = json_string(text);
    if (!value)
        return fail(failure, EXIT_CODE_USAGE, "'%.200s' is not UTF-8", text);
    return put(object, name, value, failure);
}

static bool put_number(json_t *object, const char *name, const struct option_number *number,
                       struct failure *failure)
{
    json_int_t whole;

    if (!number->is_given)
        return true;
    whole = number->value > -1e9 && number->value < 1e9 ? (json_int_t)number->value : 0;
    return put(object, name,
               (double)whole == number->value ? json_integer(whole) : json_real(number->value),
               failure);
}

static bool put_quality(json_t *root, const struct request_options *options,
                        struct failure *failure)
{
    json_t *quality;

    if (!options->shadows && !options->transparency && !options->light_lists &&
        !options->blend_filter && !options->shadow_resolution.is_given &&
        !options->shadow_compression.is_given && !options->shadow_prefilter.is_given &&
        !options->shadow_fallback.is_given && !options->samples.is_given && !options->reference &&
        !options->area_samples.is_given && !options->environment_samples.is_given &&
        !options->haze_samples.is_given && !options->refraction &&
        !options->refraction_samples.is_given && !options->environment_visibility &&
        !options->max_error.is_given && !options->budget_ms.is_given)
        return true;
    quality = member_object(root, "quality");
    return put_text(quality, "shadows", options->shadows, failure) &&
           put_text(quality, "transparency", options->transparency, failure) &&
           put_text(quality, "light_lists", options->light_lists, failure) &&
           put_text(quality, "blend_filter", options->blend_filter, failure) &&
           put_text(quality, "refraction", options->refraction, failure) &&
           put_number(quality, "refraction_samples", &options->refraction_samples, failure) &&
           put_number(quality, "shadow_resolution", &options->shadow_resolution, failure) &&
           put_number(quality, "shadow_compression", &options->shadow_compression, failure) &&
           put_number(quality, "shadow_prefilter", &options->shadow_prefilter, failure) &&
           put_number(quality, "shadow_fallback", &options->shadow_fallback, failure) &&
           put_number(quality, "samples", &options->samples, failure) &&
           (!options->reference || put(quality, "reference", json_true(), failure)) &&
           put_number(quality, "area_samples", &options->area_samples, failure) &&
           put_text(quality, "environment_visibility", options->environment_visibility, failure) &&
           put_number(quality, "environment_samples", &options->environment_samples, failure) &&
           put_number(quality, "atmosphere_samples", &options->haze_samples, failure) &&
           put_number(quality, "max_error", &options->max_error, failure) &&
           put_number(quality, "budget_ms", &options->budget_ms, failure);
}

/* Adds the parsed items of `list` to the array `name`, which is made when it is not there. */
static bool put_list(json_t *root, const char *name, const struct text_list *list,
                     json_t *(*parse)(const char *text, struct failure *failure),
                     struct failure *failure)
{
    json_t *array = json_object_get(root, name);

    if (list->count == 0)
        return true;
    if (!json_is_array(array)) {
        json_object_set_new(root, name, json_array());
        array = json_object_get(root, name);
    }
    for (size_t i = 0; i < list->count; i++) {
        json_t *item = parse(list->items[i], failure);
        if (!item)
            return false;
        if (json_array_append_new(array, item) != 0)
            return fail_no_memory(failure);
    }
    return true;
}

static bool put_lights(json_t *root, const struct request_options *options, struct failure *failure)
{
    if (options->no_scene_lights && !put(root, "scene_lights", json_false(), failure))
        return false;
    return put_list(root, "lights", &options->lights, light_spec_parse, failure);
}

static json_t *node_name(const char *text, struct failure *failure)
{
    json_t *name = json_string(text);

    if (!name)
        fail(failure, EXIT_CODE_USAGE, "--highlight: '%.200s' is not UTF-8", text);
    return name;
}

static bool put_parts(json_t *root, const struct text_list *list, struct failure *failure)
{
    json_t *parts = json_object();
    bool is_ok = parts || fail_no_memory(failure);

    for (size_t i = 0; i < list->count && is_ok; i++)
        is_ok = part_spec_parse(list->items[i], parts, failure);
    if (is_ok && list->count && json_object_update(member_object(root, "parts"), parts) != 0)
        is_ok = fail_no_memory(failure);
    json_decref(parts);
    return is_ok;
}

static bool put_grids(json_t *root, const struct text_list *list, struct failure *failure)
{
    json_t *grids = json_object();
    bool is_ok = grids || fail_no_memory(failure);

    for (size_t i = 0; i < list->count && is_ok; i++)
        is_ok = grid_spec_parse(list->items[i], grids, failure);
    if (is_ok && list->count &&
        json_object_update(member_object(member_object(root, "overrides"), "grids"), grids) != 0)
        is_ok = fail_no_memory(failure);
    json_decref(grids);
    return is_ok;
}

/* Cuts, what is drawn over the picture, other scenes in it, and looks of smoke. */
static bool put_assembly(json_t *root, const struct request_options *options,
                         struct failure *failure)
{
    if (!put_list(root, "clip_planes", &options->clips, clip_spec_parse, failure))
        return false;
    if (options->highlights.count && !put_list(member_object(root, "highlight"), "nodes",
                                               &options->highlights, node_name, failure))
        return false;
    if (options->edges && !put(root, "edges", edges_spec_parse(options->edges, failure), failure))
        return false;
    return put_parts(root, &options->parts, failure) && put_grids(root, &options->grids, failure);
}

/* --output a --output b and --output a,b say the same. */
static bool put_outputs(json_t *root, const struct request_options *options,
                        struct failure *failure)
{
    json_t *outputs;
    bool is_ok = true;

    if (options->outputs.count == 0)
        return true;
    outputs = json_array();
    for (size_t i = 0; i < options->outputs.count && is_ok; i++) {
        char *copy = strdup(options->outputs.items[i]), *rest = copy, *name;
        is_ok = outputs && copy;
        while (is_ok && (name = strsep(&rest, ",")))
            is_ok = json_array_append_new(outputs, json_string(name)) == 0;
        free(copy);
    }
    if (is_ok)
        return put(root, "outputs", outputs, failure);
    json_decref(outputs);
    return fail_no_memory(failure);
}

static bool put_size(json_t *root, const char *size, struct failure *failure)
{
    int width_px, height_px;

    if (!size)
        return true;
    return size_parse(size, &width_px, &height_px, failure) &&
           put(root, "width", json_integer(width_px), failure) &&
           put(root, "height", json_integer(height_px), failure);
}

static bool put_animation(json_t *root, const struct request_options *options,
                          struct failure *failure)
{
    if (!options->time_s.is_given && !options->animation)
        return true;
    json_t *animation = member_object(root, "animation");
    return put_text(animation, "name", options->animation, failure) &&
           put_number(animation, "time_s", &options->time_s, failure);
}

static bool put_exposure(json_t *root, const char *exposure, struct failure *failure)
{
    struct option_number number = {.is_given = true};

    if (!exposure || strcmp(exposure, "auto") == 0)
        return put_text(root, "exposure_ev", exposure, failure);
    if (!number_parse(exposure, &number.value))
        return fail(failure, EXIT_CODE_USAGE, "--exposure takes a number or auto, not '%.80s'",
                    exposure);
    return put_number(root, "exposure_ev", &number, failure);
}

static bool put_ground_plane(json_t *root, const char *height, struct failure *failure)
{
    struct option_number number = {.is_given = true};

    if (!height)
        return true;
    if (strcmp(height, "auto") == 0)
        return put(root, "ground_plane", json_object(), failure);
    if (!number_parse(height, &number.value))
        return fail(failure, EXIT_CODE_USAGE,
                    "--ground-plane takes a number of metres or auto, not '%.80s'", height);
    return put_number(member_object(root, "ground_plane"), "height", &number, failure);
}

static bool put_haze(json_t *root, const struct request_options *options, struct failure *failure)
{
    json_t *atmosphere;

    if (!options->haze.is_given && !options->haze_color && !options->haze_anisotropy.is_given &&
        !options->haze_falloff.is_given && !options->haze_base.is_given)
        return true;
    atmosphere = member_object(root, "atmosphere");
    return put_number(atmosphere, "density", &options->haze, failure) &&
           (!options->haze_color ||
            put(atmosphere, "color", numbers_parse(options->haze_color, 3, "--haze-color", failure),
                failure)) &&
           put_number(atmosphere, "anisotropy", &options->haze_anisotropy, failure) &&
           put_number(atmosphere, "falloff_m", &options->haze_falloff, failure) &&
           put_number(atmosphere, "base_m", &options->haze_base, failure);
}

/* The light itself takes the place of what the base has; the rest goes over it. */
static bool put_environment(json_t *root, const struct request_options *options,
                            struct failure *failure)
{
    json_t *environment;

    if (options->environment &&
        !put(root, "environment", environment_spec_parse(options->environment, failure), failure))
        return false;
    if (!options->environment_rotation.is_given && !options->environment_intensity.is_given &&
        !options->environment_background)
        return true;
    environment = member_object(root, "environment");
    return put_number(environment, "rotation_deg", &options->environment_rotation, failure) &&
           put_number(environment, "intensity", &options->environment_intensity, failure) &&
           (!options->environment_background ||
            put(environment, "background", json_true(), failure));
}

static bool put_view(json_t *root, const struct request_options *options, struct failure *failure)
{
    if (options->camera &&
        !put(root, "camera", camera_spec_parse(options->camera, failure), failure))
        return false;
    if (options->background &&
        !put(root, "background", numbers_parse(options->background, 4, "--background", failure),
             failure))
        return false;
    if (options->tile && !put(root, "tile", tile_spec_parse(options->tile, failure), failure))
        return false;
    return put_environment(root, options, failure) && put_haze(root, options, failure) &&
           put_size(root, options->size, failure) && put_animation(root, options, failure) &&
           put_text(root, "variant", options->variant, failure) &&
           put_text(root, "studio", options->studio, failure) &&
           put_ground_plane(root, options->ground_plane, failure) &&
           put_text(root, "tone_mapping", options->tone_mapping, failure) &&
           put_text(root, "format", options->format, failure) &&
           put_exposure(root, options->exposure, failure);
}

json_t *request_json_build(const struct request_options *options, struct failure *failure)
{
    const char *base = options->base_path;
    json_t *root = base ? json_object_load(base, "request", failure) : json_object();
    bool is_ok = root || fail_no_memory(failure);

    is_ok = is_ok && put_view(root, options, failure) && put_quality(root, options, failure) &&
            put_lights(root, options, failure) && put_assembly(root, options, failure) &&
            put_outputs(root, options, failure);
    for (size_t i = 0; i < options->settings.count && is_ok; i++)
        is_ok = request_json_set(root, options->settings.items[i], failure);
    if (is_ok)
        return root;
    json_decref(root);
    return NULL;
}

/* Undoes ~1 and ~0 of RFC 6901, 4, in place. */
static void unescape(char *token)
{
    char *out = token;

    for (const char *in = token; *in; in++) {
        if (in[0] == '~' && (in[1] == '0' || in[1] == '1')) {
            *out++ = in[1] == '1' ? '/' : '~';
            in++;
        } else {
            *out++ = *in;
        }
    }
    *out = '\0';
}

/* Index of an array's member: digits, or "-" for one past the end. */
static bool array_index(const json_t *array, const char *token, size_t *index)
{
    char *end;
    size_t size = json_array_size(array);

    *index = size;
    if (!strcmp(token, "-"))
        return true;
    if (!*token || strspn(token, "0123456789") != strlen(token) || strlen(token) > 9)
        return false;
    *index = strtoul(token, &end, 10);
    return *index <= size;
}

/* The container one step down, made when nothing is there; NULL when something else is in the way.
 */
static json_t *step_down(json_t *at, const char *token)
{
    size_t index;

    if (json_is_object(at)) {
        json_t *next = json_object_get(at, token);
        if (next && !json_is_null(next))
            return next;
        json_object_set_new(at, token, json_object());
        return json_object_get(at, token);
    }
    if (!json_is_array(at) || !array_index(at, token, &index))
        return NULL;
    if (index == json_array_size(at))
        json_array_append_new(at, json_object());
    return json_array_get(at, index);
}

/* Puts `value`, which is borrowed, where `token` of `at` is. */
static bool set_last(json_t *at, const char *token, json_t *value)
{
    size_t index;

    if (json_is_object(at))
        return json_object_set(at, token, value) == 0;
    if (!json_is_array(at) || !array_index(at, token, &index))
        return false;
    return (index == json_array_size(at) ? json_array_append(at, value)
                                         : json_array_set(at, index, value)) == 0;
}

bool request_json_set(json_t *root, const char *setting, struct failure *failure)
{
    const char *equals = strchr(setting, '=');
    json_t *value =
        equals ? json_loads(equals + 1, JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL) : NULL;
    char *pointer = equals ? strndup(setting, (size_t)(equals - setting)) : NULL;
    char *rest = pointer, *token;
    json_t *at = root;
    bool is_ok = false;

    if (!equals || setting[0] != '/' || equals == setting + 1) {
        fail(failure, EXIT_CODE_USAGE,
             "--set: '%.200s' is not POINTER=JSON, such as "
             "/camera/fov_y_deg=30",
             setting);
    } else if (!value) {
        fail(failure, EXIT_CODE_USAGE, "--set: '%.200s' is not JSON; a text needs quotes: \"...\"",
             equals + 1);
    } else if (rest) {
        strsep(&rest, "/"); /* before the first slash */
        while (at && (token = strsep(&rest, "/"))) {
            unescape(token);
            if (!rest)
                is_ok = set_last(at, token, value);
            else
                at = step_down(at, token);
        }
        if (!is_ok)
            fail(failure, EXIT_CODE_USAGE,
                 "--set: '%.200s' leads through something that is "
                 "neither an object nor an array's member",
                 setting);
    }
    json_decref(value);
    free(pointer);
    return is_ok || fail_no_memory(failure);
}
