/* SPDX-License-Identifier: MIT */
/* The thread of the jobs: submits renders, publishes what they made, and answers who waits. */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "protocol/request_tree.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/task_resources.h"
#include "server/jobs/jobs_internal.h"
#include "server/mapping/format_mapping.h"

enum {
    RETRY_MS = 1000,      /* after the worker could not take more, or was lost */
    CRASHES_IN_A_ROW = 5, /* frames that failed by ending their workers, and none done between */
};

/* ---- which frame is next ---- */

/* A share twice as large for every ten steps. */
static double weight_of(const struct farm_job *job)
{
    return exp2((job->record.priority - 50) / 10.0);
}

/* The first output of a frame that is neither there nor in the making; -1: none. */
static int output_to_make(const struct farm_job *job, const struct farm_frame *frame)
{
    for (int i = 0; i < job->request.output_count; i++)
        if (!(frame->in_flight & 1u << i) && !(frame->files && frame->files[i].size_bytes > 0))
            return i;
    return -1;
}

static bool find_in_frame(const struct jobs *jobs, const struct farm_job *job,
                          const struct farm_frame *frame, int *output, int *tile)
{
    *tile = TILE_NONE;
    return farm_job_has_tiles(job) ? farm_tiles_find(job, frame, !jobs->is_assembling, output, tile)
                                   : (*output = output_to_make(job, frame)) >= 0;
}

static bool find_piece(const struct jobs *jobs, const struct farm_job *job, int *position,
                       int *output, int *tile)
{
    if (farm_job_has_ended(job) || job->record.is_paused || farm_job_is_waiting(job))
        return false;
    if (job->pieces > 0 && !job->is_decided && farm_job_is_open(job))
        return false; /* the first frame decides for all */
    for (*position = job->next; *position < (int)job->request.frames.count; (*position)++) {
        const struct farm_frame *frame = &job->frames[*position];
        bool is_open = frame->state == FARM_FRAME_QUEUED || frame->state == FARM_FRAME_RUNNING;
        if (is_open && find_in_frame(jobs, job, frame, output, tile))
            return true;
    }
    return false;
}

static int free_slot(const struct jobs *jobs)
{
    for (int i = 0; i < PIECES_PER_WORKER * jobs->desc.config->workers; i++)
        if (!jobs->in_flight[i])
            return i;
    return -1;
}

/* Milliseconds of a piece, by those before. */
static double guess_of(const struct farm_job *job)
{
    if (farm_job_has_tiles(job))
        return job->tiles_done > 0 ? job->tiles_ms / (double)job->tiles_done : 0;
    return job->done_count > 0 ? job->busy_ms / job->done_count / job->request.output_count : 0;
}

/* The next file of the job that has been served least for its weight, marked as in flight. NULL:
 * nothing to do, no room, or no memory. Under the mutex. */
static struct job_piece *take_piece(struct jobs *jobs)
{
    struct farm_job *chosen = NULL;
    int slot = free_slot(jobs), position = 0, output = 0, tile = TILE_NONE;
    int at_position = 0, at_output = 0, at_tile = TILE_NONE;
    if (slot < 0 || now_ms() < jobs->resume_ms)
        return NULL;
    for (int i = 0; i < jobs->count; i++) {
        struct farm_job *job = jobs->list[i];
        if (chosen && job->pass >= chosen->pass)
            continue;
        if (find_piece(jobs, job, &at_position, &at_output, &at_tile)) {
            chosen = job;
            position = at_position;
            output = at_output;
            tile = at_tile;
        }
    }
    struct job_piece *piece = chosen ? calloc(1, sizeof *piece) : NULL;
    if (!piece)
        return NULL;
    struct farm_frame *frame = &chosen->frames[position];
    double guess_ms = guess_of(chosen);
    *piece = (struct job_piece){.jobs = jobs,
                                .job = chosen,
                                .position = position,
                                .output = output,
                                .tile = tile,
                                .attempt = frame->attempts,
                                .ticket = supervisor_next_ticket(jobs->desc.supervisor),
                                .charged_ms = guess_ms,
                                .image_fd = -1};
    if (tile >= 0 && !farm_tiles_begin(chosen, position, output, tile)) {
        free(piece);
        return NULL;
    }
    if (tile < 0)
        frame->in_flight |= 1u << output;
    jobs->is_assembling |= tile == TILE_ASSEMBLY;
    frame->state = FARM_FRAME_RUNNING;
    chosen->pieces++;
    chosen->pass += guess_ms / weight_of(chosen);
    jobs->in_flight[slot] = piece;
    return piece;
}

/* Where in the picture it went wrong. */
static void name_tile(struct job_piece *piece)
{
    const struct request_tile tile = picture_tiles_get(&piece->job->tiles, piece->tile);
    const struct error problem = piece->problem;
    piece->problem = (struct error){0};
    error_set(&piece->problem, problem.code, "the tile at %d, %d: %s", tile.x, tile.y,
              problem.message);
}

static enum farm_frame_state state_in_between(const struct farm_frame *frame)
{
    return frame->in_flight || frame->tiles_in_flight ? FARM_FRAME_RUNNING : FARM_FRAME_QUEUED;
}

/* ---- submitting ---- */

/* On a thread of the supervisor, or of who cancelled; or of the jobs. */
static void piece_ended(struct job_piece *piece)
{
    struct jobs *jobs = piece->jobs;
    pthread_mutex_lock(&jobs->mutex);
    for (int i = 0; i < JOB_PIECES_MAX; i++)
        if (jobs->in_flight[i] == piece)
            jobs->in_flight[i] = NULL;
    piece->next = jobs->ended;
    jobs->ended = piece;
    pthread_cond_broadcast(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
}

/* {"chosen", "error"}: malloc'ed; NULL where nothing was chosen. */
static char *chosen_of(const struct frame_stats *stats)
{
    if (!stats->chosen.shadows[0])
        return NULL;
    json_t *all = frame_stats_to_json(stats);
    json_t *kept = json_pack("{s:O*,s:O*}", "chosen", json_object_get(all, "chosen"), "error",
                             json_object_get(all, "error"));
    char *text = kept ? json_dumps(kept, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(kept);
    json_decref(all);
    return text;
}

static void rendered(void *context, struct render_outcome *outcome)
{
    struct job_piece *piece = context;
    piece->problem = outcome->problem;
    piece->image_fd = outcome->image_fd;
    outcome->image_fd = -1;
    if (outcome->stats) {
        piece->ms = outcome->stats->timings_ms[FRAME_TIMING_TOTAL];
        piece->chosen = chosen_of(outcome->stats);
    }
    piece_ended(piece);
}

static bool fill_task(struct jobs *jobs, const struct job_piece *piece, struct render_task *task,
                      struct error *err)
{
    const struct farm_job *job = piece->job;
    struct render_request request = farm_job_render(job, piece->position, piece->output);
    if (piece->tile >= 0)
        farm_tiles_request(job, piece->tile, &request);
    struct request_resources needed;
    const struct tradeoff_view view = {.scene = request.scene,
                                       .width_px = request.width,
                                       .height_px = request.height,
                                       .quality = &request.quality,
                                       .resources = &needed,
                                       .reference_text = request_reference_text_of,
                                       .context = &request};
    memcpy(task->scene, request.scene, sizeof task->scene);
    if (!render_request_resources(&request, &needed) ||
        !task_open_resources(task, jobs->desc.resources, &needed, err) ||
        !tradeoffs_offer(jobs->desc.tradeoffs, &view, false, &task->offer, err))
        return false;
    char *text = render_request_to_json(&request);
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "frame of a job");
    task->request_fd = ipc_memfd_create("vitrail-request", text, strlen(text), err);
    free(text);
    task->format = image_format_from_request(&request);
    task->priority = RENDER_BATCH;
    task->expects_reuse = job->request.frames.count > 1 || picture_tiles_count(&job->tiles) > 1;
    task->is_of_job = true;
    task->stated_error = json_incref(json_object_get(job->chosen_json, "error"));
    const struct request_quality *asked = &job->request.render.quality;
    if (job->chosen && !request_quality_asks(asked)) /* "auto", as in the first frame's file */
        task->asked_quality = request_quality_to_tree(asked);
    task->limit_ms = 1000 * job->request.frame_timeout_s;
    return task->request_fd >= 0;
}

static void submit(struct jobs *jobs, struct job_piece *piece)
{
    if (piece->tile == TILE_ASSEMBLY) {
        job_assembly_start(jobs, piece, piece_ended);
        return;
    }
    struct render_task *task = render_task_create();
    if (!task)
        error_set(&piece->problem, ERROR_NO_MEMORY, "frame of a job");
    if (task && fill_task(jobs, piece, task, &piece->problem)) {
        task->ticket = piece->ticket;
        task->context = piece;
        task->done = rendered;
        if (supervisor_submit(jobs->desc.supervisor, task, &piece->problem))
            return;
    }
    render_task_destroy(task);
    piece_ended(piece);
}

/* ---- what became of it ---- */

enum verdict {
    VERDICT_GOOD,
    VERDICT_AGAIN,  /* no frame is to blame: later, without costing an attempt */
    VERDICT_FAILED, /* costs an attempt */
    VERDICT_NEVER,  /* it would fail each time */
    VERDICT_PAUSE,  /* results cannot be written */
};

static enum verdict judge(const struct error *problem)
{
    switch (problem->code) {
    case ERROR_NONE:
        return VERDICT_GOOD;
    case ERROR_OVERLOADED:
    case ERROR_INTERRUPTED:
    case ERROR_NO_DEVICE:
    case ERROR_NO_MEMORY:
    case ERROR_TOO_MANY_REQUESTS:
        return VERDICT_AGAIN;
    case ERROR_RENDER_FAILED:
    case ERROR_TIMEOUT:
    case ERROR_INTERNAL:
    case ERROR_IO:
        return VERDICT_FAILED;
    default:
        return VERDICT_NEVER;
    }
}

/* Publishes the file of a piece. Not under the mutex. */
static bool publish(struct jobs *jobs, const struct job_piece *piece, struct file_record *file,
                    struct error *err)
{
    const struct farm_job *job = piece->job;
    const struct job_place place = farm_job_place(job);
    char name[JOB_FILE_BYTES];
    job_file_name(&job->request.outputs[piece->output],
                  job->request.frames.numbers[piece->position], name);
    file->position = piece->position;
    file->output = piece->output;
    if (piece->tile >= 0)
        return farm_tiles_keep(jobs, piece, err);
    if (piece->tile == TILE_ASSEMBLY) {
        file->size_bytes = piece->size_bytes;
        memcpy(file->digest, piece->digest, sizeof file->digest);
        return jobs_make_room_for(jobs, job, piece->size_bytes, err) &&
               job_results_adopt(jobs->results, &place, name, err);
    }
    struct stat image;
    if (fstat(piece->image_fd, &image) != 0)
        return error_set(err, ERROR_IO, "reading a picture: %s", strerror(errno));
    return jobs_make_room_for(jobs, job, (uint64_t)image.st_size, err) &&
           job_results_put(jobs->results, &place, name, piece->image_fd, &file->size_bytes,
                           file->digest, err);
}

/* Whether the frame still waits for this attempt. */
static bool is_current(const struct job_piece *piece)
{
    const struct farm_frame *frame = &piece->job->frames[piece->position];
    return !piece->job->is_gone && frame->state == FARM_FRAME_RUNNING &&
           frame->attempts == piece->attempt;
}

static void pause_job(struct farm_job *job, const struct error *why)
{
    job->record.is_paused = true;
    job->record.problem = (struct error){0};
    error_set(&job->record.problem, why->code, "paused, since a result cannot be written: %s",
              why->message);
}

/* A scene that ends every worker would keep everybody else waiting for new ones. */
static void note_crash(struct farm_job *job, bool is_crash)
{
    job->crashes += is_crash;
    if (!is_crash || job->crashes < CRASHES_IN_A_ROW)
        return;
    job->crashes = 0;
    job->record.is_paused = true;
    job->record.problem = (struct error){0};
    error_set(&job->record.problem, ERROR_RENDER_FAILED,
              "paused, since %d frames in a row ended their workers", CRASHES_IN_A_ROW);
}

static void set_problem(struct farm_frame *frame, const struct error *problem)
{
    free(frame->problem);
    frame->code = problem->code;
    frame->problem = problem->code != ERROR_NONE ? strdup(problem->message) : NULL;
}

/* A job without open frames has ended. */
static void end_if_complete(struct jobs *jobs, struct farm_job *job)
{
    size_t ended = (size_t)(job->done_count + job->failed_count);
    if (farm_job_has_ended(job) || ended < job->request.frames.count)
        return;
    jobs_note_end(jobs, job, job->failed_count > 0 ? FARM_JOB_FAILED : FARM_JOB_DONE);
    if (job->failed_count > 0) {
        job->record.problem = (struct error){0};
        error_set(&job->record.problem, ERROR_RENDER_FAILED, "%d of %zu frames failed",
                  job->failed_count, job->request.frames.count);
    }
}

static void note_file(struct farm_job *job, struct farm_frame *frame,
                      const struct file_record *file)
{
    if (!frame->files)
        frame->files = calloc((size_t)job->request.output_count, sizeof *frame->files);
    if (!frame->files)
        return; /* not noted: the file is made again */
    frame->files[file->output].size_bytes = file->size_bytes;
    memcpy(frame->files[file->output].digest, file->digest, DIGEST_TEXT_BYTES);
    job->result_bytes += file->size_bytes;
}

/* Under the mutex. */
static void settle_frame(struct jobs *jobs, struct job_piece *piece, enum verdict verdict,
                         const struct file_record *file)
{
    struct farm_job *job = piece->job;
    struct farm_frame *frame = &job->frames[piece->position];
    enum farm_frame_state state = state_in_between(frame);
    if (verdict == VERDICT_GOOD) {
        if (farm_job_is_open(job)) {
            farm_job_set_chosen(job, piece->chosen);
            piece->chosen = NULL;
        }
        job->is_decided = true;
        if (piece->tile >= 0)
            farm_tiles_note_done(piece);
        else
            note_file(job, frame, file);
        frame->ms += (float)piece->ms;
        if (state == FARM_FRAME_QUEUED && output_to_make(job, frame) < 0) {
            state = FARM_FRAME_DONE;
            frame->attempts++;
            job->busy_ms += (double)frame->ms;
            jobs->totals.frames_done++;
            job->crashes = 0;
            job->makes_directory = false;
        }
    } else if (verdict == VERDICT_FAILED || verdict == VERDICT_NEVER) {
        int attempts = piece->tile >= 0 ? farm_tiles_note_failure(piece) : ++frame->attempts;
        bool is_last = verdict == VERDICT_NEVER || attempts >= job->request.attempts;
        if (piece->tile >= 0)
            name_tile(piece);
        set_problem(frame, &piece->problem);
        if (is_last)
            frame->attempts = attempts; /* other tiles of the frame count no more */
        state = is_last            ? FARM_FRAME_FAILED
                : piece->tile >= 0 ? state_in_between(frame)
                                   : FARM_FRAME_QUEUED;
        if (piece->tile == TILE_ASSEMBLY)
            farm_tiles_lose(piece);
        jobs->totals.frames_failed += is_last;
        jobs->totals.frames_retried += !is_last;
        note_crash(job, is_last && piece->problem.code == ERROR_RENDER_FAILED);
    } else if (verdict == VERDICT_PAUSE) {
        pause_job(job, &piece->problem);
    } else {
        jobs->resume_ms = now_ms() + RETRY_MS;
    }
    farm_job_set_frame(job, piece->position, state);
    if (verdict != VERDICT_AGAIN) {
        frame->sequence = job->record.sequence + 1;
        if (job->record.state == FARM_JOB_QUEUED) {
            job->record.state = FARM_JOB_RUNNING;
            job->record.started_s = farm_job_now_s(job);
        }
        end_if_complete(jobs, job);
        jobs_note_change(jobs, job);
    }
}

static void log_verdict(const struct jobs *jobs, const struct job_piece *piece,
                        enum verdict verdict, const struct job_record *record)
{
    int number = piece->job->request.frames.numbers[piece->position];
    if (verdict == VERDICT_FAILED || verdict == VERDICT_NEVER)
        log_write(jobs->desc.log, LOG_WARNING, "job %s: frame %d, attempt %d: %s", record->id,
                  number, piece->attempt + 1, piece->problem.message);
    else if (verdict == VERDICT_PAUSE)
        log_write(jobs->desc.log, LOG_ERROR, "job %s: %s", record->id, record->problem.message);
    if (record->state == FARM_JOB_DONE || record->state == FARM_JOB_FAILED)
        log_write(jobs->desc.log, LOG_INFO, "job %s has ended: %d frames done, %d failed",
                  record->id, piece->job->done_count, piece->job->failed_count);
}

/* Under the mutex: the piece is in flight no more, and its time is the job's. Returns whether its
 * result still counts. */
static bool retire(struct job_piece *piece)
{
    struct farm_job *job = piece->job;
    struct farm_frame *frame = &job->frames[piece->position];
    bool counts = is_current(piece);
    if (piece->tile >= 0)
        farm_tiles_end(piece);
    else
        frame->in_flight &= ~(1u << piece->output);
    if (piece->tile == TILE_ASSEMBLY)
        piece->jobs->is_assembling = false;
    job->pass += (piece->ms - piece->charged_ms) / weight_of(job);
    if (!counts && frame->state == FARM_FRAME_RUNNING &&
        state_in_between(frame) == FARM_FRAME_QUEUED)
        farm_job_set_frame(job, piece->position, FARM_FRAME_QUEUED);
    return counts && !farm_job_has_ended(job);
}

static void release(struct job_piece *piece)
{
    if (--piece->job->pieces == 0 && piece->job->is_gone)
        farm_job_destroy(piece->job);
    if (piece->image_fd >= 0)
        close(piece->image_fd);
    free(piece->chosen);
    free(piece);
}

/* The disk is locked from before the file is renamed until its frame is saved and shown, so that no
 * two attempts interleave. Nobody reads a frame that is not saved: what was told is there after any
 * end of the daemon. */
static void settle(struct jobs *jobs, struct job_piece *piece)
{
    struct file_record file = {0};
    struct frame_record frame = {0};
    struct job_record record = {0};
    char problem[ERROR_MESSAGE_BYTES] = "";
    enum verdict verdict = piece->is_unwritable ? VERDICT_PAUSE : judge(&piece->problem);
    pthread_mutex_lock(&jobs->disk);
    pthread_mutex_lock(&jobs->mutex);
    bool counts = is_current(piece) && !farm_job_has_ended(piece->job);
    pthread_mutex_unlock(&jobs->mutex);
    if (counts && verdict == VERDICT_GOOD && !publish(jobs, piece, &file, &piece->problem))
        verdict = VERDICT_PAUSE;
    pthread_mutex_lock(&jobs->mutex);
    counts = retire(piece);
    if (counts) {
        const struct farm_frame *state = &piece->job->frames[piece->position];
        settle_frame(jobs, piece, verdict, &file);
        record = piece->job->record;
        frame = (struct frame_record){
            .position = piece->position,
            .state = state->state == FARM_FRAME_RUNNING ? FARM_FRAME_QUEUED : state->state,
            .attempts = state->attempts,
            .sequence = state->sequence,
            .ms = (double)state->ms,
            .code = state->code,
            .problem = problem};
        snprintf(problem, sizeof problem, "%s", state->problem ? state->problem : "");
    }
    struct error failure = {0};
    bool is_saved = !counts || verdict == VERDICT_AGAIN ||
                    job_store_put_frame(jobs->store, record.number, &frame,
                                        verdict == VERDICT_GOOD && piece->tile < 0 ? &file : NULL,
                                        &record, &failure);
    if (!is_saved) { /* it is made again after a restart */
        if (!farm_job_has_ended(piece->job))
            pause_job(piece->job, &failure);
        jobs_note_change(jobs, piece->job);
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (!is_saved)
        log_write(jobs->desc.log, LOG_ERROR, "job %s: %s", record.id, failure.message);
    else if (counts && verdict == VERDICT_GOOD && piece->tile == TILE_ASSEMBLY)
        farm_tiles_remove(jobs, piece);
    if (piece->tile == TILE_ASSEMBLY && !(counts && verdict == VERDICT_GOOD))
        farm_tiles_drop_draft(jobs, piece);
    if (counts)
        log_verdict(jobs, piece, verdict, &record);
    pthread_mutex_lock(&jobs->mutex);
    release(piece);
    pthread_mutex_unlock(&jobs->mutex);
    pthread_mutex_unlock(&jobs->disk);
}

/* ---- the thread ---- */

/* Under the mutex. */
static void sleep_until_news(struct jobs *jobs)
{
    int64_t now = now_ms(), until = jobs->look_ms;
    if (jobs->resume_ms > now && jobs->resume_ms < until)
        until = jobs->resume_ms;
    for (const struct waiting *waiting = jobs->waiting; waiting; waiting = waiting->next)
        if (waiting->due_ms < until)
            until = waiting->due_ms;
    const struct timespec when = {.tv_sec = until / 1000, .tv_nsec = until % 1000 * 1000000};
    pthread_cond_timedwait(&jobs->changed, &jobs->mutex, &when);
}

static void cancel_in_flight(struct jobs *jobs)
{
    uint64_t tickets[JOB_PIECES_MAX] = {0};
    pthread_mutex_lock(&jobs->mutex);
    for (int i = 0; i < JOB_PIECES_MAX; i++)
        if (jobs->in_flight[i])
            tickets[i] = jobs->in_flight[i]->ticket;
    pthread_mutex_unlock(&jobs->mutex);
    for (int i = 0; i < JOB_PIECES_MAX; i++)
        supervisor_cancel(jobs->desc.supervisor, tickets[i]);
}

void *jobs_thread(void *argument)
{
    struct jobs *jobs = argument;
    pthread_mutex_lock(&jobs->mutex);
    for (int i = 0; i < jobs->count; i++) /* a daemon may have ended before it was written down */
        end_if_complete(jobs, jobs->list[i]);
    while (!jobs->is_stopping) {
        bool must_look = now_ms() >= jobs->look_ms;
        bool must_cancel = jobs->order_is_stale && job_order_update(jobs);
        struct waiting *due = jobs_take_due(jobs);
        struct job_piece *ended = jobs->ended;
        struct job_piece *begun = take_piece(jobs);
        if (ended)
            jobs->ended = ended->next;
        if (!due && !ended && !begun && !must_cancel && !must_look) {
            sleep_until_news(jobs);
            continue;
        }
        pthread_mutex_unlock(&jobs->mutex);
        jobs_answer(due);
        if (must_cancel)
            job_order_cancel_broken(jobs);
        if (must_look)
            jobs_retain(jobs);
        if (begun) /* first: the worker has work while results are brought to the disk */
            submit(jobs, begun);
        if (ended)
            settle(jobs, ended);
        pthread_mutex_lock(&jobs->mutex);
    }
    struct waiting *due = jobs_take_due(jobs);
    pthread_mutex_unlock(&jobs->mutex);
    jobs_answer(due);
    cancel_in_flight(jobs);
    return NULL;
}
