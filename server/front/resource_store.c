/* SPDX-License-Identifier: MIT */
/* A store: an index in memory over directories that appear and vanish whole. */
#include "server/front/resource_store.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/ipc.h"

enum { JSON_FILE_BYTES = 64 << 20 /* above what the outline of 65,536 nodes takes */ };

struct resource_store {
    const struct resource_info *info;
    const struct log *log;
    struct state_dir *state;
    int fd;                /* of STATE/scenes or the like */
    pthread_mutex_t mutex; /* guards index and decoded_bytes */
    json_t *index;         /* id -> item of the list */
    uint64_t decoded_bytes;
    pthread_mutex_t use_mutex; /* guards last_used; taken alone, or inside of mutex */
    char last_used[DIGEST_TEXT_BYTES];
};

/* A JSON file of a published or draft directory. */
static json_t *read_json(int parent_fd, const char *name, const char *what, struct error *err)
{
    char path[96];
    snprintf(path, sizeof path, "%.64s/%s.json", name, what);
    int fd = openat(parent_fd, path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    struct ipc_mapping text = {0};
    json_t *file = NULL;
    json_error_t where;
    if (fd < 0 || !ipc_mapping_init(&text, fd, NULL) || text.size_bytes > JSON_FILE_BYTES)
        error_set(err, ERROR_IO, "its %s cannot be read", what);
    else if (!(file = json_loadb(text.bytes, text.size_bytes, 0, &where)))
        error_set(err, ERROR_IO, "its %s is not JSON: %s", what, where.text);
    ipc_mapping_finish(&text);
    if (fd >= 0)
        close(fd);
    return file;
}

/* Checks the version of the blob, too. */
static json_t *read_summary(const struct resource_store *store, const char *name, struct error *err)
{
    json_t *summary = NULL, *file = read_json(store->fd, name, "summary", err);
    if (!file)
        return NULL;
    if (json_integer_value(json_object_get(file, "blob_version")) != store->info->blob_version)
        error_set(err, ERROR_IO, "it was decoded by another version of the program");
    else if (!json_is_object(summary = json_object_get(file, "summary")))
        error_set(err, ERROR_IO, "its summary is incomplete");
    json_t *result = err->code == ERROR_NONE ? json_incref(summary) : NULL;
    json_decref(file);
    return result;
}

/* The members of a summary that the list shows. */
static json_t *item_from_summary(const struct resource_info *info, const json_t *summary)
{
    json_t *item = json_object();
    for (const char *const *member = info->list_members; item && *member; member++) {
        json_t *value = json_object_get(summary, *member);
        if (json_object_set(item, *member, value ? value : json_null()) != 0) {
            json_decref(item);
            item = NULL;
        }
    }
    return item;
}

static uint64_t item_bytes(const json_t *item)
{
    return (uint64_t)json_integer_value(json_object_get(json_object_get(item, "bytes"), "decoded"));
}

/* Takes the reference of item. Caller holds the mutex, or is alone. */
static bool index_add(struct resource_store *store, const char *id, json_t *item)
{
    if (!item || json_object_set_new(store->index, id, item) != 0)
        return false;
    store->decoded_bytes += item_bytes(item);
    return true;
}

static void load(void *context, const char *name)
{
    struct resource_store *store = context;
    struct error problem = {0};
    json_t *summary = NULL;
    char path[96];
    struct stat blob;
    if (!digest_is_text(name))
        error_set(&problem, ERROR_IO, "not the name of a %s", store->info->noun);
    else if ((summary = read_summary(store, name, &problem))) {
        snprintf(path, sizeof path, "%s/blob", name);
        if (fstatat(store->fd, path, &blob, AT_SYMLINK_NOFOLLOW) != 0 || blob.st_size == 0)
            error_set(&problem, ERROR_IO, "its blob is missing");
        else if (!index_add(store, name, item_from_summary(store->info, summary)))
            error_set(&problem, ERROR_NO_MEMORY, "index");
    }
    json_decref(summary);
    if (problem.code == ERROR_NONE)
        return;
    log_write(store->log, LOG_WARNING, "state directory: %s '%s' is removed: %s", store->info->noun,
              name, problem.message);
    state_dir_remove(store->fd, name);
}

static int compare_created(const void *left, const void *right)
{
    const json_t *const *a = left, *const *b = right;
    const char *first = json_string_value(json_object_get(*a, "created"));
    const char *second = json_string_value(json_object_get(*b, "created"));
    return strcmp(first ? first : "", second ? second : "");
}

struct resource_store *resource_store_create(const struct resource_store_desc *desc,
                                             struct error *err)
{
    struct resource_store *store = calloc(1, sizeof *store);
    if (!store) {
        error_set(err, ERROR_NO_MEMORY, "store of %ss", resource_info(desc->kind)->noun);
        return NULL;
    }
    store->info = resource_info(desc->kind);
    store->log = desc->log;
    store->state = desc->state;
    pthread_mutex_init(&store->mutex, NULL);
    pthread_mutex_init(&store->use_mutex, NULL);
    store->fd = state_dir_open(store->state, store->info->folder, err);
    store->index = json_object();
    if (!store->index)
        error_set(err, ERROR_NO_MEMORY, "index of %ss", store->info->noun);
    if (store->index && store->fd >= 0 && state_dir_for_each(store->fd, load, store, err))
        return store;
    resource_store_destroy(store);
    return NULL;
}

void resource_store_destroy(struct resource_store *store)
{
    if (!store)
        return;
    json_decref(store->index);
    pthread_mutex_destroy(&store->use_mutex);
    pthread_mutex_destroy(&store->mutex);
    if (store->fd >= 0)
        close(store->fd);
    free(store);
}

bool resource_draft_begin(struct resource_store *store, struct resource_draft *draft,
                          struct error *err)
{
    *draft = (struct resource_draft){.blob_fd = -1};
    state_dir_make_name(store->state, "draft", draft->name, sizeof draft->name);
    char path[64];
    snprintf(path, sizeof path, "%s/blob", draft->name);
    if (mkdirat(state_dir_tmp_fd(store->state), draft->name, 0700) == 0)
        draft->blob_fd = openat(state_dir_tmp_fd(store->state), path,
                                O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (draft->blob_fd >= 0)
        return true;
    error_set(err, ERROR_IO, "new %s: %s", store->info->noun, strerror(errno));
    resource_draft_discard(store, draft);
    return false;
}

void resource_draft_discard(struct resource_store *store, struct resource_draft *draft)
{
    if (!draft->name[0])
        return;
    if (draft->blob_fd >= 0)
        close(draft->blob_fd);
    state_dir_remove(state_dir_tmp_fd(store->state), draft->name);
    *draft = (struct resource_draft){0};
}

static bool write_json(struct resource_store *store, const char *path, const char *file,
                       const json_t *json, struct error *err)
{
    char what[64];
    snprintf(what, sizeof what, "%s of a %s", file, store->info->noun);
    return state_dir_write_json(store->state, path, what, json, err);
}

/* The outline has a file of its own: it can be large, and few ask for it. */
static bool write_summary(struct resource_store *store, const char *draft, json_t *summary,
                          struct error *err)
{
    json_t *outline = json_incref(json_object_get(summary, "outline"));
    json_object_del(summary, "outline");
    json_t *file =
        json_pack("{s:i,s:O}", "blob_version", store->info->blob_version, "summary", summary);
    char outline_path[64], summary_path[64];
    snprintf(outline_path, sizeof outline_path, "%s/outline.json", draft);
    snprintf(summary_path, sizeof summary_path, "%s/summary.json", draft);
    bool is_good = (!outline || write_json(store, outline_path, "outline", outline, err)) &&
                   write_json(store, summary_path, "summary", file, err);
    json_decref(file);
    json_decref(outline);
    return is_good;
}

/* The directory of the draft reaches the disk before its new name does. */
static bool sync_draft(struct resource_store *store, const struct resource_draft *draft,
                       struct error *err)
{
    int fd =
        openat(state_dir_tmp_fd(store->state), draft->name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool is_good = fd >= 0 && fsync(draft->blob_fd) == 0 && fsync(fd) == 0;
    if (!is_good)
        error_set(err, ERROR_IO, "saving a %s: %s", store->info->noun, strerror(errno));
    if (fd >= 0)
        close(fd);
    return is_good;
}

/* Renames and indexes under the mutex, so that a DELETE of the same id comes wholly before or
 * after. */
static bool publish(struct resource_store *store, struct resource_draft *draft, const char *id,
                    json_t *item, bool *is_new, struct error *err)
{
    bool is_good = true;
    pthread_mutex_lock(&store->mutex);
    if (json_object_get(store->index, id)) {
        *is_new = false;
    } else if (json_object_size(store->index) >= RESOURCES_STORED_MAX) {
        is_good =
            error_set(err, ERROR_TOO_LARGE, "%d %ss are stored, which is the limit: delete some",
                      RESOURCES_STORED_MAX, store->info->noun);
    } else if (renameat(state_dir_tmp_fd(store->state), draft->name, store->fd, id) != 0) {
        is_good =
            error_set(err, ERROR_IO, "publishing a %s: %s", store->info->noun, strerror(errno));
    } else if (fsync(store->fd) != 0 || !index_add(store, id, json_incref(item))) {
        is_good =
            error_set(err, ERROR_IO, "publishing a %s: %s", store->info->noun, strerror(errno));
        state_dir_remove(store->fd, id);
    } else {
        *is_new = true;
    }
    pthread_mutex_unlock(&store->mutex);
    return is_good;
}

bool resource_draft_commit(struct resource_store *store, struct resource_draft *draft,
                           json_t *summary, bool *is_new, struct error *err)
{
    const char *id = json_string_value(json_object_get(summary, "id"));
    json_t *item = id ? item_from_summary(store->info, summary) : NULL;
    bool is_good = item ? write_summary(store, draft->name, summary, err) &&
                              sync_draft(store, draft, err) &&
                              publish(store, draft, id, item, is_new, err)
                        : error_set(err, ERROR_NO_MEMORY, "summary of a %s", store->info->noun);
    json_decref(item);
    return is_good;
}

bool resource_store_has(struct resource_store *store, const char *id)
{
    pthread_mutex_lock(&store->mutex);
    bool is_there = json_object_get(store->index, id) != NULL;
    pthread_mutex_unlock(&store->mutex);
    return is_there;
}

static bool not_found(const struct resource_store *store, const char *id, struct error *err)
{
    return error_set(err, ERROR_NOT_FOUND, "there is no %s '%.64s'", store->info->noun, id);
}

int resource_store_open_blob(struct resource_store *store, const char *id, struct error *err)
{
    char path[96];
    snprintf(path, sizeof path, "%.64s/blob", id);
    int fd = resource_store_has(store, id)
                 ? openat(store->fd, path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW)
                 : -1;
    if (fd < 0)
        not_found(store, id, err);
    return fd;
}

static json_t *get_json(struct resource_store *store, const char *id,
                        json_t *(*read)(const struct resource_store *store, const char *name,
                                        struct error *err),
                        struct error *err)
{
    struct error problem = {0};
    json_t *json = resource_store_has(store, id) ? read(store, id, &problem) : NULL;
    if (!json && problem.code == ERROR_NONE)
        not_found(store, id, &problem);
    if (!json && err)
        *err = problem;
    return json;
}

json_t *resource_store_get_summary(struct resource_store *store, const char *id, struct error *err)
{
    return get_json(store, id, read_summary, err);
}

static json_t *read_outline(const struct resource_store *store, const char *name, struct error *err)
{
    return read_json(store->fd, name, "outline", err);
}

json_t *resource_store_get_outline(struct resource_store *store, const char *id, struct error *err)
{
    return get_json(store, id, read_outline, err);
}

/* The caller holds the mutex. */
static bool replace_summary(struct resource_store *store, const char *id, const json_t *summary,
                            struct error *err)
{
    char draft[48], path[96];
    state_dir_make_name(store->state, "summary", draft, sizeof draft);
    snprintf(path, sizeof path, "%.64s/summary.json", id);
    json_t *file =
        json_pack("{s:i,s:O}", "blob_version", store->info->blob_version, "summary", summary);
    bool is_good = write_json(store, draft, "summary", file, err);
    if (is_good && renameat(state_dir_tmp_fd(store->state), draft, store->fd, path) != 0)
        is_good = error_set(err, ERROR_IO, "renaming a %s: %s", store->info->noun, strerror(errno));
    if (!is_good)
        unlinkat(state_dir_tmp_fd(store->state), draft, 0);
    json_decref(file);
    return is_good;
}

bool resource_store_rename(struct resource_store *store, const char *id, const char *name,
                           struct error *err)
{
    struct error problem = {0};
    pthread_mutex_lock(&store->mutex);
    json_t *item = json_object_get(store->index, id);
    json_t *summary = item ? read_summary(store, id, &problem) : NULL;
    json_t *text = name ? json_string(name) : json_null();
    if (!item)
        not_found(store, id, &problem);
    else if (summary && json_object_set(summary, "name", text) != 0)
        error_set(&problem, ERROR_NO_MEMORY, "name of a %s", store->info->noun);
    else if (summary && replace_summary(store, id, summary, &problem))
        json_object_set(item, "name", text);
    pthread_mutex_unlock(&store->mutex);
    json_decref(text);
    json_decref(summary);
    if (problem.code != ERROR_NONE)
        *err = problem;
    return problem.code == ERROR_NONE;
}

/* Says whether it was another one. */
static bool set_last_used(struct resource_store *store, const char *id)
{
    pthread_mutex_lock(&store->use_mutex);
    bool is_other = strcmp(store->last_used, id) != 0;
    snprintf(store->last_used, sizeof store->last_used, "%s", id);
    pthread_mutex_unlock(&store->use_mutex);
    return is_other;
}

bool resource_store_remove(struct resource_store *store, const char *id, struct error *err)
{
    char name[48];
    state_dir_make_name(store->state, "dead", name, sizeof name);
    pthread_mutex_lock(&store->mutex);
    json_t *item = json_object_get(store->index, id);
    bool is_good = true;
    if (!item) {
        is_good = not_found(store, id, err);
    } else if (renameat(store->fd, id, state_dir_tmp_fd(store->state), name) != 0) {
        is_good = error_set(err, ERROR_IO, "removing a %s: %s", store->info->noun, strerror(errno));
    } else {
        store->decoded_bytes -= item_bytes(item);
        json_object_del(store->index, id);
        set_last_used(store, ""); /* posted again, its next use is noted again */
    }
    pthread_mutex_unlock(&store->mutex);
    if (is_good)
        state_dir_remove(state_dir_tmp_fd(store->state), name);
    return is_good;
}

json_t *resource_store_list(struct resource_store *store)
{
    pthread_mutex_lock(&store->mutex);
    json_t *copy = json_deep_copy(store->index);
    pthread_mutex_unlock(&store->mutex);
    size_t count = copy ? json_object_size(copy) : 0, i = 0;
    json_t **items = calloc(count + 1, sizeof(json_t *)), *list = json_array(), *item;
    const char *id;
    bool is_good = copy && items && list;
    if (is_good) {
        json_object_foreach(copy, id, item) items[i++] = item;
        qsort(items, count, sizeof(json_t *), compare_created);
    }
    for (i = 0; is_good && i < count; i++)
        is_good = json_array_append(list, items[i]) == 0;
    free(items);
    json_decref(copy);
    if (!is_good)
        json_decref(list);
    return is_good ? list : NULL;
}

void resource_store_note_use(struct resource_store *store, const char *id)
{
    char path[96];
    if (!set_last_used(store, id)) /* each frame of a view */
        return;
    snprintf(path, sizeof path, "%.64s/used", id);
    pthread_mutex_lock(&store->mutex); /* a DELETE must not meet a file that comes to be */
    if (json_object_get(store->index, id) && utimensat(store->fd, path, NULL, 0) != 0 &&
        errno == ENOENT) {
        int fd = openat(store->fd, path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (fd >= 0)
            close(fd);
    }
    pthread_mutex_unlock(&store->mutex);
}

struct use {
    const char *id; /* of the index */
    struct timespec at;
};

static int compare_uses(const void *left, const void *right) /* the last first */
{
    const struct use *a = left, *b = right;
    if (a->at.tv_sec != b->at.tv_sec)
        return a->at.tv_sec < b->at.tv_sec ? 1 : -1;
    return (a->at.tv_nsec < b->at.tv_nsec) - (a->at.tv_nsec > b->at.tv_nsec);
}

size_t resource_store_recent(struct resource_store *store, char (*ids)[DIGEST_TEXT_BYTES],
                             size_t most)
{
    size_t count = 0;
    const char *id;
    json_t *item;
    pthread_mutex_lock(&store->mutex);
    struct use *uses = calloc(json_object_size(store->index) + 1, sizeof *uses);
    json_object_foreach(store->index, id, item)
    {
        char path[96];
        struct stat used;
        snprintf(path, sizeof path, "%.64s/used", id);
        if (uses && fstatat(store->fd, path, &used, AT_SYMLINK_NOFOLLOW) == 0)
            uses[count++] = (struct use){id, used.st_mtim};
    }
    if (count)
        qsort(uses, count, sizeof *uses, compare_uses);
    count = count < most ? count : most;
    for (size_t i = 0; i < count; i++)
        snprintf(ids[i], DIGEST_TEXT_BYTES, "%s", uses[i].id);
    pthread_mutex_unlock(&store->mutex);
    free(uses);
    return count;
}

struct resource_store_totals resource_store_get_totals(struct resource_store *store)
{
    pthread_mutex_lock(&store->mutex);
    struct resource_store_totals totals = {json_object_size(store->index), store->decoded_bytes};
    pthread_mutex_unlock(&store->mutex);
    return totals;
}
