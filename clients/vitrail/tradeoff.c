/* SPDX-License-Identifier: MIT */
/* vitrail tradeoff: measures time against error of one view, and brings the results home. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/scene_defaults.h"
#include "clients/vitrail/scene_source.h"
#include "protocol/quality_defaults.h"
#include "protocol/tradeoff.h"

enum { POLL_MS = 250, LAST_POLLS = 40 /* after a cancel: the server ends at once */ };

struct measuring_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    const char *output;
    struct option_number time_budget_s, repeats, max_settings, reference_samples;
    bool no_images;
};

/* One run of the command. Zeroed = nothing done. */
struct measuring {
    struct measuring_options *options;
    const char *source; /* file or id, as given */
    const char *accept; /* media type of the output */
    json_t *request;
    struct session session;
    struct output_file output;
    struct scene_push scene;
    char path[600];   /* of the trade-off on the server; "" until it is there */
    json_t *document; /* as last seen */
};

static const struct {
    const char *extension, *media_type;
} FORMATS[] = {
    {".json", "application/json"},
    {".csv", "text/csv"},
    {".svg", "image/svg+xml"},
    {".html", "text/html"},
};

enum { FORMAT_COUNT = sizeof FORMATS / sizeof *FORMATS };

/* ---- before a server is asked ---- */

static bool choose_format(struct measuring *measuring, struct failure *failure)
{
    const char *output = measuring->options->output;
    const char *dot = output ? strrchr(output, '.') : NULL;

    measuring->accept = "application/json";
    if (!output || !strcmp(output, "-"))
        return true;
    for (int i = 0; dot && i < FORMAT_COUNT; i++)
        if (!strcasecmp(dot, FORMATS[i].extension)) {
            measuring->accept = FORMATS[i].media_type;
            return true;
        }
    return fail(failure, EXIT_CODE_USAGE,
                "cannot tell the format of '%s': use .json, .csv, .svg or .html", output);
}

static bool put_whole(json_t *object, const char *name, const struct option_number *number,
                      struct failure *failure)
{
    if (!number->is_given)
        return true;
    if (number->value != floor(number->value) || fabs(number->value) > 1e9)
        return fail(failure, EXIT_CODE_USAGE, "%s: %g is not a whole number", name, number->value);
    return json_object_set_new(object, name, json_integer((json_int_t)number->value)) == 0 ||
           fail_no_memory(failure);
}

static bool put_options(struct measuring *measuring, struct failure *failure)
{
    const struct measuring_options *options = measuring->options;
    json_t *object = json_object();

    if (json_object_set_new(measuring->request, "tradeoff", object) != 0)
        return fail_no_memory(failure);
    if (options->no_images && json_object_set_new(object, "keep_images", json_false()) != 0)
        return fail_no_memory(failure);
    return put_whole(object, "time_budget_s", &options->time_budget_s, failure) &&
           put_whole(object, "repeats", &options->repeats, failure) &&
           put_whole(object, "max_settings", &options->max_settings, failure) &&
           put_whole(object, "reference_samples", &options->reference_samples, failure);
}

static bool prepare(struct measuring *measuring, struct failure *failure)
{
    if (!choose_format(measuring, failure))
        return false;
    measuring->request = request_json_build(&measuring->options->request, failure);
    if (!measuring->request || !put_options(measuring, failure))
        return false;
    if (!scene_source_check_all(measuring->source, &measuring->options->file, measuring->request,
                                failure))
        return false;
    return !measuring->options->output ||
           output_file_open(&measuring->output, measuring->options->output, failure);
}

/* ---- the measurement ---- */

static bool bring_scene(struct measuring *measuring, bool force, struct failure *failure)
{
    struct file_options options = measuring->options->file;
    options.force = force;
    return scene_source_bring(&measuring->session, measuring->source, &options, measuring->request,
                              &measuring->scene, failure) &&
           (measuring->options->request.base_path ||
            scene_defaults_ask(&measuring->session, measuring->scene.id, measuring->request,
                               failure));
}

static bool begin(struct measuring *measuring, struct failure *failure)
{
    struct http_reply reply;
    char *body = json_dumps(measuring->request, JSON_COMPACT);
    bool is_ok = body || fail_no_memory(failure);

    is_ok = is_ok && session_ask(&measuring->session,
                                 &(struct http_request){.method = "POST",
                                                        .path = "/v1/tradeoffs",
                                                        .content_type = "application/json",
                                                        .body = body},
                                 "the trade-off", &reply, failure);
    free(body);
    if (!is_ok)
        return false;
    const char *path = strstr(reply.location, "/v1/tradeoffs/");
    if (path)
        snprintf(measuring->path, sizeof measuring->path, "%s", path);
    http_reply_finish(&reply);
    return path ||
           fail(failure, EXIT_CODE_UNAVAILABLE, "the server did not say where the trade-off is");
}

/* The server may have dropped the scene since it said that it has it: then it is sent, once. */
static bool bring_and_begin(struct measuring *measuring, struct failure *failure)
{
    struct failure first = {0};

    if (!bring_scene(measuring, false, failure))
        return false;
    if (begin(measuring, &first))
        return true;
    if (first.http_status != 404 || measuring->scene.was_sent ||
        scene_source_is_on_server(measuring->source)) {
        *failure = first;
        return false;
    }
    return bring_scene(measuring, true, failure) && begin(measuring, failure);
}

static const char *state_of(const struct measuring *measuring)
{
    const char *state = json_string_value(json_object_get(measuring->document, "state"));

    return state ? state : "";
}

static bool has_ended(const struct measuring *measuring)
{
    const char *state = state_of(measuring);

    return strcmp(state, "queued") != 0 && strcmp(state, "running") != 0;
}

static bool look(struct measuring *measuring, struct failure *failure)
{
    json_t *document =
        session_get_json(&measuring->session, measuring->path, "the trade-off", failure);

    if (!document)
        return false;
    json_decref(measuring->document);
    measuring->document = document;
    double share = json_number_value(json_object_get(document, "progress"));
    progress_show(&measuring->session.progress, PROGRESS_STAGE_MEASURE,
                  (uint64_t)(1000 * fmin(fmax(share, 0), 1)), 1000);
    return true;
}

static bool wait_for_end(struct measuring *measuring, struct failure *failure)
{
    do {
        if (!look(measuring, failure))
            return false;
        if (has_ended(measuring))
            return true;
    } while (interrupt_sleep(&measuring->session.interrupt, POLL_MS, failure));
    return false;
}

/* After Ctrl-C: tells the server and takes what there is. A second Ctrl-C ends this, too. */
static void cancel(struct measuring *measuring)
{
    struct failure ignored = {0};
    struct http_reply reply;

    measuring->session.interrupt.signal = 0;
    if (!measuring->path[0] ||
        !session_ask(&measuring->session,
                     &(struct http_request){.method = "DELETE", .path = measuring->path},
                     "cancelling the trade-off", &reply, &ignored))
        return;
    http_reply_finish(&reply);
    for (int i = 0; i < LAST_POLLS && look(measuring, &ignored) && !has_ended(measuring); i++)
        if (!interrupt_sleep(&measuring->session.interrupt, POLL_MS, &ignored))
            return;
}

/* ---- the results ---- */

static bool fetch(struct measuring *measuring, struct failure *failure)
{
    struct http_reply reply;

    if (!measuring->options->output)
        return true;
    if (!session_ask(&measuring->session,
                     &(struct http_request){.method = "GET",
                                            .path = measuring->path,
                                            .accept = measuring->accept,
                                            .sink = &measuring->output},
                     "the results", &reply, failure))
        return false;
    http_reply_finish(&reply);
    return output_file_commit(&measuring->output, failure);
}

static double median_ms(const json_t *setting, const char *name)
{
    return json_number_value(json_object_get(json_object_get(setting, name), "median"));
}

static void print_setting(const json_t *row)
{
    char name[160], extras[TRADEOFF_EXTRAS_BYTES], media[TRADEOFF_MEDIA_BYTES];
    const struct quality_setting setting = tradeoff_setting_from_json(row);
    const char *shadows = json_string_value(json_object_get(row, "shadows"));

    tradeoff_extras_label(&setting, extras);
    tradeoff_media_label(&setting, media);
    snprintf(name, sizeof name, "%.32s%s%s", shadows ? shadows : "?", extras, media);
    printf("%-28s x%-4d %10.1f %10.1f %12.6f\n", name, setting.samples, median_ms(row, "warm_ms"),
           median_ms(row, "cold_ms"),
           json_number_value(json_object_get(json_object_get(row, "error"), "rmse")));
}

/* The settings on the front, which are the ones to choose from. */
static void print_front(const struct measuring *measuring)
{
    const json_t *setting;
    size_t index;
    char device[256];
    const char *name = json_string_value(json_object_get(measuring->document, "device"));

    text_copy_printable(device, sizeof device, name ? name : "no device");
    printf(
        "trade-off %s, %s%s: %s\n", measuring->path + strlen("/v1/tradeoffs/"), state_of(measuring),
        json_is_true(json_object_get(measuring->document, "partial")) ? ", partial" : "", device);
    printf("%-28s %-5s %10s %10s %12s\n", "on the front", "", "warm ms", "cold ms", "RMSE");
    json_array_foreach(json_object_get(measuring->document, "settings"), index, setting)
    {
        if (json_is_true(json_object_get(setting, "on_front")))
            print_setting(setting);
    }
}

static void print_result(struct measuring *measuring)
{
    const struct measuring_options *options = measuring->options;

    progress_hide(&measuring->session.progress);
    if (!measuring->document || (options->output && !strcmp(options->output, "-")))
        return;
    if (options->common.json)
        json_print(measuring->document, true);
    else if (!options->common.quiet)
        print_front(measuring);
}

static bool check_end(const struct measuring *measuring, struct failure *failure)
{
    const json_t *problem = json_object_get(measuring->document, "problem");
    const char *detail = json_string_value(json_object_get(problem, "detail"));
    const char *code = json_string_value(json_object_get(problem, "code"));
    bool is_temporary = code && !strcmp(code, "interrupted");
    char text[FAILURE_MESSAGE_BYTES / 2];

    if (!strcmp(state_of(measuring), "done"))
        return true;
    if (!strcmp(state_of(measuring), "cancelled"))
        return fail(failure, EXIT_CODE_TEMPORARY,
                    "the trade-off was cancelled; results so far are "
                    "kept");
    text_copy_printable(text, sizeof text, detail ? detail : "no reason is known");
    return fail(failure, is_temporary ? EXIT_CODE_TEMPORARY : EXIT_CODE_REFUSED,
                "the trade-off failed: %s", text);
}

static bool tradeoff_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct measuring measuring = {.options = context, .source = operands->items[0]};
    struct failure late = {0};
    bool is_ok = prepare(&measuring, failure) &&
                 session_begin(&measuring.session, &measuring.options->common, failure) &&
                 bring_and_begin(&measuring, failure) && wait_for_end(&measuring, failure);

    if (!is_ok && failure->exit_code >= EXIT_CODE_SIGNAL_BASE && measuring.path[0])
        cancel(&measuring);
    if (measuring.document && has_ended(&measuring)) {
        bool is_fetched = fetch(&measuring, is_ok ? failure : &late);
        print_result(&measuring);
        is_ok = is_ok && is_fetched && check_end(&measuring, failure);
    }
    session_end(&measuring.session);
    output_file_finish(&measuring.output);
    json_decref(measuring.document);
    json_decref(measuring.request);
    return is_ok;
}

#define AT(member) offsetof(struct measuring_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "where the results go; .json .csv .svg .html, - is stdout (json)", AT(output)},
    {OPTION_NUMBER, "time-budget", 0, "S", "1 to 3600; default 480: what does not fit is left out",
     AT(time_budget_s)},
    {OPTION_NUMBER, "repeats", 0, "N", "timed runs of each setting; default 3", AT(repeats)},
    {OPTION_NUMBER, "max-settings", 0, "N", "the most telling ones first; default 32",
     AT(max_settings)},
    {OPTION_NUMBER, "reference-samples", 0, "N", "per pixel: 16, 64, 256; default 16",
     AT(reference_samples)},
    {OPTION_FLAG, "no-images", 0, NULL, "keep no picture of each setting for the page",
     AT(no_images)},
    SCENE_FILE_OPTIONS(struct measuring_options),
    {OPTION_TEXT, "size", 0, "WxH", "in pixels; default 1280x720", AT(request.size)},
    {OPTION_TEXT, "camera", 0, "SPEC", "as of vitrail render", AT(request.camera)},
    {OPTION_LIST, "light", 0, "SPEC", "one more light, as of vitrail render", AT(request.lights)},
    {OPTION_FLAG, "no-scene-lights", 0, NULL, "leave the lights of the scene out",
     AT(request.no_scene_lights)},
    {OPTION_LIST, "clip", 0, "SPEC", "one more clip plane, as of vitrail render",
     AT(request.clips)},
    {OPTION_LIST, "part", 0, "SPEC", "one more part, as of vitrail render", AT(request.parts)},
    REQUEST_ENVIRONMENT_OPTIONS(struct measuring_options),
    REQUEST_HAZE_OPTIONS(struct measuring_options),
    {OPTION_TEXT, "background", 0, "R,G,B,A", "linear; default transparent",
     AT(request.background)},
    {OPTION_NUMBER, "time", 0, "S", "animate, as of vitrail render", AT(request.time_s)},
    {OPTION_TEXT, "animation", 0, "NAME", "animate, as of vitrail render", AT(request.animation)},
    {OPTION_TEXT, "variant", 0, "NAME", "of materials, as of vitrail render", AT(request.variant)},
    {OPTION_TEXT, "exposure", 0, "EV", "in stops, or auto", AT(request.exposure)},
    {OPTION_TEXT, "shadows", 0, "NAME", "measure this technique alone", AT(request.shadows)},
    {OPTION_NUMBER, "shadow-resolution", 0, "N", "measure this resolution alone",
     AT(request.shadow_resolution)},
    {OPTION_NUMBER, "shadow-compression", 0, "E", "deep lists with this error alone",
     AT(request.shadow_compression)},
    {OPTION_NUMBER, "shadow-prefilter", 0, "K", "deep lists of K x K rays alone",
     AT(request.shadow_prefilter)},
    {OPTION_NUMBER, "samples", 0, "N", "measure these samples per pixel alone",
     AT(request.samples)},
    {OPTION_NUMBER, "area-samples", 0, "N",
     "per area light and point; default " QUALITY_DEFAULT_TEXT(AREA_SAMPLES_DEFAULT),
     AT(request.area_samples)},
    {OPTION_TEXT, "blend-filter", 0, "NAME", "tint, coverage, kim, modisett",
     AT(request.blend_filter)},
    {OPTION_TEXT, "refraction", 0, "NAME", "auto, off", AT(request.refraction)},
    {OPTION_TEXT, "request", 0, "FILE", "a whole request as JSON; the options go over it",
     AT(request.base_path)},
    {OPTION_LIST, "set", 0, "POINTER=JSON", "any member, such as /tradeoff/repeats=5",
     AT(request.settings)},
    {0},
};

const struct command COMMAND_TRADEOFF = {
    .name = "tradeoff",
    .synopsis = "FILE|SCENE [-o OUT]",
    .summary = "Measure time against error of a view over many settings",
    .details =
        "Prints the settings that nothing beats in both; -o takes all of them, as numbers, as a\n"
        "plot, or as a page with pictures. The server keeps the results with the scene, and\n"
        "vitrail render --max-error and --budget-ms choose from them.\n"
        "Ctrl-C cancels: what is measured so far is kept and written.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct measuring_options),
    .run = tradeoff_run,
};
