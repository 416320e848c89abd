/* SPDX-License-Identifier: MIT */
/* Lists of indices, and the unrolling of strips, fans and loops into lists. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_TOPOLOGY_H
#define VITRAIL_RENDERER_IMPORT_TOPOLOGY_H

#include <stdint.h>

#include "protocol/error.h"

/* Zeroed = empty; kept and emptied between uses by setting count to 0. */
struct index_list {
    uint32_t *values; /* owned */
    uint32_t count, capacity;
};

void index_list_finish(struct index_list *list);
MUST_CHECK bool index_list_reserve(struct index_list *list, uint64_t count,
                                   struct error *err); /* ERROR_TOO_LARGE */
MUST_CHECK bool index_list_append_sequence(struct index_list *list, uint32_t count,
                                           struct error *err); /* 0, 1, 2 ... */

/* Replaces the corners of a glTF primitive of `mode` (0 to 6) by those of points, lines or
 * triangles, in the winding of glTF 2.0 specification 3.7.2.1; corners that complete no line or
 * triangle are left out. *topology is an enum scene_topology. */
MUST_CHECK bool topology_unroll(struct index_list *corners, int mode, uint32_t *topology,
                                struct error *err);

#endif
