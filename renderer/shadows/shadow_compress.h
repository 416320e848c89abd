/* SPDX-License-Identifier: MIT */
/* Deep shadow maps whose lists are compressed, and, before that, averaged over several rays per
 * texel (Lokovic and Veach 2000, "Deep shadow maps", sections 3.1 and 3.2). Thread: GL.
 *
 * The exact lists are built by shadow_deep.h in memory of their own, at the resolution of the rays,
 * behind the opaque depth of their texel's middle. From the lists of a texel follows its mean
 * visibility, and from that a row of nodes by shaders/shadows/shadow_compress.glsl: at no depth is
 * what they say farther than the map's `compression` from the mean, in any channel. Nodes take the
 * place of events: 16 bytes, depth and rgb. They need neither media (a stretch of a medium becomes
 * lines) nor a second stream; materials without self shadow and those that cast once need exact
 * lists, so lights with these among their casters keep them.
 *
 * Where the exact lists of a light exceed what its budget leaves, the map is built in windows of
 * its rows, each counted, and each built once more to be written: memory is bounded, at the cost of
 * drawing the casters again. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_COMPRESS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_COMPRESS_H

#include "renderer/shadows/shadow_deep.h"

enum { SHADOW_PREFILTER_MAX = 4 };     /* samples per side of a texel */
#define SHADOW_COMPRESSION_LEAST 0.001 /* of a transmittance; the default with a prefilter */
#define SHADOW_COMPRESSION_MOST 0.5
#define SHADOW_NODE_BYTES SHADOW_EVENT_BYTES /* nodes lie where events do */

/* Whether the quality wants deep lists compressed or averaged. */
bool shadow_compress_is_asked(const struct view_quality *quality);

/* What the quality asks of deep lists: fills the map's flags, compression and prefilter. `allowed`:
 * an error that takes the place of exact lists, 0 for none. Leaves maps alone that must be exact.
 */
void shadow_compress_choose(struct shadow_map *map, const struct shadow_casters *casters,
                            const struct view_quality *quality, double allowed);

/* Flags of the exact lists from which the nodes of such a map are made. */
uint32_t shadow_compress_fine_flags(const struct shadow_map *map);
/* The programs that make the nodes of such a map. Thread: any. */
void shadow_compress_list_programs(const struct shadow_map *map, struct program_list *list);

/* Adds a map with SHADOW_FLAG_NODES to what a frame reports. */
void shadow_compress_report(const struct shadow_map *map, struct report_compression *compression);

/* Builds all builds of deep lists with SHADOW_FLAG_NODES, whose opaque casters stand in
 * store->target. Takes their heads and nodes from the store. `because` names the requirement for
 * the report. */
MUST_CHECK bool shadow_compress_build(struct shadow_builder *builder, struct shadow_build *builds,
                                      size_t count, const struct shadow_scene *scene,
                                      const char *because, struct error *err);

#endif
