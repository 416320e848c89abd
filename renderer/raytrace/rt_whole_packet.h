/* SPDX-License-Identifier: MIT */
/* Pixels of one sample whose packet of rays sees sheets and one opaque mesh: surfaces are lit and
 * layers composited for all of its rays together, as they lie in the packet, with the bits of
 * rt_whole's. Internal to rt_batch. Thread: one per batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_PACKET_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_PACKET_H

#include "renderer/raytrace/rt_whole.h"

/* After rt_packet_seek, before its crossings are spread. pixels: of each ray. Writes pixels, and
 * returns 1 << lane of those; 0 where too few are of this kind. */
uint32_t rt_wholes_take_packet(struct rt_batch *batch, struct rt_packet *packet,
                               const struct rt_wide_rays *rays, const int (*pixels)[2]);

#endif
