/* SPDX-License-Identifier: MIT */
/* The pass of deep images, and the way of their samples to the processor. */
#include "renderer/shading/deep.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/shading/lighting.h"

#include "shaders/shared/bindings.h"

enum { DEFINES_BYTES = 128 };

static_assert(sizeof(struct deep_sample) == 32, "two vec4 of the device");

static void describe(const struct window_frame *frame, const struct shade_facts *facts,
                     char text[DEFINES_BYTES])
{
    char media[MEDIA_DEFINES_BYTES] = "";
    if (facts->has_layers)
        lighting_media_defines(frame, facts, media);
    snprintf(text, DEFINES_BYTES, "SAMPLES=1%s%s%s", facts->has_layers ? " HAS_TRANSPARENT" : "",
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "", media);
}

static struct program_desc program_of(const char *defines)
{
    return (struct program_desc){
        .label = "deep.comp.glsl", .compute = "deep.comp.glsl", .defines = defines};
}

void deep_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                        bool is_conditional, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    describe(frame, facts, defines);
    const struct program_desc desc = program_of(defines);
    program_list_add(list, "deep-image", &desc, is_conditional);
}

/* The buffers of one window; they go when they are read. */
struct deep_window {
    struct gl_buffer slots;  /* two vec4 of each sample */
    struct gl_buffer places; /* uvec2 of each pixel: its first slot, and how many are used */
    uint64_t slot_count;
};

static bool make_buffers(struct deep_window *window, uint64_t pixels, struct error *err)
{
    return gl_buffer_init(&window->slots,
                          &(struct gl_buffer_desc){.label = "deep.slots",
                                                   .size_bytes = window->slot_count * 32},
                          err) &&
           gl_buffer_init(
               &window->places,
               &(struct gl_buffer_desc){.label = "deep.places", .size_bytes = pixels * 8}, err);
}

static bool run(const struct deep_window *window, const struct shade_desc *desc, struct error *err)
{
    const struct window_frame *frame = desc->frame;
    char defines[DEFINES_BYTES];
    const struct shade_facts facts = shade_facts_of(desc);
    describe(frame, &facts, defines);
    const struct program_desc composed = program_of(defines);
    const struct gl_program *program = program_cache_get(frame->programs, &composed, err);
    if (!program)
        return false;
    gpu_scope_begin(frame->timeline,
                    &(struct gpu_scope_desc){.pass = "deep-image",
                                             .because = "a deep image was asked for",
                                             .stage = REPORT_SHADE});
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_set_clip_planes(frame, 1, program);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    desc->layers->method->bind(desc->layers, program);
    glBindImageTexture(0, frame->targets->opaque.name, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
    gl_buffer_bind_storage(&window->slots, BIND_STATISTICS);
    gl_buffer_bind_storage(&window->places, BIND_SCAN);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    window_dispatch_pixels(frame);
    gpu_scope_end(frame->timeline);
    return true;
}

/* GL's first row is at the bottom. */
static void copy_samples(const struct window_frame *frame, const struct deep_sample *slots,
                         const uint32_t (*places)[2], struct deep_image *image)
{
    const struct camera_window *w = &frame->window;
    const struct window_share share = window_share_of(w, frame->view);
    for (int y = 0; y < share.height; y++) {
        size_t row = (size_t)(w->height - 1 - share.window_y - y);
        const uint32_t(*place)[2] = places + row * (size_t)w->width + share.window_x;
        for (int x = 0; x < share.width; x++)
            deep_image_set(image, share.image_x + x, share.image_y + y, slots + place[x][0],
                           place[x][1]);
    }
}

static size_t count_samples(const uint32_t (*places)[2], uint64_t pixels)
{
    size_t count = 0;
    for (uint64_t i = 0; i < pixels; i++)
        count += places[i][1];
    return count;
}

static bool read_back(const struct deep_window *window, const struct window_frame *frame,
                      uint64_t pixels, struct deep_image *image, struct error *err)
{
    struct deep_sample *slots = calloc(window->slot_count, sizeof *slots);
    uint32_t(*places)[2] = calloc(pixels, sizeof *places); /* a lost context reads nothing */
    bool ok = slots && places;
    if (ok) {
        gpu_timeline_will_wait(frame->timeline);
        gl_buffer_read(&window->places, 0, pixels * sizeof *places, places);
        gl_buffer_read(&window->slots, 0, window->slot_count * sizeof *slots, slots);
        ok = deep_image_reserve(image, count_samples(places, pixels), err);
    } else {
        error_set(err, ERROR_NO_MEMORY, "reading back %llu samples of a deep image",
                  (unsigned long long)window->slot_count);
    }
    if (ok)
        copy_samples(frame, slots, places, image);
    free(places);
    free(slots);
    return ok;
}

bool deep_read(const struct shade_desc *desc, struct deep_image *image, bool *overflows,
               struct error *err)
{
    const struct window_frame *frame = desc->frame;
    const struct layers *layers = desc->layers;
    uint64_t pixels = (uint64_t)frame->window.width * (uint64_t)frame->window.height;
    struct deep_window window = {.slot_count = pixels + layers->layer_count};
    if (layers->layer_count && layers->has_media)
        window.slot_count *= 2;
    *overflows = window.slot_count * 32 > gl_limits_block(frame->limits, 32) * 32;
    bool ok = *overflows || (make_buffers(&window, pixels, err) && run(&window, desc, err) &&
                             read_back(&window, frame, pixels, image, err));
    gl_buffer_finish(&window.slots);
    gl_buffer_finish(&window.places);
    return ok;
}
