/* SPDX-License-Identifier: MIT */
/* The jobs in memory, which mirror the store: what clients ask, change and wait for. */
#include "server/jobs/jobs.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/base/clock.h"
#include "server/front/frames.h"
#include "server/jobs/jobs_internal.h"
#include "server/mapping/format_mapping.h"

enum { CHANGES_SHOWN_MAX = 1000 };

/* ---- looking up ---- */

struct farm_job *jobs_find(struct jobs *jobs, const char *id)
{
    for (int i = 0; i < jobs->count; i++)
        if (strcmp(jobs->list[i]->record.id, id) == 0)
            return jobs->list[i];
    return NULL;
}

bool jobs_not_found(const char *id, struct error *err)
{
    return error_set(err, ERROR_NOT_FOUND, "there is no job '%.64s'", id);
}

void jobs_note_change(struct jobs *jobs, struct farm_job *job)
{
    job->record.sequence++;
    jobs_notify_watches(jobs, job->record.id);
    pthread_cond_broadcast(&jobs->changed);
}

/* ---- submitting ---- */

static bool check_key(const char *key, struct error *err)
{
    size_t length = strlen(key);
    bool is_good = length > 0 && length < JOB_KEY_BYTES;
    for (size_t i = 0; i < length && is_good; i++)
        is_good = key[i] >= 0x20 && key[i] < 0x7f;
    return is_good || error_set(err, ERROR_INVALID_REQUEST,
                                "Idempotency-Key: must be 1 to %d printable ASCII characters",
                                JOB_KEY_BYTES - 1);
}

/* Room for one more job, under the mutex. */
static bool make_room(struct jobs *jobs, const struct farm_job *job, struct error *err)
{
    if (jobs->is_stopping)
        return error_set(err, ERROR_OVERLOADED, "the server is stopping");
    if (jobs->count >= LIMIT_JOBS_KEPT)
        return error_set(err, ERROR_TOO_MANY_REQUESTS,
                         "%d jobs are kept, which is the limit: forget some that have ended "
                         "(DELETE with ?forget=true)",
                         jobs->count);
    if (jobs->frames_kept + job->request.frames.count > LIMIT_JOB_FRAMES_KEPT)
        return error_set(err, ERROR_TOO_MANY_REQUESTS,
                         "all jobs together would have more than %d frames, which is the limit: "
                         "forget some that have ended (DELETE with ?forget=true)",
                         LIMIT_JOB_FRAMES_KEPT);
    if (jobs->count < jobs->capacity)
        return true;
    int capacity = jobs->capacity ? 2 * jobs->capacity : 16;
    struct farm_job **grown = realloc(jobs->list, (size_t)capacity * sizeof(struct farm_job *));
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "job");
    jobs->list = grown;
    jobs->capacity = capacity;
    return true;
}

void jobs_join_queue(struct jobs *jobs, struct farm_job *job)
{
    double least = -1;
    for (int i = 0; i < jobs->count; i++) {
        const struct farm_job *other = jobs->list[i];
        if (other != job && !farm_job_has_ended(other) && !other->record.is_paused &&
            !farm_job_is_waiting(other) && (least < 0 || other->pass < least))
            least = other->pass;
    }
    if (least > job->pass)
        job->pass = least;
}

static void append(struct jobs *jobs, struct farm_job *job)
{
    jobs->list[jobs->count++] = job;
    jobs->frames_kept += job->request.frames.count;
    jobs->order_is_stale = true;
}

/* With the disk locked, so that of two requests with one key the second finds the first. */
static bool add_job(struct jobs *jobs, struct farm_job *job, const char *key, const char *body,
                    struct error *err)
{
    json_t *canonical = job_request_to_json(&job->request);
    char *text = canonical ? json_dumps(canonical, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(canonical);
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "job");
    pthread_mutex_lock(&jobs->mutex);
    bool is_good = make_room(jobs, job, err) && farm_job_has_resources(jobs, job, err) &&
                   job_order_resolve(jobs, job, false, err);
    pthread_mutex_unlock(&jobs->mutex);
    job->record.request = text;
    is_good = is_good && job_store_add(jobs->store, &job->record, key ? key : "", body, err);
    job->record.request = NULL;
    free(text);
    if (!is_good)
        return false;
    pthread_mutex_lock(&jobs->mutex);
    append(jobs, job);
    jobs_join_queue(jobs, job);
    pthread_cond_broadcast(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
    return true;
}

bool jobs_submit(struct jobs *jobs, const char *text, size_t size_bytes, const char *key,
                 char id[JOB_ID_BYTES], bool *is_new, struct error *err)
{
    char body[DIGEST_TEXT_BYTES], known_body[DIGEST_TEXT_BYTES];
    struct error problem = {0};
    *is_new = true;
    if ((key && !check_key(key, err)) || !digest_of(text, size_bytes, body, err))
        return false;
    pthread_mutex_lock(&jobs->disk);
    bool is_known = key && job_store_find_key(jobs->store, key, id, known_body, &problem);
    pthread_mutex_unlock(&jobs->disk);
    if (problem.code != ERROR_NONE)
        return error_pass(err, &problem);
    struct farm_job *job = is_known ? NULL : farm_job_create(jobs, text, size_bytes, false, err);
    if (!is_known && !job)
        return false;
    struct job_place place = {.id = "", .directory = ""};
    if (job) {
        job->record.created_s = time(NULL);
        job->record.is_paused = job->request.is_paused;
        job->record.priority = job->request.priority;
        job->record.sequence = 1;
        if (!frames_make_id(job->record.id, err)) {
            farm_job_destroy(job);
            return false;
        }
        place = farm_job_place(job);
    }
    pthread_mutex_lock(&jobs->disk);
    if (!is_known && key) /* another request may have come first */
        is_known = job_store_find_key(jobs->store, key, id, known_body, &problem);
    bool is_good = problem.code == ERROR_NONE || error_pass(err, &problem);
    if (is_good && !is_known)
        is_good =
            job_results_prepare(jobs->results, &place, err) && add_job(jobs, job, key, body, err);
    pthread_mutex_unlock(&jobs->disk);
    if (is_known || !is_good) {
        if (job)
            job_results_remove(jobs->results, job->record.id);
        farm_job_destroy(job);
    } else {
        memcpy(id, job->record.id, JOB_ID_BYTES);
    }
    *is_new = !is_known;
    return is_good &&
           (!is_known || strcmp(body, known_body) == 0 ||
            error_set(err, ERROR_UNSUPPORTED,
                      "Idempotency-Key: '%.64s' was used for job %s with another body", key, id));
}

/* ---- changing ---- */

/* Finds a job and saves what `apply` makes of it; with err set the job stays as it was. retries:
 * what is kept of failed frames is forgotten. */
static bool change(struct jobs *jobs, const char *id, void *context,
                   bool (*apply)(struct jobs *jobs, struct farm_job *job, void *context,
                                 struct error *err),
                   bool retries, struct error *err)
{
    struct job_record before, after;
    pthread_mutex_lock(&jobs->disk);
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    bool is_good = job || jobs_not_found(id, err);
    if (is_good) {
        before = job->record;
        is_good = apply(jobs, job, context, err);
        if (is_good)
            jobs_note_change(jobs, job);
        after = job->record;
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (is_good && !job_store_update(jobs->store, &after, retries, err)) {
        is_good = false;
        pthread_mutex_lock(&jobs->mutex);
        before.sequence = after.sequence + 1; /* the disk stays locked: the job is still there */
        job->record = before;
        pthread_mutex_unlock(&jobs->mutex);
    }
    pthread_mutex_unlock(&jobs->disk);
    return is_good;
}

struct cancelling {
    uint64_t tickets[JOB_PIECES_MAX];
    bool must_be_broken; /* else the job stays as it is */
};

static bool apply_cancel(struct jobs *jobs, struct farm_job *job, void *context, struct error *err)
{
    struct cancelling *cancelling = context;
    (void)err;
    if (farm_job_has_ended(job))
        return true;
    if (cancelling->must_be_broken && !(farm_job_is_waiting(job) && job->broken))
        return true;
    if (cancelling->must_be_broken)
        job->record.problem = job->broken_why;
    jobs_note_end(jobs, job, FARM_JOB_CANCELLED);
    for (int i = 0; i < JOB_PIECES_MAX; i++)
        if (jobs->in_flight[i] && jobs->in_flight[i]->job == job)
            cancelling->tickets[i] = jobs->in_flight[i]->ticket;
    return true;
}

bool jobs_cancel_broken(struct jobs *jobs, const char *id, struct error *err)
{
    struct cancelling cancelling = {.must_be_broken = true};
    return change(jobs, id, &cancelling, apply_cancel, false, err);
}

/* Tiles of a cancelled job are of no use; those still in flight are not kept. */
static void drop_tiles(struct jobs *jobs, const char *id)
{
    pthread_mutex_lock(&jobs->disk); /* whoever forgets a job locks it, too */
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    bool is_cancelled = job && job->record.state == FARM_JOB_CANCELLED;
    pthread_mutex_unlock(&jobs->mutex);
    if (is_cancelled)
        farm_tiles_clean(jobs, job);
    pthread_mutex_unlock(&jobs->disk);
}

bool jobs_cancel(struct jobs *jobs, const char *id, struct error *err)
{
    struct cancelling cancelling = {0}; /* tickets which no render has */
    bool is_good = change(jobs, id, &cancelling, apply_cancel, false, err);
    for (int i = 0; is_good && i < JOB_PIECES_MAX; i++) /* calls back: without a lock */
        supervisor_cancel(jobs->desc.supervisor, cancelling.tickets[i]);
    if (is_good)
        drop_tiles(jobs, id);
    return is_good;
}

static bool retry_failed(struct jobs *jobs, struct farm_job *job, struct error *err)
{
    if (job->failed_count == 0)
        return error_set(err, ERROR_CONFLICT, "job '%s' has no failed frames", job->record.id);
    for (int i = 0; i < (int)job->request.frames.count; i++) {
        struct farm_frame *frame = &job->frames[i];
        if (frame->state != FARM_FRAME_FAILED)
            continue;
        frame->attempts = 0;
        frame->sequence = ++job->record.sequence; /* one each: events are cut between numbers */
        farm_job_set_frame(job, i, FARM_FRAME_QUEUED);
    }
    job->record.state = job->record.started_s ? FARM_JOB_RUNNING : FARM_JOB_QUEUED;
    job->record.ended_s = job->record.ended_ms = 0;
    job->record.problem = (struct error){0};
    jobs->order_is_stale = true;
    jobs_join_queue(jobs, job);
    return true;
}

static bool apply_change(struct jobs *jobs, struct farm_job *job, void *context, struct error *err)
{
    const struct job_change *asked = context;
    if (asked->retries && !retry_failed(jobs, job, err))
        return false;
    if (asked->has_paused && farm_job_has_ended(job))
        return error_set(err, ERROR_CONFLICT, "job '%s' has ended: it cannot be paused or resumed",
                         job->record.id);
    if (asked->has_priority)
        job->record.priority = asked->priority;
    if (asked->has_paused) {
        if (job->record.is_paused && !asked->is_paused) {
            job->record.problem = (struct error){0};
            job->makes_directory = true;
            jobs_join_queue(jobs, job);
        }
        job->record.is_paused = asked->is_paused;
    }
    return true;
}

bool jobs_change(struct jobs *jobs, const char *id, const struct job_change *asked,
                 struct error *err)
{
    struct job_change copy = *asked;
    return change(jobs, id, &copy, apply_change, asked->retries, err);
}

bool jobs_forget_ended(struct jobs *jobs, struct farm_job *job, enum forget_reason reason,
                       struct error *err)
{
    if (!job_store_remove(jobs->store, job->record.number, err))
        return false;
    job_results_remove(jobs->results, job->record.id);
    pthread_mutex_lock(&jobs->mutex);
    int index = 0;
    while (jobs->list[index] != job)
        index++;
    jobs->count--;
    memmove(&jobs->list[index], &jobs->list[index + 1],
            (size_t)(jobs->count - index) * sizeof jobs->list[0]);
    jobs->frames_kept -= job->request.frames.count;
    jobs->totals.forgotten[reason]++;
    jobs_notify_watches(jobs, job->record.id);
    pthread_cond_broadcast(&jobs->changed);
    job->is_gone = true;
    if (job->pieces == 0)
        farm_job_destroy(job);
    pthread_mutex_unlock(&jobs->mutex);
    return true;
}

bool jobs_forget(struct jobs *jobs, const char *id, struct error *err)
{
    pthread_mutex_lock(&jobs->disk);
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    bool is_good = job || jobs_not_found(id, err);
    if (is_good && !farm_job_has_ended(job))
        is_good = error_set(err, ERROR_CONFLICT, "job '%s' has not ended: cancel it first", id);
    is_good = is_good && job_order_may_forget(jobs, job, err);
    pthread_mutex_unlock(&jobs->mutex);
    is_good = is_good && jobs_forget_ended(jobs, job, FORGET_ASKED, err);
    pthread_mutex_unlock(&jobs->disk);
    return is_good;
}

/* ---- reading ---- */

json_t *jobs_get(struct jobs *jobs, const char *id, struct error *err)
{
    json_t *json = NULL;
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    if (job && !(json = farm_job_to_json(jobs, job, true)))
        error_set(err, ERROR_NO_MEMORY, "job");
    pthread_mutex_unlock(&jobs->mutex);
    if (!job)
        jobs_not_found(id, err);
    return json;
}

json_t *jobs_list(struct jobs *jobs, struct error *err)
{
    json_t *list = json_array();
    bool is_good = list;
    pthread_mutex_lock(&jobs->mutex);
    for (int i = jobs->count; is_good && i-- > 0;)
        is_good = json_array_append_new(list, farm_job_to_json(jobs, jobs->list[i], false)) == 0;
    pthread_mutex_unlock(&jobs->mutex);
    if (is_good)
        return list;
    error_set(err, ERROR_NO_MEMORY, "jobs");
    json_decref(list);
    return NULL;
}

json_t *jobs_get_frames(struct jobs *jobs, const char *id, int first, int max_count,
                        struct error *err)
{
    json_t *list = json_array();
    bool is_good = list || error_set(err, ERROR_NO_MEMORY, "frames");
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    int count = job ? (int)job->request.frames.count : 0;
    int end = max_count < count - first ? first + max_count : count;
    for (int i = first; is_good && i < end; i++)
        is_good = json_array_append_new(list, farm_frame_to_json(job, i)) == 0 ||
                  error_set(err, ERROR_NO_MEMORY, "frames");
    pthread_mutex_unlock(&jobs->mutex);
    if (!job)
        is_good = jobs_not_found(id, err);
    json_t *json =
        is_good ? json_pack("{s:o,s:i,s:i}", "frames", list, "first", first, "count", count) : NULL;
    if (!is_good)
        json_decref(list);
    return json;
}

static int compare_sequences(const void *left, const void *right)
{
    const uint64_t *a = left, *b = right;
    return (*a > *b) - (*a < *b);
}

/* Positions of the frames that changed after `sequence`, below their sequences in order. */
static uint64_t *changed_frames(const struct farm_job *job, uint32_t sequence, size_t *count)
{
    *count = 0;
    for (size_t i = 0; i < job->request.frames.count; i++)
        *count += job->frames[i].sequence > sequence;
    uint64_t *keys = malloc((*count + 1) * sizeof *keys);
    size_t used = 0;
    for (size_t i = 0; keys && i < job->request.frames.count; i++)
        if (job->frames[i].sequence > sequence)
            keys[used++] = (uint64_t)job->frames[i].sequence << 32 | i;
    if (keys)
        qsort(keys, *count, sizeof *keys, compare_sequences);
    return keys;
}

json_t *jobs_changes(struct jobs *jobs, const char *id, uint32_t sequence)
{
    json_t *list = json_array(), *changes = NULL;
    size_t count = 0;
    pthread_mutex_lock(&jobs->mutex);
    struct farm_job *job = jobs_find(jobs, id);
    if (job && sequence > job->record.sequence) /* of no change of this job: all is news */
        sequence = 0;
    uint64_t *keys =
        job && list && !jobs->is_stopping ? changed_frames(job, sequence, &count) : NULL;
    if (keys) {
        size_t shown = count < CHANGES_SHOWN_MAX ? count : CHANGES_SHOWN_MAX;
        uint32_t last = shown < count ? (uint32_t)(keys[shown - 1] >> 32) : job->record.sequence;
        for (size_t i = 0; i < shown; i++)
            json_array_append_new(list, farm_frame_to_json(job, (int)(keys[i] & 0xffffffff)));
        changes = json_pack("{s:I,s:O,s:o}", "sequence", (json_int_t)last, "frames", list, "job",
                            farm_job_to_json(jobs, job, false));
    }
    pthread_mutex_unlock(&jobs->mutex);
    free(keys);
    json_decref(list);
    return changes;
}

/* ---- files ---- */

static int position_of(const struct farm_job *job, int number)
{
    for (size_t i = 0; i < job->request.frames.count; i++)
        if (job->request.frames.numbers[i] == number)
            return (int)i;
    return -1;
}

static int output_of(const struct farm_job *job, const char *name)
{
    for (int i = 0; i < job->request.output_count; i++)
        if (strcmp(job->request.outputs[i].name, name) == 0)
            return i;
    return -1;
}

/* What opening a file needs, copied under the mutex. */
struct found_file {
    char id[JOB_ID_BYTES], directory[JOB_DIRECTORY_BYTES];
    struct job_file file;
};

static void copy_file(const struct farm_job *job, int position, int output,
                      struct found_file *found)
{
    const struct farm_file *file = &job->frames[position].files[output];
    memcpy(found->id, job->record.id, sizeof found->id);
    memcpy(found->directory, job->request.directory, sizeof found->directory);
    found->file = (struct job_file){.fd = -1, .size_bytes = file->size_bytes};
    memcpy(found->file.digest, file->digest, sizeof found->file.digest);
    job_file_name(&job->request.outputs[output], job->request.frames.numbers[position],
                  found->file.name);
    struct render_request as = {.format = job->request.outputs[output].format};
    found->file.media_type = image_format_media_type(image_format_from_request(&as));
}

static bool open_found(struct jobs *jobs, struct found_file *found, struct job_file *file,
                       struct error *err)
{
    const struct job_place place = {.id = found->id, .directory = found->directory};
    *file = found->file;
    file->fd = job_results_open(jobs->results, &place, file->name, err);
    return file->fd >= 0;
}

bool jobs_open_file(struct jobs *jobs, const char *id, int frame, const char *output,
                    struct job_file *file, struct error *err)
{
    struct found_file found;
    bool is_good = false;
    pthread_mutex_lock(&jobs->mutex);
    const struct farm_job *job = jobs_find(jobs, id);
    int position = job ? position_of(job, frame) : -1;
    int index = job ? output_of(job, output) : -1;
    if (!job)
        jobs_not_found(id, err);
    else if (position < 0)
        error_set(err, ERROR_NOT_FOUND, "job '%s' has no frame %d", id, frame);
    else if (index < 0)
        error_set(err, ERROR_NOT_FOUND, "job '%s' has no output '%.64s'", id, output);
    else if (!job->frames[position].files || !job->frames[position].files[index].size_bytes)
        error_set(err, ERROR_NOT_FOUND, "'%s' of frame %d is not made%s", output, frame,
                  job->frames[position].state == FARM_FRAME_FAILED ? ": the frame has failed"
                                                                   : " yet");
    else
        is_good = true;
    if (is_good)
        copy_file(job, position, index, &found);
    pthread_mutex_unlock(&jobs->mutex);
    return is_good && open_found(jobs, &found, file, err);
}

bool jobs_next_file(struct jobs *jobs, const char *id, uint64_t *at, struct job_file *file,
                    struct error *err)
{
    struct found_file found;
    bool is_found = false;
    pthread_mutex_lock(&jobs->mutex);
    const struct farm_job *job = jobs_find(jobs, id);
    uint64_t outputs = job ? (uint64_t)job->request.output_count : 1;
    uint64_t count = job ? job->request.frames.count * outputs : 0;
    for (; *at < count && !is_found; (*at)++) {
        const struct farm_frame *frame = &job->frames[*at / outputs];
        is_found = frame->files && frame->files[*at % outputs].size_bytes > 0;
        if (is_found)
            copy_file(job, (int)(*at / outputs), (int)(*at % outputs), &found);
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (!job)
        return jobs_not_found(id, err);
    return is_found && open_found(jobs, &found, file, err);
}

struct jobs_totals jobs_get_totals(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->mutex);
    struct jobs_totals totals = jobs->totals;
    for (int i = 0; i < jobs->count; i++) {
        const struct farm_job *job = jobs->list[i];
        bool is_waiting = farm_job_is_waiting(job);
        totals.waiting += is_waiting;
        totals.by_state[job->record.state] += !is_waiting;
        if (!farm_job_has_ended(job))
            totals.frames_waiting +=
                job->request.frames.count - (size_t)(job->done_count + job->failed_count);
        totals.result_bytes += job->result_bytes;
        totals.kept_bytes += *job->request.directory ? 0 : job->result_bytes;
    }
    pthread_mutex_unlock(&jobs->mutex);
    return totals;
}

/* ---- life ---- */

/* Each of its frames would fail: its scene was of another version of the program, or is damaged. */
static void pause_without(struct jobs *jobs, struct farm_job *job, const struct error *missing)
{
    job->record.is_paused = true;
    job->record.problem = (struct error){0};
    error_set(&job->record.problem, missing->code,
              "paused, since %s: bring it again, and resume the job", missing->message);
    log_write(jobs->desc.log, LOG_WARNING, "job %s: %s", job->record.id,
              job->record.problem.message);
}

static bool load_job(void *context, const struct job_record *record, struct error *err)
{
    struct jobs *jobs = context;
    struct error problem = {0};
    struct farm_job *job =
        farm_job_create(jobs, record->request, strlen(record->request), true, &problem);
    if (!job) {
        log_write(jobs->desc.log, LOG_ERROR, "job %s of the state directory is left out: %s",
                  record->id, problem.message);
        return true;
    }
    job->record = *record;
    job->record.request = job->record.chosen = NULL;
    farm_job_set_chosen(job, record->chosen ? strdup(record->chosen) : NULL);
    if (!farm_job_has_ended(job) && !farm_job_has_resources(jobs, job, &problem))
        pause_without(jobs, job, &problem);
    pthread_mutex_lock(&jobs->mutex);
    bool is_good = make_room(jobs, job, err) && job_order_resolve(jobs, job, true, err);
    if (is_good)
        append(jobs, job);
    pthread_mutex_unlock(&jobs->mutex);
    if (!is_good)
        farm_job_destroy(job);
    return is_good;
}

static struct farm_job *newest(struct jobs *jobs, int64_t number)
{
    struct farm_job *job = jobs->count > 0 ? jobs->list[jobs->count - 1] : NULL;
    return job && job->record.number == number ? job : NULL;
}

static void load_frame(void *context, int64_t number, const struct frame_record *record)
{
    struct farm_job *job = newest(context, number);
    if (!job || record->position < 0 || record->position >= (int)job->request.frames.count)
        return;
    struct farm_frame *frame = &job->frames[record->position];
    frame->attempts = record->attempts;
    frame->sequence = record->sequence;
    frame->ms = (float)record->ms;
    frame->code = record->code;
    frame->problem = record->code != ERROR_NONE ? strdup(record->problem) : NULL;
    farm_job_set_frame(job, record->position, record->state);
    if (record->state == FARM_FRAME_DONE)
        job->busy_ms += record->ms;
}

/* A file that is not there any more, of a job that has not ended, is made again. */
static void load_file(void *context, int64_t number, const struct file_record *record)
{
    struct jobs *jobs = context;
    struct farm_job *job = newest(jobs, number);
    if (!job || record->position < 0 || record->position >= (int)job->request.frames.count ||
        record->output < 0 || record->output >= job->request.output_count)
        return;
    struct farm_frame *frame = &job->frames[record->position];
    const struct job_place place = farm_job_place(job);
    char name[JOB_FILE_BYTES];
    job_file_name(&job->request.outputs[record->output],
                  job->request.frames.numbers[record->position], name);
    if (!farm_job_has_ended(job) &&
        !job_results_have(jobs->results, &place, name, record->size_bytes)) {
        log_write(jobs->desc.log, LOG_WARNING, "job %s: '%s' is gone and is made again",
                  job->record.id, name);
        farm_job_set_frame(job, record->position, FARM_FRAME_QUEUED);
        return;
    }
    if (!frame->files)
        frame->files = calloc((size_t)job->request.output_count, sizeof *frame->files);
    if (!frame->files)
        return;
    frame->files[record->output].size_bytes = record->size_bytes;
    memcpy(frame->files[record->output].digest, record->digest, DIGEST_TEXT_BYTES);
    job->result_bytes += record->size_bytes;
}

static bool begin(struct jobs *jobs, struct error *err)
{
    char folder[CONFIG_PATH_BYTES + 8];
    const struct job_visitor visitor = {jobs, load_job, load_frame, load_file};
    snprintf(folder, sizeof folder, "%s/jobs", jobs->desc.config->state_dir);
    jobs->results = job_results_create(folder, jobs->desc.config->job_dir, err);
    jobs->store = jobs->results ? job_store_create(folder, jobs->desc.log, err) : NULL;
    jobs->began_ms = now_ms();
    if (!jobs->store || !job_store_get_ran_ms(jobs->store, &jobs->ran_before_ms, err) ||
        !job_store_load(jobs->store, &visitor, err))
        return false;
    for (int i = 0; i < jobs->count; i++)
        farm_tiles_load(jobs, jobs->list[i]);
    jobs->has_thread = pthread_create(&jobs->thread, NULL, jobs_thread, jobs) == 0;
    return jobs->has_thread || error_set(err, ERROR_INTERNAL, "jobs: no thread");
}

struct jobs *jobs_create(const struct jobs_desc *desc, struct error *err)
{
    struct jobs *jobs = calloc(1, sizeof *jobs);
    pthread_condattr_t monotonic;
    if (!jobs) {
        error_set(err, ERROR_NO_MEMORY, "jobs");
        return NULL;
    }
    jobs->desc = *desc;
    pthread_mutex_init(&jobs->disk, NULL);
    pthread_mutex_init(&jobs->mutex, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&jobs->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (begin(jobs, err))
        return jobs;
    jobs_destroy(jobs);
    return NULL;
}

void jobs_stop(struct jobs *jobs)
{
    if (!jobs || !jobs->has_thread)
        return;
    pthread_mutex_lock(&jobs->mutex);
    jobs->is_stopping = true;
    jobs_notify_watches(jobs, NULL);
    pthread_cond_broadcast(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
    pthread_join(jobs->thread, NULL);
    job_assembly_stop(jobs);
    struct error ignored = {0}; /* then the time since it was last saved does not count */
    pthread_mutex_lock(&jobs->disk);
    if (!job_store_set_ran_ms(jobs->store, jobs_ran_ms(jobs), &ignored))
        log_write(jobs->desc.log, LOG_WARNING, "%s", ignored.message);
    pthread_mutex_unlock(&jobs->disk);
    jobs->has_thread = false;
}

static void destroy_pieces(struct jobs *jobs)
{
    for (struct job_piece *piece = jobs->ended, *next; piece; piece = next) {
        next = piece->next;
        if (piece->job->is_gone && --piece->job->pieces == 0)
            farm_job_destroy(piece->job);
        if (piece->image_fd >= 0)
            close(piece->image_fd);
        free(piece->chosen);
        free(piece);
    }
}

void jobs_destroy(struct jobs *jobs)
{
    if (!jobs)
        return;
    jobs_stop(jobs);
    destroy_pieces(jobs);
    for (int i = 0; i < jobs->count; i++)
        farm_job_destroy(jobs->list[i]);
    free(jobs->list);
    job_store_destroy(jobs->store);
    job_results_destroy(jobs->results);
    pthread_cond_destroy(&jobs->changed);
    pthread_mutex_destroy(&jobs->mutex);
    pthread_mutex_destroy(&jobs->disk);
    free(jobs);
}
