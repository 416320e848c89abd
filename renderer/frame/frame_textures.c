/* SPDX-License-Identifier: MIT */
/* A lens for the camera and one for each light that sees casters with textures. */
#include "renderer/frame/frame_textures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/textures/texture_need.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const uint32_t all_slots = (1u << SCENE_TEXTURE_SLOT_COUNT) - 1;

/* The textures of casters that shadows sample (renderer/shadows/shadow_casters.c). */
static const uint32_t caster_slots = 1u << SCENE_TEXTURE_BASE_COLOR |
                                     1u << SCENE_TEXTURE_TRANSMISSION |
                                     1u << SCENE_TEXTURE_THICKNESS;

static struct texture_lens lens_of_camera(const struct camera *camera, const struct view *view)
{
    double across = 2 * camera->half_width / view->width_px;
    double down = 2 * camera->half_height / view->height_px;
    struct texture_lens lens = {.near_m = fmax(0, camera->z_near),
                                .slant = 1,
                                .pixel = fmin(across, down),
                                .is_parallel = camera->is_orthographic};
    if (!lens.is_parallel)
        lens.slant = sqrt(1 + camera->half_width * camera->half_width +
                          camera->half_height * camera->half_height);
    for (int k = 0; k < 3; k++) {
        lens.eye[k] = camera->eye[k];
        lens.forward[k] = -camera->back[k];
    }
    return lens;
}

static struct texture_lens lens_of_light(const struct shadow_frame *frame, int resolution)
{
    double half[2] = {1 / frame->scale[0], 1 / frame->scale[1]};
    struct texture_lens lens = {.near_m = frame->near_m,
                                .slant = 1,
                                .pixel = 2 * fmin(half[0], half[1]) / resolution,
                                .is_parallel = frame->shape == SHADOW_ORTHOGRAPHIC};
    if (!lens.is_parallel)
        lens.slant = sqrt(1 + half[0] * half[0] + half[1] * half[1]);
    if (frame->shape == SHADOW_CUBE)
        lens.depth_share = 1 / lens.slant;
    memcpy(lens.eye, frame->origin, sizeof lens.eye);
    memcpy(lens.forward, frame->axis[2], sizeof lens.forward);
    return lens;
}

static uint8_t *make_pass(const struct frame_textures *textures, struct error *err)
{
    uint8_t *levels = malloc(textures->key_count + 1);
    if (!levels)
        error_set(err, ERROR_NO_MEMORY, "levels of %zu textures", textures->key_count);
    else
        memset(levels, TEXTURE_UNNEEDED, textures->key_count + 1);
    return levels;
}

static bool is_sampled_by_light(const struct frame_run *run, uint32_t item)
{
    const struct state_item *drawn = &run->state->items[item];
    const struct scene_material *m = &run->state->materials[drawn->material].base;
    bool has_texture = false;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        has_texture |= (caster_slots >> slot & 1) && m->textures[slot].texture >= 0;
    return has_texture && drawn->class_ != STATE_OPAQUE;
}

static bool add_light(struct frame_textures *textures, const struct frame_run *run, size_t light,
                      struct error *err)
{
    const struct shadow_need *need = &run->frame_plan->shadows.lights[light];
    const struct view_quality *quality = &run->view->quality;
    int resolution = shadow_resolution(quality, gl_context_limits(run->context->renderer->gl));
    int samples = quality->shadow_prefilter > 1 ? quality->shadow_prefilter : 1;
    struct texture_lens lens = lens_of_light(&need->frame, resolution * samples);
    for (size_t i = 0; i < need->casters.count; i++) {
        uint8_t **levels = &textures->passes.levels[1 + light];
        if (!is_sampled_by_light(run, need->casters.items[i]))
            continue;
        if (!*levels && !(*levels = make_pass(textures, err)))
            return false;
        texture_need_add(
            &(struct texture_need_desc){.density = scene_gpu_texture_density(run->scene->gpu),
                                        .state = run->state,
                                        .items = &need->casters.items[i],
                                        .item_count = 1,
                                        .slots = caster_slots,
                                        .lens = &lens},
            *levels);
    }
    return true;
}

static bool add_passes(struct frame_textures *textures, const struct frame_run *run,
                       struct error *err)
{
    const struct geometry_items *items = &run->frame_plan->items;
    const struct shadow_needs *shadows = &run->frame_plan->shadows;
    struct texture_lens lens = lens_of_camera(run->camera, run->view);
    textures->passes.count = 1 + shadows->light_count;
    textures->passes.levels = calloc(textures->passes.count, sizeof *textures->passes.levels);
    if (!textures->passes.levels)
        return error_set(err, ERROR_NO_MEMORY, "textures of %zu lights", shadows->light_count);
    if (!(textures->passes.levels[0] = make_pass(textures, err)))
        return false;
    texture_need_add(
        &(struct texture_need_desc){.density = scene_gpu_texture_density(run->scene->gpu),
                                    .state = run->state,
                                    .items = items->drawn,
                                    .item_count = items->opaque_count + items->transparent_count +
                                                  items->medium_count,
                                    .slots = all_slots,
                                    .lens = &lens},
        textures->passes.levels[0]);
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->lights[i].has_structure && !add_light(textures, run, i, err))
            return false;
    return true;
}

/* The finest that any pass can need. */
static bool join_passes(struct frame_textures *textures, struct error *err)
{
    textures->wanted = make_pass(textures, err);
    if (!textures->wanted)
        return false;
    for (size_t pass = 0; pass < textures->passes.count; pass++) {
        const uint8_t *levels = textures->passes.levels[pass];
        for (size_t key = 0; levels && key < textures->key_count; key++)
            if (levels[key] < textures->wanted[key])
                textures->wanted[key] = levels[key];
    }
    return true;
}

static void warn(const struct report_textures *report, struct frame_report *frame)
{
    if (report->level_bias)
        report_warn(frame,
                    "textures: this view samples %.1f MiB of levels, the budget is %.1f MiB: the "
                    "finest are withheld (level bias %llu, texture-budget-bytes)",
                    (double)report->wanted_bytes / (1 << 20),
                    (double)report->budget_bytes / (1 << 20),
                    (unsigned long long)report->level_bias);
    if (report->compressed_count)
        report_warn(frame,
                    "textures: this view samples %.1f MiB of levels, the budget is %.1f MiB: the "
                    "colours of %llu are compressed and off by %.4f (RMS, of 1, as coded)",
                    (double)report->wanted_bytes / (1 << 20),
                    (double)report->budget_bytes / (1 << 20),
                    (unsigned long long)report->compressed_count, report->compressed_rmse);
    if (report->pending_bytes)
        report_warn(frame, "textures: drawn with coarse levels, %.1f MiB are to come",
                    (double)report->pending_bytes / (1 << 20));
}

/* The keys of a part among those of its scene. */
struct key_range {
    size_t first, count;
};

static struct key_range keys_of(const struct scene *scene, uint32_t part)
{
    if (!scene->part_count)
        return (struct key_range){0, 2 * (size_t)scene->image_count};
    return (struct key_range){2 * (size_t)scene->parts[part].first_image,
                              2 * (size_t)scene->parts[part].scene->image_count};
}

/* Parts of one scene sample the same textures: the first of them asks for all. */
static void join_parts(uint8_t *levels, const struct scene *scene, const struct scene_gpu *gpu)
{
    for (uint32_t part = 1; part < scene_gpu_part_count(gpu); part++) {
        struct key_range from = keys_of(scene, part);
        struct key_range to = keys_of(scene, scene_gpu_first_like(gpu, part));
        for (size_t key = 0; key < from.count; key++)
            if (levels[from.first + key] < levels[to.first + key])
                levels[to.first + key] = levels[from.first + key];
    }
}

/* The textures of each scene among the parts, once. Returns how many, at most
 * `scene_gpu_part_count` of them. */
static size_t list_demands(const uint8_t *wanted, const struct frame_run *run,
                           struct texture_demand *demands)
{
    const struct scene_gpu *gpu = run->scene->gpu;
    size_t count = 0;
    for (uint32_t part = 0; part < scene_gpu_part_count(gpu); part++) {
        struct key_range keys = keys_of(run->state->scene, part);
        if (keys.count && scene_gpu_first_like(gpu, part) == part)
            demands[count++] =
                (struct texture_demand){.store = scene_gpu_textures(gpu, part),
                                        .levels = wanted ? wanted + keys.first : NULL};
    }
    return count;
}

static bool bring(struct frame_textures *textures, const struct frame_run *run,
                  struct report_textures *report, struct error *err)
{
    struct scene_gpu *gpu = run->scene->gpu;
    uint32_t parts = scene_gpu_part_count(gpu);
    struct texture_demand *demands = calloc(parts, sizeof *demands);
    if (!demands)
        return error_set(err, ERROR_NO_MEMORY, "textures of %u parts", parts);
    const struct texture_request request = {.demands = demands,
                                            .count = list_demands(textures->wanted, run, demands),
                                            .timeline = run->context->renderer->timeline,
                                            .may_be_coarse = run->view->quality.may_be_coarse};
    bool is_good =
        texture_pool_prepare(run->context->renderer->scenes.textures, &request, report, err);
    free(demands);
    scene_gpu_set_texture_passes(gpu, textures->wanted ? &textures->passes : NULL);
    textures->is_inexact |= report->coarse_count > 0 || report->compressed_count > 0;
    return is_good;
}

/* Whether the frame asks for the levels that it needs: all of its scenes do not fit. */
static bool is_on_demand(const struct frame_run *run, bool *is, struct error *err)
{
    const struct scene_gpu *gpu = run->scene->gpu;
    uint32_t parts = scene_gpu_part_count(gpu);
    size_t count = 0;
    struct texture_store **stores = calloc(parts, sizeof(*stores));
    if (!stores)
        return error_set(err, ERROR_NO_MEMORY, "textures of %u parts", parts);
    for (uint32_t part = 0; part < parts; part++)
        if (scene_gpu_first_like(gpu, part) == part)
            stores[count++] = scene_gpu_textures(gpu, part);
    *is = !texture_pool_has_room_for(run->context->renderer->scenes.textures, stores, count);
    free(stores);
    return true;
}

bool frame_textures_begin(struct frame_textures *textures, const struct frame_run *run,
                          struct error *err)
{
    struct report_textures *report = &run->frame->report.textures;
    *textures = (struct frame_textures){.key_count = 2 * (size_t)run->state->scene->image_count};
    if (!textures->key_count)
        return true;
    bool is_partial = false;
    if (!is_on_demand(run, &is_partial, err))
        return false;
    if (is_partial) {
        if (!add_passes(textures, run, err) || !join_passes(textures, err))
            return false;
        join_parts(textures->wanted, run->state->scene, run->scene->gpu);
    }
    if (!bring(textures, run, report, err))
        return false;
    warn(report, &run->frame->report);
    return true;
}

bool frame_textures_resume(struct frame_textures *textures, const struct frame_run *run,
                           struct error *err)
{
    struct report_textures discarded;
    return !textures->key_count || bring(textures, run, &discarded, err);
}

void frame_textures_end(struct frame_textures *textures, const struct frame_run *run)
{
    scene_gpu_set_texture_passes(run->scene->gpu, NULL);
    if (textures->is_inexact) {
        shadow_system_forget(run->context->renderer->shadows,
                             resident_scene_shadow_key(run->scene));
        run->context->cached = (struct window_cache_keys){0};
    }
    for (size_t i = 0; textures->passes.levels && i < textures->passes.count; i++)
        free(textures->passes.levels[i]);
    free(textures->passes.levels);
    free(textures->wanted);
    *textures = (struct frame_textures){0};
}

/* ---- pictures that rays make ---- */

/* Level 0 of what rays read there whatever the pixel covers: alpha of masks, and filters on the way
 * of light. */
static void add_finest(const struct frame_run *run, uint8_t *levels)
{
    const struct scene *scene = run->state->scene;
    for (size_t i = 0; i < run->state->item_count; i++) {
        const struct state_item *item = &run->state->items[i];
        const struct scene_material *m = &run->state->materials[item->material].base;
        uint32_t slots =
            item->class_ == STATE_MASKED ? 1u << SCENE_TEXTURE_BASE_COLOR : caster_slots;
        if (item->class_ == STATE_OPAQUE || !item->casts_shadow || item->cap)
            continue;
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
            int32_t texture = m->textures[slot].texture;
            int32_t image = texture >= 0 ? scene->textures[texture].image : -1;
            if ((slots >> slot & 1) && image >= 0)
                levels[texture_key((uint32_t)image, scene_slot_is_srgb(slot))] = 0;
        }
    }
}

static bool add_view(const struct frame_run *run, uint8_t *levels, struct error *err)
{
    const struct window_frame window = {.state = run->state, .camera = run->camera};
    struct texture_lens lens = lens_of_camera(run->camera, run->view);
    struct geometry_items items;
    if (!geometry_cull(&window, &items, err))
        return false;
    texture_need_add(
        &(struct texture_need_desc){.density = scene_gpu_texture_density(run->scene->gpu),
                                    .state = run->state,
                                    .items = items.drawn,
                                    .item_count = items.opaque_count + items.transparent_count +
                                                  items.medium_count,
                                    .slots = all_slots,
                                    .lens = &lens},
        levels);
    geometry_items_finish(&items);
    return true;
}

/* Sets the levels to those within the budget; the report also counts images that are read at level
 * 0. */
static void take_budgeted(const struct frame_run *run, const uint8_t *finest, uint8_t *levels,
                          struct report_textures *report)
{
    const struct scene *scene = run->state->scene;
    const struct scene_gpu *gpu = run->scene->gpu;
    for (uint32_t part = 0; part < scene_gpu_part_count(gpu); part++) {
        struct key_range keys = keys_of(scene, part);
        uint32_t first = scene_gpu_first_like(gpu, part);
        for (uint32_t key = 0; key < keys.count; key++) {
            const struct scene_image *image = &scene->images[(keys.first + key) / 2];
            uint8_t wanted = levels[keys.first + key];
            uint8_t budgeted = texture_store_budgeted(scene_gpu_textures(gpu, first), key);
            uint64_t bytes = 4ull * image->width_px * image->height_px;
            levels[keys.first + key] = budgeted;
            if (part != first || finest[keys.first + key])
                continue;
            report->wanted_bytes += wanted ? bytes : 0;
            report->resident_bytes += budgeted ? bytes : 0;
        }
    }
}

static bool plan_levels(const struct frame_run *run, uint8_t *levels,
                        struct report_textures *report, struct error *err)
{
    uint32_t parts = scene_gpu_part_count(run->scene->gpu);
    struct texture_demand *demands = calloc(parts, sizeof *demands);
    if (!demands)
        return error_set(err, ERROR_NO_MEMORY, "textures of %u parts", parts);
    const struct texture_request request = {.demands = demands,
                                            .count = list_demands(levels, run, demands)};
    bool is_good =
        texture_pool_plan(run->context->renderer->scenes.textures, &request, report, err);
    free(demands);
    return is_good;
}

static void move_needed(uint8_t *levels, uint8_t *finest, size_t count)
{
    for (size_t key = 0; key < count; key++) {
        finest[key] = levels[key] == TEXTURE_UNNEEDED ? finest[key] : 0;
        levels[key] = TEXTURE_UNNEEDED;
    }
}

bool frame_textures_plan_traced(const struct frame_run *run, uint8_t **levels, struct error *err)
{
    const struct scene *scene = run->state->scene;
    const struct frame_textures sizes = {.key_count = 2 * (size_t)scene->image_count};
    struct report_textures report, *shown = &run->frame->report.textures;
    uint8_t *finest = NULL;
    *levels = NULL;
    if (!sizes.key_count)
        return true;
    bool is_good = (*levels = make_pass(&sizes, err)) && (finest = make_pass(&sizes, err));
    if (is_good) {
        add_finest(run, finest);
        join_parts(finest, scene, run->scene->gpu);
        is_good = add_view(run, *levels, err);
    }
    if (is_good) {
        join_parts(*levels, scene, run->scene->gpu);
        if (run->view->quality.reference) /* all at level 0, whatever the budget */
            move_needed(*levels, finest, sizes.key_count);
        is_good = plan_levels(run, *levels, &report, err);
    }
    if (is_good)
        take_budgeted(run, finest, *levels, &report);
    if (is_good && !shown->budget_bytes) { /* else the GPU samples textures in the same frame */
        *shown = report;
        warn(shown, &run->frame->report);
    }
    if (!is_good || !report.level_bias) {
        free(*levels);
        *levels = NULL;
    }
    free(finest);
    return is_good;
}
