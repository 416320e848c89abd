/* SPDX-License-Identifier: MIT */
/* The plan of a frame as a reply: what the frame requires and the passes that follow, as JSON, as
 * text to read, and as a drawing. Thread: any. */
#ifndef VITRAIL_PROTOCOL_PLAN_DOCUMENT_H
#define VITRAIL_PROTOCOL_PLAN_DOCUMENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/shadow_technique.h"

enum {
    PLAN_DOCUMENT_REQUIREMENTS_MAX = 32,
    PLAN_DOCUMENT_PASSES_MAX = 64,
    PLAN_DOCUMENT_WARNINGS_MAX = 32,
    PLAN_DOCUMENT_NAME_BYTES = 48,
    PLAN_DOCUMENT_TEXT_BYTES = 200,
    PLAN_DOCUMENT_ID_BYTES = 17,
    PLAN_DOCUMENT_STAGES = 5, /* of a program, at most */
    PLAN_DOCUMENT_DEFINES_BYTES = 512,
};

struct plan_document_requirement {
    char name[PLAN_DOCUMENT_NAME_BYTES];
    bool is_met;
    char because[PLAN_DOCUMENT_TEXT_BYTES]; /* why, or why not */
};

struct plan_document_pass {
    char pass[PLAN_DOCUMENT_NAME_BYTES];
    char technique[PLAN_DOCUMENT_NAME_BYTES]; /* "" where there is one way only */
    int requirement;                          /* index of the one that calls for it */
    bool is_conditional; /* left out where the pass that counts finds nothing */
    uint64_t bytes;      /* 0: not known before the frame */
};

/* Of a program. */
enum plan_document_place {
    PLAN_DOCUMENT_ABSENT, /* it would have to be compiled */
    PLAN_DOCUMENT_IN_MEMORY,
    PLAN_DOCUMENT_ON_DISK, /* as an earlier start compiled it */
    PLAN_DOCUMENT_PLACE_COUNT
};

struct plan_document_program {
    int pass;                        /* index of the one that runs it */
    char id[PLAN_DOCUMENT_ID_BYTES]; /* follows from its source: 16 hex digits */
    char files[PLAN_DOCUMENT_STAGES][PLAN_DOCUMENT_NAME_BYTES]; /* the last ones may be "" */
    char defines[PLAN_DOCUMENT_DEFINES_BYTES]; /* NAME or NAME=VALUE, separated by blanks */
    enum plan_document_place place;
    bool is_conditional; /* whether it is needed depends on what the frame counts */
};

/* Zeroed = empty; texts are NUL-terminated UTF-8. */
struct plan_document {
    char scene[65];
    char device[128];
    int width, height; /* px */
    int samples;       /* per pixel */
    struct plan_document_requirement requirements[PLAN_DOCUMENT_REQUIREMENTS_MAX];
    int requirement_count;
    struct plan_document_pass passes[PLAN_DOCUMENT_PASSES_MAX]; /* in order */
    int pass_count;
    /* What the frame will warn of, as far as its plan tells. */
    char warnings[PLAN_DOCUMENT_WARNINGS_MAX][PLAN_DOCUMENT_TEXT_BYTES];
    int warning_count;
    const struct plan_document_program *programs; /* borrowed; in the order of their passes */
    size_t program_count;
    struct {
        uint64_t opaque_items, transparent_items;    /* in view */
        uint64_t lights_by_technique[SHADOWS_COUNT]; /* those with a shadow */
        uint64_t unshadowed_lights, unseen_lights, shadow_texels, light_batches;
    } counts;
};

enum plan_format {
    PLAN_FORMAT_JSON,
    PLAN_FORMAT_TEXT,
    PLAN_FORMAT_DOT,
    PLAN_FORMAT_SVG,
    PLAN_FORMAT_GLSL /* the sources of its programs; not written from a document */
};

/* "json", "text", "dot", "svg", "glsl"; NULL past the last. */
const char *plan_format_name(int format);
const char *plan_format_media_type(int format); /* likewise */

/* malloc'ed text of *length bytes, NUL-terminated, caller frees; NULL only when memory runs out.
 * The drawings have requirements on the left, those not met in grey, and passes on the right, with
 * a line from each pass to what calls for it. */
MUST_CHECK char *plan_document_write(const struct plan_document *document, enum plan_format format,
                                     size_t *length);

#endif
