/* SPDX-License-Identifier: MIT */
/* Joining shader sources into one source text. */
#include "renderer/gl/compose.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shaders/shader_table.h"

/* Extensions must precede all else, so the composer enables those that any source may use. */
static const char prologue[] = "#version 450 core\n"
                               "#extension GL_ARB_shader_draw_parameters : enable\n"
                               "#extension GL_ARB_post_depth_coverage : enable\n"
                               "#extension GL_ARB_shader_viewport_layer_array : enable\n"
                               "#extension GL_AMD_vertex_shader_layer : enable\n";

static bool append(struct composition *composition, const char *bytes, size_t length,
                   struct error *err)
{
    size_t needed = composition->length + length + 1;
    if (needed > composition->capacity) {
        char *grown = realloc(composition->text, 2 * needed);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "composing a shader of %zu bytes", needed);
        composition->text = grown;
        composition->capacity = 2 * needed;
    }
    memcpy(composition->text + composition->length, bytes, length);
    composition->length += length;
    composition->text[composition->length] = 0;
    return true;
}

static bool append_line_mark(struct composition *composition, int line, int file, struct error *err)
{
    char mark[48];
    int length = snprintf(mark, sizeof mark, "#line %d %d\n", line, file);
    return append(composition, mark, (size_t)length, err);
}

static bool append_defines(struct composition *composition, const char *defines, struct error *err)
{
    while (defines && *defines) {
        size_t length = strcspn(defines, " ");
        size_t name_length = strcspn(defines, " =");
        const char *value = name_length < length ? defines + name_length + 1 : "1";
        size_t value_length = name_length < length ? length - name_length - 1 : 1;
        if (length &&
            !(append(composition, "#define ", 8, err) &&
              append(composition, defines, name_length, err) && append(composition, " ", 1, err) &&
              append(composition, value, value_length, err) && append(composition, "\n", 1, err)))
            return false;
        defines += length;
        defines += strspn(defines, " ");
    }
    return true;
}

static bool read_include(const char *line, size_t length, char name[128])
{
    static const char word[] = "#include \"";
    size_t word_length = sizeof word - 1;
    if (length <= word_length || strncmp(line, word, word_length) != 0)
        return false;
    const char *begin = line + word_length;
    const char *end = memchr(begin, '"', length - word_length);
    if (!end || end - begin >= 128)
        return false;
    memcpy(name, begin, (size_t)(end - begin));
    name[end - begin] = 0;
    return true;
}

/* ---- #each ---- */

enum { EACH_TEXT_BYTES = 512 };

/* The value among defines of this name, up to a space; NULL: there is none. */
static const char *find_value(const char *defines, const char *name, size_t name_length)
{
    while (defines && *defines) {
        size_t length = strcspn(defines, " ");
        if (length > name_length && !strncmp(defines, name, name_length) &&
            defines[name_length] == '=')
            return defines + name_length + 1;
        defines += length;
        defines += strspn(defines, " ");
    }
    return NULL;
}

/* Field `number` of an item, counted from 1; empty where the item has fewer. */
static const char *find_field(const char *item, size_t item_length, int number, size_t *length)
{
    const char *end = item + item_length, *at = item;
    for (; number > 1 && at < end; number--) {
        at += strcspn(at, ":, ");
        at += at < end;
    }
    *length = at < end ? strcspn(at, ":, ") : 0;
    return at;
}

/* The text with the fields of one item in their places; false where it is too long. */
static bool fill_fields(const char *text, size_t text_length, const char *item, size_t item_length,
                        char out[EACH_TEXT_BYTES])
{
    size_t used = 0;
    for (size_t i = 0; i < text_length; i++) {
        bool is_field =
            text[i] == '$' && i + 1 < text_length && text[i + 1] >= '1' && text[i + 1] <= '9';
        const char *from = text + i;
        size_t length = 1;
        if (is_field)
            from = find_field(item, item_length, text[++i] - '0', &length);
        if (used + length >= EACH_TEXT_BYTES)
            return false;
        memcpy(out + used, from, length);
        used += length;
    }
    out[used] = 0;
    return true;
}

static const char each_word[] = "#each ";

static bool is_each(const char *line)
{
    return !strncmp(line, each_word, sizeof each_word - 1);
}

struct each_line {
    const char *text; /* behind each_word */
    size_t length;    /* with the line's end */
    int file, number, depth;
};

static bool append_file(struct composition *composition, const char *name, int depth,
                        struct error *err);

static bool append_filled(struct composition *composition, const struct each_line *line,
                          const char *filled, struct error *err)
{
    char included[128];
    if (read_include(filled, strlen(filled), included))
        return append_file(composition, included, line->depth + 1, err);
    return append_line_mark(composition, line->number, line->file, err) &&
           append(composition, filled, strlen(filled), err);
}

static bool append_each(struct composition *composition, const struct each_line *line,
                        struct error *err)
{
    size_t name_length = strcspn(line->text, " \n");
    const char *text = line->text + name_length + 1;
    const char *item = find_value(composition->defines, line->text, name_length);
    if (line->text[name_length] != ' ')
        return error_set(err, ERROR_INTERNAL, "%s:%d: #each has no text",
                         composition->files[line->file], line->number);
    while (item) {
        char filled[EACH_TEXT_BYTES];
        size_t item_length = strcspn(item, ", ");
        if (!fill_fields(text, line->length - name_length - 1, item, item_length, filled))
            return error_set(err, ERROR_INTERNAL, "%s:%d: #each has no room for '%.*s'",
                             composition->files[line->file], line->number, (int)item_length, item);
        if (!append_filled(composition, line, filled, err))
            return false;
        item = item[item_length] == ',' ? item + item_length + 1 : NULL;
    }
    return true;
}

/* ---- files ---- */

/* Several lines, or none, in place of this one, which begins with a word of the composer. */
static bool append_expansion(struct composition *composition, const struct each_line *line,
                             const char *included, struct error *err)
{
    bool ok = included ? append_file(composition, included, line->depth + 1, err)
                       : append_each(composition, line, err);
    return ok && append_line_mark(composition, line->number + 1, line->file, err);
}

static bool append_file(struct composition *composition, const char *name, int depth,
                        struct error *err)
{
    const struct shader_file *file = shader_find(name);
    for (int i = 0; file && i < composition->file_count; i++)
        if (!strcmp(composition->files[i], file->name))
            return true;
    if (!file || depth > 8 || composition->file_count == COMPOSITION_FILES_MAX)
        return error_set(err, ERROR_INTERNAL, "shader file '%s' %s", name,
                         file ? "is included too deeply" : "does not exist");
    int number = composition->file_count++;
    composition->files[number] = file->name;
    if (!append_line_mark(composition, 1, number, err))
        return false;
    int line_number = 0;
    for (const char *line = file->text; *line;) {
        const char *end = strchr(line, '\n');
        size_t length = end ? (size_t)(end - line) + 1 : strlen(line);
        char included[128];
        line_number++;
        bool has_include = read_include(line, length, included);
        const struct each_line expanded = {.text = line + sizeof each_word - 1,
                                           .length = length - (sizeof each_word - 1),
                                           .file = number,
                                           .number = line_number,
                                           .depth = depth};
        bool ok = has_include || is_each(line)
                      ? append_expansion(composition, &expanded, has_include ? included : NULL, err)
                      : append(composition, line, length, err);
        if (!ok)
            return false;
        line += length;
    }
    return append(composition, "\n", 1, err);
}

bool composition_init(struct composition *composition, const char *file, const char *device_defines,
                      const char *defines, struct error *err)
{
    composition->defines = defines;
    return append(composition, prologue, sizeof prologue - 1, err) &&
           append_defines(composition, device_defines, err) &&
           append_defines(composition, defines, err) && append_file(composition, file, 0, err);
}

void composition_finish(struct composition *composition)
{
    free(composition->text);
    *composition = (struct composition){0};
}

void composition_translate_log(const struct composition *composition, const char *log, char *out,
                               size_t size)
{
    size_t used = 0;
    while (*log && used + 1 < size) {
        size_t length = strcspn(log, "\n");
        char *rest;
        long number = strtol(log, &rest, 10);
        bool is_located = rest != log && (*rest == ':' || *rest == '(') && number >= 0 &&
                          number < composition->file_count;
        int written =
            is_located ? snprintf(out + used, size - used, "%s%.*s\n", composition->files[number],
                                  (int)(length - (size_t)(rest - log)), rest)
                       : snprintf(out + used, size - used, "%.*s\n", (int)length, log);
        used += written > 0 ? (size_t)written : 0;
        log += length + (log[length] == '\n');
    }
}
