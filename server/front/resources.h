/* SPDX-License-Identifier: MIT */
/* All that clients upload: the state directory and a store of each kind. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_RESOURCES_H
#define VITRAIL_SERVER_FRONT_RESOURCES_H

#include "server/front/resource_store.h"

/* Zeroed = none. The members are borrowed from it. */
struct resources {
    struct state_dir *state;
    struct resource_store *scenes, *environments;
};

/* On failure it is zeroed. */
MUST_CHECK bool resources_init(struct resources *resources, const char *state_dir,
                               const struct log *log, struct error *err);
struct resource_store *resources_store(const struct resources *resources, enum resource_kind kind);
void resources_finish(struct resources *resources); /* accepts zeroed; files stay */

#endif
