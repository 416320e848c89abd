/* SPDX-License-Identifier: MIT */
/* Holds what was learned so far, and the copy of it that choices go by. */
#include "renderer/frame/frame_lessons.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/content_key.h"
#include "renderer/base/wall_clock.h"
#include "renderer/frame/calibrate.h"

/* Lessons before anything is published anew: tags of images change with it. */
enum { LESSONS_LEAST = 3 };
/* Expectations that moved by a third are published, though the choice stays. */
static const double DRIFT = 0.3;

struct frame_lessons {
    struct learning live, published;
    uint64_t print;
    int since; /* lessons since it was published */
    bool is_due;
};

struct frame_lessons *frame_lessons_create(void)
{
    struct frame_lessons *lessons = malloc(sizeof *lessons);
    if (lessons)
        frame_lessons_set(lessons, NULL);
    return lessons;
}

void frame_lessons_destroy(struct frame_lessons *lessons)
{
    free(lessons);
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

const struct learning *frame_lessons_published(const struct frame_lessons *lessons)
{
    return &lessons->published;
}

const struct learning *frame_lessons_live(const struct frame_lessons *lessons)
{
    return &lessons->live;
}

uint64_t frame_lessons_print(const struct frame_lessons *lessons)
{
    return lessons->print;
}

static void publish(struct frame_lessons *lessons)
{
    lessons->published = lessons->live;
    lessons->print = print_of(&lessons->published);
    lessons->since = 0;
    lessons->is_due = false;
}

void frame_lessons_publish(struct frame_lessons *lessons)
{
    if (lessons->is_due)
        publish(lessons);
}

void frame_lessons_set(struct frame_lessons *lessons, const struct learning *learned)
{
    if (learned)
        lessons->live = *learned;
    else
        learning_init(&lessons->live);
    publish(lessons);
}

/* ---- frames ---- */

static double processor_now_ms(void)
{
    return clock_now_ms(CLOCK_PROCESS_CPUTIME_ID);
}

struct frame_lesson frame_lesson_begin(void)
{
    return (struct frame_lesson){.processor_begin_ms = processor_now_ms()};
}

void frame_lesson_of_choice(struct frame_lesson *lesson, const struct auto_choice *choice)
{
    lesson->is_open = choice->is_open && choice->ms[choice->technique] > 0;
    lesson->is_timed = choice->is_timed;
    lesson->technique = choice->technique;
    memcpy(lesson->cold, choice->cold, sizeof lesson->cold);
    memcpy(lesson->frames, choice->frames, sizeof lesson->frames);
}

static bool teaches(const struct frame_lesson *lesson, const struct frame_report *report)
{
    return lesson->is_open && report->paused_ms <= 0 && !report->has_cut_lists &&
           !report->counts.programs_built && !report->counts.programs_loaded &&
           !report->textures.written_bytes && !report->counts.gbuffers_reused &&
           !report->counts.pixel_lists_reused;
}

/* The share of the technique's structures that the frame had to build. */
static double built_share(const struct frame_lesson *lesson, const struct frame_report *report)
{
    double built = (double)report->counts.shadow_maps_built;
    double all = built + (double)report->counts.shadow_maps_reused;
    if (shadow_technique_family(lesson->technique) == SHADOW_FAMILY_MAPS)
        return all > 0 ? built / all : 0;
    for (int i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].pass, "raytrace.build") == 0)
            return 1;
    return 0;
}

/* Whether choices would differ, of this view or, by a drift of expectations, of others. */
static bool matters(const struct frame_lessons *lessons, const struct frame_lesson *lesson)
{
    const struct auto_pick old = auto_pick(lesson->frames, &lessons->published);
    const struct auto_pick new = auto_pick(lesson->frames, &lessons->live);
    double ratio = new.answers[lesson->technique].ms / old.answers[lesson->technique].ms;
    return new.technique != old.technique || (!lesson->is_timed && fabs(log(ratio)) > DRIFT);
}

void frame_lessons_take(struct frame_lessons *lessons, const struct frame_lesson *lesson,
                        const struct frame_report *report, bool is_software)
{
    if (!teaches(lesson, report))
        return;
    bool is_ours = is_software || shadow_technique_is_renderer(lesson->technique);
    double processor_ms = processor_now_ms() - lesson->processor_begin_ms;
    const struct learning_case frame =
        auto_case(&lesson->cold[lesson->technique], built_share(lesson, report));
    learning_teach(&lessons->live, &frame,
                   calibrate_alone_ms(report->total_ms, processor_ms, is_ours));
    if (!lesson->is_timed)
        learning_show(&lessons->live, &frame);
    lessons->since++;
    lessons->is_due =
        lessons->is_due || (lessons->since >= LESSONS_LEAST && matters(lessons, lesson));
}
