/* SPDX-License-Identifier: MIT */
/* Two pack buffers, each with a fence behind it. */
#include "renderer/shading/readback.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/shading/screen.h"

enum {
    WAYS = 2,
    CHANNELS = 4,
    COUNT_BYTES = READBACK_COUNT_WORDS * 4,
    SIZES_BYTES = 8,
    WAIT_NS = 1000000000,
};

static const char because[] = "the color output was asked for";

/* A window's picture: rows of f32, the lowest first, or of bytes, the top one first; then the words
 * of counts, the sizes of lists that were guessed, and those of shadow lists. */
struct way {
    struct gl_buffer buffer;
    struct gl_fence fence;
    struct frame_report *report; /* NULL: free */
    struct image *color;
    struct camera_window window;
    struct window_share share; /* of it in the image */
    bool has_counts, has_guess;
    struct readback_guess guess;
    struct shadow_system *shadows;
    struct shadow_sent sent; /* sizes of shadow lists */
    uint64_t number;         /* in the order of sending */
};

struct readback {
    struct way ways[WAYS];
    struct screen screen; /* of the picture that was packed last */
    uint64_t sent;
    bool is_lazy;
};

struct readback *readback_create(bool is_lazy, struct error *err)
{
    struct readback *readback = calloc(1, sizeof *readback);
    if (!readback)
        error_set(err, ERROR_NO_MEMORY, "readback");
    else
        readback->is_lazy = is_lazy;
    return readback;
}

void readback_destroy(struct readback *readback)
{
    if (!readback)
        return;
    for (int i = 0; i < WAYS; i++) {
        gl_fence_finish(&readback->ways[i].fence);
        shadow_sent_finish(&readback->ways[i].sent);
        gl_buffer_finish(&readback->ways[i].buffer);
    }
    screen_finish(&readback->screen);
    free(readback);
}

uint64_t readback_size_bytes(const struct readback *readback)
{
    uint64_t bytes = screen_size_bytes(&readback->screen);
    for (int i = 0; i < WAYS; i++)
        bytes += readback->ways[i].buffer.size_bytes;
    return bytes;
}

uint64_t readback_free_bytes(const struct readback *readback)
{
    uint64_t bytes = screen_size_bytes(&readback->screen);
    for (int i = 0; i < WAYS; i++)
        bytes += readback->ways[i].report ? 0 : readback->ways[i].buffer.size_bytes;
    return bytes;
}

void readback_trim(struct readback *readback)
{
    for (int i = 0; i < WAYS; i++)
        if (!readback->ways[i].report)
            gl_buffer_finish(&readback->ways[i].buffer);
    screen_finish(&readback->screen);
}

uint64_t readback_window_bytes(uint64_t pixels)
{
    uint64_t bytes = pixels * CHANNELS * sizeof(float) + COUNT_BYTES;
    return WAYS * (bytes + bytes / 2); /* buffers grow by half */
}

/* Bytes of a pixel of a screen's; 0: the image is linear. */
static int screen_channels(const struct image *color)
{
    return color->component == IMAGE_U8 ? color->channels : 0;
}

static uint64_t pixel_bytes(const struct camera_window *w, const struct image *color)
{
    int channels = screen_channels(color);
    return channels ? screen_bytes(w, channels)
                    : (uint64_t)w->width * (uint64_t)w->height * CHANNELS * sizeof(float);
}

static void release(struct way *way)
{
    gl_fence_finish(&way->fence);
    shadow_sent_finish(&way->sent);
    way->report = NULL;
}

/* The image's first row is on top, GL's at the bottom. */
static void copy_rows(const struct way *way, const unsigned char *pixels)
{
    const struct camera_window *w = &way->window;
    const struct window_share *share = &way->share;
    struct image *color = way->color;
    int channels = screen_channels(color);
    size_t pixel = channels ? (size_t)channels : CHANNELS * sizeof(float);
    size_t row = (size_t)w->width * pixel, from = (size_t)share->window_x * pixel;
    for (int i = 0; i < share->height; i++) {
        int y = share->window_y + i;
        unsigned char *out =
            (unsigned char *)color->pixels +
            ((size_t)(share->image_y + i) * (size_t)color->width_px + (size_t)share->image_x) *
                pixel;
        memcpy(out, pixels + (size_t)(channels ? y : w->height - 1 - y) * row + from,
               (size_t)share->width * pixel);
    }
}

/* Of a picture, behind its pixels: what is before the sizes of shadow lists, and all. */
static uint64_t guess_bytes(const struct way *way)
{
    return COUNT_BYTES + (way->has_guess ? SIZES_BYTES : 0);
}

static uint64_t tail_bytes(const struct way *way)
{
    return guess_bytes(way) + shadow_sent_bytes(&way->sent);
}

static void take_sizes(const struct way *way, const unsigned char *words)
{
    uint32_t totals[2];
    const struct readback_guess *guess = &way->guess;
    memcpy(totals, words, sizeof totals);
    const struct list_sizes sizes = {.entries = totals[0], .longest = totals[1]};
    pixel_lists_guess_report(&guess->lists, &sizes, way->report);
    list_history_note(guess->history, guess->key, sizes);
}

static void take_shadow_sizes(const struct way *way, const unsigned char *words)
{
    const void *sizes = words;
    shadow_system_take_sizes(way->shadows, &way->sent, sizes, way->report);
}

/* Within a scope, which then counts the time of copying; or after all scopes of the frame. */
static bool collect(struct way *way, bool is_in_scope, struct error *err)
{
    uint32_t counts[READBACK_COUNT_WORDS];
    uint64_t bytes = pixel_bytes(&way->window, way->color);
    struct frame_report *report = way->report;
    while (!gl_fence_wait(&way->fence, WAIT_NS))
        continue; /* who asked has a deadline for the process */
    double begin_ms = wall_ms();
    const unsigned char *mapped = gl_buffer_map(&way->buffer, bytes + tail_bytes(way));
    if (mapped) {
        copy_rows(way, mapped);
        memcpy(counts, mapped + bytes, sizeof counts);
        if (way->has_guess)
            take_sizes(way, mapped + bytes + COUNT_BYTES);
        if (way->shadows) /* words are aligned: pixels take whole ones */
            take_shadow_sizes(way, mapped + bytes + guess_bytes(way));
    }
    bool ok = mapped && gl_buffer_unmap(&way->buffer);
    release(way);
    report->has_lost_window |= !ok;
    if (!ok)
        return error_set(err, ERROR_NO_MEMORY, "reading back %llu bytes",
                         (unsigned long long)bytes);
    if (way->has_counts)
        report->counts.split_pixels += counts[0];
    for (int i = 1; way->has_counts && i < READBACK_COUNT_WORDS; i++)
        report->counts.lookups += counts[i];
    if (!is_in_scope)
        report_add_pass(report, "readback", because, "", wall_ms() - begin_ms, REPORT_READBACK);
    return true;
}

/* The one sent first, of this frame, or of any with NULL; or NULL. */
static struct way *oldest(struct readback *readback, const struct frame_report *report)
{
    struct way *found = NULL;
    for (int i = 0; i < WAYS; i++) {
        struct way *way = &readback->ways[i];
        bool is_its = way->report && (!report || way->report == report);
        if (is_its && (!found || way->number < found->number))
            found = way;
    }
    return found;
}

static struct way *find_free(struct readback *readback)
{
    for (int i = 0; i < WAYS; i++)
        if (!readback->ways[i].report)
            return &readback->ways[i];
    return NULL;
}

/* A frame that waits for this one, or is collected later, gets its picture early. */
static struct way *take_way(struct readback *readback, const struct window_frame *frame,
                            struct error *err)
{
    if (!find_free(readback))
        gpu_timeline_will_wait(frame->timeline);
    struct way *way = find_free(readback);
    if (way)
        return way;
    way = oldest(readback, frame->report);
    if (way)
        return collect(way, true, err) ? way : NULL;
    struct error of_other = {0}; /* which that frame reports when it is collected */
    way = oldest(readback, NULL);
    return collect(way, true, &of_other) ? way : find_free(readback);
}

static void pack_linear(struct way *way, const struct window_frame *frame, uint64_t bytes)
{
    const struct camera_window *w = &frame->window;
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                    GL_PIXEL_BUFFER_BARRIER_BIT);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, way->buffer.name);
    glGetTextureSubImage(frame->targets->image.name, 0, 0, 0, 0, w->width, w->height, 1, GL_RGBA,
                         GL_FLOAT, (GLsizei)bytes, NULL);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

static void pack_screen(struct way *way, const struct screen *screen, uint64_t bytes)
{
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glCopyNamedBufferSubData(screen->words.name, way->buffer.name, 0, 0, (GLsizeiptr)bytes);
}

static bool pack(struct readback *readback, struct way *way, const struct readback_desc *desc,
                 struct error *err)
{
    const struct window_frame *frame = desc->frame;
    int channels = screen_channels(desc->color);
    uint64_t bytes = pixel_bytes(&frame->window, desc->color);
    if (channels && !screen_draw(&readback->screen, frame, channels, err))
        return false;
    if (channels)
        pack_screen(way, &readback->screen, bytes);
    else
        pack_linear(way, frame, bytes);
    if (desc->counts)
        glCopyNamedBufferSubData(desc->counts->name, way->buffer.name,
                                 (GLintptr)desc->counts_offset_bytes, (GLintptr)bytes, COUNT_BYTES);
    if (desc->guess)
        glCopyNamedBufferSubData(desc->guess->sizes->name, way->buffer.name, 0,
                                 (GLintptr)bytes + COUNT_BYTES, SIZES_BYTES);
    if (way->shadows)
        shadow_system_copy_sizes(way->shadows, &way->sent, &way->buffer, bytes + guess_bytes(way));
    return true;
}

/* The way that the picture is on; NULL with err. */
static struct way *send(struct readback *readback, const struct readback_desc *desc,
                        struct error *err)
{
    const struct window_frame *frame = desc->frame;
    struct way *way = take_way(readback, frame, err);
    if (!way)
        return NULL;
    way->has_counts = desc->counts;
    way->has_guess = desc->guess;
    way->shadows = desc->shadow_frame ? desc->shadows : NULL;
    if (way->shadows)
        way->sent = shadow_system_send_sizes(way->shadows, desc->shadow_frame);
    uint64_t bytes = pixel_bytes(&frame->window, desc->color) + tail_bytes(way);
    if (!gl_buffer_reserve(&way->buffer,
                           &(struct gl_buffer_desc){
                               .label = "frame.readback", .size_bytes = bytes, .is_mappable = true},
                           false, err) ||
        !pack(readback, way, desc, err)) {
        shadow_sent_finish(&way->sent);
        return NULL;
    }
    way->window = frame->window;
    way->share = window_share_of(&frame->window, frame->view);
    way->color = desc->color;
    way->report = frame->report;
    if (desc->guess)
        way->guess = *desc->guess;
    way->number = readback->sent++;
    /* without the sizes that a guess adds: frames before this one decide about those */
    report_raise_bytes(frame->report, "readback",
                       pixel_bytes(&frame->window, desc->color) + COUNT_BYTES);
    return way;
}

static bool take_at_once(struct readback *readback, struct way *way, bool is_in_scope,
                         struct error *err)
{
    gl_fence_set(&way->fence);
    return readback->is_lazy || !gl_fence_wait(&way->fence, 0) || collect(way, is_in_scope, err);
}

/* A device's own timers end the scope before the fence, so that who waits for the picture need not
 * wait for them. */
bool readback_send(struct readback *readback, const struct readback_desc *desc, struct error *err)
{
    struct gpu_timeline *timeline = desc->frame->timeline;
    bool is_timed_behind = desc->frame->limits->has_true_timers;
    gpu_scope_begin(
        timeline,
        &(struct gpu_scope_desc){.pass = "readback", .because = because, .stage = REPORT_READBACK});
    struct way *way = send(readback, desc, err);
    bool ok = way && (is_timed_behind || take_at_once(readback, way, true, err));
    gpu_scope_end(timeline);
    return ok && (!is_timed_behind || take_at_once(readback, way, false, err));
}

bool readback_wait(const struct readback *readback, const struct frame_report *report,
                   uint64_t timeout_ns)
{
    bool is_there = true;
    for (int i = 0; i < WAYS && is_there; i++)
        is_there = readback->ways[i].report != report ||
                   ((timeout_ns || !readback->is_lazy) &&
                    gl_fence_wait(&readback->ways[i].fence, timeout_ns));
    return is_there;
}

bool readback_collect(struct readback *readback, const struct frame_report *report,
                      struct error *err)
{
    struct way *way;
    while ((way = oldest(readback, report)))
        if (!collect(way, false, err)) {
            readback_drop(readback, report);
            return false;
        }
    return !report->has_lost_window ||
           error_set(err, ERROR_NO_MEMORY, "a part of the picture was lost while it was read back");
}

void readback_drop(struct readback *readback, const struct frame_report *report)
{
    assert(report);
    for (int i = 0; i < WAYS; i++)
        if (readback->ways[i].report == report)
            release(&readback->ways[i]);
}
