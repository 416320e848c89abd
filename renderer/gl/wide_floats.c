/* SPDX-License-Identifier: MIT */
/* One small program in each form: first its answer, then its time. */
#include "renderer/gl/wide_floats.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/gl/object.h"
#include "shaders/shared/bindings.h"

enum {
    CHECKED_LAYERS = 1000,
    TIMED_LAYERS = 64,
    GROUPS_FIRST = 64, /* of 64 invocations */
    GROUPS_MOST = 65535,
    ROUNDS = 5,
    TAKES = 3, /* share, light, depth */
};
static const double WORK_MS = 2; /* of one dispatch: long against what it takes to ask for it */

static const struct {
    const char *name, *defines;
} forms[WIDE_FLOATS_COUNT] = {
    [WIDE_FLOATS_MEASURED] = {"measured", ""},
    [WIDE_FLOATS_F64] = {"f64", ""},
    [WIDE_FLOATS_PAIRS] = {"pairs", "WIDE_PAIRS"},
    [WIDE_FLOATS_PAIRS_SPLIT] = {"pairs-split", "WIDE_PAIRS WIDE_SPLIT"},
};

const char *wide_floats_name(enum wide_floats form)
{
    return forms[form].name;
}

const char *wide_floats_defines(enum wide_floats form)
{
    return forms[form].defines;
}

/* ---- the work ---- */

/* No bits of these are zero by chance: every product and every sum has a rest. */
static const float dark_word = -0.49912345f, bright_word = 1.2345678e-3f;
static const float sigma = 0.73456789f, way = 1.3579246f, radiance = 0.98765432f;

struct probe {
    struct program_cache *programs;
    struct gl_buffer results;
};

static const struct gl_program *use_program(struct probe *probe, enum wide_floats form,
                                            bool with_depth, uint32_t layers, struct error *err)
{
    const struct gl_program *program =
        program_cache_get(probe->programs,
                          &(struct program_desc){.label = "selftest.wide",
                                                 .compute = "wide_probe.comp.glsl",
                                                 .defines = forms[form].defines},
                          err);
    if (!program)
        return NULL;
    gl_program_use(program);
    gl_program_set_u(program, "u_layers", layers);
    gl_program_set_u(program, "u_with_depth", with_depth);
    gl_program_set_f2(program, "u_words", (float[]){dark_word, bright_word});
    gl_program_set_f3(program, "u_way_light", (float[]){sigma, way, radiance});
    gl_program_set_f(program, "u_spread", 0);
    gl_buffer_bind_storage(&probe->results, BIND_STATISTICS);
    return program;
}

/* ---- the answer ---- */

/* Of each: what the invocation must find, and the relative error that docs/reference/accuracy.md
 * promises of pairs. */
struct answer {
    double value[TAKES], tolerance[TAKES];
};

static struct answer expected(void)
{
    const double n = CHECKED_LAYERS, u = ldexp(1, -24);
    struct answer answer = {{1, 0, 0}, {n * 5 * u * u, 3 * u, n * n * u * u}};
    for (int i = 0; i < CHECKED_LAYERS; i++) {
        answer.value[1] += answer.value[0] * (double)radiance;
        answer.value[2] += (double)sigma * ((double)way * (double)bright_word);
        answer.value[0] *= i % 16 ? 1 - (double)bright_word : -(double)dark_word;
    }
    return answer;
}

struct wide_bits {
    uint32_t words[2];
};

static double wide_value(struct wide_bits bits, bool is_f64)
{
    double value;
    float pair[2];
    memcpy(&value, &bits, sizeof value);
    memcpy(pair, &bits, sizeof pair);
    return is_f64 ? value : (double)pair[0] + (double)pair[1];
}

/* *is_right: within what the form promises. */
static bool check(struct probe *probe, enum wide_floats form, bool *is_right, struct error *err)
{
    const struct answer answer = expected();
    const bool is_f64 = form == WIDE_FLOATS_F64;
    const double unit = is_f64 ? 1 : ldexp(1, -64); /* of a share */
    struct wide_bits found[TAKES];
    if (!use_program(probe, form, true, CHECKED_LAYERS, err))
        return false;
    glDispatchCompute(1, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    gl_buffer_read(&probe->results, 0, sizeof found, found);
    *is_right = true;
    for (int i = 0; i < TAKES - is_f64; i++) {
        double value = wide_value(found[i], is_f64) * (i == 0 ? unit : 1);
        *is_right &= fabs(value / answer.value[i] - 1) <= answer.tolerance[i];
    }
    return true;
}

/* ---- the time ---- */

static bool time_dispatch(struct probe *probe, enum wide_floats form, uint32_t groups, double *ms,
                          struct error *err)
{
    if (!use_program(probe, form, false, TIMED_LAYERS, err))
        return false;
    glFinish();
    double begin_ms = wall_ms();
    glDispatchCompute(groups, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glFinish();
    double elapsed_ms = fmax(wall_ms() - begin_ms, 1e-4);
    *ms = *ms > 0 ? fmin(*ms, elapsed_ms) : elapsed_ms;
    return true;
}

/* The first dispatch of a program may compile it, and is not counted. */
static bool measure(struct probe *probe, enum wide_floats pairs, double *pairs_over_f64,
                    struct error *err)
{
    double f64_ms = 0, pairs_ms = 0, ignored = 0;
    uint32_t groups = GROUPS_FIRST;
    if (!time_dispatch(probe, pairs, groups, &ignored, err) ||
        !time_dispatch(probe, WIDE_FLOATS_F64, groups, &ignored, err))
        return false;
    for (;;) {
        pairs_ms = 0;
        if (!time_dispatch(probe, pairs, groups, &pairs_ms, err))
            return false;
        if (pairs_ms >= WORK_MS || groups > GROUPS_MOST / 2)
            break;
        groups *= 2;
    }
    for (int i = 0; i < ROUNDS; i++)
        if (!time_dispatch(probe, WIDE_FLOATS_F64, groups, &f64_ms, err) ||
            !time_dispatch(probe, pairs, groups, &pairs_ms, err))
            return false;
    *pairs_over_f64 = pairs_ms / f64_ms;
    return true;
}

/* ---- the choice ---- */

static bool choose(struct probe *probe, struct wide_floats_choice *choice, struct error *err)
{
    enum wide_floats pairs = WIDE_FLOATS_PAIRS;
    bool has_pairs = false, has_f64 = false;
    if (!check(probe, pairs, &has_pairs, err))
        return false;
    if (!has_pairs && !check(probe, pairs = WIDE_FLOATS_PAIRS_SPLIT, &has_pairs, err))
        return false;
    if (!check(probe, WIDE_FLOATS_F64, &has_f64, err))
        return false;
    if (!has_pairs && !has_f64)
        return error_set(err, ERROR_NO_DEVICE,
                         "self-test 'layers': neither f64 nor pairs of f32 are what they must be");
    choice->form = has_pairs ? pairs : WIDE_FLOATS_F64;
    if (!has_pairs || !has_f64)
        return true;
    if (!measure(probe, pairs, &choice->pairs_over_f64, err))
        return false;
    if (choice->pairs_over_f64 > WIDE_FLOATS_F64_GAIN)
        choice->form = WIDE_FLOATS_F64;
    return true;
}

bool wide_floats_choose(const struct wide_floats_desc *desc, struct wide_floats_choice *choice,
                        struct error *err)
{
    struct probe probe = {.programs = desc->programs};
    const bool is_known = desc->asked == WIDE_FLOATS_MEASURED && desc->is_software;
    const enum wide_floats asked = is_known ? WIDE_FLOATS_F64 : desc->asked;
    bool is_right = true;
    *choice = (struct wide_floats_choice){.form = asked};
    program_cache_set_device_defines(desc->programs, "");
    bool ok = gl_buffer_init(&probe.results,
                             &(struct gl_buffer_desc){.label = "selftest.wide",
                                                      .size_bytes = (uint64_t)TAKES * 8},
                             err) &&
              (asked == WIDE_FLOATS_MEASURED ? choose(&probe, choice, err)
                                             : check(&probe, asked, &is_right, err));
    gl_buffer_finish(&probe.results);
    if (ok && !is_right)
        return error_set(err, ERROR_NO_DEVICE, "self-test 'layers': %s are wrong here",
                         forms[asked].name);
    return ok;
}
