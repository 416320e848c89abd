/* SPDX-License-Identifier: MIT */
/* The trade-offs in memory: an array of documents, each saved as it grows. */
#include "server/tradeoffs/tradeoffs.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/request_tree.h"
#include "server/base/clock.h"
#include "server/base/digest.h"
#include "server/front/frames.h"
#include "server/tradeoffs/tradeoffs_internal.h"

enum { REQUEST_KEPT_BYTES = 16 << 10 /* of 128 trade-offs, parsed, some 20 MiB */ };

bool tradeoff_has_ended(const struct tradeoff *tradeoff)
{
    return tradeoff->state != TRADEOFF_QUEUED && tradeoff->state != TRADEOFF_RUNNING;
}

double tradeoffs_clock_s(void)
{
    return 1e-3 * now_fine_ms();
}

/* Under the mutex. A step may take long: the clock goes on meanwhile. */
static void tell_elapsed(struct tradeoff_entry *entry)
{
    if (entry->document.state == TRADEOFF_RUNNING)
        entry->document.elapsed_s = tradeoffs_clock_s() - entry->started_s;
}

/* Called under the mutex. NULL if absent. */
static struct tradeoff_entry *find(struct tradeoffs *tradeoffs, const char *id)
{
    for (int i = 0; i < tradeoffs->count; i++)
        if (strcmp(tradeoffs->entries[i]->document.id, id) == 0)
            return tradeoffs->entries[i];
    return NULL;
}

static bool not_found(const char *id, struct error *err)
{
    return error_set(err, ERROR_NOT_FOUND, "there is no trade-off '%.64s'", id);
}

static void entry_destroy(struct tradeoff_entry *entry)
{
    if (!entry)
        return;
    tradeoff_finish(&entry->document);
    tradeoff_request_finish(&entry->request);
    free(entry);
}

/* Under the mutex; the files are the caller's to remove. */
static struct tradeoff_entry *take_entry(struct tradeoffs *tradeoffs, int index)
{
    struct tradeoff_entry *entry = tradeoffs->entries[index];
    tradeoffs->count--;
    memmove(&tradeoffs->entries[index], &tradeoffs->entries[index + 1],
            (size_t)(tradeoffs->count - index) * sizeof tradeoffs->entries[0]);
    return entry;
}

/* ---- names ---- */

bool tradeoffs_device_name(struct tradeoffs *tradeoffs, char name[TRADEOFF_DEVICE_BYTES])
{
    struct device_capabilities device;
    if (!supervisor_get_device(tradeoffs->desc.supervisor, &device))
        return false;
    snprintf(name, TRADEOFF_DEVICE_BYTES, "%s, %s, %d processors, vitrail %s", device.renderer,
             device.version, tradeoffs->desc.processors, VITRAIL_VERSION);
    return true;
}

bool tradeoff_view_key(const char *text, char key[65], struct error *err)
{
    return text ? digest_of(text, strlen(text), key, err)
                : error_set(err, ERROR_NO_MEMORY, "trade-off");
}

static bool key_of_request(const struct render_request *request, char key[65], struct error *err)
{
    char *text = request_reference_text_of(request);
    bool is_good = tradeoff_view_key(text, key, err);
    free(text);
    return is_good;
}

/* ---- submitting ---- */

static void set_created(char created[TRADEOFF_TIME_BYTES])
{
    time_t now = time(NULL);
    struct tm utc;
    gmtime_r(&now, &utc);
    strftime(created, TRADEOFF_TIME_BYTES, "%Y-%m-%dT%H:%M:%SZ", &utc);
}

/* New reference, or NULL where the request is too long to be kept with its results. */
static json_t *request_to_keep(const struct render_request *request)
{
    json_t *json = request_to_tree(request);
    bool is_long = json_dumpb(json, NULL, 0, JSON_COMPACT) > REQUEST_KEPT_BYTES;
    if (!is_long)
        return json;
    json_decref(json);
    return NULL;
}

static struct tradeoff_entry *entry_create(const struct tradeoff_request *request,
                                           struct error *err)
{
    struct tradeoff_entry *entry = calloc(1, sizeof *entry);
    if (!entry) {
        error_set(err, ERROR_NO_MEMORY, "trade-off");
        return NULL;
    }
    struct tradeoff *document = &entry->document;
    memcpy(document->scene, request->render.scene, sizeof document->scene);
    document->width = request->render.width;
    document->height = request->render.height;
    document->options = request->options;
    set_created(document->created);
    if (!frames_make_id(document->id, err) ||
        !key_of_request(&request->render, document->view_key, err)) {
        entry_destroy(entry);
        return NULL;
    }
    document->request = request_to_keep(&request->render);
    if (!document->request)
        tradeoff_warn(document, "the request is not kept with the results: it is too long");
    return entry;
}

/* Under the mutex. Makes room for one more; *forgotten is an ended entry that had to go. */
static bool make_room(struct tradeoffs *tradeoffs, struct tradeoff_entry **forgotten,
                      struct error *err)
{
    int waiting = 0;
    if (tradeoffs->is_stopping)
        return error_set(err, ERROR_OVERLOADED, "the server is stopping");
    for (int i = 0; i < tradeoffs->count; i++)
        waiting += tradeoffs->entries[i]->document.state == TRADEOFF_QUEUED;
    if (waiting >= LIMIT_TRADEOFFS_WAITING)
        return error_set(err, ERROR_OVERLOADED, "%d trade-offs are waiting, which is the limit",
                         waiting);
    for (int i = 0; tradeoffs->count == LIMIT_TRADEOFFS_KEPT && i < tradeoffs->count; i++)
        if (tradeoff_has_ended(&tradeoffs->entries[i]->document))
            *forgotten = take_entry(tradeoffs, i);
    return true;
}

bool tradeoffs_submit(struct tradeoffs *tradeoffs, struct tradeoff_request *request,
                      char id[TRADEOFF_ID_BYTES], struct error *err)
{
    const struct render_request *render = &request->render;
    int64_t pixels = (int64_t)render->width * render->height;
    if (pixels > LIMIT_TRADEOFF_PIXELS)
        return error_set(err, ERROR_TOO_LARGE,
                         "%dx%d are %lld pixels, the limit of a trade-off is %d", render->width,
                         render->height, (long long)pixels, LIMIT_TRADEOFF_PIXELS);
    if (!resource_store_has(tradeoffs->desc.resources->scenes, render->scene))
        return error_set_at(err, ERROR_NOT_FOUND, "/scene", "there is no scene '%s'",
                            render->scene);
    struct tradeoff_entry *entry = entry_create(request, err), *forgotten = NULL;
    if (!entry || !tradeoff_store_save(tradeoffs->store, &entry->document, err)) {
        entry_destroy(entry);
        return false;
    }
    memcpy(id, entry->document.id, TRADEOFF_ID_BYTES);
    pthread_mutex_lock(&tradeoffs->mutex);
    bool is_good = make_room(tradeoffs, &forgotten, err);
    if (is_good) {
        entry->request = *request;
        *request = (struct tradeoff_request){0};
        tradeoffs->entries[tradeoffs->count++] = entry;
        pthread_cond_broadcast(&tradeoffs->changed);
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (forgotten)
        tradeoff_store_remove(tradeoffs->store, forgotten->document.id);
    entry_destroy(forgotten);
    if (!is_good) {
        tradeoff_store_remove(tradeoffs->store, id);
        entry_destroy(entry);
    }
    return is_good;
}

/* ---- reading ---- */

struct tradeoff *tradeoffs_get(struct tradeoffs *tradeoffs, const char *id, struct error *err)
{
    struct tradeoff *copy = malloc(sizeof *copy);
    if (!copy) {
        error_set(err, ERROR_NO_MEMORY, "trade-off");
        return NULL;
    }
    pthread_mutex_lock(&tradeoffs->mutex);
    struct tradeoff_entry *entry = find(tradeoffs, id);
    if (entry) {
        tell_elapsed(entry);
        *copy = entry->document;
        copy->request = json_deep_copy(entry->document.request); /* counts are not atomic for us */
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (entry)
        return copy;
    free(copy);
    not_found(id, err);
    return NULL;
}

json_t *tradeoffs_list(struct tradeoffs *tradeoffs)
{
    json_t *list = json_array();
    bool is_good = list;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = tradeoffs->count; is_good && i-- > 0;) {
        tell_elapsed(tradeoffs->entries[i]);
        is_good = json_array_append_new(
                      list, tradeoff_summary_to_json(&tradeoffs->entries[i]->document)) == 0;
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (is_good)
        return list;
    json_decref(list);
    return NULL;
}

int tradeoffs_open_images(struct tradeoffs *tradeoffs, const char *id)
{
    return tradeoff_store_open_images(tradeoffs->store, id);
}

/* ---- ending ---- */

/* Under the mutex. The thread notices, and saves what ran; what waited is the caller's to save. */
static void end_entry(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry)
{
    if (tradeoff_has_ended(&entry->document))
        return;
    entry->document.state = TRADEOFF_CANCELLED;
    entry->document.stage = TRADEOFF_STAGE_ENDED;
    entry->document.is_partial = true;
    pthread_cond_broadcast(&tradeoffs->changed);
}

static void save_copy(struct tradeoffs *tradeoffs, const char *id)
{
    struct error problem = {0};
    struct tradeoff *copy = tradeoffs_get(tradeoffs, id, &problem);
    if (copy && !tradeoff_store_save(tradeoffs->store, copy, &problem))
        log_write(tradeoffs->desc.log, LOG_WARNING, "trade-off %s: %s", id, problem.message);
    if (copy)
        tradeoff_finish(copy);
    free(copy);
}

bool tradeoffs_cancel(struct tradeoffs *tradeoffs, const char *id, struct error *err)
{
    pthread_mutex_lock(&tradeoffs->mutex);
    struct tradeoff_entry *entry = find(tradeoffs, id);
    bool is_waiting = entry && entry->document.state == TRADEOFF_QUEUED;
    if (entry)
        end_entry(tradeoffs, entry);
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (is_waiting)
        save_copy(tradeoffs, id);
    return entry || not_found(id, err);
}

bool tradeoffs_forget(struct tradeoffs *tradeoffs, const char *id, struct error *err)
{
    struct tradeoff_entry *gone = NULL;
    bool is_known = false;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = 0; i < tradeoffs->count && !is_known; i++) {
        if (strcmp(tradeoffs->entries[i]->document.id, id) != 0)
            continue;
        is_known = true;
        if (tradeoff_has_ended(&tradeoffs->entries[i]->document) && !tradeoffs->entries[i]->is_used)
            gone = take_entry(tradeoffs, i);
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (!is_known)
        return not_found(id, err);
    if (!gone)
        return error_set(err, ERROR_CONFLICT, "trade-off '%s' has not ended: cancel it first", id);
    tradeoff_store_remove(tradeoffs->store, id);
    entry_destroy(gone);
    return true;
}

void tradeoffs_forget_scene(struct tradeoffs *tradeoffs, const char *scene)
{
    struct tradeoff_entry *gone[LIMIT_TRADEOFFS_KEPT];
    int count = 0;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = tradeoffs->count; i-- > 0;) {
        struct tradeoff_entry *entry = tradeoffs->entries[i];
        if (strcmp(entry->document.scene, scene) != 0)
            continue;
        end_entry(tradeoffs, entry);
        if (entry->is_used)
            entry->is_unwanted = true;
        else
            gone[count++] = take_entry(tradeoffs, i);
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    for (int i = 0; i < count; i++) {
        tradeoff_store_remove(tradeoffs->store, gone[i]->document.id);
        entry_destroy(gone[i]);
    }
}

/* ---- the thread ---- */

/* Waits for work; the entry it answers is RUNNING and in use. NULL: stop. */
static struct tradeoff_entry *next_entry(struct tradeoffs *tradeoffs)
{
    struct tradeoff_entry *found = NULL;
    pthread_mutex_lock(&tradeoffs->mutex);
    while (!tradeoffs->is_stopping && !found) {
        for (int i = 0; i < tradeoffs->count && !found; i++)
            if (tradeoffs->entries[i]->document.state == TRADEOFF_QUEUED)
                found = tradeoffs->entries[i];
        if (!found)
            pthread_cond_wait(&tradeoffs->changed, &tradeoffs->mutex);
    }
    if (tradeoffs->is_stopping)
        found = NULL;
    if (found) {
        found->document.state = TRADEOFF_RUNNING;
        found->started_s = tradeoffs_clock_s();
        found->is_used = true;
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    return found;
}

static void put_back(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry)
{
    struct tradeoff_entry *gone = NULL;
    pthread_mutex_lock(&tradeoffs->mutex);
    entry->is_used = false;
    tradeoff_request_finish(&entry->request);
    for (int i = 0; entry->is_unwanted && !gone && i < tradeoffs->count; i++)
        if (tradeoffs->entries[i] == entry)
            gone = take_entry(tradeoffs, i);
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (gone)
        tradeoff_store_remove(tradeoffs->store, gone->document.id);
    entry_destroy(gone);
}

static void *tradeoffs_thread(void *argument)
{
    struct tradeoffs *tradeoffs = argument;
    for (struct tradeoff_entry *entry; (entry = next_entry(tradeoffs));) {
        tradeoff_run(tradeoffs, entry);
        put_back(tradeoffs, entry);
    }
    return NULL;
}

/* ---- life ---- */

static void load_entry(void *context, struct tradeoff *tradeoff)
{
    struct tradeoffs *tradeoffs = context;
    bool is_wanted = resource_store_has(tradeoffs->desc.resources->scenes, tradeoff->scene) &&
                     tradeoffs->count < LIMIT_TRADEOFFS_KEPT;
    struct tradeoff_entry *entry = is_wanted ? calloc(1, sizeof *entry) : NULL;
    if (!entry) {
        tradeoff_store_remove(tradeoffs->store, tradeoff->id);
        return;
    }
    entry->document = *tradeoff;
    tradeoff->request = NULL;
    if (!tradeoff_has_ended(&entry->document)) {
        entry->document.state = TRADEOFF_FAILED;
        entry->document.stage = TRADEOFF_STAGE_ENDED;
        entry->document.is_partial = true;
        error_set(&entry->document.problem, ERROR_INTERRUPTED,
                  "the server ended before the measurement did");
    }
    tradeoffs->entries[tradeoffs->count++] = entry;
}

static int compare_created(const void *left, const void *right)
{
    const struct tradeoff_entry *const *a = left, *const *b = right;
    return strcmp((*a)->document.created, (*b)->document.created);
}

struct tradeoffs *tradeoffs_create(const struct tradeoffs_desc *desc, struct error *err)
{
    struct tradeoffs *tradeoffs = calloc(1, sizeof *tradeoffs);
    if (!tradeoffs) {
        error_set(err, ERROR_NO_MEMORY, "trade-offs");
        return NULL;
    }
    tradeoffs->desc = *desc;
    pthread_mutex_init(&tradeoffs->mutex, NULL);
    pthread_cond_init(&tradeoffs->changed, NULL);
    tradeoffs->store = tradeoff_store_create(desc->state_dir, desc->log, err);
    if (!tradeoffs->store || !tradeoff_store_load(tradeoffs->store, load_entry, tradeoffs, err))
        goto fail;
    qsort(tradeoffs->entries, (size_t)tradeoffs->count, sizeof tradeoffs->entries[0],
          compare_created);
    tradeoffs->has_thread =
        pthread_create(&tradeoffs->thread, NULL, tradeoffs_thread, tradeoffs) == 0;
    if (tradeoffs->has_thread)
        return tradeoffs;
    error_set(err, ERROR_INTERNAL, "trade-offs: no thread");

fail:
    tradeoffs_destroy(tradeoffs);
    return NULL;
}

void tradeoffs_stop(struct tradeoffs *tradeoffs)
{
    if (!tradeoffs || !tradeoffs->has_thread)
        return;
    pthread_mutex_lock(&tradeoffs->mutex);
    tradeoffs->is_stopping = true;
    pthread_cond_broadcast(&tradeoffs->changed);
    pthread_mutex_unlock(&tradeoffs->mutex);
    pthread_join(tradeoffs->thread, NULL);
    tradeoffs->has_thread = false;
}

void tradeoffs_destroy(struct tradeoffs *tradeoffs)
{
    if (!tradeoffs)
        return;
    tradeoffs_stop(tradeoffs);
    for (int i = 0; i < tradeoffs->count; i++)
        entry_destroy(tradeoffs->entries[i]);
    tradeoff_store_destroy(tradeoffs->store);
    pthread_cond_destroy(&tradeoffs->changed);
    pthread_mutex_destroy(&tradeoffs->mutex);
    free(tradeoffs);
}
