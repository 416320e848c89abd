/* SPDX-License-Identifier: MIT */
/* Tells on stderr how far a command is: a bar for people, lines for farms, nothing where nobody
 * looks. */
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
    PROGRESS_STAGE_RECEIVE, /* bytes known */
    PROGRESS_STAGE_DONE,
};

/* Zeroed = silent. */
struct progress {
    enum progress_kind kind; /* AUTO has been resolved: here it means a bar */
    bool is_shown;           /* a bar is on the screen and must be wiped */
    enum progress_stage stage;
    double stage_started_s, last_shown_s;
    int percent; /* of the whole command; never goes back */
};

/* AUTO becomes a bar when stderr is a terminal, else silence. */
void progress_init(struct progress *progress, enum progress_kind kind);

/* Cheap to call often: redraws at most ten times a second, and repeats a line every ten seconds so
 * that a farm sees a heartbeat. total 0: unknown. NULL is silent. */
void progress_show(struct progress *progress, enum progress_stage stage, uint64_t done,
                   uint64_t total);

/* Wipes the bar, so that something else can be printed. NULL is silent. */
void progress_hide(struct progress *progress);

/* Seconds of a clock that only goes forward. */
double clock_s(void);

#endif
