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

static void bounds_join(struct window_bounds *a, const struct window_bounds *b)
{
    struct window_bounds old = *a;
    if (!b->width)
        return;
    *a = *b;
    if (!old.width)
        return;
    a->x = old.x < b->x ? old.x : b->x;
    a->y = old.y < b->y ? old.y : b->y;
    int right = old.x + old.width, top = old.y + old.height;
    a->width = (right > b->x + b->width ? right : b->x + b->width) - a->x;
    a->height = (top > b->y + b->height ? top : b->y + b->height) - a->y;
}

/* From how many layers each pixel has: in what bounds each set has any, so that it is drawn nowhere
 * else, and how many layers are beyond those that are peeled. */
static bool read_counts(const struct peeling *peeling, struct layers *layers,
                        const struct window_frame *frame, struct error *err)
{
    uint64_t pixels = layers->lists.pixel_count, sets = sets_of(peeling, layers);
    uint64_t width = (uint64_t)frame->window.width;
    uint32_t before = 0, *ends = calloc(pixels, sizeof *ends); /* a lost context reads nothing */
    free(layers->peeled.bounds);
    struct window_bounds *bounds = layers->peeled.bounds = calloc(sets, sizeof *bounds);
    if (!ends || !bounds) {
        free(ends);
        return error_set(err, ERROR_NO_MEMORY, "layers of %llu pixels", (unsigned long long)pixels);
    }
    gl_buffer_read(&layers->lists.ends, 0, pixels * sizeof *ends, ends);
    for (uint64_t i = 0; i < pixels; before = ends[i++]) {
        uint64_t count = ends[i] - before, most = layers_of(layers);
        if (count > most) {
            layers->peeled.dropped += count - most;
            count = most;
        }
        if (count)
            bounds_join(&bounds[(count - 1) / peeling->sides],
                        &(struct window_bounds){(int)(i % width), (int)(i / width), 1, 1});
    }
    for (uint64_t i = sets - 1; i > 0; i--)
        bounds_join(&bounds[i - 1], &bounds[i]);
    free(ends);
    return true;
}

/* The rows of those bounds, as pixels. */
static struct pixel_range {
    uint64_t first, count;
} rows_of(const struct layers *layers, const struct window_frame *frame, uint64_t set)
{
    const struct window_bounds *bounds = &layers->peeled.bounds[set];
    uint64_t width = (uint64_t)frame->window.width;
    if (!bounds->width)
        return (struct pixel_range){.count = layers->lists.pixel_count};
    return (struct pixel_range){(uint64_t)bounds->y * width, (uint64_t)bounds->height * width};
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
    if (!reserve(peeling, layers, frame, err) || !read_counts(peeling, layers, frame, err))
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

struct run { /* of a part of the lights */
    const struct peeling *peeling;
    struct layers *layers;
    const struct window_frame *frame;
    const struct geometry_items *items;
    bool is_continued; /* earlier lights have lit the layers */
};

static struct gpu_scope_desc scope_of(const struct run *run, const char *pass)
{
    return (struct gpu_scope_desc){.pass = pass,
                                   .because = run->peeling->sides > 1
                                                  ? "transparent layers are peeled, two at a time"
                                                  : "transparent layers are peeled, one at a time",
                                   .technique = transparency_name((int)run->layers->method->id),
                                   .stage = REPORT_SHADE};
}

/* Begins the sums of pixels, or adds the layers that are lit. */
static bool add(const struct run *run, enum adding adding, const struct pixel_range *pixels,
                uint64_t peeled, struct error *err)
{
    char defines[32];
    const struct program_desc desc = adding_of(run->peeling, run->frame, adding, defines);
    const struct gl_program *program = program_cache_get(run->frame->programs, &desc, err);
    if (!program)
        return false;
    gl_program_use(program);
    gl_program_set_u(program, "u_first", (uint32_t)pixels->first);
    gl_program_set_u(program, "u_pixels", (uint32_t)pixels->count);
    gl_program_set_u(program, "u_is_continued", run->is_continued);
    gl_program_set_u(program, "u_peeled", (uint32_t)peeled);
    peeling_bind(run->layers, program);
    gl_buffer_bind_storage(&run->layers->lists.statistics, BIND_STATISTICS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(pixels->count);
    return true;
}

static bool begin_sums(const struct run *run, struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(run, peeling_pass);
    const struct pixel_range all = {.count = run->layers->lists.pixel_count};
    gpu_scope_begin(run->frame->timeline, &scope);
    bool ok = add(run, ADDING_BEGINS, &all, 0, err);
    gpu_scope_end(run->frame->timeline);
    return ok;
}

/* The nearest layer of each pixel behind the last one becomes its entry, and the farthest before
 * the last one from behind its other one. */
static bool peel(const struct run *run, uint64_t set, struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(run, peeling_pass);
    struct window_frame bounded = *run->frame;
    bool ok = true;
    bounded.layer_bounds = run->layers->peeled.bounds[set];
    /* a pixel more: at the edge llvmpipe gives fragments other samples */
    if (bounded.layer_bounds.width) {
        bounded.layer_bounds.x--, bounded.layer_bounds.y--;
        bounded.layer_bounds.width += 2, bounded.layer_bounds.height += 2;
    }
    gpu_scope_begin(run->frame->timeline, &scope);
    peeling_bind(run->layers, NULL);
    for (int i = 0; i < PEELING_DRAWS && ok; i++) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        const struct geometry_layer_pass *draw = &run->peeling->draws[i];
        ok = geometry_draw_transparent(&bounded, run->items, draw->fragment, draw->evaluates, err);
    }
    gpu_scope_end(run->frame->timeline);
    return ok;
}

static bool composite(const struct run *run, uint64_t set, const struct pixel_range *pixels,
                      struct error *err)
{
    const struct gpu_scope_desc scope = scope_of(run, compositing_pass);
    gpu_scope_begin(run->frame->timeline, &scope);
    bool ok = add(run, ADDING_A_LAYER, pixels, (set + 1) * run->peeling->sides, err);
    gpu_scope_end(run->frame->timeline);
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

/* One set of layers, from drawing to compositing. */
static bool peel_set(const struct run *run, uint64_t index, const struct surface_lighter *lighter,
                     struct error *err)
{
    const struct pixel_range pixels = rows_of(run->layers, run->frame, index);
    uint64_t sides = run->peeling->sides;
    struct surface_set set = {.kind = &peeling_surfaces,
                              .first = pixels.first * sides,
                              .count = pixels.count * sides,
                              .technique = transparency_name((int)run->layers->method->id)};
    snprintf(set.because, sizeof set.because, "transparent layers are lit, %s at a time",
             sides > 1 ? "two" : "one");
    return peel(run, index, err) && lighter->light(lighter->context, &set, err) &&
           composite(run, index, &pixels, err);
}

/* Each part of the lights peels anew: a layer's share of the picture does not depend on light. */
bool peeling_light(const struct peeling *peeling, struct layers *layers,
                   const struct window_frame *frame, const struct geometry_items *items,
                   const struct surface_lighter *lighter, struct error *err)
{
    const struct run run = {.peeling = peeling,
                            .layers = layers,
                            .frame = frame,
                            .items = items,
                            .is_continued = lighter->is_continued};
    uint64_t count = layers->layer_count ? sets_of(peeling, layers) : 0, done = 0;
    if (!count)
        return true;
    if (!begin_sums(&run, err))
        return false;
    do {
        bool is_last_before_look = (done + 1) % LOOK_SETS == 0;
        if (is_last_before_look)
            forget_whether_it_goes_on(layers);
        if (!peel_set(&run, done, lighter, err))
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

static void forget_counts(struct layers *layers)
{
    free(layers->peeled.bounds);
    layers->peeled.bounds = NULL;
    layers->peeled.bytes = layers->peeled.dropped = 0;
}

void peeling_clear(struct layers *layers)
{
    pixel_lists_clear(layers);
    forget_counts(layers);
}

void peeling_finish(struct layers *layers)
{
    pixel_lists_finish(layers);
    gl_buffer_finish(&layers->peeled.state);
    gl_buffer_finish(&layers->peeled.sums);
    forget_counts(layers);
}

uint64_t peeling_size_bytes(const struct layers *layers)
{
    return pixel_lists_size_bytes(layers) + layers->peeled.state.size_bytes +
           layers->peeled.sums.size_bytes;
}
