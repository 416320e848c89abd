/* SPDX-License-Identifier: MIT */
/* The copy is made by SQLite's backup in one step: it is of one moment, and the daemon, which
 * writes to its log (WAL) meanwhile, never waits. The connection to the daemon's database neither
 * writes nor checkpoints. */
#include "server/jobs/job_backup.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_BYTES = 4096 + 64, BUSY_MS = 5000, BUSY_TRIES = 20 };

static bool refuse(sqlite3 *database, const char *what, struct error *err)
{
    return error_set(err, ERROR_IO, "%s: %s", what, sqlite3_errmsg(database));
}

static sqlite3 *open_source(const char *path, struct error *err)
{
    sqlite3 *source = NULL;
    if (access(path, F_OK) != 0) {
        error_set(err, ERROR_NOT_FOUND, "there is no database of jobs: '%s': %s", path,
                  strerror(errno));
        return NULL;
    }
    int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOFOLLOW; /* its -shm is written to read it */
    if (sqlite3_open_v2(path, &source, flags, NULL) == SQLITE_OK &&
        sqlite3_busy_timeout(source, BUSY_MS) == SQLITE_OK &&
        sqlite3_db_config(source, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL) == SQLITE_OK &&
        sqlite3_wal_autocheckpoint(source, 0) == SQLITE_OK)
        return source;
    refuse(source, "opening the database of jobs", err);
    sqlite3_close(source);
    return NULL;
}

static sqlite3 *open_draft(const char *path, struct error *err)
{
    sqlite3 *draft = NULL;
    unlink(path); /* of a backup that was cut off */
    int fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0) {
        error_set(err, ERROR_IO, "'%s': %s", path, strerror(errno));
        return NULL;
    }
    close(fd);
    if (sqlite3_open_v2(path, &draft, SQLITE_OPEN_READWRITE, NULL) == SQLITE_OK)
        return draft;
    refuse(draft, "the backup", err);
    sqlite3_close(draft);
    return NULL;
}

static bool copy(sqlite3 *source, sqlite3 *draft, struct error *err)
{
    sqlite3_backup *backup = sqlite3_backup_init(draft, "main", source, "main");
    int status = SQLITE_OK;
    for (int i = 0; backup && i < BUSY_TRIES; i++) {
        status = sqlite3_backup_step(backup, -1);
        if (status != SQLITE_BUSY && status != SQLITE_LOCKED)
            break;
        sqlite3_sleep(BUSY_MS / BUSY_TRIES);
    }
    bool is_good = backup && status == SQLITE_DONE;
    sqlite3_backup_finish(backup); /* leaves the reason with the draft */
    return is_good || refuse(draft, "copying the database of jobs", err);
}

/* The first column of the only row, as a text. */
static bool ask(sqlite3 *database, const char *sql, char *answer, size_t size, struct error *err)
{
    sqlite3_stmt *statement = NULL;
    bool is_good = sqlite3_prepare_v2(database, sql, -1, &statement, NULL) == SQLITE_OK &&
                   sqlite3_step(statement) == SQLITE_ROW;
    if (is_good)
        snprintf(answer, size, "%s", (const char *)sqlite3_column_text(statement, 0));
    else
        refuse(database, "checking the backup", err);
    sqlite3_finalize(statement);
    return is_good;
}

/* Makes it one file that needs no log beside it, and looks whether it is whole. */
static bool check(sqlite3 *draft, struct job_backup *backup, struct error *err)
{
    char answer[128];
    if (!ask(draft, "PRAGMA journal_mode=DELETE", answer, sizeof answer, err) ||
        !ask(draft, "PRAGMA quick_check(1)", answer, sizeof answer, err))
        return false;
    if (strcmp(answer, "ok") != 0)
        return error_set(err, ERROR_IO, "the database of jobs is damaged: %s", answer);
    if (!ask(draft, "SELECT count(*) FROM job", answer, sizeof answer, err))
        return false;
    backup->jobs = strtoll(answer, NULL, 10);
    return true;
}

static bool sync_path(const char *path, int flags, int64_t *size_bytes, struct error *err)
{
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC | flags);
    bool is_good = fd >= 0 && fsync(fd) == 0 && fstat(fd, &status) == 0;
    if (is_good && size_bytes)
        *size_bytes = status.st_size;
    if (!is_good)
        error_set(err, ERROR_IO, "'%s': %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    return is_good;
}

static bool publish(const char *draft, const char *file, struct job_backup *backup,
                    struct error *err)
{
    char folder[PATH_BYTES];
    snprintf(folder, sizeof folder, "%s", file);
    if (!sync_path(draft, 0, &backup->size_bytes, err))
        return false;
    if (rename(draft, file) != 0)
        return error_set(err, ERROR_IO, "'%s': %s", file, strerror(errno));
    return sync_path(dirname(folder), O_DIRECTORY, NULL, err);
}

static bool is_same_file(const char *one, const char *other)
{
    struct stat a, b;
    return stat(one, &a) == 0 && stat(other, &b) == 0 && a.st_dev == b.st_dev &&
           a.st_ino == b.st_ino;
}

bool job_backup_write(const char *state_dir, const char *file, struct job_backup *backup,
                      struct error *err)
{
    char database[PATH_BYTES], draft_path[PATH_BYTES];
    snprintf(database, sizeof database, "%s/jobs/jobs.db", state_dir);
    snprintf(draft_path, sizeof draft_path, "%s.part", file);
    if (is_same_file(database, file))
        return error_set(err, ERROR_CONFLICT, "'%s' is the database of jobs itself", file);
    sqlite3 *source = open_source(database, err);
    sqlite3 *draft = source ? open_draft(draft_path, err) : NULL;
    bool is_good = draft && copy(source, draft, err) && check(draft, backup, err);
    sqlite3_close(draft);
    sqlite3_close(source);
    is_good = is_good && publish(draft_path, file, backup, err);
    if (!is_good && source)
        unlink(draft_path);
    return is_good;
}
