/* SPDX-License-Identifier: MIT */
/* Joining takes minutes for the largest pictures, so that it has a thread, which starts a process
 * and waits for it; the file that comes out is on the disk and hashed before the jobs' thread hears
 * of it. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/base/child.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/jobs/jobs_internal.h"
#include "server/mapping/format_mapping.h"

/* What the thread works on. */
struct assembly {
    struct job_piece *piece;
    void (*ended)(struct job_piece *piece);
};

static json_t *message_of(const struct job_piece *piece)
{
    const struct farm_job *job = piece->job;
    const struct job_output *output = &job->request.outputs[piece->output];
    char prefix[TILE_NAME_BYTES];
    job_tile_prefix(piece, prefix);
    return json_pack("{s:s,s:i,s:i,s:s,s:i}", "prefix", prefix, "columns", job->tiles.columns,
                     "rows", job->tiles.rows, "format", request_format_name((int)output->format),
                     "quality", output->quality_percent);
}

/* What the child answers; a child that ends without a word costs an attempt. */
static bool hear(struct child *child, struct error *err)
{
    struct ipc_message answer = {.json = NULL};
    struct error problem = {0};
    bool is_heard = ipc_receive(child->socket, &answer, &problem) == IPC_MESSAGE;
    bool is_good = is_heard && json_is_true(json_object_get(answer.json, "ok"));
    if (is_heard && !is_good)
        ipc_error_from_json(json_object_get(answer.json, "error"), err);
    else if (!is_heard)
        error_set(err, ERROR_RENDER_FAILED, "the joining of tiles ended without an answer");
    ipc_message_finish(&answer);
    return is_good;
}

/* Tells who stops the jobs which process there is to end. */
static bool note_child(struct jobs *jobs, pid_t pid)
{
    pthread_mutex_lock(&jobs->mutex);
    bool is_wanted = !jobs->is_stopping;
    jobs->assembler_pid = pid;
    pthread_mutex_unlock(&jobs->mutex);
    return is_wanted;
}

static bool join(const struct job_piece *piece, int folder_fd, int picture_fd, struct error *err)
{
    struct child child = {.pid = 0};
    char how[64] = "";
    json_t *message = message_of(piece);
    if (!message)
        return error_set(err, ERROR_NO_MEMORY, "joining tiles");
    bool is_good = child_start(&child, &(struct child_desc){.role = "assembler"}, err);
    if (is_good)
        is_good = (note_child(piece->jobs, child.pid) ||
                   error_set(err, ERROR_INTERRUPTED, "the server stops")) &&
                  ipc_send(child.socket, message, (const int[]){folder_fd, picture_fd}, 2, err) &&
                  hear(&child, err);
    json_decref(message);
    note_child(piece->jobs, 0);
    child_stop(&child, 1000, how, sizeof how);
    return is_good;
}

static void run(struct job_piece *piece)
{
    const struct farm_job *job = piece->job;
    const struct job_place place = farm_job_place(job),
                           own = {.id = job->record.id, .directory = ""};
    struct error *err = &piece->problem;
    char name[JOB_FILE_BYTES];
    int64_t begin_ms = now_ms();
    job_file_name(&job->request.outputs[piece->output],
                  job->request.frames.numbers[piece->position], name);
    int folder_fd = job_results_folder(piece->jobs->results, &own, err);
    int picture_fd =
        folder_fd >= 0 ? job_results_draft(piece->jobs->results, &place, name, err) : -1;
    if (picture_fd >= 0 && join(piece, folder_fd, picture_fd, err) &&
        !job_results_hash(picture_fd, &piece->size_bytes, piece->digest, err))
        piece->is_unwritable = true;
    if (err->code == ERROR_IO)
        piece->is_unwritable = true;
    if (picture_fd >= 0)
        close(picture_fd);
    if (folder_fd >= 0)
        close(folder_fd);
    piece->ms = (double)(now_ms() - begin_ms);
}

static void *assemble(void *argument)
{
    struct assembly *assembly = argument;
    run(assembly->piece);
    assembly->ended(assembly->piece);
    free(assembly);
    return NULL;
}

void job_assembly_start(struct jobs *jobs, struct job_piece *piece,
                        void (*ended)(struct job_piece *piece))
{
    struct assembly *assembly = calloc(1, sizeof *assembly);
    if (jobs->has_assembler) { /* the one before has ended, but for its last steps */
        pthread_join(jobs->assembler, NULL);
        jobs->has_assembler = false;
    }
    if (assembly) {
        *assembly = (struct assembly){.piece = piece, .ended = ended};
        jobs->has_assembler = pthread_create(&jobs->assembler, NULL, assemble, assembly) == 0;
    }
    if (jobs->has_assembler)
        return;
    free(assembly);
    error_set(&piece->problem, ERROR_NO_MEMORY, "joining tiles");
    ended(piece);
}

void job_assembly_stop(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->mutex);
    if (jobs->assembler_pid > 0) /* not reaped while it is noted */
        kill(jobs->assembler_pid, SIGKILL);
    pthread_mutex_unlock(&jobs->mutex);
    if (jobs->has_assembler)
        pthread_join(jobs->assembler, NULL);
    jobs->has_assembler = false;
}
