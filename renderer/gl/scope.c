/* SPDX-License-Identifier: MIT */
/* Pass timing: GPU timestamps where they are honest, fenced wall clock where the device is our own
 * processors, no times elsewhere. */
#include "renderer/base/wall_clock.h"
#include "renderer/gl/scope.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SCOPES_MAX = 1024
}; /* one per light and pass of a large frame; what exceeds it is summed into the last */

enum clock_kind {
    CLOCK_STAMPS,
    CLOCK_FENCED,
    CLOCK_NONE, /* the device is waited for only where its results are needed */
};

struct scope_record {
    struct report_pass line;
    enum report_stage stage;
    double begin_ms, end_ms;
};

/* Of one frame. */
struct scope_set {
    struct scope_record records[SCOPES_MAX];
    GLuint queries[2 * SCOPES_MAX];
    int count;
};

struct gpu_timeline {
    enum clock_kind clock;
    struct scope_set sets[2];
    struct scope_set *now, *aside; /* each one of them */
    struct gpu_wait_callback callback;
    bool is_open;
};

static enum clock_kind choose_clock(const struct gl_limits *limits)
{
    if (limits->has_true_timers)
        return CLOCK_STAMPS;
    return limits->is_software ? CLOCK_FENCED : CLOCK_NONE;
}

struct gpu_timeline *gpu_timeline_create(const struct gl_context *context, struct error *err)
{
    struct gpu_timeline *timeline = calloc(1, sizeof *timeline);
    if (!timeline) {
        error_set(err, ERROR_NO_MEMORY, "GPU timeline");
        return NULL;
    }
    timeline->clock = choose_clock(gl_context_limits(context));
    timeline->now = &timeline->sets[0];
    timeline->aside = &timeline->sets[1];
    for (int i = 0; i < 2; i++)
        glCreateQueries(GL_TIMESTAMP, 2 * SCOPES_MAX, timeline->sets[i].queries);
    return timeline;
}

void gpu_timeline_destroy(struct gpu_timeline *timeline)
{
    if (!timeline)
        return;
    for (int i = 0; i < 2; i++)
        glDeleteQueries(2 * SCOPES_MAX, timeline->sets[i].queries);
    free(timeline);
}

void gpu_timeline_set_wait_callback(struct gpu_timeline *timeline,
                                    const struct gpu_wait_callback *callback)
{
    timeline->callback = *callback;
}

void gpu_timeline_will_wait(struct gpu_timeline *timeline)
{
    if (timeline->callback.before_wait)
        timeline->callback.before_wait(timeline->callback.context);
}

static double fenced_ms(void)
{
    glFinish();
    return wall_ms();
}

void gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc)
{
    struct scope_set *set = timeline->now;
    assert(!timeline->is_open && desc->pass && desc->because);
    timeline->is_open = true;
    glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, desc->pass);
    if (set->count == SCOPES_MAX)
        return;
    struct scope_record *record = &set->records[set->count];
    memset(record, 0, sizeof *record);
    snprintf(record->line.pass, sizeof record->line.pass, "%s", desc->pass);
    snprintf(record->line.because, sizeof record->line.because, "%s", desc->because);
    snprintf(record->line.technique, sizeof record->line.technique, "%s",
             desc->technique ? desc->technique : "");
    record->stage = desc->stage;
    if (timeline->clock == CLOCK_STAMPS)
        glQueryCounter(set->queries[2 * set->count], GL_TIMESTAMP);
    else if (timeline->clock == CLOCK_FENCED)
        record->begin_ms = fenced_ms();
}

/* Beyond SCOPES_MAX the last record's end moves on, so that no time is lost from the sum. */
void gpu_scope_end(struct gpu_timeline *timeline)
{
    struct scope_set *set = timeline->now;
    assert(timeline->is_open);
    timeline->is_open = false;
    int index = set->count < SCOPES_MAX ? set->count++ : SCOPES_MAX - 1;
    if (timeline->clock == CLOCK_STAMPS)
        glQueryCounter(set->queries[2 * index + 1], GL_TIMESTAMP);
    else if (timeline->clock == CLOCK_FENCED)
        set->records[index].end_ms = fenced_ms();
    glPopDebugGroup();
}

static double record_ms(const struct gpu_timeline *timeline, const struct scope_set *set, int index)
{
    if (timeline->clock == CLOCK_NONE)
        return NAN;
    if (timeline->clock == CLOCK_FENCED)
        return set->records[index].end_ms - set->records[index].begin_ms;
    GLuint64 begin = 0, end = 0;
    glGetQueryObjectui64v(set->queries[2 * index], GL_QUERY_RESULT, &begin);
    glGetQueryObjectui64v(set->queries[2 * index + 1], GL_QUERY_RESULT, &end);
    return end > begin ? (double)(end - begin) * 1e-6 : 0;
}

static void collect(const struct gpu_timeline *timeline, struct scope_set *set,
                    struct frame_report *report)
{
    for (int i = 0; i < set->count; i++) {
        const struct scope_record *record = &set->records[i];
        report_add_pass(report, record->line.pass, record->line.because, record->line.technique,
                        record_ms(timeline, set, i), record->stage);
    }
    set->count = 0;
}

/* A pass failed halfway: its time is meaningless. */
static void close_scope(struct gpu_timeline *timeline)
{
    if (timeline->is_open)
        gpu_scope_end(timeline);
}

void gpu_timeline_collect(struct gpu_timeline *timeline, struct frame_report *report)
{
    close_scope(timeline);
    collect(timeline, timeline->now, report);
}

void gpu_timeline_put_aside(struct gpu_timeline *timeline)
{
    struct scope_set *kept = timeline->now;
    close_scope(timeline);
    assert(timeline->aside->count == 0);
    timeline->now = timeline->aside;
    timeline->aside = kept;
}

void gpu_timeline_collect_aside(struct gpu_timeline *timeline, struct frame_report *report)
{
    collect(timeline, timeline->aside, report);
}
