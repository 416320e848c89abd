/* SPDX-License-Identifier: MIT */
/* vitrail render: one scene, one request, one image file. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/scene_defaults.h"
#include "clients/vitrail/scene_source.h"
#include "clients/vitrail/warnings.h"

struct render_options {
    struct common_options common;
    struct request_options request;
    struct scene_wish file;
    const char *output, *stats;
    bool strict;
};

/* One run of the command. Zeroed = nothing done. */
struct render {
    struct render_options *options;
    const char *source; /* file or id, as given */
    const char *accept; /* media type of the image */
    json_t *request;
    struct session session;
    struct output_file image, stats;
    struct scene_push scene;
    struct http_reply reply; /* of the image; its body is in `image` */
    json_t *frame;           /* the frame's report; NULL when the server keeps none */
    json_t *description;     /* of the scene; NULL: unknown */
    double started_s;
};

static const struct {
    const char *extension, *format, *media_type;
} FORMATS[] = {
    {".png", "png", "image/png"},    {".jpg", "jpeg", "image/jpeg"},
    {".jpeg", "jpeg", "image/jpeg"}, {".webp", "webp", "image/webp"},
    {".exr", "exr", "image/x-exr"},
};

enum { FORMAT_COUNT = sizeof FORMATS / sizeof *FORMATS };

/* --format, else the extension of the output, else what the base request says. */
static bool choose_format(struct render *render, struct failure *failure)
{
    const char *output = render->options->output;
    const char *dot = strrchr(output, '.');
    const char *slash = strrchr(output, '/');
    const char *format = render->options->request.format;

    if (!format && dot && (!slash || dot > slash))
        for (int i = 0; i < FORMAT_COUNT; i++)
            if (!strcasecmp(dot, FORMATS[i].extension))
                format = FORMATS[i].format;
    if (!format)
        format = json_string_value(json_object_get(render->request, "format"));
    for (int i = 0; format && i < FORMAT_COUNT; i++)
        if (!strcmp(format, FORMATS[i].format)) {
            render->accept = FORMATS[i].media_type;
            return json_object_set_new(render->request, "format", json_string(format)) == 0 ||
                   fail_no_memory(failure);
        }
    if (format)
        return fail(failure, EXIT_CODE_USAGE, "--format: '%s' is none of png, jpeg, webp, exr",
                    format);
    return fail(failure, EXIT_CODE_USAGE,
                "cannot tell the format of '%s': use .png, .jpg, .webp, "
                ".exr, or --format",
                output);
}

/* Everything that can be known to be wrong before a server is asked or started. */
static bool prepare(struct render *render, struct failure *failure)
{
    const struct render_options *options = render->options;

    if (!options->output && options->request.outputs.count)
        return fail(failure, EXIT_CODE_USAGE,
                    "--output says what is drawn, such as color or depth; where the image goes is "
                    "-o FILE.png");
    if (!options->output)
        return fail(failure, EXIT_CODE_USAGE, "render needs an output: -o FILE.png");
    if (options->stats && !strcmp(options->stats, "-") && !strcmp(options->output, "-"))
        return fail(failure, EXIT_CODE_USAGE, "image and stats cannot both go to stdout");
    render->request = request_json_build(&options->request, failure);
    if (!render->request || !choose_format(render, failure))
        return false;
    if (!scene_source_check_all(render->source, &render->options->file, render->request, failure))
        return false;
    return output_file_open(&render->image, options->output, failure) &&
           (!options->stats || output_file_open(&render->stats, options->stats, failure));
}

static bool describe_scene(struct render *render, struct failure *failure)
{
    json_decref(render->description);
    render->description = scene_describe(&render->session, render->scene.id, failure);
    return !failure->exit_code &&
           (render->options->request.base_path ||
            scene_defaults_put(render->description, render->request, failure));
}

static bool bring_scene(struct render *render, bool force, struct failure *failure)
{
    struct scene_wish wish = render->options->file;
    wish.force = force;
    return scene_source_bring(&render->session, render->source, &wish, render->request,
                              &render->scene, failure) &&
           describe_scene(render, failure);
}

static bool ask_for_image(struct render *render, struct failure *failure)
{
    char *body = json_dumps(render->request, JSON_COMPACT);
    bool is_ok;

    if (!body)
        return fail_no_memory(failure);
    is_ok = render_watch_ask(&render->session,
                             &(struct http_request){.method = "POST",
                                                    .path = "/v1/renders",
                                                    .accept = render->accept,
                                                    .content_type = "application/json",
                                                    .body = body,
                                                    .sink = &render->image},
                             "the render", &render->reply, failure);
    free(body);
    return is_ok;
}

/* The server may have dropped the scene since it said that it has it: then it is sent, once. */
static bool render_image(struct render *render, struct failure *failure)
{
    struct failure first = {0};

    if (!bring_scene(render, false, failure))
        return false;
    if (ask_for_image(render, &first))
        return true;
    if (first.http_status != 404 || render->scene.was_sent ||
        scene_source_is_on_server(render->source)) {
        *failure = first;
        return false;
    }
    return bring_scene(render, true, failure) && ask_for_image(render, failure);
}

static bool check_image(const struct render *render, struct failure *failure)
{
    if (render->image.size_bytes > 0 && !strncmp(render->reply.content_type, "image/", 6))
        return true;
    return fail(failure, EXIT_CODE_UNAVAILABLE,
                "the render was answered with %llu bytes of '%s', which is no image; is this a "
                "vitrail server?",
                (unsigned long long)render->image.size_bytes, render->reply.content_type);
}

/* The path that the Link header gives to the frame's report, in `path`; false when there is none.
 */
static bool frame_path(const struct render *render, char *path, size_t capacity)
{
    const char *from = strstr(render->reply.link, "</v1/frames/");
    size_t n = from ? strcspn(from, ">") : 0;

    if (!from || from[n] != '>' || n >= capacity)
        return false;
    memcpy(path, from + 1, n - 1);
    path[n - 1] = '\0';
    return true;
}

/* The report carries the warnings, so it is always asked for; it is only vital with --stats. */
static bool fetch_frame(struct render *render, struct failure *failure)
{
    struct failure ignored = {0};
    char path[160];

    if (frame_path(render, path, sizeof path))
        render->frame = session_get_json(&render->session, path, "the report of the frame",
                                         render->options->stats ? failure : &ignored);
    else if (render->options->stats)
        fail(failure, EXIT_CODE_UNAVAILABLE, "the server did not say where the frame's report is");
    if (ignored.exit_code >= EXIT_CODE_SIGNAL_BASE)
        *failure = ignored;
    return !failure->exit_code;
}

static bool commit(struct render *render, struct failure *failure)
{
    if (render->options->stats && !json_write(render->frame, &render->stats, failure))
        return false;
    return output_file_commit(&render->image, failure) &&
           (!render->options->stats || output_file_commit(&render->stats, failure));
}

static json_t *scene_warnings(const struct render *render) /* borrowed; NULL: unknown */
{
    return json_object_get(render->description, "warnings");
}

static bool check_warnings(struct render *render, struct failure *failure)
{
    return !render->options->strict ||
           warnings_refuse(scene_warnings(render), json_object_get(render->frame, "warnings"),
                           failure);
}

/* What the server chose by --max-error or --budget-ms. */
static void print_chosen(const struct render *render)
{
    const json_t *chosen = json_object_get(render->frame, "chosen");
    const char *shadows = json_string_value(json_object_get(chosen, "shadows"));
    const char *because = json_string_value(json_object_get(chosen, "because"));
    const json_t *resolution = json_object_get(chosen, "shadow_resolution");
    char text[FAILURE_MESSAGE_BYTES], map[48] = "";

    if (!shadows || !because)
        return;
    text_copy_printable(text, sizeof text, because);
    if (json_is_integer(resolution))
        snprintf(map, sizeof map, " %d, %d taps", (int)json_integer_value(resolution),
                 (int)json_integer_value(json_object_get(chosen, "shadow_taps")));
    printf("chosen: %.32s%s, %d samples per pixel: %s\n", shadows, map,
           (int)json_integer_value(json_object_get(chosen, "samples")), text);
}

static void print_result_json(const struct render *render, double elapsed_s)
{
    json_t *result = json_pack("{s:s, s:s, s:b, s:s, s:I, s:f}", "output", render->options->output,
                               "scene", render->scene.id, "sent", render->scene.was_sent,
                               "content_type", render->reply.content_type, "size_bytes",
                               (json_int_t)render->image.size_bytes, "elapsed_s", elapsed_s);
    static const char *const FROM_FRAME[] = {"id", "timings_ms", "chosen", "error", "warnings"};
    static const char *const AS[] = {"frame", "timings_ms", "chosen", "error", "warnings"};

    for (size_t i = 0; result && i < sizeof AS / sizeof *AS; i++) {
        json_t *value = json_object_get(render->frame, FROM_FRAME[i]);
        if (value)
            json_object_set(result, AS[i], value);
    }
    if (result && scene_warnings(render))
        json_object_set(result, "scene_warnings", scene_warnings(render));
    json_print(result, true);
    json_decref(result);
}

/* On stdout unless image or stats are there already. */
static void print_result(struct render *render)
{
    const struct render_options *options = render->options;
    double elapsed_s = clock_s() - render->started_s;

    progress_show(&render->session.progress, PROGRESS_STAGE_DONE, 0, 0);
    progress_hide(&render->session.progress);
    if (!options->common.quiet && !options->common.json) {
        warnings_print(scene_warnings(render), "the scene");
        warnings_print(json_object_get(render->frame, "warnings"), NULL);
    }
    if (!strcmp(options->output, "-") || (options->stats && !strcmp(options->stats, "-")))
        return;
    if (options->common.json) {
        print_result_json(render, elapsed_s);
    } else if (!options->common.quiet) {
        print_chosen(render);
        printf("%s: %.1f KiB in %.2f s, scene %s%s\n", options->output,
               (double)render->image.size_bytes / 1024., elapsed_s, render->scene.id,
               render->scene.was_sent ? "" : " (not sent again)");
    }
}

static bool render_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct render render = {
        .options = context, .source = operands->items[0], .started_s = clock_s()};
    bool is_ok = prepare(&render, failure) &&
                 session_begin(&render.session, &render.options->common, failure) &&
                 render_image(&render, failure) && check_image(&render, failure) &&
                 fetch_frame(&render, failure) && check_warnings(&render, failure) &&
                 commit(&render, failure);

    if (is_ok)
        print_result(&render);
    session_end(&render.session);
    output_file_finish(&render.image);
    output_file_finish(&render.stats);
    http_reply_finish(&render.reply);
    json_decref(render.frame);
    json_decref(render.description);
    json_decref(render.request);
    return is_ok;
}

#define AT(member) offsetof(struct render_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "where the image goes; .png .jpg .webp .exr, - is stdout", AT(output)},
    {OPTION_TEXT, "format", 0, "NAME", "png, jpeg, webp or exr, whatever FILE is called",
     AT(request.format)},
    SCENE_FILE_OPTIONS(struct render_options),
    REQUEST_OPTIONS(struct render_options),
    {OPTION_TEXT, "stats", 0, "FILE", "what the frame cost and why, as JSON; - is stdout",
     AT(stats)},
    {OPTION_FLAG, "strict", 0, NULL,
     "a warning of scene or frame is a failure: no image is written", AT(strict)},
    {0},
};

const struct command COMMAND_RENDER = {
    .name = "render",
    .synopsis = "FILE|SCENE -o OUT",
    .summary = "Render a scene file, or a scene that the server has, to an image file",
    .details = REQUEST_HELP "The image appears whole or not at all.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct render_options),
    .run = render_run,
};
