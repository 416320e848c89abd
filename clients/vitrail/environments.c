/* SPDX-License-Identifier: MIT */
/* vitrail environments: lists the environment maps of the server, or describes one. */
#include <jansson.h>
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_source.h"

struct environments_options {
    struct common_options common;
};

static double number_at(const json_t *list, size_t index)
{
    return json_number_value(json_array_get(list, index));
}

static void print_table(const json_t *maps)
{
    const json_t *map;
    size_t index;

    json_array_foreach(maps, index, map)
    {
        char id[SCENE_ID_BYTES], name[256];
        const char *text = json_string_value(json_object_get(map, "id"));
        const char *title = json_string_value(json_object_get(map, "name"));
        const json_t *mean = json_object_get(map, "mean_radiance");
        text_copy_printable(id, sizeof id, text ? text : "");
        text_copy_printable(name, sizeof name, title ? title : "");
        printf("%s  %" JSON_INTEGER_FORMAT " x %" JSON_INTEGER_FORMAT ", %g %g %g nt  %s\n", id,
               json_integer_value(json_object_get(map, "width")),
               json_integer_value(json_object_get(map, "height")), number_at(mean, 0),
               number_at(mean, 1), number_at(mean, 2), name);
    }
}

static bool environments_run(void *context, const struct text_list *ids, struct failure *failure)
{
    const struct environments_options *options = context;
    struct session session = {0};
    json_t *answer = NULL;
    char path[128] = "/v1/environments", id[SCENE_ID_BYTES];
    bool is_ok = session_begin(&session, &options->common, failure);

    if (is_ok && ids->count) {
        is_ok = environment_reference_resolve(&session, ids->items[0], id, failure);
        if (is_ok)
            snprintf(path, sizeof path, "/v1/environments/%s", id);
    }
    if (is_ok)
        answer = session_get_json(
            &session, path, ids->count ? "the environment map" : "the list of environment maps",
            failure);
    progress_hide(&session.progress);
    if (answer && !ids->count && !options->common.json)
        print_table(json_object_get(answer, "environments"));
    else if (answer)
        json_print(answer, options->common.json);
    session_end(&session);
    json_decref(answer);
    return answer != NULL;
}

const struct command COMMAND_ENVIRONMENTS = {
    .name = "environments",
    .synopsis = "[MAP]",
    .summary = "List the environment maps of the server, or describe one",
    .details = "MAP is an id, the first digits of one (at least 4), or a name.",
    .is_remote = true,
    .operands_max = 1,
    .options_bytes = sizeof(struct environments_options),
    .run = environments_run,
};
