/* SPDX-License-Identifier: MIT */
/* One compute program over three textures of the same noise. */
#include "renderer/frame/texture_speed.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/calibrate.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/textures/texture_blocks.h"
#include "shaders/shared/bindings.h"

enum {
    /* 256 KiB whole, which caches hold: what others do with the memory does not count, and blocks
     * have their worst case, as elsewhere they gain by their bytes. */
    SIDE_PX = 256,
    TILE_PX = 128,     /* of noise, repeated */
    GROUPS_FIRST = 16, /* of 64 invocations with 16 samples each */
    GROUPS_MOST = 65535,
    ROUNDS = 3,
    SAMPLES_A_GROUP = 64 * 16,
};
static const double WORK_MS = 0.2; /* of one dispatch: long against what it takes to ask for it */

enum format { WHOLE, BC1, BC3, FORMATS };

static const GLenum gl_formats[FORMATS] = {GL_SRGB8_ALPHA8, GL_COMPRESSED_SRGB_S3TC_DXT1_EXT,
                                           GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT};

struct probe {
    const struct gl_program *program;
    struct gl_texture textures[FORMATS];
    struct gl_sampler sampler;
    struct gl_buffer sums;
    bool is_software;
};

/* ---- textures ---- */

/* A gradient with noise: a block has several colours. */
static void paint(uint8_t *tile)
{
    uint32_t word = 1;
    for (uint32_t i = 0; i < TILE_PX * TILE_PX; i++)
        for (uint32_t c = 0; c < 4; c++) {
            word = word * 1664525 + 1013904223;
            tile[4 * i + c] = (uint8_t)((i % TILE_PX) / 2 + (i / TILE_PX) / 2 + (word >> 26));
        }
}

static void write_tiles(const struct gl_texture *texture, enum format format, const uint8_t *bytes,
                        GLsizei size_bytes)
{
    for (GLint y = 0; y < SIDE_PX; y += TILE_PX)
        for (GLint x = 0; x < SIDE_PX; x += TILE_PX)
            if (format == WHOLE)
                glTextureSubImage2D(texture->name, 0, x, y, TILE_PX, TILE_PX, GL_RGBA,
                                    GL_UNSIGNED_BYTE, bytes);
            else
                glCompressedTextureSubImage2D(texture->name, 0, x, y, TILE_PX, TILE_PX,
                                              gl_formats[format], size_bytes, bytes);
}

static bool init_textures(struct probe *probe, struct texture_speed *speed, struct error *err)
{
    enum { TILE_BYTES = 4 * TILE_PX * TILE_PX, BLOCKS = TILE_PX * TILE_PX / 16 };
    uint8_t *tile = malloc(TILE_BYTES), *blocks = malloc(16 * BLOCKS);
    bool is_good = tile && blocks;
    if (!is_good)
        error_set(err, ERROR_NO_MEMORY, "measuring textures");
    for (int i = 0; is_good && i < FORMATS; i++)
        is_good = gl_texture_init(&probe->textures[i],
                                  &(struct gl_texture_desc){.label = "texture_speed",
                                                            .format = gl_formats[i],
                                                            .width = SIDE_PX,
                                                            .height = SIDE_PX},
                                  err);
    if (is_good) {
        double squares = 0;
        paint(tile);
        write_tiles(&probe->textures[WHOLE], WHOLE, tile, TILE_BYTES);
        double begin_ms = clock_now_ms(CLOCK_THREAD_CPUTIME_ID);
        texture_blocks_encode(tile, TILE_PX, TILE_PX, false, blocks, &squares);
        speed->encode_bytes_per_ms =
            TILE_BYTES / fmax(clock_now_ms(CLOCK_THREAD_CPUTIME_ID) - begin_ms, 1e-3);
        write_tiles(&probe->textures[BC1], BC1, blocks, 8 * BLOCKS);
        memcpy(blocks, tile, 16 * BLOCKS); /* any bytes are blocks */
        write_tiles(&probe->textures[BC3], BC3, blocks, 16 * BLOCKS);
    }
    free(tile);
    free(blocks);
    return is_good;
}

/* ---- times ---- */

static double time_groups(const struct probe *probe, enum format format, GLuint groups)
{
    gl_texture_bind(&probe->textures[format], UNIT_MATERIAL_0);
    glFinish();
    double begin_ms = wall_ms(), processor_begin_ms = clock_now_ms(CLOCK_PROCESS_CPUTIME_ID);
    glDispatchCompute(groups, 1, 1);
    glFinish();
    return calibrate_alone_ms(wall_ms() - begin_ms,
                              clock_now_ms(CLOCK_PROCESS_CPUTIME_ID) - processor_begin_ms,
                              probe->is_software);
}

/* The least of some: others may have the processors. */
static double least_ms(const struct probe *probe, enum format format, GLuint groups)
{
    double least = INFINITY;
    for (int i = 0; i < ROUNDS; i++)
        least = fmin(least, time_groups(probe, format, groups));
    return least;
}

static void time_formats(const struct probe *probe, struct texture_speed *speed)
{
    double least[FORMATS] = {INFINITY, INFINITY, INFINITY};
    GLuint groups = GROUPS_FIRST;
    gl_program_use(probe->program);
    gl_buffer_bind_storage(&probe->sums, BIND_STATISTICS);
    glBindSampler(UNIT_MATERIAL_0, probe->sampler.name);
    for (int i = 0; i < FORMATS; i++)
        time_groups(probe, (enum format)i, 1); /* drivers compile for a format when they meet it */
    while (groups < GROUPS_MOST / 2 && least_ms(probe, WHOLE, groups) < WORK_MS)
        groups *= 2;
    for (int round = 0; round < ROUNDS; round++)
        for (int i = 0; i < FORMATS; i++)
            least[i] = fmin(least[i], time_groups(probe, (enum format)i, groups));
    double samples = (double)groups * SAMPLES_A_GROUP;
    speed->whole_ns = fmax(least[WHOLE] * 1e6 / samples, 1e-6);
    speed->bc1_ns = fmax(least[BC1] * 1e6 / samples, 1e-6);
    speed->bc3_ns = fmax(least[BC3] * 1e6 / samples, 1e-6);
    glBindSampler(UNIT_MATERIAL_0, 0);
}

bool texture_speed_measure(struct renderer *renderer, struct texture_speed *speed,
                           double *elapsed_ms, struct error *err)
{
    double begin_ms = wall_ms();
    *speed = (struct texture_speed){0};
    *elapsed_ms = 0;
    if (!renderer_samples_blocks(renderer))
        return true;
    struct probe probe = {.is_software = gl_context_limits(renderer->gl)->is_software};
    probe.program = program_cache_get(
        renderer->programs,
        &(struct program_desc){.label = "texture_speed", .compute = "texture_speed.comp.glsl"},
        err);
    bool is_good =
        probe.program &&
        gl_buffer_init(&probe.sums, &(struct gl_buffer_desc){.label = "texture_speed"}, err) &&
        init_textures(&probe, speed, err);
    if (is_good) {
        gl_sampler_init(&probe.sampler, &(struct gl_sampler_desc){.label = "texture_speed",
                                                                  .mag_filter = GL_LINEAR,
                                                                  .min_filter = GL_LINEAR,
                                                                  .wrap_s = GL_REPEAT,
                                                                  .wrap_t = GL_REPEAT});
        time_formats(&probe, speed);
        is_good = gl_context_check(renderer->gl, "measuring textures", err);
    }
    gl_sampler_finish(&probe.sampler);
    gl_buffer_finish(&probe.sums);
    for (int i = 0; i < FORMATS; i++)
        gl_texture_finish(&probe.textures[i]);
    *elapsed_ms = wall_ms() - begin_ms;
    if (!is_good)
        *speed = (struct texture_speed){0};
    return is_good || error_wrap(err, "measuring compressed textures");
}

bool texture_speed_is_known(const struct texture_speed *speed)
{
    return speed->whole_ns > 0;
}

bool texture_speed_gains(const struct texture_speed *speed)
{
    double most = TEXTURE_SPEED_SLOWER_MOST * speed->whole_ns;
    return texture_speed_is_known(speed) && speed->bc1_ns <= most && speed->bc3_ns <= most &&
           speed->encode_bytes_per_ms >= TEXTURE_SPEED_ENCODE_LEAST;
}
