/* SPDX-License-Identifier: MIT */
/* Maps that the renderer has, and those that it let go since the last sweep. */
#include "server/worker/mapped_environments.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/render_request.h"
#include "renderer/environment/environment_blob.h"
#include "server/base/ipc.h"

struct mapped_environment {
    struct mapped_environment *next;
    struct environment *environment; /* borrows the blob */
    struct ipc_mapping blob;
    char key[65];
    bool is_attached;
};

struct mapped_environments {
    struct renderer *renderer;
    struct mapped_environment *first;
};

static void mapped_destroy(struct mapped_environment *mapped)
{
    environment_destroy(mapped->environment);
    ipc_mapping_finish(&mapped->blob);
    free(mapped);
}

static void released(void *context)
{
    struct mapped_environment *mapped = context;
    mapped->is_attached = false;
}

struct mapped_environments *mapped_environments_create(struct renderer *renderer, struct error *err)
{
    struct mapped_environments *environments = calloc(1, sizeof *environments);
    if (environments)
        environments->renderer = renderer;
    else
        error_set(err, ERROR_NO_MEMORY, "environment maps");
    return environments;
}

void mapped_environments_sweep(struct mapped_environments *environments)
{
    for (struct mapped_environment **at = &environments->first; *at;) {
        struct mapped_environment *mapped = *at;
        if (mapped->is_attached) {
            at = &mapped->next;
            continue;
        }
        *at = mapped->next;
        mapped_destroy(mapped);
    }
}

void mapped_environments_destroy(struct mapped_environments *environments)
{
    if (!environments)
        return;
    for (struct mapped_environment *mapped; (mapped = environments->first);) {
        if (mapped->is_attached)
            renderer_detach_environment(environments->renderer, mapped->key);
        environments->first = mapped->next;
        mapped_destroy(mapped);
    }
    free(environments);
}

bool mapped_environments_attach(struct mapped_environments *environments, const char *key,
                                int blob_fd, struct error *err)
{
    struct renderer_environment_desc desc = {.key = key, .release = released};
    if (!request_environment_is_uploaded(key))
        return true;
    if (renderer_has_environment(environments->renderer, key)) {
        desc.release = NULL; /* there already: it only becomes the most recently used */
        return renderer_attach_environment(environments->renderer, &desc, err);
    }
    struct mapped_environment *mapped = calloc(1, sizeof *mapped);
    if (!mapped)
        return error_set(err, ERROR_NO_MEMORY, "environment map");
    if (ipc_mapping_init(&mapped->blob, blob_fd, err))
        mapped->environment =
            environment_blob_open(mapped->blob.bytes, mapped->blob.size_bytes, err);
    if (!mapped->environment) {
        mapped_destroy(mapped);
        return error_wrap(err, "environment map '%.64s'", key);
    }
    memcpy(mapped->key, key, strnlen(key, sizeof mapped->key - 1));
    mapped->next = environments->first;
    environments->first = mapped;
    desc.environment = mapped->environment;
    desc.context = mapped;
    mapped->is_attached = renderer_attach_environment(environments->renderer, &desc, err);
    return mapped->is_attached;
}

bool mapped_environments_has(const struct mapped_environments *environments, const char *key)
{
    return !request_environment_is_uploaded(key) ||
           renderer_has_environment(environments->renderer, key);
}

void mapped_environments_forget(struct mapped_environments *environments, const char *key)
{
    renderer_detach_environment(environments->renderer, key);
}
