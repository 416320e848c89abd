/* SPDX-License-Identifier: MIT */
/* Every combination that can differ, sorted by its distance from the default. */
#include "server/tradeoffs/tradeoff_sweep.h"

#include <stdio.h>
#include <stdlib.h>

#include "protocol/quality_defaults.h"

struct swept_setting {
    struct quality_setting setting;
    int distance, order; /* steps from the default; order of making, so that sorting is stable */
};

/* A technique has at most 5 resolutions, 4 numbers of taps, 2 of samples, and compressed lists. */
enum { TECHNIQUE_SETTINGS = 48 };

/* In haze and smoke, each with fewer and with more atmosphere samples than the default, too. */
enum { MEDIA_SETTINGS = 3 };

struct sweep {
    struct swept_setting
        items[(SHADOWS_COUNT * TECHNIQUE_SETTINGS + TRANSPARENCIES_COUNT) * MEDIA_SETTINGS];
    int count;
};

static int resolution_distance(int resolution)
{
    if (resolution == SHADOW_RESOLUTION_DEFAULT)
        return 0;
    return 2 * resolution == SHADOW_RESOLUTION_DEFAULT ||
                   resolution == 2 * SHADOW_RESOLUTION_DEFAULT
               ? 1
               : 2;
}

static int taps_distance(enum shadow_technique shadows, int taps)
{
    return taps == shadow_technique_taps(shadows, 0) ? 0 : taps == 16 ? 3 : 2;
}

static void add(struct sweep *sweep, struct quality_setting setting, int distance)
{
    sweep->items[sweep->count] = (struct swept_setting){setting, distance, sweep->count};
    sweep->count++;
}

/* Samples of the rasteriser that are open, or the one that was said, which may come in rounds. */
static int raster_samples(const struct sweep_desc *desc, int samples[2])
{
    int count = 0, said = desc->fixed->samples;
    for (int s = 1; !said && s <= desc->max_samples; s *= 4)
        samples[count++] = s;
    if (said && said <= SAMPLES_RASTER_MAX)
        samples[count++] = said;
    return count;
}

static void add_maps(struct sweep *sweep, const struct sweep_desc *desc,
                     enum shadow_technique shadows, int distance)
{
    static const int all_taps[][4] = {{1, 4, 9, 16}, {4, 9, 16, 64}}; /* 1: noisy ones */
    bool is_noisy = !shadow_technique_can(shadows, SHADOW_CAN_BE_SMOOTH);
    const struct request_quality *fixed = desc->fixed;
    int samples[2], sample_count = raster_samples(desc, samples);
    for (int s = 0; s < sample_count; s++)
        for (int r = 256; r <= 4096; r *= 2)
            for (int t = 0; t < 4; t++) {
                int resolution = fixed->says_shadow_resolution ? fixed->shadow_resolution : r;
                int taps = fixed->says_shadow_taps ? fixed->shadow_taps : all_taps[is_noisy][t];
                if ((fixed->says_shadow_resolution && r > 256) || (fixed->says_shadow_taps && t))
                    continue; /* once */
                int steps = (fixed->says_shadow_resolution ? 0 : resolution_distance(r)) +
                            (fixed->says_shadow_taps ? 0 : taps_distance(shadows, taps)) +
                            (samples[s] == 1);
                bool can_compress = shadow_technique_has(shadows, SHADOW_HAS_COMPRESSION);
                add(sweep,
                    (struct quality_setting){
                        .shadows = shadows,
                        .shadow_resolution = resolution,
                        .shadow_taps = taps,
                        .samples = samples[s],
                        .shadow_compression = can_compress ? fixed->shadow_compression : 0,
                        .shadow_prefilter = can_compress ? fixed->shadow_prefilter : 0},
                    distance + steps);
            }
}

/* Compressed and averaged lists beside the exact ones, where nothing is said of them. */
static void add_approximate(struct sweep *sweep, const struct sweep_desc *desc,
                            enum shadow_technique shadows)
{
    static const struct {
        double compression;
        int resolution, prefilter;
    } lists[] = {{0.02, SHADOW_RESOLUTION_DEFAULT, 1},
                 {0.02, SHADOW_RESOLUTION_DEFAULT / 2, 2},
                 {0.02, SHADOW_RESOLUTION_DEFAULT / 4, 4},
                 {0.05, SHADOW_RESOLUTION_DEFAULT / 2, 4},
                 {0.005, SHADOW_RESOLUTION_DEFAULT, 2}};
    const struct request_quality *fixed = desc->fixed;
    int samples[2], sample_count = raster_samples(desc, samples);
    if (fixed->shadow_compression > 0 || fixed->shadow_prefilter > 1)
        return;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        if (sample_count &&
            (!fixed->says_shadow_resolution || fixed->shadow_resolution == lists[i].resolution))
            add(sweep,
                (struct quality_setting){.shadows = shadows,
                                         .shadow_resolution = lists[i].resolution,
                                         .shadow_taps = fixed->says_shadow_taps
                                                            ? fixed->shadow_taps
                                                            : SHADOW_TAPS_DEFAULT,
                                         .samples = samples[sample_count - 1],
                                         .shadow_compression = lists[i].compression,
                                         .shadow_prefilter = lists[i].prefilter},
                i < 3 ? 1 : 2);
}

/* Techniques without maps take what the rasteriser has to choose: samples. */
static void add_raster(struct sweep *sweep, const struct sweep_desc *desc,
                       enum shadow_technique shadows, int distance)
{
    int samples[2], count = raster_samples(desc, samples);
    for (int s = 0; s < count; s++)
        add(sweep, (struct quality_setting){.shadows = shadows, .samples = samples[s]},
            distance + (samples[s] == 1));
}

static void add_traced(struct sweep *sweep, const struct sweep_desc *desc,
                       enum shadow_technique shadows, int distance)
{
    int said = desc->fixed->samples;
    for (int s = 1; s < desc->reference_samples; s *= s == 4 && said == 8 ? 2 : 4)
        if (!said || said == s)
            add(sweep, (struct quality_setting){.shadows = shadows, .samples = s},
                distance + (s > 4 ? 3 : 0));
}

static bool is_open(const struct sweep_desc *desc, enum shadow_technique shadows)
{
    return shadows != SHADOWS_AUTO &&
           (desc->fixed->shadows == SHADOWS_AUTO || desc->fixed->shadows == shadows);
}

/* Where nothing transparent casts a shadow, a plain map holds what the others hold, too. */
static void add_shadow_maps(struct sweep *sweep, const struct sweep_desc *desc,
                            enum shadow_technique shadows, int distance)
{
    bool is_clear = !desc->has_transparent_casters;
    bool filters = shadow_technique_can(shadows, SHADOW_CAN_FILTER);
    if (is_clear && filters && desc->fixed->shadows == SHADOWS_AUTO)
        return;
    add_maps(sweep, desc, shadows, is_clear && !filters ? 0 : distance);
    if (!is_clear && shadow_technique_has(shadows, SHADOW_HAS_COMPRESSION))
        add_approximate(sweep, desc, shadows);
}

static void add_technique(struct sweep *sweep, const struct sweep_desc *desc,
                          enum shadow_technique shadows)
{
    int distance = shadow_technique_rows[shadows].distance;
    enum shadow_family family = shadow_technique_family(shadows);
    bool casts = family == SHADOW_FAMILY_MAPS || family == SHADOW_FAMILY_POINTS;
    bool fits = shadow_technique_can(shadows, desc->needs);
    if (!is_open(desc, shadows) || (casts && !(desc->has_shadows && fits)))
        return;
    if (family == SHADOW_FAMILY_RAYS)
        add_traced(sweep, desc, shadows, distance);
    else if (family == SHADOW_FAMILY_MAPS)
        add_shadow_maps(sweep, desc, shadows, distance);
    else
        add_raster(sweep, desc, shadows, casts || desc->has_shadows ? distance : 0);
}

/* Adds family by family, and of each the nearest first: of settings at one distance the first ones
 * stay. */
static void add_all(struct sweep *sweep, const struct sweep_desc *desc)
{
    static const enum shadow_family families[SHADOW_FAMILIES] = {
        SHADOW_FAMILY_RAYS, SHADOW_FAMILY_NONE, SHADOW_FAMILY_POINTS, SHADOW_FAMILY_MAPS};
    int farthest = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (shadow_technique_rows[i].distance > farthest)
            farthest = shadow_technique_rows[i].distance;
    for (int f = 0; f < SHADOW_FAMILIES; f++)
        for (int distance = 0; distance <= farthest; distance++)
            for (int i = 0; i < SHADOWS_COUNT; i++)
                if (shadow_technique_family((enum shadow_technique)i) == families[f] &&
                    shadow_technique_rows[i].distance == distance)
                    add_technique(sweep, desc, (enum shadow_technique)i);
}

static bool is_nearer(const struct swept_setting *one, const struct swept_setting *other)
{
    bool has_map = shadow_technique_has(one->setting.shadows, SHADOW_HAS_MAP);
    if (has_map != shadow_technique_has(other->setting.shadows, SHADOW_HAS_MAP))
        return has_map;
    return one->distance < other->distance;
}

/* The rasteriser's setting that is nearest to the default: that of maps before others. */
static const struct swept_setting *nearest_raster(const struct sweep *sweep)
{
    const struct swept_setting *nearest = NULL;
    for (int i = 0; i < sweep->count; i++) {
        const struct swept_setting *item = &sweep->items[i];
        bool is_raster = shadow_technique_family(item->setting.shadows) != SHADOW_FAMILY_RAYS;
        if (is_raster && (!nearest || is_nearer(item, nearest)))
            nearest = item;
    }
    return nearest;
}

/* The other methods for what is transparent to the camera, each once: what a method changes hardly
 * depends on the shadows. */
static void add_methods(struct sweep *sweep, const struct sweep_desc *desc)
{
    const struct swept_setting *nearest = nearest_raster(sweep);
    if (!nearest || !desc->has_layers || desc->fixed->transparency != TRANSPARENCY_AUTO)
        return;
    unsigned needs = desc->layer_needs;
    if (shadow_technique_family(nearest->setting.shadows) == SHADOW_FAMILY_POINTS)
        needs |= TRANSPARENCY_CAN_TRACED_SHADOWS;
    struct swept_setting base = *nearest;
    for (int i = TRANSPARENCY_LISTS + 1; i < TRANSPARENCIES_COUNT; i++)
        if (!(needs & ~transparency_rows[i].can)) {
            base.setting.transparency = (enum transparency)i;
            add(sweep, base.setting, base.distance + 1);
        }
}

/* ---- haze and density grids ---- */

static bool has_media(const struct sweep_desc *desc)
{
    return desc->needs & (SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS);
}

/* Beside the default. A grid has columns and slices by them; rays in density grids take them as
 * points for each light, of which the default has 8 or 16. */
static void find_atmosphere_samples(const struct sweep_desc *desc, enum shadow_technique shadows,
                                    int *fewer, int *more)
{
    bool has_points =
        shadow_technique_family(shadows) == SHADOW_FAMILY_RAYS && desc->needs & SHADOW_CAN_GRIDS;
    bool has_haze = desc->needs & SHADOW_CAN_ATMOSPHERE;
    *fewer = has_points && !has_haze ? GRID_POINTS_MANY / 2 : ATMOSPHERE_SLICES_FEWER;
    *more = has_points ? has_haze ? ATMOSPHERE_SLICES_DEFAULT : 2 * GRID_POINTS_DEFAULT
                       : ATMOSPHERE_SLICES_MORE;
}

/* Each setting is there with fewer and with more, a step farther from the default. */
static void add_media(struct sweep *sweep, const struct sweep_desc *desc)
{
    int count = sweep->count, said = desc->fixed->atmosphere_samples;
    if (!has_media(desc))
        return;
    for (int i = 0; i < count; i++) {
        struct quality_setting setting = sweep->items[i].setting;
        int distance = sweep->items[i].distance, fewer, more;
        sweep->items[i].setting.atmosphere_samples = said;
        if (said || !desc->has_lights)
            continue;
        find_atmosphere_samples(desc, setting.shadows, &fewer, &more);
        setting.atmosphere_samples = fewer;
        add(sweep, setting, distance + 1);
        setting.atmosphere_samples = more;
        add(sweep, setting, distance + 1);
    }
}

/* ---- what is left out ---- */

/* The names of techniques that can and have all of this, and cast shadows: "map, deep". */
static void list_names(unsigned can, unsigned parameters, char text[SHADOW_TECHNIQUES_TEXT_BYTES])
{
    size_t used = 0;
    text[0] = 0;
    for (int i = 0; i < SHADOWS_COUNT && used < SHADOW_TECHNIQUES_TEXT_BYTES; i++) {
        enum shadow_technique shadows = (enum shadow_technique)i;
        enum shadow_family family = shadow_technique_family(shadows);
        if (shadows != SHADOWS_AUTO &&
            (family == SHADOW_FAMILY_MAPS || family == SHADOW_FAMILY_POINTS) &&
            shadow_technique_can(shadows, can) && shadow_technique_has(shadows, parameters))
            used += (size_t)snprintf(text + used, SHADOW_TECHNIQUES_TEXT_BYTES - used, "%s%s",
                                     used ? ", " : "", shadow_technique_name(i));
    }
}

static void skip_techniques(const struct sweep_desc *desc, struct tradeoff *tradeoff)
{
    char names[SHADOW_TECHNIQUES_TEXT_BYTES];
    if (!desc->has_shadows) {
        list_names(0, 0, names);
        tradeoff_skip(tradeoff, names, "no light casts a shadow in this view");
    } else if (!desc->has_transparent_casters && desc->fixed->shadows == SHADOWS_AUTO) {
        list_names(SHADOW_CAN_FILTER, SHADOW_HAS_RESOLUTION, names);
        tradeoff_skip(tradeoff, names,
                      "nothing transparent casts a shadow, so a plain map holds the same");
    }
}

static void skip_media(const struct sweep_desc *desc, struct tradeoff *tradeoff)
{
    if (has_media(desc) && !desc->has_lights && !desc->fixed->atmosphere_samples)
        tradeoff_skip(tradeoff, "atmosphere_samples", "no light shines in this view");
}

static int compare_settings(const void *left, const void *right)
{
    const struct swept_setting *a = left, *b = right;
    return a->distance != b->distance ? a->distance - b->distance : a->order - b->order;
}

int tradeoff_sweep(const struct sweep_desc *desc,
                   struct quality_setting settings[TRADEOFF_ROWS_MAX], struct tradeoff *tradeoff)
{
    struct sweep sweep = {.count = 0};
    add_all(&sweep, desc);
    add_media(&sweep, desc);
    add_methods(&sweep, desc);
    skip_techniques(desc, tradeoff);
    skip_media(desc, tradeoff);
    if (desc->max_samples < 4 && !desc->fixed->samples)
        tradeoff_skip(tradeoff, "4 samples",
                      "the device cannot antialias transparent lists: 1 sample per pixel");
    qsort(sweep.items, (size_t)sweep.count, sizeof sweep.items[0], compare_settings);
    int count = sweep.count < desc->max_settings ? sweep.count : desc->max_settings;
    if (count > TRADEOFF_ROWS_MAX)
        count = TRADEOFF_ROWS_MAX;
    for (int i = 0; i < count; i++)
        settings[i] = sweep.items[i].setting;
    if (count < sweep.count) {
        char what[64];
        snprintf(what, sizeof what, "%d more settings", sweep.count - count);
        tradeoff_skip(tradeoff, what, "max_settings is %d", desc->max_settings);
    }
    return count;
}
