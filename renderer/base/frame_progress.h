/* SPDX-License-Identifier: MIT */
/* How far a frame is, by what of it is finished. */
#ifndef VITRAIL_RENDERER_BASE_FRAME_PROGRESS_H
#define VITRAIL_RENDERER_BASE_FRAME_PROGRESS_H

enum frame_stage {
    FRAME_STAGE_SHADOWS, /* structures of lights; left out where lights come in batches */
    FRAME_STAGE_RAYS,    /* tiles or rows of a traced picture */
    FRAME_STAGE_SHADING, /* windows, batches and slices of lights, traced shadows, bands of passes:
                            pieces that need not take the same time */
    FRAME_STAGE_COUNT
};

struct frame_progress {
    void *context;
    /* Required; any thread, often. share: of the stage, in [0, 1]; it may fall where a window has
     * to be made again. */
    void (*tell)(void *context, enum frame_stage stage, double share);
};

/* The part of a stage that is being made. */
struct frame_piece {
    enum frame_stage stage;
    double first, size; /* shares of the stage */
};

/* A part of a piece. */
static inline struct frame_piece frame_piece_part(struct frame_piece piece, double first,
                                                  double size)
{
    return (struct frame_piece){piece.stage, piece.first + first * piece.size, size * piece.size};
}

#endif
