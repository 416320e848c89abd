/* SPDX-License-Identifier: MIT */
/* A learner over settings, and a ring of techniques whose programs stand. */
#include "server/worker/time_estimator.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/utf8.h"
#include "renderer/base/content_key.h"
#include "renderer/cost/learning.h"
#include "server/mapping/lesson_mapping.h"
#include "server/mapping/observations_file.h"

enum { STANDING_MAX = 256, OBSERVATIONS_LEAST = 2, PATH_BYTES = 4096, KEY_BYTES = 1024 };
enum { WRITE_OBSERVATIONS = 32 }; /* 40 KB each time */
enum { LESSONS_KEPT = 16 };       /* they are taken after each frame */

/* llvmpipe compiles 0.1 to 0.5 s for the first frame of a technique that it has kept on disk, 0.3
 * to 1.3 s for one that it has not, and the self-test of its shadows takes up to 0.8 s before; the
 * most counts until one was seen. */
static const double COMPILE_FIRST_MS = 2000, COMPILE_LEAST_MS = 1, COMPILE_MOST_MS = 20000;
static const double COMPILE_STEP = 0.7; /* of the logarithm: one frame at most doubles it */
static const double MISS = 1.5;
/* Memory that a frame is the first to have: llvmpipe's is the processor's, whose pages of 4 KiB
 * take about 1 us each when they are first written. Less than MEMORY_TELLS is lost in the rest. */
static const double MEMORY_FIRST = 0.25e-6, MEMORY_LEAST = 0.01e-6, MEMORY_MOST = 10e-6; /* ms */
static const double MEMORY_TELLS = 8e6;                                                  /* bytes */
/* Modelled times are promised so many standard deviations above the mean: four of five keep them.
 */
static const double CAREFUL = 0.84;

struct time_estimator {
    pthread_mutex_t mutex;
    struct learning learned;
    double compile_ms;
    double memory_ms;                /* of a byte that no frame had before */
    double held_bytes;               /* the most that one had since the worker started or rested */
    uint64_t standing[STANDING_MAX]; /* 0: no entry */
    size_t next;
    struct time_lesson lessons[LESSONS_KEPT]; /* not taken yet: the oldest first */
    size_t lesson_count;
    char path[PATH_BYTES], key[KEY_BYTES]; /* of the file; "": none */
    uint64_t written;                      /* observations in it */
};

struct time_estimator *time_estimator_create(struct error *err)
{
    struct time_estimator *estimator = calloc(1, sizeof *estimator);
    if (!estimator) {
        error_set(err, ERROR_NO_MEMORY, "forecasts");
        return NULL;
    }
    pthread_mutex_init(&estimator->mutex, NULL);
    learning_init(&estimator->learned);
    estimator->compile_ms = COMPILE_FIRST_MS;
    estimator->memory_ms = MEMORY_FIRST;
    return estimator;
}

/* Under the mutex, or at the end. */
static void write_observations(struct time_estimator *estimator)
{
    struct error unsaved = {0};
    if (!estimator->path[0] || estimator->learned.clock == estimator->written)
        return;
    estimator->written = estimator->learned.clock;
    (void)!observations_file_save(&estimator->learned, estimator->path, estimator->key, &unsaved);
}

void time_estimator_destroy(struct time_estimator *estimator)
{
    if (!estimator)
        return;
    write_observations(estimator);
    pthread_mutex_destroy(&estimator->mutex);
    free(estimator);
}

void time_estimator_keep(struct time_estimator *estimator, const char *path, const char *key)
{
    struct learning *earlier = malloc(sizeof *earlier);
    pthread_mutex_lock(&estimator->mutex);
    if (earlier && !estimator->path[0]) {
        utf8_copy(estimator->path, sizeof estimator->path, path);
        utf8_copy(estimator->key, sizeof estimator->key, key);
        if (!estimator->learned.clock && observations_file_load(earlier, path, estimator->key))
            estimator->learned = *earlier;
        estimator->written = estimator->learned.clock;
    }
    pthread_mutex_unlock(&estimator->mutex);
    free(earlier);
}

void time_estimator_only_read(struct time_estimator *estimator)
{
    pthread_mutex_lock(&estimator->mutex);
    estimator->path[0] = '\0';
    pthread_mutex_unlock(&estimator->mutex);
}

void time_estimator_forget_memory(struct time_estimator *estimator)
{
    pthread_mutex_lock(&estimator->mutex);
    estimator->held_bytes = 0;
    pthread_mutex_unlock(&estimator->mutex);
}

/* ---- programs; under the mutex ---- */

/* Techniques whose programs differ, and samples that do: 1, 4, and several rounds of them. */
static uint64_t program_key(const struct time_estimator_frame *frame)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, frame->scene);
    content_key_add_word(&key, (uint64_t)choice_candidate_of(frame->setting.shadows));
    content_key_add_word(&key, (uint64_t)(frame->setting.samples > 1) +
                                   (uint64_t)(frame->setting.samples > 4));
    content_key_add_word(&key, frame->setting.shadow_compression > 0);
    content_key_add_word(&key, frame->is_hazy);
    return key.words[0] | 1;
}

static bool stands(const struct time_estimator *estimator, const struct time_estimator_frame *frame)
{
    uint64_t key = program_key(frame);
    bool is_found = shadow_technique_is_renderer(frame->setting.shadows); /* it has none */
    for (size_t i = 0; i < STANDING_MAX && !is_found; i++)
        is_found = estimator->standing[i] == key;
    return is_found;
}

static void note_standing(struct time_estimator *estimator,
                          const struct time_estimator_frame *frame)
{
    if (stands(estimator, frame))
        return;
    estimator->standing[estimator->next] = program_key(frame);
    estimator->next = (estimator->next + 1) % STANDING_MAX;
}

/* ---- times; under the mutex ---- */

static struct learning_case case_of(const struct time_estimator_frame *frame)
{
    const struct quality_setting *setting = &frame->setting;
    struct content_key key = content_key_begin();
    content_key_add_text(&key, frame->scene);
    content_key_add_word(&key, (uint64_t)setting->shadows);
    content_key_add_word(&key, (uint64_t)setting->shadow_resolution);
    content_key_add_word(&key, (uint64_t)setting->shadow_taps);
    content_key_add_word(&key, (uint64_t)setting->samples);
    content_key_add_word(&key, setting->shadow_compression > 0);
    content_key_add_word(&key, (uint64_t)setting->shadow_prefilter);
    content_key_add_word(&key, (uint64_t)setting->atmosphere_samples);
    content_key_add_word(&key, (uint64_t)setting->transparency);
    content_key_add_word(&key, frame->is_warm);
    content_key_add_word(&key, frame->is_measured);
    if (frame->is_hazy)
        content_key_add_text(&key, "haze");
    struct learning_case made = {.technique = setting->shadows, .view = key.words[0] | 1};
    /* All of its work as one kind: measured and modelled times are off by other factors. */
    made.terms[frame->is_measured ? FORECAST_TERM_FRAME : FORECAST_TERM_PIXELS] = frame->base_ms;
    return made;
}

/* Bytes that the frame is the first to have. */
static double fresh_bytes(const struct time_estimator *estimator,
                          const struct time_estimator_frame *frame)
{
    return fmax(frame->bytes - estimator->held_bytes, 0);
}

double time_estimator_expect(struct time_estimator *estimator,
                             const struct time_estimator_frame *frame)
{
    const struct learning_case one = case_of(frame);
    pthread_mutex_lock(&estimator->mutex);
    const struct learning_answer answer = learning_expect(&estimator->learned, &one);
    double compile_ms = stands(estimator, frame) ? 0 : estimator->compile_ms;
    compile_ms += estimator->memory_ms * fresh_bytes(estimator, frame);
    pthread_mutex_unlock(&estimator->mutex);
    if (!(answer.ms > 0))
        return frame->base_ms;
    if (!frame->is_measured)
        return answer.ms * exp(CAREFUL * answer.doubt) + compile_ms;
    bool is_worse = answer.observations >= OBSERVATIONS_LEAST && answer.ms > MISS * frame->base_ms;
    return is_worse ? answer.ms : frame->base_ms;
}

/* Towards a new value, by one step at most. */
static double follow(double value, double now, double least, double most)
{
    double step = log(fmax(now, least) / value);
    double moved = value * exp(fmin(fmax(step, -COMPILE_STEP), COMPILE_STEP));
    return fmin(fmax(moved, least), most);
}

static void note_compiling(struct time_estimator *estimator, double ms)
{
    estimator->compile_ms = follow(estimator->compile_ms, ms, COMPILE_LEAST_MS, COMPILE_MOST_MS);
}

/* Where the frame had much memory for the first time, what it took beyond the expectation went into
 * that; the rest of it teaches. */
static void note_time(struct time_estimator *estimator, const struct learning_case *one,
                      double bytes, double took_ms)
{
    const struct learning_answer answer = learning_expect(&estimator->learned, one);
    if (bytes >= MEMORY_TELLS && answer.observations)
        estimator->memory_ms =
            follow(estimator->memory_ms, (took_ms - answer.ms) / bytes, MEMORY_LEAST, MEMORY_MOST);
    learning_teach(&estimator->learned, one,
                   fmax(took_ms - estimator->memory_ms * bytes, took_ms / 2));
}

static void learn(struct time_estimator *estimator, const struct time_lesson *lesson)
{
    const struct learning_case *one = &lesson->frame;
    if (lesson->has_compiled)
        note_compiling(estimator, lesson->took_ms - learning_expect(&estimator->learned, one).ms);
    else
        note_time(estimator, one, lesson->fresh_bytes, lesson->took_ms);
    if (estimator->learned.clock >= estimator->written + WRITE_OBSERVATIONS)
        write_observations(estimator);
}

static void keep_lesson(struct time_estimator *estimator, const struct time_lesson *lesson)
{
    if (estimator->lesson_count == LESSONS_KEPT)
        memmove(&estimator->lessons[0], &estimator->lessons[1],
                --estimator->lesson_count * sizeof estimator->lessons[0]);
    estimator->lessons[estimator->lesson_count++] = *lesson;
}

void time_estimator_note(struct time_estimator *estimator, const struct time_estimator_frame *frame,
                         double took_ms, bool has_compiled)
{
    pthread_mutex_lock(&estimator->mutex);
    const struct time_lesson lesson = {.frame = case_of(frame),
                                       .took_ms = took_ms,
                                       .fresh_bytes = fresh_bytes(estimator, frame),
                                       .has_compiled = has_compiled};
    if (frame->base_ms > 0 && took_ms > 0) { /* it was promised */
        learn(estimator, &lesson);
        keep_lesson(estimator, &lesson);
    }
    estimator->held_bytes = fmax(estimator->held_bytes, frame->bytes);
    note_standing(estimator, frame);
    pthread_mutex_unlock(&estimator->mutex);
}

json_t *time_estimator_take_lessons(struct time_estimator *estimator)
{
    pthread_mutex_lock(&estimator->mutex);
    json_t *lessons = estimator->lesson_count ? json_array() : NULL;
    for (size_t i = 0; i < estimator->lesson_count; i++)
        json_array_append_new(lessons, time_lesson_to_json(&estimator->lessons[i]));
    estimator->lesson_count = 0;
    pthread_mutex_unlock(&estimator->mutex);
    return lessons;
}

void time_estimator_learn(struct time_estimator *estimator, const json_t *lessons)
{
    struct time_lesson lesson;
    const json_t *one;
    size_t index;
    pthread_mutex_lock(&estimator->mutex);
    json_array_foreach(lessons, index, one) if (time_lesson_from_json(one, &lesson))
        learn(estimator, &lesson);
    pthread_mutex_unlock(&estimator->mutex);
}

void time_estimator_note_warm(struct time_estimator *estimator, const char *scene)
{
    pthread_mutex_lock(&estimator->mutex);
    for (int i = 0; i < 2 * SHADOWS_COUNT; i++) {
        const struct time_estimator_frame frame = {
            .scene = scene,
            .setting = {.shadows = (enum shadow_technique)(i / 2), .samples = i % 2 ? 4 : 1}};
        if (shadow_technique_is_candidate(frame.setting.shadows))
            note_standing(estimator, &frame);
    }
    pthread_mutex_unlock(&estimator->mutex);
}
