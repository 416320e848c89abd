/* SPDX-License-Identifier: MIT */
/* Files of program binaries: a header that says what it is of, and the driver's bytes. */
#include "renderer/gl/program_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "renderer/base/file_write.h"

/* A draft is NAME.PID.draft: one process writes it, or tries it. */
static const char SUFFIX[] = ".program", DRAFT[] = ".draft";

enum { NAME_BYTES = 96 };

struct header { /* in the order of this machine: the file does not travel */
    char magic[8];
    struct content_key driver, source, content; /* content: of the bytes that follow */
    uint64_t size_bytes;
    uint32_t format, version;
};
static const char MAGIC[] = "VITRPROG"; /* its zero stays at home */
enum { VERSION = 1 };

struct program_store {
    int folder_fd;
    struct content_key driver;
    uint64_t budget_bytes;
    struct program_store_totals totals;
};

static bool ends_with(const char *name, const char *suffix)
{
    size_t length = strlen(name), end = strlen(suffix);
    return length > end && !strcmp(name + length - end, suffix);
}

static void name_of(const struct program_store *store, struct content_key source,
                    char name[NAME_BYTES])
{
    snprintf(name, NAME_BYTES, "%016" PRIx64 "%016" PRIx64 "-%016" PRIx64 "%s", source.words[0],
             source.words[1], store->driver.words[0], SUFFIX);
}

/* ---- what is there ---- */

struct stored_file {
    char name[NAME_BYTES];
    uint64_t bytes;
    struct timespec used;
};

static int older_first(const void *a, const void *b)
{
    const struct stored_file *x = a, *y = b;
    if (x->used.tv_sec != y->used.tv_sec)
        return x->used.tv_sec < y->used.tv_sec ? -1 : 1;
    if (x->used.tv_nsec != y->used.tv_nsec)
        return x->used.tv_nsec < y->used.tv_nsec ? -1 : 1;
    return strcmp(x->name, y->name);
}

static bool add_file(struct stored_file **files, size_t *count, const struct stored_file *file)
{
    if (!(*count & (*count - 1))) { /* grows at powers of two */
        void *grown = realloc(*files, (*count ? 2 * *count : 1) * sizeof **files);
        if (!grown)
            return false;
        *files = grown;
    }
    (*files)[(*count)++] = *file;
    return true;
}

/* Whether the process of a draft has ended, or is this one, which tries none between two calls. A
 * name without a number is of an older version. */
static bool is_left_behind(const char *draft)
{
    int pid = 0;
    const char *number = strstr(draft, SUFFIX);
    bool is_named = number && sscanf(number + strlen(SUFFIX), ".%d.draft", &pid) == 1 && pid > 0;
    return !is_named || pid == (int)getpid() || (kill((pid_t)pid, 0) != 0 && errno == ESRCH);
}

/* Our files, the least recently used first; drafts that a process left behind are removed. The
 * caller frees. NULL with a count of 0 when there are none, or no memory. */
static struct stored_file *list_files(const struct program_store *store, size_t *count)
{
    struct stored_file *files = NULL;
    int fd = openat(store->folder_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = fd >= 0 ? fdopendir(fd) : NULL;
    *count = 0;
    if (!folder && fd >= 0)
        close(fd);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        struct stat status;
        struct stored_file file = {.bytes = 0};
        if (ends_with(entry->d_name, DRAFT) && is_left_behind(entry->d_name))
            unlinkat(store->folder_fd, entry->d_name, 0);
        if (!ends_with(entry->d_name, SUFFIX) || strlen(entry->d_name) >= sizeof file.name ||
            fstatat(store->folder_fd, entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0 ||
            !S_ISREG(status.st_mode))
            continue;
        memcpy(file.name, entry->d_name, strlen(entry->d_name));
        file.bytes = (uint64_t)status.st_size;
        file.used = status.st_mtim;
        if (!add_file(&files, count, &file))
            break;
    }
    if (folder)
        closedir(folder);
    if (files)
        qsort(files, *count, sizeof *files, older_first);
    return files;
}

/* Counts what is there, and removes what is too much. */
static void trim(struct program_store *store)
{
    size_t count;
    struct stored_file *files = list_files(store, &count);
    struct program_store_totals *totals = &store->totals;
    totals->files = totals->bytes = 0;
    for (size_t i = 0; i < count; i++) {
        totals->files++;
        totals->bytes += files[i].bytes;
    }
    for (size_t i = 0; i < count && totals->bytes > store->budget_bytes; i++) {
        if (unlinkat(store->folder_fd, files[i].name, 0) != 0)
            continue;
        totals->files--;
        totals->bytes -= files[i].bytes;
        totals->evicted++;
    }
    free(files);
}

/* And the folder that it lies in. */
static bool make_folder(const char *path)
{
    if (mkdir(path, 0700) == 0 || errno == EEXIST)
        return true;
    const char *end = strrchr(path, '/');
    char *parent = errno == ENOENT && end ? strndup(path, (size_t)(end - path)) : NULL;
    bool is_made = parent && mkdir(parent, 0700) == 0 && mkdir(path, 0700) == 0;
    free(parent);
    return is_made;
}

struct program_store *program_store_open(const struct program_store_desc *desc, struct error *err)
{
    struct program_store *store = calloc(1, sizeof *store);
    if (!store) {
        error_set(err, ERROR_NO_MEMORY, "program store");
        return NULL;
    }
    store->driver = content_key_begin();
    content_key_add_text(&store->driver, desc->driver);
    store->budget_bytes = desc->budget_bytes;
    bool is_there = make_folder(desc->folder);
    store->folder_fd =
        is_there ? open(desc->folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC) : -1;
    if (store->folder_fd < 0) {
        error_set(err, ERROR_IO, "folder of programs '%s': %s", desc->folder, strerror(errno));
        free(store);
        return NULL;
    }
    trim(store);
    return store;
}

void program_store_close(struct program_store *store)
{
    if (!store)
        return;
    close(store->folder_fd);
    free(store);
}

/* ---- one file ---- */

void program_binary_finish(struct program_binary *binary)
{
    free(binary->bytes);
    *binary = (struct program_binary){0};
}

static struct content_key key_of_bytes(const struct program_binary *binary)
{
    struct content_key key = content_key_begin();
    content_key_add_word(&key, binary->format);
    content_key_add(&key, binary->bytes, binary->size_bytes);
    return key;
}

static bool read_all(int fd, void *bytes, size_t size_bytes)
{
    for (size_t done = 0; done < size_bytes;) {
        ssize_t got = read(fd, (char *)bytes + done, size_bytes - done);
        if (got <= 0 && !(got < 0 && errno == EINTR))
            return false;
        done += got > 0 ? (size_t)got : 0;
    }
    return true;
}

/* Nothing that the file says is believed before it was checked. */
static bool read_file(int fd, const struct program_store *store, struct content_key source,
                      struct program_binary *binary)
{
    struct header header;
    struct stat status;
    if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode) ||
        !read_all(fd, &header, sizeof header) ||
        memcmp(header.magic, MAGIC, sizeof header.magic) != 0 || header.version != VERSION ||
        !content_key_equals(header.driver, store->driver) ||
        !content_key_equals(header.source, source) || !header.size_bytes ||
        header.size_bytes > PROGRAM_BINARY_BYTES_MAX ||
        (uint64_t)status.st_size != sizeof header + header.size_bytes)
        return false;
    *binary = (struct program_binary){.format = header.format,
                                      .bytes = malloc(header.size_bytes),
                                      .size_bytes = header.size_bytes};
    return binary->bytes && read_all(fd, binary->bytes, binary->size_bytes) &&
           content_key_equals(header.content, key_of_bytes(binary));
}

bool program_store_has(const struct program_store *store, struct content_key source)
{
    struct stat status;
    char name[NAME_BYTES];
    name_of(store, source, name);
    return fstatat(store->folder_fd, name, &status, AT_SYMLINK_NOFOLLOW) == 0 &&
           S_ISREG(status.st_mode);
}

/* No longer there, under that name. */
static void remove_file(struct program_store *store, const char *name)
{
    struct stat status;
    if (fstatat(store->folder_fd, name, &status, AT_SYMLINK_NOFOLLOW) != 0 ||
        unlinkat(store->folder_fd, name, 0) != 0)
        return;
    store->totals.files -= store->totals.files > 0;
    uint64_t bytes = S_ISREG(status.st_mode) ? (uint64_t)status.st_size : 0;
    store->totals.bytes -= bytes < store->totals.bytes ? bytes : store->totals.bytes;
}

static void draft_of(const struct program_store *store, struct content_key source,
                     char name[NAME_BYTES], char draft[NAME_BYTES])
{
    name_of(store, source, name);
    snprintf(draft, NAME_BYTES, "%.72s.%d%s", name, (int)getpid(), DRAFT);
}

bool program_store_read(struct program_store *store, struct content_key source,
                        struct program_binary *binary)
{
    char name[NAME_BYTES], draft[NAME_BYTES];
    draft_of(store, source, name, draft);
    *binary = (struct program_binary){0};
    int fd = openat(store->folder_fd, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return false;
    bool is_good = read_file(fd, store, source, binary);
    if (is_good)
        futimens(fd, NULL); /* used now */
    close(fd);
    if (is_good && renameat(store->folder_fd, name, store->folder_fd, draft) == 0)
        return true;
    program_binary_finish(binary);
    store->totals.refused++;
    remove_file(store, name);
    return false;
}

void program_store_confirm(struct program_store *store, struct content_key source)
{
    char name[NAME_BYTES], draft[NAME_BYTES];
    draft_of(store, source, name, draft);
    store->totals.confirmed += renameat(store->folder_fd, draft, store->folder_fd, name) == 0;
}

void program_store_drop(struct program_store *store, struct content_key source)
{
    char name[NAME_BYTES], draft[NAME_BYTES];
    draft_of(store, source, name, draft);
    remove_file(store, draft);
    store->totals.dropped++;
}

void program_store_write(struct program_store *store, struct content_key source,
                         const struct program_binary *binary)
{
    struct header header = {.driver = store->driver,
                            .source = source,
                            .content = key_of_bytes(binary),
                            .size_bytes = binary->size_bytes,
                            .format = binary->format,
                            .version = VERSION};
    char name[NAME_BYTES], draft[NAME_BYTES];
    memcpy(header.magic, MAGIC, sizeof header.magic);
    draft_of(store, source, name, draft);
    uint64_t bytes = sizeof header + binary->size_bytes;
    if (!binary->size_bytes || binary->size_bytes > PROGRAM_BINARY_BYTES_MAX ||
        bytes > store->budget_bytes)
        return;
    unlinkat(store->folder_fd, draft, 0); /* of a process that is gone */
    int fd =
        openat(store->folder_fd, draft, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (fd < 0)
        return;
    bool is_good = file_write_all(fd, &header, sizeof header) &&
                   file_write_all(fd, binary->bytes, binary->size_bytes);
    is_good = close(fd) == 0 && is_good;
    remove_file(store, name); /* one that stood there is counted no more */
    if (!is_good || renameat(store->folder_fd, draft, store->folder_fd, name) != 0) {
        unlinkat(store->folder_fd, draft, 0);
        return;
    }
    store->totals.written++;
    store->totals.files++;
    store->totals.bytes += bytes;
    if (store->totals.bytes > store->budget_bytes)
        trim(store);
}

void program_store_get_totals(const struct program_store *store,
                              struct program_store_totals *totals)
{
    *totals = store->totals;
}
