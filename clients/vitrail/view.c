/* SPDX-License-Identifier: MIT */
/* vitrail view: makes, shows, patches, looks at and forgets views of a server. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/view_client.h"

struct view_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    const char *output_file, *aov;
    bool through;
};

/* One call: a verb, and what it is about. */
struct view_call {
    const struct view_options *options;
    struct session *session;
    const char *subject; /* a scene or a view; NULL: all */
    const char *point;   /* of pick; or NULL */
    json_t *members;     /* what is sent; NULL where nothing is */
};

static bool print_from(const struct view_call *call, const char *path, const char *task,
                       struct failure *failure)
{
    json_t *json = session_get_json(call->session, path, task, failure);

    progress_hide(&call->session->progress);
    if (json)
        json_print(json, call->options->common.json);
    json_decref(json);
    return !failure->exit_code;
}

static bool create(const struct view_call *call, struct failure *failure)
{
    json_t *view =
        view_client_make(call->session, call->subject, &call->options->file,
                         !call->options->request.base_path, json_incref(call->members), failure);

    progress_hide(&call->session->progress);
    if (view && call->options->common.json)
        json_print(view, true);
    else if (view)
        puts(json_string_value(json_object_get(view, "id")));
    json_decref(view);
    return view != NULL;
}

static bool show(const struct view_call *call, struct failure *failure)
{
    char path[128];

    snprintf(path, sizeof path, "/v1/views%s%s", call->subject ? "/" : "",
             call->subject ? call->subject : "");
    return print_from(call, path, "the view", failure);
}

static bool patch(const struct view_call *call, struct failure *failure)
{
    return scene_source_bring_beside(call->session, call->members, failure) &&
           view_client_patch(call->session, call->subject, call->members, failure);
}

static bool image(const struct view_call *call, struct failure *failure)
{
    char query[64] = "";

    if (call->options->aov)
        snprintf(query, sizeof query, "&aov=%.40s", call->options->aov);
    return view_client_save(call->session, call->subject, query, call->options->output_file,
                            failure);
}

static bool pick(const struct view_call *call, struct failure *failure)
{
    char path[256], x[32] = "";
    const char *comma = strchr(call->point, ',');
    double number;

    if (comma && (size_t)(comma - call->point) < sizeof x)
        memcpy(x, call->point, (size_t)(comma - call->point));
    if (!comma || !number_parse(x, &number) || !number_parse(comma + 1, &number))
        return fail(failure, EXIT_CODE_USAGE, "'%s' is not X,Y in pixels", call->point);
    snprintf(path, sizeof path, "/v1/views/%s/pick?x=%s&y=%.30s%s", call->subject, x, comma + 1,
             call->options->through ? "&through=1" : "");
    return print_from(call, path, "the pick", failure);
}

static bool forget(const struct view_call *call, struct failure *failure)
{
    return view_client_delete(call->session, call->subject, failure);
}

static const struct verb {
    const char *name;
    int operands_min, operands_max; /* after the verb */
    bool is_of_scene, has_members, needs_file;
    bool (*run)(const struct view_call *call, struct failure *failure);
} VERBS[] = {
    {"create", 1, 1, true, true, false, create}, {"show", 0, 1, false, false, false, show},
    {"patch", 1, 1, false, true, false, patch},  {"image", 1, 1, false, false, true, image},
    {"pick", 2, 2, false, false, false, pick},   {"delete", 1, 1, false, false, false, forget},
};

static const struct verb *find_verb(const char *name, struct failure *failure)
{
    for (size_t i = 0; i < sizeof VERBS / sizeof *VERBS; i++)
        if (!strcmp(name, VERBS[i].name))
            return &VERBS[i];
    fail(failure, EXIT_CODE_USAGE, "'%s' is none of create, show, patch, image, pick, delete",
         name);
    return NULL;
}

/* Everything that can be known to be wrong before a server is asked. */
static bool check(const struct verb *verb, struct view_call *call, int operands,
                  struct failure *failure)
{
    if (operands < verb->operands_min || operands > verb->operands_max)
        return fail(failure, EXIT_CODE_USAGE, "'view %s' takes %d to %d operands, not %d",
                    verb->name, verb->operands_min, verb->operands_max, operands);
    if (verb->needs_file && !call->options->output_file)
        return fail(failure, EXIT_CODE_USAGE, "'view %s' needs an output: -o FILE.png", verb->name);
    if (verb->needs_file && !view_client_format(call->options->output_file, failure))
        return false;
    if (verb->has_members &&
        !(call->members = request_json_build(&call->options->request, failure)))
        return false;
    if (!verb->is_of_scene && call->subject && !view_id_is_valid(call->subject, failure))
        return false;
    if (call->options->file.scene && !verb->is_of_scene)
        return fail(failure, EXIT_CODE_USAGE, "--scene is for 'view create FILE'");
    return scene_source_check_all(verb->is_of_scene ? call->subject : NULL, &call->options->file,
                                  call->members, failure);
}

static bool view_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct view_options *options = context;
    const struct verb *verb = find_verb(operands->items[0], failure);
    struct session session = {0};
    struct view_call call = {.options = options,
                             .session = &session,
                             .subject = operands->count > 1 ? operands->items[1] : NULL,
                             .point = operands->count > 2 ? operands->items[2] : NULL};
    bool is_ok = verb && check(verb, &call, (int)operands->count - 1, failure) &&
                 session_begin(&session, &options->common, failure) && verb->run(&call, failure);

    progress_hide(&session.progress);
    session_end(&session);
    json_decref(call.members);
    return is_ok;
}

#define AT(member) offsetof(struct view_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE", "image: where it goes; .png .jpg .webp .exr",
     AT(output_file)},
    {OPTION_TEXT, "aov", 0, "NAME",
     "image: color, depth, normal, albedo, node, material, position,\n"
     "transmittance, lights, layers, optical_depth",
     AT(aov)},
    {OPTION_FLAG, "through", 0, NULL, "pick: every layer, nearest first", AT(through)},
    SCENE_FILE_OPTIONS(struct view_options),
    REQUEST_VIEW_OPTIONS(struct view_options),
    {0},
};

const struct command COMMAND_VIEW = {
    .name = "view",
    .synopsis = "VERB ...",
    .summary = "Make, edit and look at views that live on a server",
    .details = "  create FILE|SCENE     prints the id of the new view\n"
               "  show [VIEW]              the view, or a list of all\n"
               "  patch VIEW --set ...     changes members\n"
               "  image VIEW -o FILE       the exact image\n"
               "  pick VIEW X,Y            what is at that point of the image\n"
               "  delete VIEW              forgets it\n"
               "create and patch take the options from --camera on, as those of 'vitrail render';\n"
               "a patch with --light, --clip or --highlight replaces all of them, and\n"
               "--set /overrides/nodes/Door=null takes a member back.\n" REQUEST_HELP,
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 3,
    .options_bytes = sizeof(struct view_options),
    .run = view_run,
};
