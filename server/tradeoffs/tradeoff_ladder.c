/* SPDX-License-Identifier: MIT */
/* Every combination that can differ, sorted by its distance from the default. */
#include "server/tradeoffs/tradeoff_ladder.h"

#include <stdio.h>
#include <stdlib.h>

struct rung {
    struct tradeoff_setting setting;
    int distance, order; /* steps from the default; order of making, so that sorting is stable */
};

struct rungs {
    struct rung items[TRADEOFF_ROWS_MAX];
    int count;
};

static int resolution_distance(int resolution)
{
    return resolution == 1024 ? 0 : resolution == 512 || resolution == 2048 ? 1 : 2;
}

static int taps_distance(int taps)
{
    return taps == 4 ? 0 : taps == 16 ? 3 : 2;
}

static void add(struct rungs *rungs, struct tradeoff_setting setting, int distance)
{
    rungs->items[rungs->count] = (struct rung){setting, distance, rungs->count};
    rungs->count++;
}

/* Samples of the rasteriser that are open, or the one that was said. */
static int raster_samples(const struct ladder_desc *desc, int samples[2])
{
    int count = 0;
    for (int s = 1; s <= desc->max_samples; s *= 4)
        if (!desc->fixed->samples || desc->fixed->samples == s)
            samples[count++] = s;
    return count;
}

static void add_maps(struct rungs *rungs, const struct ladder_desc *desc,
                     enum shadow_technique shadows, int distance)
{
    static const int all_taps[] = {1, 4, 9, 16};
    const struct request_quality *fixed = desc->fixed;
    int samples[2], sample_count = raster_samples(desc, samples);
    for (int s = 0; s < sample_count; s++)
        for (int r = 256; r <= 4096; r *= 2)
            for (int t = 0; t < 4; t++) {
                int resolution = fixed->says_shadow_resolution ? fixed->shadow_resolution : r;
                int taps = fixed->says_shadow_taps ? fixed->shadow_taps : all_taps[t];
                if ((fixed->says_shadow_resolution && r > 256) || (fixed->says_shadow_taps && t))
                    continue; /* once */
                int steps = (fixed->says_shadow_resolution ? 0 : resolution_distance(r)) +
                            (fixed->says_shadow_taps ? 0 : taps_distance(taps)) + (samples[s] == 1);
                bool is_deep = shadows == SHADOWS_DEEP;
                add(rungs,
                    (struct tradeoff_setting){shadows, resolution, taps, samples[s],
                                              is_deep ? fixed->shadow_compression : 0,
                                              is_deep ? fixed->shadow_prefilter : 0},
                    distance + steps);
            }
}

/* Compressed and averaged lists beside the exact ones, where nothing is said of them. */
static void add_approximate(struct rungs *rungs, const struct ladder_desc *desc)
{
    static const struct {
        double compression;
        int resolution, prefilter;
    } lists[] = {{0.02, 1024, 1}, {0.02, 512, 2}, {0.02, 256, 4}, {0.05, 512, 4}, {0.005, 1024, 2}};
    const struct request_quality *fixed = desc->fixed;
    int samples[2], sample_count = raster_samples(desc, samples);
    if (fixed->shadow_compression > 0 || fixed->shadow_prefilter > 1)
        return;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        if (sample_count &&
            (!fixed->says_shadow_resolution || fixed->shadow_resolution == lists[i].resolution))
            add(rungs,
                (struct tradeoff_setting){SHADOWS_DEEP, lists[i].resolution,
                                          fixed->says_shadow_taps ? fixed->shadow_taps : 4,
                                          samples[sample_count - 1], lists[i].compression,
                                          lists[i].prefilter},
                i < 3 ? 1 : 2);
}

static void add_bare(struct rungs *rungs, const struct ladder_desc *desc, int distance)
{
    int samples[2], count = raster_samples(desc, samples);
    for (int s = 0; s < count; s++)
        add(rungs, (struct tradeoff_setting){.shadows = SHADOWS_NONE, .samples = samples[s]},
            distance + (samples[s] == 1));
}

static void add_traced(struct rungs *rungs, const struct ladder_desc *desc)
{
    for (int s = 1; s < desc->reference_samples; s *= 4)
        if (!desc->fixed->samples || desc->fixed->samples == s)
            add(rungs, (struct tradeoff_setting){.shadows = SHADOWS_RAYTRACED, .samples = s},
                s > 4 ? 4 : 1);
}

/* Rays in place of maps, under the rasteriser's surfaces. */
static void add_traced_shadows(struct rungs *rungs, const struct ladder_desc *desc)
{
    int samples[2], count = raster_samples(desc, samples);
    for (int s = 0; s < count; s++)
        add(rungs,
            (struct tradeoff_setting){.shadows = SHADOWS_RAYTRACED_SHADOWS, .samples = samples[s]},
            1 + (samples[s] == 1));
}

static bool is_open(const struct ladder_desc *desc, enum shadow_technique shadows)
{
    return desc->fixed->shadows == SHADOWS_AUTO || desc->fixed->shadows == shadows;
}

static void add_shadows(struct rungs *rungs, const struct ladder_desc *desc,
                        struct tradeoff *tradeoff)
{
    bool is_clear = !desc->has_transparent_casters;
    if (is_clear && desc->fixed->shadows == SHADOWS_AUTO)
        tradeoff_skip(tradeoff, "deep, deep-linked",
                      "nothing transparent casts a shadow, so a plain map holds the same");
    if (is_open(desc, SHADOWS_RAYTRACED_SHADOWS) && !desc->has_linked_lists)
        add_traced_shadows(rungs, desc);
    bool wants_deep = !is_clear || desc->fixed->shadows != SHADOWS_AUTO;
    if (wants_deep && is_open(desc, SHADOWS_DEEP))
        add_maps(rungs, desc, SHADOWS_DEEP, 0);
    if (!is_clear && is_open(desc, SHADOWS_DEEP))
        add_approximate(rungs, desc);
    if (is_open(desc, SHADOWS_MAP))
        add_maps(rungs, desc, SHADOWS_MAP, is_clear ? 0 : 3);
    if (wants_deep && is_open(desc, SHADOWS_DEEP_LINKED))
        add_maps(rungs, desc, SHADOWS_DEEP_LINKED, 4);
}

static int compare_rungs(const void *left, const void *right)
{
    const struct rung *a = left, *b = right;
    return a->distance != b->distance ? a->distance - b->distance : a->order - b->order;
}

int tradeoff_ladder(const struct ladder_desc *desc,
                    struct tradeoff_setting settings[TRADEOFF_ROWS_MAX], struct tradeoff *tradeoff)
{
    struct rungs rungs = {.count = 0};
    if (is_open(desc, SHADOWS_RAYTRACED))
        add_traced(&rungs, desc);
    if (is_open(desc, SHADOWS_NONE))
        add_bare(&rungs, desc, desc->has_shadows ? 1 : 0);
    if (desc->has_shadows)
        add_shadows(&rungs, desc, tradeoff);
    else
        tradeoff_skip(tradeoff, "map, deep, deep-linked, raytraced-shadows",
                      "no light casts a shadow in this view");
    if (desc->max_samples < 4)
        tradeoff_skip(tradeoff, "4 samples",
                      "the device cannot antialias transparent lists: 1 sample per pixel");
    qsort(rungs.items, (size_t)rungs.count, sizeof rungs.items[0], compare_rungs);
    int count = rungs.count < desc->max_settings ? rungs.count : desc->max_settings;
    for (int i = 0; i < count; i++)
        settings[i] = rungs.items[i].setting;
    if (count < rungs.count) {
        char what[64];
        snprintf(what, sizeof what, "%d more settings", rungs.count - count);
        tradeoff_skip(tradeoff, what, "max_settings is %d", desc->max_settings);
    }
    return count;
}
