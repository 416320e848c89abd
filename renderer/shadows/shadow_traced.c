/* SPDX-License-Identifier: MIT */
/* Points of a window to a finder, and what it found to shading. */
#include "renderer/shadows/shadow_traced.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/transparency/method.h"
#include "renderer/window/apart.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

uint64_t traced_shadows_points_max(const struct gl_limits *limits)
{
    uint64_t most = gl_limits_block(limits, sizeof(struct shadow_point));
    return most < TRACED_POINTS_MAX ? most : TRACED_POINTS_MAX;
}

/* What the finder of frames before has kept is none of this one's. */
static void take_finder(struct traced_shadows *traced, const struct traced_desc *desc)
{
    traced->finder = desc->finder;
    traced->technique = desc->technique;
    if (!desc->finder || desc->finder == traced->owner)
        return;
    if (traced->owner && traced->owner->finish)
        traced->owner->finish(traced);
    traced->owner = desc->finder;
}

/* Rays for what they alone find; those that find shadows have begun. */
static bool begin_rays(struct traced_shadows *traced, const struct raytrace_desc *desc,
                       struct error *err)
{
    bool *none = calloc(desc->state->light_count + 1, sizeof *none);
    if (!none)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", desc->state->light_count);
    traced->rays = raytrace_shadows_create(desc, none, &traced->stats, err);
    free(none);
    return traced->rays;
}

bool traced_shadows_begin(struct traced_shadows *traced, const struct traced_desc *desc,
                          struct error *err)
{
    const struct raytrace_desc *rays = desc->finding.desc;
    traced_shadows_end(traced);
    take_finder(traced, desc);
    traced->visibility_lobes = desc->visibility_lobes;
    traced->has_lights = traced->has_fixed_points = false;
    for (size_t i = 0; i < rays->state->light_count; i++)
        traced->has_lights |= desc->finding.is_shadowed[i];
    traced->window_bytes = 0;
    traced->missing_bytes = 0;
    traced->stats = (struct raytrace_stats){0};
    return (!desc->finder || desc->finder->begin(traced, &desc->finding, err)) &&
           (!desc->visibility_lobes || traced->rays || begin_rays(traced, rays, err));
}

uint32_t traced_shadows_record(const struct traced_shadows *traced, size_t light)
{
    return traced->finder->filters(traced, light) ? 0 : NO_SHADOW;
}

static void free_arrays(struct traced_shadows *traced)
{
    for (size_t i = 0; i < sizeof traced->arrays / sizeof *traced->arrays; i++) {
        free(traced->arrays[i]);
        traced->arrays[i] = NULL;
    }
    traced->filter_capacity = 0;
    traced->window = (struct raytrace_shadow_points){0};
}

void traced_shadows_end(struct traced_shadows *traced)
{
    if (traced->finder && traced->finder->end)
        traced->finder->end(traced);
    traced->finder = NULL;
    raytrace_shadows_destroy(traced->rays);
    traced->rays = NULL;
    free_arrays(traced);
}

void traced_shadows_set_budget(struct traced_shadows *traced, uint64_t bytes)
{
    traced->most_bytes = bytes ? bytes : 1;
}

void traced_shadows_free(struct traced_shadows *traced)
{
    struct gl_texture *views[] = {&traced->head_view, &traced->table_view, &traced->filter_view};
    struct gl_buffer *buffers[] = {&traced->points, &traced->heads,   &traced->counter,
                                   &traced->table,  &traced->filters, &traced->visibility};
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        gl_texture_finish(views[i]);
    for (size_t i = 0; i < sizeof buffers / sizeof *buffers; i++)
        gl_buffer_finish(buffers[i]);
    if (traced->owner && traced->owner->free)
        traced->owner->free(traced);
}

void traced_shadows_finish(struct traced_shadows *traced)
{
    traced_shadows_end(traced);
    traced_shadows_free(traced);
    if (traced->owner && traced->owner->finish)
        traced->owner->finish(traced);
    *traced = (struct traced_shadows){0};
}

/* Points, and what is found of them. */
static uint64_t buffer_bytes(const struct traced_shadows *traced)
{
    return traced->points.size_bytes + traced->heads.size_bytes + traced->table.size_bytes +
           traced->filters.size_bytes;
}

uint64_t traced_shadows_size_bytes(const struct traced_shadows *traced)
{
    const struct shadow_finder *owner = traced->owner;
    return buffer_bytes(traced) + (owner && owner->size_bytes ? owner->size_bytes(traced) : 0);
}

static bool reads_points(const struct traced_shadows *traced)
{
    return traced->visibility_lobes || !traced->finder || traced->finder->reads_points;
}

/* Room in a buffer, and in the texture that views it (optional): no more than asked for, where
 * more would exceed what the buffers may take. */
static bool reserve(struct traced_shadows *traced, struct gl_buffer *buffer,
                    struct gl_texture *view, const char *label, uint32_t format, uint64_t bytes,
                    struct error *err)
{
    /* what is found on the CPU */
    const bool from_host = buffer == &traced->visibility ||
                           (format == GL_RG32UI && traced->finder && traced->finder->reads_points);
    uint64_t grown =
        buffer_bytes(traced) - buffer->size_bytes + gl_buffer_reserved_bytes(buffer, bytes);
    if (traced->most_bytes && buffer->size_bytes < bytes && grown > traced->most_bytes)
        gl_buffer_finish(buffer);
    if (!gl_buffer_reserve(buffer,
                           &(struct gl_buffer_desc){.label = label,
                                                    .size_bytes = bytes,
                                                    .is_dynamic = !from_host,
                                                    .is_uploaded = from_host},
                           false, err))
        return false;
    return !view || gl_texture_follow_buffer(view, label, format, buffer, err);
}

enum { DEFINES_BYTES = 96 };

/* Whose points a program collects: those of opaque samples, of samples that are lit apart, or of
 * the surfaces of a kind. */
struct collected {
    const struct surface_kind *kind; /* NULL: of samples */
    bool is_apart;
};

static struct program_desc program_of(const struct window_frame *frame,
                                      const struct collected *collected,
                                      char defines[DEFINES_BYTES])
{
    const struct surface_kind *kind = collected->kind;
    const char *file = kind ? "shadow_points_surfaces.comp.glsl" : "shadow_points_pixels.comp.glsl";
    snprintf(defines, DEFINES_BYTES, "SAMPLES=%d%s%s%s%s", frame->targets->samples,
             collected->is_apart ? " SAMPLES_APART" : "",
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "", kind ? " POINTS=" : "",
             kind ? kind->points : "");
    return (struct program_desc){.label = file, .compute = file, .defines = defines};
}

static void list_program(const struct window_frame *frame, struct collected collected,
                         bool is_conditional, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(frame, &collected, defines);
    program_list_add(list, "shadow.points", &desc, is_conditional);
}

void traced_shadows_list_programs(const struct window_frame *frame,
                                  const struct surface_kind *layers,
                                  const struct shadow_finder *finder, struct program_list *list)
{
    if (finder && finder->list_programs)
        finder->list_programs(frame, list);
    if (layers)
        list_program(frame, (struct collected){.kind = layers}, true, list);
    list_program(frame, (struct collected){.kind = NULL}, false, list);
    if (apart_is_possible(frame))
        list_program(frame, (struct collected){.is_apart = true}, true, list);
}

/* Uses the program, which may write so many points. */
static const struct gl_program *use_program(struct traced_shadows *traced,
                                            const struct window_frame *frame,
                                            const struct collected *collected, uint64_t points,
                                            struct error *err)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(frame, collected, defines);
    const struct gl_program *program = program_cache_get(frame->programs, &desc, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    gl_buffer_bind_storage_range(&traced->points, 0, points * sizeof(struct shadow_point),
                                 BIND_TRACED_POINTS);
    return program;
}

static bool collect_layers(struct traced_shadows *traced, const struct window_frame *frame,
                           const struct layers *layers, struct error *err)
{
    const struct collected collected = {.kind = layers->method->surfaces};
    if (!layers->layer_count)
        return true;
    const struct gl_program *program =
        use_program(traced, frame, &collected, layers->layer_count, err);
    if (!program)
        return false;
    layers->method->bind(layers, program);
    gl_program_set_u(program, "u_surfaces", (uint32_t)layers->layer_count);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(layers->layer_count);
    return true;
}

/* Pixels of the list of those whose samples are shaded apart. */
struct apart_range {
    uint32_t first, count; /* first: a multiple of 64 */
};

static void dispatch_pixels(const struct window_frame *frame, const struct apart_range *apart,
                            const struct gl_program *program)
{
    if (!apart) {
        window_dispatch_pixels(frame);
        return;
    }
    apart_bind(frame->targets);
    gl_program_set_u(program, "u_first", apart->first);
    window_dispatch_items(apart->count);
}

/* Collects the surfaces of all pixels, or of those of `apart`: counts them, and writes as many
 * points as there is room for. */
static bool collect_samples(struct traced_shadows *traced, const struct window_frame *frame,
                            const struct apart_range *apart, uint32_t first, uint32_t room,
                            uint32_t *count, struct error *err)
{
    const struct collected collected = {.is_apart = apart != NULL};
    const struct gl_program *program =
        use_program(traced, frame, &collected, (uint64_t)first + room, err);
    if (!program)
        return false;
    gl_buffer_clear_u32(&traced->counter, 0, 4, 0);
    uint64_t pixels = (uint64_t)frame->window.width * (uint64_t)frame->window.height;
    gl_buffer_bind_storage_range(&traced->heads, 0, pixels * 4, BIND_TRACED_HEADS);
    gl_buffer_bind_storage(&traced->counter, BIND_STATISTICS);
    gl_program_set_u(program, "u_first_point", first);
    gl_program_set_u(program, "u_room", room);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_FRAMEBUFFER_BARRIER_BIT);
    dispatch_pixels(frame, apart, program);
    gpu_timeline_will_wait(frame->timeline);
    gl_buffer_read(&traced->counter, 0, 4, count);
    return true;
}

enum { POINT_BYTES = sizeof(struct shadow_point) + 8 }; /* with its place in the table */

enum { FILTER_BYTES = 8 };

/* Whether heads and so many points have room, with what is seen of the map and, where lights are
 * traced, as many bytes again for filters. */
static bool has_room(struct traced_shadows *traced, uint64_t pixel_count, uint64_t points)
{
    uint64_t seen = points * traced->visibility_lobes * FILTER_BYTES;
    uint64_t own = traced->has_lights ? traced->finder->point_bytes : 0;
    uint64_t lists =
        points * (own + (traced->has_lights ? POINT_BYTES : sizeof(struct shadow_point)));
    uint64_t bytes = (traced->has_lights ? 2 : 1) * (pixel_count * 4 + lists) + seen;
    traced->missing_bytes = traced->most_bytes && bytes > traced->most_bytes ? bytes : 0;
    return !traced->missing_bytes;
}

/* Buffers of larger windows leave none for filters: they begin anew. */
static void drop_large(struct traced_shadows *traced)
{
    if (traced->most_bytes && buffer_bytes(traced) > traced->most_bytes / 2)
        traced_shadows_free(traced);
}

size_t traced_shadows_most_filters(const struct traced_shadows *traced)
{
    uint64_t table = traced->window.count * 8;
    uint64_t seen = traced->window.count * traced->visibility_lobes * FILTER_BYTES;
    uint64_t own = traced->finder ? traced->window.count * traced->finder->point_bytes : 0;
    uint64_t used = own + traced->points.size_bytes + traced->heads.size_bytes +
                    (seen > traced->visibility.size_bytes ? seen : traced->visibility.size_bytes) +
                    (table > traced->table.size_bytes ? table : traced->table.size_bytes);
    uint64_t room = traced->most_bytes > used ? (traced->most_bytes - used) / 8 : 0;
    return !traced->most_bytes || room > TRACED_FILTERS_MAX ? TRACED_FILTERS_MAX : room;
}

/* A guess at the number of surfaces, and once more where it was too low. */
static enum traced_outcome collect(struct traced_shadows *traced, const struct window_frame *frame,
                                   const struct layers *layers, uint32_t *surfaces,
                                   struct error *err)
{
    uint64_t pixel_count = (uint64_t)frame->window.width * (uint64_t)frame->window.height;
    uint32_t layer_count = (uint32_t)layers->layer_count;
    *surfaces = (uint32_t)(pixel_count + pixel_count / 8);
    drop_large(traced);
    if (!reserve(traced, &traced->heads, &traced->head_view, "shadow.traced.heads", GL_R32UI,
                 pixel_count * 4, err) ||
        !reserve(traced, &traced->counter, NULL, "shadow.traced.counter", 0, 16, err))
        return TRACED_FAILED;
    for (uint32_t room = 0; room < *surfaces;) {
        room = *surfaces;
        if ((uint64_t)room + layer_count > traced_shadows_points_max(frame->limits) ||
            !has_room(traced, pixel_count, (uint64_t)room + layer_count))
            return TRACED_TOO_MANY;
        if (!reserve(traced, &traced->points, NULL, "shadow.traced.points", 0,
                     ((uint64_t)room + layer_count) * sizeof(struct shadow_point), err) ||
            !collect_layers(traced, frame, layers, err) ||
            !collect_samples(traced, frame, NULL, layer_count, room, surfaces, err))
            return TRACED_FAILED;
    }
    return TRACED_COLLECTED;
}

static bool read_array(struct traced_shadows *traced, enum traced_array array,
                       const struct gl_buffer *buffer, uint64_t bytes, struct error *err)
{
    traced->arrays[array] = calloc(1, bytes ? bytes : 1); /* a lost context reads nothing */
    if (!traced->arrays[array])
        return error_set(err, ERROR_NO_MEMORY, "reading back %llu bytes",
                         (unsigned long long)bytes);
    if (bytes)
        gl_buffer_read(buffer, 0, bytes, traced->arrays[array]);
    return true;
}

/* layers: NULL where they have no points. */
static bool read_points(struct traced_shadows *traced, const struct window_frame *frame,
                        const struct layers *layers, uint32_t surfaces, struct error *err)
{
    const struct camera_window *w = &frame->window;
    uint64_t layer_count = layers ? layers->layer_count : 0, count = layer_count + surfaces;
    uint64_t pixel_bytes = 4 * (uint64_t)w->width * (uint64_t)w->height;
    free_arrays(traced);
    if (reads_points(traced)) {
        traced->arrays[TRACED_TABLE] = calloc(count + 1, 2 * sizeof(uint32_t));
        if (!traced->arrays[TRACED_TABLE])
            return error_set(err, ERROR_NO_MEMORY, "%llu points in shadow",
                             (unsigned long long)count);
        if (!read_array(traced, TRACED_POINTS, &traced->points, count * sizeof(struct shadow_point),
                        err) ||
            !read_array(traced, TRACED_HEADS, &traced->heads, pixel_bytes, err) ||
            (layer_count && !read_array(traced, TRACED_LAYER_ENDS, layers->method->ends(layers),
                                        pixel_bytes, err)))
            return false;
    }
    traced->layer_ends = layer_count ? layers->method->ends(layers) : NULL;
    traced->longest_layers = layer_count ? layers->longest : 0;
    traced->window = (struct raytrace_shadow_points){
        .points = traced->arrays[TRACED_POINTS],
        .count = count,
        .layer_count = layer_count,
        .layer_ends = traced->arrays[TRACED_LAYER_ENDS],
        .heads = traced->arrays[TRACED_HEADS],
        .width = w->width,
        .height = w->height,
        .image_x = w->x,
        .image_y_bottom = w->y + w->height - 1,
    };
    return true;
}

enum traced_outcome traced_shadows_collect(struct traced_shadows *traced,
                                           const struct window_frame *frame,
                                           const struct layers *layers, struct error *err)
{
    uint32_t surfaces = 0;
    gpu_scope_begin(frame->timeline,
                    &(struct gpu_scope_desc){
                        .pass = "shadow.points",
                        .because = "shadows are to be found on the surfaces that are in view",
                        .technique = traced->technique,
                        .stage = REPORT_SHADOW,
                    });
    enum traced_outcome outcome = collect(traced, frame, layers, &surfaces, err);
    gpu_scope_end(frame->timeline);
    if (outcome == TRACED_COLLECTED && !read_points(traced, frame, layers, surfaces, err))
        return TRACED_FAILED;
    return outcome;
}

uint32_t traced_shadows_apart_room(const struct traced_shadows *traced, int samples)
{
    uint64_t pixels = traced->window.count / (uint64_t)samples / 64 * 64;
    return pixels ? (uint32_t)pixels : 64;
}

bool traced_shadows_collect_apart(struct traced_shadows *traced, const struct window_frame *frame,
                                  uint32_t first, uint32_t count, struct error *err)
{
    uint64_t pixel_count = (uint64_t)frame->window.width * (uint64_t)frame->window.height;
    const struct apart_range apart = {.first = first, .count = count};
    uint32_t room = count * (uint32_t)frame->targets->samples, surfaces = 0;
    if (!reserve(traced, &traced->points, NULL, "shadow.traced.points", 0,
                 room * sizeof(struct shadow_point), err))
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = "shadow.points",
                                         .because = "samples are lit apart where light differs",
                                         .technique = traced->technique,
                                         .stage = REPORT_SHADOW,
                                     });
    /* others have no points */
    bool ok = window_clear(frame, &traced->heads, pixel_count * 4, err) &&
              collect_samples(traced, frame, &apart, 0, room, &surfaces, err);
    gpu_scope_end(frame->timeline);
    assert(surfaces <= room);
    return ok && read_points(traced, frame, NULL, surfaces, err);
}

uint32_t traced_shadows_room(struct traced_shadows *traced, const struct clusters *clusters)
{
    size_t most = traced_shadows_most_filters(traced);
    uint32_t room = traced->finder->room(traced, clusters, most);
    if (!room && most < TRACED_FILTERS_MAX)
        traced->missing_bytes = traced->most_bytes + traced->window.count * 8;
    return room;
}

static void note_bytes(struct traced_shadows *traced, uint64_t filters)
{
    const struct raytrace_shadow_points *window = &traced->window;
    uint64_t pixels = (uint64_t)window->width * (uint64_t)window->height;
    uint64_t each = sizeof(struct shadow_point) + traced->visibility_lobes * FILTER_BYTES;
    uint64_t bytes = window->count * each + pixels * 4 + filters * FILTER_BYTES;
    bytes += traced->has_lights ? window->count * (8 + traced->finder->point_bytes) : 0;
    if (bytes > traced->window_bytes)
        traced->window_bytes = bytes;
}

bool traced_shadows_reserve(struct traced_shadows *traced, uint64_t filters, struct error *err)
{
    return reserve(traced, &traced->table, &traced->table_view, "shadow.traced.points", GL_RG32UI,
                   traced->window.count * 8, err) &&
           reserve(traced, &traced->filters, &traced->filter_view, "shadow.traced.filters",
                   GL_RG32UI, filters * 8, err);
}

bool traced_shadows_find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                         struct error *err)
{
    uint64_t filters = 0;
    if (!traced->finder->find(traced, chunk, &filters, err))
        return false;
    note_bytes(traced, filters);
    return true;
}

void traced_shadows_report(const struct traced_shadows *traced, const struct shadow_report *report)
{
    if (traced->finder)
        traced->finder->report(traced, report);
}

bool traced_shadows_see(struct traced_shadows *traced, struct error *err)
{
    uint64_t bytes = traced->window.count * traced->visibility_lobes * FILTER_BYTES;
    void *found = calloc(1, bytes + 1); /* points without light have none */
    free(traced->arrays[TRACED_VISIBILITY]);
    traced->arrays[TRACED_VISIBILITY] = found;
    if (!found)
        return error_set(err, ERROR_NO_MEMORY, "%llu points in the light of the environment",
                         (unsigned long long)traced->window.count);
    if (!raytrace_shadows_see(traced->rays, &traced->window, traced->visibility_lobes, found,
                              &traced->stats, err) ||
        !reserve(traced, &traced->visibility, NULL, "shadow.traced.visibility", 0,
                 bytes ? bytes : FILTER_BYTES, err))
        return false;
    gl_buffer_write(&traced->visibility, 0, bytes, found);
    if (!traced->has_lights)
        note_bytes(traced, 0);
    return true;
}

bool traced_shadows_light_haze(struct traced_shadows *traced, const struct window_frame *frame,
                               struct raytrace_shadow_haze *haze, struct error *err)
{
    uint64_t bytes =
        atmosphere_columns(haze->size) * (uint64_t)haze->size->slices * ATMOSPHERE_SLICE_BYTES;
    if (!raytrace_shadows_light_haze(traced->rays, haze, &traced->stats, err))
        return false;
    gl_buffer_write(&frame->targets->atmosphere, 0, bytes, haze->lights);
    free(haze->lights);
    haze->lights = NULL;
    return true;
}

void traced_shadows_bind_visibility(const struct traced_shadows *traced,
                                    const struct gl_program *program)
{
    gl_buffer_bind_storage(&traced->visibility, BIND_VISIBILITY);
    gl_buffer_bind_storage(&traced->heads, BIND_TRACED_HEADS);
    gl_program_set_u(program, "u_seen_first", (uint32_t)traced->window.layer_count);
}

void traced_shadows_bind(const struct traced_shadows *traced, const struct gl_program *program)
{
    gl_texture_bind(&traced->head_view, UNIT_TRACED_HEADS);
    gl_texture_bind(&traced->table_view, UNIT_TRACED_POINTS);
    gl_texture_bind(&traced->filter_view, UNIT_TRACED_FILTERS);
    gl_program_set_u(program, "u_traced_first", (uint32_t)traced->window.layer_count);
    gl_program_set_u(program, "u_area_fixed", traced->has_fixed_points);
}
