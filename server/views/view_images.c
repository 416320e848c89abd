/* SPDX-License-Identifier: MIT */
/* A table of what is being made and a list of what was, both by entity tag. */
#include "server/views/view_images.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/task_resources.h"

/* Somebody who asked. */
struct waiter {
    struct waiter *next;
    uint64_t ticket;
    const char *request_id; /* borrowed while it waits; NULL: none */
    enum view_image_source source;
    void *context;
    void (*done)(void *context, struct view_image *image, enum view_image_source source,
                 const struct error *problem);
};

/* An image that is being made. */
struct making {
    struct making *next;
    struct view_images *images;
    char tag[IMAGE_TAG_BYTES];
    char view[FRAME_ID_BYTES];
    uint64_t revision;
    enum image_format format;
    bool is_moving;
    uint64_t render; /* ticket of the supervisor */
    double asked_ms;
    struct waiter *waiters;
};

struct kept {
    char tag[IMAGE_TAG_BYTES];
    struct view_image *image;
};

struct view_images {
    struct view_images_desc desc;
    pthread_mutex_t mutex;
    struct making *making;
    struct kept kept[LIMIT_VIEW_IMAGES_KEPT]; /* the last used first */
    size_t kept_count;
    uint64_t next_ticket;
    struct view_images_totals totals;
};

/* ---- images ---- */

struct view_image *view_image_hold(struct view_image *image)
{
    atomic_fetch_add(&image->references, 1);
    return image;
}

void view_image_release(struct view_image *image)
{
    if (!image || atomic_fetch_sub(&image->references, 1) > 1)
        return;
    if (image->bytes)
        munmap((void *)(uintptr_t)image->bytes, image->size_bytes);
    if (image->fd >= 0)
        close(image->fd);
    free(image->stats);
    free(image);
}

static bool map_image(struct view_image *image, struct error *err)
{
    struct stat found;
    if (fstat(image->fd, &found) != 0 || found.st_size <= 0)
        return error_set(err, ERROR_INTERNAL, "the image of the worker cannot be read");
    image->size_bytes = (size_t)found.st_size;
    void *bytes = mmap(NULL, image->size_bytes, PROT_READ, MAP_SHARED, image->fd, 0);
    if (bytes == MAP_FAILED)
        return error_set(err, ERROR_NO_MEMORY, "an image of %zu bytes", image->size_bytes);
    image->bytes = bytes;
    return true;
}

/* Takes the outcome's descriptor. NULL on failure. */
static struct view_image *make_image(const struct making *making, struct render_outcome *outcome,
                                     struct error *err)
{
    const struct view_images_desc *desc = &making->images->desc;
    struct frame_stats *stats = outcome->stats;
    struct view_image *image = calloc(1, sizeof *image);
    if (!image) {
        error_set(err, ERROR_NO_MEMORY, "image");
        return NULL;
    }
    atomic_init(&image->references, 1);
    image->fd = outcome->image_fd;
    outcome->image_fd = -1;
    image->format = making->format;
    memcpy(image->drawn, outcome->drawn, sizeof image->drawn);
    image->worker = outcome->worker;
    if (!map_image(image, err) || !frames_make_id(image->frame, err)) {
        view_image_release(image);
        return NULL;
    }
    memcpy(stats->id, image->frame, sizeof image->frame);
    memcpy(stats->view, making->view, sizeof making->view);
    stats->revision = making->revision;
    image->cost_ms = stats->timings_ms[FRAME_TIMING_TOTAL] + stats->timings_ms[FRAME_TIMING_ENCODE];
    frame_stats_close(stats, outcome->queue_ms, now_fine_ms() - making->asked_ms);
    image->queue_ms = stats->timings_ms[FRAME_TIMING_QUEUE];
    image->total_ms = stats->timings_ms[FRAME_TIMING_TOTAL];
    image->width_px = stats->width;
    image->height_px = stats->height;
    frame_stats_server_timing(stats, image->timing, sizeof image->timing);
    image->stats = frame_stats_to_json_text(stats);
    frames_add(desc->frames, image->frame, image->stats ? strdup(image->stats) : NULL);
    metrics_count_frame(desc->metrics, stats);
    resource_store_note_use(desc->resources->scenes, stats->scene);
    return image;
}

/* ---- what is kept; all under the mutex ---- */

static void move_to_front(struct view_images *images, size_t index)
{
    struct kept found = images->kept[index];
    memmove(images->kept + 1, images->kept, index * sizeof found);
    images->kept[0] = found;
}

static struct view_image *find_kept(struct view_images *images, const char *tag)
{
    for (size_t i = 0; i < images->kept_count; i++)
        if (strcmp(images->kept[i].tag, tag) == 0) {
            move_to_front(images, i);
            return images->kept[0].image;
        }
    return NULL;
}

static void forget_last(struct view_images *images)
{
    struct view_image *last = images->kept[--images->kept_count].image;
    images->totals.held_bytes -= last->size_bytes;
    view_image_release(last);
}

static void keep(struct view_images *images, const char *tag, struct view_image *image)
{
    if (image->size_bytes > LIMIT_VIEW_IMAGES_BYTES || find_kept(images, tag))
        return;
    while (images->kept_count > 0 &&
           (images->kept_count == LIMIT_VIEW_IMAGES_KEPT ||
            images->totals.held_bytes + image->size_bytes > LIMIT_VIEW_IMAGES_BYTES))
        forget_last(images);
    struct kept *slot = &images->kept[images->kept_count++];
    memcpy(slot->tag, tag, sizeof slot->tag);
    slot->image = view_image_hold(image);
    images->totals.held_bytes += image->size_bytes;
    move_to_front(images, images->kept_count - 1);
}

/* ---- making ---- */

static void unlink_making(struct view_images *images, const struct making *making)
{
    for (struct making **at = &images->making; *at; at = &(*at)->next)
        if (*at == making) {
            *at = making->next;
            return;
        }
}

/* Takes the image, which is NULL on failure. */
static void complete(struct making *making, struct view_image *image, const struct error *problem)
{
    struct view_images *images = making->images;
    pthread_mutex_lock(&images->mutex);
    unlink_making(images, making);
    images->totals.rendered += image != NULL;
    if (image && !making->is_moving)
        keep(images, making->tag, image);
    pthread_mutex_unlock(&images->mutex);
    for (struct waiter *waiter = making->waiters, *next; waiter; waiter = next) {
        next = waiter->next;
        waiter->done(waiter->context, image, waiter->source, problem);
        free(waiter);
    }
    view_image_release(image);
    free(making);
}

/* On a thread of the supervisor, or of who cancelled. */
static void rendered(void *context, struct render_outcome *outcome)
{
    struct making *making = context;
    struct error problem = outcome->problem;
    struct view_image *image =
        problem.code == ERROR_NONE ? make_image(making, outcome, &problem) : NULL;
    complete(making, image, &problem);
}

static struct render_task *make_task(struct view_images *images,
                                     const struct view_image_request *request, struct error *err)
{
    struct render_task *task = render_task_create();
    if (!task) {
        error_set(err, ERROR_NO_MEMORY, "render");
        return NULL;
    }
    memcpy(task->scene, request->scene, sizeof task->scene);
    task->format = request->format;
    task->priority = request->priority;
    task->home = request->home;
    task->expects_reuse = true;
    task->may_be_coarse = request->is_moving;
    task->done = rendered;
    task->offer = json_incref(request->offer);
    if (task_open_resources(task, images->desc.resources, request->resources, err))
        task->request_fd =
            ipc_memfd_create("vitrail-request", request->text, strlen(request->text), err);
    if (task->request_fd >= 0)
        return task;
    render_task_destroy(task);
    return NULL;
}

static struct making *making_create(struct view_images *images,
                                    const struct view_image_request *request)
{
    struct making *making = calloc(1, sizeof *making);
    if (!making)
        return NULL;
    *making = (struct making){.images = images,
                              .revision = request->revision,
                              .format = request->format,
                              .is_moving = request->is_moving,
                              .render = supervisor_next_ticket(images->desc.supervisor),
                              .asked_ms = now_fine_ms()};
    memcpy(making->tag, request->tag, sizeof making->tag);
    if (request->view)
        memcpy(making->view, request->view, strnlen(request->view, sizeof making->view - 1));
    return making;
}

/* Under the mutex. Joins what is being made; false when nothing equal is. Afterwards the request's
 * strings may be gone, since it may be completed at any time. */
static bool join(struct view_images *images, const struct view_image_request *request,
                 struct waiter *waiter)
{
    struct making *found = images->making;
    while (found && (strcmp(found->tag, request->tag) != 0 ||
                     (found->is_moving && !request->is_moving))) /* it may be coarse */
        found = found->next;
    if (!found)
        return false;
    images->totals.shared++;
    waiter->source = VIEW_IMAGE_SHARED;
    waiter->next = found->waiters;
    found->waiters = waiter;
    return true;
}

/* Nothing equal was there a moment ago: renders it, unless somebody began meanwhile. */
static void make(struct view_images *images, const struct view_image_request *request,
                 struct waiter *waiter)
{
    struct error problem = {0};
    struct making *making = making_create(images, request);
    struct render_task *task = making ? make_task(images, request, &problem) : NULL;
    if (!task) {
        error_set(&problem, ERROR_NO_MEMORY, "image");
        free(making);
        waiter->done(waiter->context, NULL, VIEW_IMAGE_RENDERED, &problem);
        free(waiter);
        return;
    }
    task->context = making;
    task->ticket = making->render;
    pthread_mutex_lock(&images->mutex);
    bool has_joined = join(images, request, waiter);
    if (!has_joined) {
        making->waiters = waiter;
        making->next = images->making;
        images->making = making;
    }
    pthread_mutex_unlock(&images->mutex);
    if (!has_joined && supervisor_submit(images->desc.supervisor, task, &problem))
        return;
    render_task_destroy(task);
    if (has_joined)
        free(making);
    else
        complete(making, NULL, &problem);
}

void view_images_ask(struct view_images *images, const struct view_image_request *request,
                     uint64_t ticket)
{
    struct waiter *waiter = calloc(1, sizeof *waiter);
    if (!waiter) {
        struct error problem = {ERROR_NO_MEMORY, "image", ""};
        request->done(request->context, NULL, VIEW_IMAGE_RENDERED, &problem);
        return;
    }
    *waiter = (struct waiter){.ticket = ticket,
                              .request_id = request->request_id,
                              .context = request->context,
                              .done = request->done};
    pthread_mutex_lock(&images->mutex);
    struct view_image *image = find_kept(images, request->tag);
    bool has_joined = !image && join(images, request, waiter);
    if (image) {
        view_image_hold(image);
        images->totals.kept++;
    }
    pthread_mutex_unlock(&images->mutex);
    if (image) {
        waiter->done(waiter->context, image, VIEW_IMAGE_KEPT, &(struct error){0});
        view_image_release(image);
        free(waiter);
    } else if (!has_joined) {
        make(images, request, waiter);
    }
}

uint64_t view_images_next_ticket(struct view_images *images)
{
    pthread_mutex_lock(&images->mutex);
    uint64_t ticket = ++images->next_ticket;
    pthread_mutex_unlock(&images->mutex);
    return ticket;
}

bool view_images_get_progress(struct view_images *images, uint64_t ticket,
                              struct job_progress *progress)
{
    uint64_t render = 0;
    pthread_mutex_lock(&images->mutex);
    for (const struct making *making = images->making; making; making = making->next)
        for (const struct waiter *waiter = making->waiters; waiter; waiter = waiter->next)
            if (waiter->ticket == ticket)
                render = making->render;
    pthread_mutex_unlock(&images->mutex);
    return render && supervisor_get_progress(images->desc.supervisor, render, progress);
}

uint64_t view_images_find_render(struct view_images *images, const char *request_id)
{
    uint64_t newest = 0, render = 0;
    pthread_mutex_lock(&images->mutex);
    for (const struct making *making = images->making; making; making = making->next)
        for (const struct waiter *waiter = making->waiters; waiter; waiter = waiter->next)
            if (waiter->request_id && strcmp(waiter->request_id, request_id) == 0 &&
                waiter->ticket > newest) {
                newest = waiter->ticket;
                render = making->render;
            }
    pthread_mutex_unlock(&images->mutex);
    return render;
}

static struct waiter *take_waiter(struct making *making, uint64_t ticket)
{
    for (struct waiter **at = &making->waiters; *at; at = &(*at)->next)
        if ((*at)->ticket == ticket) {
            struct waiter *found = *at;
            *at = found->next;
            return found;
        }
    return NULL;
}

void view_images_cancel(struct view_images *images, uint64_t ticket)
{
    struct waiter *found = NULL;
    uint64_t unwanted = 0;
    pthread_mutex_lock(&images->mutex);
    for (struct making *making = images->making, *next; making && !found; making = next) {
        next = making->next;
        found = take_waiter(making, ticket);
        if (found && !making->waiters) {
            unwanted = making->render;
            unlink_making(images, making); /* so that nobody joins what is about to be cancelled */
        }
    }
    pthread_mutex_unlock(&images->mutex);
    if (!found)
        return;
    struct error problem = {ERROR_OVERLOADED, "the client left before its turn", ""};
    found->done(found->context, NULL, found->source, &problem);
    free(found);
    if (unwanted)
        supervisor_cancel(images->desc.supervisor, unwanted);
}

/* ---- life ---- */

struct view_images *view_images_create(const struct view_images_desc *desc, struct error *err)
{
    struct view_images *images = calloc(1, sizeof *images);
    if (!images) {
        error_set(err, ERROR_NO_MEMORY, "images of views");
        return NULL;
    }
    images->desc = *desc;
    pthread_mutex_init(&images->mutex, NULL);
    return images;
}

void view_images_destroy(struct view_images *images)
{
    if (!images)
        return;
    while (images->kept_count > 0)
        forget_last(images);
    pthread_mutex_destroy(&images->mutex);
    free(images);
}

struct view_images_totals view_images_get_totals(struct view_images *images)
{
    pthread_mutex_lock(&images->mutex);
    struct view_images_totals totals = images->totals;
    totals.held = images->kept_count;
    pthread_mutex_unlock(&images->mutex);
    return totals;
}
