/* SPDX-License-Identifier: MIT */
/* A learner over settings, and a ring of techniques whose programs stand. */
#include "server/experience.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "renderer/plan/content_key.h"
#include "renderer/plan/learning.h"

enum { STANDING_MAX = 256, LESSONS_LEAST = 2 };

/* llvmpipe compiles 0.1 to 0.5 s for the first frame of a technique that it has kept on disk, 0.3
 * to 1.3 s for one that it has not; the most counts until one was seen. */
static const double COMPILE_FIRST_MS = 1000, COMPILE_LEAST_MS = 1, COMPILE_MOST_MS = 20000;
static const double COMPILE_STEP = 0.7; /* of the logarithm: one frame at most doubles it */
static const double MISS = 1.5;
/* Modelled times are told so many standard deviations above the mean: four of five keep them. */
static const double CAREFUL = 0.84;

struct experience {
    pthread_mutex_t mutex;
    struct learning learned;
    double compile_ms;
    uint64_t standing[STANDING_MAX]; /* 0: no entry */
    size_t next;
};

struct experience *experience_create(struct error *err)
{
    struct experience *experience = calloc(1, sizeof *experience);
    if (!experience) {
        error_set(err, ERROR_NO_MEMORY, "forecasts");
        return NULL;
    }
    pthread_mutex_init(&experience->mutex, NULL);
    learning_init(&experience->learned);
    experience->compile_ms = COMPILE_FIRST_MS;
    return experience;
}

void experience_destroy(struct experience *experience)
{
    if (experience)
        pthread_mutex_destroy(&experience->mutex);
    free(experience);
}

void experience_forget_programs(struct experience *experience)
{
    pthread_mutex_lock(&experience->mutex);
    for (size_t i = 0; i < STANDING_MAX; i++)
        experience->standing[i] = 0;
    pthread_mutex_unlock(&experience->mutex);
}

/* ---- programs; under the mutex ---- */

/* Techniques whose programs differ, and samples that do. */
static uint64_t program_key(const struct experience_frame *frame)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, frame->scene);
    /* deep lists are made where a caster is transparent alone */
    bool has_maps = frame->setting.shadows == VIEW_SHADOWS_MAP;
    content_key_add_word(&key, has_maps ? VIEW_SHADOWS_DEEP : (uint64_t)frame->setting.shadows);
    content_key_add_word(&key, frame->setting.samples > 1);
    content_key_add_word(&key, frame->setting.shadow_compression > 0);
    return key.words[0] | 1;
}

static bool stands(const struct experience *experience, const struct experience_frame *frame)
{
    uint64_t key = program_key(frame);
    bool is_found = frame->setting.shadows == VIEW_SHADOWS_RAYTRACED; /* it has none */
    for (size_t i = 0; i < STANDING_MAX && !is_found; i++)
        is_found = experience->standing[i] == key;
    return is_found;
}

static void note_standing(struct experience *experience, const struct experience_frame *frame)
{
    if (stands(experience, frame))
        return;
    experience->standing[experience->next] = program_key(frame);
    experience->next = (experience->next + 1) % STANDING_MAX;
}

/* ---- times; under the mutex ---- */

static struct learning_case case_of(const struct experience_frame *frame)
{
    const struct choice_setting *setting = &frame->setting;
    struct content_key key = content_key_begin();
    content_key_add_text(&key, frame->scene);
    content_key_add_word(&key, (uint64_t)setting->shadows);
    content_key_add_word(&key, (uint64_t)setting->shadow_resolution);
    content_key_add_word(&key, (uint64_t)setting->shadow_taps);
    content_key_add_word(&key, (uint64_t)setting->samples);
    content_key_add_word(&key, setting->shadow_compression > 0);
    content_key_add_word(&key, (uint64_t)setting->shadow_prefilter);
    content_key_add_word(&key, frame->is_warm);
    content_key_add_word(&key, frame->is_measured);
    struct learning_case made = {.view = key.words[0] | 1};
    made.technique = setting->shadows == VIEW_SHADOWS_RAYTRACED           ? FORECAST_RAYS
                     : setting->shadows == VIEW_SHADOWS_RAYTRACED_SHADOWS ? FORECAST_TRACED_SHADOWS
                                                                          : FORECAST_MAPS;
    /* All of its work as one kind: measured and modelled times are off by other factors. */
    made.terms[frame->is_measured ? FORECAST_TERM_FRAME : FORECAST_TERM_PIXELS] = frame->base_ms;
    return made;
}

double experience_expect(struct experience *experience, const struct experience_frame *frame)
{
    const struct learning_case one = case_of(frame);
    pthread_mutex_lock(&experience->mutex);
    const struct learning_answer answer = learning_expect(&experience->learned, &one);
    double compile_ms = stands(experience, frame) ? 0 : experience->compile_ms;
    pthread_mutex_unlock(&experience->mutex);
    if (!(answer.ms > 0))
        return frame->base_ms;
    if (!frame->is_measured)
        return answer.ms * exp(CAREFUL * answer.doubt) + compile_ms;
    bool is_worse = answer.lessons >= LESSONS_LEAST && answer.ms > MISS * frame->base_ms;
    return is_worse ? answer.ms : frame->base_ms;
}

static void note_compiling(struct experience *experience, double ms)
{
    double step = log(fmax(ms, COMPILE_LEAST_MS) / experience->compile_ms);
    double grown = experience->compile_ms * exp(fmin(fmax(step, -COMPILE_STEP), COMPILE_STEP));
    experience->compile_ms = fmin(fmax(grown, COMPILE_LEAST_MS), COMPILE_MOST_MS);
}

void experience_note(struct experience *experience, const struct experience_frame *frame,
                     double took_ms, bool has_compiled)
{
    const struct learning_case one = case_of(frame);
    pthread_mutex_lock(&experience->mutex);
    bool was_promised = frame->base_ms > 0 && took_ms > 0;
    if (was_promised && has_compiled)
        note_compiling(experience, took_ms - learning_expect(&experience->learned, &one).ms);
    else if (was_promised)
        learning_teach(&experience->learned, &one, took_ms);
    note_standing(experience, frame);
    pthread_mutex_unlock(&experience->mutex);
}

void experience_note_warm(struct experience *experience, const char *scene)
{
    static const enum view_shadows techniques[] = {VIEW_SHADOWS_DEEP,
                                                   VIEW_SHADOWS_RAYTRACED_SHADOWS};
    pthread_mutex_lock(&experience->mutex);
    for (int i = 0; i < 4; i++)
        note_standing(experience,
                      &(struct experience_frame){
                          .scene = scene,
                          .setting = {.shadows = techniques[i / 2], .samples = i % 2 ? 4 : 1}});
    pthread_mutex_unlock(&experience->mutex);
}

double experience_compile_ms(struct experience *experience)
{
    pthread_mutex_lock(&experience->mutex);
    double ms = experience->compile_ms;
    pthread_mutex_unlock(&experience->mutex);
    return ms;
}
