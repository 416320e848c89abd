/* SPDX-License-Identifier: MIT */
/* What casts shadows, as shadow volumes take it: triangles of one set of vertices, their edges with
 * the vertices opposite to them, and what light loses to each. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUME_CASTERS_H
#define VITRAIL_RENDERER_SHADOWS_VOLUME_CASTERS_H

#include "renderer/base/content_key.h"
#include "renderer/scene/scene_state.h"

struct volume_range {
    size_t first, count;
};

/* Triangles that the device takes at once, with all that they need. Numbers of vertices, sides,
 * triangles and edges are those within the chunk. An edge between triangles of several chunks is
 * in each of these, with the sides that are there: what it counts is the sum. */
struct volume_chunk {
    struct volume_range vertices, edges, sides, triangles, parts;
};

/* Vertices of equal position are one, so that neighbours share their edges. All numbers of vertices
 * rise: that order is the one in which all programs look at an edge or a triangle, and so get the
 * same bits. Any soup of triangles will do; edges may have any number of them. */
struct volume_casters {       /* zeroed: none */
    struct content_key key;   /* of all that it was made of */
    double (*vertices)[3];    /* owned, as all of these; world */
    uint32_t (*edges)[4];     /* low vertex, high vertex, first side, their number */
    uint32_t (*sides)[2];     /* of an edge: the vertex opposite; the triangle */
    uint32_t (*triangles)[4]; /* vertices; the item's number in the state */
    uint32_t (*parts)[2];     /* of edges with more sides than VOLUME_PATCH_QUADS: the edge, which
                                 patch of them, from the second on */
    size_t vertex_count, edge_count, side_count, triangle_count, part_count;
    struct volume_chunk *chunks; /* in the order of all arrays; one at least */
    size_t chunk_count;
};

/* scene_key: of the scene in memory. */
struct content_key volume_casters_key(const struct scene_state *state, const char *scene_key);
/* Takes all that casts shadows in the state, as its clip planes leave it. casters: zeroed.
 * faces_most: edges and triangles of a chunk together; at least VOLUME_FACES_LEAST. */
MUST_CHECK bool volume_casters_init(struct volume_casters *casters, const struct scene_state *state,
                                    uint64_t faces_most, struct error *err);
enum { VOLUME_FACES_LEAST = 4 }; /* of one triangle */
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
/* Casters of one filter are a group, which has a counter of its own. More groups than these have
 * none, and their filters are summed as `volume` does. */
enum { VOLUME_GROUPS_MOST = 24 };
/* Index of the group with this weight among `count` of them; `count`: there is none. */
size_t volume_group_of(const struct volume_weight *groups, size_t count,
                       const struct volume_weight *weight);
/* The groups of all that casts shadows. Returns how many there are; of more than
 * VOLUME_GROUPS_MOST it counts one and keeps none. */
size_t volume_groups_find(const struct scene_state *state, enum view_blend_filter blend,
                          struct volume_weight groups[VOLUME_GROUPS_MOST]);
/* Whether so many groups go with faces that stages of the device draw, which have nothing but
 * counters. Else ERROR_UNSUPPORTED. */
MUST_CHECK bool volume_groups_check(size_t groups, enum view_silhouette_form form,
                                    struct error *err);
/* Of a channel, 0 to 2: the transmittance that it stands for. Of another: 1. */
double volume_weight_filter(const struct volume_weight *weight, int channel);

#endif
