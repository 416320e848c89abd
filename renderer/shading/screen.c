/* SPDX-License-Identifier: MIT */
/* Tone mapping as a dispatch. */
#include "renderer/shading/screen.h"

#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/tone_curve.h"

enum { PIXELS_PER_THREAD = 4 };

static const struct program_desc tone_map_program = {.label = "tone_map.comp.glsl",
                                                     .compute = "tone_map.comp.glsl"};

static uint64_t thread_count(const struct camera_window *window)
{
    uint64_t pixels = (uint64_t)window->width * (uint64_t)window->height;
    return (pixels + PIXELS_PER_THREAD - 1) / PIXELS_PER_THREAD;
}

uint64_t screen_bytes(const struct camera_window *window, int channels)
{
    return thread_count(window) * PIXELS_PER_THREAD * (uint64_t)channels;
}

static bool prepare(struct screen *screen, uint64_t bytes, struct error *err)
{
    struct tone_bucket buckets[TONE_BUCKETS];
    if (!gl_buffer_reserve(&screen->words,
                           &(struct gl_buffer_desc){.label = "frame.screen", .size_bytes = bytes},
                           false, err))
        return false;
    if (screen->buckets.name)
        return true;
    tone_map_fill_buckets(buckets);
    return gl_buffer_init(&screen->buckets,
                          &(struct gl_buffer_desc){.label = "frame.tone_buckets",
                                                   .size_bytes = sizeof buckets,
                                                   .data = buckets},
                          err);
}

bool screen_draw(struct screen *screen, const struct window_frame *frame, int channels,
                 struct error *err)
{
    const struct camera_window *window = &frame->window;
    const struct tone_map_desc mapping = view_screen_code(&frame->view->screen);
    const struct gl_program *program = program_cache_get(frame->programs, &tone_map_program, err);
    if (!program || !prepare(screen, screen_bytes(window, channels), err))
        return false;
    gl_program_use(program);
    gl_program_set_u2(program, "u_size_px", (uint32_t)window->width, (uint32_t)window->height);
    gl_program_set_u(program, "u_channels", (uint32_t)channels);
    gl_program_set_u(program, "u_operator", (uint32_t)mapping.operator_);
    gl_program_set_f(program, "u_gain", tone_map_gain(&mapping));
    glBindImageTexture(0, frame->targets->image.name, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
    gl_buffer_bind_storage(&screen->words, BIND_SCREEN);
    gl_buffer_bind_storage(&screen->buckets, BIND_TONE_BUCKETS);
    /* words: a frame of the picture that is kept has nothing between this dispatch and the last */
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(thread_count(window));
    return true;
}

void screen_list_programs(struct program_list *list)
{
    program_list_add(list, "readback", &tone_map_program, false);
}

void screen_finish(struct screen *screen)
{
    gl_buffer_finish(&screen->words);
    gl_buffer_finish(&screen->buckets);
}

uint64_t screen_size_bytes(const struct screen *screen)
{
    return screen->words.size_bytes + screen->buckets.size_bytes;
}
