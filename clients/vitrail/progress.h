/* SPDX-License-Identifier: MIT */
/* Tells on stderr how far a command is: a bar or plain lines for people, other lines for farms,
 * nothing where nobody looks. */
#ifndef VITRAIL_CLIENTS_VITRAIL_PROGRESS_H
#define VITRAIL_CLIENTS_VITRAIL_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

#include "clients/vitrail/options.h"

/* In the order a render goes through them. */
enum progress_stage {
    PROGRESS_STAGE_NONE,
    PROGRESS_STAGE_START,  /* a private server comes up */
    PROGRESS_STAGE_UPLOAD, /* bytes known */
    PROGRESS_STAGE_DECODE, /* the server reads the scene */
    PROGRESS_STAGE_RENDER,
    PROGRESS_STAGE_MEASURE, /* a trade-off, instead of a render; thousandths known */
    PROGRESS_STAGE_FRAMES,  /* of a job; their number is known */
    PROGRESS_STAGE_RECEIVE, /* bytes known */
    PROGRESS_STAGE_DONE,
};

/* What the server says of a render, or of an upload that it reads. */
struct progress_render {
    char state[16]; /* "waiting", "rendering", "paused", "encoding"; "decoding" */
    char pass[16];  /* "shadows", "rays", "shading"; the stage of reading; "": it tells none yet */
    double share;   /* of the pass that is done, [0, 1] */
    double left_s;  /* of the pass; below 0: not known */
};

/* Zeroed = silent. */
struct progress {
    enum progress_kind kind; /* AUTO has been resolved: here it means a bar */
    bool is_shown;           /* a bar is on the screen and must be wiped */
    enum progress_stage stage;
    double started_s, stage_started_s, last_shown_s;
    int percent; /* of the whole command; never goes back */
    struct progress_render render, shown;
};

/* AUTO becomes a bar when stderr is a terminal, else silence. */
void progress_init(struct progress *progress, enum progress_kind kind);

/* Cheap to call often: redraws at most ten times a second, writes plain lines at most one a second,
 * and repeats a line every ten seconds so that a farm sees a heartbeat. total 0: unknown. NULL is
 * silent. */
void progress_show(struct progress *progress, enum progress_stage stage, uint64_t done,
                   uint64_t total);

/* What progress_show tells from now on while PROGRESS_STAGE_RENDER or PROGRESS_STAGE_DECODE lasts.
 * NULL: nothing is known. */
void progress_note_render(struct progress *progress, const struct progress_render *render);

/* The next of several images: its stages begin again. */
void progress_begin_again(struct progress *progress);

/* Wipes the bar, so that something else can be printed. NULL is silent. */
void progress_hide(struct progress *progress);

/* Seconds of a clock that only goes forward. */
double clock_s(void);

#endif
