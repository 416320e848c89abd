/* SPDX-License-Identifier: MIT */
/* What one frame cost, as clients see it: /v1/frames/{id} and the Server-Timing header.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_FRAME_STATS_H
#define VITRAIL_PROTOCOL_FRAME_STATS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/report_counts.h"

enum {
    FRAME_STATS_PASSES_MAX = 64,
    FRAME_STATS_BYTES_MAX = 24,
    FRAME_STATS_REUSED_MAX = 24,
    FRAME_STATS_WARNINGS_MAX = 40,
    FRAME_STATS_NAME_BYTES = 48,
    FRAME_STATS_TEXT_BYTES = 200,
    FRAME_STATS_DEVICE_BYTES = 128,
};

/* Tokens of Server-Timing and keys of timings_ms: queue, paused, prepare, shadow, light-list,
 * shade, readback, encode, other, total. */
enum frame_timing {
    FRAME_TIMING_QUEUE,
    FRAME_TIMING_PAUSED,  /* urgent frames went before the rest of this one */
    FRAME_TIMING_PREPARE, /* the frame outside of its passes: scene, plan, memory, programs */
    FRAME_TIMING_SHADOW,
    FRAME_TIMING_LIGHT_LIST,
    FRAME_TIMING_SHADE,
    FRAME_TIMING_READBACK,
    FRAME_TIMING_ENCODE,
    FRAME_TIMING_OTHER, /* between the processes: the request's way to the worker and back */
    FRAME_TIMING_TOTAL, /* of a frame in the renderer, without pauses, until frame_stats_close */
    FRAME_TIMING_COUNT
};

struct frame_stats_pass {
    char pass[FRAME_STATS_NAME_BYTES];
    char because[FRAME_STATS_TEXT_BYTES];
    char technique[FRAME_STATS_NAME_BYTES]; /* "" where only one way exists */
    double ms;
};

struct frame_stats_bytes {
    char structure[FRAME_STATS_NAME_BYTES];
    uint64_t bytes;
};

/* Where the stated error of a frame comes from. */
enum frame_error_source { FRAME_ERROR_EXACT, FRAME_ERROR_MEASURED, FRAME_ERROR_ESTIMATED };

/* What a choice was made by: measurements of this view, the speed of this device and a model of
 * each technique, a measurement of another view or the configuration. */
enum frame_choice_source {
    FRAME_CHOICE_MEASURED,
    FRAME_CHOICE_CALIBRATED,
    FRAME_CHOICE_ESTIMATED,
    FRAME_CHOICE_CONFIGURED
};

/* What the server chose where a request left it open. */
struct frame_stats_chosen {
    enum frame_choice_source source;
    char shadows[FRAME_STATS_NAME_BYTES]; /* "" = nothing was chosen */
    int shadow_resolution, shadow_taps;   /* 0 where the technique has none */
    double shadow_compression;            /* of deep lists; 0 = exact */
    int shadow_prefilter;                 /* of deep lists; 0 and 1 = none */
    int samples;
    int atmosphere_samples; /* 0 = the default, and where there is neither haze nor smoke */
    char transparency[FRAME_STATS_NAME_BYTES]; /* "" = the one of the request */
    double expected_ms;
    double took_ms;                      /* in the renderer, without pauses; 0: not known */
    char missed[FRAME_STATS_TEXT_BYTES]; /* what was asked for and expected, and why it took longer;
                                            "": it did not */
    char because[FRAME_STATS_TEXT_BYTES];
};

/* What is known of a frame before it is rendered. Zeroed = nothing. */
struct frame_promise {
    struct frame_stats_chosen chosen;
    bool has_error;
    double rmse;
    double budget_ms; /* that was asked for; 0: none */
    double base_ms;   /* of the row that was chosen, before what was learned; 0: none was */
    double bytes;     /* likewise, of memory; 0: not known */
    bool is_warm, is_measured; /* that row's time, and where from: server/worker/time_estimator.h */
    bool is_hazy;              /* of the frame */
    enum frame_error_source source;
    char warning[FRAME_STATS_TEXT_BYTES]; /* "" = none */
};

/* Zeroed = an empty report; every text is NUL-terminated UTF-8. */
struct frame_stats {
    char id[65]; /* of /v1/frames/{id}; "" until one is given */
    char scene[65];
    char view[65];     /* "" = null: a one-shot render */
    uint64_t revision; /* of the view; 0 for a one-shot render */
    char device[FRAME_STATS_DEVICE_BYTES];
    int width, height;  /* px */
    bool has_exposure;  /* the picture has colours of a screen */
    double exposure_ev; /* theirs */
    struct frame_stats_environment {
        char image[65]; /* as in a request; "": no environment map */
        int samples;    /* towards it, per ray traced point; 0: nothing was ray traced */
    } environment;
    struct frame_stats_pass plan[FRAME_STATS_PASSES_MAX];
    int plan_count;
    double timings_ms[FRAME_TIMING_COUNT];
    struct report_counts counts;
    struct report_compression compression; /* maps 0: null */
    struct report_textures textures;       /* budget_bytes 0: null */
    struct frame_stats_bytes bytes[FRAME_STATS_BYTES_MAX];
    int byte_count;
    uint64_t resident_bytes; /* of all structures that the renderer holds, after the frame */
    char reused[FRAME_STATS_REUSED_MAX][FRAME_STATS_NAME_BYTES];
    int reused_count;
    bool has_error; /* false: null, nothing is known about the error */
    char error_metric[FRAME_STATS_NAME_BYTES];
    double error_value;
    enum frame_error_source error_source;
    struct frame_stats_chosen chosen;
    char warnings[FRAME_STATS_WARNINGS_MAX][FRAME_STATS_TEXT_BYTES];
    int warning_count;
};

/* From the renderer's times to those of a reply: `total_ms` from the request to the reply, of which
 * it waited `queue_ms` at most. Then all stages together are the total. */
void frame_stats_close(struct frame_stats *stats, double queue_ms, double total_ms);

/* Adds a warning; the last slot says that more were dropped. */
void frame_stats_warn(struct frame_stats *stats, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Puts a promise into the report of its frame; its error, of the metric that was asked for,
 * replaces what the frame knows of others. */
void frame_stats_promise(struct frame_stats *stats, const struct frame_promise *promise);

/* Tells what the frame took beside what was expected of it, before frame_stats_close; and whether
 * that is more than half as much again as was expected and, where a time was asked for, as that. */
void frame_stats_judge(struct frame_stats *stats, double budget_ms);

/* The member "error" by itself, null where there is none. A new reference; NULL only when memory
 * runs out. */
MUST_CHECK json_t *frame_stats_error_to_json(const struct frame_stats *stats);
/* Takes an error that was stated before the frame into its promise; an exact one is left out, since
 * each frame knows by itself whether it is exact. json: that member, or NULL; false: it is none. */
MUST_CHECK bool frame_promise_take_error(struct frame_promise *promise, json_t *json,
                                         struct error *err);

/* A new reference, or malloc'ed text; NULL only when memory runs out. */
MUST_CHECK json_t *frame_stats_to_json(const struct frame_stats *stats);
MUST_CHECK char *frame_stats_to_json_text(const struct frame_stats *stats);

/* Reads what frame_stats_to_json writes (worker to front, server to CLI). Members it does not know
 * are passed over, so that a newer server can be read; wrong types and ranges are refused. */
MUST_CHECK bool frame_stats_from_json(json_t *json, struct frame_stats *stats, struct error *err);

const char *frame_timing_name(int timing); /* token; NULL past the last */

/* Value of the Server-Timing header, e.g. "queue;dur=0.1, shadow;dur=3.2, ...". Always
 * NUL-terminated; returns the length that the whole value has, as snprintf does.
 * FRAME_SERVER_TIMING_BYTES always suffices. */
enum { FRAME_SERVER_TIMING_BYTES = 512 };
int frame_stats_server_timing(const struct frame_stats *stats, char *text, size_t size_bytes);

#endif
