/* SPDX-License-Identifier: MIT */
/* The progress of a frame, by the share of its stages that is finished. */
#ifndef VITRAIL_RENDERER_BASE_FRAME_PROGRESS_H
#define VITRAIL_RENDERER_BASE_FRAME_PROGRESS_H

enum frame_stage {
    FRAME_STAGE_SHADOWS, /* structures of lights; left out where lights come in batches */
    FRAME_STAGE_RAYS,    /* tiles or rows of a traced picture */
    FRAME_STAGE_SHADING, /* windows, batches and chunks of lights, traced shadows, time slices of
                            passes: parts that need not take the same time */
    FRAME_STAGE_COUNT
};

struct frame_progress {
    void *context;
    /* Required; any thread, often. share: of the stage, in [0, 1]; it may fall where a window has
     * to be made again. */
    void (*tell)(void *context, enum frame_stage stage, double share);
};

/* The span of a stage's progress that the work under way covers. */
struct progress_span {
    enum frame_stage stage;
    double first, size; /* shares of the stage */
};

/* A part of a span. */
static inline struct progress_span progress_span_part(struct progress_span span, double first,
                                                      double size)
{
    return (struct progress_span){span.stage, span.first + first * span.size, size * span.size};
}

#endif
