/* SPDX-License-Identifier: MIT */
/* vitrail job: submits lists of frames, watches them, and brings their files home. */
#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/job_watch.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/resource.h"
#include "clients/vitrail/scene_defaults.h"
#include "clients/vitrail/scene_source.h"

enum { PAGE_FRAMES = 500, ID_DIGITS = 16 };

struct job_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    const char *frames, *name, *key, *directory, *folder, *camera_path, *tiles;
    struct option_number frame_rate, priority, attempts, frame_timeout_s, turntable_deg;
    const char *after_failure;
    struct text_list files, after;
    bool still, paused, watch, turntable;
};

/* One call: a verb, and what it is about. */
struct job_call {
    struct job_options *options;
    struct session *session;
    const char *subject; /* a file, a scene or a job; NULL: all jobs */
    json_t *request;     /* of submit, without the scene; else NULL */
};

/* ---- the request ---- */

static bool put(json_t *object, const char *name, json_t *value, struct failure *failure)
{
    return json_object_set_new(object, name, value) == 0 || fail_no_memory(failure);
}

static bool put_number(json_t *object, const char *name, const struct option_number *number,
                       struct failure *failure)
{
    bool is_whole = number->value == floor(number->value) && fabs(number->value) < 1e15;
    return !number->is_given ||
           put(object, name,
               is_whole ? json_integer((json_int_t)number->value) : json_real(number->value),
               failure);
}

static bool put_text(json_t *object, const char *name, const char *text, struct failure *failure)
{
    return !text || put(object, name, json_string(text), failure);
}

#define DEEP "exr-deep" /* the one format that its file does not tell */

/* "beauty.%04d.exr=color,depth": the name of the output is that of the file up to its number. */
static json_t *read_file_option(const char *text, struct failure *failure)
{
    const char *equals = strchr(text, '=');
    int length = equals ? (int)(equals - text) : (int)strlen(text);
    json_t *outputs = json_array();
    size_t named = strcspn(text, "%.=");
    const char *format = NULL;

    for (const char *at = equals ? equals + 1 : ""; *at;) {
        size_t end = strcspn(at, ",");
        if (strncmp(at, DEEP, end) == 0 && end == strlen(DEEP))
            format = DEEP;
        else
            json_array_append_new(outputs, json_stringn(at, end));
        at += end + (at[end] == ',');
    }
    json_t *object = json_pack(
        "{s:s#,s:s#,s:o*,s:s*}", "file", text, length, "name", text, (int)named, "outputs",
        json_array_size(outputs) > 0 ? json_incref(outputs) : NULL, "format", format);
    json_decref(outputs);
    if (!object)
        fail(failure, EXIT_CODE_USAGE, "'%s' is not FILE or FILE=OUTPUT,OUTPUT", text);
    return object;
}

static bool put_files(json_t *object, const struct text_list *files, struct failure *failure)
{
    json_t *outputs = json_array();
    for (size_t i = 0; i < files->count; i++) {
        json_t *output = read_file_option(files->items[i], failure);
        if (!output || json_array_append_new(outputs, output) != 0) {
            json_decref(outputs);
            return false;
        }
    }
    if (files->count > 0)
        return put(object, "outputs", outputs, failure);
    json_decref(outputs);
    return true;
}

static bool put_turntable(json_t *object, const struct job_options *options,
                          struct failure *failure)
{
    if (!options->turntable && !options->turntable_deg.is_given)
        return true;
    json_t *turntable = json_object();
    return put(object, "turntable", turntable, failure) &&
           put_number(turntable, "elevation_deg", &options->turntable_deg, failure);
}

/* "2048" or "2048x1024". */
static bool put_tiles(json_t *object, const char *text, struct failure *failure)
{
    int width = 0, height = 0, end = 0;
    if (!text)
        return true;
    if (strspn(text, "0123456789x") != strlen(text) || sscanf(text, "%9d%n", &width, &end) != 1 ||
        (text[end] && (sscanf(text, "%9dx%9d%n", &width, &height, &end) != 2 || text[end])))
        return fail(failure, EXIT_CODE_USAGE, "--tiles: '%.60s' is not N or WIDTHxHEIGHT", text);
    return put(object, "tiles",
               height ? json_pack("{s:i,s:i}", "width", width, "height", height)
                      : json_integer(width),
               failure);
}

static bool put_camera_path(json_t *object, const char *path, struct failure *failure)
{
    json_t *keys = path ? json_object_load(path, "camera-path", failure) : NULL;
    return !path || (keys && put(object, "camera_path", keys, failure));
}

static bool is_job_id(const char *text)
{
    return strlen(text) == ID_DIGITS && strspn(text, "0123456789abcdef") == ID_DIGITS;
}

static bool put_after(json_t *object, const struct job_options *options, struct failure *failure)
{
    json_t *after = json_array();
    for (size_t i = 0; i < options->after.count; i++) {
        if (!is_job_id(options->after.items[i])) {
            json_decref(after);
            return fail(failure, EXIT_CODE_USAGE,
                        "--after: '%s' is not a job id: %d hexadecimal digits",
                        options->after.items[i], ID_DIGITS);
        }
        json_array_append_new(after, json_string(options->after.items[i]));
    }
    if (options->after.count > 0)
        return put(object, "after", after, failure) &&
               put_text(object, "after_failure", options->after_failure, failure);
    json_decref(after);
    return !options->after_failure ||
           fail(failure, EXIT_CODE_USAGE, "--after-failure needs --after JOB");
}

static json_t *build_request(const struct job_options *options, struct failure *failure)
{
    json_t *view = request_json_build(&options->request, failure);
    json_t *request = view ? json_pack("{s:o}", "view", view) : NULL;
    if (!request)
        return NULL;
    if (put_text(request, "frames", options->frames, failure) &&
        put_text(request, "name", options->name, failure) &&
        put_text(request, "directory", options->directory, failure) &&
        put_number(request, "frame_rate", &options->frame_rate, failure) &&
        put_number(request, "priority", &options->priority, failure) &&
        put_number(request, "attempts", &options->attempts, failure) &&
        put_number(request, "frame_timeout_s", &options->frame_timeout_s, failure) &&
        (!options->still || put(request, "animate", json_false(), failure)) &&
        (!options->paused || put(request, "paused", json_true(), failure)) &&
        put_after(request, options, failure) && put_turntable(request, options, failure) &&
        put_camera_path(request, options->camera_path, failure) &&
        put_tiles(request, options->tiles, failure) && put_files(request, &options->files, failure))
        return request;
    json_decref(request);
    return NULL;
}

/* ---- asking ---- */

static json_t *get_job(const struct job_call *call, const char *id, struct failure *failure)
{
    char path[128];
    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    return session_get_json(call->session, path, "the job", failure);
}

static json_int_t count_of(const json_t *job, const char *key)
{
    return json_integer_value(json_object_get(json_object_get(job, "frames"), key));
}

/* "  after JOB and 2 more", or nothing. */
static void describe_waits(const json_t *job, char *text, size_t size)
{
    const json_t *ids = json_object_get(job, "waits_for");
    size_t count = json_array_size(ids);
    char id[32], more[32] = "";
    const char *first = json_string_value(json_array_get(ids, 0));
    text_copy_printable(id, sizeof id, first ? first : "");
    if (count > 1)
        snprintf(more, sizeof more, " and %zu more", count - 1);
    snprintf(text, size, "%s%s%s", count > 0 ? "  after " : "", id, more);
}

static void print_row(const json_t *job)
{
    char id[32], state[16], name[256], waits[96];
    describe_waits(job, waits, sizeof waits);
    bool is_paused = json_is_true(json_object_get(job, "paused")) && !job_has_ended(job);
    text_copy_printable(id, sizeof id, job_text(job, "id"));
    text_copy_printable(state, sizeof state, is_paused ? "paused" : job_text(job, "state"));
    text_copy_printable(name, sizeof name, job_text(job, "name"));
    printf("%s  %-9s %6lld of %lld frames, %lld failed%s%s%s\n", id, state,
           (long long)count_of(job, "done"), (long long)count_of(job, "count"),
           (long long)count_of(job, "failed"), waits, *name ? "  " : "", name);
}

/* Until the job has ended, or waits for somebody to resume it. Ctrl-C leaves the job as it is. */
static bool watch_job(const struct job_call *call, const char *id, struct failure *failure)
{
    char path[128];
    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    const struct job_watch watch = {
        .session = call->session, .path = path, .noun = "the job", .parts = "frames"};
    json_t *job = job_watch_wait(&watch, failure);
    if (!job)
        return false;
    progress_hide(&call->session->progress);
    if (call->options->common.json)
        json_print(job, true);
    else if (!call->options->common.quiet)
        print_row(job);
    bool is_ok = job_watch_judge(&watch, job, failure);
    json_decref(job);
    return is_ok;
}

/* ---- verbs ---- */

static bool bring(const struct job_call *call, struct failure *failure)
{
    struct scene_push push = {0};
    json_t *view = json_object_get(call->request, "view");
    if (!scene_source_bring(call->session, call->subject, &call->options->file, view, &push,
                            failure) ||
        (!call->options->request.base_path &&
         !scene_defaults_ask(call->session, push.id, view, failure)))
        return false;
    json_object_del(view, "scene");
    return put(call->request, "scene", json_string(push.id), failure);
}

static bool submit(const struct job_call *call, struct failure *failure)
{
    struct http_reply reply = {0};
    json_t *job = NULL;
    char *text = NULL;
    if (bring(call, failure) && !(text = json_dumps(call->request, JSON_COMPACT)))
        fail_no_memory(failure);
    if (text && session_ask(call->session,
                            &(struct http_request){.method = "POST",
                                                   .path = "/v1/jobs",
                                                   .content_type = "application/json",
                                                   .body = text,
                                                   .idempotency_key = call->options->key},
                            "the job", &reply, failure))
        job = reply_json(&reply, "the job", failure);
    http_reply_finish(&reply);
    free(text);
    progress_hide(&call->session->progress);
    char id[ID_DIGITS + 1];
    snprintf(id, sizeof id, "%s", job_text(job, "id"));
    bool is_ok = job != NULL;
    if (job && call->options->common.json && !call->options->watch)
        json_print(job, true);
    else if (job && !call->options->common.json)
        puts(id);
    fflush(stdout);
    json_decref(job);
    return is_ok && (!call->options->watch || watch_job(call, id, failure));
}

static bool list(const struct job_call *call, struct failure *failure)
{
    json_t *answer = session_get_json(call->session, "/v1/jobs", "the list of jobs", failure);
    const json_t *job;
    size_t index;
    progress_hide(&call->session->progress);
    if (answer && call->options->common.json)
        json_print(answer, true);
    else
        json_array_foreach(json_object_get(answer, "jobs"), index, job) print_row(job);
    json_decref(answer);
    return answer != NULL;
}

static bool show(const struct job_call *call, struct failure *failure)
{
    json_t *job = get_job(call, call->subject, failure);
    progress_hide(&call->session->progress);
    if (job)
        json_print(job, call->options->common.json);
    json_decref(job);
    return job != NULL;
}

static bool watch(const struct job_call *call, struct failure *failure)
{
    return watch_job(call, call->subject, failure);
}

/* Asks for a change, and prints what the job is then. */
static bool ask(const struct job_call *call, const char *method, const char *query,
                const char *body, struct failure *failure)
{
    struct http_reply reply = {0};
    char path[128];
    snprintf(path, sizeof path, "/v1/jobs/%s%s", call->subject, query);
    bool is_ok =
        session_ask(call->session,
                    &(struct http_request){.method = method,
                                           .path = path,
                                           .content_type = body ? "application/json" : NULL,
                                           .body = body},
                    "the job", &reply, failure);
    json_t *job = is_ok && reply.body_bytes > 0 ? reply_json(&reply, "the job", failure) : NULL;
    progress_hide(&call->session->progress);
    if (job && call->options->common.json)
        json_print(job, true);
    else if (job && !call->options->common.quiet)
        print_row(job);
    json_decref(job);
    http_reply_finish(&reply);
    return is_ok;
}

static bool cancel(const struct job_call *call, struct failure *failure)
{
    return ask(call, "DELETE", "", NULL, failure);
}

static bool forget(const struct job_call *call, struct failure *failure)
{
    return ask(call, "DELETE", "?forget=true", NULL, failure);
}

static bool pause_job(const struct job_call *call, struct failure *failure)
{
    return ask(call, "PATCH", "", "{\"paused\":true}", failure);
}

static bool resume(const struct job_call *call, struct failure *failure)
{
    return ask(call, "PATCH", "", "{\"paused\":false}", failure);
}

static bool retry(const struct job_call *call, struct failure *failure)
{
    return ask(call, "PATCH", "", "{\"retry_failed\":true}", failure);
}

static bool set_priority(const struct job_call *call, struct failure *failure)
{
    char body[64];
    if (!call->options->priority.is_given)
        return fail(failure, EXIT_CODE_USAGE, "'job priority' needs --priority P");
    snprintf(body, sizeof body, "{\"priority\":%.17g}", call->options->priority.value);
    return ask(call, "PATCH", "", body, failure);
}

/* ---- fetch ---- */

/* Whether the file is there with that content. */
static bool is_there(const struct job_call *call, const char *path, const char *sha256)
{
    struct failure ignored = {0};
    struct stat status;
    char found[SCENE_ID_BYTES];
    return stat(path, &status) == 0 && S_ISREG(status.st_mode) &&
           resource_hash(call->session, path, found, &ignored) && !strcmp(found, sha256);
}

static bool fetch_file(const struct job_call *call, const json_t *file, bool *is_new,
                       struct failure *failure)
{
    struct output_file output = {0};
    struct http_reply reply = {0};
    const char *name = job_text(file, "file"), *href = job_text(file, "href");
    char *path = NULL;
    if (!*name || strchr(name, '/') || name[0] == '.' || href[0] != '/')
        return fail(failure, EXIT_CODE_UNAVAILABLE, "the server names a file that cannot be taken");
    if (asprintf(&path, "%s/%s", call->options->folder, name) < 0)
        return fail_no_memory(failure);
    *is_new = !is_there(call, path, job_text(file, "sha256"));
    bool is_ok = !*is_new ||
                 (output_file_open(&output, path, failure) &&
                  session_ask(call->session,
                              &(struct http_request){
                                  .method = "GET", .path = href, .accept = "*/*", .sink = &output},
                              "a file of the job", &reply, failure) &&
                  output_file_commit(&output, failure));
    http_reply_finish(&reply);
    output_file_finish(&output);
    free(path);
    return is_ok;
}

static bool fetch_page(const struct job_call *call, const json_t *page, json_int_t counts[2],
                       struct failure *failure)
{
    const json_t *frame, *file;
    size_t i, k;
    bool is_new = false;
    json_array_foreach(json_object_get(page, "frames"), i, frame)
    {
        json_array_foreach(json_object_get(frame, "files"), k, file)
        {
            if (!fetch_file(call, file, &is_new, failure))
                return false;
            counts[is_new]++;
        }
    }
    return true;
}

static bool fetch(const struct job_call *call, struct failure *failure)
{
    json_int_t counts[2] = {0}, first = 0, all = 1; /* files that were there, and new ones */
    char path[160];
    if (!call->options->folder)
        return fail(failure, EXIT_CODE_USAGE, "'job fetch' needs a folder: -o FOLDER");
    if (mkdir(call->options->folder, 0777) != 0 && errno != EEXIST)
        return fail(failure, EXIT_CODE_CANT_CREATE, "'%s': %s", call->options->folder,
                    strerror(errno));
    for (; first < all; first += PAGE_FRAMES) {
        snprintf(path, sizeof path, "/v1/jobs/%s/frames?first=%lld&count=%d", call->subject,
                 (long long)first, PAGE_FRAMES);
        json_t *page = session_get_json(call->session, path, "the frames", failure);
        all = json_integer_value(json_object_get(page, "count"));
        bool is_ok = page && fetch_page(call, page, counts, failure);
        json_decref(page);
        if (!is_ok)
            return false;
    }
    progress_hide(&call->session->progress);
    if (!call->options->common.quiet)
        printf("%lld files fetched, %lld were there\n", (long long)counts[1], (long long)counts[0]);
    return true;
}

/* ---- the command ---- */

static const struct verb {
    const char *name;
    int operands_min, operands_max; /* after the verb */
    bool (*run)(const struct job_call *call, struct failure *failure);
} VERBS[] = {
    {"submit", 1, 1, submit},   {"list", 0, 0, list},     {"show", 1, 1, show},
    {"watch", 1, 1, watch},     {"fetch", 1, 1, fetch},   {"cancel", 1, 1, cancel},
    {"pause", 1, 1, pause_job}, {"resume", 1, 1, resume}, {"priority", 1, 1, set_priority},
    {"retry", 1, 1, retry},     {"forget", 1, 1, forget},
};

static const struct verb *find_verb(const char *name, struct failure *failure)
{
    for (size_t i = 0; i < sizeof VERBS / sizeof *VERBS; i++)
        if (!strcmp(name, VERBS[i].name))
            return &VERBS[i];
    fail(failure, EXIT_CODE_USAGE,
         "'%s' is none of submit, list, show, watch, fetch, cancel, pause, resume, priority, "
         "retry, forget",
         name);
    return NULL;
}

static bool check(const struct verb *verb, struct job_call *call, int operands,
                  struct failure *failure)
{
    if (operands < verb->operands_min || operands > verb->operands_max)
        return fail(failure, EXIT_CODE_USAGE, "'job %s' takes %d operands, not %d", verb->name,
                    verb->operands_max, operands);
    if (verb->run != submit)
        return !call->subject || is_job_id(call->subject) ||
               fail(failure, EXIT_CODE_USAGE, "'%s' is not a job id: 16 hexadecimal digits",
                    call->subject);
    call->request = build_request(call->options, failure);
    return call->request && scene_source_check_all(call->subject, &call->options->file,
                                                   json_object_get(call->request, "view"), failure);
}

static bool job_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct job_options *options = context;
    const struct verb *verb = find_verb(operands->items[0], failure);
    struct session session = {0};
    struct job_call call = {.options = options,
                            .session = &session,
                            .subject = operands->count > 1 ? operands->items[1] : NULL};
    bool is_ok = verb && check(verb, &call, (int)operands->count - 1, failure) &&
                 session_begin(&session, &options->common, failure) && verb->run(&call, failure);

    progress_hide(&session.progress);
    session_end(&session);
    json_decref(call.request);
    return is_ok;
}

#define AT(member) offsetof(struct job_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "frames", 0, "LIST", "numbers and ranges, such as 1-100,120-140x2", AT(frames)},
    {OPTION_NUMBER, "frame-rate", 0, "N", "frames per second of the scene's animation; default 24",
     AT(frame_rate)},
    {OPTION_FLAG, "still", 0, NULL, "the scene stands still from frame to frame", AT(still)},
    {OPTION_FLAG, "turntable", 0, NULL, "the camera goes round the scene once", AT(turntable)},
    {OPTION_NUMBER, "turntable-elevation", 0, "DEGREES", "from so far above; default 20",
     AT(turntable_deg)},
    {OPTION_TEXT, "tiles", 0, "N",
     "render large pictures in tiles of N or WxH pixels, and join them", AT(tiles)},
    {OPTION_TEXT, "camera-path", 0, "FILE.json", "the camera moves through the keys of the file",
     AT(camera_path)},
    {OPTION_LIST, "file", 0, "PATTERN",
     "one file of each frame: beauty.%04d.exr=color,depth\n(default: color.%04d.png), "
     "or deep.%04d.exr=exr-deep",
     AT(files)},
    {OPTION_TEXT, "name", 0, "TEXT", "of the job, for people", AT(name)},
    {OPTION_NUMBER, "priority", 0, "P", "0 to 100, default 50: ten more double the share",
     AT(priority)},
    {OPTION_NUMBER, "attempts", 0, "N", "of a frame, until it has failed; default 3", AT(attempts)},
    {OPTION_NUMBER, "frame-timeout", 0, "S", "deadline of a frame; default: the server's",
     AT(frame_timeout_s)},
    {OPTION_TEXT, "key", 0, "TEXT", "submitted again with the same key, it is the same job",
     AT(key)},
    {OPTION_TEXT, "directory", 0, "PATH", "of the server, below its --job-dir: results go there",
     AT(directory)},
    {OPTION_LIST, "after", 0, "JOB", "begin when that job is done; may be given several times",
     AT(after)},
    {OPTION_TEXT, "after-failure", 0, "WHAT",
     "where such a job fails: cancel (the default), run or wait", AT(after_failure)},
    {OPTION_FLAG, "paused", 0, NULL, "wait for 'job resume'", AT(paused)},
    {OPTION_FLAG, "watch", 0, NULL, "submit: stay until the job has ended", AT(watch)},
    {OPTION_TEXT, "output-folder", 'o', "FOLDER", "fetch: where the files go", AT(folder)},
    SCENE_FILE_OPTIONS(struct job_options),
    REQUEST_VIEW_OPTIONS(struct job_options),
    {0},
};

const struct command COMMAND_JOB = {
    .name = "job",
    .synopsis = "VERB ...",
    .summary = "Render lists of frames on the server, whatever ends meanwhile",
    .details = "  submit FILE|SCENE     prints the id of the new job\n"
               "  list                  all jobs, newest first\n"
               "  show JOB              what is known of it, as JSON\n"
               "  watch JOB             stays until it has ended\n"
               "  fetch JOB -o FOLDER   its files; those that are there already are not sent\n"
               "  cancel JOB            no more frames; those that are done stay\n"
               "  pause JOB, resume JOB\n"
               "  priority JOB --priority P\n"
               "  retry JOB             failed frames are rendered again\n"
               "  forget JOB            removes one that has ended, with its results\n"
               "submit takes the options from --frames on; Ctrl-C while it watches leaves the job\n"
               "on the server as it is. Exit codes of watch: 1 frames failed or the job was\n"
               "cancelled, 75 it is paused, or waits for a job that failed.\n" REQUEST_HELP,
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = 2,
    .options_bytes = sizeof(struct job_options),
    .run = job_run,
};
