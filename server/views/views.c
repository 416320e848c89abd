/* SPDX-License-Identifier: MIT */
/* A list of views under one mutex. */
#include "server/views/views.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "server/base/clock.h"
#include "server/http/negotiate.h"
#include "server/views/views_internal.h"

enum { LOOK_MS = 1000 /* at least this often for what is idle */ };

/* ---- names of scenes; under the mutex ---- */

static void names_release(struct views *views, struct scene_names *names)
{
    if (!names || --names->references > 0)
        return;
    for (struct scene_names **at = &views->names; *at; at = &(*at)->next)
        if (*at == names) {
            *at = names->next;
            break;
        }
    view_names_destroy(names->names);
    free(names);
}

static struct scene_names *names_find(struct views *views, const char *scene)
{
    for (struct scene_names *names = views->names; names; names = names->next)
        if (strcmp(names->scene, scene) == 0) {
            names->references++;
            return names;
        }
    return NULL;
}

/* Reads the scene's summary, which takes milliseconds for large scenes: not under the mutex. */
static struct scene_names *names_read(struct views *views, const char *scene, struct error *err)
{
    struct error no_scene = {0};
    json_t *summary = resource_store_get_summary(views->desc.resources->scenes, scene, &no_scene);
    if (!summary) {
        error_set_at(err, no_scene.code, "/scene", "%s", no_scene.message);
        return NULL;
    }
    struct scene_names *names = calloc(1, sizeof *names);
    if (names)
        names->names = view_names_create(summary, err);
    json_decref(summary);
    if (names && names->names) {
        snprintf(names->scene, sizeof names->scene, "%s", scene);
        names->references = 1;
        return names;
    }
    error_set(err, ERROR_NO_MEMORY, "names of a scene");
    free(names);
    return NULL;
}

/* ---- one view; under the mutex ---- */

void view_release(struct view *view)
{
    if (--view->references > 0)
        return;
    live_finish(&view->live);
    names_release(view->views, view->names);
    view_document_destroy(view->document);
    free(view);
}

static void remove_view(struct views *views, struct view *view)
{
    for (struct view **at = &views->oldest; *at; at = &(*at)->next)
        if (*at == view) {
            *at = view->next;
            break;
        }
    view->is_gone = true;
    views->totals.views--;
    views->totals.document_bytes -= view_document_bytes(view->document);
    live_tell(view);
    view_release(view);
}

struct view *views_find(struct views *views, const char *id, struct error *err)
{
    for (struct view *view = views->oldest; view; view = view->next)
        if (strcmp(view->id, id) == 0) {
            view->used_ms = now_ms();
            return view;
        }
    error_set(err, ERROR_NOT_FOUND,
              "there is no view '%.64s'; idle ones are forgotten after at most %d s", id,
              views->desc.config->view_idle_s);
    return NULL;
}

static json_t *summarise(const struct view *view)
{
    int width, height;
    view_document_get_size(view->document, &width, &height);
    return json_pack("{s:s,s:s,s:I,s:i,s:i,s:i,s:o,s:f,s:i}", "id", view->id, "scene",
                     view_document_scene(view->document), "revision", (json_int_t)view->revision,
                     "width", width, "height", height, "watchers", view->live.watcher_count,
                     "created", json_time(view->made_unix_s), "idle_s",
                     1e-3 * (double)(now_ms() - view->used_ms), "expires_s", view->expires_s);
}

static json_t *summary_or_error(const struct view *view, struct error *err)
{
    json_t *summary = summarise(view);
    if (summary && view->live.progress.stage[0])
        json_object_set_new(summary, "progress", job_progress_to_json(&view->live.progress));
    if (!summary)
        error_set(err, ERROR_NO_MEMORY, "view");
    return summary;
}

static bool meets(const struct view *view, const struct view_condition *condition,
                  struct error *err)
{
    char tag[32];
    snprintf(tag, sizeof tag, "\"%llu\"", (unsigned long long)view->revision);
    if (negotiate_if_match(condition->if_match, tag) &&
        (!condition->revision || condition->revision == view->revision))
        return true;
    return error_set(err, ERROR_PRECONDITION_FAILED, "the view is at revision %llu now",
                     (unsigned long long)view->revision);
}

/* ---- making ---- */

/* Under the mutex. */
static bool has_room(struct views *views, const char *address, size_t bytes, struct error *err)
{
    const struct config *config = views->desc.config;
    int of_client = 0;
    for (const struct view *view = views->oldest; view; view = view->next)
        of_client += strcmp(view->address, address) == 0;
    if (views->is_stopping)
        return error_set(err, ERROR_OVERLOADED, "the server is stopping");
    if (views->totals.views >= (uint64_t)config->views)
        return error_set(err, ERROR_OVERLOADED, "there are %d views, which is the limit",
                         config->views);
    if (of_client >= config->views_per_client)
        return error_set(err, ERROR_TOO_MANY_REQUESTS,
                         "%s has %d views, which is the limit for one client", address, of_client);
    if (views->totals.document_bytes + bytes > LIMIT_VIEWS_BYTES)
        return error_set(err, ERROR_TOO_LARGE, "all views together would have over %llu bytes",
                         (unsigned long long)LIMIT_VIEWS_BYTES);
    return true;
}

static struct view *view_create(struct views *views, const struct view_make_desc *desc,
                                struct error *err)
{
    uint64_t bits;
    struct view *view = calloc(1, sizeof *view);
    if (!view) {
        error_set(err, ERROR_NO_MEMORY, "view");
        return NULL;
    }
    view->views = views;
    view->references = 1;
    view->revision = 1;
    view->made_unix_s = (int64_t)time(NULL);
    view->used_ms = view->changed_ms = now_ms();
    view->live.scale = 1;
    const int most_s = views->desc.config->view_idle_s;
    view->expires_s = desc->expires_s > 0 && desc->expires_s < most_s ? desc->expires_s : most_s;
    snprintf(view->address, sizeof view->address, "%s", desc->address);
    view->document = view_document_create(desc->json, desc->length, err);
    if (view->document && getrandom(&bits, sizeof bits, 0) == sizeof bits) {
        snprintf(view->id, sizeof view->id, "%016llx", (unsigned long long)bits);
        return view;
    }
    error_set(err, ERROR_INTERNAL, "getrandom: %s", strerror(errno));
    view_document_destroy(view->document);
    free(view);
    return NULL;
}

static bool has_scene(void *context, const char *id)
{
    const struct views *views = context;
    return resource_store_has(views->desc.resources->scenes, id);
}

static bool has_environment(void *context, const char *id)
{
    const struct views *views = context;
    return resource_store_has(views->desc.resources->environments, id);
}

static struct view_scenes scenes_of(struct views *views)
{
    return (struct view_scenes){
        .has = has_scene, .has_environment = has_environment, .context = views};
}

/* Under the mutex; takes read, which is NULL when the names are here already. */
static bool add_view(struct views *views, struct view *view, struct scene_names *read,
                     struct error *err)
{
    view->names = names_find(views, view_document_scene(view->document));
    if (view->names || !read) {
        if (read)
            view_names_destroy(read->names);
        free(read);
    } else {
        read->next = views->names;
        views->names = view->names = read;
    }
    size_t bytes = view_document_bytes(view->document);
    struct view_scenes scenes = scenes_of(views);
    if (!has_room(views, view->address, bytes, err) ||
        (view->names && !view_document_check_names(view->document, view->names->names, err)) ||
        !view_document_check_scenes(view->document, &scenes, err))
        return false;
    struct view **last = &views->oldest;
    while (*last)
        last = &(*last)->next;
    *last = view;
    views->totals.views++;
    views->totals.made++;
    views->totals.document_bytes += bytes;
    return true;
}

json_t *views_make(struct views *views, const struct view_make_desc *desc, struct error *err)
{
    pthread_mutex_lock(&views->mutex);
    bool has_place = has_room(views, desc->address, 0, err); /* before the work of parsing */
    views->totals.refused += !has_place;
    pthread_mutex_unlock(&views->mutex);
    struct view *view = has_place ? view_create(views, desc, err) : NULL;
    if (!view)
        return NULL;
    pthread_mutex_lock(&views->mutex);
    struct scene_names *known = names_find(views, view_document_scene(view->document));
    pthread_mutex_unlock(&views->mutex);
    struct scene_names *read =
        known ? NULL : names_read(views, view_document_scene(view->document), err);
    pthread_mutex_lock(&views->mutex);
    json_t *summary = NULL;
    if ((known || read) && add_view(views, view, read, err)) {
        summary = summary_or_error(view, err);
        if (!summary)
            remove_view(views, view);
    } else {
        view_release(view);
    }
    names_release(views, known);
    pthread_mutex_unlock(&views->mutex);
    return summary;
}

/* ---- reading ---- */

json_t *views_list(struct views *views)
{
    json_t *list = json_array();
    bool has_failed = !list;
    pthread_mutex_lock(&views->mutex);
    for (const struct view *view = views->oldest; view; view = view->next)
        has_failed |= json_array_append_new(list, summarise(view)) != 0;
    pthread_mutex_unlock(&views->mutex);
    if (!has_failed)
        return list;
    json_decref(list);
    return NULL;
}

/* The document that patches change: as "view", and beside the summary's members, as RFC 7396 has
 * a patch and its target alike. */
static bool add_members(json_t *json, const struct view_document *document)
{
    json_t *members = view_document_to_json(document);
    return json_object_set_new(json, "view", members) == 0 &&
           json_object_update_missing(json, members) == 0;
}

json_t *views_get(struct views *views, const char *id, bool is_whole, struct error *err)
{
    json_t *json = NULL;
    pthread_mutex_lock(&views->mutex);
    struct view *view = views_find(views, id, err);
    if (view)
        json = summary_or_error(view, err);
    if (json && is_whole && !add_members(json, view->document)) {
        error_set(err, ERROR_NO_MEMORY, "view");
        json_decref(json);
        json = NULL;
    }
    pthread_mutex_unlock(&views->mutex);
    return json;
}

/* ---- changing ---- */

/* Whether a patch changes nothing but what is drawn over the picture. */
static bool is_over_picture(const json_t *patch)
{
    return json_object_size(patch) == 1 &&
           (json_object_get(patch, "highlight") || json_object_get(patch, "edges"));
}

/* Under the mutex. */
static bool patch_view(struct views *views, struct view *view, const struct view_patch *patch,
                       struct error *err)
{
    struct view_patch with_names = *patch;
    with_names.names = view->names ? view->names->names : NULL;
    with_names.scenes = scenes_of(views);
    size_t before = view_document_bytes(view->document);
    if (views->totals.document_bytes > LIMIT_VIEWS_BYTES)
        return error_set(err, ERROR_TOO_LARGE, "all views together have over %llu bytes",
                         (unsigned long long)LIMIT_VIEWS_BYTES);
    if (!view_document_patch(view->document, &with_names, err))
        return false;
    views->totals.document_bytes += view_document_bytes(view->document) - before;
    views->totals.patches++;
    live_note_patch(view, is_over_picture(patch->json));
    view->revision++;
    view->changed_ms = now_ms();
    live_tell(view);
    views_poke(views);
    return true;
}

json_t *views_patch(struct views *views, const char *id, const struct view_patch *patch,
                    const struct view_condition *condition, uint64_t *revision, struct error *err)
{
    json_t *summary = NULL;
    pthread_mutex_lock(&views->mutex);
    struct view *view = views_find(views, id, err);
    if (view && meets(view, condition, err) && patch_view(views, view, patch, err))
        summary = summary_or_error(view, err);
    *revision = view ? view->revision : 0;
    pthread_mutex_unlock(&views->mutex);
    return summary;
}

bool views_remove(struct views *views, const char *id, const struct view_condition *condition,
                  uint64_t *revision, struct error *err)
{
    pthread_mutex_lock(&views->mutex);
    struct view *view = views_find(views, id, err);
    *revision = view ? view->revision : 0;
    bool is_good = view && meets(view, condition, err);
    if (is_good)
        remove_view(views, view);
    pthread_mutex_unlock(&views->mutex);
    return is_good;
}

/* ---- pictures ---- */

static char *reference_text(const void *context)
{
    return view_document_reference_text(context);
}

/* Sets what the worker chooses from, and the tag. Pictures in motion leave nothing to choose. */
static bool describe(struct view *view, const struct view_frame_desc *frame,
                     struct view_picture *picture, struct error *err)
{
    const struct views_desc *desc = &view->views->desc;
    const struct request_quality *quality = view_document_quality(view->document);
    const struct tradeoff_view measured = {.scene = picture->scene,
                                           .width_px = picture->width_px,
                                           .height_px = picture->height_px,
                                           .quality = quality,
                                           .resources = &picture->resources,
                                           .reference_text = reference_text,
                                           .context = view->document};
    picture->has_target = !frame->is_moving && request_quality_asks(quality);
    if (picture->has_target &&
        !tradeoffs_offer(desc->tradeoffs, &measured, true, &picture->offer, err))
        return false;
    image_digest(picture->text, picture->offer, picture->digest);
    (void)!image_tag_make(&(struct image_tag_desc){.supervisor = desc->supervisor,
                                                   .build_id = desc->build_id,
                                                   .request_digest = picture->digest},
                          picture->tag);
    return true;
}

bool view_describe_frame(struct view *view, const struct view_frame_desc *frame,
                         struct view_picture *picture, struct error *err)
{
    *picture = (struct view_picture){.revision = view->revision,
                                     .shape = view_document_shape(view->document),
                                     .home = view->home};
    snprintf(picture->scene, sizeof picture->scene, "%s", view_document_scene(view->document));
    view_document_resources(view->document, &picture->resources);
    picture->text =
        view_document_frame(view->document, frame, &picture->width_px, &picture->height_px);
    if (!picture->text)
        return error_set(err, ERROR_NO_MEMORY, "picture of a view");
    if (describe(view, frame, picture, err))
        return true;
    view_picture_finish(picture);
    return false;
}

bool views_describe_frame(struct views *views, const char *id, const struct view_frame_desc *frame,
                          struct view_picture *picture, struct error *err)
{
    *picture = (struct view_picture){0};
    pthread_mutex_lock(&views->mutex);
    struct view *view = views_find(views, id, err);
    bool is_good = view && view_describe_frame(view, frame, picture, err);
    pthread_mutex_unlock(&views->mutex);
    return is_good;
}

void view_picture_finish(struct view_picture *picture)
{
    free(picture->text);
    json_decref(picture->offer);
    *picture = (struct view_picture){0};
}

/* ---- the thread ---- */

void views_poke(struct views *views)
{
    views->is_poked = true;
    pthread_cond_signal(&views->poke);
}

/* Under the mutex: forgets what is idle, collects what watchers need. */
static struct launch *look_around(struct views *views, int64_t *until_ms)
{
    int64_t now = now_ms();
    struct launch *launches = NULL;
    for (struct view *view = views->oldest, *next; view; view = next) {
        next = view->next;
        if (view->live.watcher_count > 0)
            view->used_ms = now;
        if (now - view->used_ms > 1000ll * view->expires_s) {
            views->totals.expired++;
            remove_view(views, view);
            continue;
        }
        struct launch *launch = live_step(view, now, until_ms);
        if (launch) {
            launch->next = launches;
            launches = launch;
        }
    }
    return launches;
}

static void *views_run(void *argument)
{
    struct views *views = argument;
    pthread_mutex_lock(&views->mutex);
    while (!views->is_stopping) {
        int64_t until_ms = now_ms() + LOOK_MS;
        views->is_poked = false;
        struct launch *launches = look_around(views, &until_ms);
        pthread_mutex_unlock(&views->mutex);
        for (struct launch *next; launches; launches = next) {
            next = launches->next;
            live_launch(launches);
        }
        pthread_mutex_lock(&views->mutex);
        struct timespec until = {.tv_sec = until_ms / 1000, .tv_nsec = until_ms % 1000 * 1000000};
        while (!views->is_poked && !views->is_stopping &&
               pthread_cond_timedwait(&views->poke, &views->mutex, &until) == 0)
            continue;
    }
    pthread_mutex_unlock(&views->mutex);
    return NULL;
}

/* ---- life ---- */

struct views *views_create(const struct views_desc *desc, struct error *err)
{
    struct views *views = calloc(1, sizeof *views);
    if (!views) {
        error_set(err, ERROR_NO_MEMORY, "views");
        return NULL;
    }
    views->desc = *desc;
    pthread_mutex_init(&views->mutex, NULL);
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&views->poke, &monotonic);
    pthread_condattr_destroy(&monotonic);
    views->has_thread = pthread_create(&views->thread, NULL, views_run, views) == 0;
    if (views->has_thread)
        return views;
    error_set(err, ERROR_INTERNAL, "views: %s", strerror(errno));
    views_destroy(views);
    return NULL;
}

void views_stop(struct views *views)
{
    pthread_mutex_lock(&views->mutex);
    views->is_stopping = true;
    views_poke(views);
    while (views->oldest)
        remove_view(views, views->oldest);
    bool has_thread = views->has_thread;
    views->has_thread = false;
    pthread_mutex_unlock(&views->mutex);
    if (has_thread)
        pthread_join(views->thread, NULL);
}

void views_destroy(struct views *views)
{
    if (!views)
        return;
    views_stop(views);
    pthread_cond_destroy(&views->poke);
    pthread_mutex_destroy(&views->mutex);
    free(views);
}

struct views_totals views_get_totals(struct views *views)
{
    pthread_mutex_lock(&views->mutex);
    struct views_totals totals = views->totals;
    totals.watchers = (uint64_t)views->watcher_count;
    pthread_mutex_unlock(&views->mutex);
    return totals;
}

void views_count_not_modified(struct views *views)
{
    pthread_mutex_lock(&views->mutex);
    views->totals.not_modified++;
    pthread_mutex_unlock(&views->mutex);
}
