/* SPDX-License-Identifier: MIT */
/* The kinds of what clients upload. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_RESOURCE_KIND_H
#define VITRAIL_SERVER_FRONT_RESOURCE_KIND_H

#include "protocol/error.h"

enum resource_kind { RESOURCE_SCENE, RESOURCE_ENVIRONMENT };

struct resource_info {
    const char *noun;   /* in messages: "scene" */
    const char *folder; /* in the state directory, and the route below /v1/ */
    const char *job;    /* what the decoder is asked for */
    int blob_version;   /* what is stored with another one is removed */
    enum error_code broken;
    const char *const *list_members; /* of a summary: those that the list shows; ended by NULL */
};
const struct resource_info *resource_info(enum resource_kind kind);

#endif
