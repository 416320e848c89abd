/* SPDX-License-Identifier: MIT */
/* A pass runs inside a scope: debug group, timing and report line under one name. Thread: GL. Where
 * the device is our own processors, a scope is fenced with glFinish and timed by the wall clock; on
 * a device whose timestamps are not to be believed its time is NAN, and nothing is waited for. */
#ifndef VITRAIL_RENDERER_GL_SCOPE_H
#define VITRAIL_RENDERER_GL_SCOPE_H

#include "protocol/error.h"
#include "renderer/frame_report.h"
#include "renderer/gl/context.h"

struct gpu_timeline;

struct gpu_timeline *gpu_timeline_create(const struct gl_context *context, struct error *err);
void gpu_timeline_destroy(struct gpu_timeline *timeline);

/* Whoever has asked the device for something before the passes to come takes it when a wait is
 * about to begin, because the wait would end later. It takes that and does no more: it begins no
 * scope and leaves bindings as they are. Scopes themselves call nobody. */
struct gpu_wait_callback {
    void *context;
    void (*before_wait)(void *context);
};
void gpu_timeline_set_wait_callback(struct gpu_timeline *timeline,
                                    const struct gpu_wait_callback *callback);

/* To be called before anything of the passes so far is read or waited for: calls the callback. */
void gpu_timeline_will_wait(struct gpu_timeline *timeline);

struct gpu_scope_desc {
    const char *pass;      /* required: "shadow.deep" */
    const char *because;   /* required: the requirement, copied */
    const char *technique; /* optional */
    enum report_stage stage;
};

/* Scopes of one frame do not nest. */
void gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc);
void gpu_scope_end(struct gpu_timeline *timeline);

/* Resolves all scopes since the last call into report lines; waits for the GPU. Scopes with the
 * same pass, reason and technique (one per light, say) are merged into one line. */
void gpu_timeline_collect(struct gpu_timeline *timeline, struct frame_report *report);

/* Keeps all scopes since the last call for later, beside those of another frame: one set at most.
 * The other resolves them, as above. */
void gpu_timeline_put_aside(struct gpu_timeline *timeline);
void gpu_timeline_collect_aside(struct gpu_timeline *timeline, struct frame_report *report);

#endif
