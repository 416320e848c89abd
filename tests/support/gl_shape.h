/* SPDX-License-Identifier: MIT */
/* What a program reads and writes: GL's introspection, and the qualifiers readonly and writeonly of
 * its source, which GL does not tell. Thread: GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_SHAPE_H
#define VITRAIL_TESTS_SUPPORT_GL_SHAPE_H

#include "tests/support/gl_mirror.h"

void gl_shape_set_source(GLuint shader, GLsizei count, const GLchar *const *text,
                         const GLint *length);
void gl_shape_attach(GLuint program, GLuint shader);

/* Of the stages attached since it was created. Lives on. */
struct gl_shape *gl_shape_of_linked(const struct gl_functions *gl, GLuint program);
/* So that the same bytes, loaded later, have the same shape; of bytes that this process did not
 * keep itself every storage block is read and written. */
void gl_shape_keep(const struct gl_shape *shape, const void *binary, GLsizei length);
struct gl_shape *gl_shape_of_binary(const struct gl_functions *gl, GLuint program,
                                    const void *binary, GLsizei length);

#endif
