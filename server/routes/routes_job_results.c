/* SPDX-License-Identifier: MIT */
/* /v1/jobs/{id}/...: the files of frames, all of them as one archive, and events. */
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/http/negotiate.h"
#include "server/jobs/jobs.h"
#include "server/routes/job_archive.h"
#include "server/routes/router.h"

/* ---- one file ---- */

/* "ID/12/color" */
static bool split(const char *path, char id[JOB_ID_BYTES], int *frame, const char **output,
                  struct error *err)
{
    const char *number = strchr(path, '/') + 1;
    char *end = NULL;
    snprintf(id, JOB_ID_BYTES, "%.*s", (int)(number - 1 - path), path);
    long value = strtol(number, &end, 10);
    *output = strchr(number, '/') + 1;
    *frame = (int)value;
    return (*end == '/' && *number >= '0' && *number <= '9' && value <= FRAME_NUMBER_MAX) ||
           error_set(err, ERROR_NOT_FOUND, "'%.*s' is no number of a frame",
                     (int)strcspn(number, "/"), number);
}

static void run_file(struct service *service, struct http_exchange *exchange, const char *path)
{
    struct error problem = {0};
    struct job_file file;
    char id[JOB_ID_BYTES], tag[DIGEST_TEXT_BYTES + 2];
    const char *output;
    int frame;
    if (!split(path, id, &frame, &output, &problem) ||
        !jobs_open_file(service->jobs, id, frame, output, &file, &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    snprintf(tag, sizeof tag, "\"%s\"", file.digest);
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (negotiate_tag_matches(http_request_header(exchange, "If-None-Match"), tag)) {
        close(file.fd);
        http_reply_header(exchange, "ETag", "%s", tag);
        http_reply_empty(exchange, 304);
        return;
    }
    http_reply_header(exchange, "Content-Disposition", "inline; filename=\"%s\"", file.name);
    http_reply_file(exchange, file.media_type, tag, file.fd, file.size_bytes);
}

/* ---- all files ---- */

static ssize_t read_archive(void *context, char *bytes, size_t capacity)
{
    return job_archive_read(context, bytes, capacity);
}

static void destroy_archive(void *data)
{
    job_archive_destroy(data);
}

static void run_archive(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct job_archive *archive = job_archive_create(service->jobs, id, &problem);
    if (!archive) {
        http_reply_error(exchange, &problem);
        return;
    }
    route_attach(exchange, archive, destroy_archive);
    http_reply_header(exchange, "Content-Disposition", "attachment; filename=\"job-%s.tar\"", id);
    http_reply_stream(exchange, "application/x-tar",
                      &(struct http_source){.context = archive, .read = read_archive});
}

/* ---- events ---- */

/* A GET that does not end: the exchange owns it. */
struct events_get {
    struct jobs *jobs;
    struct job_watch *watch;
    _Atomic(struct http_stream *) stream; /* NULL until the reply has begun */
    char id[JOB_ID_BYTES];
    uint32_t sequence; /* of the last change that was sent */
    bool has_begun, has_ended;
    char *text; /* owned; to be sent */
    size_t text_bytes, sent_bytes;
};

static void events_destroy(void *data)
{
    struct events_get *get = data;
    jobs_unwatch(get->watch);
    free(get->text);
    free(get);
}

/* With the lock of the jobs held. */
static void wake(void *context)
{
    struct events_get *get = context;
    struct http_stream *stream = atomic_load(&get->stream);
    if (stream)
        http_stream_wake(stream);
}

static bool put_event(FILE *out, const char *name, const json_t *data, json_int_t sequence)
{
    char *text = json_dumps(data, JSON_COMPACT | JSON_REAL_PRECISION(15));
    if (!text)
        return false;
    if (sequence > 0)
        fprintf(out, "id: %lld\n", (long long)sequence);
    fprintf(out, "event: %s\ndata: %s\n\n", name, text);
    free(text);
    return true;
}

/* The events of what changed; the last one carries its number, so that a client that was cut off
 * inside gets all of them again. */
static void make_events(struct events_get *get)
{
    json_t *changes = jobs_changes(get->jobs, get->id, get->sequence), *frame;
    json_int_t sequence = json_integer_value(json_object_get(changes, "sequence"));
    size_t index, size_bytes = 0;
    FILE *out = NULL;
    if (!changes) {
        get->has_ended = true;
        return;
    }
    if (!get->has_begun || sequence != (json_int_t)get->sequence)
        out = open_memstream(&get->text, &size_bytes);
    if (out) {
        const json_t *job = json_object_get(changes, "job");
        json_array_foreach(json_object_get(changes, "frames"), index, frame)
            put_event(out, "frame", frame, 0);
        put_event(out, "job", job, sequence);
        get->has_ended = !json_is_null(json_object_get(job, "ended")) &&
                         json_integer_value(json_object_get(job, "sequence")) == sequence;
        fclose(out);
        get->text_bytes = size_bytes;
        get->sequence = (uint32_t)sequence;
        get->has_begun = true;
    }
    json_decref(changes);
}

static ssize_t read_events(void *context, char *bytes, size_t capacity)
{
    struct events_get *get = context;
    if (!get->text && get->has_ended)
        return -1;
    if (!get->text)
        make_events(get);
    if (!get->text)
        return get->has_ended ? -1 : 0;
    size_t left = get->text_bytes - get->sent_bytes;
    size_t count = left < capacity ? left : capacity;
    memcpy(bytes, get->text + get->sent_bytes, count);
    get->sent_bytes += count;
    if (get->sent_bytes == get->text_bytes) {
        free(get->text);
        get->text = NULL;
        get->text_bytes = get->sent_bytes = 0;
    }
    return (ssize_t)count;
}

static void run_events(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    const char *last = http_request_header(exchange, "Last-Event-ID");
    struct events_get *get = strlen(id) < JOB_ID_BYTES ? calloc(1, sizeof *get) : NULL;
    if (!get) {
        error_set(&problem, ERROR_NOT_FOUND, "there is no job '%.64s'", id);
        http_reply_error(exchange, &problem);
        return;
    }
    route_attach(exchange, get, events_destroy);
    get->jobs = service->jobs;
    memcpy(get->id, id, strlen(id) + 1);
    get->sequence = last ? (uint32_t)strtoul(last, NULL, 10) : 0;
    get->watch = jobs_watch(service->jobs, id, get, wake, &problem);
    if (!get->watch) {
        http_reply_error(exchange, &problem);
        return;
    }
    struct http_stream *stream = http_reply_stream(
        exchange, "text/event-stream", &(struct http_source){.context = get, .read = read_events});
    atomic_store(&get->stream, stream);
}

const struct route routes_job_results[] = {
    {"/v1/jobs/{id}/frames/{frame}/{output}", {{HTTP_GET, NULL, run_file}}},
    {"/v1/jobs/{id}/results.tar", {{HTTP_GET, NULL, run_archive}}},
    {"/v1/jobs/{id}/events", {{HTTP_GET, NULL, run_events}}},
    {0},
};
