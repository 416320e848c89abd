/* SPDX-License-Identifier: MIT */
/* Progress on stderr in its three forms. */
#include "clients/vitrail/progress.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define REDRAW_S 0.1    /* fast enough to look alive */
#define HEARTBEAT_S 10. /* farms take 30 s of silence for a hang */

enum { BAR_CELLS = 24 };

/* First percent of each stage: a render of an unknown length is most of the time a person waits. */
static const struct {
    const char *name;
    int percent;
} STAGES[] = {
    [PROGRESS_STAGE_NONE] = {"", 0},
    [PROGRESS_STAGE_START] = {"starting", 0},
    [PROGRESS_STAGE_UPLOAD] = {"uploading", 2},
    [PROGRESS_STAGE_DECODE] = {"reading scene", 30},
    [PROGRESS_STAGE_RENDER] = {"rendering", 40},
    [PROGRESS_STAGE_MEASURE] = {"measuring", 40},
    [PROGRESS_STAGE_RECEIVE] = {"receiving", 90},
    [PROGRESS_STAGE_DONE] = {"done", 100},
};

double clock_s(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void progress_init(struct progress *progress, enum progress_kind kind)
{
    if (kind == PROGRESS_AUTO && !isatty(STDERR_FILENO))
        kind = PROGRESS_NONE;
    *progress = (struct progress){.kind = kind};
}

static void show_bar(struct progress *progress, double elapsed_s, uint64_t done, uint64_t total)
{
    char bar[BAR_CELLS + 1];
    int filled;

    progress_hide(progress);
    if (progress->stage == PROGRESS_STAGE_DONE)
        return;
    progress->is_shown = true;
    if (!total) {
        fprintf(stderr, "\r\033[K%-13s %.1f s", STAGES[progress->stage].name, elapsed_s);
        fflush(stderr);
        return;
    }
    filled = (int)((double)done / (double)total * BAR_CELLS);
    memset(bar, '#', (size_t)filled);
    memset(bar + filled, '-', (size_t)(BAR_CELLS - filled));
    bar[BAR_CELLS] = '\0';
    fprintf(stderr, "\r\033[K%-13s [%s] %3d%%", STAGES[progress->stage].name, bar,
            (int)(100. * (double)done / (double)total));
    if (progress->stage == PROGRESS_STAGE_MEASURE)
        fprintf(stderr, "  %.0f s", elapsed_s);
    else
        fprintf(stderr, "  %.1f of %.1f MiB", (double)done / 1048576., (double)total / 1048576.);
    fflush(stderr);
}

static void show_json(const struct progress *progress, double elapsed_s, uint64_t done,
                      uint64_t total)
{
    fprintf(stderr, "{\"progress\":%d,\"stage\":\"%s\",\"elapsed_s\":%.1f", progress->percent,
            STAGES[progress->stage].name, elapsed_s);
    if (total && progress->stage != PROGRESS_STAGE_MEASURE)
        fprintf(stderr, ",\"done_bytes\":%llu,\"total_bytes\":%llu", (unsigned long long)done,
                (unsigned long long)total);
    fputs("}\n", stderr);
}

static int percent_of(enum progress_stage stage, uint64_t done, uint64_t total)
{
    int from = STAGES[stage].percent;
    int to = stage < PROGRESS_STAGE_DONE ? STAGES[stage + 1].percent : from;

    return total ? from + (int)((double)(to - from) * (double)done / (double)total) : from;
}

void progress_show(struct progress *progress, enum progress_stage stage, uint64_t done,
                   uint64_t total)
{
    double now_s;
    int percent;
    bool is_new_stage;

    if (!progress || progress->kind == PROGRESS_NONE)
        return;
    if (done > total)
        done = total;
    now_s = clock_s();
    is_new_stage = stage != progress->stage;
    percent = percent_of(stage, done, total);
    if (!is_new_stage && now_s - progress->last_shown_s < REDRAW_S)
        return;
    if (is_new_stage)
        progress->stage_started_s = now_s;
    else if (progress->kind != PROGRESS_AUTO && percent <= progress->percent &&
             now_s - progress->last_shown_s < HEARTBEAT_S)
        return;
    progress->stage = stage;
    progress->last_shown_s = now_s;
    if (percent > progress->percent)
        progress->percent = percent;
    if (progress->kind == PROGRESS_AUTO) {
        show_bar(progress, now_s - progress->stage_started_s, done, total);
    } else if (progress->kind == PROGRESS_JSON) {
        show_json(progress, now_s - progress->stage_started_s, done, total);
    } else {
        if (is_new_stage)
            fprintf(stderr, "ACTIVITY: %s\n", STAGES[stage].name);
        fprintf(stderr, "PROGRESS: %d%%\n", progress->percent);
    }
}

void progress_hide(struct progress *progress)
{
    if (!progress || !progress->is_shown)
        return;
    fputs("\r\033[K", stderr);
    progress->is_shown = false;
}
