/* SPDX-License-Identifier: MIT */
/* Pass timing: GPU timestamps where they are honest, fenced wall clock elsewhere. */
#include "renderer/gl/scope.h"
#include "renderer/wall_clock.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SCOPES_MAX = 1024
}; /* one per light and pass of a large frame; what exceeds it is summed into the last */

struct scope_record {
    struct report_pass line;
    enum report_stage stage;
    double begin_ms, end_ms;
};

struct gpu_timeline {
    const struct gl_limits *limits;
    struct scope_record records[SCOPES_MAX];
    GLuint queries[2 * SCOPES_MAX];
    int count;
    bool is_open;
};

struct gpu_timeline *gpu_timeline_create(const struct gl_context *context, struct error *err)
{
    struct gpu_timeline *timeline = calloc(1, sizeof *timeline);
    if (!timeline) {
        error_set(err, ERROR_NO_MEMORY, "GPU timeline");
        return NULL;
    }
    timeline->limits = gl_context_limits(context);
    glCreateQueries(GL_TIMESTAMP, 2 * SCOPES_MAX, timeline->queries);
    return timeline;
}

void gpu_timeline_destroy(struct gpu_timeline *timeline)
{
    if (!timeline)
        return;
    glDeleteQueries(2 * SCOPES_MAX, timeline->queries);
    free(timeline);
}

void gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc)
{
    assert(!timeline->is_open && desc->pass && desc->because);
    timeline->is_open = true;
    glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, desc->pass);
    if (timeline->count == SCOPES_MAX)
        return;
    struct scope_record *record = &timeline->records[timeline->count];
    memset(record, 0, sizeof *record);
    snprintf(record->line.pass, sizeof record->line.pass, "%s", desc->pass);
    snprintf(record->line.because, sizeof record->line.because, "%s", desc->because);
    snprintf(record->line.technique, sizeof record->line.technique, "%s",
             desc->technique ? desc->technique : "");
    record->stage = desc->stage;
    if (timeline->limits->has_true_timers) {
        glQueryCounter(timeline->queries[2 * timeline->count], GL_TIMESTAMP);
    } else {
        glFinish();
        record->begin_ms = wall_ms();
    }
}

/* Beyond SCOPES_MAX the last record's end moves on, so that no time is lost from the sum. */
void gpu_scope_end(struct gpu_timeline *timeline)
{
    assert(timeline->is_open);
    timeline->is_open = false;
    int index = timeline->count < SCOPES_MAX ? timeline->count++ : SCOPES_MAX - 1;
    if (timeline->limits->has_true_timers) {
        glQueryCounter(timeline->queries[2 * index + 1], GL_TIMESTAMP);
    } else {
        glFinish();
        timeline->records[index].end_ms = wall_ms();
    }
    glPopDebugGroup();
}

static double record_ms(const struct gpu_timeline *timeline, int index)
{
    if (!timeline->limits->has_true_timers)
        return timeline->records[index].end_ms - timeline->records[index].begin_ms;
    GLuint64 begin = 0, end = 0;
    glGetQueryObjectui64v(timeline->queries[2 * index], GL_QUERY_RESULT, &begin);
    glGetQueryObjectui64v(timeline->queries[2 * index + 1], GL_QUERY_RESULT, &end);
    return end > begin ? (double)(end - begin) * 1e-6 : 0;
}

void gpu_timeline_collect(struct gpu_timeline *timeline, struct frame_report *report)
{
    if (timeline->is_open) /* a pass failed halfway: close it, its time is meaningless */
        gpu_scope_end(timeline);
    for (int i = 0; i < timeline->count; i++) {
        const struct scope_record *record = &timeline->records[i];
        report_add_pass(report, record->line.pass, record->line.because, record->line.technique,
                        record_ms(timeline, i), record->stage);
    }
    timeline->count = 0;
}
