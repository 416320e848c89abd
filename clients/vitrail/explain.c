/* SPDX-License-Identifier: MIT */
/* vitrail explain: what a frame of a scene requires, and the passes that follow, without drawing
 * it.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/output_file.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/scene_defaults.h"
#include "clients/vitrail/scene_source.h"

struct explain_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    const char *output;
    bool shaders; /* their sources instead of the plan */
};

/* One run of the command. Zeroed = nothing done. */
struct explaining {
    const struct explain_options *options;
    const char *source; /* file or id, as given */
    const char *path;   /* of the route, with the form */
    json_t *request;
    struct session session;
    struct output_file output;
    struct scene_push scene;
    struct http_reply reply;
};

static const struct {
    const char *extension, *path;
} FORMS[] = {
    {".txt", "/v1/renders?explain=text"},  {".json", "/v1/renders?explain=json"},
    {".dot", "/v1/renders?explain=dot"},   {".svg", "/v1/renders?explain=svg"},
    {".glsl", "/v1/renders?explain=glsl"},
};
enum { FORM_TEXT, FORM_JSON, FORM_GLSL = 4 };

static bool choose_form(struct explaining *explaining, struct failure *failure)
{
    const char *output = explaining->options->output;
    const char *dot = output ? strrchr(output, '.') : NULL;

    explaining->path = FORMS[explaining->options->shaders       ? FORM_GLSL
                             : explaining->options->common.json ? FORM_JSON
                                                                : FORM_TEXT]
                           .path;
    if (explaining->options->shaders || !output || !strcmp(output, "-"))
        return true;
    for (size_t i = 0; dot && i < sizeof FORMS / sizeof *FORMS; i++)
        if (!strcasecmp(dot, FORMS[i].extension)) {
            explaining->path = FORMS[i].path;
            return true;
        }
    return fail(failure, EXIT_CODE_USAGE,
                "cannot tell the form of '%s': use .txt, .json, .dot, .svg or .glsl", output);
}

static bool ask_for_plan(struct explaining *explaining, struct failure *failure)
{
    char *body = json_dumps(explaining->request, JSON_COMPACT);
    bool is_ok;

    if (!body)
        return fail_no_memory(failure);
    is_ok = session_ask(&explaining->session,
                        &(struct http_request){.method = "POST",
                                               .path = explaining->path,
                                               .content_type = "application/json",
                                               .body = body,
                                               .sink = &explaining->output,
                                               .waiting = PROGRESS_STAGE_RENDER,
                                               .receiving = PROGRESS_STAGE_RECEIVE},
                        "the plan", &explaining->reply, failure);
    free(body);
    return is_ok;
}

static bool explain_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct explaining explaining = {.options = context, .source = operands->items[0]};
    const char *output = explaining.options->output;
    bool is_ok;

    explaining.request = request_json_build(&explaining.options->request, failure);
    is_ok = explaining.request && choose_form(&explaining, failure) &&
            scene_source_check_all(explaining.source, &explaining.options->file, explaining.request,
                                   failure) &&
            output_file_open(&explaining.output, output ? output : "-", failure) &&
            session_begin(&explaining.session, &explaining.options->common, failure) &&
            scene_source_bring(&explaining.session, explaining.source, &explaining.options->file,
                               explaining.request, &explaining.scene, failure) &&
            (explaining.options->request.base_path ||
             scene_defaults_ask(&explaining.session, explaining.scene.id, explaining.request,
                                failure)) &&
            ask_for_plan(&explaining, failure);
    progress_hide(&explaining.session.progress);
    is_ok = is_ok && output_file_commit(&explaining.output, failure);
    session_end(&explaining.session);
    output_file_finish(&explaining.output);
    http_reply_finish(&explaining.reply);
    json_decref(explaining.request);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "where the plan goes; .txt .json .dot .svg .glsl, - is stdout (text)",
     offsetof(struct explain_options, output)},
    {OPTION_FLAG, "shaders", 0, NULL,
     "the composed sources of the shader programs instead of the plan, also as -o FILE.glsl",
     offsetof(struct explain_options, shaders)},
    SCENE_FILE_OPTIONS(struct explain_options),
    REQUEST_OPTIONS(struct explain_options),
    {0},
};

const struct command COMMAND_EXPLAIN = {
    .name = "explain",
    .synopsis = "FILE|SCENE [-o OUT]",
    .summary = "Tell what a frame requires and the passes that follow, without drawing it",
    .details =
        REQUEST_HELP "Takes what vitrail render takes. With --json the plan on stdout is JSON.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct explain_options),
    .run = explain_run,
};
