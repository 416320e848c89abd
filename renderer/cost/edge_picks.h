/* SPDX-License-Identifier: MIT */
/* Edges of a scene's triangles of which some may be of a silhouette: a sample of those of each
 * primitive, picked by how long they are and how far the surface bends there, so that few long
 * edges among many short ones are found. Of the scene alone; what a view shows, and from where,
 * changes nothing. The same scene gives the same picks. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_EDGE_PICKS_H
#define VITRAIL_RENDERER_COST_EDGE_PICKS_H

#include "renderer/base/content_key.h"
#include "renderer/scene/scene.h"

enum { EDGE_IS_BORDER = 0xffffffff }; /* in the place of the last vertex: of one triangle */

struct edge_pick {
    uint32_t vertices[4];  /* of the primitive: its ends, and what its two triangles have besides */
    float weight;          /* edges of the primitive that it stands for */
    double turns, lengths; /* sums of weight * turn and of weight * turn * length (model space) up
                              to and with this pick; turn: of the surface, as sizes have it */
};

struct edge_list { /* of a primitive */
    size_t first, count;
    double turns, lengths; /* of its last pick */
};

struct edge_picks {          /* zeroed = empty */
    struct content_key key;  /* of the scene */
    struct edge_list *lists; /* for each primitive */
    struct edge_pick *picks;
    size_t count;
};

/* Keeps what it has where that is of the same scene. Looks at the edges of 65,536 triangles at most
 * and of a few of each primitive: seven milliseconds. */
MUST_CHECK bool edge_picks_make(struct edge_picks *picks, const struct scene *scene,
                                struct error *err);
void edge_picks_finish(struct edge_picks *picks); /* empty afterwards */

/* A systematic sample by size (Madow 1949, "On the theory of systematic sampling, II"): of what
 * lies one after another along a line, what every step meets. */
struct size_steps {
    double step, next; /* next: from the begin of what is asked for next */
};
struct size_steps size_steps_begin(double total, double wanted);
/* How often steps meet what has that size; it then stands for count * step / size of its like. */
double size_steps_count(struct size_steps *steps, double size);

#endif
