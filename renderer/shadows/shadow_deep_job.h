/* SPDX-License-Identifier: MIT */
/* The deep shadow maps being built, as the steps of their construction share them. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_JOB_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_JOB_H

#include "renderer/shadows/shadow_deep.h"

enum {
    DEEP_CLASSES = 16,    /* class c: lists of 2^c + 1 to 2^(c + 1) events; class 0: of 2, and with
                             media of 1 */
    DEEP_RUN = 32,        /* longer lists are merged from runs of this many */
    DEEP_LONGEST = 60000, /* llvmpipe ends all loops of a thread after 65,535 iterations; merging
                             needs one per event */
};

struct deep_statistics { /* of one light; words as shadow_scan.comp.glsl writes them */
    uint32_t total, total_high, longest, occupied;
    uint32_t classes[DEEP_CLASSES]; /* texels per class */
};
enum { DEEP_STATISTIC_WORDS = sizeof(struct deep_statistics) / 4 };

struct deep_job {
    struct shadow_builder *builder;
    struct shadow_build *builds; /* those of other kinds are passed over */
    size_t count;
    const struct shadow_scene *scene;
    const char *because;
    struct deep_statistics *statistics; /* per build */
    uint32_t chunks;                    /* device scan: room for the sums of each build */
    uint32_t **texels; /* host scan: per build, its texels of deep_job_shortest or more events by
                          class */
};

bool deep_job_has(const struct deep_job *job, size_t build); /* it is a deep shadow map */
/* Events from which on a list must be finished: a single one is, where nothing acts behind it. */
uint32_t deep_job_shortest(const struct deep_job *job, size_t build);
void deep_job_begin(const struct deep_job *job, const char *pass);
uint32_t deep_statistics_texels(const struct deep_statistics *statistics); /* of all classes */

void deep_free_transient(struct shadow_builder *builder); /* what a build needs while it lasts */

/* One thread each, in groups of 64. */
void deep_dispatch(uint32_t threads);

/* Sums the counts of every light into job->statistics: the one readback of a build. */
MUST_CHECK bool deep_scan_sum(struct deep_job *job, struct error *err);
/* Turns counts into offsets and fills builder->texels with the class lists, one light after
 * another. */
MUST_CHECK bool deep_scan_place(struct deep_job *job, struct error *err);
void deep_scan_finish(struct deep_job *job);

/* Makes room for class lists and scratch memory. */
MUST_CHECK bool deep_sort_reserve(struct deep_job *job, struct error *err);
MUST_CHECK bool deep_sort(struct deep_job *job, struct error *err);

/* The programs of a scan on the device, and of sorting lists of any length for maps with such
 * flags. Thread: any. */
void deep_scan_list_programs(struct program_list *list);
void deep_sort_list_programs(uint32_t map_flags, struct program_list *list);

#endif
