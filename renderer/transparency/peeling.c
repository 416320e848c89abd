/* SPDX-License-Identifier: MIT */
/* Peeling layers, from one side or from both. */
#include "renderer/transparency/peeling.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "shaders/shared/bindings.h"

enum {
    LAYERS_MOST = 512, /* three draws for each, or for two: a frame ends in bounded time */
    LOOK_SETS = 8,     /* between waits for the device */
    STATE_BYTES = 16,  /* of a pixel and a side */
    SUMS_BYTES = 48,   /* of a sample and a side */
};

const char peeling_pass[] = "transparency.peel";
static const char compositing_pass[] = "transparency.composite";

const struct transparency_pass peeling_passes[] = {
    {.name = pixel_lists_counting_pass},
    {.name = peeling_pass, .is_conditional = true, .is_of_light = true},
    {.name = pixel_lists_lighting_pass, .is_conditional = true, .is_of_light = true},
    {.name = compositing_pass, .is_conditional = true, .is_of_light = true},
    {.name = NULL},
};

/* ---- programs ---- */

enum adding { ADDING_BEGINS, ADDING_A_LAYER };

static struct program_desc adding_of(const struct peeling *peeling,
                                     const struct window_frame *frame, enum adding adding,
                                     char defines[32])
{
    snprintf(defines, 32, "SAMPLES=%d PASS=%d", frame->targets->samples, (int)adding);
    return (struct program_desc){
        .label = peeling->adding, .compute = peeling->adding, .defines = defines};
}

void peeling_list_programs(const struct peeling *peeling, const struct window_frame *frame,
                           const struct geometry_items *items, struct program_list *list)
{
    char defines[32];
    pixel_lists_list_counting(frame, items, list);
    for (int i = 0; i < PEELING_DRAWS; i++)
        geometry_list_transparent(frame, items, &peeling->draws[i], list);
    struct program_desc desc = adding_of(peeling, frame, ADDING_BEGINS, defines);
    program_list_add(list, peeling_pass, &desc, true);
    desc = adding_of(peeling, frame, ADDING_A_LAYER, defines);
    program_list_add(list, compositing_pass, &desc, true);
}

/* ---- finding ---- */

static uint64_t layers_of(const struct layers *layers)
{
    return layers->longest < LAYERS_MOST ? layers->longest : LAYERS_MOST;
}

static uint64_t sets_of(const struct peeling *peeling, const struct layers *layers)
{
    return (layers_of(layers) + peeling->sides - 1) / peeling->sides;
}

static uint64_t state_bytes(const struct peeling *peeling, const struct layers *layers)
{
    return layers->lists.pixel_count * STATE_BYTES * peeling->sides;
}

static uint64_t sample_bytes(const struct peeling *peeling, const struct window_frame *frame)
{
    return SUMS_BYTES * peeling->sides * (uint64_t)frame->targets->samples;
}

/* Surfaces of the pixels that have more of them than are peeled. */
static bool count_dropped(struct layers *layers, struct error *err)
{
    uint64_t pixels = layers->lists.pixel_count;
    uint32_t before = 0, *ends = calloc(pixels, sizeof *ends); /* a lost context reads nothing */
    if (!ends)
        return error_set(err, ERROR_NO_MEMORY, "layers of %llu pixels", (unsigned long long)pixels);
    gl_buffer_read(&layers->lists.ends, 0, pixels * sizeof *ends, ends);
    for (uint64_t i = 0; i < pixels; before = ends[i++])
        if (ends[i] > before + LAYERS_MOST)
            layers->peeled.dropped += ends[i] - before - LAYERS_MOST;
    free(ends);
    return true;
}

static bool reserve(const struct peeling *peeling, struct layers *layers,
                    const struct window_frame *frame, struct error *err)
{
    uint64_t state = state_bytes(peeling, layers);
    uint64_t sums = layers->lists.pixel_count * sample_bytes(peeling, frame);
    const struct gl_buffer_desc of_state = {
        .label = "peeled.state", .size_bytes = state, .is_dynamic = true};
    const struct gl_buffer_desc of_sums = {
        .label = "peeled.sums", .size_bytes = sums, .is_dynamic = true};
    bool ok = pixel_lists_reserve(layers, err) &&
              gl_buffer_reserve(&layers->peeled.state, &of_state, false, err) &&
              gl_buffer_reserve(&layers->peeled.sums, &of_sums, false, err);
    layers->peeled.bytes = layers->lists.list_bytes + state + sums;
    return ok;
}

void peeling_report(const struct layers *layers, struct frame_report *report)
{
    report->counts.transparent_fragments += layers->layer_count;
    if (report->counts.longest_pixel_list < layers->longest)
        report->counts.longest_pixel_list = layers->longest;
    report_raise_bytes(report, "peeled_layers", layers->peeled.bytes);
    if (layers->peeled.dropped && !report->counts.dropped_layers)
        report_warn(report,
                    "a pixel has %llu transparent layers, and %s ends after %d of them: the "
                    "others are left out",
                    (unsigned long long)layers->longest, transparency_name((int)layers->method->id),
                    LAYERS_MOST);
    report->counts.dropped_layers += layers->peeled.dropped;
}

enum layers_outcome peeling_find(const struct peeling *peeling, struct layers *layers,
                                 const struct window_frame *frame,
                                 const struct geometry_items *items, struct error *err)
{
    if (!pixel_lists_find_sizes(layers, frame, items, err))
        return LAYERS_FAILED;
    if (!layers->layer_count)
        return LAYERS_FOUND;
    uint64_t pixels = layers->lists.pixel_count, entries = pixels * peeling->sides;
    uint64_t each = sample_bytes(peeling, frame);
    if (pixels > gl_limits_block(frame->limits, each) ||
        entries > pixel_lists_entries_max(frame->limits) ||
        !pixel_lists_find_room(layers, entries, state_bytes(peeling, layers) + pixels * each))
        return LAYERS_TOO_MANY;
    if (!reserve(peeling, layers, frame, err) ||
        (layers->longest > LAYERS_MOST && !count_dropped(layers, err)))
        return LAYERS_FAILED;
    peeling_report(layers, frame->report);
    return LAYERS_FOUND;
}

/* ---- peeling ---- */

void peeling_bind(const struct layers *layers, const struct gl_program *program)
{
    pixel_lists_bind(layers, program);
    if (program)
        gl_program_set_u(program, "u_entries", (uint32_t)layers->lists.entry_count);
    gl_buffer_bind_storage(&layers->peeled.state, BIND_PEELED);
    gl_buffer_bind_storage(&layers->peeled.sums, BIND_PEELED_SUMS);
}

static struct gpu_scope_desc scope_of(const struct peeling *peeling, const struct layers *layers,
                                      const char *pass)
{
    return (struct gpu_scope_desc){.pass = pass,
                                   .because = peeling->sides > 1
                                                  ? "transparent layers are peeled, two at a time"
                                                  : "transparent layers are peeled, one at a time",
                                   .technique = transparency_name((int)layers->method->id),
                                   .stage = REPORT_SHADE};
}

/* Begins the sums of all pixels, or adds the layers that are lit. */
static bool add(const struct peeling *peeling, const struct layers *layers,
                const struct window_frame *frame, enum adding adding, bool is_continued,
                struct error *err)
{
    char defines[32];
    const struct program_desc desc = adding_of(peeling, frame, adding, defines);
    const struct gl_program *program = program_cache_get(frame->programs, &desc, err);
    if (!program)
        return false;
    gl_program_use(program);
    gl_program_set_u(program, "u_pixels", (uint32_t)layers->lists.pixel_count);
    gl_program_set_u(program, "u_is_continued", is_continued);
    peeling_bind(layers, program);
    gl_buffer_bind_storage(&layers->lists.statistics, BIND_STATISTICS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(layers->lists.pixel_count);
    return true;
}

static bool begin_sums(const struct peeling *peeling, const struct layers *layers,
                       const struct window_frame *frame, bool is_continued, struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(peeling, layers, peeling_pass);
    gpu_scope_begin(frame->timeline, &scope);
    bool ok = add(peeling, layers, frame, ADDING_BEGINS, is_continued, err);
    gpu_scope_end(frame->timeline);
    return ok;
}

/* The nearest layer of each pixel behind the last one becomes its entry, and the farthest before
 * the last one from behind its other one. */
static bool peel(const struct peeling *peeling, const struct layers *layers,
                 const struct window_frame *frame, const struct geometry_items *items,
                 struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(peeling, layers, peeling_pass);
    bool ok = true;
    gpu_scope_begin(frame->timeline, &scope);
    peeling_bind(layers, NULL);
    for (int i = 0; i < PEELING_DRAWS && ok; i++) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        const struct geometry_layer_pass *draw = &peeling->draws[i];
        ok = geometry_draw_transparent(frame, items, draw->fragment, draw->evaluates, err);
    }
    gpu_scope_end(frame->timeline);
    return ok;
}

static bool composite(const struct peeling *peeling, const struct layers *layers,
                      const struct window_frame *frame, struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(peeling, layers, compositing_pass);
    gpu_scope_begin(frame->timeline, &scope);
    bool ok = add(peeling, layers, frame, ADDING_A_LAYER, false, err);
    gpu_scope_end(frame->timeline);
    return ok;
}

static void forget_whether_it_goes_on(struct layers *layers)
{
    gl_buffer_clear_u32(&layers->lists.statistics, STATISTICS_PEELING * 4, 4, 0);
}

/* Whether a pixel that had a layer since then lets something through. */
static bool goes_on(const struct layers *layers, const struct window_frame *frame)
{
    uint32_t is_peeling = 0; /* a lost context reads nothing */
    gpu_timeline_will_wait(frame->timeline);
    gl_buffer_read(&layers->lists.statistics, STATISTICS_PEELING * 4, 4, &is_peeling);
    return is_peeling;
}

static void bind_window(const struct window_frame *frame, const struct gl_program *program)
{
    const struct camera_window *window = &frame->window;
    gl_program_set_u(program, "u_width_px", (uint32_t)window->width);
}

const struct surface_kind peeling_surfaces = {
    .pass = pixel_lists_lighting_pass,
    .program = "shade_surfaces.comp.glsl",
    .source = "peeled_surfaces.glsl",
    .are_transparent = true,
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_LAYERS,
    .bind = bind_window,
};

/* Each part of the lights peels anew: a layer's share of the picture does not depend on light. */
bool peeling_light(const struct peeling *peeling, struct layers *layers,
                   const struct window_frame *frame, const struct geometry_items *items,
                   const struct surface_lighter *lighter, struct error *err)
{
    struct surface_set set = {.kind = &peeling_surfaces,
                              .count = layers->lists.entry_count,
                              .technique = transparency_name((int)layers->method->id)};
    uint64_t count = layers->layer_count ? sets_of(peeling, layers) : 0, done = 0;
    if (!count)
        return true;
    snprintf(set.because, sizeof set.because, "transparent layers are lit, %s at a time",
             peeling->sides > 1 ? "two" : "one");
    if (!begin_sums(peeling, layers, frame, lighter->is_continued, err))
        return false;
    do {
        bool is_last_before_look = (done + 1) % LOOK_SETS == 0;
        if (is_last_before_look)
            forget_whether_it_goes_on(layers);
        if (!peel(peeling, layers, frame, items, err) ||
            !lighter->light(lighter->context, &set, err) || !composite(peeling, layers, frame, err))
            return false;
        done++;
    } while (done < count && (done % LOOK_SETS || goes_on(layers, frame)));
    uint64_t peeled = done < count ? done * peeling->sides : layers_of(layers);
    if (frame->report->counts.peeled_layers < peeled)
        frame->report->counts.peeled_layers = peeled;
    return true;
}

int peeling_count_sets(const struct peeling *peeling, const struct layers *layers)
{
    return layers->layer_count ? (int)sets_of(peeling, layers) : 0;
}

/* ---- memory ---- */

void peeling_clear(struct layers *layers)
{
    pixel_lists_clear(layers);
    layers->peeled.bytes = layers->peeled.dropped = 0;
}

void peeling_finish(struct layers *layers)
{
    pixel_lists_finish(layers);
    gl_buffer_finish(&layers->peeled.state);
    gl_buffer_finish(&layers->peeled.sums);
    layers->peeled.bytes = layers->peeled.dropped = 0;
}

uint64_t peeling_size_bytes(const struct layers *layers)
{
    return pixel_lists_size_bytes(layers) + layers->peeled.state.size_bytes +
           layers->peeled.sums.size_bytes;
}
