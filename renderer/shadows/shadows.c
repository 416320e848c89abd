/* SPDX-License-Identifier: MIT */
/* The shadow system: which structure each light needs, and which of them stand already. */
#include "renderer/shadows/shadows.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_key.h"
#include "renderer/shadows/shadow_media.h"
#include "renderer/shadows/shadow_reason.h"
#include "renderer/shadows/shadows_internal.h"
#include "renderer/shadows/technique.h"
#include "renderer/window/time_slice_clock.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

#define DEFAULT_BUDGET_BYTES (2ull << 30)

static bool give_map(struct shadow_system *shadows, struct shadow_map *map, struct error *err)
{
    const struct shadow_structure *structure = map->method->structure;
    return shadow_store_free(&shadows->store, SHADOW_POOL_DEPTHS, &map->depths, err) &&
           (!structure->drop || structure->drop(&shadows->store, map, err));
}

/* A range that cannot be given back for want of memory is only lost until the store is cleared. */
static void drop_map(struct shadow_system *shadows, size_t index)
{
    struct shadow_map *map = shadows->maps[index];
    struct error ignored = {0};
    if (!give_map(shadows, map, &ignored))
        assert(ignored.code == ERROR_NO_MEMORY);
    free(map);
    shadows->maps[index] = shadows->maps[--shadows->map_count];
}

static void drop_map_itself(struct shadow_system *shadows, const struct shadow_map *map)
{
    for (size_t i = 0; i < shadows->map_count; i++)
        if (shadows->maps[i] == map) {
            drop_map(shadows, i);
            return;
        }
}

static bool drop_oldest_map(void *context, uint64_t frames)
{
    struct shadow_system *shadows = context;
    size_t oldest = shadows->map_count;
    for (size_t i = 0; i < shadows->map_count; i++) {
        uint64_t last = shadows->maps[i]->last_frame;
        if (last + frames <= shadows->frame &&
            (oldest == shadows->map_count || last < shadows->maps[oldest]->last_frame))
            oldest = i;
    }
    if (oldest == shadows->map_count)
        return false;
    drop_map(shadows, oldest);
    return true;
}

static void drop_all(struct shadow_system *shadows)
{
    for (size_t i = 0; i < shadows->map_count; i++)
        free(shadows->maps[i]);
    shadows->map_count = 0;
    shadow_store_clear(&shadows->store);
}

struct shadow_system *shadow_system_create(const struct shadow_system_desc *desc, struct error *err)
{
    struct shadow_system *shadows = calloc(1, sizeof *shadows);
    if (!shadows) {
        error_set(err, ERROR_NO_MEMORY, "shadow system");
        return NULL;
    }
    shadows->timeline = desc->timeline;
    shadows->store = (struct shadow_store){
        .limits = desc->limits,
        .budget_bytes = desc->budget_bytes ? desc->budget_bytes : DEFAULT_BUDGET_BYTES,
        .make_room = drop_oldest_map,
        .context = shadows,
        .reserve = desc->reserve,
        .reserve_context = desc->context,
    };
    shadows->painter.programs = desc->programs;
    /* llvmpipe has nothing of fewer calls, and reads the records of draws in a storage buffer more
     * slowly than as attributes: its frames of the demo scene's twelve lights take a tenth longer
     */
    shadows->painter.is_layered =
        desc->limits->has_vertex_layer && (!desc->limits->is_software || desc->layers_faces);
    shadows->builder = (struct shadow_builder){
        .programs = desc->programs,
        .timeline = desc->timeline,
        .store = &shadows->store,
        .painter = &shadows->painter,
        .first_elements = desc->first_linked_elements,
        .refused_locks = desc->refused_locks,
        .scans_on_host = desc->limits->is_software && !desc->scans_on_device,
        .guesses = &shadows->guesses,
    };
    return shadows;
}

static void finish_build(struct shadow_build *build)
{
    shadow_casters_finish(&build->casters);
    free(build->partitions);
    build->partitions = NULL;
}

static void finish_builds(struct shadow_system *shadows)
{
    for (size_t i = 0; i < shadows->build_count; i++)
        finish_build(&shadows->builds[i]);
    shadows->build_count = 0;
}

void shadow_system_destroy(struct shadow_system *shadows)
{
    if (!shadows)
        return;
    finish_builds(shadows);
    drop_all(shadows);
    shadow_builder_finish(&shadows->builder);
    caster_painter_finish(&shadows->painter);
    shadow_guesses_finish(&shadows->guesses);
    gl_texture_finish(&shadows->record_view);
    gl_buffer_finish(&shadows->records);
    free(shadows->maps);
    free(shadows->builds);
    free(shadows->light_maps);
    free(shadows->light_records);
    free(shadows);
}

static bool reserve(void **array, size_t *capacity, size_t count, size_t element, struct error *err)
{
    if (count <= *capacity)
        return true;
    size_t wanted = count < 16 ? 16 : count + count / 2;
    void *grown = realloc(*array, wanted * element);
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow maps", wanted);
    *array = grown;
    *capacity = wanted;
    return true;
}

static bool reserve_lights(struct shadow_system *shadows, size_t count, struct error *err)
{
    size_t capacity = shadows->light_capacity;
    void *maps = shadows->light_maps, *records = shadows->light_records;
    bool ok = reserve(&maps, &capacity, count, sizeof *shadows->light_maps, err);
    shadows->light_maps = maps;
    capacity = shadows->light_capacity;
    ok = ok && reserve(&records, &capacity, count, sizeof *shadows->light_records, err);
    shadows->light_records = records;
    if (!ok)
        return false;
    shadows->light_capacity = capacity;
    shadows->light_count = count;
    for (size_t i = 0; i < count; i++) {
        shadows->light_maps[i] = NULL;
        shadows->light_records[i] = NO_SHADOW;
    }
    return true;
}

static struct shadow_map *find_map(const struct shadow_system *shadows, struct content_key key)
{
    for (size_t i = 0; i < shadows->map_count; i++)
        if (content_key_equals(shadows->maps[i]->key, key))
            return shadows->maps[i];
    return NULL;
}

/* Of the map that the light had last, at this size: for one that takes its place. */
static uint64_t nodes_before(const struct shadow_system *shadows, const struct shadow_map *map)
{
    const struct shadow_map *last = NULL;
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *other = shadows->maps[i];
        if (other->method == map->method && other->is_faithful == map->is_faithful &&
            other->light == map->light && content_key_equals(other->scene, map->scene) &&
            shadow_map_texels(other) == shadow_map_texels(map) &&
            (!last || other->last_frame >= last->last_frame))
            last = other;
    }
    return last ? last->nodes.count : 0;
}

static struct shadow_map *add_map(struct shadow_system *shadows, const struct shadow_map *desc,
                                  struct error *err)
{
    void *maps = shadows->maps;
    bool ok =
        reserve(&maps, &shadows->map_capacity, shadows->map_count + 1, sizeof *shadows->maps, err);
    shadows->maps = maps;
    struct shadow_map *map = ok ? malloc(sizeof *map) : NULL;
    if (!map) {
        error_set(err, ERROR_NO_MEMORY, "shadow map");
        return NULL;
    }
    *map = *desc;
    shadows->maps[shadows->map_count++] = map;
    return map;
}

static bool add_build(struct shadow_system *shadows, struct shadow_map *map, uint32_t light,
                      const struct shadow_casters *casters, struct error *err)
{
    void *builds = shadows->builds;
    bool ok = reserve(&builds, &shadows->build_capacity, shadows->build_count + 1,
                      sizeof *shadows->builds, err);
    shadows->builds = builds;
    if (!ok)
        return false;
    struct shadow_build *build = &shadows->builds[shadows->build_count];
    *build = (struct shadow_build){.map = map, .light = light};
    if (!shadow_casters_copy(casters, &build->casters, err))
        return false;
    shadows->build_count++;
    return true;
}

static bool divide_last(struct shadow_system *shadows, const struct scene_state *state,
                        struct error *err)
{
    struct shadow_build *build = &shadows->builds[shadows->build_count - 1];
    const struct shadow_structure *structure = build->map->method->structure;
    return !structure->divide || structure->divide(build, state, err);
}

/* One whose sizes are not known will do where they come with the picture; else they are read. One
 * that has no room for them is none. */
static struct shadow_map *find_standing(struct shadow_system *shadows, struct content_key key,
                                        bool may_guess)
{
    struct shadow_map *map = find_map(shadows, key);
    if (map && map->guess && !shadow_guess_stands(shadows, map, may_guess)) {
        drop_map_itself(shadows, map);
        return NULL;
    }
    return map;
}

static bool prepare_light(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                          uint32_t light, struct error *err)
{
    const struct scene_state *state = desc->state;
    const struct shadow_need *need = &desc->needs->lights[light];
    const struct shadow_casters *casters = &need->casters;
    struct shadow_map map = {.resolution = shadows->resolution,
                             .light = light,
                             .last_frame = shadows->frame,
                             .progress = shadows->progress ? shadows->progress->number : 0,
                             .scene = shadow_key_of_scene(desc->scene_key)};
    if (!need->has_structure || (desc->is_left_out && desc->is_left_out[light]))
        return true;
    shadow_map_describe(&map, need, state, desc->quality, shadows->allowed_error);
    map.key = shadow_key_of_map(&map, casters, state, (uint32_t)desc->quality->blend_filter);
    struct shadow_map *standing = find_standing(shadows, map.key, desc->frame > 0);
    if (!standing) {
        shadow_media_at(state, casters, &map);
        if (need->method->structure->has_nodes)
            map.expected_nodes = nodes_before(shadows, &map);
        standing = add_map(shadows, &map, err);
        if (!standing)
            return false;
        if (!add_build(shadows, standing, light, casters, err)) {
            drop_map(shadows, shadows->map_count - 1);
            return false;
        }
        if (!divide_last(shadows, state, err))
            return false;
    }
    standing->last_frame = shadows->frame;
    standing->keeps_exact = map.keeps_exact;
    shadows->light_maps[light] = standing;
    return true;
}

struct build_batch { /* builds whose faces share the target */
    struct shadow_build *builds;
    size_t count;
};

/* Whether the target has colours, too. */
static bool has_texels(const struct shadow_system *shadows)
{
    bool has_any = false;
    for (size_t i = 0; i < shadows->build_count; i++)
        has_any |= shadows->builds[i].map->method->structure->has_texels;
    return has_any;
}

/* Layers that the target may have for several builds. A device that has its memory on our own cores
 * pays for each page of it, and gains nothing by many builds at once: there it is small enough to
 * be kept. */
static uint64_t most_layers(const struct shadow_system *shadows)
{
    uint64_t texel_bytes = has_texels(shadows) ? 20 : 4; /* of the target */
    const struct gl_limits *limits = shadows->store.limits;
    uint64_t most_bytes = limits->is_software ? SHADOW_TARGET_KEPT_BYTES : 256ull << 20;
    if (most_bytes > shadows->store.budget_bytes / 4)
        most_bytes = shadows->store.budget_bytes / 4;
    uint64_t face_bytes =
        texel_bytes * (uint64_t)shadows->resolution * (uint64_t)shadows->resolution;
    uint64_t most = most_bytes / face_bytes;
    return most > (uint64_t)limits->max_texture_layers ? (uint64_t)limits->max_texture_layers
                                                       : most;
}

/* As many of the builds from first on as the target may hold at once, and no more than wanted; at
 * least one. */
static struct build_batch next_batch(const struct shadow_system *shadows, size_t first,
                                     uint64_t wanted)
{
    uint64_t most = most_layers(shadows);
    struct build_batch batch = {&shadows->builds[first], 0};
    if (shadows->is_frugal)
        wanted = 1;
    for (uint64_t layers = 0; first + batch.count < shadows->build_count && batch.count < wanted;
         batch.count++) {
        struct shadow_build *build = &batch.builds[batch.count];
        build->target_layer = (uint32_t)layers;
        layers += build->map->frame.face_count;
        if (layers > most && batch.count)
            break;
    }
    return batch;
}

/* What a map takes of a pool for certain. */
static uint64_t known_elements(const struct shadow_map *map, enum shadow_pool_kind kind)
{
    const struct shadow_structure *structure = map->method->structure;
    if (map->flags & SHADOW_FLAG_NODES)
        return 0;
    if (kind == SHADOW_POOL_TEXELS)
        return structure->has_texels ? shadow_map_layered_texels(map) : 0;
    if (kind == SHADOW_POOL_HEADS)
        return structure->has_lists ? shadow_map_texels(map) + 1 : 0;
    return kind == SHADOW_POOL_DEPTHS ? shadow_map_texels(map) : 0;
}

/* What all builds take for certain comes in one piece. */
static bool reserve_pools(struct shadow_system *shadows, struct error *err)
{
    static const enum shadow_pool_kind kinds[] = {SHADOW_POOL_DEPTHS, SHADOW_POOL_HEADS,
                                                  SHADOW_POOL_TEXELS};
    size_t count = shadows->build_count;
    uint64_t *counts = malloc((count + 1) * sizeof *counts);
    bool ok = counts || error_set(err, ERROR_NO_MEMORY, "%zu shadow maps", count);
    for (size_t k = 0; ok && count && k < sizeof kinds / sizeof *kinds; k++) {
        for (size_t i = 0; i < count; i++)
            counts[i] = known_elements(shadows->builds[i].map, kinds[k]);
        ok = shadow_store_reserve(&shadows->store, kinds[k], counts, count, err);
    }
    free(counts);
    return ok;
}

/* Of the structures that need the opaque depths in the target, or do not any more. */
static bool build_lists(struct shadow_builder *builder, const struct build_batch *batch,
                        bool follows_depths, const struct shadow_scene *scene, const char *because,
                        struct error *err)
{
    struct shadow_building building = {
        .builds = batch->builds, .count = batch->count, .scene = scene, .because = because};
    bool ok = true;
    for (size_t i = 0; ok && (building.structure = shadow_structure_at(i)); i++)
        if (building.structure->build && building.structure->follows_depths == follows_depths)
            ok = building.structure->build(builder, &building, err);
    return ok;
}

static bool build_batch(struct shadow_system *shadows, const struct build_batch *batch,
                        const struct shadow_scene *scene, const char *opaque,
                        const char *transparent, struct error *err)
{
    struct shadow_builder *builder = &shadows->builder;
    struct shadow_build *builds = batch->builds;
    if (!shadow_depth_build(builder, builds, batch->count, scene, opaque, err) ||
        !build_lists(builder, batch, false, scene, transparent, err))
        return false;
    return shadow_depth_keep(builder, builds, batch->count, opaque, err) &&
           build_lists(builder, batch, true, scene, transparent, err);
}

/* Lights that have a structure in this frame. */
static size_t count_structures(const struct shadow_system *shadows)
{
    size_t count = 0;
    for (size_t i = 0; i < shadows->light_count; i++)
        count += shadows->light_maps[i] != NULL;
    return count;
}

/* Of the largest batch there may be, so that smaller ones before it leave no target behind that is
 * too small; before pools grow, which take what the budget leaves. */
static bool reserve_target(struct shadow_system *shadows, struct error *err)
{
    uint64_t all = 0, largest = most_layers(shadows);
    for (size_t i = 0; i < shadows->build_count; i++) {
        uint64_t faces = shadows->builds[i].map->frame.face_count;
        all += faces;
        if (faces > largest)
            largest = faces;
    }
    uint64_t layers = all < largest ? all : largest;
    return !layers ||
           (shadow_store_reserve_target(&shadows->store, shadows->resolution, layers, err) &&
            (!has_texels(shadows) || shadow_store_reserve_colors(&shadows->store, err)));
}

static uint64_t first_slice(const struct shadow_prepare_desc *desc)
{
    return !desc->yield ? 0 : desc->first_count ? desc->first_count : 1;
}

/* Why structures are built, the same words in each turn, so that their lines are one. */
static void find_reasons(const struct shadow_system *shadows,
                         const struct shadow_prepare_desc *desc, char opaque[REPORT_TEXT_BYTES],
                         char transparent[REPORT_TEXT_BYTES])
{
    struct shadow_progress *progress = shadows->progress;
    if (!progress || !progress->opaque[0])
        shadow_reasons(shadows->builds, shadows->build_count, desc, opaque, transparent);
    if (!progress)
        return;
    if (progress->opaque[0]) {
        memcpy(opaque, progress->opaque, REPORT_TEXT_BYTES);
        memcpy(transparent, progress->transparent, REPORT_TEXT_BYTES);
    } else {
        memcpy(progress->opaque, opaque, REPORT_TEXT_BYTES);
        memcpy(progress->transparent, transparent, REPORT_TEXT_BYTES);
    }
}

static void tell_built(const struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                       size_t built)
{
    size_t left = shadows->build_count - built, all = count_structures(shadows);
    if (desc->advance && all >= left && all)
        desc->advance(desc->advance_context, (double)(all - left) / (double)all);
}

/* Builds all, or the first of them: the turn ends where urgent frames are due. Where such frames
 * drove out what had been built, so that more is built than there are lights, they wait. */
static bool build_all(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                      struct error *err)
{
    double eye_axes[3][3];
    shadow_eye_axes(desc, eye_axes);
    struct shadow_scene scene = {.gpu = desc->gpu,
                                 .state = desc->state,
                                 .arena = desc->arena,
                                 .blend_filter = (uint32_t)desc->quality->blend_filter,
                                 .grids = desc->grids,
                                 .eye = desc->eye,
                                 .eye_axes = eye_axes};
    struct shadow_progress *progress = shadows->progress;
    char opaque[REPORT_TEXT_BYTES], transparent[REPORT_TEXT_BYTES];
    struct time_slices slices = time_slices_begin(shadows->build_count, first_slice(desc), 1);
    struct time_slice_clock clock = {.timeline = shadows->timeline,
                                     .is_software = shadows->store.limits->is_software};
    size_t first = 0;
    bool ok = shadows->is_frugal || (reserve_target(shadows, err) && reserve_pools(shadows, err));
    bool is_over = false;
    find_reasons(shadows, desc, opaque, transparent);
    while (ok && !is_over && time_slices_next(&slices)) {
        time_slice_clock_begin(&clock);
        for (size_t end = slices.first + slices.count; ok && first < end;) {
            struct build_batch batch = next_batch(shadows, first, end - first);
            if (shadows->is_frugal) /* none larger than this structure's */
                shadow_store_drop_target(&shadows->store);
            ok = build_batch(shadows, &batch, &scene, opaque, transparent, err);
            first += batch.count;
            if (ok)
                tell_built(shadows, desc, first);
        }
        if (!ok || !progress || time_slices_is_last(&slices))
            continue;
        time_slice_clock_end(&clock, &slices);
        is_over =
            progress->built + first <= count_structures(shadows) && yield_point_is_due(desc->yield);
    }
    time_slice_clock_finish(&clock);
    if (ok && progress) {
        progress->built += first;
        progress->is_interrupted = is_over;
        shadows->done_count = first;
    }
    shadow_store_trim_target(&shadows->store);
    return ok;
}

static struct content_key key_of_all(const struct shadow_system *shadows)
{
    struct content_key key = {{0, 0}};
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->light_maps[i])
            key = shadow_key_join(key, shadows->light_maps[i]->key);
    return key;
}

/* What this frame's maps take for certain, before the first of them is built. */
static bool check_size(const struct shadow_system *shadows, struct error *err)
{
    uint64_t depths = 0, heads = 0, colors = 0;
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *map = shadows->maps[i];
        uint64_t texels = map->last_frame == shadows->frame ? shadow_map_texels(map) : 0;
        depths += texels;
        heads += map->method->structure->has_lists ? texels : 0;
        colors += texels && map->method->structure->has_texels ? shadow_map_layered_texels(map) : 0;
    }
    return shadow_store_check_frame(&shadows->store, depths, heads, colors, err);
}

/* Exact lists of these very maps exceeded the budget before: not once more in every frame. */
static bool is_refused(const struct shadow_system *shadows, const struct view_quality *quality)
{
    return quality->shadow_error_allowed > 0 && shadows->allowed_error <= 0 &&
           shadows->light_count > 0 &&
           shadows->store.budget_bytes <= shadows->refused_budget_bytes &&
           content_key_equals(shadows->refused, key_of_all(shadows));
}

static bool prepare_maps(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                         struct error *err)
{
    finish_builds(shadows);
    if (!reserve_lights(shadows, desc->state->light_count, err))
        return false;
    for (size_t i = 0; i < desc->state->light_count; i++)
        if (!prepare_light(shadows, desc, (uint32_t)i, err))
            return false;
    if (is_refused(shadows, desc->quality))
        return error_set(err, ERROR_OVER_BUDGET, "exact shadow lists exceeded the budget before");
    return check_size(shadows, err) && build_all(shadows, desc, err);
}

/* Maps whose construction failed halfway, or did not begin, must not be found again. */
static void drop_builds_from(struct shadow_system *shadows, size_t first)
{
    for (size_t b = first; b < shadows->build_count; b++) {
        drop_map_itself(shadows, shadows->builds[b].map);
        finish_build(&shadows->builds[b]);
    }
    shadows->build_count = first;
    shadows->light_count = 0;
}

static void drop_builds(struct shadow_system *shadows)
{
    drop_builds_from(shadows, 0);
}

int shadow_resolution(const struct view_quality *quality, const struct gl_limits *limits)
{
    int wanted = quality_or(quality->shadow_resolution, SHADOW_RESOLUTION_DEFAULT);
    return wanted < limits->max_texture_size ? wanted : limits->max_texture_size;
}

/* Exact lists, and where the quality allows for an error, compressed ones. Each beside what stands,
 * as many at a time as the clock says, and where they exceed the budget once more in an empty
 * store, one after the other: so that the budget alone decides, by the least that they take. */
enum { ATTEMPTS = 4 };
static bool is_compressed_in(int attempt)
{
    return attempt >= ATTEMPTS / 2;
}

static void begin_attempt(struct shadow_system *shadows, int attempt, double allowed_error)
{
    shadows->is_frugal = attempt % 2 == 1;
    shadows->allowed_error = is_compressed_in(attempt) ? allowed_error : 0;
    if (shadows->is_frugal)
        drop_all(shadows);
}

static bool prepare_within_budget(struct shadow_system *shadows,
                                  const struct shadow_prepare_desc *desc,
                                  struct frame_report *report, struct error *err)
{
    const struct view_quality *quality = desc->quality;
    bool may_compress = quality->shadow_error_allowed > 0 && !shadow_compress_is_asked(quality);
    struct error failure = {0};
    struct content_key exact = {{0, 0}};
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        failure = (struct error){0};
        begin_attempt(shadows, attempt, quality->shadow_error_allowed);
        if (prepare_maps(shadows, desc, &failure)) {
            if (!is_compressed_in(attempt))
                return true;
            shadows->refused = exact;
            shadows->refused_budget_bytes = shadows->store.budget_bytes;
            if (!shadows->progress || !shadows->progress->is_interrupted)
                report_warn(report,
                            "exact shadow lists exceed the budget of %llu bytes: compressed, no "
                            "transmittance farther off than %g",
                            (unsigned long long)shadows->store.budget_bytes,
                            shadows->allowed_error);
            return true;
        }
        bool was_known = attempt == 0 && is_refused(shadows, quality);
        if (!is_compressed_in(attempt))
            exact = key_of_all(shadows);
        drop_builds(shadows);
        if (failure.code != ERROR_OVER_BUDGET || (attempt + 1 == ATTEMPTS / 2 && !may_compress))
            break;
        if (was_known)
            attempt = ATTEMPTS / 2 - 1;
    }
    shadows->refused = (struct content_key){{0, 0}};
    return error_pass(err, &failure);
}

/* One turn. *is_interrupted: it ended before all structures stood. */
static bool prepare_turn(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                         bool *is_interrupted, struct frame_report *report, struct error *err)
{
    struct shadow_prepare_desc complete = *desc;
    struct shadow_needs own = {0};
    shadows->frame++;
    shadows->resolution = shadow_resolution(desc->quality, shadows->store.limits);
    shadows->taps = shadow_technique_taps(desc->quality->shadows, desc->quality->shadow_taps);
    const struct shadow_needs_desc needs_desc = {
        .state = desc->state, .quality = desc->quality, .resolution = shadows->resolution};
    if (!desc->needs && !shadow_needs_init(&own, &needs_desc, err))
        return false;
    if (!desc->needs)
        complete.needs = &own;
    shadows->builder.may_guess = desc->frame > 0;
    bool ok = prepare_within_budget(shadows, &complete, report, err);
    shadow_needs_finish(&own);
    *is_interrupted = ok && shadows->progress && shadows->progress->is_interrupted;
    if (*is_interrupted) {
        drop_builds_from(shadows, shadows->done_count);
        report->counts.shadow_maps_built += shadows->build_count;
        shadow_report_casters(shadows, desc->state, report);
        finish_builds(shadows);
        return true;
    }
    if (!ok || !shadow_records_upload(shadows, desc, err) || !shadow_sizes_use(shadows, desc, err))
        return false;
    shadow_report_fill(shadows, report);
    shadow_report_casters(shadows, desc->state, report);
    if (!desc->is_left_out)
        shadow_system_warn(report);
    return true;
}

bool shadow_system_prepare(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                           struct frame_report *report, struct error *err)
{
    struct shadow_progress progress = {.number = 0};
    bool is_interrupted, ok;
    if (desc->yield)
        progress.number = ++shadows->progresses;
    do {
        progress.is_interrupted = false;
        shadows->progress = desc->yield ? &progress : NULL; /* urgent frames have none */
        ok = prepare_turn(shadows, desc, &is_interrupted, report, err);
        shadows->progress = NULL;
    } while (ok && is_interrupted && (ok = yield_point_run(desc->yield, err)));
    return ok;
}

bool shadow_system_prepare_none(struct shadow_system *shadows, size_t light_count,
                                struct error *err)
{
    shadows->frame++;
    shadows->defines[0] = 0;
    finish_builds(shadows);
    return reserve_lights(shadows, light_count, err);
}

struct shadow_ways shadow_system_ways(const struct shadow_system *shadows)
{
    return (struct shadow_ways){.scans_on_host = shadows->builder.scans_on_host,
                                .layers_faces = shadows->painter.is_layered};
}

uint64_t shadow_system_budget_bytes(const struct shadow_system *shadows)
{
    return shadows->store.budget_bytes;
}

void shadow_system_set_budget(struct shadow_system *shadows, uint64_t budget_bytes)
{
    shadows->store.budget_bytes = budget_bytes;
    if (shadow_store_size_bytes(&shadows->store) <= budget_bytes)
        return;
    finish_builds(shadows);
    drop_all(shadows);
    shadows->light_count = 0; /* the frame's maps were among them */
}

uint64_t shadow_system_peak_bytes(const struct shadow_system *shadows)
{
    return shadows->store.peak_bytes + shadows->records.size_bytes;
}

uint32_t shadow_system_record(const struct shadow_system *shadows, size_t light)
{
    return light < shadows->light_count ? shadows->light_records[light] : NO_SHADOW;
}

bool shadow_system_holds_grids(const struct shadow_system *shadows, size_t light)
{
    return light < shadows->light_count && shadows->light_maps[light] &&
           shadows->light_maps[light]->holds_grids;
}

const char *shadow_system_defines(const struct shadow_system *shadows)
{
    return shadows->defines;
}

void shadow_system_forget(struct shadow_system *shadows, const char *scene_key)
{
    struct content_key scene = shadow_key_of_scene(scene_key);
    for (size_t i = shadows->map_count; i-- > 0;)
        if (content_key_equals(shadows->maps[i]->scene, scene))
            drop_map(shadows, i);
    finish_builds(shadows);
    shadows->light_count = 0; /* the frame's maps may be among them */
}

void shadow_system_trim(struct shadow_system *shadows)
{
    struct error ignored = {0};
    if (!shadow_store_trim(&shadows->store, &ignored))
        drop_all(shadows); /* no memory for a smaller pool: the structures are made anew */
    finish_builds(shadows);
    shadows->light_count = 0; /* the frame's maps may have been among them */
}

void shadow_system_trim_unused(struct shadow_system *shadows)
{
    while (drop_oldest_map(shadows, 1))
        continue;
    shadow_system_trim(shadows);
}

uint64_t shadow_system_size_bytes(const struct shadow_system *shadows)
{
    return shadow_store_size_bytes(&shadows->store) + shadows->records.size_bytes;
}
