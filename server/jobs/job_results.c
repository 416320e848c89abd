/* SPDX-License-Identifier: MIT */
/* Folders are opened step by step without following links, so that nothing leads out of them. */
#include "server/jobs/job_results.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/base/ipc.h"
#include "server/front/state_dir.h"

enum { COPY_BYTES = 1 << 16, NAME_BYTES = 300 };
enum { FOLDER_FLAGS = O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW };

struct job_results {
    int jobs_fd;
    char allowed[4096]; /* opened anew each time: it may be mounted later, or disappear */
};

struct job_results *job_results_create(const char *jobs, const char *allowed, struct error *err)
{
    struct job_results *results = calloc(1, sizeof *results);
    if (!results) {
        error_set(err, ERROR_NO_MEMORY, "results of jobs");
        return NULL;
    }
    snprintf(results->allowed, sizeof results->allowed, "%s", allowed);
    if (mkdir(jobs, 0700) != 0 && errno != EEXIST)
        results->jobs_fd = -1;
    else
        results->jobs_fd = open(jobs, FOLDER_FLAGS);
    if (results->jobs_fd >= 0)
        return results;
    error_set(err, ERROR_IO, "results of jobs, '%.200s': %s", jobs, strerror(errno));
    free(results);
    return NULL;
}

void job_results_destroy(struct job_results *results)
{
    if (!results)
        return;
    close(results->jobs_fd);
    free(results);
}

/* ---- folders ---- */

/* Opens a folder of another one, which is closed; makes it where it is not there. */
static int step_into(int parent_fd, const char *name, bool may_make)
{
    int mode = 0777; /* less the umask: what farms read later */
    int fd = -1;
    if (!may_make || mkdirat(parent_fd, name, (mode_t)mode) == 0 || errno == EEXIST)
        fd = openat(parent_fd, name, FOLDER_FLAGS);
    int problem = errno;
    close(parent_fd);
    errno = problem;
    return fd;
}

static int open_allowed(struct job_results *results, const char *directory, bool may_make,
                        struct error *err)
{
    char name[NAME_BYTES];
    int fd = open(results->allowed, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    for (const char *at = directory; fd >= 0 && *at;) {
        size_t length = strcspn(at, "/");
        snprintf(name, sizeof name, "%.*s", (int)length, at);
        fd = step_into(fd, name, may_make);
        at += length + (at[length] == '/');
    }
    if (fd < 0)
        error_set(err, errno == ENOENT && !may_make ? ERROR_NOT_FOUND : ERROR_IO,
                  "folder '%s' of the directory for jobs: %s", directory, strerror(errno));
    return fd;
}

static int open_place(struct job_results *results, const struct job_place *place, bool may_make,
                      struct error *err)
{
    if (*place->directory && !*results->allowed) {
        error_set_at(err, ERROR_UNSUPPORTED, "/directory",
                     "/directory: this server has no directory for jobs (--job-dir); without "
                     "'directory' it keeps the results itself");
        return -1;
    }
    if (*place->directory)
        return open_allowed(results, place->directory, may_make, err);
    if (may_make && mkdirat(results->jobs_fd, place->id, 0700) != 0 && errno != EEXIST) {
        error_set(err, ERROR_IO, "folder of job %s: %s", place->id, strerror(errno));
        return -1;
    }
    int fd = openat(results->jobs_fd, place->id, FOLDER_FLAGS);
    if (fd < 0)
        error_set(err, errno == ENOENT ? ERROR_NOT_FOUND : ERROR_IO, "folder of job %s: %s",
                  place->id, strerror(errno));
    return fd;
}

bool job_results_prepare(struct job_results *results, const struct job_place *place,
                         struct error *err)
{
    int fd = open_place(results, place, true, err);
    if (fd >= 0)
        close(fd);
    return fd >= 0;
}

/* The directory of a job was there when it was submitted: where it is not, it was taken away, or
 * what is mounted there was, and the files that are done with it. */
static int open_to_write(struct job_results *results, const struct job_place *place,
                         struct error *err)
{
    int fd = open_place(results, place, !*place->directory || place->makes_directory, err);
    if (fd < 0 && err->code == ERROR_NOT_FOUND)
        err->code = ERROR_IO;
    return fd;
}

/* ---- files ---- */

static bool copy(int from_fd, int to_fd, uint64_t *size_bytes, char digest_text[DIGEST_TEXT_BYTES],
                 struct error *err)
{
    static const size_t piece_bytes = COPY_BYTES;
    struct digest *digest = digest_create(err);
    char *piece = malloc(piece_bytes);
    bool is_good = digest && (piece || error_set(err, ERROR_NO_MEMORY, "result of a job"));
    ssize_t count = 1;
    *size_bytes = 0;
    while (is_good && count > 0) {
        count = pread(from_fd, piece, piece_bytes, (off_t)*size_bytes);
        if (count < 0 && errno != EINTR)
            is_good = error_set(err, ERROR_IO, "reading a picture: %s", strerror(errno));
        else if (count < 0)
            count = 1;
        else if (count > 0) {
            digest_write(digest, piece, (size_t)count);
            *size_bytes += (uint64_t)count;
            is_good = ipc_write_all(to_fd, piece, (size_t)count, err);
        }
    }
    if (is_good)
        digest_end(digest, digest_text);
    digest_destroy(digest);
    free(piece);
    return is_good;
}

bool job_results_put(struct job_results *results, const struct job_place *place, const char *name,
                     int from_fd, uint64_t *size_bytes, char digest[DIGEST_TEXT_BYTES],
                     struct error *err)
{
    char draft[NAME_BYTES];
    int folder_fd = open_to_write(results, place, err);
    if (folder_fd < 0)
        return false;
    snprintf(draft, sizeof draft, ".%s.tmp", name);
    int fd = openat(folder_fd, draft, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    bool is_good = fd >= 0 || error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno));
    is_good = is_good && copy(from_fd, fd, size_bytes, digest, err) &&
              (fsync(fd) == 0 || error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno)));
    if (fd >= 0 && close(fd) != 0 && is_good)
        is_good = error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno));
    if (is_good && (renameat(folder_fd, draft, folder_fd, name) != 0 || fsync(folder_fd) != 0))
        is_good = error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno));
    if (!is_good)
        unlinkat(folder_fd, draft, 0);
    close(folder_fd);
    return is_good;
}

static void name_draft(const char *name, char draft[NAME_BYTES])
{
    snprintf(draft, NAME_BYTES, ".%s.joined", name);
}

int job_results_draft(struct job_results *results, const struct job_place *place, const char *name,
                      struct error *err)
{
    char draft[NAME_BYTES];
    int folder_fd = open_to_write(results, place, err);
    if (folder_fd < 0)
        return -1;
    name_draft(name, draft);
    int fd = openat(folder_fd, draft, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (fd < 0)
        error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno));
    close(folder_fd);
    return fd;
}

bool job_results_hash(int draft_fd, uint64_t *size_bytes, char digest_text[DIGEST_TEXT_BYTES],
                      struct error *err)
{
    static const size_t piece_bytes = COPY_BYTES;
    struct digest *digest = digest_create(err);
    char *piece = malloc(piece_bytes);
    bool is_good = digest && (piece || error_set(err, ERROR_NO_MEMORY, "result of a job"));
    ssize_t count = 1;
    *size_bytes = 0;
    while (is_good && count > 0) {
        count = pread(draft_fd, piece, piece_bytes, (off_t)*size_bytes);
        is_good = count >= 0 || error_set(err, ERROR_IO, "reading a picture: %s", strerror(errno));
        if (count > 0) {
            digest_write(digest, piece, (size_t)count);
            *size_bytes += (uint64_t)count;
        }
    }
    is_good = is_good && (fsync(draft_fd) == 0 ||
                          error_set(err, ERROR_IO, "a picture of tiles: %s", strerror(errno)));
    if (is_good)
        digest_end(digest, digest_text);
    digest_destroy(digest);
    free(piece);
    return is_good;
}

void job_results_drop(struct job_results *results, const struct job_place *place, const char *name)
{
    char draft[NAME_BYTES];
    struct error ignored = {0};
    int folder_fd = open_place(results, place, false, &ignored);
    if (folder_fd < 0)
        return;
    name_draft(name, draft);
    unlinkat(folder_fd, draft, 0);
    close(folder_fd);
}

bool job_results_adopt(struct job_results *results, const struct job_place *place, const char *name,
                       struct error *err)
{
    char draft[NAME_BYTES];
    int folder_fd = open_place(results, place, false, err);
    if (folder_fd < 0)
        return false;
    name_draft(name, draft);
    bool is_good = (renameat(folder_fd, draft, folder_fd, name) == 0 && fsync(folder_fd) == 0) ||
                   error_set(err, ERROR_IO, "'%s': %s", name, strerror(errno));
    close(folder_fd);
    return is_good;
}

int job_results_folder(struct job_results *results, const struct job_place *place,
                       struct error *err)
{
    return open_place(results, place, false, err);
}

int job_results_open(struct job_results *results, const struct job_place *place, const char *name,
                     struct error *err)
{
    int folder_fd = open_place(results, place, false, err);
    if (folder_fd < 0)
        return -1;
    int fd = openat(folder_fd, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        error_set(err, errno == ENOENT ? ERROR_NOT_FOUND : ERROR_IO, "the file '%s' of the job: %s",
                  name, strerror(errno));
    close(folder_fd);
    return fd;
}

bool job_results_have(struct job_results *results, const struct job_place *place, const char *name,
                      uint64_t size_bytes)
{
    struct error ignored = {0};
    struct stat file;
    int fd = job_results_open(results, place, name, &ignored);
    bool is_there = fd >= 0 && fstat(fd, &file) == 0 && (uint64_t)file.st_size == size_bytes;
    if (fd >= 0)
        close(fd);
    return is_there;
}

void job_results_remove(struct job_results *results, const char *id)
{
    state_dir_remove(results->jobs_fd, id);
}
