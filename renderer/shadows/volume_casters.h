/* SPDX-License-Identifier: MIT */
/* What casts shadows, as shadow volumes take it: triangles of one set of vertices, their edges with
 * the vertices opposite to them, and what light loses to each. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUME_CASTERS_H
#define VITRAIL_RENDERER_SHADOWS_VOLUME_CASTERS_H

#include "renderer/base/content_key.h"
#include "renderer/scene/scene_state.h"

/* Vertices of equal position are one, so that neighbours share their edges. All numbers of vertices
 * rise: that order is the one in which all programs look at an edge or a triangle, and so get the
 * same bits. Any soup of triangles will do; edges may have any number of them. */
struct volume_casters {       /* zeroed: none */
    struct content_key key;   /* of all that it was made of */
    double (*vertices)[3];    /* owned, as all of these; world */
    uint32_t (*edges)[4];     /* low vertex, high vertex, first side, their number */
    uint32_t (*sides)[2];     /* of an edge: the vertex opposite; the triangle */
    uint32_t (*triangles)[4]; /* vertices; the item's number in the state */
    size_t vertex_count, edge_count, side_count, triangle_count;
};

/* scene_key: of the scene in memory. */
struct content_key volume_casters_key(const struct scene_state *state, const char *scene_key);
/* Takes all that casts shadows in the state, as its clip planes leave it. casters: zeroed. */
MUST_CHECK bool volume_casters_init(struct volume_casters *casters, const struct scene_state *state,
                                    struct error *err);
void volume_casters_finish(struct volume_casters *casters);

/* What light loses to an item: -log2 of each channel's transmittance in units of
 * 2^-VOLUME_WEIGHT_BITS, and bits of the channels that do not pass. */
enum { VOLUME_WEIGHT_BITS = 20 };
struct volume_weight {
    uint32_t log2[3], stops;
};
/* item: of those that caster_filter_is_even knows. */
struct volume_weight volume_weight_of(const struct scene_state *state,
                                      const struct state_item *item, enum view_blend_filter blend);
/* Of a channel, 0 to 2: the transmittance that it stands for. Of another: 1. */
double volume_weight_filter(const struct volume_weight *weight, int channel);

#endif
