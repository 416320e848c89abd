/* SPDX-License-Identifier: MIT */
/* Several scenes as one: a base, and parts that hang on nodes. Nodes, materials and the other small
 * tables are joined; vertices, indices and pixels stay where they are. Thread: any; immutable once
 * it is made.
 *
 * What the base has keeps its indices. Parts follow: each begins with a node of the part's name,
 * below which the roots of its scene hang. Inside, names are PART/NAME, and PART/#3 is the thing
 * that has index 3 in the scene of the part. */
#ifndef VITRAIL_RENDERER_SCENE_COMPOSE_H
#define VITRAIL_RENDERER_SCENE_COMPOSE_H

#include "renderer/scene/scene.h"

enum {
    COMPOSE_DEPTH_MAX = 16,      /* parts on parts */
    COMPOSE_NODES_MAX = 1 << 22, /* 1.2 GB of records */
};
#define COMPOSE_TRIANGLES_MAX (1ull << 28) /* drawn, instances counted each time */

struct compose_part {
    const char *name;          /* required, unique; no '/' in it */
    const struct scene *scene; /* required, no composed one; borrowed while the result lives */
    const char *parent;        /* a node of the base or of another part; NULL: no parent */
    uint64_t identity;         /* of the scene's content; not 0 */
};

struct compose_desc {
    const struct scene *base; /* as those of parts */
    const struct compose_part *parts;
    size_t part_count; /* at least 1 */
};

struct composed_scene;

/* Errors: ERROR_NOT_FOUND naming a part and its parent, which is unknown or hangs on the part;
 * ERROR_INVALID_REQUEST for a name that a node has already; ERROR_TOO_LARGE. */
MUST_CHECK struct composed_scene *scene_compose(const struct compose_desc *desc, struct error *err);
void composed_scene_destroy(struct composed_scene *composed); /* accepts half-built and NULL */
const struct scene *composed_scene_get(const struct composed_scene *composed);

#endif
