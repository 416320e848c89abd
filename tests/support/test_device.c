/* SPDX-License-Identifier: MIT */
/* What every test program lets its environment choose, without the renderer knowing. With
 * VITRAIL_NOOP_DEVICE=1 a device that executes nothing is taken, whose buffers read as zeros, so
 * that calls can be counted there; VITRAIL_DUMP_SHADERS=DIR has the source of every composed
 * program written into the folder. VITRAIL_WIDE_FLOATS=f64, pairs or pairs-split has layers added
 * up in that form where a test does not ask for one. Besides, tests have shaders of their own. The
 * linker sends calls of the functions here (--wrap). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/frame/scene_selftest.h"
#include "renderer/gl/loop_probe.h"
#include "renderer/gl/object.h"
#include "renderer/gl/program.h"
#include "renderer/gl/selftest.h"
#include "renderer/gl/wide_floats.h"
#include "tests/support/gl_hostile.h"
#include "tests/support/test_shader_table.h"

bool __real_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);
bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);
bool __real_loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                           struct error *err);
bool __wrap_loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                           struct error *err);
bool __real_scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err);
bool __wrap_scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err);
void __real_gl_buffer_read(const struct gl_buffer *buffer, uint64_t offset_bytes,
                           uint64_t size_bytes, void *data);
void __wrap_gl_buffer_read(const struct gl_buffer *buffer, uint64_t offset_bytes,
                           uint64_t size_bytes, void *data);
const void *__real_gl_buffer_map(const struct gl_buffer *buffer, uint64_t size_bytes);
const void *__wrap_gl_buffer_map(const struct gl_buffer *buffer, uint64_t size_bytes);
struct program_cache *__real_program_cache_create(const char *dump_dir, struct error *err);
struct program_cache *__wrap_program_cache_create(const char *dump_dir, struct error *err);

bool __real_wide_floats_choose(const struct wide_floats_desc *desc,
                               struct wide_floats_choice *choice, struct error *err);
bool __wrap_wide_floats_choose(const struct wide_floats_desc *desc,
                               struct wide_floats_choice *choice, struct error *err);

const struct shader_file *__real_shader_find(const char *name);
const struct shader_file *__wrap_shader_find(const char *name);

const struct shader_file *__wrap_shader_find(const char *name)
{
    const struct shader_file *file = __real_shader_find(name);
    return file ? file : shader_table_find(test_shader_table, name);
}

bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err)
{
    if (!getenv("VITRAIL_NOOP_DEVICE"))
        return __real_gl_selftest(context, programs, err);
    gl_context_set_true_timers(context, gl_stamps_are_answered());
    return true;
}

bool __wrap_loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                           struct error *err)
{
    if (!getenv("VITRAIL_NOOP_DEVICE"))
        return __real_loop_probe_run(programs, steps, end, err);
    *end = 0; /* as on devices that end no loop */
    return true;
}

bool __wrap_scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err)
{
    return getenv("VITRAIL_NOOP_DEVICE") || __real_scene_selftest(renderer, wanted, err);
}

/* iris gives new buffers memory of deleted ones, which nothing clears. */
void __wrap_gl_buffer_read(const struct gl_buffer *buffer, uint64_t offset_bytes,
                           uint64_t size_bytes, void *data)
{
    __real_gl_buffer_read(buffer, offset_bytes, size_bytes, data);
    if (getenv("VITRAIL_NOOP_DEVICE"))
        memset(data, 0, size_bytes);
}

const void *__wrap_gl_buffer_map(const struct gl_buffer *buffer, uint64_t size_bytes)
{
    const void *mapped = __real_gl_buffer_map(buffer, size_bytes);
    if (mapped && getenv("VITRAIL_NOOP_DEVICE"))
        memset((void *)(uintptr_t)mapped, 0, size_bytes);
    return mapped;
}

static enum wide_floats wished_form(void)
{
    const char *wish = getenv("VITRAIL_WIDE_FLOATS");
    if (!wish || !*wish)
        return WIDE_FLOATS_MEASURED;
    for (int i = 0; i < WIDE_FLOATS_COUNT; i++)
        if (!strcmp(wish, wide_floats_name((enum wide_floats)i)))
            return (enum wide_floats)i;
    fprintf(stderr, "VITRAIL_WIDE_FLOATS: '%s' is no form\n", wish);
    exit(2);
}

bool __wrap_wide_floats_choose(const struct wide_floats_desc *desc,
                               struct wide_floats_choice *choice, struct error *err)
{
    struct wide_floats_desc wish = *desc;
    if (!wish.asked)
        wish.asked = wished_form();
    if (!getenv("VITRAIL_NOOP_DEVICE"))
        return __real_wide_floats_choose(&wish, choice, err);
    *choice = (struct wide_floats_choice){.form = wish.asked          ? wish.asked
                                                  : desc->is_software ? WIDE_FLOATS_F64
                                                                      : WIDE_FLOATS_PAIRS};
    return true;
}

/* Test programs without a renderer have no device defines but these. */
struct program_cache *__wrap_program_cache_create(const char *dump_dir, struct error *err)
{
    struct program_cache *cache =
        __real_program_cache_create(dump_dir ? dump_dir : getenv("VITRAIL_DUMP_SHADERS"), err);
    if (cache)
        program_cache_set_device_defines(cache, wide_floats_defines(wished_form()));
    return cache;
}
