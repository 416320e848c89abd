/* SPDX-License-Identifier: MIT */
/* A queue of frames, and threads that encode them. Who sends requests bounds its length. */
#include "server/worker/encoder.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "protocol/provenance.h"
#include "server/base/clock.h"
#include "server/worker/frame_image.h"

enum { THREADS_MAX = 8, LIBRARY_NICE = 10 };

struct encoder {
    struct encoder_desc desc;
    pthread_mutex_t mutex;
    pthread_cond_t has_work;
    struct encode_task *first, **last;
    bool is_stopping;
    pthread_t threads[THREADS_MAX];
    int thread_count;
    pthread_t library_thread; /* loads that of formats which need one, before someone asks */
    bool has_library_thread;
};

void encode_task_destroy(struct encode_task *task)
{
    if (!task)
        return;
    frame_finish(&task->frame);
    render_request_finish(&task->request);
    json_decref(task->asked_quality);
    free(task->bytes);
    free(task);
}

/* How the image was made, for its file; *text is NULL where the request wants none. */
static bool make_provenance(const struct encode_task *task, char **text, struct error *err)
{
    *text = NULL;
    if (task->request.omits_provenance)
        return true;
    *text = provenance_make(&(struct provenance_desc){.request = &task->request,
                                                      .asked_quality = task->asked_quality,
                                                      .stats = &task->stats,
                                                      .version = VITRAIL_VERSION});
    return *text || error_set(err, ERROR_NO_MEMORY, "provenance");
}

static const char description[] = "Rendered by Vitrail " VITRAIL_VERSION;

static bool encode(struct encode_task *task, struct error *err)
{
    struct image image = {0};
    char *provenance = NULL;
    double began = now_fine_ms();
    bool is_good = make_provenance(task, &provenance, err);
    if (is_good && task->request.format == REQUEST_FORMAT_EXR_DEEP)
        is_good = deep_image_encode(
            &task->frame.deep,
            &(struct deep_encode_desc){.description = description, .provenance = provenance},
            &task->bytes, &task->size_bytes, err);
    else if (is_good)
        is_good = frame_image_init(&image, &task->frame, &task->request, task->format, err) &&
                  image_encode(&image,
                               &(struct image_encode_desc){.format = task->format,
                                                           .quality = task->request.quality_percent,
                                                           .description = description,
                                                           .provenance = provenance},
                               &task->bytes, &task->size_bytes, err);
    image_finish(&image);
    free(provenance);
    task->stats.timings_ms[FRAME_TIMING_ENCODE] = now_fine_ms() - began;
    return is_good;
}

/* NULL at the end. */
static struct encode_task *take_task(struct encoder *encoder)
{
    pthread_mutex_lock(&encoder->mutex);
    while (!encoder->first && !encoder->is_stopping)
        pthread_cond_wait(&encoder->has_work, &encoder->mutex);
    struct encode_task *task = encoder->first;
    if (task) {
        encoder->first = task->next;
        if (!encoder->first)
            encoder->last = &encoder->first;
    }
    pthread_mutex_unlock(&encoder->mutex);
    return task;
}

static void *encoder_run(void *argument)
{
    struct encoder *encoder = argument;
    for (struct encode_task *task; (task = take_task(encoder));) {
        struct error problem = {0};
        if (!encode(task, &problem))
            error_wrap(&problem, "encoding");
        encoder->desc.done(encoder->desc.context, task, &problem);
        encode_task_destroy(task);
    }
    return NULL;
}

/* Beside work that someone waits for. */
static void *library_run(void *unused)
{
    (void)unused;
    setpriority(PRIO_PROCESS, 0, LIBRARY_NICE); /* of this thread, on Linux */
    image_warm_up();
    return NULL;
}

struct encoder *encoder_create(const struct encoder_desc *desc, struct error *err)
{
    struct encoder *encoder = calloc(1, sizeof *encoder);
    if (!encoder) {
        error_set(err, ERROR_NO_MEMORY, "encoder");
        return NULL;
    }
    encoder->desc = *desc;
    encoder->last = &encoder->first;
    pthread_mutex_init(&encoder->mutex, NULL);
    pthread_cond_init(&encoder->has_work, NULL);
    int wanted = desc->thread_count < THREADS_MAX ? desc->thread_count : THREADS_MAX;
    while (encoder->thread_count < wanted &&
           pthread_create(&encoder->threads[encoder->thread_count], NULL, encoder_run, encoder) ==
               0)
        encoder->thread_count++;
    if (encoder->thread_count > 0)
        return encoder;
    error_set(err, ERROR_INTERNAL, "encoder: no thread can be started");
    encoder_destroy(encoder);
    return NULL;
}

void encoder_destroy(struct encoder *encoder)
{
    if (!encoder)
        return;
    pthread_mutex_lock(&encoder->mutex);
    encoder->is_stopping = true;
    pthread_cond_broadcast(&encoder->has_work);
    pthread_mutex_unlock(&encoder->mutex);
    for (int i = 0; i < encoder->thread_count; i++)
        pthread_join(encoder->threads[i], NULL);
    if (encoder->has_library_thread)
        pthread_join(encoder->library_thread, NULL);
    pthread_cond_destroy(&encoder->has_work);
    pthread_mutex_destroy(&encoder->mutex);
    free(encoder);
}

void encoder_submit(struct encoder *encoder, struct encode_task *task)
{
    task->next = NULL;
    pthread_mutex_lock(&encoder->mutex);
    *encoder->last = task;
    encoder->last = &task->next;
    pthread_cond_signal(&encoder->has_work);
    pthread_mutex_unlock(&encoder->mutex);
}

void encoder_warm_up(struct encoder *encoder)
{
    if (!encoder->has_library_thread)
        encoder->has_library_thread =
            pthread_create(&encoder->library_thread, NULL, library_run, NULL) == 0;
}
