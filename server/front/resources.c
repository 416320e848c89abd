/* SPDX-License-Identifier: MIT */
/* A store for each kind. */
#include "server/front/resources.h"

static struct resource_store *open_store(const struct resources *resources, enum resource_kind kind,
                                         const struct log *log, struct error *err)
{
    return resource_store_create(
        &(struct resource_store_desc){.state = resources->state, .kind = kind, .log = log}, err);
}

bool resources_init(struct resources *resources, const char *state_dir, const struct log *log,
                    struct error *err)
{
    *resources = (struct resources){.state = state_dir_create(state_dir, err)};
    if (resources->state && (resources->scenes = open_store(resources, RESOURCE_SCENE, log, err)) &&
        (resources->environments = open_store(resources, RESOURCE_ENVIRONMENT, log, err)))
        return true;
    resources_finish(resources);
    return false;
}

struct resource_store *resources_store(const struct resources *resources, enum resource_kind kind)
{
    return kind == RESOURCE_SCENE ? resources->scenes : resources->environments;
}

void resources_finish(struct resources *resources)
{
    resource_store_destroy(resources->environments);
    resource_store_destroy(resources->scenes);
    state_dir_destroy(resources->state);
    *resources = (struct resources){0};
}
