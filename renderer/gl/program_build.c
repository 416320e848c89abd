/* SPDX-License-Identifier: MIT */
/* Compiling and linking of one program. */
#include "renderer/gl/program_build.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/base/wall_clock.h"

static GLuint begin_stage(const struct composition *composition, GLenum kind)
{
    GLuint shader = glCreateShader(kind);
    const GLchar *text = composition->text;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    return shader;
}

void program_build_begin(struct program_build *build, struct program_source *source, bool is_kept)
{
    static const GLenum kinds[PROGRAM_STAGES] = {GL_VERTEX_SHADER,          GL_TESS_CONTROL_SHADER,
                                                 GL_TESS_EVALUATION_SHADER, GL_GEOMETRY_SHADER,
                                                 GL_FRAGMENT_SHADER,        GL_COMPUTE_SHADER};
    double begin_ms = wall_ms();
    *build = (struct program_build){.source = *source, .program = glCreateProgram()};
    *source = (struct program_source){0};
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        if (!build->source.files[i])
            continue;
        build->shaders[i] = begin_stage(&build->source.stages[i], kinds[i]);
        glAttachShader(build->program, build->shaders[i]);
    }
    if (is_kept)
        glProgramParameteri(build->program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    glLinkProgram(build->program);
    build->spent_ms = wall_ms() - begin_ms;
}

static void report_log(const struct composition *composition, const struct program_desc *desc,
                       GLuint shader, struct error *err)
{
    char log[2048] = "", translated[4096] = "";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    composition_translate_log(composition, log, translated, sizeof translated);
    fprintf(stderr, "<3>shader '%s' [%s]:\n%s", desc->label, desc->defines ? desc->defines : "",
            translated);
    error_set(err, ERROR_INTERNAL, "shader '%s' does not compile: %.200s", desc->label, translated);
}

/* The first stage that does not compile, else what linking says. */
static void report_failure(const struct program_build *build, const struct program_desc *desc,
                           struct error *err)
{
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        GLint ok = GL_TRUE;
        if (build->shaders[i])
            glGetShaderiv(build->shaders[i], GL_COMPILE_STATUS, &ok);
        if (!ok) {
            report_log(&build->source.stages[i], desc, build->shaders[i], err);
            return;
        }
    }
    char log[1024] = "";
    glGetProgramInfoLog(build->program, sizeof log, NULL, log);
    error_set(err, ERROR_INTERNAL, "program '%s' does not link: %.200s", desc->label, log);
}

uint32_t program_build_end(struct program_build *build, const struct program_desc *desc,
                           struct error *err)
{
    GLint linked = 0;
    uint32_t program = build->program;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        report_failure(build, desc, err);
        return 0;
    }
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        if (!build->shaders[i])
            continue;
        glDetachShader(program, build->shaders[i]);
        glDeleteShader(build->shaders[i]);
        build->shaders[i] = 0;
    }
    build->program = 0;
    return program;
}

void program_build_finish(struct program_build *build)
{
    for (int i = 0; i < PROGRAM_STAGES; i++)
        if (build->shaders[i])
            glDeleteShader(build->shaders[i]);
    if (build->program)
        glDeleteProgram(build->program);
    program_source_finish(&build->source);
    *build = (struct program_build){.spent_ms = 0};
}
