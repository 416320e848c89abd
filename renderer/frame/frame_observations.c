/* SPDX-License-Identifier: MIT */
/* Holds what was learned so far, and the copy of it that choices go by. */
#include "renderer/frame/frame_observations.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/content_key.h"
#include "renderer/base/wall_clock.h"
#include "renderer/frame/calibrate.h"

/* Observations before anything is published anew: tags of images change with it. */
enum { OBSERVATIONS_LEAST = 3, LESSONS_KEPT = 16 };
/* Expectations that moved by a third are published, though the choice stays. */
static const double DRIFT = 0.3;

struct frame_observations {
    struct learning live, published;
    uint64_t print;
    bool learns_nothing;
    int since; /* observations since it was published */
    bool is_due;
    struct frame_lesson lessons[LESSONS_KEPT]; /* of one that learns nothing: the oldest first */
    int lesson_count;
};

struct frame_observations *frame_observations_create(bool learns_nothing)
{
    struct frame_observations *observations = calloc(1, sizeof *observations);
    if (observations)
        frame_observations_set(observations, NULL);
    if (observations)
        observations->learns_nothing = learns_nothing;
    return observations;
}

void frame_observations_destroy(struct frame_observations *observations)
{
    free(observations);
}

static uint64_t print_of(const struct learning *learned)
{
    struct content_key key = content_key_begin();
    content_key_add(&key, learned->factor, sizeof learned->factor);
    for (int i = 0; i < LEARNING_VIEWS_MAX; i++) {
        uint64_t off;
        memcpy(&off, &learned->views[i].off, sizeof off);
        content_key_add_word(&key, learned->views[i].key);
        content_key_add_word(&key, off);
        content_key_add_word(&key, learned->views[i].is_shown);
    }
    return learned->clock ? key.words[0] | 1 : 0;
}

const struct learning *frame_observations_published(const struct frame_observations *observations)
{
    return &observations->published;
}

const struct learning *frame_observations_live(const struct frame_observations *observations)
{
    return &observations->live;
}

uint64_t frame_observations_print(const struct frame_observations *observations)
{
    return observations->print;
}

static void publish(struct frame_observations *observations)
{
    observations->published = observations->live;
    observations->print = print_of(&observations->published);
    observations->since = 0;
    observations->is_due = false;
}

void frame_observations_publish(struct frame_observations *observations)
{
    if (observations->is_due)
        publish(observations);
}

void frame_observations_set(struct frame_observations *observations, const struct learning *learned)
{
    if (learned)
        observations->live = *learned;
    else
        learning_init(&observations->live);
    publish(observations);
}

/* ---- frames ---- */

static double processor_now_ms(void)
{
    return clock_now_ms(CLOCK_PROCESS_CPUTIME_ID);
}

struct frame_observation frame_observation_begin(void)
{
    return (struct frame_observation){.processor_begin_ms = processor_now_ms()};
}

void frame_observation_of_choice(struct frame_observation *observation,
                                 const struct auto_choice *choice)
{
    observation->is_open = choice->is_open && choice->ms[choice->technique] > 0;
    observation->is_timed = choice->is_timed;
    observation->technique = choice->technique;
    memcpy(observation->cold, choice->cold, sizeof observation->cold);
    memcpy(observation->frames, choice->frames, sizeof observation->frames);
}

static bool teaches(const struct frame_observation *observation, const struct frame_report *report)
{
    return observation->is_open && report->paused_ms <= 0 && !report->has_cut_lists &&
           !report->counts.programs_built && !report->counts.programs_loaded &&
           !report->textures.written_bytes && !report->counts.gbuffers_reused &&
           !report->counts.pixel_lists_reused;
}

/* The share of the technique's structures that the frame had to build. */
static double built_share(const struct frame_observation *observation,
                          const struct frame_report *report)
{
    double built = (double)report->counts.shadow_maps_built;
    double all = built + (double)report->counts.shadow_maps_reused;
    if (shadow_technique_family(observation->technique) == SHADOW_FAMILY_MAPS)
        return all > 0 ? built / all : 0;
    for (int i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].pass, "raytrace.build") == 0)
            return 1;
    return 0;
}

/* Whether choices would differ, of this view or, by a drift of expectations, of others. */
static bool matters(const struct frame_observations *observations,
                    const struct frame_lesson *lesson)
{
    enum shadow_technique own = lesson->frame.technique;
    const struct auto_pick old = auto_pick(lesson->frames, &observations->published);
    const struct auto_pick new = auto_pick(lesson->frames, &observations->live);
    double ratio = new.answers[own].ms / old.answers[own].ms;
    return new.technique != old.technique || (!lesson->is_timed && fabs(log(ratio)) > DRIFT);
}

void frame_observations_learn(struct frame_observations *observations,
                              const struct frame_lesson *lesson)
{
    learning_teach(&observations->live, &lesson->frame, lesson->alone_ms);
    if (!lesson->is_timed)
        learning_show(&observations->live, &lesson->frame);
    observations->since++;
    observations->is_due = observations->is_due || (observations->since >= OBSERVATIONS_LEAST &&
                                                    matters(observations, lesson));
}

static void drop_oldest(struct frame_observations *observations)
{
    observations->lesson_count--;
    memmove(&observations->lessons[0], &observations->lessons[1],
            (size_t)observations->lesson_count * sizeof observations->lessons[0]);
}

static void keep(struct frame_observations *observations, const struct frame_lesson *lesson)
{
    if (observations->lesson_count == LESSONS_KEPT)
        drop_oldest(observations);
    observations->lessons[observations->lesson_count++] = *lesson;
}

bool frame_observations_pop(struct frame_observations *observations, struct frame_lesson *lesson)
{
    if (observations->lesson_count == 0)
        return false;
    *lesson = observations->lessons[0];
    drop_oldest(observations);
    return true;
}

void frame_observations_take(struct frame_observations *observations,
                             const struct frame_observation *observation,
                             const struct frame_report *report, bool is_software)
{
    if (!teaches(observation, report))
        return;
    bool is_ours = is_software || shadow_technique_is_renderer(observation->technique);
    double processor_ms = processor_now_ms() - observation->processor_begin_ms;
    struct frame_lesson lesson = {
        .is_timed = observation->is_timed,
        .alone_ms = calibrate_alone_ms(report->total_ms, processor_ms, is_ours),
        .frame =
            auto_case(&observation->cold[observation->technique], built_share(observation, report)),
    };
    memcpy(lesson.frames, observation->frames, sizeof lesson.frames);
    if (observations->learns_nothing)
        keep(observations, &lesson);
    else
        frame_observations_learn(observations, &lesson);
}
