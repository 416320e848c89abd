/* SPDX-License-Identifier: MIT */
/* Decides which frames of a watched view are rendered, when, and at which scale. */
#include "server/views/live.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "server/base/clock.h"
#include "server/views/views_internal.h"

enum {
    BEAT_MS = 15000,
    PROGRESS_FIRST_MS = 500, /* the worker tells of no quicker frame */
    PROGRESS_EVERY_MS = 250,
};

static const double FIRST_SCALE = 0.5;

/* ---- frames ---- */

static void show(struct live_frame *slot, const struct live_frame *frame)
{
    view_image_release(slot->image);
    *slot = *frame;
    view_image_hold(slot->image);
}

static void take_frame(const struct live_frame *from, struct live_frame *to)
{
    *to = *from;
    view_image_hold(to->image);
}

/* A view that nobody watches holds no images. */
static void forget_frames(struct live *live)
{
    view_image_release(live->newest.image);
    view_image_release(live->noted.image);
    live->newest.image = live->noted.image = NULL;
    live->tried_revision = 0;
    live->tried = live->under = LIVE_NONE;
}

void live_finish(struct live *live)
{
    forget_frames(live);
}

/* ---- making frames ---- */

static void count_frame(struct views_totals *totals, enum live_kind kind)
{
    totals->moving_frames += kind == LIVE_MOVING;
    totals->exact_frames += kind == LIVE_EXACT;
    totals->refined_frames += kind == LIVE_REFINED;
}

static void frame_done(void *context, struct view_image *image, enum view_image_source source,
                       const struct error *problem)
{
    struct launch *launch = context;
    struct view *view = launch->view;
    struct views *views = view->views;
    struct live *live = &view->live;
    pthread_mutex_lock(&views->mutex);
    bool is_unwanted = live->is_unwanted && !image;
    if (!is_unwanted) {
        live->tried_revision = live->pending_revision;
        live->tried = image || launch->kind == LIVE_MOVING ? launch->kind : LIVE_REFINED;
    }
    if (image && source == VIEW_IMAGE_RENDERED)
        view->home = image->worker;
    live->pending = LIVE_NONE;
    live->progress = (struct job_progress){0};
    live->is_unwanted = false;
    live->shown_ms = now_ms();
    if (image && live->watcher_count > 0) {
        show(&live->newest, &(struct live_frame){.image = image,
                                                 .number = ++live->frame_number,
                                                 .revision = live->pending_revision,
                                                 .is_exact = launch->kind >= LIVE_EXACT,
                                                 .is_refined = launch->kind == LIVE_REFINED,
                                                 .scale = live->pending_scale});
        count_frame(&views->totals, launch->kind);
        const struct view_stream *stream = view_document_stream(view->document);
        if (launch->kind == LIVE_MOVING)
            live->scale = live_scale_next(&live->costs, live->pending_scale, image->cost_ms,
                                          stream->budget_ms, stream->min_scale);
    } else if (!image && !is_unwanted) {
        live->problem = *problem;
        live->problem_number++;
        views->totals.failed_frames++;
    }
    live_tell(view);
    views_poke(views);
    view_release(view);
    pthread_mutex_unlock(&views->mutex);
    view_picture_finish(&launch->picture);
    free(launch);
}

static enum image_format image_format_of(enum request_format format)
{
    return format == REQUEST_FORMAT_JPEG   ? IMAGE_FORMAT_JPEG
           : format == REQUEST_FORMAT_WEBP ? IMAGE_FORMAT_WEBP
                                           : IMAGE_FORMAT_PNG;
}

/* Under the mutex. */
static struct launch *prepare(struct view *view, enum live_kind kind)
{
    const struct view_stream *stream = view_document_stream(view->document);
    struct live *live = &view->live;
    struct error problem = {0};
    struct launch *launch = calloc(1, sizeof *launch);
    bool is_exact = kind >= LIVE_EXACT;
    enum request_format format = is_exact ? stream->rest_format : stream->format;
    double scale = is_exact ? 1 : fmax(fmin(live->scale, 1), stream->min_scale);
    int percent = format == REQUEST_FORMAT_PNG ? 0 : is_exact ? 100 : stream->quality_percent;
    if (!launch ||
        !view_describe_frame(view,
                             &(struct view_frame_desc){.output = REQUEST_OUTPUT_COLOR,
                                                       .format = format,
                                                       .quality_percent = percent,
                                                       .scale = scale,
                                                       .is_moving = !is_exact,
                                                       .is_refined = kind == LIVE_REFINED},
                             &launch->picture, &problem)) {
        free(launch); /* no memory: the next look tries again */
        return NULL;
    }
    launch->view = view;
    launch->kind = kind;
    launch->format = image_format_of(format);
    view->references++;
    live->pending = kind;
    live->pending_revision = view->revision;
    live->pending_scale = scale;
    live->progress_ms = now_ms() + PROGRESS_FIRST_MS;
    live->pending_ticket = launch->ticket = view_images_next_ticket(view->views->desc.images);
    return launch;
}

/* Cancels the pending exact or refined frame, because the view has changed since. Under the mutex.
 */
static struct launch *cancel_exact(struct view *view)
{
    struct live *live = &view->live;
    struct launch *launch = calloc(1, sizeof *launch);
    if (!launch)
        return NULL;
    live->is_unwanted = true;
    launch->view = view;
    launch->unwanted = live->pending_ticket;
    view->references++;
    return launch;
}

static void cancel(struct launch *launch)
{
    struct views *views = launch->view->views;
    view_images_cancel(views->desc.images, launch->unwanted);
    pthread_mutex_lock(&views->mutex);
    view_release(launch->view);
    pthread_mutex_unlock(&views->mutex);
    free(launch);
}

/* What others see for the first time goes before what is seen once more, and better. */
static enum render_priority priority_of(enum live_kind kind)
{
    return kind == LIVE_MOVING  ? RENDER_INTERACTIVE
           : kind == LIVE_EXACT ? RENDER_NORMAL
                                : RENDER_BATCH;
}

void live_launch(struct launch *launch)
{
    if (launch->unwanted) {
        cancel(launch);
        return;
    }
    struct view_images *images = launch->view->views->desc.images;
    struct view_picture *picture = &launch->picture;
    view_images_ask(images,
                    &(struct view_image_request){.scene = picture->scene,
                                                 .resources = &picture->resources,
                                                 .text = picture->text,
                                                 .tag = picture->tag,
                                                 .format = launch->format,
                                                 .priority = priority_of(launch->kind),
                                                 .home = picture->home,
                                                 .view = launch->view->id,
                                                 .revision = picture->revision,
                                                 .is_moving = launch->kind == LIVE_MOVING,
                                                 .offer = picture->offer,
                                                 .context = launch,
                                                 .done = frame_done},
                    launch->ticket);
}

static void sooner(int64_t *until_ms, int64_t ms)
{
    if (ms < *until_ms)
        *until_ms = ms;
}

static void beat(struct view *view, int64_t now_ms, int64_t *until_ms)
{
    for (struct watcher *watcher = view->live.watchers; watcher; watcher = watcher->next) {
        if (now_ms - watcher->beat_ms >= BEAT_MS) {
            watcher->beat_ms = now_ms;
            watcher->is_beat_due = true;
            watcher->desc.notify(watcher->desc.context);
        }
        sooner(until_ms, watcher->beat_ms + BEAT_MS);
    }
}

/* Notifies the watchers of a long frame of its progress. */
static void look_at_progress(struct view *view, int64_t now_ms, int64_t *until_ms)
{
    struct live *live = &view->live;
    struct job_progress progress;
    if (now_ms >= live->progress_ms) {
        live->progress_ms = now_ms + PROGRESS_EVERY_MS;
        if (view_images_get_progress(view->views->desc.images, live->pending_ticket, &progress) &&
            (progress.share != live->progress.share ||
             strcmp(progress.stage, live->progress.stage) != 0)) {
            live->progress = progress;
            live->progress_number++;
            live_tell(view);
        }
    }
    sooner(until_ms, live->progress_ms);
}

/* By somebody who has had that frame. */
static bool is_wanted_after(const struct live *live, uint64_t frame_number)
{
    for (const struct watcher *watcher = live->watchers; watcher; watcher = watcher->next)
        if (watcher->is_waiting && !watcher->desc.is_passive && watcher->seen_frame >= frame_number)
            return true;
    return false;
}

void live_note_patch(struct view *view, bool is_over)
{
    struct live *live = &view->live;
    if (!is_over)
        live->under = LIVE_NONE;
    else if (live->tried >= LIVE_EXACT && live->tried_revision == view->revision)
        live->under = live->tried;
}

/* Of the first frame after a change. */
static enum live_kind next_kind(const struct view *view)
{
    enum live_kind under = view->live.under;
    if (under == LIVE_NONE)
        return LIVE_MOVING;
    return under == LIVE_REFINED && view_document_refines(view->document) ? LIVE_REFINED
                                                                          : LIVE_EXACT;
}

struct launch *live_step(struct view *view, int64_t now_ms, int64_t *until_ms)
{
    struct live *live = &view->live;
    beat(view, now_ms, until_ms);
    if (live->pending != LIVE_NONE && live->watcher_count > 0)
        look_at_progress(view, now_ms, until_ms);
    if (live->pending >= LIVE_EXACT && live->pending_revision != view->revision &&
        !live->is_unwanted)
        return cancel_exact(view);
    if (live->active_count == 0 || live->pending != LIVE_NONE || !is_wanted_after(live, 0))
        return NULL;
    if (live->tried_revision != view->revision)
        /* the picture under what has changed stands, and a smaller one would gain nothing */
        return prepare(view, next_kind(view));
    if (live->tried >= LIVE_EXACT)
        return live->tried == LIVE_EXACT && view_document_refines(view->document) &&
                       is_wanted_after(live, live->frame_number)
                   ? prepare(view, LIVE_REFINED)
                   : NULL;
    /* Counted from the last frame, too: a client that moves on as soon as it sees one is not at
     * rest while it waits for it. */
    int64_t since_ms = view->changed_ms > live->shown_ms ? view->changed_ms : live->shown_ms;
    int64_t due_ms = since_ms + view_document_stream(view->document)->rest_ms;
    if (now_ms >= due_ms)
        return prepare(view, LIVE_EXACT);
    sooner(until_ms, due_ms);
    return NULL;
}

void live_tell(struct view *view)
{
    for (struct watcher *watcher = view->live.watchers; watcher; watcher = watcher->next)
        watcher->desc.notify(watcher->desc.context);
}

void live_note_image(struct views *views, const char *id, uint64_t revision,
                     struct view_image *image)
{
    pthread_mutex_lock(&views->mutex);
    for (struct view *view = views->oldest; view; view = view->next) {
        if (strcmp(view->id, id) != 0)
            continue;
        struct live *live = &view->live;
        view->home = image->worker;
        if (live->watcher_count > live->active_count) {
            show(&live->noted, &(struct live_frame){.image = image,
                                                    .number = live->noted.number + 1,
                                                    .revision = revision,
                                                    .is_exact = true,
                                                    .scale = 1});
            live_tell(view);
        }
    }
    pthread_mutex_unlock(&views->mutex);
}

/* ---- watchers ---- */

/* Under the mutex. */
static bool may_watch(const struct views *views, const struct view *view, struct error *err)
{
    int most = views->desc.config->connections / 2;
    if (view->live.watcher_count >= LIMIT_VIEW_WATCHERS)
        return error_set(err, ERROR_OVERLOADED, "%d watch this view, which is the limit",
                         LIMIT_VIEW_WATCHERS);
    return views->watcher_count < most ||
           error_set(err, ERROR_OVERLOADED, "%d watch views, which is half of all connections",
                     most);
}

struct watcher *watcher_create(struct views *views, const struct watcher_desc *desc,
                               struct error *err)
{
    struct watcher *watcher = calloc(1, sizeof *watcher);
    if (!watcher) {
        error_set(err, ERROR_NO_MEMORY, "watcher");
        return NULL;
    }
    pthread_mutex_lock(&views->mutex);
    struct view *view = views_find(views, desc->view, err);
    bool is_good = view && may_watch(views, view, err);
    if (is_good) {
        struct live *live = &view->live;
        *watcher = (struct watcher){
            .next = live->watchers, .view = view, .desc = *desc, .beat_ms = now_ms()};
        if (live->watcher_count == 0) {
            live->scale = FIRST_SCALE;
            live->costs = (struct live_scale){.count = 0};
        }
        live->watchers = watcher;
        live->watcher_count++;
        live->active_count += !desc->is_passive;
        views->watcher_count++;
        view->references++;
        if (desc->is_passive)
            watcher->seen_frame = live->frame_number;
        watcher->seen_noted = live->noted.number;
        watcher->seen_problem = live->problem_number;
        watcher->seen_progress = live->progress_number;
    }
    pthread_mutex_unlock(&views->mutex);
    if (is_good)
        return watcher;
    free(watcher);
    return NULL;
}

void watcher_destroy(struct watcher *watcher)
{
    if (!watcher)
        return;
    struct view *view = watcher->view;
    struct views *views = view->views;
    pthread_mutex_lock(&views->mutex);
    for (struct watcher **at = &view->live.watchers; *at; at = &(*at)->next)
        if (*at == watcher) {
            *at = watcher->next;
            break;
        }
    view->live.watcher_count--;
    view->live.active_count -= !watcher->desc.is_passive;
    views->watcher_count--;
    if (view->live.watcher_count == 0)
        forget_frames(&view->live);
    view->used_ms = now_ms();
    view_release(view);
    pthread_mutex_unlock(&views->mutex);
    free(watcher);
}

/* Under the mutex: the newest frame that this watcher has not had. */
static bool find_frame(struct watcher *watcher, struct live_frame *frame)
{
    struct live *live = &watcher->view->live;
    if (live->newest.image && live->newest.number > watcher->seen_frame) {
        watcher->seen_frame = live->newest.number;
        take_frame(&live->newest, frame);
        return true;
    }
    if (!watcher->desc.is_passive || live->noted.number <= watcher->seen_noted)
        return false;
    watcher->seen_noted = live->noted.number;
    take_frame(&live->noted, frame);
    return true;
}

void watcher_look(struct watcher *watcher, bool wants_frame, struct watcher_news *news)
{
    struct view *view = watcher->view;
    struct live *live = &view->live;
    *news = (struct watcher_news){0};
    pthread_mutex_lock(&view->views->mutex);
    news->is_gone = view->is_gone;
    news->revision = view->revision;
    news->has_revision = watcher->seen_revision != view->revision;
    watcher->seen_revision = view->revision;
    news->has_problem = live->problem_number > watcher->seen_problem;
    news->problem = live->problem;
    watcher->seen_problem = live->problem_number;
    news->has_progress = live->progress_number > watcher->seen_progress && live->progress.stage[0];
    news->progress = live->progress;
    watcher->seen_progress = live->progress_number;
    news->has_frame = wants_frame && find_frame(watcher, &news->frame);
    view->views->totals.sent_frames += news->has_frame && !watcher->desc.is_passive;
    bool was_waiting = watcher->is_waiting;
    watcher->is_waiting = wants_frame && !news->has_frame;
    if (watcher->is_waiting && !was_waiting)
        views_poke(view->views);
    news->is_beat_due = watcher->is_beat_due;
    watcher->is_beat_due = false;
    if (news->has_frame || news->has_revision || news->has_problem || news->has_progress)
        watcher->beat_ms = now_ms();
    pthread_mutex_unlock(&view->views->mutex);
}

bool watcher_repeat(struct watcher *watcher, struct live_frame *frame)
{
    struct views *views = watcher->view->views;
    pthread_mutex_lock(&views->mutex);
    bool has_frame = watcher->view->live.newest.image != NULL;
    if (has_frame)
        take_frame(&watcher->view->live.newest, frame);
    pthread_mutex_unlock(&views->mutex);
    return has_frame;
}
