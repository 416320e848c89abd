/* SPDX-License-Identifier: MIT */
/* libarchive writes into a buffer, which is emptied before more is asked of it. */
#include "server/routes/job_archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { PIECE_BYTES = 1 << 16 };

struct job_archive {
    struct jobs *jobs;
    char id[JOB_ID_BYTES];
    struct archive *writer;
    uint64_t next;        /* of the job's files */
    struct job_file file; /* that is being written; its fd is -1 where none is */
    uint64_t written_bytes;
    char *made; /* owned */
    size_t made_bytes, sent_bytes, capacity;
    bool is_closed;
};

static ssize_t keep(struct archive *writer, void *context, const void *bytes, size_t size_bytes)
{
    struct job_archive *archive = context;
    if (archive->made_bytes + size_bytes > archive->capacity) {
        size_t capacity = archive->made_bytes + size_bytes;
        char *grown = realloc(archive->made, capacity);
        if (!grown) {
            archive_set_error(writer, ARCHIVE_FATAL, "out of memory");
            return -1;
        }
        archive->made = grown;
        archive->capacity = capacity;
    }
    memcpy(archive->made + archive->made_bytes, bytes, size_bytes);
    archive->made_bytes += size_bytes;
    return (ssize_t)size_bytes;
}

struct job_archive *job_archive_create(struct jobs *jobs, const char *id, struct error *err)
{
    json_t *job = jobs_get(jobs, id, err);
    if (!job)
        return NULL;
    json_decref(job);
    struct job_archive *archive = calloc(1, sizeof *archive);
    struct archive *writer = archive ? archive_write_new() : NULL;
    if (!writer) {
        free(archive);
        error_set(err, ERROR_NO_MEMORY, "archive");
        return NULL;
    }
    archive->jobs = jobs;
    archive->writer = writer;
    archive->file.fd = -1;
    snprintf(archive->id, sizeof archive->id, "%s", id);
    archive_write_set_format_ustar(writer);
    archive_write_set_bytes_in_last_block(writer, 1);
    if (archive_write_open(writer, archive, NULL, keep, NULL) == ARCHIVE_OK)
        return archive;
    error_set(err, ERROR_INTERNAL, "archive: %s", archive_error_string(writer));
    job_archive_destroy(archive);
    return NULL;
}

void job_archive_destroy(struct job_archive *archive)
{
    if (!archive)
        return;
    archive_write_free(archive->writer); /* closes it, which may still write */
    if (archive->file.fd >= 0)
        close(archive->file.fd);
    free(archive->made);
    free(archive);
}

static bool begin_file(struct job_archive *archive)
{
    struct archive_entry *entry = archive_entry_new();
    if (!entry)
        return false;
    archive_entry_set_pathname(entry, archive->file.name);
    archive_entry_set_size(entry, (la_int64_t)archive->file.size_bytes);
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_mtime(entry, time(NULL), 0);
    archive->written_bytes = 0;
    bool is_good = archive_write_header(archive->writer, entry) == ARCHIVE_OK;
    archive_entry_free(entry);
    return is_good;
}

static bool write_piece(struct job_archive *archive)
{
    static const size_t most = PIECE_BYTES;
    char piece[PIECE_BYTES];
    uint64_t left = archive->file.size_bytes - archive->written_bytes;
    ssize_t count = pread(archive->file.fd, piece, left < most ? (size_t)left : most,
                          (off_t)archive->written_bytes);
    if (count <= 0 || archive_write_data(archive->writer, piece, (size_t)count) != count)
        return false;
    archive->written_bytes += (uint64_t)count;
    if (archive->written_bytes == archive->file.size_bytes) {
        close(archive->file.fd);
        archive->file.fd = -1;
    }
    return true;
}

/* Makes some more of the archive. */
static bool make_more(struct job_archive *archive)
{
    struct error problem = {0};
    archive->made_bytes = archive->sent_bytes = 0;
    if (archive->file.fd >= 0)
        return write_piece(archive);
    if (jobs_next_file(archive->jobs, archive->id, &archive->next, &archive->file, &problem))
        return begin_file(archive);
    archive->file.fd = -1;
    archive->is_closed = true;
    return problem.code == ERROR_NONE && archive_write_close(archive->writer) == ARCHIVE_OK;
}

ssize_t job_archive_read(struct job_archive *archive, char *bytes, size_t capacity)
{
    while (archive->sent_bytes == archive->made_bytes)
        if (archive->is_closed || !make_more(archive))
            return -1;
    size_t left = archive->made_bytes - archive->sent_bytes;
    size_t count = left < capacity ? left : capacity;
    memcpy(bytes, archive->made + archive->sent_bytes, count);
    archive->sent_bytes += count;
    return (ssize_t)count;
}
