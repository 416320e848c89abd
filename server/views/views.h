/* SPDX-License-Identifier: MIT */
/* The views of the service: made, edited, read and forgotten; who watches them is in
 * server/views/live.h. Thread: any; owns one thread, which forgets idle views and keeps watchers
 * supplied. */
#ifndef VITRAIL_SERVER_VIEWS_VIEWS_H
#define VITRAIL_SERVER_VIEWS_VIEWS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/view_document.h"
#include "server/base/config.h"
#include "server/front/resources.h"
#include "server/tradeoffs/tradeoffs.h"
#include "server/views/view_images.h"

enum { VIEW_ID_BYTES = 17 };

struct views;

struct views_desc { /* all required, borrowed */
    const struct config *config;
    const struct resources *resources;
    struct supervisor *supervisor;
    struct view_images *images;
    struct tradeoffs *tradeoffs; /* chooses for exact pictures */
    const char *build_id;
};
struct views *views_create(const struct views_desc *desc, struct error *err);

/* No view is made or watched any more, and every watcher gets a message that its view is gone. */
void views_stop(struct views *views);

/* After the supervisor, which completes the renders of watched views; without watchers. Accepts
 * NULL. */
void views_destroy(struct views *views);

struct view_make_desc {
    const char *json; /* the body of POST /v1/views, length bytes, borrowed for the call */
    size_t length;
    const char *address; /* of the client, borrowed for the call */
    int expires_s;       /* 0 = config->view_idle_s, which is also the most */
};

/* The answer is the summary, a new reference; NULL on failure. */
MUST_CHECK json_t *views_make(struct views *views, const struct view_make_desc *desc,
                              struct error *err);

MUST_CHECK json_t *views_list(struct views *views); /* summaries, oldest first; NULL: no memory */

/* The summary, with all members in `view` when is_whole. ERROR_NOT_FOUND. */
MUST_CHECK json_t *views_get(struct views *views, const char *id, bool is_whole, struct error *err);

/* The condition of a change. Zeroed = none. */
struct view_condition {
    const char *if_match; /* value of the header, borrowed; NULL = none */
    uint64_t revision;    /* 0 = any */
};

/* Applies a merge patch. patch->names is ignored: the scene's are taken. On success the answer is
 * the new summary. *revision is the present one, also after ERROR_PRECONDITION_FAILED; 0 when there
 * is no such view. */
MUST_CHECK json_t *views_patch(struct views *views, const char *id, const struct view_patch *patch,
                               const struct view_condition *condition, uint64_t *revision,
                               struct error *err);

MUST_CHECK bool views_remove(struct views *views, const char *id,
                             const struct view_condition *condition, uint64_t *revision,
                             struct error *err);

/* One picture of the present revision, ready to be asked for. Zeroed = none. */
struct view_picture {
    char scene[65];
    struct request_resources resources; /* beside the scene */
    char *text;                         /* owned */
    json_t *offer;                      /* owned; what the worker chooses from, or NULL */
    char digest[DIGEST_TEXT_BYTES];     /* image_digest of text and offer */
    char tag[IMAGE_TAG_BYTES];          /* of that: equal pictures are made once */
    bool has_target; /* the worker chooses: target_digests.h knows what it drew */
    uint64_t revision, shape;
    int width_px, height_px;
    int home; /* the number of the worker that has drawn the view so far; 0: none has */
};
MUST_CHECK bool views_describe_frame(struct views *views, const char *id,
                                     const struct view_frame_desc *frame,
                                     struct view_picture *picture, struct error *err);
void view_picture_finish(struct view_picture *picture); /* accepts zeroed */

struct views_totals {
    uint64_t views, watchers, made, patches, expired, refused;
    uint64_t moving_frames, exact_frames, refined_frames, sent_frames, failed_frames;
    uint64_t not_modified;
    uint64_t document_bytes;
};
struct views_totals views_get_totals(struct views *views);
void views_count_not_modified(struct views *views);

#endif
