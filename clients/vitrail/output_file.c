/* SPDX-License-Identifier: MIT */
/* Atomic outputs: temporary file in the same folder, fsync, rename, fsync of the folder. */
#include "clients/vitrail/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool fail_create(struct output_file *file, struct failure *failure)
{
    return fail(failure, EXIT_CODE_CANT_CREATE, "cannot write '%s': %s", file->path,
                strerror(errno));
}

/* Replaces `place` by what a symbolic link there points at, so that the link itself survives. */
static bool follow_link(struct output_file *file, const struct stat *at, struct failure *failure)
{
    char *target;

    if (!S_ISLNK(at->st_mode))
        return true;
    target = realpath(file->place, NULL);
    if (!target)
        return fail_create(file, failure);
    free(file->place);
    file->place = target;
    return true;
}

static bool open_directly(struct output_file *file, struct failure *failure)
{
    int fd = open(file->place, O_WRONLY | O_CLOEXEC);

    free(file->place);
    file->place = NULL;
    if (fd < 0)
        return fail_create(file, failure);
    file->stream = fdopen(fd, "wb");
    if (!file->stream) {
        close(fd);
        return fail_no_memory(failure);
    }
    return true;
}

/* ".NAME.XXXXXX" beside NAME: hidden, so that a farm that lists a folder for frames never sees it.
 */
static char *temporary_template(const char *place)
{
    const char *slash = strrchr(place, '/');
    int folder_length = slash ? (int)(slash - place) + 1 : 0;
    char *path = NULL;

    if (asprintf(&path, "%.*s.%.200s.XXXXXX", folder_length, place, place + folder_length) < 0)
        return NULL;
    return path;
}

static bool open_temporary(struct output_file *file, struct failure *failure)
{
    mode_t mask;
    int fd;
    char *path = temporary_template(file->place);

    if (!path)
        return fail_no_memory(failure);
    fd = mkostemp(path, O_CLOEXEC);
    if (fd < 0) {
        free(path);
        return fail_create(file, failure);
    }
    file->temporary = path;
    mask = umask(0);
    umask(mask);
    if (fchmod(fd, 0666 & ~mask) != 0) {
        close(fd);
        return fail_create(file, failure);
    }
    file->stream = fdopen(fd, "wb");
    if (!file->stream) {
        close(fd);
        return fail_no_memory(failure);
    }
    return true;
}

bool output_file_open(struct output_file *file, const char *path, struct failure *failure)
{
    struct stat at;

    *file = (struct output_file){.path = strdup(path)};
    if (!file->path)
        return fail_no_memory(failure);
    if (!strcmp(path, "-")) {
        file->stream = stdout;
        return true;
    }
    file->place = strdup(path);
    if (!file->place)
        return fail_no_memory(failure);
    if (!*path || path[strlen(path) - 1] == '/')
        return fail(failure, EXIT_CODE_CANT_CREATE, "cannot write '%s': not a file name", path);
    if (lstat(path, &at) == 0) {
        if (!follow_link(file, &at, failure))
            return false;
        if (stat(path, &at) == 0 && S_ISDIR(at.st_mode))
            return fail(failure, EXIT_CODE_CANT_CREATE, "cannot write '%s': it is a folder", path);
        if (!S_ISREG(at.st_mode))
            return open_directly(file, failure);
    }
    return open_temporary(file, failure);
}

bool output_file_write(struct output_file *file, const void *bytes, size_t size_bytes,
                       struct failure *failure)
{
    if (fwrite(bytes, 1, size_bytes, file->stream) != size_bytes)
        return fail_create(file, failure);
    file->size_bytes += size_bytes;
    return true;
}

/* The rename is durable once its folder is synced. Some file systems cannot; then it is not our
 * failure. */
static void sync_folder(const char *place)
{
    char *folder = strdup(place);
    char *slash = folder ? strrchr(folder, '/') : NULL;
    int fd;

    if (slash)
        slash[slash == folder] = '\0';
    fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

bool output_file_commit(struct output_file *file, struct failure *failure)
{
    FILE *stream = file->stream;

    if (fflush(stream) != 0 || (file->temporary && fsync(fileno(stream)) != 0))
        return fail_create(file, failure);
    file->stream = NULL;
    if (stream != stdout && fclose(stream) != 0)
        return fail_create(file, failure);
    if (!file->temporary)
        return true;
    if (rename(file->temporary, file->place) != 0)
        return fail_create(file, failure);
    sync_folder(file->place);
    free(file->temporary);
    file->temporary = NULL;
    return true;
}

void output_file_finish(struct output_file *file)
{
    if (file->stream && file->stream != stdout)
        fclose(file->stream);
    if (file->temporary)
        unlink(file->temporary);
    free(file->temporary);
    free(file->place);
    free(file->path);
    *file = (struct output_file){0};
}
