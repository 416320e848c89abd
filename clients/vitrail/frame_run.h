/* SPDX-License-Identifier: MIT */
/* The frames of one call of a farm: a list, or the share of it that this call is to do. */
#ifndef VITRAIL_CLIENTS_VITRAIL_FRAME_RUN_H
#define VITRAIL_CLIENTS_VITRAIL_FRAME_RUN_H

#include <jansson.h>
#include <stddef.h>

#include "clients/vitrail/options.h"
#include "clients/vitrail/session.h"
#include "protocol/camera_path.h"
#include "protocol/frame_list.h"

/* What a command line says of frames. */
struct frame_options {
    const char *frames, *camera_path;
    struct option_number frame_rate, chunk, chunks;
    bool still, skip_existing;
};

/* Rows of an option table; the options have a member `frame`. */
#define FRAME_OPTION(owner, kind, name, argument, help, member)               \
    {                                                                         \
        OPTION_##kind, name, 0, argument, help, offsetof(owner, frame.member) \
    }
#define FRAME_OPTIONS(owner)                                                                    \
    FRAME_OPTION(owner, TEXT, "frames", "LIST",                                                 \
                 "several images, of frames such as 1-100,120-140x2; FILE\nthen holds a %d or " \
                 "%04d",                                                                        \
                 frames),                                                                       \
        FRAME_OPTION(owner, NUMBER, "frame-rate", "N",                                          \
                     "frames per second of the scene's animation; default 24", frame_rate),     \
        FRAME_OPTION(owner, FLAG, "still", NULL, "the scene stands still from frame to frame",  \
                     still),                                                                    \
        FRAME_OPTION(owner, TEXT, "camera-path", "FILE.json",                                   \
                     "the camera moves through the keys of the file", camera_path),             \
        FRAME_OPTION(owner, NUMBER, "chunks", "N", "do one of N shares of the list", chunks),   \
        FRAME_OPTION(owner, NUMBER, "chunk", "I",                                               \
                     "which share, from 0; default: by SLURM_ARRAY_TASK_ID or\n"                \
                     "JOB_COMPLETION_INDEX",                                                    \
                     chunk),                                                                    \
        FRAME_OPTION(owner, FLAG, "skip-existing", NULL,                                        \
                     "leave out frames whose image is there, whole and of the same\nrequest: "  \
                     "FILE.json beside each tells",                                             \
                     skip_existing)

/* Zeroed: one image that has no number. */
struct frame_run {
    const struct frame_options *options; /* borrowed */
    struct frame_list list;
    size_t first, end; /* of the list: the share of this call */
    double time_s;     /* of the request, before frames change it */
    bool is_animated;
    struct camera_path path;
};

/* Checks what is said. Without a list, options that need one are a wrong command line. */
bool frame_run_init(struct frame_run *run, const struct frame_options *options, const char *pattern,
                    struct failure *failure);
void frame_run_finish(struct frame_run *run); /* accepts zeroed */

/* Before the first frame: what the request and the scene say of time. description: of the scene, or
 * NULL: unknown. */
void frame_run_note(struct frame_run *run, const json_t *request, const json_t *description);
/* Puts the time of a frame, and the camera of a path, into the request. */
bool frame_run_put_frame(const struct frame_run *run, size_t index, json_t *request,
                         struct failure *failure);

#endif
