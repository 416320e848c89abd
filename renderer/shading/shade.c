/* SPDX-License-Identifier: MIT */
/* The shading passes: programs, uniforms and dispatches. */
#include "renderer/shading/shade.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/window/apart.h"
#include "renderer/window/band_clock.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    STATISTICS_WORDS = 128,
    STATISTICS_LOOKUPS = STATISTICS_WORDS - READBACK_LOOKUP_WORDS,
    STATISTICS_COUNTS = STATISTICS_WORDS - READBACK_COUNT_WORDS,
    DEFINES_BYTES = 512,
};

static void fill_light(const struct state_light *light, uint32_t shadow,
                       const struct camera *camera, struct light_record *r)
{
    double offset[3], axes[3][3];
    vec3_sub(light->position, camera->eye, offset);
    camera_axes(camera, axes);
    *r = (struct light_record){.shadow = shadow};
    for (int k = 0; k < 3; k++) {
        r->position_range.v[k] = (float)vec3_dot(axes[k], offset);
        r->color.v[k] = light->color[k] * (state_light_is_area(light) ? (float)light->area_m2 : 1);
        r->direction_cone.v[k] = (float)vec3_dot(axes[k], light->direction);
    }
    r->position_range.v[3] = light->range;
    r->type = light->type == SCENE_LIGHT_DIRECTIONAL ? LIGHT_DIRECTIONAL
              : light->type == SCENE_LIGHT_POINT     ? LIGHT_POINT
              : state_light_is_area(light)           ? LIGHT_AREA
                                                     : LIGHT_SPOT;
    /* KHR_lights_punctual, "Inner and Outer Cone Angles" */
    float outer = cosf(light->outer_cone_rad), inner = cosf(light->inner_cone_rad);
    float scale = 1 / fmaxf(inner - outer, 1e-3f);
    r->direction_cone.v[3] = scale;
    r->spot_offset = -outer * scale;
}

bool shade_upload_lights(struct shade *shade, const struct shade_lights_desc *desc,
                         struct error *err)
{
    const struct scene_state *state = desc->state;
    struct light_record *records = calloc(state->light_count + 1, sizeof *records);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", state->light_count);
    for (size_t i = 0; i < state->light_count; i++) {
        uint32_t shadow = desc->traced ? traced_shadows_record(desc->traced, i)
                                       : shadow_system_record(desc->shadows, i);
        fill_light(&state->lights[i], shadow, desc->camera, &records[i]);
        if (desc->is_left_out && desc->is_left_out[i])
            records[i].color = (vec4){{0, 0, 0, 0}};
    }
    uint64_t bytes = state->light_count * sizeof *records;
    bool ok =
        gl_buffer_reserve(&shade->lights,
                          &(struct gl_buffer_desc){
                              .label = "frame.lights", .size_bytes = bytes, .is_uploaded = true},
                          false, err) &&
        gl_buffer_reserve(&shade->statistics,
                          &(struct gl_buffer_desc){.label = "frame.statistics",
                                                   .size_bytes = STATISTICS_WORDS * 4,
                                                   .is_dynamic = true},
                          false, err) &&
        (desc->needs->area_samples <= 1 ||
         light_areas_upload(&shade->areas, state, desc->camera, err));
    if (ok)
        gl_buffer_write(&shade->lights, 0, bytes, records);
    free(records);
    return ok;
}

/* A part of the light lists, walked by one dispatch. */
struct light_slice {
    uint32_t first, count;
    bool is_whole;          /* of the lists; first and count mean nothing */
    bool is_first, is_last; /* of all dispatches over the window */
    int part, parts;        /* which pass of all slices is next, of how many */
};

/* Of the lists' media. */
static void describe_media(const struct window_frame *frame, const struct shade_facts *facts,
                           char text[64])
{
    size_t planes = frame->view->clip_plane_count;
    int used = snprintf(text, 64, "%s%s", facts->has_media ? " HAS_MEDIA" : "",
                        facts->may_surround ? " MEDIA_SURROUND" : "");
    if (facts->has_media && planes)
        snprintf(text + used, 64 - (size_t)used, " CUT_PLANES=%zu", planes);
}

/* Requirements of the shading programs, in canonical order. */
static void describe(const struct window_frame *frame, const struct shade_facts *facts,
                     const struct light_slice *slice, bool for_pixels, char text[DEFINES_BYTES])
{
    bool has_lights = frame->state->light_count > 0;
    bool has_shadows = has_lights && facts->shadows && *facts->shadows;
    bool has_maps = has_shadows && !facts->is_traced;
    char pixel_defines[80] = "", media_defines[64] = "";
    char material_defines[SHADER_NEEDS_TEXT_BYTES], light_defines[SHADER_NEEDS_TEXT_BYTES] = "";
    const struct shader_needs *needs = frame->needs;
    shader_needs_material_defines(for_pixels ? needs->surface_kinds : needs->layer_kinds,
                                  material_defines);
    if (has_lights)
        shader_needs_light_defines(needs, light_defines);
    if (for_pixels)
        snprintf(pixel_defines, sizeof pixel_defines, " SAMPLES=%d%s%s%s%s",
                 frame->targets->samples, has_maps && needs->lifts ? " HAS_LIFT" : "",
                 facts->is_apart ? " SAMPLES_APART" : "",
                 facts->has_entries ? " HAS_TRANSPARENT" : "",
                 frame->view->screen.has_backdrop ? " HAS_BACKDROP" : "");
    if (facts->has_entries)
        describe_media(frame, facts, media_defines);
    snprintf(text, DEFINES_BYTES, "%s%s%s%s%s%s%s%s%s %s %s", has_lights ? "HAS_LIGHTS" : "",
             has_maps ? " HAS_SHADOWS" : "",
             frame->state->has_environment ? " HAS_ENVIRONMENT" : "",
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "", pixel_defines, media_defines,
             material_defines, light_defines,
             slice->is_first && slice->is_last ? ""
             : slice->is_whole                 ? " HAS_LIGHT_PARTS"
                                               : " HAS_LIGHT_PARTS HAS_LIGHT_SLICE",
             has_lights ? facts->lists : "", has_shadows ? facts->shadows : "");
}

struct shade_facts shade_facts_of(const struct shade_desc *desc)
{
    const struct pixel_lists *pixels = desc->pixels;
    return (struct shade_facts){
        .shadows = desc->traced ? SHADE_TRACED_SHADOWS : shadow_system_defines(desc->shadows),
        .lists = light_lists_defines(desc->lists),
        .is_traced = desc->traced,
        .is_apart = desc->is_apart,
        .has_entries = pixels->entry_count > 0,
        .has_media = pixels->has_media,
        .may_surround = pixels->may_surround,
    };
}

static const char entries_file[] = "shade_fragments.comp.glsl",
                  pixels_file[] = "shade_pixels.comp.glsl";

static void list_program(const struct window_frame *frame, const struct shade_facts *facts,
                         const struct light_slice *slice, bool for_pixels, bool is_conditional,
                         struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const char *file = for_pixels ? pixels_file : entries_file;
    const char *pass = facts->is_apart ? "shade.apart"
                       : for_pixels    ? "shade.opaque"
                                       : "shade.transparent";
    describe(frame, facts, slice, for_pixels, defines);
    program_list_add(list, pass,
                     &(struct program_desc){.label = file, .compute = file, .defines = defines},
                     is_conditional);
}

void shade_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                         enum shade_parts parts, bool is_conditional, struct program_list *list)
{
    struct light_slice slice = {
        .is_whole = parts != SHADE_IN_SLICES, .is_first = true, .is_last = parts == SHADE_AT_ONCE};
    for (int for_pixels = !facts->has_entries; for_pixels < 2; for_pixels++)
        list_program(frame, facts, &slice, for_pixels, is_conditional, list);
    struct shade_facts apart = *facts;
    apart.is_apart = true;
    if (apart_is_possible(frame))
        list_program(frame, &apart, &slice, true, true, list);
}

static uint32_t count_taps(const struct window_frame *frame, bool is_traced)
{
    int taps = frame->view->quality.shadow_taps;
    return is_traced ? 1 : taps ? (uint32_t)taps : 4;
}

static const struct gl_program *prepare_program(struct shade *shade, const struct shade_desc *desc,
                                                const struct light_slice *slice, const char *file,
                                                bool for_pixels, struct error *err)
{
    const struct window_frame *frame = desc->frame;
    char defines[DEFINES_BYTES];
    const struct shade_facts facts = shade_facts_of(desc);
    describe(frame, &facts, slice, for_pixels, defines);
    const struct gl_program *program = program_cache_get(
        frame->programs, &(struct program_desc){.label = file, .compute = file, .defines = defines},
        err);
    if (!program)
        return NULL;
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_set_clip_planes(frame, 1, program);
    if (frame->state->has_environment)
        window_set_world_axes(frame, program);
    gl_program_set_f3(program, "u_sky", frame->state->sky);
    gl_program_set_f3(program, "u_ground", frame->state->ground);
    gl_program_set_f(program, "u_taps", (float)count_taps(frame, desc->traced));
    gl_program_set_u2(program, "u_light_slice", slice->first, slice->count);
    gl_program_set_u2(program, "u_light_part", slice->is_first, slice->is_last);
    gl_buffer_bind_storage(&shade->lights, BIND_LIGHTS);
    gl_buffer_bind_storage(&shade->statistics, BIND_STATISTICS);
    if (frame->state->light_count) {
        light_lists_bind(desc->lists, program);
        if (frame->needs->area_samples > 1)
            light_areas_bind(&shade->areas, frame, program);
        if (desc->traced)
            traced_shadows_bind(desc->traced, program);
        else if (frame->needs->area_samples <= 1) /* else there are no maps, and units are shared */
            shadow_system_bind(desc->shadows, program);
    }
    pixel_lists_bind(desc->pixels, program);
    return program;
}

/* A pass over the window, in pieces of rows or of list entries. */
struct shade_pass {
    struct shade *shade;
    const struct shade_desc *desc;
    const struct light_slice *slice;
    struct gpu_scope_desc scope;
    bool for_pixels;
    uint64_t units, granule; /* rows, in eights; or entries, in groups */
    uint64_t unit_items;     /* pixels of a row */
    bool is_apart;           /* for pixels: those of the list; units 0: the device knows how many */
    uint32_t first;          /* of the list */
};

static void set_list_pixels(const struct camera_window *window, const struct gl_program *program)
{
    gl_program_set_u(program, "u_width_px", (uint32_t)window->width);
    gl_program_set_u(program, "u_pixels", (uint32_t)(window->width * window->height));
}

static const struct gl_program *begin_entries(const struct shade_pass *pass, struct error *err)
{
    const struct gl_program *program =
        prepare_program(pass->shade, pass->desc, pass->slice, entries_file, false, err);
    if (program)
        set_list_pixels(&pass->desc->frame->window, program);
    return program;
}

/* In the picture, or behind what a screen shows of it. */
static void set_background(const struct view *view, const struct gl_program *program)
{
    const struct view_screen *screen = &view->screen;
    const float *b = view->background, none[4] = {0};
    const float background[4] = {b[0] * b[3], b[1] * b[3], b[2] * b[3], b[3]};
    gl_program_set_f4(program, "u_background", screen->has_backdrop ? none : background);
    if (!screen->has_backdrop)
        return;
    float backdrop[4];
    view_backdrop(view, backdrop);
    gl_program_set_f4(program, "u_backdrop", backdrop);
    gl_program_set_f(program, "u_gain", tone_map_gain(&screen->mapping));
    gl_program_set_u(program, "u_is_neutral", screen->mapping.operator_ == TONE_MAPPING_NEUTRAL);
}

static const struct gl_program *begin_pixels(const struct shade_pass *pass, struct error *err)
{
    const struct window_frame *frame = pass->desc->frame;
    const struct gl_program *program =
        prepare_program(pass->shade, pass->desc, pass->slice, pixels_file, true, err);
    if (!program)
        return NULL;
    set_background(frame->view, program);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    if (frame->targets->parts.name)
        glBindImageTexture(1, frame->targets->parts.name, 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    glBindImageTexture(0, frame->targets->image.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    if (pass->is_apart)
        apart_bind(frame->targets);
    else if (apart_is_possible(frame))
        glBindImageTexture(2, frame->targets->light.name, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R32UI);
    return program;
}

static const struct gl_program *begin_pass(const struct shade_pass *pass, struct error *err)
{
    const struct gl_program *program =
        pass->for_pixels ? begin_pixels(pass, err) : begin_entries(pass, err);
    if (!program)
        return NULL;
    gpu_scope_begin(pass->desc->frame->timeline, &pass->scope);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                    GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT |
                    (pass->is_apart ? GL_COMMAND_BARRIER_BIT : 0));
    return program;
}

/* Pixels of the list: a thread each. */
static void dispatch_apart(const struct shade_pass *pass, const struct gl_program *program,
                           const struct bands *bands)
{
    gl_program_set_u(program, "u_first_entry", pass->first + (uint32_t)bands->first);
    if (pass->units) {
        window_dispatch_items(bands->count);
        return;
    }
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, pass->desc->frame->targets->apart.name);
    glDispatchComputeIndirect((GLintptr)apart_groups_bytes_at(pass->desc->frame->targets));
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
}

static void dispatch(const struct shade_pass *pass, const struct gl_program *program,
                     const struct bands *bands)
{
    if (pass->is_apart) {
        dispatch_apart(pass, program, bands);
    } else if (pass->for_pixels) {
        gl_program_set_u(program, "u_first_row", (uint32_t)bands->first);
        window_dispatch_rows(pass->desc->frame, (int)bands->count);
    } else {
        gl_program_set_u(program, "u_first_entry", (uint32_t)bands->first);
        gl_program_set_u(program, "u_entries", (uint32_t)(bands->first + bands->count));
        window_dispatch_items(bands->count);
    }
}

/* The units of the first piece; 0: all of them. */
static uint64_t first_piece(const struct shade_pass *pass)
{
    enum band_kind kind = pass->for_pixels ? BAND_PIXELS : BAND_ENTRIES;
    uint64_t items = band_pace_first(&pass->desc->pace, kind, pass->shade->first_band);
    return pass->desc->pause ? (items + pass->unit_items - 1) / pass->unit_items : 0;
}

static void tell_part(const struct shade_desc *desc, const struct light_slice *slice, double done)
{
    if (desc->advance)
        desc->advance(desc->advance_context, (slice->part + done) / slice->parts,
                      (1 - done) / slice->parts);
}

/* In pieces where others may go first: they would wait for what the device was given. */
static bool run_pass(const struct shade_pass *pass, struct error *err)
{
    const struct shade_pause *pause = pass->desc->pause;
    struct gpu_timeline *timeline = pass->desc->frame->timeline;
    struct bands bands =
        bands_begin(pass->units ? pass->units : 1, first_piece(pass), pass->granule);
    struct band_clock clock = {.timeline = timeline,
                               .is_software = pass->desc->frame->limits->is_software};
    const struct gl_program *program = begin_pass(pass, err);
    tell_part(pass->desc, pass->slice, 0);
    while (program && bands_next(&bands)) {
        band_clock_begin(&clock);
        dispatch(pass, program, &bands);
        if (!pause || bands_is_last(&bands))
            break;
        band_clock_end(&clock, &bands);
        tell_part(pass->desc, pass->slice,
                  (double)(bands.first + bands.count) / (double)pass->units);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
        if (!pause->is_due(pause->context))
            continue;
        gpu_scope_end(timeline);
        program = pause->serve(pause->context, err) ? begin_pass(pass, err) : NULL;
    }
    band_clock_finish(&clock);
    if (program)
        gpu_scope_end(timeline);
    return program != NULL;
}

static bool shade_entries(struct shade *shade, const struct shade_desc *desc,
                          const struct light_slice *slice, struct error *err)
{
    char because[REPORT_TEXT_BYTES];
    if (desc->pixels->is_guessed)
        snprintf(because, sizeof because, "transparent surface samples are lit");
    else
        snprintf(because, sizeof because, "%llu transparent surface samples are lit",
                 (unsigned long long)desc->pixels->entry_count);
    const struct shade_pass pass = {.shade = shade,
                                    .desc = desc,
                                    .slice = slice,
                                    .scope = {.pass = "shade.transparent",
                                              .because = because,
                                              .technique = "lists",
                                              .stage = REPORT_SHADE},
                                    .units = desc->pixels->entry_count,
                                    .granule = 64,
                                    .unit_items = 1};
    return run_pass(&pass, err);
}

static bool shade_pixels(struct shade *shade, const struct shade_desc *desc,
                         const struct light_slice *slice, struct error *err)
{
    const struct window_frame *frame = desc->frame;
    const struct shade_pass pass = {
        .shade = shade,
        .desc = desc,
        .slice = slice,
        .scope = {.pass = "shade.opaque",
                  .because = "the color output was asked for",
                  .technique = frame->targets->samples > 1 ? "msaa4" : "",
                  .stage = REPORT_SHADE},
        .for_pixels = true,
        .units = (uint64_t)frame->window.height,
        .granule = 8,
        .unit_items = (uint64_t)frame->window.width};
    return run_pass(&pass, err);
}

/* The samples of `count` pixels in which light differs, from the first-th on; 0: of all. Where
 * others may go first they come in pieces, for which our own processors tell their number; they are
 * one piece on other devices, which would be waited for. */
static bool shade_apart(struct shade *shade, const struct shade_desc *desc,
                        const struct light_slice *slice, uint32_t first, uint32_t count,
                        struct error *err)
{
    const struct window_frame *frame = desc->frame;
    struct shade_desc place = *desc;
    if (!count && desc->pause && frame->limits->is_software) {
        count = apart_count(frame);
        if (!count)
            return true;
    }
    place.pause = count ? desc->pause : NULL;
    const struct shade_pass pass = {
        .shade = shade,
        .desc = &place,
        .slice = slice,
        .scope = {.pass = "shade.apart",
                  .because = "samples are lit apart where light differs",
                  .technique = "msaa4",
                  .stage = REPORT_SHADE},
        .for_pixels = true,
        .is_apart = true,
        .first = first,
        .units = count,
        .granule = 64,
        .unit_items = (uint64_t)frame->targets->samples};
    return run_pass(&pass, err);
}

/* A batch of lights: its sums would not be told from those of the others. What follows finds 0. */
static void take_lookups(struct shade *shade, const struct shade_desc *desc)
{
    uint32_t words[READBACK_LOOKUP_WORDS] = {0}; /* a lost context reads nothing */
    gpu_timeline_will_wait(desc->frame->timeline);
    gl_buffer_read(&shade->statistics, STATISTICS_LOOKUPS * 4, sizeof words, words);
    gl_buffer_clear_u32(&shade->statistics, 0, STATISTICS_WORDS * 4, 0);
    for (int i = 0; i < READBACK_LOOKUP_WORDS; i++)
        desc->frame->report->counts.lookups += words[i];
}

static uint64_t count_shadowed(const struct shade_desc *desc)
{
    uint64_t count = desc->traced ? desc->frame->state->light_count : 0;
    for (size_t i = 0; !desc->traced && i < desc->frame->state->light_count; i++)
        count += shadow_system_record(desc->shadows, i) != NO_SHADOW;
    return count;
}

bool shade_takes_samples_in_turn(const struct gl_limits *limits)
{
    return !limits->is_software;
}

static uint64_t steps_of_layers(const struct window_frame *frame, uint64_t longest,
                                bool is_walked_twice)
{
    uint64_t walks =
        shade_takes_samples_in_turn(frame->limits) ? (uint64_t)frame->targets->samples : 1;
    return walks * loop_steps_of_layers(longest, is_walked_twice);
}

/* Without what only drawing tells. */
static struct loop_lights loops_before(const struct window_frame *frame, bool is_traced)
{
    const struct shadow_method *method = shadow_method_of(frame->view->quality.shadows);
    struct loop_lights loops = {
        .taps = is_traced ? 0 : count_taps(frame, false),
        .points = (uint32_t)frame->needs->area_samples,
        .walks_lists = method && method->is_walked,
        .surfaces = (uint32_t)frame->targets->samples,
    };
    for (uint32_t i = 0; i < frame->state->scene->material_count; i++)
        loops.walks_lists |= frame->state->materials[i].no_self_shadow;
    return loops;
}

static struct loop_lights loops_of(const struct shade_desc *desc)
{
    const struct pixel_lists *pixels = desc->pixels;
    struct loop_lights loops = loops_before(desc->frame, desc->traced);
    loops.shadowed = count_shadowed(desc);
    uint64_t longest = shadow_system_longest_list(desc->shadows);
    loops.longest_list = desc->frame->report->counts.longest_list;
    if (loops.longest_list < longest)
        loops.longest_list = longest;
    loops.besides = steps_of_layers(desc->frame, pixels->longest, pixels->may_surround);
    return loops;
}

/* They have no end, so that every list has them. */
static size_t count_everywhere(const struct scene_state *state)
{
    size_t count = 0;
    for (size_t i = 0; i < state->light_count; i++)
        count += state->lights[i].type == SCENE_LIGHT_DIRECTIONAL || !(state->lights[i].range > 0);
    return count;
}

/* Whether rays to all lights from all points may be more than one upload holds. */
static bool may_exceed_rays(const struct shade_parts_desc *desc)
{
    const struct window_frame *frame = desc->frame;
    uint64_t points = (uint64_t)frame->view->width_px * (uint64_t)frame->view->height_px *
                      (uint64_t)frame->targets->samples;
    uint64_t each = frame->needs->area_samples > 1 ? (uint64_t)frame->needs->area_samples : 1;
    uint64_t most = traced_shadows_points_max(frame->limits);
    if (desc->has_layers || points > most)
        points = most;
    return frame->state->light_count * each > TRACED_FILTERS_MAX / points;
}

int shade_list_parts(const struct shade_parts_desc *desc, bool may[SHADE_PARTS])
{
    enum { LONG = 4096 };
    const struct window_frame *frame = desc->frame;
    struct loop_lights least = loops_before(frame, desc->is_traced), most = least;
    bool can = frame->view->quality.light_lists != VIEW_LIGHT_LISTS_LINKED;
    most.shadowed = desc->shadowed_count;
    most.longest_list = LONG;
    most.besides = desc->has_layers ? steps_of_layers(frame, LONG, false) : 0;
    bool must = can && count_everywhere(frame->state) > loop_steps_room(&least, desc->loop_steps);
    bool may_slice =
        must || (can && (frame->state->light_count > loop_steps_room(&most, desc->loop_steps) ||
                         (desc->is_traced && may_exceed_rays(desc))));
    may[SHADE_AT_ONCE] = !must && !desc->is_in_batches;
    may[SHADE_IN_BATCHES] = !must && desc->is_in_batches;
    may[SHADE_IN_SLICES] = may_slice;
    return !must + may_slice;
}

/* Long light lists are walked in several dispatches, each going on with the sums of the one before
 * it (renderer/shading/loop_steps.h). */
static bool choose_slices(const struct shade *shade, const struct shade_desc *desc,
                          struct light_slice *slice, uint32_t *slice_count, struct error *err)
{
    uint32_t longest = desc->frame->state->light_count ? light_lists_longest(desc->lists) : 0;
    const struct loop_lights loops = loops_of(desc);
    uint64_t per_slice = loop_steps_room(&loops, shade->loop_steps);
    if (desc->traced && longest) {
        uint32_t room = traced_shadows_room(desc->traced, light_lists_clusters(desc->lists));
        per_slice = per_slice < room ? per_slice : room;
    }
    *slice_count = 1;
    *slice = (struct light_slice){.count = longest, .is_whole = true};
    if (loops.besides > shade->loop_steps)
        return error_set(err, ERROR_OVER_BUDGET,
                         "%llu transparent layers at one pixel take %llu loop steps, limit is "
                         "%llu: ask for fewer quality.samples",
                         (unsigned long long)desc->pixels->longest,
                         (unsigned long long)loops.besides, (unsigned long long)shade->loop_steps);
    if (longest <= per_slice)
        return true;
    if (!per_slice || desc->frame->view->quality.light_lists == VIEW_LIGHT_LISTS_LINKED)
        return error_set(
            err, ERROR_OVER_BUDGET,
            "%u lights at one point take %llu loop steps, limit is %llu: ask for fewer "
            "quality.samples, shadow_taps or area_samples",
            longest, (unsigned long long)loop_steps_of_lights(&loops, longest),
            (unsigned long long)shade->loop_steps);
    *slice = (struct light_slice){.count = (uint32_t)per_slice};
    *slice_count = (longest + slice->count - 1) / slice->count;
    return true;
}

static bool shade_slice(struct shade *shade, const struct shade_desc *desc,
                        struct light_slice *slice, struct error *err)
{
    if (desc->is_apart) {
        bool is_lit = shade_apart(shade, desc, slice, 0, 0, err);
        slice->part++;
        return is_lit;
    }
    if (desc->traced) {
        tell_part(desc, slice, 0);
        if (!traced_shadows_trace(desc->traced, light_lists_clusters(desc->lists), slice->first,
                                  slice->count, err))
            return false;
        slice->part++;
    }
    if (desc->pixels->entry_count) {
        if (!shade_entries(shade, desc, slice, err))
            return false;
        slice->part++;
    }
    bool is_shaded = shade_pixels(shade, desc, slice, err);
    slice->part++;
    return is_shaded;
}

static bool shade_slices(struct shade *shade, const struct shade_desc *desc,
                         struct light_slice *slice, uint32_t slice_count, struct error *err)
{
    slice->first = 0;
    for (uint32_t i = 0; i < slice_count; i++, slice->first += slice->count) {
        slice->is_first = i == 0 && !desc->is_continued;
        slice->is_last = i + 1 == slice_count && !desc->continues;
        if (!shade_slice(shade, desc, slice, err))
            return false;
    }
    return true;
}

/* Points of `*count` pixels, or of fewer: as many as have room for a light at once. */
static bool collect_piece(const struct shade_desc *desc, uint32_t first, uint32_t *count,
                          struct error *err)
{
    const struct clusters *clusters = light_lists_clusters(desc->lists);
    for (;;) {
        if (!traced_shadows_collect_apart(desc->traced, desc->frame, first, *count, err))
            return false;
        if (*count <= 64 || !clusters->longest || traced_shadows_room(desc->traced, clusters))
            return true;
        *count = (*count / 2 + 63) / 64 * 64;
    }
}

/* The samples apart of some pixels of the list, with traced shadows of their own. */
static bool shade_traced_piece(struct shade *shade, const struct shade_desc *desc, uint32_t first,
                               uint32_t count, struct error *err)
{
    const struct clusters *clusters = light_lists_clusters(desc->lists);
    struct light_slice slice;
    uint32_t slices;
    bool ok = choose_slices(shade, desc, &slice, &slices, err) &&
              (slices == 1 || targets_prepare_parts(desc->frame->targets, err));
    for (uint32_t i = 0; ok && i < slices; i++, slice.first += slice.count) {
        slice.is_first = i == 0;
        slice.is_last = i + 1 == slices;
        slice.parts = 1;
        ok = traced_shadows_trace(desc->traced, clusters, slice.first, slice.count, err) &&
             shade_apart(shade, desc, &slice, first, count, err);
    }
    return ok;
}

/* No more pixels at a time than what the points of the window had room for. */
static bool shade_apart_traced(struct shade *shade, const struct shade_desc *desc,
                               struct error *err)
{
    uint32_t count = apart_count(desc->frame), piece;
    uint32_t room = traced_shadows_apart_room(desc->traced, desc->frame->targets->samples);
    for (uint32_t first = 0; first < count; first += piece) {
        piece = count - first < room ? count - first : room;
        if (!collect_piece(desc, first, &piece, err) ||
            !shade_traced_piece(shade, desc, first, piece, err))
            return false;
    }
    return true;
}

/* Where all lights are in the picture: which samples are shaded apart, and these where all lights
 * are at hand. */
static bool shade_differing(struct shade *shade, const struct shade_desc *desc,
                            struct light_slice *slice, uint32_t slice_count, struct error *err)
{
    struct shade_desc apart = *desc;
    apart.is_apart = true;
    shade->has_apart = true;
    if (!apart_find(desc->frame, err))
        return false;
    if (desc->traced) { /* however many pieces these are */
        apart.advance = NULL;
        return shade_apart_traced(shade, &apart, err);
    }
    return desc->is_continued || shade_slices(shade, &apart, slice, slice_count, err);
}

bool shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err)
{
    bool may_differ = apart_is_possible(desc->frame) && !desc->is_apart;
    struct light_slice slice;
    uint32_t slice_count;
    if (!choose_slices(shade, desc, &slice, &slice_count, err))
        return false;
    if (slice_count == 1 && !desc->is_continued && !desc->continues)
        gl_texture_finish(&desc->frame->targets->parts);
    else if (!targets_prepare_parts(desc->frame->targets, err))
        return false;
    if (may_differ && !targets_prepare_apart(desc->frame->targets, err))
        return false;
    gl_buffer_clear_u32(&shade->statistics, 0, STATISTICS_WORDS * 4, 0);
    desc->frame->report->counts.light_slices += desc->is_apart ? 0 : slice_count;
    slice.parts = (int)slice_count *
                  (1 + (desc->traced != NULL) + (desc->pixels->entry_count > 0) +
                   (may_differ && !desc->traced && !desc->is_continued && !desc->continues));
    if (desc->is_apart)
        slice.parts = (int)slice_count;
    shade->has_apart = desc->is_apart;
    if (!shade_slices(shade, desc, &slice, slice_count, err) ||
        (may_differ && !desc->continues && !shade_differing(shade, desc, &slice, slice_count, err)))
        return false;
    if (desc->is_continued || desc->continues)
        take_lookups(shade, desc);
    return true;
}

bool shade_send_color(struct shade *shade, struct readback *readback,
                      const struct readback_desc *desc, struct error *err)
{
    struct readback_desc whole = *desc;
    if (shade->has_apart)
        gl_buffer_copy(&desc->frame->targets->apart, apart_count_bytes_at(desc->frame->targets),
                       &shade->statistics, STATISTICS_COUNTS * 4, 4);
    whole.counts = &shade->statistics;
    whole.counts_offset_bytes = STATISTICS_COUNTS * 4;
    return readback_send(readback, &whole, err);
}

void shade_finish(struct shade *shade)
{
    gl_buffer_finish(&shade->lights);
    gl_buffer_finish(&shade->statistics);
    light_areas_finish(&shade->areas);
}
