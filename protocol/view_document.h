/* SPDX-License-Identifier: MIT */
/* The members of a view: a render request without its outputs, kept as canonical JSON and changed
 * by merge patches (RFC 7396), and how its moving pictures are made. The manual for clients is
 * docs/reference/views.md. Thread: any, one at a time. */
#ifndef VITRAIL_PROTOCOL_VIEW_DOCUMENT_H
#define VITRAIL_PROTOCOL_VIEW_DOCUMENT_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/render_request.h"
#include "protocol/view_names.h"

/* The member `stream`. */
struct view_stream {
    double budget_ms;                /* [1, 10000] for a moving frame; default 50 */
    double min_scale;                /* [0.1, 1]; default 0.25 */
    enum request_format format;      /* of moving frames: JPEG (default), WEBP or PNG */
    int quality_percent;             /* of moving frames, [1, 100]; default 80 */
    enum request_format rest_format; /* of the exact frame: PNG (default) or WEBP, lossless */
    int rest_ms;                     /* [0, 10000]; default 200 */
    int rest_samples; /* per pixel, 4, 8 or 16: the frame at rest is refined to; 0 (default): not */
};

struct view_document;

/* Reads the body that makes a view. Errors point into the body. NULL on failure. */
struct view_document *view_document_create(const char *json, size_t length, struct error *err);
void view_document_destroy(struct view_document *document); /* accepts NULL */

/* Whether there is such a scene, for parts, and such an environment map; NULL: not asked. */
struct view_scenes {
    bool (*has)(void *context, const char *id);
    bool (*has_environment)(void *context, const char *id);
    void *context;
};

/* Applies a merge patch, whole or not at all; borrows it. Costs what the patch touches, whatever
 * else the view holds. replaces_camera: the member `camera` is not merged but replaces the old
 * one. names: what the scene holds, or NULL. */
struct view_patch {
    json_t *json; /* required */
    bool replaces_camera;
    const struct view_names *names;
    struct view_scenes scenes;
};
MUST_CHECK bool view_document_patch(struct view_document *document, const struct view_patch *patch,
                                    struct error *err);

/* Loads the text of a patch; a new reference, or NULL. */
MUST_CHECK json_t *view_patch_load(const char *json, size_t length, struct error *err);

/* ERROR_NOT_FOUND at the first node or material of the whole document that the scene lacks. */
MUST_CHECK bool view_document_check_names(const struct view_document *document,
                                          const struct view_names *names, struct error *err);

/* ERROR_NOT_FOUND at the first part of the whole document whose scene is not there, or at its
 * environment map. */
MUST_CHECK bool view_document_check_scenes(const struct view_document *document,
                                           const struct view_scenes *scenes, struct error *err);

/* What it needs beside its scene. */
void view_document_resources(const struct view_document *document,
                             struct request_resources *resources);

const char *view_document_scene(const struct view_document *document);
void view_document_get_size(const struct view_document *document, int *width_px, int *height_px);
const struct view_stream *view_document_stream(const struct view_document *document);
size_t view_document_bytes(const struct view_document *document); /* of its text; never too few */

/* Counts the patches that moved, hid or changed what rays can hit. */
uint64_t view_document_shape(const struct view_document *document);

/* All members, in canonical form. A new reference that shares nothing; NULL: no memory. */
MUST_CHECK json_t *view_document_to_json(const struct view_document *document);

/* A frame that is asked of the view. */
struct view_frame_desc {
    enum request_output output;
    enum request_format format; /* required, not ANY */
    int quality_percent;        /* 0 = the default */
    double scale;               /* of width and height; 0 means 1 */
    /* One sample, one shadow tap, and no whole renderer: only shadows may be ray-traced. */
    bool is_moving;
    bool is_refined; /* with as many samples as `stream` wants at rest */
};

/* Whether the frame at rest can be refined: `stream` wants more samples than `quality` has, which
 * is neither the reference nor left to be chosen for a target. */
bool view_document_refines(const struct view_document *document);

/* As request_reference_text has it. */
MUST_CHECK char *view_document_reference_text(const struct view_document *document);

/* What its member `quality` says. */
const struct request_quality *view_document_quality(const struct view_document *document);

/* The frame as the text of a render request: equal views give equal texts. malloc'ed; NULL: no
 * memory. *width_px, *height_px: of the picture; may be NULL. */
MUST_CHECK char *view_document_frame(const struct view_document *document,
                                     const struct view_frame_desc *frame, int *width_px,
                                     int *height_px);

#endif
