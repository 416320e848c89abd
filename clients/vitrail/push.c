/* SPDX-License-Identifier: MIT */
/* vitrail push: brings scenes and environment maps to the server and prints their ids. */
#include <jansson.h>
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/environment_source.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_source.h"
#include "clients/vitrail/specs.h"
#include "clients/vitrail/warnings.h"

struct push_options {
    struct common_options common;
    struct file_options file;
    struct text_list procedures;
    bool strict, demo;
};

/* path: of a file, else NULL; what: for people. */
static void print_push(const struct push_options *options, const char *path, const char *what,
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
        warnings_print(warnings, what);
}

/* Tells of what the server has now; in any case its id. */
static bool tell(struct session *session, const struct push_options *options, const char *path,
                 const char *what, const struct scene_push *push, json_t *warnings,
                 struct failure *failure)
{
    progress_hide(&session->progress);
    print_push(options, path, what, push, warnings);
    bool is_ok =
        !failure->exit_code && (!options->strict || warnings_refuse(warnings, NULL, failure));
    json_decref(warnings);
    return is_ok;
}

/* path: NULL for the demo scene. */
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
    return tell(session, options, path, path ? path : "the demo scene", &push, warnings, failure);
}

static bool push_procedure(struct session *session, const struct push_options *options,
                           const char *spec, struct failure *failure)
{
    struct scene_push push;
    json_t *grid = procedure_spec_parse(spec, failure);
    bool is_ok = grid && scene_source_push_grid(session, grid, options->file.name, &push, failure);
    json_decref(grid);
    return is_ok && tell(session, options, NULL, spec, &push,
                         warnings_of_scene(session, push.id, failure), failure);
}

/* Before a server is started for them. */
static bool check_procedures(const struct push_options *options, struct failure *failure)
{
    for (size_t i = 0; i < options->procedures.count; i++) {
        json_t *grid = procedure_spec_parse(options->procedures.items[i], failure);
        if (!grid)
            return false;
        json_decref(grid);
    }
    return true;
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

static bool check_options(const struct push_options *options, const struct text_list *files,
                          struct failure *failure)
{
    const struct file_options *file = &options->file;
    size_t made = options->demo + options->procedures.count, count = files->count + made;

    if (!count)
        return fail(failure, EXIT_CODE_USAGE, "push needs a FILE, or --demo, or --procedure");
    if (file->name && count > 1)
        return fail(failure, EXIT_CODE_USAGE, "--name is for one FILE, and there are %zu", count);
    if (made && (file->unit || file->up || file->deflection))
        return fail(failure, EXIT_CODE_USAGE, "--unit, --up and --deflection are for a FILE");
    if (file->scene && (files->count != 1 || made))
        return fail(failure, EXIT_CODE_USAGE, "--scene is for one FILE, and there are %zu", count);
    return check_procedures(options, failure);
}

static bool push_run(void *context, const struct text_list *files, struct failure *failure)
{
    const struct push_options *options = context;
    struct session session = {0};
    bool is_ok = check_options(options, files, failure);

    if (!is_ok)
        return false;
    for (size_t i = 0; i < files->count && is_ok; i++)
        is_ok = check_file(options, files->items[i], failure);
    is_ok = is_ok && session_begin(&session, &options->common, failure);
    if (is_ok && options->demo)
        is_ok = push_file(&session, options, NULL, failure);
    for (size_t i = 0; i < options->procedures.count && is_ok; i++)
        is_ok = push_procedure(&session, options, options->procedures.items[i], failure);
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
    {OPTION_LIST, "procedure", 0, "SPEC",
     "one more scene, of a density grid that the server makes:\nsmoke, fog or cloud, then such as "
     ":min=-1,0,-1;max=1,4,1;\ndensity=20;seed=3",
     offsetof(struct push_options, procedures)},
    SCENE_FILE_OPTIONS(struct push_options),
    {OPTION_FLAG, "strict", 0, NULL, "a scene with warnings is a failure",
     offsetof(struct push_options, strict)},
    {0},
};

const struct command COMMAND_PUSH = {
    .name = "push",
    .synopsis = "FILE... | --demo | --procedure SPEC",
    .summary = "Send scenes (glTF, OBJ, STL, FBX and others) or environment maps, print their ids",
    .details = "Prints one id per line, in the order of the files. The files that a .gltf or .obj\n"
               "names go with it. A .glb or a map that the server has already is not sent again.\n"
               "The demo scene, a chapel with stained-glass windows, and smoke by procedures go\n"
               "before the files.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_max = -1,
    .options_bytes = sizeof(struct push_options),
    .run = push_run,
};
