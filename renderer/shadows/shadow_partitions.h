/* SPDX-License-Identifier: MIT */
/* Partitions of a light's transparent casters for composited shadows (Modisett 2023, 5.1): sets of
 * which none casts a shadow on another of the same, ordered from the light on. What a set casts its
 * shadow on lies in a later one. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_PARTITIONS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_PARTITIONS_H

#include "renderer/shadows/shadow_map.h"

/* Of a light; a map of 512 x 512 texels takes 1 GiB for them. */
#define SHADOW_PARTITIONS_MAX 256u
#define SHADOW_PARTITION_MESHES_MAX (1u << 12) /* whose pairs are compared: a second */
#define SHADOW_NO_PARTITION 0xffffffffu

struct shadow_partitions {
    uint32_t *of_casters; /* of each caster of the light; SHADOW_NO_PARTITION of opaque ones; the
                             caller frees it, also on failure */
    uint32_t count;       /* 1 at least */
    uint32_t wanted;      /* those that a light without a limit had */
    uint32_t crossed;     /* meshes whose boxes meet, or surround, that of another: their middles
                             order them, which may be wrong in parts */
};

struct shadow_partitions_desc {   /* all required */
    const struct shadow_map *map; /* its frame and resolution; faithful: one for each mesh, as
                                     published */
    const struct scene_state *state;
    const struct shadow_casters *casters;
    uint32_t light;
};

/* A mesh is what one node shows. Meshes that overlap no other as the light sees them share a
 * partition, so that as many are needed as lie one behind another. Farther ones than the limit has
 * room for share the last; of the published form they are refused: ERROR_UNSUPPORTED. */
MUST_CHECK bool shadow_partitions_find(struct shadow_partitions *partitions,
                                       const struct shadow_partitions_desc *desc,
                                       struct error *err);

#endif
