/* SPDX-License-Identifier: MIT */
/* What one frame cost, what it modelled and why. Filled by the renderer, copied by value. */
#ifndef VITRAIL_RENDERER_FRAME_REPORT_H
#define VITRAIL_RENDERER_FRAME_REPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/report_counts.h"
#include "protocol/shadow_technique.h"

enum {
    REPORT_PASSES_MAX = 64,
    REPORT_NAME_BYTES = 48,
    REPORT_TEXT_BYTES = 200,
    REPORT_WARNINGS_MAX = 32,
    REPORT_REUSED_MAX = 16,
    REPORT_BYTES_MAX = 16,
};

/* The coarse stages of Server-Timing. Encode and queue are added by those who do them. */
enum report_stage {
    REPORT_SHADOW,
    REPORT_LIGHT_LIST,
    REPORT_SHADE,
    REPORT_READBACK,
    REPORT_STAGE_COUNT
};

struct report_pass {
    char pass[REPORT_NAME_BYTES];      /* "shadow.deep", "gbuffer", ... */
    char because[REPORT_TEXT_BYTES];   /* the requirement that called for it */
    char technique[REPORT_NAME_BYTES]; /* "deep", "map", "clustered", "lists", "" */
    double ms; /* true on this device: GPU timer where it is honest, fenced wall clock where the
                  device is our own processors; else NAN: not known */
};

struct report_bytes {
    char structure[REPORT_NAME_BYTES];
    uint64_t bytes;
};

/* Of lights whose transparent meshes are divided into partitions. */
struct report_partitions {
    size_t lights, merged, crossed; /* of these: with too many, and with meshes that cross */
    uint32_t most, most_crossed;    /* partitions that a light wants; meshes of one that cross */
};

struct frame_report {
    struct report_pass passes[REPORT_PASSES_MAX];
    int pass_count;
    char order[REPORT_PASSES_MAX][REPORT_NAME_BYTES]; /* of passes; report_order_pass */
    int order_count;
    double stage_ms[REPORT_STAGE_COUNT]; /* NAN where a pass of it has no known time */
    double total_ms;  /* wall clock of the whole frame in the renderer, without pauses */
    double paused_ms; /* while other frames went before the rest of this one */
    struct report_counts counts;
    struct report_compression compression;
    struct report_textures textures;
    /* What the frame's picture is made from, whatever else is resident. */
    struct report_bytes bytes[REPORT_BYTES_MAX];
    int byte_count;
    uint64_t resident_bytes; /* of all that counts against the budget, after the frame */
    char reused[REPORT_REUSED_MAX][REPORT_NAME_BYTES]; /* "scene", "shadow.deep", ... */
    int reused_count;
    char warnings[REPORT_WARNINGS_MAX][REPORT_TEXT_BYTES];
    int warning_count;
    struct {                             /* what `shadows: auto` became; because "": nothing */
        char because[REPORT_TEXT_BYTES]; /* was open */
        enum shadow_technique shadows;   /* `map` where no light has a transparent caster */
        double expected_ms;              /* 0: not known */
    } chosen;
    struct report_partitions partitions;
    char environment[65]; /* key of the map that lights; "": none */
    bool has_layers;      /* transparent surfaces are in view, */
    unsigned layer_needs; /* of whose method this is asked: enum transparency_can */
    bool is_kept_picture; /* nothing was drawn but what lies over it: it teaches nothing */
    bool has_cut_lists;   /* some did not find the room that was guessed: the frame is made again */
    bool has_lost_window; /* what came of it could not be read back: the frame has failed */
    bool error_is_exact;  /* of light's way to the surfaces of the color output nothing is left out
                             or approximated, but for the sampling of texels */
};

/* A pass has a line for each reason, and beyond half of the lines one for all further reasons. Each
 * silently stops at its cap; warnings say in the last slot that more were dropped. */
void report_add_pass(struct frame_report *report, const char *pass, const char *because,
                     const char *technique, double ms, enum report_stage stage);
/* The order of passes from now on, whenever their times become known; others follow. Names beyond
 * the cap are not kept. */
void report_order_pass(struct frame_report *report, const char *pass);
void report_add_bytes(struct frame_report *report, const char *structure, uint64_t bytes);
/* Of memory that windows or batches of lights use one after the other: the most of any counts. 0
 * makes no entry. */
void report_raise_bytes(struct frame_report *report, const char *structure, uint64_t bytes);
void report_add_reused(struct frame_report *report, const char *what);
/* Adds those of further lights. */
void report_add_partitions(struct frame_report *report, const struct report_partitions *added);
void report_warn(struct frame_report *report, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
