/* SPDX-License-Identifier: MIT */
/* /v1/views/{id}/image: the exact image of a view. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/front/task_resources.h"
#include "server/http/negotiate.h"
#include "server/mapping/format_mapping.h"
#include "server/routes/route_query.h"
#include "server/routes/router.h"
#include "server/views/live.h"

/* A GET on its way: the exchange owns it. */
struct image_get {
    struct service *service;
    struct http_exchange *exchange;
    char id[VIEW_ID_BYTES];
    struct view_picture picture;
    char tag[IMAGE_TAG_BYTES]; /* as it is sent */
};

static void image_get_destroy(void *data)
{
    struct image_get *get = data;
    view_picture_finish(&get->picture);
    free(get);
}

/* ---- what is asked for ---- */

static bool read_output(const char *text, enum request_output *output, struct error *err)
{
    char list[96] = "";
    if (!text)
        return true;
    for (int i = 0; i < REQUEST_OUTPUT_COUNT; i++) {
        size_t used = strlen(list);
        if (strcmp(text, request_output_name(i)) == 0) {
            *output = (enum request_output)i;
            return true;
        }
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", request_output_name(i));
    }
    return error_set(err, ERROR_INVALID_REQUEST, "?aov=%.40s is none of: %s", text, list);
}

static bool read_format(const struct http_exchange *exchange, unsigned allowed,
                        enum image_format *format, struct error *err)
{
    const char *text = http_request_query(exchange, "format");
    if (!text)
        return negotiate_format(http_request_header(exchange, "Accept"), allowed, format, err);
    if (!image_format_from_name(text, format))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "?format=%.40s is none of: png, jpeg, webp, exr", text);
    return (allowed & 1u << *format) ||
           error_set(err, ERROR_UNSUPPORTED, "?format=%s cannot hold that output; use exr%s", text,
                     allowed & 1u << IMAGE_FORMAT_PNG ? " or png" : "");
}

static bool read_frame(const struct http_exchange *exchange, struct view_frame_desc *frame,
                       enum image_format *format, struct error *err)
{
    static const char *const known[] = {"aov", "format", "quality_percent", NULL};
    if (!http_request_check_query(exchange, known, err) ||
        !read_output(http_request_query(exchange, "aov"), &frame->output, err) ||
        !read_format(exchange, frame_image_formats(1u << frame->output), format, err) ||
        !query_int(exchange, "quality_percent", 1, 100, &frame->quality_percent, err))
        return false;
    frame->format = request_format_of_image(*format);
    bool is_lossless = *format == IMAGE_FORMAT_PNG || *format == IMAGE_FORMAT_EXR;
    if (is_lossless && frame->quality_percent && http_request_query(exchange, "format"))
        return error_set(err, ERROR_INVALID_REQUEST, "?quality_percent=%d, but %s is lossless",
                         frame->quality_percent, image_format_name(*format));
    if (is_lossless)
        frame->quality_percent = 0;
    return true;
}

/* ---- the reply ---- */

static void add_headers(struct image_get *get)
{
    struct http_exchange *exchange = get->exchange;
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    http_reply_header(exchange, "Vary", "Accept");
    http_reply_header(exchange, "X-View-Revision", "%llu",
                      (unsigned long long)get->picture.revision);
}

/* On a thread of the supervisor, or of who asked or cancelled. */
static void made(void *context, struct view_image *image, enum view_image_source source,
                 const struct error *problem)
{
    struct image_get *get = context;
    struct http_exchange *exchange = get->exchange;
    int fd = image ? dup(image->fd) : -1;
    struct error failure = *problem;
    if (image && fd < 0)
        error_set(&failure, ERROR_NO_MEMORY, "a descriptor for the image");
    if (fd < 0) {
        http_reply_error(exchange, &failure);
        http_resume(exchange);
        return;
    }
    if (source == VIEW_IMAGE_RENDERED)
        live_note_image(get->service->views, get->id, get->picture.revision, image);
    add_headers(get);
    http_reply_header(exchange, "Server-Timing", "%s", image->timing);
    http_reply_header(exchange, "Link", "</v1/frames/%s>; rel=\"describedby\"", image->frame);
    const struct made_image shown = {get->picture.digest, image->drawn, image->worker};
    if (service_tag_image(get->service, &shown, get->tag) &&
        reply_if_unchanged(exchange, get->tag)) {
        close(fd);
        views_count_not_modified(get->service->views);
    } else {
        http_reply_fd(exchange, 200, image_format_media_type(image->format), fd, image->size_bytes);
    }
    http_resume(exchange);
}

static void client_left(void *context, uint64_t ticket)
{
    view_images_cancel(context, ticket);
}

static struct image_get *image_get_create(struct service *service, struct http_exchange *exchange,
                                          const char *id, struct error *err)
{
    struct image_get *get = calloc(1, sizeof *get);
    if (!get) {
        error_set(err, ERROR_NO_MEMORY, "image");
        return NULL;
    }
    get->service = service;
    get->exchange = exchange;
    memcpy(get->id, id, strnlen(id, sizeof get->id - 1));
    route_attach(exchange, get, image_get_destroy);
    return get;
}

static void run_image(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct view_frame_desc frame = {0};
    enum image_format format;
    struct image_get *get = image_get_create(service, exchange, id, &problem);
    if (!get || !read_frame(exchange, &frame, &format, &problem) ||
        !views_describe_frame(service->views, id, &frame, &get->picture, &problem) ||
        !task_has_resources(&service->resources, get->picture.scene, &get->picture.resources,
                            &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    if (service_find_tag(service, get->picture.digest, get->picture.has_target, get->tag) &&
        negotiate_tag_matches(http_request_header(exchange, "If-None-Match"), get->tag)) {
        views_count_not_modified(service->views);
        add_headers(get);
        reply_if_unchanged(exchange, get->tag);
        return;
    }
    struct view_image_request request = {
        .scene = get->picture.scene,
        .resources = &get->picture.resources,
        .text = get->picture.text,
        .tag = get->picture.tag,
        .format = format,
        .priority = image_priority(http_request_header(exchange, "Priority")),
        .request_id = http_request_id(exchange),
        .view = get->id,
        .revision = get->picture.revision,
        .home = get->picture.home,
        .offer = get->picture.offer,
        .context = get,
        .done = made};
    uint64_t ticket = view_images_next_ticket(service->view_images);
    http_wait(exchange, client_left, service->view_images, ticket);
    view_images_ask(service->view_images, &request, ticket);
}

const struct route routes_view_images[] = {
    {"/v1/views/{id}/image", {{HTTP_GET, NULL, run_image}}},
    {0},
};
