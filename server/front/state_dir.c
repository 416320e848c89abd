/* SPDX-License-Identifier: MIT */
/* Directories that only their owner may read, and new files in one of them. */
#include "server/front/state_dir.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/ipc.h"

struct state_dir {
    int fd, lock_fd, tmp_fd;
    atomic_uint_least64_t next_name;
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

int state_dir_open(struct state_dir *state, const char *name, struct error *err)
{
    return open_directory(state->fd, name, err);
}

static void remove_entry(void *context, const char *name)
{
    const int *fd = context;
    unlinkat(*fd, name, 0);
}

void state_dir_remove(int parent_fd, const char *name)
{
    struct error ignored = {0};
    int fd = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0) {
        unlinkat(parent_fd, name, 0);
        return;
    }
    if (state_dir_for_each(fd, remove_entry, &fd, &ignored))
        unlinkat(parent_fd, name, AT_REMOVEDIR);
    close(fd);
}

bool state_dir_for_each(int fd, void (*visit)(void *context, const char *name), void *context,
                        struct error *err)
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
            visit(context, entry->d_name);
    closedir(directory);
    return true;
}

static void remove_tmp(void *context, const char *name)
{
    const struct state_dir *state = context;
    state_dir_remove(state->tmp_fd, name);
}

static bool take_lock(struct state_dir *state, const char *path, struct error *err)
{
    state->fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    state->lock_fd =
        state->fd < 0 ? -1 : openat(state->fd, "lock", O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (state->lock_fd < 0)
        return error_set(err, ERROR_IO, "state directory '%s': %s", path, strerror(errno));
    return flock(state->lock_fd, LOCK_EX | LOCK_NB) == 0 ||
           error_set(err, ERROR_CONFLICT, "state directory '%s' is in use by another daemon", path);
}

struct state_dir *state_dir_create(const char *path, struct error *err)
{
    struct state_dir *state = calloc(1, sizeof *state);
    if (!state) {
        error_set(err, ERROR_NO_MEMORY, "state directory");
        return NULL;
    }
    state->fd = state->lock_fd = state->tmp_fd = -1;
    if (!make_directories(path, err) || !take_lock(state, path, err))
        goto fail;
    int cache_fd = state_dir_open(state, "cache", err);
    if (cache_fd < 0)
        goto fail;
    close(cache_fd);
    if ((state->tmp_fd = state_dir_open(state, "tmp", err)) < 0 ||
        !state_dir_for_each(state->tmp_fd, remove_tmp, state, err))
        goto fail;
    return state;

fail:
    state_dir_destroy(state);
    return NULL;
}

void state_dir_destroy(struct state_dir *state)
{
    if (!state)
        return;
    int fds[] = {state->tmp_fd, state->fd, state->lock_fd};
    for (size_t i = 0; i < sizeof fds / sizeof *fds; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    free(state);
}

int state_dir_tmp_fd(const struct state_dir *state)
{
    return state->tmp_fd;
}

void state_dir_make_name(struct state_dir *state, const char *prefix, char *name, size_t size_bytes)
{
    unsigned long long number = atomic_fetch_add(&state->next_name, 1);
    snprintf(name, size_bytes, "%s-%llu", prefix, number);
}

int state_dir_open_spool(struct state_dir *state, struct error *err)
{
    int fd = openat(state->tmp_fd, ".", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd < 0) { /* file systems without O_TMPFILE */
        char name[48];
        state_dir_make_name(state, "spool", name, sizeof name);
        fd = openat(state->tmp_fd, name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (fd >= 0)
            unlinkat(state->tmp_fd, name, 0);
    }
    if (fd < 0)
        error_set(err, ERROR_IO, "temporary file: %s", strerror(errno));
    return fd;
}

bool state_dir_write_json(struct state_dir *state, const char *path, const char *what,
                          const json_t *json, struct error *err)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "%s", what);
    int fd =
        openat(state->tmp_fd, path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    bool is_good = fd >= 0 ? ipc_write_all(fd, text, strlen(text), err)
                           : error_set(err, ERROR_IO, "%s: %s", what, strerror(errno));
    if (is_good && fsync(fd) != 0)
        is_good = error_set(err, ERROR_IO, "%s: %s", what, strerror(errno));
    if (fd >= 0)
        close(fd);
    free(text);
    return is_good;
}
