/* SPDX-License-Identifier: MIT */
/* One connection, whose transactions are short. Statements are prepared where they are used: that
 * costs microseconds beside the milliseconds of a commit. */
#include "server/jobs/job_store.h"

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    APPLICATION_ID = 0x56746a62 /* "Vtjb" */,
    VERSION = 3,
    PATH_BYTES = 4096 + 64,
    SEQUENCES_SKIPPED = 1000
};

struct job_store {
    const struct log *log;
    sqlite3 *database;
    char path[PATH_BYTES];
};

static const char schema[] =
    "CREATE TABLE job(number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,"
    " created_s INTEGER NOT NULL, started_s INTEGER NOT NULL, ended_s INTEGER NOT NULL,"
    " state INTEGER NOT NULL, is_paused INTEGER NOT NULL, priority INTEGER NOT NULL,"
    " sequence INTEGER NOT NULL, code TEXT, problem TEXT, request TEXT NOT NULL,"
    " key TEXT UNIQUE, body TEXT NOT NULL, chosen TEXT, ended_ms INTEGER NOT NULL) STRICT;"
    "CREATE TABLE frame(job INTEGER NOT NULL REFERENCES job(number) ON DELETE CASCADE,"
    " position INTEGER NOT NULL, state INTEGER NOT NULL, attempts INTEGER NOT NULL,"
    " sequence INTEGER NOT NULL, ms REAL NOT NULL, code TEXT, problem TEXT,"
    " PRIMARY KEY(job, position)) STRICT, WITHOUT ROWID;"
    "CREATE TABLE file(job INTEGER NOT NULL REFERENCES job(number) ON DELETE CASCADE,"
    " position INTEGER NOT NULL, output INTEGER NOT NULL, size_bytes INTEGER NOT NULL,"
    " digest TEXT NOT NULL, PRIMARY KEY(job, position, output)) STRICT, WITHOUT ROWID;"
    "CREATE TABLE clock(ran_ms INTEGER NOT NULL) STRICT; INSERT INTO clock VALUES(0);";

/* From each version to the next one. */
static const char *const migrations[VERSION] = {
    [1] = "ALTER TABLE job ADD COLUMN chosen TEXT;",
    [2] = "ALTER TABLE job ADD COLUMN ended_ms INTEGER NOT NULL DEFAULT 0;"
          "CREATE TABLE clock(ran_ms INTEGER NOT NULL) STRICT; INSERT INTO clock VALUES(0);",
};

/* ---- statements ---- */

static bool refuse(struct job_store *store, const char *what, struct error *err)
{
    return error_set(err, ERROR_IO, "jobs: %s: %s", what, sqlite3_errmsg(store->database));
}

static bool execute(struct job_store *store, const char *sql, struct error *err)
{
    return sqlite3_exec(store->database, sql, NULL, NULL, NULL) == SQLITE_OK ||
           refuse(store, "the database", err);
}

static sqlite3_stmt *prepare(struct job_store *store, const char *sql, struct error *err)
{
    sqlite3_stmt *statement = NULL;
    if (sqlite3_prepare_v2(store->database, sql, -1, &statement, NULL) != SQLITE_OK)
        refuse(store, "the database", err);
    return statement;
}

/* "" is NULL. */
static void bind_text(sqlite3_stmt *statement, int index, const char *text)
{
    if (text && *text)
        sqlite3_bind_text(statement, index, text, -1, SQLITE_TRANSIENT);
}

static const char *text_of(sqlite3_stmt *statement, int column)
{
    const char *text = (const char *)sqlite3_column_text(statement, column);
    return text ? text : "";
}

/* Runs a statement without rows, and ends it. NULL: it could not be prepared. */
static bool finish(struct job_store *store, sqlite3_stmt *statement, const char *what,
                   struct error *err)
{
    bool is_good = statement && sqlite3_step(statement) == SQLITE_DONE;
    if (statement && !is_good)
        refuse(store, what, err);
    sqlite3_finalize(statement);
    return is_good;
}

static bool read_integer(struct job_store *store, const char *sql, int64_t *value,
                         struct error *err)
{
    sqlite3_stmt *statement = prepare(store, sql, err);
    bool is_good = statement && sqlite3_step(statement) == SQLITE_ROW;
    if (is_good)
        *value = sqlite3_column_int64(statement, 0);
    else if (statement)
        refuse(store, "the database", err);
    sqlite3_finalize(statement);
    return is_good;
}

/* ---- opening ---- */

static bool is_sound(struct job_store *store, struct error *err)
{
    sqlite3_stmt *statement = prepare(store, "PRAGMA quick_check(1)", err);
    bool has_row = statement && sqlite3_step(statement) == SQLITE_ROW;
    bool is_good = has_row && strcmp(text_of(statement, 0), "ok") == 0;
    if (has_row && !is_good)
        error_set(err, ERROR_IO, "jobs: the database is damaged: %s", text_of(statement, 0));
    else if (statement && !has_row)
        refuse(store, "the database", err);
    sqlite3_finalize(statement);
    return is_good;
}

static bool make_tables(struct job_store *store, struct error *err)
{
    char stamp[96];
    snprintf(stamp, sizeof stamp, "PRAGMA application_id=%d; PRAGMA user_version=%d;",
             APPLICATION_ID, VERSION);
    if (execute(store, "BEGIN IMMEDIATE", err) && execute(store, schema, err) &&
        execute(store, stamp, err) && execute(store, "COMMIT", err))
        return true;
    sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
    return false;
}

static bool migrate(struct job_store *store, int64_t version, struct error *err)
{
    for (; version < VERSION; version++) {
        char step[512];
        snprintf(step, sizeof step, "BEGIN IMMEDIATE; %s PRAGMA user_version=%d; COMMIT;",
                 migrations[version], (int)version + 1);
        if (!execute(store, step, err)) {
            sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
            return false;
        }
        log_write(store->log, LOG_INFO, "jobs: the database is of version %d now",
                  (int)version + 1);
    }
    return true;
}

static bool open_database(struct job_store *store, struct error *err)
{
    static const char settings[] = "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
                                   "PRAGMA foreign_keys=ON;";
    int64_t version = 0, application = 0, tables = 0;
    int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOFOLLOW;
    if (sqlite3_open_v2(store->path, &store->database, flags, NULL) != SQLITE_OK)
        return refuse(store, "opening the database", err);
    sqlite3_busy_timeout(store->database, 5000);
    if (!execute(store, settings, err) || !is_sound(store, err) ||
        !read_integer(store, "PRAGMA user_version", &version, err) ||
        !read_integer(store, "PRAGMA application_id", &application, err) ||
        !read_integer(store, "SELECT count(*) FROM sqlite_schema", &tables, err))
        return false;
    if (tables == 0)
        return make_tables(store, err);
    if (application == APPLICATION_ID && version > VERSION)
        return error_set(err, ERROR_CONFLICT,
                         "the jobs in '%s' are of version %lld, and this program knows %d: run "
                         "the newer program, or move the file away",
                         store->path, (long long)version, VERSION);
    if (application != APPLICATION_ID || version < 1)
        return error_set(err, ERROR_IO, "jobs: '%s' is no database of jobs", store->path);
    return migrate(store, version, err);
}

static void close_database(struct job_store *store)
{
    sqlite3_close(store->database);
    store->database = NULL;
}

/* Renames the database, and what belongs to it, to names that nothing has. */
static void set_aside(struct job_store *store, const struct error *problem)
{
    static const char *const suffixes[] = {"", "-wal", "-shm"};
    char from[PATH_BYTES + 8], to[PATH_BYTES + 40];
    int number = 1;
    for (; number < 1000; number++) {
        snprintf(to, sizeof to, "%s.damaged-%d", store->path, number);
        if (access(to, F_OK) != 0)
            break;
    }
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        snprintf(from, sizeof from, "%s%s", store->path, suffixes[i]);
        snprintf(to, sizeof to, "%s.damaged-%d%s", store->path, number, suffixes[i]);
        rename(from, to);
    }
    log_write(store->log, LOG_ERROR, "%s; it is set aside as %s.damaged-%d, and its jobs with it",
              problem->message, store->path, number);
}

struct job_store *job_store_create(const char *directory, const struct log *log, struct error *err)
{
    struct job_store *store = calloc(1, sizeof *store);
    if (!store) {
        error_set(err, ERROR_NO_MEMORY, "store of jobs");
        return NULL;
    }
    store->log = log;
    snprintf(store->path, sizeof store->path, "%s/jobs.db", directory);
    struct error problem = {0};
    bool is_good = open_database(store, &problem);
    if (!is_good && problem.code == ERROR_IO && store->database) {
        close_database(store);
        set_aside(store, &problem);
        problem = (struct error){0};
        is_good = open_database(store, &problem);
    }
    if (is_good)
        return store;
    error_pass(err, &problem);
    job_store_destroy(store);
    return NULL;
}

void job_store_destroy(struct job_store *store)
{
    if (!store)
        return;
    close_database(store);
    free(store);
}

/* ---- reading ---- */

static void read_job(sqlite3_stmt *row, struct job_record *job)
{
    *job = (struct job_record){
        .number = sqlite3_column_int64(row, 0),
        .created_s = sqlite3_column_int64(row, 2),
        .started_s = sqlite3_column_int64(row, 3),
        .ended_s = sqlite3_column_int64(row, 4),
        .state = (enum farm_job_state)(sqlite3_column_int(row, 5) % FARM_JOB_STATE_COUNT),
        .is_paused = sqlite3_column_int(row, 6),
        .priority = sqlite3_column_int(row, 7),
        .sequence = (uint32_t)sqlite3_column_int64(row, 8),
        .request = text_of(row, 11),
        .chosen = *text_of(row, 12) ? text_of(row, 12) : NULL,
        .ended_ms = sqlite3_column_int64(row, 13)};
    snprintf(job->id, sizeof job->id, "%s", text_of(row, 1));
    if (*text_of(row, 9))
        error_set(&job->problem, error_code_from_name(text_of(row, 9)), "%s", text_of(row, 10));
}

static void load_frames(sqlite3_stmt *rows, int64_t number, const struct job_visitor *visitor)
{
    sqlite3_bind_int64(rows, 1, number);
    while (sqlite3_step(rows) == SQLITE_ROW) {
        const char *code = text_of(rows, 4);
        visitor->frame(
            visitor->context, number,
            &(struct frame_record){.position = sqlite3_column_int(rows, 0),
                                   .state = (enum farm_frame_state)(sqlite3_column_int(rows, 1) %
                                                                    FARM_FRAME_STATE_COUNT),
                                   .attempts = sqlite3_column_int(rows, 2),
                                   .sequence = (uint32_t)sqlite3_column_int64(rows, 6),
                                   .ms = sqlite3_column_double(rows, 3),
                                   .code = *code ? error_code_from_name(code) : ERROR_NONE,
                                   .problem = text_of(rows, 5)});
    }
    sqlite3_reset(rows);
}

static void load_files(sqlite3_stmt *rows, int64_t number, const struct job_visitor *visitor)
{
    sqlite3_bind_int64(rows, 1, number);
    while (sqlite3_step(rows) == SQLITE_ROW) {
        struct file_record file = {.position = sqlite3_column_int(rows, 0),
                                   .output = sqlite3_column_int(rows, 1),
                                   .size_bytes = (uint64_t)sqlite3_column_int64(rows, 2)};
        snprintf(file.digest, sizeof file.digest, "%s", text_of(rows, 3));
        visitor->file(visitor->context, number, &file);
    }
    sqlite3_reset(rows);
}

/* The numbers of changes that were told but not saved when the last server was killed are not given
 * again. */
static bool skip_sequences(struct job_store *store, struct error *err)
{
    char sql[128];
    snprintf(sql, sizeof sql, "UPDATE job SET sequence = sequence + %d WHERE state IN (%d, %d)",
             SEQUENCES_SKIPPED, FARM_JOB_QUEUED, FARM_JOB_RUNNING);
    return execute(store, sql, err);
}

bool job_store_load(struct job_store *store, const struct job_visitor *visitor, struct error *err)
{
    static const char all_jobs[] =
        "SELECT number, id, created_s, started_s, ended_s, state, is_paused, priority, sequence,"
        " code, problem, request, chosen, ended_ms FROM job ORDER BY number";
    static const char its_frames[] =
        "SELECT position, state, attempts, ms, code, problem, sequence FROM frame WHERE job=?";
    static const char its_files[] =
        "SELECT position, output, size_bytes, digest FROM file WHERE job=?";
    struct error problem = {0};
    if (!skip_sequences(store, &problem)) /* such as a full disk, where a server still starts */
        log_write(store->log, LOG_WARNING, "%s", problem.message);
    sqlite3_stmt *jobs = prepare(store, all_jobs, err);
    sqlite3_stmt *frames = prepare(store, its_frames, err);
    sqlite3_stmt *files = prepare(store, its_files, err);
    bool is_good = jobs && frames && files;
    int status = SQLITE_DONE;
    while (is_good && (status = sqlite3_step(jobs)) == SQLITE_ROW) {
        struct job_record job;
        read_job(jobs, &job);
        is_good = visitor->job(visitor->context, &job, err);
        if (is_good) {
            load_frames(frames, job.number, visitor);
            load_files(files, job.number, visitor);
        }
    }
    if (is_good && status != SQLITE_DONE)
        is_good = refuse(store, "reading the jobs", err);
    sqlite3_finalize(jobs);
    sqlite3_finalize(frames);
    sqlite3_finalize(files);
    return is_good;
}

bool job_store_find_key(struct job_store *store, const char *key, char id[JOB_ID_BYTES],
                        char body[DIGEST_TEXT_BYTES], struct error *err)
{
    sqlite3_stmt *statement = prepare(store, "SELECT id, body FROM job WHERE key=?", err);
    if (!statement)
        return false;
    bind_text(statement, 1, key);
    int status = sqlite3_step(statement);
    if (status == SQLITE_ROW) {
        snprintf(id, JOB_ID_BYTES, "%s", text_of(statement, 0));
        snprintf(body, DIGEST_TEXT_BYTES, "%s", text_of(statement, 1));
    } else if (status != SQLITE_DONE) {
        refuse(store, "looking for a key", err);
    }
    sqlite3_finalize(statement);
    return status == SQLITE_ROW;
}

/* ---- writing ---- */

static void bind_problem(sqlite3_stmt *statement, int index, enum error_code code,
                         const char *problem)
{
    if (code == ERROR_NONE)
        return;
    bind_text(statement, index, error_code_name(code));
    bind_text(statement, index + 1, problem);
}

static bool update_job(struct job_store *store, const struct job_record *job, struct error *err)
{
    sqlite3_stmt *statement =
        prepare(store,
                "UPDATE job SET started_s=?, ended_s=?, state=?, is_paused=?, priority=?,"
                " sequence=?, code=?, problem=?, chosen=?, ended_ms=? WHERE number=?",
                err);
    if (statement) {
        sqlite3_bind_int64(statement, 1, job->started_s);
        sqlite3_bind_int64(statement, 2, job->ended_s);
        sqlite3_bind_int(statement, 3, (int)job->state);
        sqlite3_bind_int(statement, 4, job->is_paused);
        sqlite3_bind_int(statement, 5, job->priority);
        sqlite3_bind_int64(statement, 6, job->sequence);
        bind_problem(statement, 7, job->problem.code, job->problem.message);
        bind_text(statement, 9, job->chosen);
        sqlite3_bind_int64(statement, 10, job->ended_ms);
        sqlite3_bind_int64(statement, 11, job->number);
    }
    return finish(store, statement, "saving a job", err);
}

static bool forget_failures(struct job_store *store, int64_t number, struct error *err)
{
    sqlite3_stmt *statement = prepare(store, "DELETE FROM frame WHERE job=? AND state=?", err);
    if (statement) {
        sqlite3_bind_int64(statement, 1, number);
        sqlite3_bind_int(statement, 2, FARM_FRAME_FAILED);
    }
    return finish(store, statement, "saving a job", err);
}

static bool roll_back(struct job_store *store)
{
    sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
    return false;
}

bool job_store_update(struct job_store *store, const struct job_record *job, bool retries,
                      struct error *err)
{
    return (execute(store, "BEGIN IMMEDIATE", err) && update_job(store, job, err) &&
            (!retries || forget_failures(store, job->number, err)) &&
            execute(store, "COMMIT", err)) ||
           roll_back(store);
}

bool job_store_add(struct job_store *store, struct job_record *job, const char *key,
                   const char *body, struct error *err)
{
    sqlite3_stmt *statement = prepare(
        store,
        "INSERT INTO job(id, created_s, started_s, ended_s, state, is_paused, priority,"
        " sequence, request, key, body, ended_ms) VALUES(?, ?, 0, 0, ?, ?, ?, ?, ?, ?, ?, 0)",
        err);
    if (statement) {
        bind_text(statement, 1, job->id);
        sqlite3_bind_int64(statement, 2, job->created_s);
        sqlite3_bind_int(statement, 3, (int)job->state);
        sqlite3_bind_int(statement, 4, job->is_paused);
        sqlite3_bind_int(statement, 5, job->priority);
        sqlite3_bind_int64(statement, 6, job->sequence);
        bind_text(statement, 7, job->request);
        bind_text(statement, 8, key);
        bind_text(statement, 9, body);
    }
    if (!finish(store, statement, "saving a job", err))
        return false;
    job->number = sqlite3_last_insert_rowid(store->database);
    return true;
}

static bool put_frame(struct job_store *store, int64_t number, const struct frame_record *frame,
                      struct error *err)
{
    sqlite3_stmt *statement =
        prepare(store,
                "INSERT OR REPLACE INTO frame(job, position, state, attempts, sequence, ms, code,"
                " problem) VALUES(?, ?, ?, ?, ?, ?, ?, ?)",
                err);
    if (statement) {
        sqlite3_bind_int64(statement, 1, number);
        sqlite3_bind_int(statement, 2, frame->position);
        sqlite3_bind_int(statement, 3, (int)frame->state);
        sqlite3_bind_int(statement, 4, frame->attempts);
        sqlite3_bind_int64(statement, 5, frame->sequence);
        sqlite3_bind_double(statement, 6, frame->ms);
        bind_problem(statement, 7, frame->code, frame->problem);
    }
    return finish(store, statement, "saving a frame", err);
}

static bool put_file(struct job_store *store, int64_t number, const struct file_record *file,
                     struct error *err)
{
    sqlite3_stmt *statement =
        prepare(store,
                "INSERT OR REPLACE INTO file(job, position, output, size_bytes, digest)"
                " VALUES(?, ?, ?, ?, ?)",
                err);
    if (statement) {
        sqlite3_bind_int64(statement, 1, number);
        sqlite3_bind_int(statement, 2, file->position);
        sqlite3_bind_int(statement, 3, file->output);
        sqlite3_bind_int64(statement, 4, (int64_t)file->size_bytes);
        bind_text(statement, 5, file->digest);
    }
    return finish(store, statement, "saving a file", err);
}

bool job_store_put_frame(struct job_store *store, int64_t number, const struct frame_record *frame,
                         const struct file_record *file, const struct job_record *job,
                         struct error *err)
{
    return (execute(store, "BEGIN IMMEDIATE", err) && put_frame(store, number, frame, err) &&
            (!file || put_file(store, number, file, err)) &&
            (!job || update_job(store, job, err)) && execute(store, "COMMIT", err)) ||
           roll_back(store);
}

bool job_store_remove(struct job_store *store, int64_t number, struct error *err)
{
    sqlite3_stmt *statement = prepare(store, "DELETE FROM job WHERE number=?", err);
    if (statement)
        sqlite3_bind_int64(statement, 1, number);
    return finish(store, statement, "removing a job", err);
}

/* ---- the time that the server ran ---- */

bool job_store_get_ran_ms(struct job_store *store, int64_t *ran_ms, struct error *err)
{
    return read_integer(store,
                        "SELECT max((SELECT max(ran_ms) FROM clock),"
                        " (SELECT coalesce(max(ended_ms), 0) FROM job))",
                        ran_ms, err);
}

bool job_store_set_ran_ms(struct job_store *store, int64_t ran_ms, struct error *err)
{
    sqlite3_stmt *statement = prepare(store, "UPDATE clock SET ran_ms=?", err);
    if (statement)
        sqlite3_bind_int64(statement, 1, ran_ms);
    return finish(store, statement, "saving the time that the server ran", err);
}
