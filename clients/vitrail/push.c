/* SPDX-License-Identifier: MIT */
/* vitrail push: brings scenes and environment maps to the server and prints their ids. */
#include <jansson.h>
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/environment_source.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_source.h"
#include "clients/vitrail/warnings.h"

struct push_options {
    struct common_options common;
    struct file_options file;
    bool strict, demo;
};

/* path: NULL for the demo scene. */
static void print_push(const struct push_options *options, const char *path,
                       const struct scene_push *push, json_t *warnings)
{
    if (!options->common.json) {
        puts(push->id);
    } else {
        json_t *line =
            json_pack("{s:s?, s:s, s:b}", "file", path, "id", push->id, "sent", push->was_sent);
        if (line && warnings)
            json_object_set(line, "warnings", warnings);
        json_print(line, true);
        json_decref(line);
    }
    fflush(stdout);
    if (!options->common.json && !options->common.quiet)
        warnings_print(warnings, path ? path : "the demo scene");
}

/* path: NULL for the demo scene. The id is printed in any case: the server has the scene. */
static bool push_file(struct session *session, const struct push_options *options, const char *path,
                      struct failure *failure)
{
    struct scene_push push;
    bool is_map = false;
    if (path && !environment_source_is_map(path, &is_map, failure))
        return false;
    if (is_map ? !environment_source_push(session, path, &options->file, &push, failure)
        : path ? !scene_source_push(session, path, &options->file, &push, failure)
               : !scene_source_push_demo(session, options->file.name, &push, failure))
        return false;
    json_t *warnings = is_map ? warnings_of_environment(session, push.id, failure)
                              : warnings_of_scene(session, push.id, failure);
    progress_hide(&session->progress);
    print_push(options, path, &push, warnings);
    bool is_ok =
        !failure->exit_code && (!options->strict || warnings_refuse(warnings, NULL, failure));
    json_decref(warnings);
    return is_ok;
}

static bool check_file(const struct push_options *options, const char *path,
                       struct failure *failure)
{
    bool is_map;
    if (!environment_source_is_map(path, &is_map, failure))
        return false;
    if (is_map && options->file.scene)
        return fail(failure, EXIT_CODE_USAGE, "--scene: '%s' is an environment map", path);
    return is_map || scene_source_check(path, failure);
}

static bool push_run(void *context, const struct text_list *files, struct failure *failure)
{
    const struct push_options *options = context;
    struct session session = {0};
    bool is_ok = true;

    if (!options->demo && !files->count)
        return fail(failure, EXIT_CODE_USAGE, "push needs a FILE, or --demo");
    if (options->file.name && files->count + options->demo > 1)
        return fail(failure, EXIT_CODE_USAGE, "--name is for one FILE, and there are %zu",
                    files->count + options->demo);
    if (options->demo && (options->file.unit || options->file.up || options->file.deflection))
        return fail(failure, EXIT_CODE_USAGE, "--unit, --up and --deflection are for a FILE");
    if (options->file.scene && (files->count != 1 || options->demo))
        return fail(failure, EXIT_CODE_USAGE, "--scene is for one FILE, and there are %zu",
                    files->count + options->demo);
    for (size_t i = 0; i < files->count && is_ok; i++)
        is_ok = check_file(options, files->items[i], failure);
    is_ok = is_ok && session_begin(&session, &options->common, failure);
    if (is_ok && options->demo)
        is_ok = push_file(&session, options, NULL, failure);
    for (size_t i = 0; i < files->count && is_ok; i++)
        is_ok = push_file(&session, options, files->items[i], failure);
    progress_hide(&session.progress);
    session_end(&session);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_FLAG, "demo", 0, NULL, "have the server make its demo scene",
     offsetof(struct push_options, demo)},
    {OPTION_FLAG, "force", 0, NULL, "send even what the server has already",
     offsetof(struct push_options, file.force)},
    {OPTION_TEXT, "name", 0, "NAME", "what it is called (default: as its file)",
     offsetof(struct push_options, file.name)},
    SCENE_FILE_OPTIONS(struct push_options),
    {OPTION_FLAG, "strict", 0, NULL, "a scene with warnings is a failure",
     offsetof(struct push_options, strict)},
    {0},
};

const struct command COMMAND_PUSH = {
    .name = "push",
    .synopsis = "FILE... | --demo",
    .summary = "Send scenes (glTF, OBJ, STL, FBX and others) or environment maps, print their ids",
    .details = "Prints one id per line, in the order of the files. The files that a .gltf or .obj\n"
               "names go with it. A .glb or a map that the server has already is not sent again.\n"
               "The demo scene, a chapel with stained-glass windows, goes before the files, and\n"
               "nothing is sent for it.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_max = -1,
    .options_bytes = sizeof(struct push_options),
    .run = push_run,
};
