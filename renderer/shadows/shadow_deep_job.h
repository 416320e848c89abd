/* SPDX-License-Identifier: MIT */
/* The deep shadow maps being built, as the steps of their construction share them: every step is
 * one dispatch over all of them, cut where a storage block of the device ends. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_JOB_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_JOB_H

#include "renderer/shadows/shadow_deep.h"

enum {
    DEEP_RUN = 32,           /* longer lists are merged from runs of this many */
    DEEP_LONGEST = 60000,    /* llvmpipe ends all loops of a thread after 65,535 iterations; merging
                                needs one per event */
    DEEP_SCRATCH_BYTES = 16, /* per event that is merged; 4 more for its object and its medium */
    DEEP_TILE = 2048, /* counts of a light that a group of a scan takes: shadow_scan.comp.glsl */
};

struct deep_slot {
    struct shadow_build *build;
    uint32_t first_tile;
    uint32_t *texels; /* host scan: those of `shortest` or more events, by class */
};

/* Slots side by side whose heads, and whose counts, one storage block takes. Their lists of texels
 * lie together, all of a class beside each other: builder->table has for each class and slot the
 * first, from lists_first on, and then their number. */
struct deep_group {
    size_t first, count;
    struct shadow_range heads, counts;
    uint32_t table;       /* its first word in builder->table */
    uint64_t lists_first; /* in builder->texels */
};

struct deep_job {
    struct shadow_builder *builder;
    const struct shadow_scene *scene;
    const char *because;
    bool has_no_lists; /* offsets are all that is asked for: nothing is to be sorted */
    bool is_guessed; /* statistics are the room of the lights, not their sizes, which stay in ... */
    uint64_t first_guess; /* ... the records from this one on */

    struct deep_slot *slots; /* the deep shadow maps, those of like streams side by side */
    struct deep_statistics *statistics; /* per slot; and what their lists have room for */
    size_t count;
    struct deep_group *groups;
    size_t group_count;
    uint32_t *table; /* as builder->table */
    uint32_t tiles;  /* of all slots */
};

/* The caller has set all up to has_no_lists; builds of other kinds are passed over. Heads and
 * depths must be taken. deep_job_finish accepts half-built jobs. */
MUST_CHECK bool deep_job_init(struct deep_job *job, struct shadow_build *builds, size_t count,
                              struct error *err);
void deep_job_finish(struct deep_job *job);

bool deep_is_built(const struct shadow_map *map); /* it is a deep shadow map of exact lists */
/* Events from which on a list must be finished: a single one is, where nothing acts behind it. */
uint32_t deep_job_shortest(const struct deep_job *job, size_t slot);
void deep_job_begin(const struct deep_job *job, const char *pass);

/* What shaders know of the lights, to builder->lights: anew once they have their events. */
MUST_CHECK bool deep_job_upload(const struct deep_job *job, struct error *err);
/* Lays the lists of texels out by job->statistics: table and groups; how many there are. */
MUST_CHECK bool deep_job_lay_out(struct deep_job *job, uint64_t *lists, struct error *err);
/* The lists of a class of some slots of a group, from *first on; their number. */
uint32_t deep_group_lists(const struct deep_job *job, const struct deep_group *group, int class_,
                          size_t slot, size_t slots, uint32_t *first);
/* Binds the lists of a group. */
void deep_group_bind_lists(const struct deep_job *job, const struct deep_group *group,
                           uint32_t binding);

void deep_free_transient(struct shadow_builder *builder); /* what a build needs while it lasts */

/* Dispatches so many groups and slices of them, over two dimensions if one is too short. */
void deep_dispatch_groups(uint64_t groups, uint32_t slices);
/* Dispatches so many threads, in groups of 64. */
void deep_dispatch(uint32_t threads);

/* Sums the counts of every light into job->statistics: the one readback of a build. Of a guessed
 * one into its records, which nobody waits for. */
MUST_CHECK bool deep_scan_sum(struct deep_job *job, struct error *err);
/* Turns counts into heads and fills builder->texels with the lists of the groups. Lights without
 * room have empty lists then. */
MUST_CHECK bool deep_scan_place(struct deep_job *job, struct error *err);

/* Makes room for lists of texels and scratch memory. */
MUST_CHECK bool deep_sort_reserve(struct deep_job *job, struct error *err);
MUST_CHECK bool deep_sort(struct deep_job *job, struct error *err);

/* The programs of a scan on the device, and of sorting lists of any length for maps with such
 * flags. on_host: as builder->scans_on_host. Thread: any. */
void deep_scan_list_programs(struct program_list *list);
void deep_sort_list_programs(uint32_t map_flags, bool on_host, struct program_list *list);

#endif
