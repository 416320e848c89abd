/* SPDX-License-Identifier: MIT */
/* The shadow system: which structure each light needs, which of them stand already, and their
 * records for shading. */
#include "renderer/shadows/shadows.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/matrix.h"
#include "renderer/shading/bands.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_key.h"
#include "renderer/shadows/shadow_media.h"
#include "renderer/shadows/shadow_probe.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/shadow_reason.h"
#include "renderer/wall_clock.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

#define DEFAULT_BUDGET_BYTES (2ull << 30)
enum { DEFAULT_RESOLUTION = 1024, DEFAULT_TAPS = 4 };

struct shadow_system {
    struct gpu_timeline *timeline;
    struct shadow_store store;
    struct caster_painter painter;
    struct shadow_builder builder;
    struct shadow_map **maps; /* all that stand, of any scene */
    size_t map_count, map_capacity;
    uint64_t frame;      /* number of the frame being prepared */
    uint64_t progresses; /* number of the last that began */

    /* of the current frame */
    struct shadow_map **light_maps; /* per light, NULL without a shadow */
    uint32_t *light_records;        /* per light, NO_SHADOW without */
    size_t light_count, light_capacity;
    struct shadow_build *builds;
    size_t build_count, build_capacity;
    size_t done_count; /* with a shadow_progress: of builds, those that stand */
    int resolution, taps;
    double allowed_error;       /* of lists that take the place of exact ones; 0: none do */
    struct content_key refused; /* of the maps whose exact lists last exceeded the budget */
    size_t kept_exact;          /* lights that were to be compressed and have lists with objects */
    bool has_cut_lamp;          /* a light stands in too many media, where they are cut away */
    bool has_thick_media;       /* a linked map has media among its casters */
    struct gl_buffer records;
    struct gl_texture record_view;
    char defines[SHADOW_DEFINES_BYTES];
};

static bool give_map(struct shadow_system *shadows, struct shadow_map *map, struct error *err)
{
    struct shadow_store *store = &shadows->store;
    return shadow_store_give(store, SHADOW_POOL_DEPTHS, &map->depths, err) &&
           shadow_store_give(store, SHADOW_POOL_HEADS, &map->heads, err) &&
           shadow_store_give(store, SHADOW_POOL_EVENTS, &map->events, err) &&
           shadow_store_give(store, SHADOW_POOL_NODES, &map->nodes, err);
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
    };
    shadows->painter.programs = desc->programs;
    shadows->builder = (struct shadow_builder){
        .programs = desc->programs,
        .timeline = desc->timeline,
        .store = &shadows->store,
        .painter = &shadows->painter,
        .first_elements = desc->first_linked_elements,
        .scans_on_host = desc->limits->is_software && !desc->scans_on_device,
    };
    return shadows;
}

static void finish_builds(struct shadow_system *shadows)
{
    for (size_t i = 0; i < shadows->build_count; i++)
        shadow_casters_finish(&shadows->builds[i].casters);
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

/* Lists are to be compressed where they can be. */
static bool asks_nodes(const struct shadow_system *shadows, const struct view_quality *quality)
{
    return shadow_compress_is_asked(quality) || shadows->allowed_error > 0;
}

static bool has_cut_lamp(const struct shadow_map *map)
{
    bool is_cut = false;
    for (uint32_t i = 0; i < map->plane_count; i++)
        is_cut |= vec3_dot(map->planes[i], map->frame.origin) + map->planes[i][3] < 0;
    return is_cut && vec3_length(map->sigma) > 0;
}

static bool prepare_light(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                          uint32_t light, struct error *err)
{
    const struct scene_state *state = desc->state;
    const struct shadow_need *need = &desc->needs->lights[light];
    const struct shadow_casters *casters = &need->casters;
    struct shadow_map map = {.resolution = shadows->resolution,
                             .last_frame = shadows->frame,
                             .progress = desc->progress ? desc->progress->number : 0,
                             .scene = shadow_key_of_scene(desc->scene_key)};
    if (!need->has_structure || (desc->is_left_out && desc->is_left_out[light]))
        return true;
    shadow_map_describe(&map, need, state, desc->quality, shadows->allowed_error);
    shadows->kept_exact += casters->has_exclusions && asks_nodes(shadows, desc->quality);
    map.keys_per_m = (float)(SHADOW_KEY_MOST / fmax(casters->farthest_m, 1e-6));
    shadows->has_thick_media |= map.kind == SHADOW_LINKED && casters->has_media;
    map.key = shadow_key_of_map(&map, casters, state, (uint32_t)desc->quality->blend_filter);
    struct shadow_map *standing = find_map(shadows, map.key);
    if (!standing) {
        shadow_media_at(state, casters, &map);
        standing = add_map(shadows, &map, err);
        if (!standing)
            return false;
        if (!add_build(shadows, standing, light, casters, err)) {
            drop_map(shadows, shadows->map_count - 1);
            return false;
        }
    }
    standing->last_frame = shadows->frame;
    shadows->has_cut_lamp |= has_cut_lamp(standing);
    shadows->light_maps[light] = standing;
    return true;
}

struct build_batch { /* builds whose faces share the target */
    struct shadow_build *builds;
    size_t count;
};

/* As many of the builds from first on as the target may hold at once, and no more than wanted; at
 * least one. */
static struct build_batch next_batch(const struct shadow_system *shadows, size_t first,
                                     uint64_t wanted)
{
    uint64_t most_bytes = 256ull << 20;
    if (most_bytes > shadows->store.budget_bytes / 4)
        most_bytes = shadows->store.budget_bytes / 4;
    uint64_t face_bytes = 4ull * (uint64_t)shadows->resolution * (uint64_t)shadows->resolution;
    uint64_t most = most_bytes / face_bytes;
    if (most > (uint64_t)shadows->store.limits->max_texture_layers)
        most = (uint64_t)shadows->store.limits->max_texture_layers;
    struct build_batch batch = {&shadows->builds[first], 0};
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

/* What all builds take for certain comes in one piece. */
static bool reserve_pools(struct shadow_system *shadows, struct error *err)
{
    uint64_t depths = 0, heads = 0;
    for (size_t i = 0; i < shadows->build_count; i++) {
        const struct shadow_map *map = shadows->builds[i].map;
        if (map->flags & SHADOW_FLAG_NODES)
            continue;
        depths += shadow_map_texels(map);
        heads += map->kind == SHADOW_MAP ? 0 : shadow_map_texels(map) + 1;
    }
    return shadow_store_reserve(&shadows->store, SHADOW_POOL_DEPTHS, depths, err) &&
           shadow_store_reserve(&shadows->store, SHADOW_POOL_HEADS, heads, err);
}

static bool build_batch(struct shadow_system *shadows, const struct build_batch *batch,
                        const struct shadow_scene *scene, const char *opaque,
                        const char *transparent, struct error *err)
{
    struct shadow_builder *builder = &shadows->builder;
    struct shadow_build *builds = batch->builds;
    return shadow_depth_build(builder, builds, batch->count, scene, opaque, err) &&
           shadow_deep_build(builder, builds, batch->count, scene, transparent, err) &&
           shadow_compress_build(builder, builds, batch->count, scene, transparent, err) &&
           shadow_linked_build(builder, builds, batch->count, scene, transparent, err);
}

/* Lights that have a structure in this frame. */
static size_t count_structures(const struct shadow_system *shadows)
{
    size_t count = 0;
    for (size_t i = 0; i < shadows->light_count; i++)
        count += shadows->light_maps[i] != NULL;
    return count;
}

/* Of the largest batch, so that smaller ones before it leave no target behind that is too small. */
static bool reserve_target(struct shadow_system *shadows, struct error *err)
{
    struct build_batch batch = next_batch(shadows, 0, shadows->build_count);
    uint64_t layers = 0;
    for (size_t i = 0; i < batch.count; i++)
        layers += batch.builds[i].map->frame.face_count;
    return !layers ||
           shadow_store_reserve_target(&shadows->store, shadows->resolution, layers, err);
}

/* Builds all, or the first of them: others go first then. Where they drove out what had been built,
 * so that more is built than there are lights, they wait. */
static bool build_all(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                      struct error *err)
{
    struct shadow_scene scene = {desc->gpu, desc->state, desc->arena,
                                 (uint32_t)desc->quality->blend_filter};
    struct shadow_progress *progress = desc->progress;
    char opaque[REPORT_TEXT_BYTES], transparent[REPORT_TEXT_BYTES];
    struct bands bands = bands_begin(shadows->build_count, progress ? 1 : 0, 1);
    size_t first = 0;
    bool ok = reserve_pools(shadows, err) && reserve_target(shadows, err), is_over = false;
    shadow_reasons(shadows->builds, shadows->build_count, desc, opaque, transparent);
    while (ok && !is_over && bands_next(&bands)) {
        double begin_ms = wall_ms();
        for (size_t end = bands.first + bands.count; ok && first < end;) {
            struct build_batch batch = next_batch(shadows, first, end - first);
            ok = build_batch(shadows, &batch, &scene, opaque, transparent, err);
            first += batch.count;
        }
        if (!ok || !progress || bands_is_last(&bands))
            continue;
        glFinish();
        bands_took(&bands, wall_ms() - begin_ms);
        is_over = progress->built + first <= count_structures(shadows) &&
                  progress->is_due(progress->context);
    }
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
    uint64_t depths = 0, heads = 0;
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *map = shadows->maps[i];
        uint64_t texels = map->last_frame == shadows->frame ? shadow_map_texels(map) : 0;
        depths += texels;
        heads += map->kind == SHADOW_MAP ? 0 : texels;
    }
    return shadow_store_check_frame(&shadows->store, depths, heads, err);
}

/* Exact lists of these very maps exceeded the budget before: not once more in every frame. */
static bool is_refused(const struct shadow_system *shadows, const struct view_quality *quality)
{
    return quality->shadow_error_allowed > 0 && shadows->allowed_error <= 0 &&
           shadows->light_count > 0 && content_key_equals(shadows->refused, key_of_all(shadows));
}

static bool prepare_maps(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                         struct error *err)
{
    finish_builds(shadows);
    shadows->has_thick_media = shadows->has_cut_lamp = false;
    shadows->kept_exact = 0;
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
        for (size_t i = 0; i < shadows->map_count; i++)
            if (shadows->maps[i] == shadows->builds[b].map) {
                drop_map(shadows, i);
                break;
            }
        shadow_casters_finish(&shadows->builds[b].casters);
    }
    shadows->build_count = first;
    shadows->light_count = 0;
}

static void drop_builds(struct shadow_system *shadows)
{
    drop_builds_from(shadows, 0);
}

/* Rows of eye_from_world. */
static void get_eye_axes(const struct shadow_prepare_desc *desc, double axes[3][3])
{
    memcpy(axes, desc->eye_axes, sizeof desc->eye_axes);
    if (vec3_length(axes[0]) > 0)
        return;
    memset(axes, 0, sizeof desc->eye_axes);
    for (int k = 0; k < 3; k++)
        axes[k][k] = 1;
}

static void fill_record(const struct shadow_system *shadows, const struct shadow_map *map,
                        const struct shadow_prepare_desc *desc, struct shadow_record *record)
{
    const struct shadow_frame *frame = &map->frame;
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    double texel_width = 2 / (frame->scale[0] * map->resolution);
    *record = (struct shadow_record){
        .kind_shape_flags_resolution =
            map->kind | frame->shape << 4 | map->flags << 8 | (uint32_t)shadows->resolution << 16,
        .depth_base = (uint32_t)map->depths.first,
        .head_base = (uint32_t)map->heads.first,
        .event_base = (uint32_t)(map->kind == SHADOW_LINKED ? map->nodes.first : map->events.first),
        .projection = {{(float)frame->scale[0], (float)(is_flat ? frame->scale[1] : texel_width),
                        (float)(is_flat ? frame->depth_m : frame->near_m), map->keys_per_m}},
    };
    for (int k = 0; k < 3; k++)
        record->sigma.v[k] = (float)map->sigma[k];
    vec4 *axes[3] = {&record->axis_x, &record->axis_y, &record->axis_z};
    double from_eye[3], eye_axes[3][3];
    vec3_sub(desc->eye, frame->origin, from_eye);
    get_eye_axes(desc, eye_axes);
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 3; c++)
            axes[k]->v[c] = (float)vec3_dot(frame->axis[k], eye_axes[c]);
        axes[k]->v[3] = (float)vec3_dot(frame->axis[k], from_eye);
    }
}

static bool upload_records(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                           struct error *err)
{
    struct shadow_record *records = calloc(shadows->light_count + 1, sizeof *records);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow records", shadows->light_count);
    uint32_t count = 0;
    for (size_t i = 0; i < shadows->light_count; i++) {
        if (!shadows->light_maps[i])
            continue;
        fill_record(shadows, shadows->light_maps[i], desc, &records[count]);
        shadows->light_records[i] = count++;
    }
    uint32_t old = shadows->records.name;
    bool ok =
        gl_buffer_reserve(&shadows->records,
                          &(struct gl_buffer_desc){.label = "shadow.records",
                                                   .size_bytes = (count + 1) * sizeof *records,
                                                   .is_dynamic = true},
                          false, err);
    if (ok && (shadows->records.name != old || !shadows->record_view.name)) {
        gl_texture_finish(&shadows->record_view);
        ok = gl_texture_init_buffer(&shadows->record_view, "shadow.records", GL_RGBA32UI,
                                    &shadows->records, err);
    }
    if (ok)
        gl_buffer_write(&shadows->records, 0, count * sizeof *records, records);
    free(records);
    return ok;
}

static void set_defines(struct shadow_system *shadows)
{
    struct shadow_features features = {{false}};
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->light_maps[i])
            shadow_features_add(&features, shadows->light_maps[i]);
    shadow_features_write(&features, shadows->defines);
}

static bool is_built_now(const struct shadow_system *shadows, const struct shadow_map *map,
                         const struct shadow_progress *progress)
{
    if (progress && map->progress == progress->number)
        return true;
    for (size_t i = 0; i < shadows->build_count; i++)
        if (shadows->builds[i].map == map)
            return true;
    return false;
}

static uint64_t event_bytes(const struct shadow_map *map)
{
    return SHADOW_EVENT_BYTES + (map->flags & SHADOW_FLAG_RAW ? sizeof(uint32_t) : 0) +
           (map->flags & SHADOW_FLAG_MEDIA ? SHADOW_MEDIUM_BYTES : 0);
}

/* Of the maps that this frame looks up, however much more the pools hold. */
static void report_bytes(const struct shadow_system *shadows, struct frame_report *report)
{
    static const char *const names[] = {"shadow.depth", "shadow.heads", "shadow.deep.events",
                                        "shadow.linked.nodes"};
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *map = shadows->maps[i];
        const uint64_t bytes[] = {4 * map->depths.count, 4 * map->heads.count,
                                  event_bytes(map) * map->events.count, 16 * map->nodes.count};
        for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++)
            if (map->last_frame == shadows->frame && bytes[kind])
                report_add_bytes(report, names[kind], bytes[kind]);
    }
}

static void count_casters(const struct shadow_system *shadows, const struct scene_state *state,
                          struct frame_report *report)
{
    for (size_t i = 0; i < shadows->build_count; i++)
        shadow_casters_count(&shadows->builds[i].casters, shadows->builds[i].map->frame.face_count,
                             state, &report->counts.shadow_draws, &report->counts.shadow_culled);
}

static void report_nodes(const struct shadow_system *shadows, struct frame_report *report)
{
    struct report_compression *c = &report->compression;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        if (!map || !(map->flags & SHADOW_FLAG_NODES))
            continue;
        shadow_compress_report(map, c);
    }
    if (shadows->kept_exact)
        report_warn(report,
                    "%zu of %zu lights with deep lists meet a material without self shadow, or one "
                    "that casts once: they keep exact lists, neither compressed nor prefiltered",
                    shadows->kept_exact, shadows->kept_exact + (size_t)c->maps);
}

static void fill_report(const struct shadow_system *shadows, const struct shadow_progress *progress,
                        struct frame_report *report)
{
    static const char *const names[] = {"shadow.map", "shadow.deep", "shadow.deep-linked"};
    bool is_reused[3] = {false, false, false};
    uint64_t occupied = 0;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        if (!map)
            continue;
        report->counts.shadowed_lights++;
        report->counts.events += map->event_count;
        occupied += map->occupied_texels;
        if (map->longest_list > report->counts.longest_list)
            report->counts.longest_list = map->longest_list;
        if (is_built_now(shadows, map, progress))
            continue;
        report->counts.shadow_maps_reused++;
        if (!is_reused[map->kind])
            report_add_reused(report, names[map->kind]);
        is_reused[map->kind] = true;
    }
    report_nodes(shadows, report);
    if (shadows->has_cut_lamp)
        report_warn(report,
                    "a lamp stands in more than %d media, in a part that is cut away: its maps "
                    "attenuate from the lamp on; traced shadows do from the cut on",
                    SHADOW_AROUND_MAX);
    if (shadows->has_thick_media)
        report_warn(report,
                    "deep-linked has no room for media: closed volumes keep the thickness of "
                    "their material; 'deep' follows the light inside");
    report->counts.shadow_maps_built += shadows->build_count;
    report->counts.mean_list = occupied ? (double)report->counts.events / (double)occupied : 0;
    report_bytes(shadows, report);
}

int shadow_resolution(const struct view_quality *quality, const struct gl_limits *limits)
{
    int wanted = quality->shadow_resolution > 0 ? quality->shadow_resolution : DEFAULT_RESOLUTION;
    return wanted < limits->max_texture_size ? wanted : limits->max_texture_size;
}

/* Once more in an empty, unfragmented store; and where the quality allows for an error, with
 * compressed lists. */
static bool prepare_within_budget(struct shadow_system *shadows,
                                  const struct shadow_prepare_desc *desc,
                                  struct frame_report *report, struct error *err)
{
    const struct view_quality *quality = desc->quality;
    struct error failure = {0};
    struct content_key exact = {{0, 0}};
    for (int attempt = 0; attempt < 3; attempt++) {
        failure = (struct error){0};
        shadows->allowed_error = attempt == 2 ? quality->shadow_error_allowed : 0;
        if (prepare_maps(shadows, desc, &failure)) {
            if (desc->progress && desc->progress->is_interrupted)
                return true;
            if (attempt == 2)
                report_warn(report,
                            "exact shadow lists exceed the budget of %llu bytes: compressed, no "
                            "transmittance farther off than %g",
                            (unsigned long long)shadows->store.budget_bytes,
                            shadows->allowed_error);
            if (attempt == 2)
                shadows->refused = exact;
            return true;
        }
        bool was_known = attempt == 0 && is_refused(shadows, quality);
        if (attempt < 2)
            exact = key_of_all(shadows);
        drop_builds(shadows);
        if (failure.code != ERROR_OVER_BUDGET)
            break;
        bool may_compress = quality->shadow_error_allowed > 0 && !asks_nodes(shadows, quality);
        if (attempt == 1 && !may_compress)
            break;
        if (was_known)
            attempt = 1;
        else
            drop_all(shadows);
    }
    shadows->refused = (struct content_key){{0, 0}};
    return error_set(err, failure.code, "%s", failure.message);
}

bool shadow_system_prepare(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                           struct frame_report *report, struct error *err)
{
    struct shadow_prepare_desc complete = *desc;
    struct shadow_needs own = {0};
    shadows->frame++;
    shadows->resolution = shadow_resolution(desc->quality, shadows->store.limits);
    shadows->taps = desc->quality->shadow_taps > 0 ? desc->quality->shadow_taps : DEFAULT_TAPS;
    const struct shadow_needs_desc needs_desc = {
        .state = desc->state, .quality = desc->quality, .resolution = shadows->resolution};
    if (!desc->needs && !shadow_needs_init(&own, &needs_desc, err))
        return false;
    if (!desc->needs)
        complete.needs = &own;
    if (desc->progress && !desc->progress->number)
        desc->progress->number = ++shadows->progresses;
    if (desc->progress)
        desc->progress->is_interrupted = false;
    bool ok = prepare_within_budget(shadows, &complete, report, err);
    shadow_needs_finish(&own);
    if (ok && desc->progress && desc->progress->is_interrupted) {
        drop_builds_from(shadows, shadows->done_count);
        report->counts.shadow_maps_built += shadows->build_count;
        count_casters(shadows, desc->state, report);
        finish_builds(shadows);
        return true;
    }
    if (!ok || !upload_records(shadows, desc, err))
        return false;
    gl_buffer_bind_storage(&shadows->records, BIND_SHADOWS);
    set_defines(shadows);
    fill_report(shadows, desc->progress, report);
    count_casters(shadows, desc->state, report);
    return true;
}

bool shadow_system_prepare_none(struct shadow_system *shadows, size_t light_count,
                                struct error *err)
{
    shadows->frame++;
    shadows->defines[0] = 0;
    finish_builds(shadows);
    return reserve_lights(shadows, light_count, err);
}

bool shadow_system_scans_on_host(const struct shadow_system *shadows)
{
    return shadows->builder.scans_on_host;
}

uint64_t shadow_system_budget_bytes(const struct shadow_system *shadows)
{
    return shadows->store.budget_bytes;
}

uint32_t shadow_system_record(const struct shadow_system *shadows, size_t light)
{
    return light < shadows->light_count ? shadows->light_records[light] : NO_SHADOW;
}

const struct shadow_map *shadow_system_map(const struct shadow_system *shadows, size_t light)
{
    return light < shadows->light_count ? shadows->light_maps[light] : NULL;
}

const struct shadow_store *shadow_system_store(const struct shadow_system *shadows)
{
    return &shadows->store;
}

const char *shadow_system_defines(const struct shadow_system *shadows)
{
    return shadows->defines;
}

void shadow_system_bind(const struct shadow_system *shadows, const struct gl_program *program)
{
    static const struct {
        enum shadow_pool_kind kind;
        int stream;
        uint32_t unit;
    } views[] = {
        {SHADOW_POOL_DEPTHS, 0, UNIT_SHADOW_DEPTH},
        {SHADOW_POOL_HEADS, 0, UNIT_SHADOW_HEADS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, UNIT_SHADOW_EVENTS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_KEYS, UNIT_SHADOW_KEYS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT, UNIT_SHADOW_ID},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM, UNIT_SHADOW_MEDIA},
        {SHADOW_POOL_NODES, 0, UNIT_SHADOW_NODES},
    };
    if (!shadows->defines[0])
        return;
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        gl_texture_bind(shadow_store_view(&shadows->store, views[i].kind, views[i].stream),
                        views[i].unit);
    gl_texture_bind(&shadows->record_view, UNIT_SHADOW_RECORDS);
    gl_buffer_bind_storage(&shadows->records, BIND_SHADOWS);
    gl_program_set_u(program, "u_shadow_taps", (uint32_t)shadows->taps);
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

uint64_t shadow_system_size_bytes(const struct shadow_system *shadows)
{
    return shadow_store_size_bytes(&shadows->store) + shadows->records.size_bytes;
}
