/* SPDX-License-Identifier: MIT */
/* One invocation with one long loop. */
#include "renderer/gl/loop_probe.h"

#include <epoxy/gl.h>

#include "renderer/gl/object.h"
#include "shaders/shared/bindings.h"

bool loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                    struct error *err)
{
    struct gl_buffer results = {0};
    uint32_t taken = 0;
    const struct gl_program *program = program_cache_get(
        programs,
        &(struct program_desc){.label = "selftest.loops", .compute = "loop_probe.comp.glsl"}, err);
    if (!program ||
        !gl_buffer_init(&results,
                        &(struct gl_buffer_desc){.label = "selftest.loops", .size_bytes = 8}, err))
        return false;
    gl_program_use(program);
    gl_program_set_u(program, "u_steps", steps);
    gl_buffer_bind_storage(&results, BIND_STATISTICS);
    glDispatchCompute(1, 1, 1);
    gl_buffer_read(&results, 0, sizeof taken, &taken);
    gl_buffer_finish(&results);
    if (taken == 0 || taken > steps)
        return error_set(err, ERROR_NO_DEVICE, "self-test 'loops': expected %u steps, found %u",
                         steps, taken);
    *end = taken < steps ? taken : 0;
    return true;
}
