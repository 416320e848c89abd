/* SPDX-License-Identifier: MIT */
/* vitrail render: one scene, one request, one image file, or one of each frame of a list. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/frame_run.h"
#include "clients/vitrail/image_note.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/numbered_path.h"
#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/scene_defaults.h"
#include "clients/vitrail/scene_source.h"
#include "clients/vitrail/warnings.h"
#include "protocol/tradeoff.h"

struct render_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    struct frame_options frame;
    const char *output, *stats;
    bool strict, note;
};

/* One run of the command. Zeroed = nothing done. */
struct render {
    struct render_options *options;
    const char *source; /* file or id, as given */
    const char *accept; /* media type of the image */
    json_t *request;
    struct frame_run run;
    struct session session;
    struct scene_push scene;
    json_t *description; /* of the scene; NULL: unknown */
    double started_s;
    bool has_scene, has_warned;
    char version[64];   /* of the server, for notes */
    const char *output; /* where the image goes */
    struct output_file image, stats;
    struct http_reply reply; /* of the image; its body is in `image` */
    json_t *frame;           /* the frame's report; NULL when the server keeps none */
};

static const struct {
    const char *extension, *format, *media_type;
} FORMATS[] = {
    {".png", "png", "image/png"},        {".jpg", "jpeg", "image/jpeg"},
    {".jpeg", "jpeg", "image/jpeg"},     {".webp", "webp", "image/webp"},
    {".exr", "exr-deep", "image/x-exr"}, {".exr", "exr", "image/x-exr"}, /* the usual one last */
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
        return fail(failure, EXIT_CODE_USAGE,
                    "--format: '%s' is none of png, jpeg, webp, exr, exr-deep", format);
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
    if (options->note && !strcmp(options->output, "-"))
        return fail(failure, EXIT_CODE_USAGE, "--note needs a FILE to write beside");
    render->request = request_json_build(&options->request, failure);
    if (!render->request || !choose_format(render, failure))
        return false;
    if (!frame_run_init(&render->run, &options->frame, options->output, failure) ||
        !scene_source_check_all(render->source, &render->options->file, render->request, failure))
        return false;
    if (options->frame.frames && options->stats)
        return fail(failure, EXIT_CODE_USAGE,
                    "--stats is of one image: it does not go with --frames");
    return options->frame.frames ||
           (output_file_open(&render->image, options->output, failure) &&
            (!options->stats || output_file_open(&render->stats, options->stats, failure)));
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
    struct file_options options = render->options->file;
    options.force = force;
    return scene_source_bring(&render->session, render->source, &options, render->request,
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

    if (!render->has_scene && !bring_scene(render, false, failure))
        return false;
    render->has_scene = true;
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

/* The report carries the warnings, so it is always asked for; it is only vital with --stats. */
static bool fetch_frame(struct render *render, struct failure *failure)
{
    struct failure ignored = {0};
    char path[160];

    if (http_reply_frame_path(&render->reply, path, sizeof path))
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
    const struct quality_setting setting = tradeoff_setting_from_json(chosen);
    char text[FAILURE_MESSAGE_BYTES], extras[TRADEOFF_EXTRAS_BYTES];
    char media[TRADEOFF_MEDIA_BYTES];

    if (!shadows || !because)
        return;
    text_copy_printable(text, sizeof text, because);
    tradeoff_extras_label(&setting, extras);
    tradeoff_media_label(&setting, media);
    printf("chosen: %.32s%s, %d sample%s per pixel%s: %s\n", shadows, extras, setting.samples,
           setting.samples == 1 ? "" : "s", media, text);
}

static void print_result_json(const struct render *render, double elapsed_s)
{
    json_t *result = json_pack("{s:s, s:s, s:b, s:s, s:I, s:f}", "output", render->output, "scene",
                               render->scene.id, "sent", render->scene.was_sent, "content_type",
                               render->reply.content_type, "size_bytes",
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
    if (!options->common.quiet && !options->common.json && !render->has_warned) {
        warnings_print(scene_warnings(render), "the scene");
        warnings_print(json_object_get(render->frame, "warnings"), NULL);
    }
    render->has_warned = true; /* frames of a list have the same */
    if (!strcmp(options->output, "-") || (options->stats && !strcmp(options->stats, "-")))
        return;
    if (options->common.json) {
        print_result_json(render, elapsed_s);
    } else if (!options->common.quiet) {
        print_chosen(render);
        printf("%s: %.1f KiB in %.2f s, scene %s%s\n", render->output,
               (double)render->image.size_bytes / 1024., elapsed_s, render->scene.id,
               render->scene.was_sent ? "" : " (not sent again)");
    }
}

/* The note beside the image, where one is wanted. */
static bool write_note(struct render *render, struct failure *failure)
{
    if (!render->options->note && !render->options->frame.skip_existing)
        return true;
    if (!render->version[0])
        image_note_version(&render->session, render->version, sizeof render->version);
    return image_note_write(&render->session, render->output, render->request, render->frame,
                            render->version, failure);
}

/* One image, from the question to its place. */
static bool make_image(struct render *render, struct failure *failure)
{
    return render_image(render, failure) && check_image(render, failure) &&
           fetch_frame(render, failure) && check_warnings(render, failure) &&
           commit(render, failure) && write_note(render, failure);
}

static void forget_image(struct render *render)
{
    output_file_finish(&render->image);
    output_file_finish(&render->stats);
    http_reply_finish(&render->reply);
    json_decref(render->frame);
    render->frame = NULL;
}

static bool make_frame(struct render *render, size_t index, struct failure *failure)
{
    const struct frame_options *options = &render->options->frame;
    struct session *session = &render->session;
    char *path = numbered_path_make(render->options->output, render->run.list.numbers[index]);
    bool is_ok = path || fail_no_memory(failure);
    render->output = path;
    render->started_s = clock_s();
    if (session->progress.kind == PROGRESS_AFANASY)
        fprintf(stderr, "FRAME: %d\n", render->run.list.numbers[index]);
    is_ok = is_ok && frame_run_put_frame(&render->run, index, render->request, failure);
    if (is_ok && options->skip_existing && image_note_matches(session, path, render->request)) {
        if (!render->options->common.quiet && !render->options->common.json)
            printf("%s: is there\n", path);
    } else if (is_ok) {
        is_ok = output_file_open(&render->image, path, failure) && make_image(render, failure);
        if (is_ok)
            print_result(render);
        forget_image(render);
    }
    fflush(stdout);
    progress_begin_again(&session->progress);
    free(path);
    return is_ok;
}

/* The frames of this call, in order; the first that fails ends it. */
static bool make_frames(struct render *render, struct failure *failure)
{
    bool is_ok = bring_scene(render, false, failure);
    render->has_scene = true;
    if (is_ok)
        frame_run_note(&render->run, render->request, render->description);
    for (size_t i = render->run.first; is_ok && i < render->run.end; i++)
        is_ok =
            make_frame(render, i, failure) && interrupt_check(&render->session.interrupt, failure);
    return is_ok;
}

static bool render_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct render render = {
        .options = context, .source = operands->items[0], .started_s = clock_s()};
    bool is_ok = prepare(&render, failure) &&
                 session_begin(&render.session, &render.options->common, failure);

    if (is_ok && render.options->frame.frames) {
        is_ok = make_frames(&render, failure);
    } else if (is_ok) {
        render.output = render.options->output;
        is_ok = make_image(&render, failure);
        if (is_ok)
            print_result(&render);
    }
    session_end(&render.session);
    forget_image(&render);
    frame_run_finish(&render.run);
    json_decref(render.description);
    json_decref(render.request);
    return is_ok;
}

#define AT(member) offsetof(struct render_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "where the image goes; .png .jpg .webp .exr, - is stdout", AT(output)},
    {OPTION_TEXT, "format", 0, "NAME", "png, jpeg, webp, exr or exr-deep, whatever FILE is called",
     AT(request.format)},
    FRAME_OPTIONS(struct render_options),
    SCENE_FILE_OPTIONS(struct render_options),
    REQUEST_OPTIONS(struct render_options),
    {OPTION_TEXT, "stats", 0, "FILE", "what the frame cost and why, as JSON; - is stdout",
     AT(stats)},
    {OPTION_FLAG, "note", 0, NULL,
     "write FILE.json beside the image, by which 'vitrail verify'\nmakes it again", AT(note)},
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
