/* SPDX-License-Identifier: MIT */
/* Progress on stderr in its four forms. */
#include "clients/vitrail/progress.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "protocol/upload_stage.h"

#define REDRAW_S 0.1      /* fast enough to look alive */
#define LINE_S 1.         /* plain lines stay readable while they come */
#define HEARTBEAT_S 10.   /* farms take 30 s of silence for a hang */
#define SHADOWS_SHARE 0.4 /* of a frame, chosen: shading takes longer in most scenes */

enum {
    BAR_CELLS = 24,
    TEXT_BYTES = 80,
    PASS_TOTAL = 1000, /* a pass has no bytes: thousandths */
};

/* Percents of each stage: a render of an unknown length is most of the time a person waits. */
static const struct {
    const char *name;
    int first, end;
} STAGES[] = {
    [PROGRESS_STAGE_NONE] = {"", 0, 0},
    [PROGRESS_STAGE_START] = {"starting", 0, 2},
    [PROGRESS_STAGE_UPLOAD] = {"uploading", 2, 30},
    [PROGRESS_STAGE_DECODE] = {"reading scene", 30, 40},
    [PROGRESS_STAGE_RENDER] = {"rendering", 40, 90},
    [PROGRESS_STAGE_MEASURE] = {"measuring", 40, 90},
    [PROGRESS_STAGE_FRAMES] = {"frames", 40, 90},
    [PROGRESS_STAGE_RECEIVE] = {"receiving", 90, 100},
    [PROGRESS_STAGE_DONE] = {"done", 100, 100},
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
    *progress = (struct progress){.kind = kind, .started_s = clock_s()};
}

/* Whether the server tells what goes on in the stage. */
static bool is_told(enum progress_stage stage)
{
    return stage == PROGRESS_STAGE_RENDER || stage == PROGRESS_STAGE_DECODE;
}

/* What goes on in the stage, behind a separator; "" where no more is known than its name. */
static void describe(const struct progress *progress, const char *separator, char *text,
                     size_t capacity)
{
    const struct progress_render *render = &progress->render;
    char left[32] = "";

    text[0] = '\0';
    if (!is_told(progress->stage) || !render->state[0])
        return;
    if (!strcmp(render->state, "waiting"))
        snprintf(text, capacity, "%swaiting for other %s", separator,
                 progress->stage == PROGRESS_STAGE_RENDER ? "renders" : "uploads");
    else if (!strcmp(render->state, "paused"))
        snprintf(text, capacity, "%spaused for urgent renders", separator);
    else if (!strcmp(render->state, "encoding"))
        snprintf(text, capacity, "%sencoding", separator);
    else if (render->pass[0]) {
        if (render->left_s >= 0)
            snprintf(left, sizeof left, ", %.0f s left", render->left_s);
        snprintf(text, capacity, "%s%s%s", separator, render->pass, left);
    }
}

static void show_bar(struct progress *progress, double elapsed_s, uint64_t done, uint64_t total)
{
    char bar[BAR_CELLS + 1], what[TEXT_BYTES];
    int filled;

    progress_hide(progress);
    if (progress->stage == PROGRESS_STAGE_DONE)
        return;
    progress->is_shown = true;
    describe(progress, "  ", what, sizeof what);
    if (!total) {
        fprintf(stderr, "\r\033[K%-13s %.1f s%s", STAGES[progress->stage].name, elapsed_s, what);
        fflush(stderr);
        return;
    }
    filled = (int)((double)done / (double)total * BAR_CELLS);
    memset(bar, '#', (size_t)filled);
    memset(bar + filled, '-', (size_t)(BAR_CELLS - filled));
    bar[BAR_CELLS] = '\0';
    fprintf(stderr, "\r\033[K%-13s [%s] %3d%%%s", STAGES[progress->stage].name, bar,
            (int)(100. * (double)done / (double)total), what);
    if (progress->stage == PROGRESS_STAGE_MEASURE || is_told(progress->stage))
        fprintf(stderr, "  %.0f s", elapsed_s);
    else if (progress->stage == PROGRESS_STAGE_FRAMES)
        fprintf(stderr, "  %llu of %llu frames", (unsigned long long)done,
                (unsigned long long)total);
    else
        fprintf(stderr, "  %.1f of %.1f MiB", (double)done / 1048576., (double)total / 1048576.);
    fflush(stderr);
}

static void show_plain(const struct progress *progress, double elapsed_s, uint64_t done,
                       uint64_t total)
{
    char what[TEXT_BYTES];

    describe(progress, ": ", what, sizeof what);
    fprintf(stderr, "vitrail: %s", STAGES[progress->stage].name);
    if (total)
        fprintf(stderr, " %d%%", (int)(100. * (double)done / (double)total));
    fprintf(stderr, "%s (%.0f s)\n", what, elapsed_s);
}

static void show_json(const struct progress *progress, double elapsed_s, uint64_t done,
                      uint64_t total)
{
    const struct progress_render *render = &progress->render;
    bool is_render = is_told(progress->stage);
    json_t *line = json_pack("{s:i, s:s, s:f}", "progress", progress->percent, "stage",
                             STAGES[progress->stage].name, "elapsed_s", round(10 * elapsed_s) / 10);

    if (is_render && render->state[0])
        json_object_set_new(line, "state", json_string(render->state));
    if (is_render && render->pass[0]) {
        json_object_set_new(line, "pass", json_string(render->pass));
        json_object_set_new(line, "share", json_real(round(1000 * render->share) / 1000));
        json_object_set_new(line, "left_s",
                            render->left_s >= 0 ? json_real(render->left_s) : json_null());
    } else if (total && progress->stage != PROGRESS_STAGE_MEASURE) {
        bool is_of_frames = progress->stage == PROGRESS_STAGE_FRAMES;
        json_object_set_new(line, is_of_frames ? "done_frames" : "done_bytes",
                            json_integer((json_int_t)done));
        json_object_set_new(line, is_of_frames ? "total_frames" : "total_bytes",
                            json_integer((json_int_t)total));
    }
    json_dumpf(line, stderr, JSON_COMPACT | JSON_REAL_PRECISION(6));
    fputc('\n', stderr);
    json_decref(line);
}

static void show_afanasy(const struct progress *progress, bool is_new_stage)
{
    if (is_new_stage)
        fprintf(stderr, "ACTIVITY: %s\n", STAGES[progress->stage].name);
    fprintf(stderr, "PROGRESS: %d%%\n", progress->percent);
}

static int percent_of(enum progress_stage stage, double share)
{
    return STAGES[stage].first + (int)((double)(STAGES[stage].end - STAGES[stage].first) * share);
}

/* Of the whole render. A traced picture has rays alone; others begin with their shadows. */
static double render_share(const struct progress_render *render)
{
    if (!strcmp(render->state, "encoding"))
        return 1;
    if (!strcmp(render->pass, "shadows"))
        return SHADOWS_SHARE * render->share;
    if (!strcmp(render->pass, "shading"))
        return SHADOWS_SHARE + (1 - SHADOWS_SHARE) * render->share;
    return render->share;
}

/* Of the reading of an upload. How its stages share it is a guess. */
static double decode_share(const struct progress_render *render)
{
    static const struct {
        double first, end;
    } stages[UPLOAD_STAGE_COUNT + 1] = {[UPLOAD_STAGE_FILE] = {0.1, 0.1},
                                        [UPLOAD_STAGE_MESHES] = {0.3, 0.5},
                                        [UPLOAD_STAGE_NODES] = {0.5, 0.6},
                                        [UPLOAD_STAGE_IMAGES] = {0.6, 0.9},
                                        [UPLOAD_STAGE_OUTLINE] = {0.9, 0.9}};
    int stage = upload_stage_find(render->pass);
    return stages[stage].first + (stages[stage].end - stages[stage].first) * render->share;
}

static bool is_other_pass(const struct progress *progress)
{
    return strcmp(progress->render.state, progress->shown.state) != 0 ||
           strcmp(progress->render.pass, progress->shown.pass) != 0;
}

static bool is_due(const struct progress *progress, int percent, double since_s)
{
    bool is_news = percent > progress->percent || is_other_pass(progress);

    if (progress->kind == PROGRESS_AUTO)
        return since_s >= REDRAW_S;
    if (progress->kind == PROGRESS_PLAIN && since_s < LINE_S)
        return false;
    return since_s >= HEARTBEAT_S || (since_s >= REDRAW_S && is_news);
}

static void show(struct progress *progress, bool is_new_stage, uint64_t done, uint64_t total)
{
    double elapsed_s = progress->last_shown_s - progress->started_s;

    if (progress->kind == PROGRESS_AUTO)
        show_bar(progress, progress->last_shown_s - progress->stage_started_s, done, total);
    else if (progress->kind == PROGRESS_PLAIN)
        show_plain(progress, elapsed_s, done, total);
    else if (progress->kind == PROGRESS_JSON)
        show_json(progress, elapsed_s, done, total);
    else
        show_afanasy(progress, is_new_stage);
}

void progress_show(struct progress *progress, enum progress_stage stage, uint64_t done,
                   uint64_t total)
{
    double now_s, share;
    int percent;
    bool is_new_stage;

    if (!progress || progress->kind == PROGRESS_NONE)
        return;
    if (done > total)
        done = total;
    share = total ? (double)done / (double)total : 0;
    if (is_told(stage)) {
        share = stage == PROGRESS_STAGE_RENDER ? render_share(&progress->render)
                                               : decode_share(&progress->render);
        total = progress->render.pass[0] ? PASS_TOTAL : 0;
        done = (uint64_t)(progress->render.share * PASS_TOTAL);
    }
    now_s = clock_s();
    is_new_stage = stage != progress->stage;
    percent = percent_of(stage, share);
    if (!is_new_stage && !is_due(progress, percent, now_s - progress->last_shown_s))
        return;
    if (is_new_stage)
        progress->stage_started_s = now_s;
    progress->stage = stage;
    progress->last_shown_s = now_s;
    progress->shown = progress->render;
    if (percent > progress->percent)
        progress->percent = percent;
    show(progress, is_new_stage, done, total);
}

void progress_note_render(struct progress *progress, const struct progress_render *render)
{
    progress->render = render ? *render : (struct progress_render){.left_s = -1};
    progress->render.share = fmin(fmax(progress->render.share, 0), 1);
}

void progress_begin_again(struct progress *progress)
{
    progress_hide(progress);
    progress->stage = PROGRESS_STAGE_NONE;
    progress->percent = 0;
}

void progress_hide(struct progress *progress)
{
    if (!progress || !progress->is_shown)
        return;
    fputs("\r\033[K", stderr);
    progress->is_shown = false;
}
