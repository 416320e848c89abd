/* SPDX-License-Identifier: MIT */
/* Chooses the numbers in which shaders multiply and add up layers (shaders/base/wide.glsl): f64 if
 * the device is quick at it, else pairs of f32. Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_WIDE_FLOATS_H
#define VITRAIL_RENDERER_GL_WIDE_FLOATS_H

#include "renderer/gl/program.h"

enum wide_floats {
    WIDE_FLOATS_MEASURED, /* as the device is found to be quicker */
    WIDE_FLOATS_F64,
    WIDE_FLOATS_PAIRS,       /* products' errors by fma, which must round once */
    WIDE_FLOATS_PAIRS_SPLIT, /* by halves of the factors, where fma rounds twice */
    WIDE_FLOATS_COUNT
};

const char *wide_floats_name(enum wide_floats form);    /* "f64", "pairs", "pairs-split" */
const char *wide_floats_defines(enum wide_floats form); /* for shaders/base/wide.glsl; never NULL */

struct wide_floats_choice {
    enum wide_floats form; /* never WIDE_FLOATS_MEASURED */
    double pairs_over_f64; /* time of the same work, pairs to f64; 0: not measured */
};

/* Checks a thousand layers against f64 of the processor, bit for bit as far as the form promises,
 * and with WIDE_FLOATS_MEASURED takes f64 where pairs take more than WIDE_FLOATS_F64_GAIN times as
 * long. ERROR_NO_DEVICE where the form asked for, or every one, is wrong. Costs one or two small
 * programs, three where fma rounds twice, and some milliseconds of work; a device that emulates f64
 * compiles it in the smallest of programs only. Leaves the cache without device defines. */
#define WIDE_FLOATS_F64_GAIN 1.25
struct wide_floats_desc {
    struct program_cache *programs; /* required */
    enum wide_floats asked;
    bool is_software; /* the device works on our own processors, which are quick at f64: measured is
                         f64, untimed, so that pictures keep their bits on a busy machine, too */
};
MUST_CHECK bool wide_floats_choose(const struct wide_floats_desc *desc,
                                   struct wide_floats_choice *choice, struct error *err);

#endif
