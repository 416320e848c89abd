/* SPDX-License-Identifier: MIT */
/* Building the per-pixel lists of transparent surfaces. */
#include "renderer/transparency/pixel_lists.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "shaders/shared/bindings.h"

enum { LONGEST_GUESSED = LIST_RUN << 10 }; /* longer lists are read */
enum { SCAN_TILE = 2048 };                 /* TILE of shaders/transparency/lists_scan.comp.glsl */

static bool reserve(struct gl_buffer *buffer, const char *label, uint64_t bytes, struct error *err)
{
    return gl_buffer_reserve(
        buffer, &(struct gl_buffer_desc){.label = label, .size_bytes = bytes, .is_dynamic = true},
        false, err);
}

/* What is in use, as the buffer may have grown beyond a storage block. */
static void bind(const struct gl_buffer *buffer, uint64_t used_bytes, uint32_t binding)
{
    if (used_bytes)
        gl_buffer_bind_storage_range(buffer, 0, used_bytes, binding);
    else
        gl_buffer_bind_storage(buffer, binding);
}

uint64_t pixel_lists_entries_max(const struct gl_limits *limits)
{
    uint64_t most = gl_limits_block(limits, PIXEL_LISTS_ENTRY_BYTES);
    return most < PIXEL_LISTS_ENTRIES_MAX ? most : PIXEL_LISTS_ENTRIES_MAX;
}

static const char sort_file[] = "lists_sort.comp.glsl";
static const char *const scan_passes[] = {"PASS=0", "PASS=1", "PASS=2"};
/* Runs, their merging by rank, and by one thread each. */
static const char *const sort_passes[] = {"PASS=0", "PASS=1", "PASS=2"};
const char pixel_lists_counting_pass[] = "transparency.count";
static const struct geometry_layer_pass counting = {.pass = pixel_lists_counting_pass,
                                                    .fragment = "lists_count.frag.glsl"};
const char pixel_lists_scattering_pass[] = "transparency.scatter";
static const struct geometry_layer_pass scattering = {.pass = pixel_lists_scattering_pass,
                                                      .fragment = "lists_scatter.frag.glsl",
                                                      .evaluates = true,
                                                      .is_conditional = true};

const char pixel_lists_lighting_pass[] = "shade.transparent";

const struct transparency_pass pixel_lists_passes[] = {
    {.name = pixel_lists_counting_pass},
    {.name = pixel_lists_scattering_pass, .is_conditional = true},
    {.name = "transparency.sort", .is_conditional = true},
    {.name = pixel_lists_lighting_pass, .is_conditional = true, .is_of_light = true},
    {.name = NULL},
};

static struct program_desc compute_of(const char *file, const char *defines)
{
    return (struct program_desc){.label = file, .compute = file, .defines = defines};
}

static const struct gl_program *get_compute(const struct window_frame *frame, const char *file,
                                            const char *defines, struct error *err)
{
    const struct program_desc desc = compute_of(file, defines);
    return program_cache_get(frame->programs, &desc, err);
}

/* In shared memory, or where barriers cost more than they gain without. */
static const char *scan_file_of(const struct gl_limits *limits)
{
    return limits->is_software ? "lists_scan_chunks.comp.glsl" : "lists_scan.comp.glsl";
}

void pixel_lists_list_counting(const struct window_frame *frame, const struct geometry_items *items,
                               struct program_list *list)
{
    window_list_clear(frame, counting.pass, list);
    geometry_list_transparent(frame, items, &counting, list);
    for (int i = 0; i < 3; i++) {
        const struct program_desc desc = compute_of(scan_file_of(frame->limits), scan_passes[i]);
        program_list_add(list, counting.pass, &desc, false);
    }
}

void pixel_lists_list_sorting(const struct window_frame *frame, struct program_list *list)
{
    for (int i = 0; i < (frame->limits->is_software ? 3 : 2); i++) {
        const struct program_desc desc = compute_of(sort_file, sort_passes[i]);
        program_list_add(list, "transparency.sort", &desc, true);
    }
}

void pixel_lists_list_programs(const struct window_frame *frame, const struct geometry_items *items,
                               struct program_list *list)
{
    pixel_lists_list_counting(frame, items, list);
    geometry_list_transparent(frame, items, &scattering, list);
    pixel_lists_list_sorting(frame, list);
}

/* Chunks of about the square root, so that neither loop of the scan is long. */
static uint32_t scan_chunk(uint32_t count)
{
    uint32_t chunk = 64;
    while ((uint64_t)chunk * chunk < count)
        chunk *= 2;
    return chunk;
}

static void read_sizes(struct layers *layers, const struct window_frame *frame)
{
    uint32_t totals[2] = {0}; /* a lost context reads nothing */
    gpu_timeline_will_wait(frame->timeline);
    gl_buffer_read(&layers->lists.statistics, 0, sizeof totals, totals);
    layers->layer_count = totals[0];
    layers->longest = totals[1];
}

static bool run_scan(struct layers *layers, const struct window_frame *frame, struct error *err)
{
    bool has_tiles = !frame->limits->is_software;
    uint32_t count = (uint32_t)(frame->window.width * frame->window.height);
    uint32_t chunk = has_tiles ? (uint32_t)SCAN_TILE : scan_chunk(count);
    uint32_t chunks = (count + chunk - 1) / chunk;
    if (!reserve(&layers->lists.scan, "lists.scan", (uint64_t)chunks * 8, err) ||
        !reserve(&layers->lists.statistics, "lists.statistics", 16, err))
        return false;
    bind(&layers->lists.ends, layers->lists.pixel_count * 4, BIND_PIXEL_COUNTS);
    gl_buffer_bind_storage(&layers->lists.scan, BIND_SCAN);
    gl_buffer_bind_storage(&layers->lists.statistics, BIND_STATISTICS);
    for (int i = 0; i < 3; i++) {
        const struct gl_program *program =
            get_compute(frame, scan_file_of(frame->limits), scan_passes[i], err);
        if (!program)
            return false;
        gl_program_use(program);
        gl_program_set_u(program, "u_count", count);
        gl_program_set_u(program, has_tiles ? "u_tiles" : "u_chunks", chunks);
        if (!has_tiles)
            gl_program_set_u(program, "u_chunk", chunk);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        window_dispatch_items(i == 1 ? 1 : (has_tiles ? 64ull : 1) * chunks); /* 64: a group */
    }
    return true;
}

/* reads: their numbers, too, which waits. */
static bool count_fragments(struct layers *layers, const struct window_frame *frame,
                            const struct geometry_items *items, bool reads, struct error *err)
{
    uint64_t bytes = (uint64_t)frame->window.width * (uint64_t)frame->window.height * 4;
    layers->lists.pixel_count = bytes / 4;
    layers->lists.list_bytes = 2 * bytes;
    if (!reserve(&layers->lists.ends, "lists.ends", bytes, err) ||
        !reserve(&layers->lists.left, "lists.left", bytes, err))
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = counting.pass,
                                         .because = "transparent surfaces are in view",
                                         .technique = transparency_name((int)layers->method->id),
                                         .stage = REPORT_SHADE,
                                     });
    bool ok = window_clear(frame, &layers->lists.left, bytes, err);
    bind(&layers->lists.left, layers->lists.pixel_count * 4, BIND_PIXEL_LEFT);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); /* a split window has just been scanned */
    ok = ok &&
         geometry_draw_transparent(frame, items, counting.fragment, counting.evaluates, err) &&
         run_scan(layers, frame, err);
    if (ok && reads)
        read_sizes(layers, frame);
    gpu_scope_end(frame->timeline);
    return ok;
}

static void finish_entries(struct layers *layers)
{
    gl_buffer_finish(&layers->lists.keys);
    for (int i = 0; i < PIXEL_LISTS_WORDS; i++)
        gl_buffer_finish(&layers->lists.surfaces[i]);
    gl_buffer_finish(&layers->lists.colors);
}

/* Bytes of the keys of an entry. */
static uint64_t key_bytes(const struct layers *layers)
{
    return layers->lists.has_two_halves ? 32 : 16;
}

static int word_count(const struct layers *layers)
{
    return PIXEL_LISTS_WORDS - 2 + (int)layers->lobes;
}

static uint64_t entry_bytes(const struct layers *layers)
{
    return key_bytes(layers) + 32 + (uint64_t)word_count(layers) * 16;
}

/* Buffers that would grow beyond the budget by what they hold in store begin anew. */
static bool has_room(struct layers *layers, uint64_t beside_bytes)
{
    uint64_t n = layers->lists.entry_count;
    uint64_t pixels = beside_bytes + layers->lists.ends.size_bytes + layers->lists.left.size_bytes +
                      layers->lists.scan.size_bytes;
    uint64_t exact = pixels + n * entry_bytes(layers);
    uint64_t grown = pixels + gl_buffer_reserved_bytes(&layers->lists.keys, n * key_bytes(layers)) +
                     gl_buffer_reserved_bytes(&layers->lists.colors, n * 32);
    for (int i = 0; i < word_count(layers); i++)
        grown += gl_buffer_reserved_bytes(&layers->lists.surfaces[i], n * 16);
    if (!layers->most_bytes)
        return true;
    if (grown > layers->most_bytes)
        finish_entries(layers);
    layers->missing_bytes = exact > layers->most_bytes ? exact : 0;
    return !layers->missing_bytes;
}

bool pixel_lists_find_room(struct layers *layers, uint64_t entry_count, uint64_t beside_bytes)
{
    layers->lists.entry_count = entry_count;
    layers->lists.has_two_halves = false;
    return has_room(layers, beside_bytes);
}

/* Whether the entries that were counted have room. */
static bool find_room(struct layers *layers)
{
    layers->lists.entry_count = layers->layer_count;
    layers->lists.has_two_halves = layers->longest > LIST_RUN; /* so that lists are merged */
    return has_room(layers, 0);
}

bool pixel_lists_reserve(struct layers *layers, struct error *err)
{
    static const char *const labels[PIXEL_LISTS_WORDS] = {
        "lists.surface_0", "lists.surface_1", "lists.surface_2", "lists.lobes", "lists.more_lobes"};
    uint64_t n = layers->lists.entry_count;
    layers->lists.list_bytes += n * entry_bytes(layers);
    bool ok = reserve(&layers->lists.keys, "lists.keys", n * key_bytes(layers), err) &&
              reserve(&layers->lists.colors, "lists.colors", n * 32, err);
    for (int i = 0; i < word_count(layers) && ok; i++)
        ok = reserve(&layers->lists.surfaces[i], labels[i], n * 16, err);
    return ok;
}

static bool scatter_by_depth(const struct window_frame *frame, const struct geometry_items *items,
                             struct error *err)
{
    return geometry_draw_transparent(frame, items, scattering.fragment, scattering.evaluates, err);
}

static bool scatter_fragments(const struct pixel_lists_order *order, struct layers *layers,
                              const struct window_frame *frame, const struct geometry_items *items,
                              struct error *err)
{
    if (!pixel_lists_reserve(layers, err))
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = scattering.pass,
                                         .because = "transparent surfaces are in view",
                                         .technique = transparency_name((int)layers->method->id),
                                         .stage = REPORT_SHADE,
                                     });
    struct window_frame roomy = *frame;
    roomy.list_room = (uint32_t)layers->lists.entry_count;
    pixel_lists_bind(layers, NULL);
    bind(&layers->lists.left, layers->lists.pixel_count * 4, BIND_PIXEL_LEFT);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    bool ok = order->scatter(&roomy, items, err);
    gpu_scope_end(frame->timeline);
    return ok;
}

static bool run_sort(struct layers *layers, const struct window_frame *frame, const char *pass,
                     uint64_t run, struct error *err)
{
    const struct gl_program *program = get_compute(frame, sort_file, pass, err);
    if (!program)
        return false;
    uint64_t to = layers->lists.keys_offset ? 0 : layers->layer_count;
    gl_program_use(program);
    gl_program_set_u(program, "u_entries", (uint32_t)layers->layer_count);
    gl_program_set_u(program, "u_pixels", (uint32_t)(frame->window.width * frame->window.height));
    gl_program_set_u(program, "u_run", (uint32_t)run);
    gl_program_set_u(program, "u_from", (uint32_t)layers->lists.keys_offset);
    gl_program_set_u(program, "u_to", (uint32_t)to);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(layers->layer_count);
    if (run)
        layers->lists.keys_offset = to;
    return true;
}

/* llvmpipe 22.3, 262,144 entries: by rank a level takes 0.75 of the time with runs of 16, as much
 * with runs of 128, 1.4 of it with runs of 1024. */
static bool merges_by_rank(const struct window_frame *frame, uint64_t run)
{
    return !frame->limits->is_software || run <= 128;
}

static bool sort_lists(struct layers *layers, const struct window_frame *frame, struct error *err)
{
    char because[REPORT_TEXT_BYTES];
    if (layers->is_guessed)
        snprintf(because, sizeof because, "transparent surfaces are in view");
    else
        snprintf(because, sizeof because, "some pixel has %llu transparent layers",
                 (unsigned long long)layers->longest);
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = "transparency.sort",
                                         .because = because,
                                         .technique = transparency_name((int)layers->method->id),
                                         .stage = REPORT_SHADE,
                                     });
    layers->lists.keys_offset = 0;
    bool ok = layers->longest < 2 || run_sort(layers, frame, sort_passes[0], 0, err);
    for (uint64_t run = LIST_RUN; ok && run < layers->longest; run *= 2)
        ok = run_sort(layers, frame, sort_passes[merges_by_rank(frame, run) ? 1 : 2], run, err);
    gpu_scope_end(frame->timeline);
    return ok;
}

void pixel_lists_clear(struct layers *layers)
{
    layers->lists.keys_offset = layers->lists.list_bytes = layers->lists.pixel_count = 0;
    layers->lists.entry_count = 0;
    layers->lists.has_two_halves = false;
}

void pixel_lists_report(const struct layers *layers, struct frame_report *report)
{
    report->counts.transparent_fragments += layers->layer_count;
    if (report->counts.longest_pixel_list < layers->longest)
        report->counts.longest_pixel_list = layers->longest;
    report_raise_bytes(report, "pixel_lists", layers->lists.list_bytes);
}

struct pixel_lists_guess pixel_lists_guess_of(const struct layers *layers)
{
    return (struct pixel_lists_guess){
        .room = {.entries = layers->layer_count, .longest = layers->longest},
        .pixels_bytes = layers->lists.list_bytes - layers->layer_count * entry_bytes(layers),
        .entry_bytes = entry_bytes(layers),
    };
}

void pixel_lists_guess_report(const struct pixel_lists_guess *guess, const struct list_sizes *sizes,
                              struct frame_report *report)
{
    report->counts.transparent_fragments += sizes->entries;
    if (report->counts.longest_pixel_list < sizes->longest)
        report->counts.longest_pixel_list = sizes->longest;
    report_raise_bytes(report, "pixel_lists",
                       guess->pixels_bytes + sizes->entries * guess->entry_bytes);
    report->has_cut_lists |= !list_sizes_fit(sizes, &guess->room);
}

/* Where there is no memory for what is guessed sizes are read, which may be smaller. */
static void take_guess(struct layers *layers, const struct list_sizes *room,
                       const struct gl_limits *limits)
{
    if (!room || room->entries > pixel_lists_entries_max(limits) || room->longest > LONGEST_GUESSED)
        return;
    layers->layer_count = room->entries;
    layers->longest = room->longest;
    layers->is_guessed = find_room(layers);
    if (!layers->is_guessed)
        layers->layer_count = layers->longest = layers->missing_bytes = 0;
}

static bool are_any(const struct geometry_items *items)
{
    return items->transparent_count || items->medium_count;
}

static void begin(struct layers *layers, const struct window_frame *frame,
                  const struct geometry_items *items)
{
    layers_clear(layers);
    layers->has_media = items->medium_count > 0;
    layers->lobes = shader_needs_lobes(frame->needs->layer_kinds);
    layers->may_surround = items->may_surround;
}

bool pixel_lists_count(struct layers *layers, const struct window_frame *frame,
                       const struct geometry_items *items, struct error *err)
{
    begin(layers, frame, items);
    layers->is_counted = are_any(items) && count_fragments(layers, frame, items, false, err);
    return layers->is_counted || !are_any(items);
}

/* Until their sizes are known, or guessed. */
static bool find_sizes(struct layers *layers, const struct window_frame *frame,
                       const struct geometry_items *items, const struct list_sizes *room,
                       struct error *err)
{
    if (layers->is_counted) {
        layers->is_counted = false;
        read_sizes(layers, frame);
        return true;
    }
    begin(layers, frame, items);
    take_guess(layers, room, frame->limits);
    if (!count_fragments(layers, frame, items, !layers->is_guessed, err))
        return false;
    if (layers->is_guessed && !find_room(layers)) {
        layers->is_guessed = false;
        read_sizes(layers, frame);
    }
    return true;
}

bool pixel_lists_find_sizes(struct layers *layers, const struct window_frame *frame,
                            const struct geometry_items *items, struct error *err)
{
    if (are_any(items))
        return find_sizes(layers, frame, items, NULL, err);
    begin(layers, frame, items);
    return true;
}

enum layers_outcome pixel_lists_find_by(const struct pixel_lists_order *order,
                                        struct layers *layers, const struct window_frame *frame,
                                        const struct geometry_items *items,
                                        const struct list_sizes *room, struct error *err)
{
    if (!are_any(items)) {
        begin(layers, frame, items);
        return LAYERS_FOUND;
    }
    if (!find_sizes(layers, frame, items, room, err))
        return LAYERS_FAILED;
    if (layers->longest > PIXEL_LISTS_LONGEST_MAX) {
        error_set(err, ERROR_OVER_BUDGET, "a pixel has %llu transparent layers, limit is %d",
                  (unsigned long long)layers->longest, PIXEL_LISTS_LONGEST_MAX);
        return LAYERS_FAILED;
    }
    if (layers->layer_count > pixel_lists_entries_max(frame->limits) || !find_room(layers))
        return LAYERS_TOO_MANY;
    if (layers->layer_count &&
        (!scatter_fragments(order, layers, frame, items, err) || !sort_lists(layers, frame, err)))
        return LAYERS_FAILED;
    if (!layers->is_guessed)
        pixel_lists_report(layers, frame->report);
    return LAYERS_FOUND;
}

enum layers_outcome pixel_lists_find(struct layers *layers, const struct window_frame *frame,
                                     const struct geometry_items *items,
                                     const struct list_sizes *room, struct error *err)
{
    static const struct pixel_lists_order by_depth = {.scatter = scatter_by_depth};
    return pixel_lists_find_by(&by_depth, layers, frame, items, room, err);
}

static void bind_window(const struct window_frame *frame, const struct gl_program *program)
{
    const struct camera_window *window = &frame->window;
    gl_program_set_u(program, "u_width_px", (uint32_t)window->width);
    gl_program_set_u(program, "u_pixels", (uint32_t)(window->width * window->height));
}

const struct surface_kind pixel_lists_surfaces = {
    .pass = pixel_lists_lighting_pass,
    .program = "shade_surfaces.comp.glsl",
    .source = "lists_surfaces.glsl",
    .points = "lists_points.glsl",
    .are_transparent = true,
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_LAYERS,
    .bind = bind_window,
};

const struct gl_buffer *pixel_lists_ends(const struct layers *layers)
{
    return &layers->lists.ends;
}

int pixel_lists_count_sets(const struct layers *layers)
{
    return layers->layer_count > 0;
}

/* All entries at once: what each lets through is known already, so that lighting needs no order. */
bool pixel_lists_light(struct layers *layers, const struct window_frame *frame,
                       const struct geometry_items *items, const struct surface_lighter *lighter,
                       struct error *err)
{
    struct surface_set set = {
        .kind = &pixel_lists_surfaces,
        .count = layers->layer_count,
        .technique = transparency_name((int)layers->method->id),
    };
    (void)frame, (void)items;
    if (layers->is_guessed)
        snprintf(set.because, sizeof set.because, "transparent surface samples are lit");
    else
        snprintf(set.because, sizeof set.because, "%llu transparent surface samples are lit",
                 (unsigned long long)layers->layer_count);
    return !layers->layer_count || lighter->light(lighter->context, &set, err);
}

void pixel_lists_bind(const struct layers *layers, const struct gl_program *program)
{
    bind(&layers->lists.ends, layers->lists.pixel_count * 4, BIND_PIXEL_COUNTS);
    uint64_t n = layers->lists.entry_count;
    bind(&layers->lists.keys, n * key_bytes(layers), BIND_ENTRY_KEYS);
    bind(&layers->lists.surfaces[0], n * 16, BIND_ENTRY_SURFACE_0);
    bind(&layers->lists.surfaces[1], n * 16, BIND_ENTRY_SURFACE_1);
    bind(&layers->lists.surfaces[2], n * 16, BIND_ENTRY_SURFACE_2);
    if (layers->lobes > 0)
        bind(&layers->lists.surfaces[3], n * 16, BIND_ENTRY_LOBES);
    if (layers->lobes > 1)
        bind(&layers->lists.surfaces[4], n * 16, BIND_ENTRY_MORE_LOBES);
    bind(&layers->lists.colors, n * PIXEL_LISTS_ENTRY_BYTES, BIND_ENTRY_COLORS);
    if (!program)
        return;
    gl_program_set_u(program, "u_keys_offset", (uint32_t)layers->lists.keys_offset);
    gl_program_set_u(program, "u_list_room", (uint32_t)n);
}

void pixel_lists_finish(struct layers *layers)
{
    gl_buffer_finish(&layers->lists.ends);
    gl_buffer_finish(&layers->lists.left);
    gl_buffer_finish(&layers->lists.scan);
    gl_buffer_finish(&layers->lists.statistics);
    finish_entries(layers);
    layers->lists = (struct pixel_lists){.pixel_count = 0};
}

uint64_t pixel_lists_size_bytes(const struct layers *layers)
{
    uint64_t bytes = layers->lists.ends.size_bytes + layers->lists.left.size_bytes +
                     layers->lists.scan.size_bytes + layers->lists.keys.size_bytes +
                     layers->lists.colors.size_bytes;
    for (int i = 0; i < PIXEL_LISTS_WORDS; i++)
        bytes += layers->lists.surfaces[i].size_bytes;
    return bytes;
}
