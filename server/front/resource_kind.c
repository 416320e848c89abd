/* SPDX-License-Identifier: MIT */
/* The table of kinds. */
#include "server/front/resource_kind.h"

#include <stddef.h>

#include "renderer/environment/environment_blob.h"
#include "renderer/scene/scene_blob.h"

static const char *const scene_members[] = {
    "id",    "name",    "triangles", "material_count", "light_count", "camera_count",
    "bytes", "created", NULL};
static const char *const environment_members[] = {
    "id", "name", "width", "height", "mean_radiance", "bytes", "created", NULL};

const struct resource_info *resource_info(enum resource_kind kind)
{
    static const struct resource_info infos[] = {
        [RESOURCE_SCENE] = {.noun = "scene",
                            .folder = "scenes",
                            .job = "scene",
                            .blob_version = SCENE_BLOB_VERSION,
                            .broken = ERROR_INVALID_SCENE,
                            .list_members = scene_members},
        [RESOURCE_ENVIRONMENT] = {.noun = "environment map",
                                  .folder = "environments",
                                  .job = "environment",
                                  .blob_version = ENVIRONMENT_BLOB_VERSION,
                                  .broken = ERROR_INVALID_ENVIRONMENT,
                                  .list_members = environment_members},
    };
    return &infos[kind];
}
