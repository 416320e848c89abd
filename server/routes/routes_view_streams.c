/* SPDX-License-Identifier: MIT */
/* /v1/views/{id}/stream and /events: frames as multipart, and what is known of them as server-sent
 * events. */
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/problem.h"
#include "server/routes/router.h"
#include "server/views/live.h"

#define BOUNDARY "vitrail-frame"
static const char frame_end[] = "\r\n--" BOUNDARY "\r\n";

/* A GET that does not end: the exchange owns it. Read on the HTTP server's threads. */
struct stream_get {
    struct watcher *watcher;
    _Atomic(struct http_stream *) stream; /* NULL until the reply has begun */
    bool is_ended;                        /* what waits to be sent is the last */
    /* The data to be sent: a text, then an image, then the end of a part. */
    char *text; /* owned */
    size_t text_bytes;
    struct view_image *image; /* held, or NULL */
    const char *tail;
    size_t sent_bytes;
};

static void stream_get_destroy(void *data)
{
    struct stream_get *get = data;
    watcher_destroy(get->watcher);
    view_image_release(get->image);
    free(get->text);
    free(get);
}

/* With the lock of the views held. */
static void wake(void *context)
{
    struct stream_get *get = context;
    struct http_stream *stream = atomic_load(&get->stream);
    if (stream)
        http_stream_wake(stream);
}

/* ---- sending ---- */

static void append(struct stream_get *get, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void append(struct stream_get *get, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *added = NULL;
    int length = vasprintf(&added, format, arguments);
    va_end(arguments);
    char *text = length >= 0 ? realloc(get->text, get->text_bytes + (size_t)length + 1) : NULL;
    if (text) { /* else that much is left out */
        memcpy(text + get->text_bytes, added, (size_t)length + 1);
        get->text = text;
        get->text_bytes += (size_t)length;
    }
    if (length >= 0)
        free(added);
}

/* Copies the part of [bytes, bytes + size) that is next, when the position is inside. */
static size_t copy_part(const void *bytes, size_t size_bytes, size_t *position, char *out,
                        size_t capacity)
{
    if (*position >= size_bytes) {
        *position -= size_bytes;
        return 0;
    }
    size_t count = size_bytes - *position < capacity ? size_bytes - *position : capacity;
    memcpy(out, (const char *)bytes + *position, count);
    return count;
}

static size_t send_some(struct stream_get *get, char *out, size_t capacity)
{
    size_t position = get->sent_bytes;
    size_t count = get->text ? copy_part(get->text, get->text_bytes, &position, out, capacity) : 0;
    if (count == 0 && get->image)
        count = copy_part(get->image->bytes, get->image->size_bytes, &position, out, capacity);
    if (count == 0 && get->tail)
        count = copy_part(get->tail, strlen(get->tail), &position, out, capacity);
    get->sent_bytes += count;
    if (count > 0)
        return count;
    free(get->text);
    view_image_release(get->image);
    get->text = NULL;
    get->image = NULL;
    get->tail = NULL;
    get->text_bytes = get->sent_bytes = 0;
    return 0;
}

/* ---- multipart ---- */

static void put_frame(struct stream_get *get, struct live_frame *frame)
{
    append(get,
           "Content-Type: %s\r\nContent-Length: %zu\r\nX-View-Revision: %llu\r\nX-View-Exact: "
           "%d\r\nX-View-Refined: %d\r\nX-View-Scale: %.6g\r\nLink: </v1/frames/%s>; "
           "rel=\"describedby\"\r\n\r\n",
           image_format_media_type(frame->image->format), frame->image->size_bytes,
           (unsigned long long)frame->revision, frame->is_exact, frame->is_refined, frame->scale,
           frame->image->frame);
    get->image = frame->image;
    get->tail = frame_end;
}

static void put_problem(struct stream_get *get, const struct error *problem)
{
    char *json = problem_to_json(problem, NULL);
    if (json)
        append(get, "Content-Type: " PROBLEM_MEDIA_TYPE "\r\nContent-Length: %zu\r\n\r\n%s",
               strlen(json), json);
    get->tail = frame_end;
    free(json);
}

static ssize_t read_frames(void *context, char *bytes, size_t capacity)
{
    struct stream_get *get = context;
    for (;;) {
        size_t count = send_some(get, bytes, capacity);
        if (count > 0)
            return (ssize_t)count;
        struct watcher_news news;
        struct live_frame again;
        watcher_look(get->watcher, true, &news);
        if (news.has_frame)
            put_frame(get, &news.frame);
        else if (news.is_gone)
            return -1;
        else if (news.has_problem)
            put_problem(get, &news.problem);
        else if (news.is_beat_due && watcher_repeat(get->watcher, &again))
            put_frame(get, &again);
        else
            return 0;
    }
}

/* ---- server-sent events ---- */

static void put_stats(struct stream_get *get, const struct live_frame *frame)
{
    const struct view_image *image = frame->image;
    append(get,
           "event: frame\ndata: "
           "{\"revision\":%llu,\"exact\":%s,\"refined\":%s,\"scale\":%.6g,\"format\":\"%s\","
           "\"bytes\":%zu,\"stats\":%s}\n\n",
           (unsigned long long)frame->revision, frame->is_exact ? "true" : "false",
           frame->is_refined ? "true" : "false", frame->scale,
           image_format_media_type(image->format), image->size_bytes,
           image->stats ? image->stats : "null");
    view_image_release(frame->image);
}

static void put_progress(struct stream_get *get, const struct job_progress *progress)
{
    json_t *json = job_progress_to_json(progress);
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(15)) : NULL;
    if (text)
        append(get, "event: progress\ndata: %s\n\n", text);
    free(text);
    json_decref(json);
}

static void put_events(struct stream_get *get, const struct watcher_news *news)
{
    if (news->has_revision)
        append(get, "event: view\ndata: {\"revision\":%llu}\n\n",
               (unsigned long long)news->revision);
    if (news->has_progress)
        put_progress(get, &news->progress);
    if (news->has_frame)
        put_stats(get, &news->frame);
    char *json = news->has_problem ? problem_to_json(&news->problem, NULL) : NULL;
    if (json)
        append(get, "event: problem\ndata: %s\n\n", json);
    free(json);
    if (news->is_gone)
        append(get, "event: gone\ndata: {}\n\n");
    else if (news->is_beat_due && get->text_bytes == 0)
        append(get, ": heartbeat\n\n");
    get->is_ended = news->is_gone;
}

static ssize_t read_events(void *context, char *bytes, size_t capacity)
{
    struct stream_get *get = context;
    for (;;) {
        size_t count = send_some(get, bytes, capacity);
        if (count > 0)
            return (ssize_t)count;
        if (get->is_ended)
            return -1;
        struct watcher_news news;
        watcher_look(get->watcher, true, &news);
        put_events(get, &news);
        if (get->text_bytes == 0)
            return 0;
    }
}

/* ---- routes ---- */

static void begin(struct service *service, struct http_exchange *exchange, const char *id,
                  bool is_passive)
{
    struct error problem = {0};
    struct stream_get *get = calloc(1, sizeof *get);
    if (!get) {
        http_reply_error(exchange, &(struct error){ERROR_NO_MEMORY, "stream", ""});
        return;
    }
    route_attach(exchange, get, stream_get_destroy);
    get->watcher =
        watcher_create(service->views,
                       &(struct watcher_desc){
                           .view = id, .is_passive = is_passive, .context = get, .notify = wake},
                       &problem);
    if (!get->watcher) {
        http_reply_error(exchange, &problem);
        return;
    }
    if (!is_passive)
        append(get, "--" BOUNDARY "\r\n");
    struct http_stream *stream = http_reply_stream(
        exchange,
        is_passive ? "text/event-stream" : "multipart/x-mixed-replace; boundary=" BOUNDARY,
        &(struct http_source){.context = get, .read = is_passive ? read_events : read_frames});
    atomic_store(&get->stream, stream);
}

static void run_stream(struct service *service, struct http_exchange *exchange, const char *id)
{
    begin(service, exchange, id, false);
}

static void run_events(struct service *service, struct http_exchange *exchange, const char *id)
{
    begin(service, exchange, id, true);
}

const struct route routes_view_streams[] = {
    {"/v1/views/{id}/stream", {{HTTP_GET, NULL, run_stream}}},
    {"/v1/views/{id}/events", {{HTTP_GET, NULL, run_events}}},
    {0},
};
