/* SPDX-License-Identifier: MIT */
/* Start-up self-test: refuses a device whose results would be silently wrong. Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_SELFTEST_H
#define VITRAIL_RENDERER_GL_SELFTEST_H

#include "renderer/gl/context.h"
#include "renderer/gl/program.h"

/* Checks that no fragment loses its side effects (without attachments; and with depth and colour
 * masked, behind depth none has any), that compute sums over many groups, RGB32F
 * buffer textures and writes between dispatches are exact, and, where GL_ARB_post_depth_coverage
 * exists, that coverage masks of 4x multisampled integer targets agree with their samples. Then
 * measures whether timestamps tell the truth and sets has_true_timers: never where is_software.
 * ERROR_NO_DEVICE names the step, what was expected and what was found. Costs two small programs:
 * on one llvmpipe core about 155 ms with a cold shader cache, 30 ms with Mesa's disk cache. */
MUST_CHECK bool gl_selftest(struct gl_context *context, struct program_cache *programs,
                            struct error *err);

#endif
