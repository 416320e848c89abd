/* SPDX-License-Identifier: MIT */
/* `moments`: of each texel and colour four moments of the absorbance over depth, and its sum.
 * Muenstermann, Krumpen, Klein and Peters 2018, "Moment-Based Order-Independent Transparency"
 * (I3D), whose moments of what the camera sees stand here in the space of a light, as those of
 * Peters, Muenstermann, Wetzstein and Klein 2016, "Beyond hard shadows: moment shadow maps for
 * single scattering, soft shadows and translucent occluders" (I3D). Memory is the same for any
 * number of casters; what they cannot tell is between three and more depths of a texel. */
#include "renderer/base/matrix.h"
#include "renderer/frame_report.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/shadow_texels.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

#include <math.h>
#include <string.h>

enum { PARTS = SHADOW_PART_TOTAL + 1, TABLE_WORDS = 3 };

static void describe(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error)
{
    (void)quality;
    (void)allowed_error;
    map->has_layers = casters->has_layers;
}

/* What is transparent asks as such: object_of of lighting.glsl. */
static void add_features(struct shadow_features *features, const struct shadow_map *map)
{
    (void)map;
    features->has[SHADOW_FEATURE_PARTITIONS] = true;
}

/* Depths run from the nearest bounding sphere of a transparent caster to the farthest. */
static bool divide(struct shadow_build *build, const struct scene_state *state, struct error *err)
{
    struct shadow_map *map = build->map;
    double nearest = INFINITY, farthest = -INFINITY;
    (void)err;
    for (size_t i = 0; i < build->casters.count; i++) {
        const struct state_item *item = &state->items[build->casters.items[i]];
        if (item->class_ != STATE_TRANSPARENT)
            continue;
        double depth = shadow_texels_depth(&map->frame, item->center);
        nearest = fmin(nearest, depth - item->radius_m);
        farthest = fmax(farthest, depth + item->radius_m);
    }
    if (map->frame.shape != SHADOW_ORTHOGRAPHIC)
        nearest = fmax(nearest, 0);
    map->layers = PARTS;
    map->nearest_m = nearest;
    map->depths_per_m = farthest > nearest ? 2 / (farthest - nearest) : 0;
    return true;
}

static uint32_t word_of(double value)
{
    float rounded = (float)value;
    uint32_t word;
    memcpy(&word, &rounded, sizeof word);
    return word;
}

static bool build(struct shadow_builder *builder, const struct shadow_building *building,
                  struct error *err)
{
    bool ok = true;
    for (size_t i = 0; ok && i < building->count; i++) {
        struct shadow_map *map = building->builds[i].map;
        if (map->method->structure != building->structure)
            continue;
        const uint32_t table[TABLE_WORDS] = {(uint32_t)shadow_map_texels(map),
                                             word_of(map->nearest_m), word_of(map->depths_per_m)};
        ok = shadow_texels_write_table(builder->store, map, table, TABLE_WORDS, err);
    }
    return ok && shadow_texels_build(builder, building, err);
}

static void report(const struct shadow_map *const *maps, size_t count, struct frame_report *report)
{
    size_t lights = 0, layered = 0;
    for (size_t i = 0; i < count; i++) {
        if (!maps[i] || maps[i]->method->structure != &shadow_structure_moments)
            continue;
        lights++;
        layered += maps[i]->has_layers;
    }
    if (layered)
        report_warn(report,
                    "shadows moments: light between three and more transparent surfaces is "
                    "approximate, of %zu of %zu lights; deep is exact",
                    layered, lights);
}

static const struct shadow_pass passes[] = {
    {.name = "shadow.moments",
     .casters = {CASTER_MOMENTS, CASTER_MOMENTS},
     .list_programs = shadow_texels_list_programs},
    {.name = NULL},
};

static const struct shadow_trial trials[] = {
    {"moments", {.shadows = SHADOWS_MOMENTS}},
    {.name = NULL},
};

const struct shadow_structure shadow_structure_moments = {SHADOW_TABLE_STRUCTURE,
                                                          .passes = passes,
                                                          .trials = trials,
                                                          .forecast = forecast_add_maps,
                                                          .forecast_error = forecast_moments_error,
                                                          .texel_bytes = 4 + 16 * PARTS,
                                                          .describe = describe,
                                                          .add_features = add_features,
                                                          .divide = divide,
                                                          .build = build,
                                                          .report = report};

const struct shadow_method shadow_method_moments = {.id = SHADOWS_MOMENTS,
                                                    .structure = &shadow_structure_moments,
                                                    .reused = "shadow.moments",
                                                    .lookup = "moments",
                                                    .otherwise = &shadow_method_map,
                                                    .wants = shadow_wants_transparent};
