/* SPDX-License-Identifier: MIT */
/* Finding a shader file by its name. */
#include "shaders/shader_table.h"

#include <string.h>

const struct shader_file *shader_table_find(const struct shader_file *table, const char *name)
{
    size_t length = strlen(name);
    for (const struct shader_file *file = table; file->name; file++) {
        size_t path_length = strlen(file->name);
        if (path_length > length && file->name[path_length - length - 1] == '/' &&
            !strcmp(file->name + path_length - length, name))
            return file;
    }
    return NULL;
}

const struct shader_file *shader_find(const char *name)
{
    return shader_table_find(shader_table, name);
}
