/* SPDX-License-Identifier: MIT */
/* Files of trade-offs: written beside their place, synced, renamed; checked by digest when read. */
#include "server/tradeoffs/tradeoff_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/digest.h"
#include "server/base/ipc.h"

struct tradeoff_store {
    const struct log *log;
    int directory_fd;
};

struct tradeoff_store *tradeoff_store_create(const char *state_dir, const struct log *log,
                                             struct error *err)
{
    char path[4096 + sizeof "/tradeoffs"];
    struct tradeoff_store *store = calloc(1, sizeof *store);
    if (!store) {
        error_set(err, ERROR_NO_MEMORY, "store of trade-offs");
        return NULL;
    }
    snprintf(path, sizeof path, "%s/tradeoffs", state_dir);
    store->log = log;
    store->directory_fd = -1;
    if (mkdir(path, 0700) == 0 || errno == EEXIST)
        store->directory_fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (store->directory_fd >= 0)
        return store;
    error_set(err, ERROR_IO, "state directory, '%.200s': %s", path, strerror(errno));
    tradeoff_store_destroy(store);
    return NULL;
}

void tradeoff_store_destroy(struct tradeoff_store *store)
{
    if (!store)
        return;
    if (store->directory_fd >= 0)
        close(store->directory_fd);
    free(store);
}

static void make_name(char name[64], const char *id, const char *extension)
{
    snprintf(name, 64, "%.16s.%s", id, extension);
}

/* ---- writing ---- */

static bool write_file(struct tradeoff_store *store, const char *name, const char *text,
                       struct error *err)
{
    char head[DIGEST_TEXT_BYTES + 1];
    if (!digest_of(text, strlen(text), head, err))
        return false;
    head[DIGEST_TEXT_BYTES - 1] = '\n';
    int fd = openat(store->directory_fd, name,
                    O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    bool is_good = fd >= 0 && ipc_write_all(fd, head, DIGEST_TEXT_BYTES, err) &&
                   ipc_write_all(fd, text, strlen(text), err) && fsync(fd) == 0;
    if (!is_good)
        error_set(err, ERROR_IO, "saving a trade-off: %s", strerror(errno));
    if (fd >= 0)
        close(fd);
    return is_good;
}

bool tradeoff_store_save(struct tradeoff_store *store, const struct tradeoff *tradeoff,
                         struct error *err)
{
    char name[64], draft[64];
    make_name(name, tradeoff->id, "json");
    make_name(draft, tradeoff->id, "tmp");
    json_t *json = tradeoff_to_json(tradeoff);
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "trade-off");
    bool is_good = write_file(store, draft, text, err);
    free(text);
    if (is_good && (renameat(store->directory_fd, draft, store->directory_fd, name) != 0 ||
                    fsync(store->directory_fd) != 0))
        is_good = error_set(err, ERROR_IO, "saving a trade-off: %s", strerror(errno));
    if (!is_good)
        unlinkat(store->directory_fd, draft, 0);
    return is_good;
}

void tradeoff_store_remove(struct tradeoff_store *store, const char *id)
{
    char name[64];
    make_name(name, id, "json");
    unlinkat(store->directory_fd, name, 0);
    make_name(name, id, "images");
    unlinkat(store->directory_fd, name, 0);
    fsync(store->directory_fd);
}

bool tradeoff_store_add_image(struct tradeoff_store *store, const char *id, int image_fd,
                              uint64_t *offset, uint64_t *bytes, struct error *err)
{
    char name[64];
    struct ipc_mapping image = {0};
    make_name(name, id, "images");
    int fd = openat(store->directory_fd, name, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    off_t end = fd >= 0 ? lseek(fd, 0, SEEK_END) : -1;
    bool is_good = end >= 0 || error_set(err, ERROR_IO, "pictures: %s", strerror(errno));
    is_good = is_good && ipc_mapping_init(&image, image_fd, err) &&
              ipc_write_all(fd, image.bytes, image.size_bytes, err) &&
              (fsync(fd) == 0 || error_set(err, ERROR_IO, "pictures: %s", strerror(errno)));
    if (is_good) {
        *offset = (uint64_t)end;
        *bytes = image.size_bytes;
    }
    ipc_mapping_finish(&image);
    if (fd >= 0)
        close(fd);
    return is_good;
}

int tradeoff_store_open_images(struct tradeoff_store *store, const char *id)
{
    char name[64];
    make_name(name, id, "images");
    return openat(store->directory_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
}

/* ---- reading ---- */

static bool parse(const struct ipc_mapping *file, const char *id, struct tradeoff *tradeoff,
                  struct error *err)
{
    char expected[DIGEST_TEXT_BYTES];
    const char *text = file->bytes;
    if (file->size_bytes <= DIGEST_TEXT_BYTES || file->size_bytes > TRADEOFF_DOCUMENT_BYTES)
        return error_set(err, ERROR_IO, "it has %zu bytes", file->size_bytes);
    if (!digest_of(text + DIGEST_TEXT_BYTES, file->size_bytes - DIGEST_TEXT_BYTES, expected, err))
        return false;
    if (memcmp(expected, text, DIGEST_TEXT_BYTES - 1) != 0)
        return error_set(err, ERROR_IO, "its digest is not that of its content");
    json_t *json =
        json_loadb(text + DIGEST_TEXT_BYTES, file->size_bytes - DIGEST_TEXT_BYTES, 0, NULL);
    bool is_good =
        json ? tradeoff_from_json(json, tradeoff, err) : error_set(err, ERROR_IO, "it is not JSON");
    json_decref(json);
    if (is_good && strcmp(tradeoff->id, id) != 0) {
        tradeoff_finish(tradeoff);
        is_good = error_set(err, ERROR_IO, "it is of another id");
    }
    return is_good;
}

static bool read_file(struct tradeoff_store *store, const char *name, const char *id,
                      struct tradeoff *tradeoff, struct error *err)
{
    struct ipc_mapping file = {0};
    int fd = openat(store->directory_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    bool is_good = fd >= 0 || error_set(err, ERROR_IO, "%s", strerror(errno));
    is_good = is_good && ipc_mapping_init(&file, fd, err) && parse(&file, id, tradeoff, err);
    ipc_mapping_finish(&file);
    if (fd >= 0)
        close(fd);
    return is_good;
}

static void set_aside(struct tradeoff_store *store, const char *name, const struct error *problem)
{
    char aside[300];
    snprintf(aside, sizeof aside, "%s.corrupt", name);
    log_write(store->log, LOG_WARNING, "state directory: trade-off '%s' is set aside: %s", name,
              problem->message);
    renameat(store->directory_fd, name, store->directory_fd, aside);
}

static bool has_extension(const char *name, const char *extension)
{
    size_t length = strlen(name), tail = strlen(extension);
    return length > tail && strcmp(name + length - tail, extension) == 0;
}

struct loading {
    struct tradeoff_store *store;
    void (*visit)(void *context, struct tradeoff *tradeoff);
    void *context;
    struct tradeoff *tradeoff;
};

static void load_entry(struct loading *loading, const char *name)
{
    struct tradeoff_store *store = loading->store;
    struct error problem = {0};
    char id[TRADEOFF_ID_BYTES], document[64];
    snprintf(id, sizeof id, "%.16s", name);
    if (has_extension(name, ".tmp")) {
        unlinkat(store->directory_fd, name, 0);
    } else if (has_extension(name, ".images")) {
        make_name(document, id, "json");
        if (faccessat(store->directory_fd, document, F_OK, 0) != 0)
            unlinkat(store->directory_fd, name, 0);
    } else if (has_extension(name, ".json")) {
        if (read_file(store, name, id, loading->tradeoff, &problem)) {
            loading->visit(loading->context, loading->tradeoff);
            tradeoff_finish(loading->tradeoff);
        } else {
            set_aside(store, name, &problem);
        }
    }
}

bool tradeoff_store_load(struct tradeoff_store *store,
                         void (*visit)(void *context, struct tradeoff *tradeoff), void *context,
                         struct error *err)
{
    struct loading loading = {store, visit, context, calloc(1, sizeof(struct tradeoff))};
    int copy = openat(store->directory_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *directory = copy >= 0 ? fdopendir(copy) : NULL;
    bool is_good = loading.tradeoff && directory;
    if (!is_good)
        error_set(err, ERROR_IO, "reading the trade-offs: %s", strerror(errno));
    for (struct dirent *entry; is_good && (entry = readdir(directory));)
        load_entry(&loading, entry->d_name);
    if (directory)
        closedir(directory);
    else if (copy >= 0)
        close(copy);
    free(loading.tradeoff);
    return is_good;
}
