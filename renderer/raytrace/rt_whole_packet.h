/* SPDX-License-Identifier: MIT */
/* Pixels whose packet of rays sees sheets and one opaque mesh, told for all of its rays together.
 * Of one sample, surfaces are lit and layers composited as they lie in the packet, with the bits of
 * rt_whole's; of several, pixels whose samples are alike are rt_whole's. Internal to rt_batch.
 * Thread: one per batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_PACKET_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_PACKET_H

#include "renderer/raytrace/rt_whole.h"

/* After rt_packet_seek, before its crossings are spread. pixels: of the packet. Returns 1 << lane
 * of those whose pixels are written, or are to be with rt_wholes_write; 0 where too few are of this
 * kind. */
uint32_t rt_wholes_take_packet(struct rt_batch *batch, struct rt_packet *packet,
                               const struct rt_wide_rays *rays, const int (*pixels)[2]);

#endif
