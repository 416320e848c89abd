/* SPDX-License-Identifier: MIT */
/* Links every program of a folder of dumped shaders with the driver at hand and prints, a line
 * each, what its compiler says of them: usage: compile_programs FOLDER. Drivers of Mesa tell
 * statistics of shaders as debug messages while they link, if they compile in the thread that asks.
 */
#include <dirent.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"

enum { KEY = 16 }; /* names begin with the key of their program, in hexadecimal */

static GLenum kind_of(const char *name)
{
    return strstr(name, ".comp.")   ? GL_COMPUTE_SHADER
           : strstr(name, ".vert.") ? GL_VERTEX_SHADER
           : strstr(name, ".frag.") ? GL_FRAGMENT_SHADER
           : strstr(name, ".geom.") ? GL_GEOMETRY_SHADER
           : strstr(name, ".tesc.") ? GL_TESS_CONTROL_SHADER
           : strstr(name, ".tese.") ? GL_TESS_EVALUATION_SHADER
                                    : 0;
}

static int is_program(const struct dirent *entry)
{
    return strlen(entry->d_name) > KEY + 1 && entry->d_name[KEY] == '-' && kind_of(entry->d_name);
}

static char *read_text(const char *folder, const char *name)
{
    char path[4096], *text = NULL;
    size_t size = 0;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    if (!file || getdelim(&text, &size, 0, file) < 0) {
        fprintf(stderr, "compile_programs: %s cannot be read\n", path);
        exit(1);
    }
    fclose(file);
    return text;
}

static void GLAPIENTRY on_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                  GLsizei length, const GLchar *text, const void *program)
{
    (void)type, (void)id, (void)severity, (void)length;
    if (source == GL_DEBUG_SOURCE_SHADER_COMPILER && *(const char *const *)program)
        printf("said\t%s\t%.*s\n", *(const char *const *)program, (int)strcspn(text, "\n"), text);
}

static bool attach(GLuint program, const char *folder, const char *name)
{
    char *text = read_text(folder, name), log[1024] = "";
    const GLchar *source = text;
    GLint ok = 0;
    GLuint shader = glCreateShader(kind_of(name));
    glShaderSource(shader, 1, &source, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        fprintf(stderr, "%s: %s\n", name, log);
    }
    glAttachShader(program, shader);
    glDeleteShader(shader);
    free(text);
    return ok;
}

/* A program's stages follow each other in the list. */
static bool link_program(const char *folder, struct dirent **names, int count, const char **current)
{
    GLuint program = glCreateProgram();
    GLint ok = 1;
    char log[1024] = "";
    *current = NULL;
    for (int i = 0; i < count; i++)
        ok &= attach(program, folder, names[i]->d_name);
    *current = names[0]->d_name;
    glLinkProgram(program);
    if (ok) {
        glGetProgramiv(program, GL_LINK_STATUS, &ok);
        glGetProgramInfoLog(program, sizeof log, NULL, log);
    }
    *current = NULL; /* from here on the driver compiles what is its own */
    printf("%s", ok ? "linked" : "failed");
    for (int i = 0; i < count; i++)
        printf("\t%s", names[i]->d_name);
    printf("\n");
    if (!ok)
        fprintf(stderr, "%s does not link: %s\n", names[0]->d_name, log);
    glDeleteProgram(program);
    return ok;
}

int main(int argc, char **argv)
{
    struct error err = {0};
    struct dirent **names = NULL;
    static const char *current; /* the program that is linked; messages come with a pointer only */
    int count = argc == 2 ? scandir(argv[1], &names, is_program, alphasort) : -1, failed = 0;
    if (count <= 0) {
        fprintf(stderr,
                "usage: compile_programs FOLDER of programs, as --dump-shaders writes them\n");
        return 2;
    }
    struct gl_context *context =
        gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context) {
        printf("skipped: %s\n", err.message);
        return 77;
    }
    printf("device\t%s\n", gl_context_limits(context)->renderer);
    glDebugMessageCallback(on_message, &current);
    glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DONT_CARE, 0, NULL, GL_TRUE);
    for (int i = 0, next; i < count; i = next) {
        for (next = i + 1; next < count && !strncmp(names[i]->d_name, names[next]->d_name, KEY);)
            next++;
        failed += !link_program(argv[1], names + i, next - i, &current);
    }
    for (int i = 0; i < count; i++)
        free(names[i]);
    free(names);
    gl_context_destroy(context);
    return failed ? 1 : 0;
}
