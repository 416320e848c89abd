/* SPDX-License-Identifier: MIT */
/* vitrail verify: makes an image again by its note or by the provenance that it holds, and says
 * what is different. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/image_difference.h"
#include "clients/vitrail/image_note.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/picture_by_tiles.h"
#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/resource.h"

struct verify_options {
    struct common_options common;
    const char *output;
    bool show;
};

/* One image. Zeroed = nothing done. */
struct verify {
    const struct verify_options *options;
    struct session *session;
    const char *path;
    json_t *note, *request;
    char *place; /* of the new image */
    char version[64];
    char sha256[SCENE_ID_BYTES]; /* of the image */
    json_t *now;                 /* the note of the new image */
    bool is_same_file;
    struct image_difference difference;
};

static const char *text_of(const json_t *note, const char *key)
{
    const char *text = json_string_value(json_object_get(note, key));
    return text ? text : "";
}

/* ---- the new image ---- */

static bool read_note(struct verify *verify, struct failure *failure)
{
    if (!(verify->note = image_note_find(verify->path, failure)))
        return false;
    verify->request = json_loads(text_of(verify->note, "request"), 0, NULL);
    if (!json_is_object(verify->request))
        return fail(failure, EXIT_CODE_NO_INPUT, "the note of '%s' names no request", verify->path);
    if (!resource_hash(verify->session, verify->path, verify->sha256, failure))
        return false;
    const char *noted = text_of(verify->note, "sha256");
    return !noted[0] || !strcmp(verify->sha256, noted) ||
           fail(failure, EXIT_CODE_DIFFERENT,
                "'%s' was changed after it was rendered: its SHA-256 is %s, and %s in its note",
                verify->path, verify->sha256, noted);
}

/* The report of the frame; NULL: none. */
static json_t *report_of(struct verify *verify, const struct http_reply *reply)
{
    struct failure ignored = {0};
    char path[160];
    return http_reply_frame_path(reply, path, sizeof path)
               ? session_get_json(verify->session, path, "the report of the frame", &ignored)
               : NULL;
}

static bool render_whole(struct verify *verify, struct output_file *image, struct http_reply *reply,
                         struct failure *failure)
{
    char *body = json_dumps(verify->request, JSON_COMPACT);
    bool is_ok = (body || fail_no_memory(failure)) &&
                 render_watch_ask(verify->session,
                                  &(struct http_request){.method = "POST",
                                                         .path = "/v1/renders",
                                                         .accept = "*/*",
                                                         .content_type = "application/json",
                                                         .body = body,
                                                         .sink = image},
                                  "the render", reply, failure);
    free(body);
    return is_ok;
}

/* What the new image says of itself, or else what is known of its frame. */
static json_t *note_now(struct verify *verify, bool is_tiled, const struct http_reply *reply,
                        struct failure *failure)
{
    struct failure no_note = {0};
    char sha256[SCENE_ID_BYTES];
    if (!resource_hash(verify->session, verify->place, sha256, failure))
        return NULL;
    json_t *note = is_tiled ? image_note_find(verify->place, &no_note) : NULL;
    if (note) {
        json_object_set_new(note, "sha256", json_string(sha256));
        return note;
    }
    json_t *report = report_of(verify, reply);
    image_note_version(verify->session, verify->version, sizeof verify->version);
    note = image_note_make(sha256, verify->request, report, verify->version, failure);
    json_decref(report);
    return note;
}

static bool render_again(struct verify *verify, struct failure *failure)
{
    struct output_file image = {0};
    struct http_reply reply = {0};
    bool is_tiled = picture_is_by_tiles(verify->request);
    bool is_ok =
        output_file_open(&image, verify->place, failure) &&
        (is_tiled ? picture_make_by_tiles(verify->session, verify->request,
                                          json_object_get(verify->note, "tiles"), &image, failure)
                  : render_whole(verify, &image, &reply, failure)) &&
        output_file_commit(&image, failure);
    verify->now = is_ok ? note_now(verify, is_tiled, &reply, failure) : NULL;
    http_reply_finish(&reply);
    output_file_finish(&image);
    return verify->now;
}

/* ---- the verdict ---- */

/* Measures the pixels where the files differ. */
static bool compare(struct verify *verify, struct failure *failure)
{
    const char *outputs[LIMIT_OUTPUTS + 1] = {0};
    const json_t *output, *asked = json_object_get(verify->request, "outputs");
    size_t i;
    verify->is_same_file = !strcmp(verify->sha256, text_of(verify->now, "sha256"));
    if (verify->is_same_file)
        return true;
    json_array_foreach(asked, i, output) if (json_array_size(asked) > 1 && i < LIMIT_OUTPUTS)
        outputs[i] = json_string_value(output);
    return image_difference_measure(verify->place, verify->path, outputs, &verify->difference,
                                    failure);
}

/* What was chosen, or else what the request says. */
static json_t *technique_of(const struct verify *verify, const json_t *note)
{
    json_t *chosen = json_object_get(json_object_get(note, "chosen"), "shadows");
    return chosen ? chosen
                  : json_object_get(json_object_get(verify->request, "quality"), "shadows");
}

static void add_difference(json_t *found, const char *name, json_t *then, json_t *now)
{
    if (!json_equal(then, now))
        json_object_set_new(found, name,
                            json_pack("{s:O,s:O}", "then", then ? then : json_null(), "now",
                                      now ? now : json_null()));
}

/* What the notes say differently, by its names; besides the image. */
static json_t *differences(const struct verify *verify)
{
    static const char *const always[] = {"version", "device"};
    static const char *const where_told[] = {"techniques", "error"}; /* by both */
    json_t *found = json_object(), *then = verify->note, *now = verify->now;
    for (size_t i = 0; i < sizeof always / sizeof *always; i++)
        add_difference(found, always[i], json_object_get(then, always[i]),
                       json_object_get(now, always[i]));
    for (size_t i = 0; i < sizeof where_told / sizeof *where_told; i++) {
        json_t *told_then = json_object_get(then, where_told[i]);
        json_t *told_now = json_object_get(now, where_told[i]);
        if (told_then && !json_is_null(told_then) && told_now && !json_is_null(told_now))
            add_difference(found, where_told[i], told_then, told_now);
    }
    add_difference(found, "shadows", technique_of(verify, then), technique_of(verify, now));
    return found;
}

static void print_text(const json_t *value)
{
    char *text = json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(6));
    fputs(text ? text : "?", stdout);
    free(text);
}

static json_t *number(double value)
{
    json_t *real = json_real(value);
    return real ? real : json_null(); /* not finite */
}

static bool is_same(const struct verify *verify)
{
    return verify->is_same_file || verify->difference.share == 0;
}

static void print_json(const struct verify *verify, json_t *different)
{
    const struct image_difference *difference = &verify->difference;
    json_t *result = json_pack(
        "{s:s,s:b,s:b,s:s,s:s,s:{s:o,s:o,s:o},s:O}", "image", verify->path, "same", is_same(verify),
        "same_file", verify->is_same_file, "sha256", verify->sha256, "sha256_now",
        text_of(verify->now, "sha256"), "pixels", "differing_share", number(difference->share),
        "rmse", number(difference->rmse), "max", number(difference->max), "differences", different);
    json_print(result, true);
    json_decref(result);
}

static void print_verdict(const struct verify *verify, json_t *different)
{
    const struct image_difference *difference = &verify->difference;
    const char *key;
    json_t *value;
    printf("%s: ", verify->path);
    if (verify->is_same_file)
        puts("the same to the bit");
    else if (is_same(verify))
        puts("the same pixels, in another file");
    else
        printf("other pixels: %.3g %% of the values, RMSE %.3g, at most %.3g\n",
               100 * difference->share, difference->rmse, difference->max);
    json_object_foreach(different, key, value)
    {
        printf("  %s: ", key);
        print_text(json_object_get(value, "then"));
        fputs(" then, ", stdout);
        print_text(json_object_get(value, "now"));
        puts(" now");
    }
}

static bool give_verdict(const struct verify *verify, struct failure *failure)
{
    json_t *different = differences(verify);
    bool is_explained = json_object_size(different) > 0;
    progress_hide(&verify->session->progress);
    if (verify->options->common.json)
        print_json(verify, different);
    else if (!verify->options->common.quiet)
        print_verdict(verify, different);
    json_decref(different);
    return is_same(verify) ||
           fail(failure, EXIT_CODE_DIFFERENT, "the image made now has other pixels%s",
                is_explained ? "" : ", and nothing that is known of both is different");
}

static bool verify_image(struct verify *verify, struct failure *failure)
{
    const char *output = verify->options->output;
    if (!read_note(verify, failure))
        return false;
    if (asprintf(&verify->place, "%s%s", output ? output : verify->path, output ? "" : ".verify") <
        0) {
        verify->place = NULL;
        return fail_no_memory(failure);
    }
    bool is_ok =
        render_again(verify, failure) && compare(verify, failure) && give_verdict(verify, failure);
    if (!output)
        remove(verify->place);
    return is_ok;
}

/* What is known of the image, without a server. */
static bool show(struct verify *verify, struct failure *failure)
{
    verify->note = image_note_find(verify->path, failure);
    json_t *request = json_loads(text_of(verify->note, "request"), 0, NULL);
    if (request)
        json_object_set_new(verify->note, "request", request);
    if (verify->note)
        json_print(verify->note, verify->options->common.json);
    return verify->note;
}

static bool verify_on_server(struct verify *verify, struct failure *failure)
{
    struct session session = {0};
    verify->session = &session;
    bool is_ok =
        session_begin(&session, &verify->options->common, failure) && verify_image(verify, failure);
    session_end(&session);
    return is_ok;
}

static bool verify_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct verify verify = {.options = context, .path = operands->items[0]};
    bool is_ok = verify.options->show ? show(&verify, failure) : verify_on_server(&verify, failure);
    json_decref(verify.note);
    json_decref(verify.request);
    json_decref(verify.now);
    free(verify.place);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE", "keep the image that is made now",
     offsetof(struct verify_options, output)},
    {OPTION_FLAG, "show", 0, NULL, "print what is known of the image, and make nothing",
     offsetof(struct verify_options, show)},
    {0},
};

const struct command COMMAND_VERIFY = {
    .name = "verify",
    .synopsis = "IMAGE",
    .summary = "Make an image again by what it says of itself, and say what is different",
    .details = "Images of renders and jobs hold how they were made: the scene, the request,\n"
               "version, device, what was chosen and the stated error. A note beside the image,\n"
               "IMAGE.json, which 'vitrail render --note' and --skip-existing write, goes first.\n"
               "The server must have the scene. Exit code 3: the image was changed since, or\n"
               "has other pixels now.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct verify_options),
    .run = verify_run,
};
