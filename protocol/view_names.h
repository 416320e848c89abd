/* SPDX-License-Identifier: MIT */
/* The names of a scene's nodes, materials, density grids, animations and variants, to find edits of
 * what is not there. Thread: any, once it is made. */
#ifndef VITRAIL_PROTOCOL_VIEW_NAMES_H
#define VITRAIL_PROTOCOL_VIEW_NAMES_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

struct view_names;

/* From a scene's summary (protocol/scene_summary.h). A list that the summary cut short knows every
 * name. */
struct view_names *view_names_create(json_t *summary, struct error *err);
void view_names_destroy(struct view_names *names); /* accepts NULL */

enum view_name_kind {
    VIEW_NAME_NODE,
    VIEW_NAME_MATERIAL,
    VIEW_NAME_GRID,
    VIEW_NAME_ANIMATION,
    VIEW_NAME_VARIANT,
    VIEW_NAME_KIND_COUNT
};

/* False only when the scene certainly has no such thing; "#12" is the one with index 12. */
bool view_names_may_have(const struct view_names *names, enum view_name_kind kind,
                         const char *name);

/* True only when the scene certainly has something of that name. */
bool view_names_has(const struct view_names *names, enum view_name_kind kind, const char *name);

/* The names as 'A', 'B', as many as there is room for; "" where there are none. */
void view_names_list(const struct view_names *names, enum view_name_kind kind, char *text,
                     size_t size_bytes);

#endif
