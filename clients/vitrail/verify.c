/* SPDX-License-Identifier: MIT */
/* vitrail verify: makes an image again by its note, and says what is different. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/image_note.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/resource.h"

struct verify_options {
    struct common_options common;
    const char *output;
};

/* One image. Zeroed = nothing done. */
struct verify {
    const struct verify_options *options;
    struct session *session;
    const char *path;
    json_t *note, *request;
    char *place; /* of the new image */
    char version[64];
    json_t *now; /* its note */
};

static const char *text_of(const json_t *note, const char *key)
{
    const char *text = json_string_value(json_object_get(note, key));
    return text ? text : "";
}

/* ---- the new image ---- */

static bool read_note(struct verify *verify, struct failure *failure)
{
    char sha256[SCENE_ID_BYTES];
    verify->note = image_note_read(verify->path, failure);
    if (!verify->note)
        return false;
    verify->request = json_loads(text_of(verify->note, "request"), 0, NULL);
    if (!json_is_object(verify->request))
        return fail(failure, EXIT_CODE_NO_INPUT, "the note of '%s' names no request", verify->path);
    if (!resource_hash(verify->session, verify->path, sha256, failure))
        return false;
    return !strcmp(sha256, text_of(verify->note, "sha256")) ||
           fail(failure, EXIT_CODE_DIFFERENT,
                "'%s' was changed after it was rendered: its SHA-256 is %s, and %s in its note",
                verify->path, sha256, text_of(verify->note, "sha256"));
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

static bool render_again(struct verify *verify, struct failure *failure)
{
    struct output_file image = {0};
    struct http_reply reply = {0};
    char sha256[SCENE_ID_BYTES];
    char *body = json_dumps(verify->request, JSON_COMPACT);
    bool is_ok = (body || fail_no_memory(failure)) &&
                 output_file_open(&image, verify->place, failure) &&
                 render_watch_ask(verify->session,
                                  &(struct http_request){.method = "POST",
                                                         .path = "/v1/renders",
                                                         .accept = "*/*",
                                                         .content_type = "application/json",
                                                         .body = body,
                                                         .sink = &image},
                                  "the render", &reply, failure) &&
                 output_file_commit(&image, failure) &&
                 resource_hash(verify->session, verify->place, sha256, failure);
    json_t *report = is_ok ? report_of(verify, &reply) : NULL;
    if (is_ok) {
        image_note_version(verify->session, verify->version, sizeof verify->version);
        verify->now = image_note_make(sha256, verify->request, report, verify->version, failure);
    }
    json_decref(report);
    http_reply_finish(&reply);
    output_file_finish(&image);
    free(body);
    return is_ok && verify->now;
}

/* ---- the verdict ---- */

/* Names of what the notes say differently, besides the image. */
static json_t *differences(const struct verify *verify)
{
    static const char *const keys[] = {"version", "device", "techniques", "chosen", "error"};
    json_t *found = json_object();
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        json_t *then = json_object_get(verify->note, keys[i]);
        json_t *now = json_object_get(verify->now, keys[i]);
        bool is_choice = !strcmp(keys[i], "chosen"); /* its times differ each time */
        if (is_choice) {
            then = json_object_get(then, "shadows");
            now = json_object_get(now, "shadows");
        }
        if (json_equal(then, now) || (!then && !now))
            continue;
        json_object_set_new(found, is_choice ? "chosen shadows" : keys[i],
                            json_pack("{s:O,s:O}", "then", then ? then : json_null(), "now",
                                      now ? now : json_null()));
    }
    return found;
}

static void print_text(const json_t *value)
{
    char *text = json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(6));
    fputs(text ? text : "?", stdout);
    free(text);
}

static void print_verdict(const struct verify *verify, bool is_same, json_t *different)
{
    const char *key;
    json_t *value;
    if (verify->options->common.json) {
        json_t *result = json_pack("{s:s,s:b,s:s,s:s,s:O}", "image", verify->path, "same", is_same,
                                   "sha256", text_of(verify->note, "sha256"), "sha256_now",
                                   text_of(verify->now, "sha256"), "differences", different);
        json_print(result, true);
        json_decref(result);
        return;
    }
    printf("%s: %s\n", verify->path, is_same ? "the same to the bit" : "other pixels");
    json_object_foreach(different, key, value)
    {
        printf("  %s: ", key);
        print_text(json_object_get(value, "then"));
        fputs(" then, ", stdout);
        print_text(json_object_get(value, "now"));
        puts(" now");
    }
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
    if (!render_again(verify, failure))
        return false;
    bool is_same = !strcmp(text_of(verify->note, "sha256"), text_of(verify->now, "sha256"));
    json_t *different = differences(verify);
    progress_hide(&verify->session->progress);
    if (!verify->options->common.quiet)
        print_verdict(verify, is_same, different);
    bool is_explained = json_object_size(different) > 0;
    json_decref(different);
    if (!output)
        remove(verify->place);
    return is_same || fail(failure, EXIT_CODE_DIFFERENT, "the image made now has other pixels%s",
                           is_explained ? "" : ", and nothing that its note tells is different");
}

static bool verify_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct verify verify = {.options = context, .path = operands->items[0]};
    struct session session = {0};
    verify.session = &session;
    bool is_ok =
        session_begin(&session, &verify.options->common, failure) && verify_image(&verify, failure);
    progress_hide(&session.progress);
    session_end(&session);
    json_decref(verify.note);
    json_decref(verify.request);
    json_decref(verify.now);
    free(verify.place);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE", "keep the image that is made now",
     offsetof(struct verify_options, output)},
    {0},
};

const struct command COMMAND_VERIFY = {
    .name = "verify",
    .synopsis = "IMAGE",
    .summary = "Make an image again by the note beside it, and say what is different",
    .details = "IMAGE.json is the note, which 'vitrail render --note' and --skip-existing write:\n"
               "the scene, the request, version, device, techniques and the stated error. The\n"
               "server must have the scene. Exit code 3: the image was changed since, or has\n"
               "other pixels now.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 1,
    .options_bytes = sizeof(struct verify_options),
    .run = verify_run,
};
