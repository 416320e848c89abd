/* SPDX-License-Identifier: MIT */
/* Measures after how many steps a device ends the loops of one shader invocation. Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_LOOP_PROBE_H
#define VITRAIL_RENDERER_GL_LOOP_PROBE_H

#include <stdint.h>

#include "renderer/gl/program.h"

/* Takes `steps` steps in one invocation and counts those that were taken: *end is 0 where all were,
 * else their number. llvmpipe up to 22.3 ends loops after 65,535 steps, without a word. Costs one
 * small program, and 1 ms for 262,144 steps (llvmpipe). */
MUST_CHECK bool loop_probe_run(struct program_cache *programs, uint32_t steps, uint32_t *end,
                               struct error *err);

#endif
