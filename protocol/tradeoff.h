/* SPDX-License-Identifier: MIT */
/* A trade-off: one view measured at many settings, time against error. The body of
 * POST /v1/tradeoffs, and the document that GET answers and the server keeps. Thread: any. The
 * manual for clients is docs/reference/tradeoffs.md. */
#ifndef VITRAIL_PROTOCOL_TRADEOFF_H
#define VITRAIL_PROTOCOL_TRADEOFF_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/quality_setting.h"
#include "protocol/render_request.h"

enum {
    TRADEOFF_ROWS_MAX = 160,   /* the whole sweep has 128 where there is neither haze nor smoke */
    TRADEOFF_REPEATS_MAX = 20, /* timed runs of one setting */
    TRADEOFF_SKIPS_MAX = 64,
    TRADEOFF_WARNINGS_MAX = 16,
    TRADEOFF_TEXT_BYTES = 200,
    TRADEOFF_DEVICE_BYTES = 400,
    TRADEOFF_ID_BYTES = 17, /* 16 hexadecimal digits */
    TRADEOFF_TIME_BYTES = 32,
    TRADEOFF_DOCUMENT_BYTES = 64 << 20, /* a request at its cap, and every row */
};

/* ---- the request ---- */

/* How to measure. Zero means the default. */
struct tradeoff_options {
    int time_budget_s;     /* [1, 3600]; default 480: when it is spent, what is left is skipped */
    int repeats;           /* timed runs of each setting, [1, 20]; default 3 */
    int max_settings;      /* [1, 128]; default 32: the most telling ones first */
    int reference_samples; /* of the reference per pixel: 16, 64, 256; default 16 */
    bool drops_images;     /* keep_images false */
};

struct tradeoff_request {
    struct render_request render; /* what it says of quality is held fixed; here the says_ members
                                     of quality are always meant */
    struct tradeoff_options options; /* filled in */
};

/* As render_request_parse, with the member "tradeoff". Refuses what a measurement cannot take:
 * max_error, budget_ms, other outputs than color, a format, and shadow techniques that are not
 * measured together with their parameters. */
MUST_CHECK bool tradeoff_request_parse(const char *json, size_t length,
                                       struct tradeoff_request *request, struct error *err);
void tradeoff_request_finish(struct tradeoff_request *request); /* accepts zeroed; zeroes */

/* ---- the document ---- */

enum tradeoff_state {
    TRADEOFF_QUEUED,
    TRADEOFF_RUNNING,
    TRADEOFF_DONE,
    TRADEOFF_FAILED,
    TRADEOFF_CANCELLED
};
enum tradeoff_stage {
    TRADEOFF_STAGE_WAITING,
    TRADEOFF_STAGE_PROBE,
    TRADEOFF_STAGE_REFERENCE,
    TRADEOFF_STAGE_ERRORS,
    TRADEOFF_STAGE_TIMES,
    TRADEOFF_STAGE_ENDED
};
const char *tradeoff_state_name(int state); /* NULL past the last */
const char *tradeoff_stage_name(int stage);

/* Runs of one setting, in the order they were made. */
struct tradeoff_times {
    double ms[TRADEOFF_REPEATS_MAX];
    int count;
};
/* 0 of an empty list. spread: median absolute deviation from the median (Hampel 1974). */
double tradeoff_times_median(const struct tradeoff_times *times);
double tradeoff_times_spread(const struct tradeoff_times *times);
double tradeoff_times_max(const struct tradeoff_times *times);

struct tradeoff_row {
    struct quality_setting setting;
    /* Of linear colour under the exposure, cut to [0, 1]; flip < 0: not measured. */
    double rmse, p999, max, flip;
    struct tradeoff_times warm, cold;
    uint64_t bytes; /* of every structure of the frame */
    bool is_on_front;
    uint64_t image_offset, image_bytes; /* in the images file; 0 bytes: none */
};

struct tradeoff_skip {
    char what[96];
    char because[TRADEOFF_TEXT_BYTES];
};

/* On the heap: some 90 KiB. Zeroed = empty. */
struct tradeoff {
    char id[TRADEOFF_ID_BYTES];
    char scene[65];
    char view_key[65]; /* digest of the request without what the sweep varies */
    char device[TRADEOFF_DEVICE_BYTES];
    char created[TRADEOFF_TIME_BYTES]; /* RFC 3339, UTC */
    int width, height;                 /* px */
    enum tradeoff_state state;
    enum tradeoff_stage stage;
    bool is_partial; /* something planned was not measured, or not as often as asked for */
    struct tradeoff_options options;
    double progress; /* share done, [0, 1] */
    double elapsed_s;
    int reference_rows; /* rows of the reference that are done */
    double reference_ms;
    uint64_t lights, shadowed_lights, triangles;
    bool has_transparent_casters;
    uint64_t reference_offset, reference_bytes; /* its image, as of a row */
    struct tradeoff_row rows[TRADEOFF_ROWS_MAX];
    int row_count;
    struct tradeoff_skip skips[TRADEOFF_SKIPS_MAX];
    int skip_count;
    char warnings[TRADEOFF_WARNINGS_MAX][TRADEOFF_TEXT_BYTES];
    int warning_count;
    struct error problem; /* of FAILED */
    json_t *request;      /* owned reference, never changed; NULL in lists */
};
void tradeoff_finish(struct tradeoff *tradeoff); /* accepts zeroed */

/* Each stops silently at its cap. */
void tradeoff_skip(struct tradeoff *tradeoff, const char *what, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void tradeoff_warn(struct tradeoff *tradeoff, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The setting of a row, or of `chosen` of the stats, as this program's own code has written either.
 * What is missing, null or unknown is 0; a technique, SHADOWS_COUNT. */
struct quality_setting tradeoff_setting_from_json(const json_t *members);
/* The transparency that a setting names; NULL: none. */
const char *tradeoff_method(const struct quality_setting *setting);
/* What a setting says of maps, deep lists and transparent surfaces, after the name of its
 * technique: " 512, 1 tap, k 2, e 0.02, sorted"; "" where the technique has no maps and all is as
 * by default. */
enum { TRADEOFF_EXTRAS_BYTES = 96, TRADEOFF_MEDIA_BYTES = 24 };
void tradeoff_extras_label(const struct quality_setting *setting,
                           char label[TRADEOFF_EXTRAS_BYTES]);
/* What it says of haze and density grids, as ", media 16"; "" for the default. */
void tradeoff_media_label(const struct quality_setting *setting, char label[TRADEOFF_MEDIA_BYTES]);
/* "deep 1024, 4 taps, 1 sample, media 16" */
enum { TRADEOFF_LABEL_BYTES = 176 };
void tradeoff_setting_label(const struct quality_setting *setting,
                            char label[TRADEOFF_LABEL_BYTES]);

/* Marks the rows that no other row beats in both warm time and RMSE (Pareto). Rows without a time
 * are never on it. */
void tradeoff_mark_front(struct tradeoff *tradeoff);

/* New references; NULL only when memory runs out. The summary has no settings. */
MUST_CHECK json_t *tradeoff_to_json(const struct tradeoff *tradeoff);
MUST_CHECK json_t *tradeoff_summary_to_json(const struct tradeoff *tradeoff);

/* Reads what tradeoff_to_json writes, and refuses what it cannot have written: the server's own
 * files, which a disk may have damaged. On failure the trade-off is zeroed. */
MUST_CHECK bool tradeoff_from_json(json_t *json, struct tradeoff *tradeoff, struct error *err);

/* One line per setting after a line of names; malloc'ed, NULL when memory runs out. */
MUST_CHECK char *tradeoff_to_csv(const struct tradeoff *tradeoff);

#endif
