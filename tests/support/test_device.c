/* SPDX-License-Identifier: MIT */
/* What every test program lets its environment choose, without the renderer knowing. With
 * VITRAIL_NOOP_DEVICE=1 a device that executes nothing is taken, so that calls can be counted
 * there; VITRAIL_DUMP_SHADERS=DIR has the source of every composed program written into the folder.
 * The linker sends calls of the four functions here (--wrap). */
#include <stdlib.h>

#include "renderer/gl/loop_probe.h"
#include "renderer/gl/program.h"
#include "renderer/gl/selftest.h"
#include "renderer/scene_selftest.h"

bool __real_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);
bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);
bool __real_loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                           struct error *err);
bool __wrap_loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                           struct error *err);
bool __real_scene_selftest(struct renderer *renderer, struct error *err);
bool __wrap_scene_selftest(struct renderer *renderer, struct error *err);
struct program_cache *__real_program_cache_create(const char *dump_dir, struct error *err);
struct program_cache *__wrap_program_cache_create(const char *dump_dir, struct error *err);

bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err)
{
    if (!getenv("VITRAIL_NOOP_DEVICE"))
        return __real_gl_selftest(context, programs, err);
    gl_context_set_true_timers(context, true); /* of a device whose driver answers at once */
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

bool __wrap_scene_selftest(struct renderer *renderer, struct error *err)
{
    return getenv("VITRAIL_NOOP_DEVICE") || __real_scene_selftest(renderer, err);
}

struct program_cache *__wrap_program_cache_create(const char *dump_dir, struct error *err)
{
    return __real_program_cache_create(dump_dir ? dump_dir : getenv("VITRAIL_DUMP_SHADERS"), err);
}
