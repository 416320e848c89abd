/* SPDX-License-Identifier: MIT */
/* What /v1/scenes and /v1/environments have in common: bring, list, describe, rename. Thread: as
 * routes; posts end on a thread of the decode pool. */
#ifndef VITRAIL_SERVER_ROUTES_RESOURCE_ROUTES_H
#define VITRAIL_SERVER_ROUTES_RESOURCE_ROUTES_H

#include <jansson.h>

#include "server/front/upload.h"
#include "server/routes/router.h"

struct resource_post_desc {
    enum resource_kind kind;
    const char *content_type; /* of the body; NULL: that of the request */
    const char *default_name; /* NULL: as the file */
    bool takes_scene;         /* ?scene= chooses one of the file */
    /* Optional: called with the id of what was stored just now. */
    void (*stored)(struct service *service, const char *id);
};

/* A POST on its way: the exchange owns it. */
struct resource_post {
    struct resource_post_desc desc;
    struct service *service;
    struct http_exchange *exchange;
    struct upload *upload; /* NULL once the decoders have it */
    char id[DIGEST_TEXT_BYTES];
};

/* A post with an empty upload, attached to its exchange; NULL with the reply made. */
struct resource_post *resource_post_begin(struct service *service, struct http_exchange *exchange,
                                          const struct resource_post_desc *desc);
/* Has the body written to the upload. */
void resource_post_take_body(struct resource_post *post);
/* The body is over: works out the id. False with the reply made, also where it is stored already.
 * Else it is to be submitted. */
bool resource_post_end(struct resource_post *post);
/* Has the upload decoded. fill: as in struct decode_job_desc, with the post as context; NULL where
 * the upload has ended. The reply is made later. */
void resource_post_submit(struct resource_post *post,
                          bool (*fill)(void *post, struct upload *upload,
                                       char id[DIGEST_TEXT_BYTES], struct error *err));

void resource_reply_list(struct service *service, struct http_exchange *exchange,
                         enum resource_kind kind);
/* Answers with what is reported of an id, or with the problem where json is NULL. Takes json. */
void resource_reply(struct http_exchange *exchange, const char *id, json_t *json,
                    const struct error *problem);
void resource_reply_summary(struct service *service, struct http_exchange *exchange,
                            enum resource_kind kind, const char *id);
/* Removes it unless a job needs it (?force=true: all the same); false: the problem is answered. */
MUST_CHECK bool resource_delete(struct service *service, struct http_exchange *exchange,
                                enum resource_kind kind, const char *id);
/* Renames by the body of text_body_open, and answers with the summary. */
void resource_reply_patched(struct service *service, struct http_exchange *exchange,
                            enum resource_kind kind, const char *id);

#endif
