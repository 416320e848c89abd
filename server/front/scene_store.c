/* SPDX-License-Identifier: MIT */
/* The scene store: an index in memory over directories that appear and vanish whole. */
#include "server/front/scene_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "renderer/scene/scene_blob.h"
#include "server/base/ipc.h"

enum { JSON_FILE_BYTES = 64 << 20 /* above what the outline of 65,536 nodes takes */ };

struct scene_store {
    const struct log *log;
    int lock_fd, scenes_fd, tmp_fd;
    atomic_uint_least64_t next_draft;
    pthread_mutex_t mutex; /* guards index and decoded_bytes */
    json_t *index;         /* id -> item of the list */
    uint64_t decoded_bytes;
    pthread_mutex_t use_mutex; /* guards last_used; taken alone, or inside of mutex */
    char last_used[DIGEST_TEXT_BYTES];
};

static bool make_directories(const char *path, struct error *err)
{
    char part[4096];
    size_t length = strlen(path);
    if (length == 0 || length >= sizeof part)
        return error_set(err, ERROR_IO, "state directory '%s': unusable path", path);
    for (size_t i = 1; i <= length; i++) {
        if (path[i] != '/' && path[i] != '\0')
            continue;
        memcpy(part, path, i);
        part[i] = '\0';
        if (mkdir(part, 0700) != 0 && errno != EEXIST)
            return error_set(err, ERROR_IO, "state directory '%s': %s", part, strerror(errno));
    }
    return true;
}

static int open_directory(int parent_fd, const char *name, struct error *err)
{
    if (mkdirat(parent_fd, name, 0700) != 0 && errno != EEXIST) {
        error_set(err, ERROR_IO, "state directory, '%s': %s", name, strerror(errno));
        return -1;
    }
    int fd = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        error_set(err, ERROR_IO, "state directory, '%s': %s", name, strerror(errno));
    return fd;
}

/* Removes a scene or draft directory: it holds four files at most. */
static void remove_tree(int parent_fd, const char *name)
{
    int fd = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (fd >= 0) {
        unlinkat(fd, "blob", 0);
        unlinkat(fd, "summary.json", 0);
        unlinkat(fd, "outline.json", 0);
        unlinkat(fd, "used", 0);
        close(fd);
        unlinkat(parent_fd, name, AT_REMOVEDIR);
    } else {
        unlinkat(parent_fd, name, 0);
    }
}

/* Calls visit for every entry but "." and ".."; entries may be removed meanwhile. */
static bool for_each_entry(int fd, void (*visit)(struct scene_store *store, const char *name),
                           struct scene_store *store, struct error *err)
{
    int copy = openat(fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *directory = copy >= 0 ? fdopendir(copy) : NULL;
    if (!directory) {
        if (copy >= 0)
            close(copy);
        return error_set(err, ERROR_IO, "reading the state directory: %s", strerror(errno));
    }
    for (struct dirent *entry; (entry = readdir(directory));)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            visit(store, entry->d_name);
    closedir(directory);
    return true;
}

static void remove_tmp(struct scene_store *store, const char *name)
{
    remove_tree(store->tmp_fd, name);
}

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
static json_t *read_summary(int parent_fd, const char *name, struct error *err)
{
    json_t *summary = NULL, *file = read_json(parent_fd, name, "summary", err);
    if (!file)
        return NULL;
    if (json_integer_value(json_object_get(file, "blob_version")) != SCENE_BLOB_VERSION)
        error_set(err, ERROR_IO, "it was decoded by another version of the program");
    else if (!json_is_object(summary = json_object_get(file, "summary")))
        error_set(err, ERROR_IO, "its summary is incomplete");
    json_t *result = err->code == ERROR_NONE ? json_incref(summary) : NULL;
    json_decref(file);
    return result;
}

/* The members of a summary that the list shows. */
static json_t *item_from_summary(const json_t *summary)
{
    static const char *const members[] = {
        "id",          "name",         "triangles", "material_count",
        "light_count", "camera_count", "bytes",     "created"};
    json_t *item = json_object();
    for (size_t i = 0; item && i < sizeof members / sizeof members[0]; i++) {
        json_t *value = json_object_get(summary, members[i]);
        if (json_object_set(item, members[i], value ? value : json_null()) != 0) {
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
static bool index_add(struct scene_store *store, const char *id, json_t *item)
{
    if (!item || json_object_set_new(store->index, id, item) != 0)
        return false;
    store->decoded_bytes += item_bytes(item);
    return true;
}

static void load_scene(struct scene_store *store, const char *name)
{
    struct error problem = {0};
    json_t *summary = NULL;
    char path[96];
    struct stat blob;
    if (!digest_is_text(name))
        error_set(&problem, ERROR_IO, "not the name of a scene");
    else if ((summary = read_summary(store->scenes_fd, name, &problem))) {
        snprintf(path, sizeof path, "%s/blob", name);
        if (fstatat(store->scenes_fd, path, &blob, AT_SYMLINK_NOFOLLOW) != 0 || blob.st_size == 0)
            error_set(&problem, ERROR_IO, "its blob is missing");
        else if (!index_add(store, name, item_from_summary(summary)))
            error_set(&problem, ERROR_NO_MEMORY, "index");
    }
    json_decref(summary);
    if (problem.code == ERROR_NONE)
        return;
    log_write(store->log, LOG_WARNING, "state directory: scene '%s' is removed: %s", name,
              problem.message);
    remove_tree(store->scenes_fd, name);
}

static int compare_created(const void *left, const void *right)
{
    const json_t *const *a = left, *const *b = right;
    const char *first = json_string_value(json_object_get(*a, "created"));
    const char *second = json_string_value(json_object_get(*b, "created"));
    return strcmp(first ? first : "", second ? second : "");
}

struct scene_store *scene_store_create(const char *state_dir, const struct log *log,
                                       struct error *err)
{
    int state_fd = -1;
    struct scene_store *store = calloc(1, sizeof *store);
    if (!store) {
        error_set(err, ERROR_NO_MEMORY, "scene store");
        return NULL;
    }
    store->log = log;
    store->lock_fd = store->scenes_fd = store->tmp_fd = -1;
    pthread_mutex_init(&store->mutex, NULL);
    pthread_mutex_init(&store->use_mutex, NULL);
    store->index = json_object();
    if (!store->index) {
        error_set(err, ERROR_NO_MEMORY, "scene index");
        goto fail;
    }
    if (!make_directories(state_dir, err))
        goto fail;
    state_fd = open(state_dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    store->lock_fd =
        state_fd < 0 ? -1 : openat(state_fd, "lock", O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (store->lock_fd < 0) {
        error_set(err, ERROR_IO, "state directory '%s': %s", state_dir, strerror(errno));
        goto fail;
    }
    if (flock(store->lock_fd, LOCK_EX | LOCK_NB) != 0) {
        error_set(err, ERROR_CONFLICT, "state directory '%s' is in use by another daemon",
                  state_dir);
        goto fail;
    }
    int cache_fd = open_directory(state_fd, "cache", err);
    if (cache_fd < 0)
        goto fail;
    close(cache_fd);
    if ((store->scenes_fd = open_directory(state_fd, "scenes", err)) < 0 ||
        (store->tmp_fd = open_directory(state_fd, "tmp", err)) < 0 ||
        !for_each_entry(store->tmp_fd, remove_tmp, store, err) ||
        !for_each_entry(store->scenes_fd, load_scene, store, err))
        goto fail;
    close(state_fd);
    return store;

fail:
    if (state_fd >= 0)
        close(state_fd);
    scene_store_destroy(store);
    return NULL;
}

void scene_store_destroy(struct scene_store *store)
{
    if (!store)
        return;
    json_decref(store->index);
    pthread_mutex_destroy(&store->use_mutex);
    pthread_mutex_destroy(&store->mutex);
    int fds[] = {store->tmp_fd, store->scenes_fd, store->lock_fd};
    for (size_t i = 0; i < 3; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    free(store);
}

static void make_name(struct scene_store *store, const char *prefix, char *name, size_t size_bytes)
{
    unsigned long long number = atomic_fetch_add(&store->next_draft, 1);
    snprintf(name, size_bytes, "%s-%llu", prefix, number);
}

int scene_store_open_spool(struct scene_store *store, struct error *err)
{
    int fd = openat(store->tmp_fd, ".", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd < 0) { /* file systems without O_TMPFILE */
        char name[48];
        make_name(store, "spool", name, sizeof name);
        fd = openat(store->tmp_fd, name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (fd >= 0)
            unlinkat(store->tmp_fd, name, 0);
    }
    if (fd < 0)
        error_set(err, ERROR_IO, "temporary file: %s", strerror(errno));
    return fd;
}

bool scene_draft_begin(struct scene_store *store, struct scene_draft *draft, struct error *err)
{
    *draft = (struct scene_draft){.blob_fd = -1};
    make_name(store, "draft", draft->name, sizeof draft->name);
    char path[64];
    snprintf(path, sizeof path, "%s/blob", draft->name);
    if (mkdirat(store->tmp_fd, draft->name, 0700) == 0)
        draft->blob_fd =
            openat(store->tmp_fd, path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (draft->blob_fd >= 0)
        return true;
    error_set(err, ERROR_IO, "new scene: %s", strerror(errno));
    scene_draft_discard(store, draft);
    return false;
}

void scene_draft_discard(struct scene_store *store, struct scene_draft *draft)
{
    if (!draft->name[0])
        return;
    if (draft->blob_fd >= 0)
        close(draft->blob_fd);
    remove_tree(store->tmp_fd, draft->name);
    *draft = (struct scene_draft){0};
}

/* A new file in STATE/tmp, on the disk when this returns. */
static bool write_json(struct scene_store *store, const char *path, const char *what,
                       const json_t *json, struct error *err)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "%s of a scene", what);
    int fd =
        openat(store->tmp_fd, path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    bool is_good = fd >= 0 ? ipc_write_all(fd, text, strlen(text), err)
                           : error_set(err, ERROR_IO, "%s of a scene: %s", what, strerror(errno));
    if (is_good && fsync(fd) != 0)
        is_good = error_set(err, ERROR_IO, "%s of a scene: %s", what, strerror(errno));
    if (fd >= 0)
        close(fd);
    free(text);
    return is_good;
}

/* The outline has a file of its own: it can be large, and few ask for it. */
static bool write_summary(struct scene_store *store, const char *draft, json_t *summary,
                          struct error *err)
{
    json_t *outline = json_incref(json_object_get(summary, "outline"));
    json_object_del(summary, "outline");
    json_t *file = json_pack("{s:i,s:O}", "blob_version", SCENE_BLOB_VERSION, "summary", summary);
    char outline_path[64], summary_path[64];
    snprintf(outline_path, sizeof outline_path, "%s/outline.json", draft);
    snprintf(summary_path, sizeof summary_path, "%s/summary.json", draft);
    bool is_good = write_json(store, outline_path, "outline", outline, err) &&
                   write_json(store, summary_path, "summary", file, err);
    json_decref(file);
    json_decref(outline);
    return is_good;
}

/* The directory of the draft reaches the disk before its new name does. */
static bool sync_draft(struct scene_store *store, const struct scene_draft *draft,
                       struct error *err)
{
    int fd = openat(store->tmp_fd, draft->name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool is_good = fd >= 0 && fsync(draft->blob_fd) == 0 && fsync(fd) == 0;
    if (!is_good)
        error_set(err, ERROR_IO, "saving a scene: %s", strerror(errno));
    if (fd >= 0)
        close(fd);
    return is_good;
}

/* Renames and indexes under the mutex, so that a DELETE of the same id comes wholly before or
 * after. */
static bool publish(struct scene_store *store, struct scene_draft *draft, const char *id,
                    json_t *item, bool *is_new, struct error *err)
{
    bool is_good = true;
    pthread_mutex_lock(&store->mutex);
    if (json_object_get(store->index, id)) {
        *is_new = false;
    } else if (json_object_size(store->index) >= SCENES_STORED_MAX) {
        is_good =
            error_set(err, ERROR_TOO_LARGE, "%d scenes are stored, which is the limit: delete some",
                      SCENES_STORED_MAX);
    } else if (renameat(store->tmp_fd, draft->name, store->scenes_fd, id) != 0) {
        is_good = error_set(err, ERROR_IO, "publishing a scene: %s", strerror(errno));
    } else if (fsync(store->scenes_fd) != 0 || !index_add(store, id, json_incref(item))) {
        is_good = error_set(err, ERROR_IO, "publishing a scene: %s", strerror(errno));
        remove_tree(store->scenes_fd, id);
    } else {
        *is_new = true;
    }
    pthread_mutex_unlock(&store->mutex);
    return is_good;
}

bool scene_draft_commit(struct scene_store *store, struct scene_draft *draft,
                        const struct scene_summary *summary, bool *is_new, struct error *err)
{
    json_t *json = scene_summary_to_json(summary);
    json_t *item = json ? item_from_summary(json) : NULL;
    bool is_good = item ? write_summary(store, draft->name, json, err) &&
                              sync_draft(store, draft, err) &&
                              publish(store, draft, summary->id, item, is_new, err)
                        : error_set(err, ERROR_NO_MEMORY, "summary of a scene");
    json_decref(item);
    json_decref(json);
    return is_good;
}

bool scene_store_has(struct scene_store *store, const char *id)
{
    pthread_mutex_lock(&store->mutex);
    bool is_there = json_object_get(store->index, id) != NULL;
    pthread_mutex_unlock(&store->mutex);
    return is_there;
}

static bool not_found(const char *id, struct error *err)
{
    return error_set(err, ERROR_NOT_FOUND, "there is no scene '%.64s'", id);
}

int scene_store_open_blob(struct scene_store *store, const char *id, struct error *err)
{
    char path[96];
    snprintf(path, sizeof path, "%.64s/blob", id);
    int fd = scene_store_has(store, id)
                 ? openat(store->scenes_fd, path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW)
                 : -1;
    if (fd < 0)
        not_found(id, err);
    return fd;
}

static json_t *get_json(struct scene_store *store, const char *id,
                        json_t *(*read)(int parent_fd, const char *name, struct error *err),
                        struct error *err)
{
    struct error problem = {0};
    json_t *json = scene_store_has(store, id) ? read(store->scenes_fd, id, &problem) : NULL;
    if (!json && problem.code == ERROR_NONE)
        not_found(id, &problem);
    if (!json && err)
        *err = problem;
    return json;
}

json_t *scene_store_get_summary(struct scene_store *store, const char *id, struct error *err)
{
    return get_json(store, id, read_summary, err);
}

static json_t *read_outline(int parent_fd, const char *name, struct error *err)
{
    return read_json(parent_fd, name, "outline", err);
}

json_t *scene_store_get_outline(struct scene_store *store, const char *id, struct error *err)
{
    return get_json(store, id, read_outline, err);
}

/* The caller holds the mutex. */
static bool replace_summary(struct scene_store *store, const char *id, const json_t *summary,
                            struct error *err)
{
    char draft[48], path[96];
    make_name(store, "summary", draft, sizeof draft);
    snprintf(path, sizeof path, "%.64s/summary.json", id);
    json_t *file = json_pack("{s:i,s:O}", "blob_version", SCENE_BLOB_VERSION, "summary", summary);
    bool is_good = write_json(store, draft, "summary", file, err);
    if (is_good && renameat(store->tmp_fd, draft, store->scenes_fd, path) != 0)
        is_good = error_set(err, ERROR_IO, "renaming a scene: %s", strerror(errno));
    if (!is_good)
        unlinkat(store->tmp_fd, draft, 0);
    json_decref(file);
    return is_good;
}

bool scene_store_rename(struct scene_store *store, const char *id, const char *name,
                        struct error *err)
{
    struct error problem = {0};
    pthread_mutex_lock(&store->mutex);
    json_t *item = json_object_get(store->index, id);
    json_t *summary = item ? read_summary(store->scenes_fd, id, &problem) : NULL;
    json_t *text = name ? json_string(name) : json_null();
    if (!item)
        not_found(id, &problem);
    else if (summary && json_object_set(summary, "name", text) != 0)
        error_set(&problem, ERROR_NO_MEMORY, "name of a scene");
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
static bool set_last_used(struct scene_store *store, const char *id)
{
    pthread_mutex_lock(&store->use_mutex);
    bool is_other = strcmp(store->last_used, id) != 0;
    snprintf(store->last_used, sizeof store->last_used, "%s", id);
    pthread_mutex_unlock(&store->use_mutex);
    return is_other;
}

bool scene_store_remove(struct scene_store *store, const char *id, struct error *err)
{
    char name[48];
    make_name(store, "dead", name, sizeof name);
    pthread_mutex_lock(&store->mutex);
    json_t *item = json_object_get(store->index, id);
    bool is_good = true;
    if (!item) {
        is_good = not_found(id, err);
    } else if (renameat(store->scenes_fd, id, store->tmp_fd, name) != 0) {
        is_good = error_set(err, ERROR_IO, "removing a scene: %s", strerror(errno));
    } else {
        store->decoded_bytes -= item_bytes(item);
        json_object_del(store->index, id);
        set_last_used(store, ""); /* posted again, its next use is noted again */
    }
    pthread_mutex_unlock(&store->mutex);
    if (is_good)
        remove_tree(store->tmp_fd, name);
    return is_good;
}

json_t *scene_store_list(struct scene_store *store)
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

void scene_store_note_use(struct scene_store *store, const char *id)
{
    char path[96];
    if (!set_last_used(store, id)) /* each frame of a view */
        return;
    snprintf(path, sizeof path, "%.64s/used", id);
    pthread_mutex_lock(&store->mutex); /* a DELETE must not meet a file that comes to be */
    if (json_object_get(store->index, id) && utimensat(store->scenes_fd, path, NULL, 0) != 0 &&
        errno == ENOENT) {
        int fd = openat(store->scenes_fd, path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
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

size_t scene_store_recent(struct scene_store *store, char (*ids)[DIGEST_TEXT_BYTES], size_t most)
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
        if (uses && fstatat(store->scenes_fd, path, &used, AT_SYMLINK_NOFOLLOW) == 0)
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

struct scene_store_totals scene_store_get_totals(struct scene_store *store)
{
    pthread_mutex_lock(&store->mutex);
    struct scene_store_totals totals = {json_object_size(store->index), store->decoded_bytes};
    pthread_mutex_unlock(&store->mutex);
    return totals;
}
