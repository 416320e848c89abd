/* SPDX-License-Identifier: MIT */
/* libcurl behind a plain request and reply: one multi handle, polled together with the signals. */
#include "clients/vitrail/http.h"

#include <curl/curl.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define SIDE_FIRST_S 0.5 /* quicker answers are not looked at */
#define SIDE_LAST_S 2.   /* between two looks, after ... */
#define SIDE_SHARE 0.05  /* ... this share of what has passed already is longer */

enum {
    SIDE_BYTES_MAX = 4096,       /* a longer one is cut, and then is no document */
    REPLY_BYTES_MAX = 256 << 20, /* an answer that is kept in memory: JSON, never an image */
    POLL_MS = 100,               /* as often as the progress bar is redrawn */
    CONNECT_TIMEOUT_MS = 10000,  /* a machine that is down must not look like a slow one */
};

struct http_client {
    char *base_url;
    char *shown_url; /* the same without user and password, for messages */
    bool is_local;   /* on this machine: never through a proxy */
    struct interrupt *interrupt;
    struct progress *progress;
    double deadline_s;
    CURL *easy;
    CURLM *multi;
};

/* The document beside a request. Zeroed = none is asked for. */
struct side_look {
    CURL *easy; /* NULL: not yet */
    char *url;
    bool is_under_way;
    double begun_s, due_s;
    char body[SIDE_BYTES_MAX];
    size_t body_bytes;
};

/* One request under way. */
struct transfer {
    struct http_client *client;
    const struct http_request *request;
    struct http_reply *reply;
    struct failure *failure;
    struct curl_slist *headers;
    curl_mime *mime;
    FILE *body;
    char *url;
    char curl_message[CURL_ERROR_SIZE];
    bool is_coming; /* the body of the answer */
    struct side_look look;
};

/* The address as it may be shown: without user and password. NULL: no memory. */
static char *url_to_show(CURLU *url)
{
    char *text = NULL, *copy = NULL;

    if (!curl_url_set(url, CURLUPART_USER, NULL, 0) &&
        !curl_url_set(url, CURLUPART_PASSWORD, NULL, 0) &&
        !curl_url_get(url, CURLUPART_URL, &text, 0))
        copy = strdup(text);
    curl_free(text);
    for (size_t n = copy ? strlen(copy) : 0; n > 0 && copy[n - 1] == '/'; n--)
        copy[n - 1] = '\0';
    return copy;
}

/* Takes the address apart: it must be of a server, and may be on this machine. */
static bool url_understand(struct http_client *client, CURLU *url)
{
    char *scheme = NULL, *host = NULL;
    bool is_ok = !curl_url_set(url, CURLUPART_URL, client->base_url, 0) &&
                 !strpbrk(client->base_url, "?# \t\r\n") &&
                 !curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) &&
                 !curl_url_get(url, CURLUPART_HOST, &host, 0) &&
                 (!strcmp(scheme, "http") || !strcmp(scheme, "https"));

    if (is_ok)
        client->is_local =
            !strncmp(host, "127.", 4) || !strcmp(host, "localhost") || !strcmp(host, "[::1]");
    curl_free(scheme);
    curl_free(host);
    return is_ok;
}

/* Also takes "host:port", for http://host:port. */
static bool url_set(struct http_client *client, const char *text, struct failure *failure)
{
    CURLU *url = curl_url();

    if (asprintf(&client->base_url, "%s%s", strstr(text, "://") ? "" : "http://", text) < 0)
        client->base_url = NULL;
    for (size_t n = client->base_url ? strlen(client->base_url) : 0;
         n > 0 && client->base_url[n - 1] == '/'; n--)
        client->base_url[n - 1] = '\0';
    if (url && client->base_url) {
        if (url_understand(client, url))
            client->shown_url = url_to_show(url);
        else
            fail(failure, EXIT_CODE_USAGE,
                 "'%s' is not the address of a server, such as http://127.0.0.1:8090", text);
    }
    curl_url_cleanup(url);
    return client->shown_url || fail_no_memory(failure);
}

struct http_client *http_client_create(const struct http_client_desc *desc, struct failure *failure)
{
    struct http_client *client = calloc(1, sizeof *client);

    if (!client || curl_global_init(CURL_GLOBAL_DEFAULT) != 0) {
        fail_no_memory(failure);
        free(client);
        return NULL;
    }
    client->interrupt = desc->interrupt;
    client->progress = desc->progress;
    client->deadline_s = desc->deadline_s;
    client->easy = curl_easy_init();
    client->multi = curl_multi_init();
    if (!client->easy || !client->multi) {
        fail_no_memory(failure);
        goto fail;
    }
    if (!url_set(client, desc->base_url, failure))
        goto fail;
    return client;

fail:
    http_client_destroy(client);
    return NULL;
}

void http_client_destroy(struct http_client *client)
{
    if (!client)
        return;
    if (client->easy)
        curl_easy_cleanup(client->easy);
    if (client->multi)
        curl_multi_cleanup(client->multi);
    curl_global_cleanup();
    free(client->base_url);
    free(client->shown_url);
    free(client);
}

const char *http_client_url(const struct http_client *client)
{
    return client->shown_url;
}

bool http_reply_frame_path(const struct http_reply *reply, char *path, size_t capacity)
{
    const char *from = strstr(reply->link, "</v1/frames/");
    size_t n = from ? strcspn(from, ">") : 0;

    if (!from || from[n] != '>' || n >= capacity)
        return false;
    memcpy(path, from + 1, n - 1);
    path[n - 1] = '\0';
    return true;
}

void http_reply_finish(struct http_reply *reply)
{
    free(reply->body);
    *reply = (struct http_reply){0};
}

static bool reply_append(struct transfer *transfer, const char *bytes, size_t size)
{
    struct http_reply *reply = transfer->reply;
    char *body;

    if (size > REPLY_BYTES_MAX - reply->body_bytes)
        return fail(transfer->failure, EXIT_CODE_TEMPORARY, "the answer is longer than %d MiB",
                    REPLY_BYTES_MAX >> 20);
    body = realloc(reply->body, reply->body_bytes + size + 1);
    if (!body)
        return fail_no_memory(transfer->failure);
    memcpy(body + reply->body_bytes, bytes, size);
    reply->body = body;
    reply->body_bytes += size;
    body[reply->body_bytes] = '\0';
    return true;
}

static size_t on_receive(char *bytes, size_t unit, size_t count, void *context)
{
    struct transfer *transfer = context;
    size_t size = unit * count;
    long status = 0;
    bool is_ok;

    transfer->is_coming = true;
    curl_easy_getinfo(transfer->client->easy, CURLINFO_RESPONSE_CODE, &status);
    if (transfer->request->sink && status >= 200 && status < 300)
        is_ok = output_file_write(transfer->request->sink, bytes, size, transfer->failure);
    else
        is_ok = reply_append(transfer, bytes, size);
    return is_ok ? size : 0;
}

static size_t on_send(char *bytes, size_t unit, size_t count, void *context)
{
    struct transfer *transfer = context;
    size_t size = fread(bytes, 1, unit * count, transfer->body);

    if (ferror(transfer->body)) {
        fail(transfer->failure, EXIT_CODE_NO_INPUT, "cannot read '%s'",
             transfer->request->body_path);
        return CURL_READFUNC_ABORT;
    }
    return size;
}

static int on_seek(void *context, curl_off_t offset, int origin)
{
    struct transfer *transfer = context;
    return fseeko(transfer->body, offset, origin) == 0 ? CURL_SEEKFUNC_OK : CURL_SEEKFUNC_FAIL;
}

static int on_progress(void *context, curl_off_t down_total, curl_off_t down, curl_off_t up_total,
                       curl_off_t up)
{
    const struct transfer *transfer = context;
    const struct http_request *request = transfer->request;
    struct progress *progress = transfer->client->progress;

    if (down > 0 && request->receiving)
        progress_show(progress, request->receiving, (uint64_t)down, (uint64_t)down_total);
    else if (up < up_total && request->sending)
        progress_show(progress, request->sending, (uint64_t)up, (uint64_t)up_total);
    else if (down == 0 && request->waiting && (up_total > 0 || !request->sending))
        progress_show(progress, request->waiting, 0, 0);
    return 0;
}

static bool add_header(struct transfer *transfer, const char *name, const char *value)
{
    char line[256];
    struct curl_slist *longer;

    snprintf(line, sizeof line, "%s: %s", name, value);
    longer = curl_slist_append(transfer->headers, line);
    if (!longer)
        return fail_no_memory(transfer->failure);
    transfer->headers = longer;
    return true;
}

static bool attach_file(struct transfer *transfer)
{
    struct stat status;
    CURL *easy = transfer->client->easy;
    const char *path = transfer->request->body_path;

    transfer->body = fopen(path, "rbe");
    if (!transfer->body || fstat(fileno(transfer->body), &status) != 0)
        return fail(transfer->failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", path,
                    strerror(errno));
    curl_easy_setopt(easy, CURLOPT_POST, 1L);
    curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)status.st_size);
    curl_easy_setopt(easy, CURLOPT_READFUNCTION, on_send);
    curl_easy_setopt(easy, CURLOPT_READDATA, transfer);
    curl_easy_setopt(easy, CURLOPT_SEEKFUNCTION, on_seek);
    curl_easy_setopt(easy, CURLOPT_SEEKDATA, transfer);
    return true;
}

static bool attach_parts(struct transfer *transfer)
{
    const struct http_request *request = transfer->request;

    transfer->mime = curl_mime_init(transfer->client->easy);
    if (!transfer->mime)
        return fail_no_memory(transfer->failure);
    for (size_t i = 0; i < request->part_count; i++) {
        const struct http_part *file = &request->parts[i];
        curl_mimepart *part = curl_mime_addpart(transfer->mime);
        CURLcode code = part ? curl_mime_filedata(part, file->path) : CURLE_OUT_OF_MEMORY;
        if (code == CURLE_READ_ERROR)
            return fail(transfer->failure, EXIT_CODE_NO_INPUT, "cannot read '%s'", file->path);
        /* The name is in both places: many servers cut the folders off a file name. */
        if (code || curl_mime_name(part, file->name) || curl_mime_filename(part, file->name))
            return fail_no_memory(transfer->failure);
    }
    curl_easy_setopt(transfer->client->easy, CURLOPT_MIMEPOST, transfer->mime);
    return true;
}

static bool attach_body(struct transfer *transfer)
{
    const struct http_request *request = transfer->request;
    CURL *easy = transfer->client->easy;

    if (request->content_type && !add_header(transfer, "Content-Type", request->content_type))
        return false;
    if (request->parts)
        return attach_parts(transfer);
    if (request->body_path)
        return attach_file(transfer);
    if (request->body) {
        curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)strlen(request->body));
        curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request->body);
        if (strcmp(request->method, "POST") != 0)
            curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request->method);
    } else if (!strcmp(request->method, "HEAD")) {
        curl_easy_setopt(easy, CURLOPT_NOBODY, 1L);
    } else if (strcmp(request->method, "GET") != 0) {
        curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request->method);
    }
    return true;
}

static void set_common(const struct http_client *client, CURL *easy, const char *url)
{
    curl_easy_setopt(easy, CURLOPT_URL, url);
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_USERAGENT, "vitrail/" VITRAIL_VERSION);
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, (long)CONNECT_TIMEOUT_MS);
    curl_easy_setopt(easy, CURLOPT_TCP_KEEPALIVE, 1L);
    if (client->is_local)
        curl_easy_setopt(easy, CURLOPT_PROXY, "");
}

static bool transfer_prepare(struct transfer *transfer)
{
    struct http_client *client = transfer->client;
    const struct http_request *request = transfer->request;
    CURL *easy = client->easy;

    curl_easy_reset(easy);
    if (asprintf(&transfer->url, "%s%s", client->base_url, request->path) < 0)
        return fail_no_memory(transfer->failure);
    set_common(client, easy, transfer->url);
    curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, transfer->curl_message);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, on_receive);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, transfer);
    curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(easy, CURLOPT_XFERINFODATA, transfer);
    if (!add_header(transfer, "Accept", request->accept ? request->accept : "application/json"))
        return false;
    if (request->request_id && !add_header(transfer, "X-Request-Id", request->request_id))
        return false;
    if (request->idempotency_key &&
        !add_header(transfer, "Idempotency-Key", request->idempotency_key))
        return false;
    if (!attach_body(transfer))
        return false;
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, transfer->headers);
    return true;
}

/* ---- the document beside it ---- */

static size_t on_side(char *bytes, size_t unit, size_t count, void *context)
{
    struct side_look *look = context;
    size_t size = unit * count, room = sizeof look->body - 1 - look->body_bytes;

    if (size > room)
        return 0;
    memcpy(look->body + look->body_bytes, bytes, size);
    look->body_bytes += size;
    look->body[look->body_bytes] = '\0';
    return size;
}

/* Without memory there is none. */
static void side_begin(struct transfer *transfer)
{
    struct http_client *client = transfer->client;
    struct side_look *look = &transfer->look;

    if (!look->easy && (look->easy = curl_easy_init()) &&
        asprintf(&look->url, "%s%s", client->base_url, transfer->request->side->path) < 0)
        look->url = NULL;
    if (!look->url)
        return;
    look->body_bytes = 0;
    set_common(client, look->easy, look->url);
    curl_easy_setopt(look->easy, CURLOPT_WRITEFUNCTION, on_side);
    curl_easy_setopt(look->easy, CURLOPT_WRITEDATA, look);
    look->is_under_way = curl_multi_add_handle(client->multi, look->easy) == CURLM_OK;
}

static void side_end(struct transfer *transfer, CURLcode code)
{
    const struct http_side *side = transfer->request->side;
    struct side_look *look = &transfer->look;
    double now_s = clock_s(), pause_s = SIDE_SHARE * (now_s - look->begun_s);
    long status = 0;

    curl_easy_getinfo(look->easy, CURLINFO_RESPONSE_CODE, &status);
    curl_multi_remove_handle(transfer->client->multi, look->easy);
    look->is_under_way = false;
    look->due_s = now_s + (pause_s < SIDE_FIRST_S  ? SIDE_FIRST_S
                           : pause_s > SIDE_LAST_S ? SIDE_LAST_S
                                                   : pause_s);
    if (code == CURLE_OK && status == 200 && look->body_bytes && !transfer->is_coming)
        side->take(side->context, look->body);
}

static void side_step(struct transfer *transfer)
{
    struct side_look *look = &transfer->look;

    if (!transfer->request->side || look->is_under_way || transfer->is_coming)
        return;
    if (!look->begun_s) {
        look->begun_s = clock_s();
        look->due_s = look->begun_s + SIDE_FIRST_S;
    }
    if (clock_s() >= look->due_s)
        side_begin(transfer);
}

static void side_finish(struct transfer *transfer)
{
    struct side_look *look = &transfer->look;

    if (look->is_under_way)
        curl_multi_remove_handle(transfer->client->multi, look->easy);
    curl_easy_cleanup(look->easy);
    free(look->url);
    *look = (struct side_look){0};
}

/* Runs the transfer to its end; *code is libcurl's verdict. False: interrupted, late, or our own
 * failure. */
static bool transfer_run(struct transfer *transfer, CURLcode *code)
{
    struct http_client *client = transfer->client;
    struct curl_waitfd signals = {.fd = client->interrupt->fd, .events = CURL_WAIT_POLLIN};
    int running = 1, left;
    bool has_ended = false;

    while (!has_ended) {
        const CURLMsg *message;
        if (curl_multi_perform(client->multi, &running))
            return fail_no_memory(transfer->failure);
        while ((message = curl_multi_info_read(client->multi, &left)))
            if (message->msg == CURLMSG_DONE && message->easy_handle == client->easy) {
                *code = message->data.result;
                has_ended = true;
            } else if (message->msg == CURLMSG_DONE) {
                side_end(transfer, message->data.result);
            }
        if (has_ended)
            return true;
        side_step(transfer);
        if (!interrupt_check(client->interrupt, transfer->failure))
            return false;
        if (client->deadline_s > 0 && clock_s() >= client->deadline_s)
            return fail(transfer->failure, EXIT_CODE_TEMPORARY,
                        "%s did not finish in the time "
                        "given by --timeout",
                        client->shown_url);
        curl_multi_poll(client->multi, &signals, 1, POLL_MS, NULL);
    }
    return true;
}

static void copy_header(CURL *easy, const char *name, char *out, size_t capacity)
{
    struct curl_header *header;

    if (curl_easy_header(easy, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK)
        text_copy_printable(out, capacity, header->value);
}

static void read_head(struct transfer *transfer)
{
    CURL *easy = transfer->client->easy;
    struct http_reply *reply = transfer->reply;
    curl_off_t retry_after_s = 0;
    long status = 0;

    curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
    curl_easy_getinfo(easy, CURLINFO_RETRY_AFTER, &retry_after_s);
    reply->status = (int)status;
    reply->retry_after_s = retry_after_s > 86400 ? 86400 : (int)retry_after_s;
    copy_header(easy, "Content-Type", reply->content_type, sizeof reply->content_type);
    copy_header(easy, "Location", reply->location, sizeof reply->location);
    copy_header(easy, "Link", reply->link, sizeof reply->link);
}

static bool transfer_judge(struct transfer *transfer, CURLcode code)
{
    const char *url = transfer->client->shown_url;
    const char *why = transfer->curl_message[0] ? transfer->curl_message : curl_easy_strerror(code);

    read_head(transfer);
    switch (code) {
    case CURLE_OK:
        return true;
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_OPERATION_TIMEDOUT: /* only connecting has a time-out of libcurl's */
        return fail(transfer->failure, EXIT_CODE_UNAVAILABLE, "no server at %s: %s", url, why);
    case CURLE_SEND_ERROR: /* refused before the whole upload was read: the answer counts */
    case CURLE_RECV_ERROR:
        if (transfer->reply->status >= 400)
            return true;
        break;
    default:
        break;
    }
    return fail(transfer->failure, EXIT_CODE_TEMPORARY, "the connection to %s broke off: %s", url,
                why);
}

bool http_send(struct http_client *client, const struct http_request *request,
               struct http_reply *reply, struct failure *failure)
{
    struct transfer transfer = {
        .client = client, .request = request, .reply = reply, .failure = failure};
    CURLcode code = CURLE_OK;
    bool is_ok = false;

    *reply = (struct http_reply){0};
    if (transfer_prepare(&transfer)) {
        if (curl_multi_add_handle(client->multi, client->easy))
            fail_no_memory(failure);
        else
            is_ok = transfer_run(&transfer, &code) && transfer_judge(&transfer, code);
        side_finish(&transfer);
        curl_multi_remove_handle(client->multi, client->easy);
    }
    curl_easy_setopt(client->easy, CURLOPT_HTTPHEADER, NULL);
    curl_easy_setopt(client->easy, CURLOPT_MIMEPOST, NULL);
    curl_easy_setopt(client->easy, CURLOPT_ERRORBUFFER, NULL);
    curl_slist_free_all(transfer.headers);
    curl_mime_free(transfer.mime);
    if (transfer.body)
        fclose(transfer.body);
    free(transfer.url);
    if (!is_ok)
        http_reply_finish(reply);
    return is_ok;
}

bool http_ask(struct http_client *client, const struct http_request *request, const char *task,
              struct http_reply *reply, struct failure *failure)
{
    if (!http_send(client, request, reply, failure))
        return false;
    if (reply->status >= 200 && reply->status < 300)
        return true;
    fail_from_reply(failure, &(struct failure_reply){.task = task,
                                                     .status = reply->status,
                                                     .body = reply->body ? reply->body : "",
                                                     .body_bytes = reply->body_bytes,
                                                     .retry_after_s = reply->retry_after_s});
    http_reply_finish(reply);
    return false;
}
