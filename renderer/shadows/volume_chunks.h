/* SPDX-License-Identifier: MIT */
/* Edges of the casters of shadow volumes, in chunks that storage blocks have room for. CPU only.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUME_CHUNKS_H
#define VITRAIL_RENDERER_SHADOWS_VOLUME_CHUNKS_H

#include "renderer/shadows/volume_casters.h"

/* Finds edges, sides, parts and chunks of the triangles, which stay in their order. faces_most: as
 * volume_casters_init has it. What is left after a failure volume_casters_finish frees. */
MUST_CHECK bool volume_chunks_find(struct volume_casters *casters, uint64_t faces_most,
                                   struct error *err);

#endif
