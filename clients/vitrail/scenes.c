/* SPDX-License-Identifier: MIT */
/* vitrail scenes: lists the scenes of the server, or describes one. */
#include <jansson.h>
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_source.h"

struct scenes_options {
    struct common_options common;
};

static void print_table(const json_t *scenes)
{
    const json_t *scene;
    size_t index;

    json_array_foreach(scenes, index, scene)
    {
        char id[SCENE_ID_BYTES], name[256];
        const char *text = json_string_value(json_object_get(scene, "id"));
        const char *title = json_string_value(json_object_get(scene, "name"));
        const json_t *bytes = json_object_get(scene, "bytes");
        json_int_t decoded = json_integer_value(json_object_get(bytes, "decoded"));
        text_copy_printable(id, sizeof id, text ? text : "");
        text_copy_printable(name, sizeof name, title ? title : "");
        printf("%s  %" JSON_INTEGER_FORMAT " triangles, %" JSON_INTEGER_FORMAT
               " materials, %" JSON_INTEGER_FORMAT " lights, %.1f MiB  %s\n",
               id, json_integer_value(json_object_get(scene, "triangles")),
               json_integer_value(json_object_get(scene, "material_count")),
               json_integer_value(json_object_get(scene, "light_count")),
               (double)decoded / 1048576., name);
    }
}

static bool scenes_run(void *context, const struct text_list *ids, struct failure *failure)
{
    const struct scenes_options *options = context;
    struct session session = {0};
    json_t *answer = NULL;
    char path[128] = "/v1/scenes", id[SCENE_ID_BYTES];
    bool is_ok = session_begin(&session, &options->common, failure);

    if (is_ok && ids->count) {
        is_ok = scene_reference_resolve(&session, ids->items[0], id, failure);
        if (is_ok)
            snprintf(path, sizeof path, "/v1/scenes/%s", id);
    }
    if (is_ok)
        answer = session_get_json(&session, path, ids->count ? "the scene" : "the list of scenes",
                                  failure);
    progress_hide(&session.progress);
    if (answer && !ids->count && !options->common.json)
        print_table(json_is_array(answer) ? answer : json_object_get(answer, "scenes"));
    else if (answer)
        json_print(answer, options->common.json);
    session_end(&session);
    json_decref(answer);
    return answer != NULL;
}

const struct command COMMAND_SCENES = {
    .name = "scenes",
    .synopsis = "[SCENE]",
    .summary = "List the scenes of the server, or describe one",
    .details = "SCENE is an id, the first digits of one (at least 4), or a name.",
    .is_remote = true,
    .operands_max = 1,
    .options_bytes = sizeof(struct scenes_options),
    .run = scenes_run,
};
