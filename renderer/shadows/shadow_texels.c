/* SPDX-License-Identifier: MIT */
/* Transparent casters, blended into texels. */
#include "renderer/shadows/shadow_texels.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/shadow_casters.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_pack.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static const struct shadow_range *texels_of(const struct shadow_map *map)
{
    return &map->texels;
}

void shadow_texels_list_programs(const struct shadow_pass *pass,
                                 const struct shadow_listing *listing, struct program_list *list)
{
    struct caster_view view = listing->view;
    view.pass = pass->casters[view.map->is_faithful];
    view.is_layered &= !caster_pass_is_ordered(view.pass);
    caster_list_programs(&view, listing->casters, pass->name, false, list);
}

void shadow_texels_describe(struct shadow_map *map, const struct shadow_casters *casters,
                            const struct view_quality *quality, double allowed_error)
{
    (void)casters;
    (void)allowed_error;
    map->is_faithful = quality->faithful;
}

bool shadow_texels_is_exact(const struct view_quality *quality)
{
    (void)quality;
    return false; /* between transparent casters */
}

/* The builds of the structure, into `some`. */
static size_t gather(const struct shadow_building *building, struct shadow_build **some)
{
    size_t count = 0;
    for (size_t i = 0; i < building->count; i++)
        if (building->builds[i].map->method->structure == building->structure)
            some[count++] = &building->builds[i];
    return count;
}

static bool take_texels(struct shadow_store *store, struct shadow_build *const *builds,
                        size_t count, struct error *err)
{
    for (size_t i = 0; i < count; i++) {
        struct shadow_map *map = builds[i]->map;
        if (!shadow_store_take(store, SHADOW_POOL_TEXELS, shadow_map_layered_texels(map),
                               &map->texels, err))
            return false;
    }
    return shadow_store_reserve_colors(store, err);
}

/* Maps of which a layer is painted: themselves, or their layers as maps of their own. */
struct layer_work {
    struct shadow_build **builds;
    struct shadow_build *parts;
    struct shadow_map *maps;
    size_t count;
};

static void finish_parts(struct layer_work *work)
{
    for (size_t i = 0; i < work->count; i++)
        if (work->parts && work->builds[i] == &work->parts[i])
            shadow_casters_finish(&work->parts[i].casters);
    work->count = 0;
}

static void finish_work(struct layer_work *work)
{
    finish_parts(work);
    free(work->builds);
    free(work->parts);
    free(work->maps);
}

static bool init_work(struct layer_work *work, size_t count, struct error *err)
{
    *work = (struct layer_work){.builds = calloc(count, sizeof *work->builds),
                                .parts = calloc(count, sizeof *work->parts),
                                .maps = calloc(count, sizeof *work->maps)};
    return (work->builds && work->parts && work->maps) ||
           error_set(err, ERROR_NO_MEMORY, "%zu lights", count);
}

/* Of the casters those of partitions from `first` to `last`, both included. */
static void select_casters(struct shadow_casters *casters, const uint32_t *partitions,
                           uint32_t first, uint32_t last)
{
    size_t count = 0;
    for (size_t i = 0; i < casters->count; i++) {
        if (partitions[i] < first || partitions[i] > last)
            continue;
        casters->items[count] = casters->items[i];
        casters->faces[count++] = casters->faces[i];
    }
    casters->count = count;
}

/* What partition `layer` receives; layer 0, after all, what lies behind the last. The published
 * form draws all casters anew for each, which the target must not keep then. */
static bool add_part(struct layer_work *work, const struct shadow_build *build, uint32_t layer,
                     struct error *err)
{
    struct shadow_map *map = &work->maps[work->count];
    struct shadow_build *part = &work->parts[work->count];
    uint32_t place = layer < build->map->layers ? layer : 0;
    *map = *build->map;
    map->texels.first += place * shadow_map_texels(map);
    *part = *build;
    part->map = map;
    part->placement = (struct draw_placement){0};
    part->casters = (struct shadow_casters){0};
    work->builds[work->count++] = part;
    if (!shadow_casters_copy(&build->casters, &part->casters, err))
        return false;
    select_casters(&part->casters, build->partitions, map->is_faithful ? 0 : layer - 1, layer - 1);
    return true;
}

/* The layer's part of the moments of all casters. */
static bool add_moments(struct layer_work *work, const struct shadow_build *build, uint32_t layer,
                        struct error *err)
{
    struct shadow_map *map = &work->maps[work->count];
    struct shadow_build *part = &work->parts[work->count];
    *map = *build->map;
    map->texels.first += (layer - 1) * shadow_map_texels(map);
    *part = *build;
    part->map = map;
    part->placement = (struct draw_placement){0};
    part->casters = (struct shadow_casters){0};
    work->builds[work->count++] = part;
    return shadow_casters_copy(&build->casters, &part->casters, err);
}

struct ordered_caster {
    double depth; /* of its middle */
    uint32_t item;
    uint8_t faces;
};

static int compare_depths(const void *a, const void *b)
{
    const struct ordered_caster *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth < y->depth ? -1 : 1;
    return x->item < y->item ? -1 : x->item > y->item;
}

double shadow_texels_depth(const struct shadow_frame *frame, const double point[3])
{
    double offset[3];
    vec3_sub(point, frame->origin, offset);
    return frame->shape == SHADOW_ORTHOGRAPHIC ? vec3_dot(frame->axis[2], offset)
                                               : vec3_length(offset);
}

/* From the light on. */
static bool sort_casters(struct shadow_casters *casters, const struct shadow_frame *frame,
                         const struct scene_state *state, struct error *err)
{
    struct ordered_caster *ordered = calloc(casters->count + 1, sizeof *ordered);
    if (!ordered)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow casters", casters->count);
    for (size_t i = 0; i < casters->count; i++)
        ordered[i] = (struct ordered_caster){
            shadow_texels_depth(frame, state->items[casters->items[i]].center), casters->items[i],
            casters->faces[i]};
    qsort(ordered, casters->count, sizeof *ordered, compare_depths);
    for (size_t i = 0; i < casters->count; i++) {
        casters->items[i] = ordered[i].item;
        casters->faces[i] = ordered[i].faces;
    }
    free(ordered);
    return true;
}

/* The build with its casters in the order of their depths. */
static bool add_ordered(struct layer_work *work, const struct shadow_build *build,
                        const struct scene_state *state, struct error *err)
{
    struct shadow_build *part = &work->parts[work->count];
    *part = *build;
    part->placement = (struct draw_placement){0};
    part->casters = (struct shadow_casters){0};
    work->builds[work->count++] = part;
    return shadow_casters_copy(&build->casters, &part->casters, err) &&
           sort_casters(&part->casters, &build->map->frame, state, err);
}

static enum caster_pass pass_of(const struct shadow_building *building,
                                const struct shadow_build *build)
{
    return building->structure->passes[0].casters[build->map->is_faithful];
}

static bool add_whole(struct layer_work *work, struct shadow_build *build,
                      const struct shadow_building *building, struct error *err)
{
    if (caster_pass_is_ordered(pass_of(building, build)))
        return add_ordered(work, build, building->scene->state, err);
    work->builds[work->count++] = build;
    return true;
}

/* The builds that have the layer, from 1 on. */
static bool gather_layer(struct layer_work *work, struct shadow_build *const *builds, size_t count,
                         uint32_t layer, const struct shadow_building *building, struct error *err)
{
    finish_parts(work);
    for (size_t i = 0; i < count; i++) {
        struct shadow_build *build = builds[i];
        uint32_t layers = build->map->layers ? build->map->layers : 1;
        if (layer > layers)
            continue;
        if (!(build->partitions ? add_part(work, build, layer, err)
              : layers > 1      ? add_moments(work, build, layer, err)
                                : add_whole(work, build, building, err)))
            return false;
    }
    return true;
}

/* A layer in all rounds of its pass. Those of partitions add to the one before. */
static bool paint(struct shadow_builder *builder, const struct shadow_building *building,
                  const struct layer_work *work, uint32_t layer, struct error *err)
{
    struct shadow_store *store = builder->store;
    const struct shadow_build *first = work->builds[0];
    enum caster_pass pass = pass_of(building, first);
    bool ok = true, adds = layer > 1 && first->partitions && !first->map->is_faithful;
    for (uint32_t round = 0; ok && round < caster_pass_rounds(pass); round++) {
        const struct caster_paint_desc painting = {.pass = pass,
                                                   .keeps_texels = adds || round > 0,
                                                   .part = layer - 1 + round,
                                                   .builds = work->builds,
                                                   .build_count = work->count,
                                                   .scene = building->scene,
                                                   .store = store};
        ok = caster_painter_paint(builder->painter, &painting, err);
    }
    const struct shadow_pack_desc packing = {.from = &store->colors,
                                             .format = GL_RGBA,
                                             .texel_bytes = 16,
                                             .pool = SHADOW_POOL_TEXELS,
                                             .range = texels_of,
                                             .builds = work->builds,
                                             .build_count = work->count};
    return ok && shadow_pack(store, &packing, err);
}

static bool paint_layers(struct shadow_builder *builder, const struct shadow_building *building,
                         struct shadow_build *const *builds, size_t count, struct error *err)
{
    const struct shadow_map *map = builds[0]->map;
    struct layer_work work;
    bool ok = init_work(&work, count, err);
    gpu_scope_begin(builder->timeline, &(struct gpu_scope_desc){
                                           .pass = building->structure->passes[0].name,
                                           .because = building->because,
                                           .technique = shadow_technique_name((int)map->method->id),
                                           .stage = REPORT_SHADOW});
    for (uint32_t layer = 1; ok; layer++) {
        ok = gather_layer(&work, builds, count, layer, building, err);
        if (ok && !work.count)
            break;
        ok = ok && paint(builder, building, &work, layer, err);
    }
    gpu_scope_end(builder->timeline);
    finish_work(&work);
    return ok;
}

bool shadow_texels_build(struct shadow_builder *builder, const struct shadow_building *building,
                         struct error *err)
{
    struct shadow_build **some = calloc(building->count, sizeof *some);
    size_t count = some ? gather(building, some) : 0;
    bool ok = some || error_set(err, ERROR_NO_MEMORY, "%zu lights", building->count);
    if (count)
        ok = take_texels(builder->store, some, count, err) &&
             paint_layers(builder, building, some, count, err);
    free(some);
    return ok;
}

void shadow_texels_record(const struct shadow_map *map, struct shadow_record *record)
{
    record->head_base = (uint32_t)map->texels.first;
}

void shadow_texels_bind(const struct shadow_store *store)
{
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_TEXELS, 0), UNIT_SHADOW_TEXELS);
}

bool shadow_texels_drop(struct shadow_store *store, struct shadow_map *map, struct error *err)
{
    return shadow_store_free(store, SHADOW_POOL_TEXELS, &map->texels, err);
}

bool shadow_texels_write_table(struct shadow_store *store, struct shadow_map *map,
                               const uint32_t *table, uint64_t words, struct error *err)
{
    const struct gl_buffer_desc desc = {
        .label = "shadow.texels.table", .size_bytes = 4 * words, .data = table};
    struct gl_buffer aside = {0};
    if (!shadow_store_take(store, SHADOW_POOL_HEADS, words, &map->heads, err) ||
        !gl_buffer_init(&aside, &desc, err))
        return false;
    gl_buffer_copy(&aside, 0, &store->pools[SHADOW_POOL_HEADS].streams[0], 4 * map->heads.first,
                   4 * words);
    gl_buffer_finish(&aside);
    return true;
}

void shadow_texels_record_table(const struct shadow_map *map, struct shadow_record *record)
{
    shadow_texels_record(map, record);
    record->event_base = (uint32_t)map->heads.first;
}

void shadow_texels_bind_table(const struct shadow_store *store)
{
    shadow_texels_bind(store);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
}

bool shadow_texels_drop_table(struct shadow_store *store, struct shadow_map *map, struct error *err)
{
    return shadow_store_free(store, SHADOW_POOL_HEADS, &map->heads, err) &&
           shadow_texels_drop(store, map, err);
}
