/* SPDX-License-Identifier: MIT */
/* Decoding: spawn, hand over descriptors, wait with a deadline, publish or say what went wrong. */
#include "server/front/decode_pool.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "protocol/upload_stage.h"
#include "server/base/child.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/decoded_summary.h"

enum {
    STOP_CHECK_MS = 100, /* how soon a stop is noticed while a decoder runs */
    PEER_STALL_S = 10,
    CALM_S = 3, /* after a start */
    DECODE_REQUEST_ID_BYTES = 65,
};

struct decode_job {
    struct decode_job *next;
    char id[DIGEST_TEXT_BYTES], request_id[DECODE_REQUEST_ID_BYTES];
    struct upload *upload;
    int64_t submitted_ms;
    struct decode_status status; /* guarded by the pool's mutex */
    void *context;
    bool (*fill)(void *context, struct upload *upload, char id[DIGEST_TEXT_BYTES],
                 struct error *err);
    bool is_here; /* stored before it was filled: nothing is decoded */
    void (*done)(void *context, bool is_new, const struct error *problem);
};

struct decode_pool {
    const struct config *config;
    const struct log *log;
    const struct resources *resources;
    pthread_mutex_t mutex; /* guards the queue and the spare */
    pthread_cond_t has_work;
    struct decode_job *first, **last;
    struct decode_job *running; /* linked as those that wait */
    size_t count;
    atomic_bool is_stopping;
    struct child spare; /* a decoder that has loaded its libraries already and waits for a job */
    pthread_t threads[DECODE_THREADS];
    int thread_count;
    atomic_uint_least64_t decoded, refused, crashes, timeouts;
};

static const struct resource_info *info_of(const struct upload *upload)
{
    return resource_info(upload_kind(upload));
}

static json_t *describe_job(const struct decode_pool *pool, const struct upload *upload)
{
    size_t count;
    const struct upload_file *files = upload_files(upload, &count);
    json_t *list = json_array();
    for (size_t i = 0; list && i < count; i++)
        if (json_array_append_new(list, json_pack("{s:s,s:I,s:I}", "name", files[i].name, "offset",
                                                  (json_int_t)files[i].offset_bytes, "size",
                                                  (json_int_t)files[i].size_bytes)) != 0) {
            json_decref(list);
            return NULL;
        }
    const struct upload_reading *reading = upload_reading(upload);
    return list ? json_pack("{s:s,s:o,s:s?,s:s,s:f,s:i,s:f,s:I,s:i}", "kind", info_of(upload)->job,
                            "files", list, "scene", upload_scene(upload), "format",
                            scene_format_describe(reading->format)->name, "unit_m", reading->unit_m,
                            "up", reading->up, "deflection", reading->deflection, "memory_bytes",
                            (json_int_t)pool->config->decode_memory_bytes, "timeout_s",
                            pool->config->decode_timeout_s)
                : NULL;
}

enum answer { ANSWER_MESSAGE, ANSWER_NONE, ANSWER_REFUSED };

/* Waits for a message of the decoder. ANSWER_NONE: it died, and err is untouched; ANSWER_REFUSED:
 * err says why. */
static enum answer await_message(struct decode_pool *pool, const struct child *decoder,
                                 int64_t deadline, struct ipc_message *message, struct error *err)
{
    struct pollfd wait = {.fd = decoder->socket, .events = POLLIN};
    for (;;) {
        int64_t left = deadline - now_ms();
        int ready = left > 0 ? poll(&wait, 1, left < STOP_CHECK_MS ? (int)left : STOP_CHECK_MS) : 0;
        if (ready > 0)
            break;
        if (atomic_load(&pool->is_stopping)) {
            error_set(err, ERROR_OVERLOADED, "the server is stopping");
            return ANSWER_REFUSED;
        }
        if (left > 0)
            continue;
        atomic_fetch_add(&pool->timeouts, 1);
        error_set(err, ERROR_INVALID_SCENE,
                  "decoding took longer than %d s, the limit (decode-timeout-s)",
                  pool->config->decode_timeout_s);
        return ANSWER_REFUSED;
    }
    return ipc_receive(decoder->socket, message, NULL) == IPC_MESSAGE ? ANSWER_MESSAGE
                                                                      : ANSWER_NONE;
}

/* Adds what was reading to an error of a decoder that could not say it itself. */
static bool name_reader(const struct upload *upload, struct error *err)
{
    const struct scene_format_info *format = scene_format_describe(upload_reading(upload)->format);
    return format->converter
               ? error_wrap(err, "%s, read through %s", format->title, format->converter)
               : false;
}

/* A decoder says how far it is; it is not trusted to say it well. False: it says something else. */
static bool note_status(struct decode_pool *pool, struct decode_job *job, const json_t *said)
{
    const char *stage = json_string_value(json_object_get(said, "stage"));
    double share = json_number_value(json_object_get(said, "share"));
    if (!stage)
        return false;
    const char *known = upload_stage_name(upload_stage_find(stage));
    if (!known)
        return true;
    pthread_mutex_lock(&pool->mutex);
    snprintf(job->status.stage, sizeof job->status.stage, "%s", known);
    job->status.share = share >= 0 && share <= 1 ? share : 0;
    pthread_mutex_unlock(&pool->mutex);
    return true;
}

/* The decoder's last word; what it says on its way is noted. */
static enum answer await_last_message(struct decode_pool *pool, struct decode_job *job,
                                      const struct child *decoder, int64_t deadline,
                                      struct ipc_message *message, struct error *err)
{
    for (;;) {
        enum answer answer = await_message(pool, decoder, deadline, message, err);
        if (answer != ANSWER_MESSAGE || !note_status(pool, job, message->json))
            return answer;
        ipc_message_finish(message);
    }
}

/* The decoder has begun. What it was doing when it dies is unknown; that it died is said to the
 * client. */
static bool await_result(struct decode_pool *pool, struct decode_job *job, struct child *decoder,
                         int64_t deadline, struct error *err)
{
    struct ipc_message message = {0};
    const struct upload *upload = job->upload;
    switch (await_last_message(pool, job, decoder, deadline, &message, err)) {
    case ANSWER_REFUSED:
        return err->code == ERROR_INVALID_SCENE ? name_reader(upload, err) : false;
    case ANSWER_NONE: {
        char how[64];
        child_stop(decoder, 1000, how, sizeof how);
        if (atomic_load(&pool->is_stopping)) /* its thread took it along */
            return error_set(err, ERROR_OVERLOADED, "the server is stopping");
        atomic_fetch_add(&pool->crashes, 1);
        error_set(err, ERROR_INVALID_SCENE, "the decoder ended with %s while it read this upload",
                  how);
        return name_reader(upload, err);
    }
    case ANSWER_MESSAGE:
        break;
    }
    const json_t *failure = json_object_get(message.json, "error");
    if (failure)
        ipc_error_from_json(failure, err);
    ipc_message_finish(&message);
    return failure == NULL;
}

/* Starting a decoder takes longer than most decoding, so one is kept ready. It dies with the thread
 * that started it, and those live as long as the pool. */
static void refill_spare(struct decode_pool *pool)
{
    struct child fresh = {0};
    pthread_mutex_lock(&pool->mutex);
    bool is_wanted = pool->spare.pid == 0 && !atomic_load(&pool->is_stopping);
    if (is_wanted && child_start(&fresh, &(struct child_desc){.role = "decoder"}, NULL))
        pool->spare = fresh;
    pthread_mutex_unlock(&pool->mutex);
}

static bool send_job(const struct child *decoder, const json_t *job, const int fds[3],
                     struct error *err)
{
    return ipc_set_timeout(decoder->socket, PEER_STALL_S, err) &&
           ipc_send(decoder->socket, job, fds, 3, err);
}

/* Leaves a decoder that has begun. The spare may have been killed meanwhile: then, and only then, a
 * fresh one is tried. */
static bool start_decoder(struct decode_pool *pool, struct child *decoder, const json_t *job,
                          const int fds[3], int64_t deadline, struct error *err)
{
    pthread_mutex_lock(&pool->mutex);
    *decoder = pool->spare;
    pool->spare = (struct child){0};
    pthread_mutex_unlock(&pool->mutex);
    bool was_spare = decoder->pid > 0;
    if (!was_spare && !child_start(decoder, &(struct child_desc){.role = "decoder"}, err))
        return false;
    struct ipc_message began = {0};
    enum answer answer = send_job(decoder, job, fds, NULL)
                             ? await_message(pool, decoder, deadline, &began, err)
                             : ANSWER_NONE;
    ipc_message_finish(&began);
    if (answer == ANSWER_MESSAGE)
        return true;
    child_stop(decoder, 0, NULL, 0);
    if (answer == ANSWER_REFUSED)
        return false;
    return was_spare ? start_decoder(pool, decoder, job, fds, deadline, err)
                     : error_set(err, ERROR_INTERNAL, "the decoder does not start");
}

/* Sends the job and waits. An upload may not take the service's memory for its
 * own want of it. */
static bool run_decoder(struct decode_pool *pool, struct decode_job *job, int blob_fd,
                        int summary_fd, struct error *err)
{
    struct child decoder;
    const struct upload *upload = job->upload;
    json_t *message = describe_job(pool, upload);
    if (!message)
        return error_set(err, ERROR_NO_MEMORY, "job of a decoder");
    const int fds[3] = {upload_fd(upload), blob_fd, summary_fd};
    int64_t deadline = now_ms() + 1000ll * pool->config->decode_timeout_s;
    bool is_good = start_decoder(pool, &decoder, message, fds, deadline, err);
    json_decref(message);
    if (is_good) {
        is_good = await_result(pool, job, &decoder, deadline, err);
        child_stop(&decoder, is_good ? 1000 : 0, NULL, 0);
    }
    if (!is_good && err->code == ERROR_NO_MEMORY) {
        struct error in_upload = {0};
        error_set(&in_upload, ERROR_INVALID_SCENE,
                  "decoding needs more than the %llu bytes that it may take: %s",
                  (unsigned long long)pool->config->decode_memory_bytes, err->message);
        *err = in_upload;
    }
    if (!is_good && err->code == ERROR_INVALID_SCENE)
        err->code = info_of(upload)->broken;
    return is_good;
}

static struct resource_store *store_of(const struct decode_pool *pool, const struct decode_job *job)
{
    return resources_store(pool->resources, upload_kind(job->upload));
}

static bool fill_job(struct decode_pool *pool, struct decode_job *job, struct error *err)
{
    if (!job->fill)
        return true;
    if (!job->fill(job->context, job->upload, job->id, err))
        return false;
    job->is_here = resource_store_has(store_of(pool, job), job->id);
    return true;
}

static bool decode(struct decode_pool *pool, struct decode_job *job, bool *is_new,
                   struct error *err)
{
    struct resource_store *store = store_of(pool, job);
    struct resource_draft draft = {0};
    json_t *summary = NULL;
    int summary_fd = memfd_create("vitrail-summary", MFD_CLOEXEC);
    if (summary_fd < 0)
        return error_set(err, ERROR_NO_MEMORY, "memfd_create: %s", strerror(errno));
    bool is_good =
        resource_draft_begin(store, &draft, err) &&
        run_decoder(pool, job, draft.blob_fd, summary_fd, err) &&
        (summary = decoded_summary_read(job->upload, job->id, summary_fd, draft.blob_fd, err)) &&
        resource_draft_commit(store, &draft, summary, is_new, err);
    json_decref(summary);
    resource_draft_discard(store, &draft);
    close(summary_fd);
    return is_good;
}

static bool run_job(struct decode_pool *pool, struct decode_job *job, bool *is_new,
                    struct error *err)
{
    return fill_job(pool, job, err) && (job->is_here || decode(pool, job, is_new, err));
}

static void finish_job(struct decode_pool *pool, struct decode_job *job, bool is_new,
                       const struct error *problem)
{
    if (!job->is_here)
        atomic_fetch_add(problem->code == ERROR_NONE ? &pool->decoded : &pool->refused, 1);
    pthread_mutex_lock(&pool->mutex);
    for (struct decode_job **at = &pool->running; *at; at = &(*at)->next)
        if (*at == job) {
            *at = job->next;
            break;
        }
    pthread_mutex_unlock(&pool->mutex);
    upload_destroy(job->upload);
    job->done(job->context, is_new, problem);
    free(job);
}

static struct decode_job *take_job(struct decode_pool *pool)
{
    pthread_mutex_lock(&pool->mutex);
    while (!pool->first && !pool->is_stopping)
        pthread_cond_wait(&pool->has_work, &pool->mutex);
    struct decode_job *job = pool->is_stopping ? NULL : pool->first;
    if (job) {
        pool->first = job->next;
        if (!pool->first)
            pool->last = &pool->first;
        pool->count--;
        job->status.is_decoding = true;
        job->next = pool->running;
        pool->running = job;
    }
    pthread_mutex_unlock(&pool->mutex);
    return job;
}

/* Where scenes are stored, a start is most likely followed by a render of one, and a decoder that
 * loads its libraries meanwhile takes a core from it. False when there is work already. */
static bool wait_for_calm(struct decode_pool *pool)
{
    struct timespec until;
    int result = resource_store_get_totals(pool->resources->scenes).count ? 0 : ETIMEDOUT;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += CALM_S;
    pthread_mutex_lock(&pool->mutex);
    while (!pool->first && !pool->is_stopping && result == 0)
        result = pthread_cond_clockwait(&pool->has_work, &pool->mutex, CLOCK_MONOTONIC, &until);
    bool is_calm = !pool->first && !pool->is_stopping;
    pthread_mutex_unlock(&pool->mutex);
    return is_calm;
}

static void *pool_run(void *argument)
{
    struct decode_pool *pool = argument;
    if (wait_for_calm(pool))
        refill_spare(pool);
    for (struct decode_job *job; (job = take_job(pool)); refill_spare(pool)) {
        struct error problem = {0};
        bool is_new = false;
        int64_t began = now_ms();
        if (!run_job(pool, job, &is_new, &problem))
            log_write(pool->log, LOG_INFO, "%s %.12s refused after %lld ms: %s",
                      info_of(job->upload)->noun, job->id, (long long)(now_ms() - began),
                      problem.message);
        else if (!job->is_here)
            log_write(pool->log, LOG_INFO, "%s %.12s decoded in %lld ms",
                      info_of(job->upload)->noun, job->id, (long long)(now_ms() - began));
        finish_job(pool, job, is_new, &problem);
    }
    return NULL;
}

struct decode_pool *decode_pool_create(const struct decode_pool_desc *desc, struct error *err)
{
    struct decode_pool *pool = calloc(1, sizeof *pool);
    if (!pool) {
        error_set(err, ERROR_NO_MEMORY, "decode pool");
        return NULL;
    }
    pool->config = desc->config;
    pool->log = desc->log;
    pool->resources = desc->resources;
    pool->last = &pool->first;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->has_work, NULL);
    while (pool->thread_count < DECODE_THREADS &&
           pthread_create(&pool->threads[pool->thread_count], NULL, pool_run, pool) == 0)
        pool->thread_count++;
    if (pool->thread_count == DECODE_THREADS)
        return pool;
    error_set(err, ERROR_INTERNAL, "decode pool: threads cannot be started");
    decode_pool_destroy(pool);
    return NULL;
}

void decode_pool_stop(struct decode_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->mutex);
    pool->is_stopping = true;
    struct decode_job *waiting = pool->first;
    pool->first = NULL;
    pthread_cond_broadcast(&pool->has_work);
    pthread_mutex_unlock(&pool->mutex);
    struct error stopping = {ERROR_OVERLOADED, "the server is stopping", ""};
    while (waiting) {
        struct decode_job *next = waiting->next;
        finish_job(pool, waiting, false, &stopping);
        waiting = next;
    }
    for (int i = 0; i < pool->thread_count; i++)
        pthread_join(pool->threads[i], NULL);
    pool->thread_count = 0;
}

void decode_pool_destroy(struct decode_pool *pool)
{
    if (!pool)
        return;
    decode_pool_stop(pool);
    child_stop(&pool->spare, 0, NULL, 0);
    pthread_cond_destroy(&pool->has_work);
    pthread_mutex_destroy(&pool->mutex);
    free(pool);
}

bool decode_pool_submit(struct decode_pool *pool, const struct decode_job_desc *desc,
                        struct error *err)
{
    struct decode_job *job = calloc(1, sizeof *job);
    if (!job)
        return error_set(err, ERROR_NO_MEMORY, "decode job");
    if (desc->id)
        memcpy(job->id, desc->id, sizeof job->id);
    if (desc->request_id)
        snprintf(job->request_id, sizeof job->request_id, "%s", desc->request_id);
    job->submitted_ms = now_ms();
    job->fill = desc->fill;
    job->upload = desc->upload;
    job->context = desc->context;
    job->done = desc->done;
    pthread_mutex_lock(&pool->mutex);
    bool is_stopping = pool->is_stopping, is_good = !is_stopping && pool->count < DECODE_QUEUE_MAX;
    if (is_good) {
        *pool->last = job;
        pool->last = &job->next;
        pool->count++;
        pthread_cond_signal(&pool->has_work);
    }
    pthread_mutex_unlock(&pool->mutex);
    if (is_good)
        return true;
    free(job);
    if (is_stopping)
        return error_set(err, ERROR_OVERLOADED, "the server is stopping");
    return error_set(err, ERROR_OVERLOADED,
                     "%d uploads are waiting to be decoded, which is the limit", DECODE_QUEUE_MAX);
}

bool decode_pool_find(struct decode_pool *pool, const char *request_id,
                      struct decode_status *status)
{
    const struct decode_job *found = NULL;
    pthread_mutex_lock(&pool->mutex);
    for (int is_running = 0; is_running < 2; is_running++)
        for (const struct decode_job *job = is_running ? pool->running : pool->first; job;
             job = job->next)
            if (strcmp(job->request_id, request_id) == 0 &&
                (!found || job->submitted_ms > found->submitted_ms))
                found = job;
    if (found) {
        *status = found->status;
        status->elapsed_s = (double)(now_ms() - found->submitted_ms) * 1e-3;
    }
    pthread_mutex_unlock(&pool->mutex);
    return found != NULL;
}

struct decode_totals decode_pool_get_totals(struct decode_pool *pool)
{
    return (struct decode_totals){atomic_load(&pool->decoded), atomic_load(&pool->refused),
                                  atomic_load(&pool->crashes), atomic_load(&pool->timeouts)};
}
