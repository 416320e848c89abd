/* SPDX-License-Identifier: MIT */
/* /v1/views/{id}/pick: what is at a point of a view's image, or in a rectangle of it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "server/base/ipc.h"
#include "server/front/task_resources.h"
#include "server/mapping/questions.h"
#include "server/routes/route_query.h"
#include "server/routes/router.h"

/* A GET on its way: the exchange owns it. */
struct pick_get {
    struct service *service;
    struct http_exchange *exchange;
    char id[VIEW_ID_BYTES];
    struct pick_desc desc;
    struct view_picture picture;
};

static void pick_get_destroy(void *data)
{
    struct pick_get *get = data;
    view_picture_finish(&get->picture);
    free(get);
}

/* ---- the reply ---- */

static json_t *reply_head(const struct pick_get *get)
{
    json_t *head = json_pack("{s:s,s:I,s:f,s:f}", "view", get->id, "revision",
                             (json_int_t)get->picture.revision, "x", get->desc.x, "y", get->desc.y);
    if (get->desc.width > 0) {
        json_object_set_new(head, "width", json_integer(get->desc.width));
        json_object_set_new(head, "height", json_integer(get->desc.height));
    }
    return head;
}

static json_t *reply_of(const struct pick_get *get, int fd, struct error *err)
{
    struct ipc_mapping text = {0};
    if (!ipc_mapping_init(&text, fd, err))
        return NULL;
    json_t *reply = reply_head(get), *found = json_loadb(text.bytes, text.size_bytes, 0, NULL);
    ipc_mapping_finish(&text);
    bool is_good = found && json_object_update(reply, found) == 0;
    json_decref(found);
    if (is_good)
        return reply;
    json_decref(reply);
    error_set(err, ERROR_INTERNAL, "the answer of the worker cannot be read");
    return NULL;
}

/* On a thread of the supervisor, or of who cancelled. */
static void picked(void *context, struct render_outcome *outcome)
{
    struct pick_get *get = context;
    struct error problem = outcome->problem;
    json_t *reply = problem.code == ERROR_NONE ? reply_of(get, outcome->image_fd, &problem) : NULL;
    if (reply) {
        http_reply_header(get->exchange, "X-View-Revision", "%llu",
                          (unsigned long long)get->picture.revision);
        reply_json(get->exchange, 200, reply);
    } else {
        http_reply_error(get->exchange, &problem);
    }
    http_resume(get->exchange);
}

/* ---- the request ---- */

static bool read_query(const struct http_exchange *exchange, struct pick_desc *desc,
                       struct error *err)
{
    static const char *const known[] = {"x", "y", "width", "height", "through", NULL};
    int through = 0;
    if (!http_request_check_query(exchange, known, err))
        return false;
    if (!http_request_query(exchange, "x") || !http_request_query(exchange, "y"))
        return error_set(err, ERROR_INVALID_REQUEST, "the query needs x and y");
    if (!query_number(exchange, "x", 0, LIMIT_IMAGE_SIDE_PX, &desc->x, err) ||
        !query_number(exchange, "y", 0, LIMIT_IMAGE_SIDE_PX, &desc->y, err) ||
        !query_int(exchange, "width", 1, LIMIT_IMAGE_SIDE_PX, &desc->width, err) ||
        !query_int(exchange, "height", 1, LIMIT_IMAGE_SIDE_PX, &desc->height, err) ||
        !query_int(exchange, "through", 0, 1, &through, err))
        return false;
    desc->is_through = through;
    if ((desc->width > 0) != (desc->height > 0))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "a rectangle needs both width and height in the query");
    return true;
}

static int clipped(double first, int count, int side)
{
    return first + count > side ? side - (int)first : count;
}

/* Against the size of the picture. */
static bool fit(struct pick_desc *desc, const struct view_picture *picture, struct error *err)
{
    bool is_rectangle = desc->width > 0;
    if (desc->x > picture->width_px || desc->y > picture->height_px ||
        (is_rectangle && (desc->x == picture->width_px || desc->y == picture->height_px)))
        return error_set(err, ERROR_INVALID_REQUEST, "%.9g, %.9g is outside the image of %d x %d",
                         desc->x, desc->y, picture->width_px, picture->height_px);
    if (!is_rectangle)
        return true;
    if (desc->x != floor(desc->x) || desc->y != floor(desc->y))
        return error_set(err, ERROR_INVALID_REQUEST, "a rectangle begins at a whole pixel");
    desc->width = clipped(desc->x, desc->width, picture->width_px);
    desc->height = clipped(desc->y, desc->height, picture->height_px);
    return (long long)desc->width * desc->height <= LIMIT_PICK_PIXELS ||
           error_set(err, ERROR_TOO_LARGE, "a rectangle of %d x %d has more than %d pixels",
                     desc->width, desc->height, LIMIT_PICK_PIXELS);
}

static struct render_task *make_task(struct pick_get *get, struct error *err)
{
    struct render_task *task = render_task_create();
    if (!task) {
        error_set(err, ERROR_NO_MEMORY, "pick");
        return NULL;
    }
    memcpy(task->scene, get->picture.scene, sizeof task->scene);
    task->question = pick_make_step(&get->desc);
    task->priority = RENDER_INTERACTIVE;
    task->home = get->picture.home;
    task->context = get;
    task->done = picked;
    task->ticket = supervisor_next_ticket(get->service->supervisor);
    if (task_open_resources(task, &get->service->resources, &get->picture.resources, err))
        task->request_fd =
            ipc_memfd_create("vitrail-request", get->picture.text, strlen(get->picture.text), err);
    if (task->request_fd >= 0 && task->question)
        return task;
    error_set(err, ERROR_NO_MEMORY, "pick");
    render_task_destroy(task);
    return NULL;
}

static struct pick_get *prepare(struct service *service, struct http_exchange *exchange,
                                const char *id, struct error *err)
{
    const struct view_frame_desc frame = {.output = REQUEST_OUTPUT_COLOR,
                                          .format = REQUEST_FORMAT_PNG};
    struct pick_get *get = calloc(1, sizeof *get);
    if (!get) {
        error_set(err, ERROR_NO_MEMORY, "pick");
        return NULL;
    }
    get->service = service;
    get->exchange = exchange;
    memcpy(get->id, id, strnlen(id, sizeof get->id - 1));
    route_attach(exchange, get, pick_get_destroy);
    return read_query(exchange, &get->desc, err) &&
                   views_describe_frame(service->views, id, &frame, &get->picture, err) &&
                   fit(&get->desc, &get->picture, err)
               ? get
               : NULL;
}

static void run_pick(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct pick_get *get = prepare(service, exchange, id, &problem);
    struct render_task *task = get ? make_task(get, &problem) : NULL;
    if (!task) {
        http_reply_error(exchange, &problem);
        return;
    }
    reply_by_worker(service, exchange, task);
}

const struct route routes_view_pick[] = {
    {"/v1/views/{id}/pick", {{HTTP_GET, NULL, run_pick}}},
    {0},
};
