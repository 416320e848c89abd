/* SPDX-License-Identifier: MIT */
/* The table of kinds, and a store for each. */
#include "server/front/resources.h"

#include "renderer/scene/scene_blob.h"

static const char *const scene_members[] = {
    "id",    "name",    "triangles", "material_count", "light_count", "camera_count",
    "bytes", "created", NULL};

static const struct resource_kind scene_kind = {.noun = "scene",
                                                .folder = "scenes",
                                                .blob_version = SCENE_BLOB_VERSION,
                                                .list_members = scene_members};

static struct resource_store *open_store(const struct resources *resources,
                                         const struct resource_kind *kind, const struct log *log,
                                         struct error *err)
{
    return resource_store_create(
        &(struct resource_store_desc){.state = resources->state, .kind = kind, .log = log}, err);
}

bool resources_init(struct resources *resources, const char *state_dir, const struct log *log,
                    struct error *err)
{
    *resources = (struct resources){.state = state_dir_create(state_dir, err)};
    if (resources->state && (resources->scenes = open_store(resources, &scene_kind, log, err)))
        return true;
    resources_finish(resources);
    return false;
}

void resources_finish(struct resources *resources)
{
    resource_store_destroy(resources->scenes);
    state_dir_destroy(resources->state);
    *resources = (struct resources){0};
}
