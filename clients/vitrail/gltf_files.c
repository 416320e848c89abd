/* SPDX-License-Identifier: MIT */
/* Collects the files of a scene, and refuses those that are none of its business. */
#include "clients/vitrail/gltf_files.h"

#include <ctype.h>
#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "protocol/limits.h"
#include "protocol/scene_format.h"

struct search {
    struct gltf_files *files;
    const char *gltf; /* path as given, for messages */
    char *folder;     /* resolved, of the .gltf */
    struct failure *failure;
};

void gltf_files_finish(struct gltf_files *files)
{
    for (size_t i = 0; i < files->count; i++) {
        free(files->files[i].name);
        free(files->files[i].path);
    }
    free(files->files);
    *files = (struct gltf_files){0};
}

/* Takes both strings, also on failure. */
static bool add(struct search *search, char *name, char *path)
{
    struct gltf_files *files = search->files;
    struct http_part *longer = NULL;

    if (name && path)
        longer = reallocarray(files->files, files->count + 1, sizeof *longer);
    if (!longer) {
        free(name);
        free(path);
        return fail_no_memory(search->failure);
    }
    files->files = longer;
    longer[files->count++] = (struct http_part){.name = name, .path = path};
    return true;
}

static int hex_value(char digit)
{
    return isdigit((unsigned char)digit) ? digit - '0' : tolower((unsigned char)digit) - 'a' + 10;
}

/* RFC 3986, 2.1. malloc'ed; a '%' that starts no escape stays as it is. NULL: no memory, or an
 * escaped NUL. */
static char *percent_decode(const char *text)
{
    char *decoded = malloc(strlen(text) + 1);
    char *out = decoded;

    while (decoded && *text) {
        if (text[0] == '%' && isxdigit((unsigned char)text[1]) &&
            isxdigit((unsigned char)text[2])) {
            *out = (char)(hex_value(text[1]) * 16 + hex_value(text[2]));
            text += 3;
            if (!*out++) {
                free(decoded);
                return NULL;
            }
        } else {
            *out++ = *text++;
        }
    }
    if (decoded)
        *out = '\0';
    return decoded;
}

/* "scheme:" of RFC 3986, 3.1. A drive letter counts as one too. */
static bool has_scheme(const char *uri)
{
    size_t n = strspn(uri, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.");
    return n > 0 && uri[n] == ':' && isalpha((unsigned char)uri[0]);
}

/* Drops "." and resolves ".." in place, by text alone. False when the name is absolute, empty or
 * climbs out. */
static bool name_normalise(char *name)
{
    char *out = name; /* end of what is kept; never past `in` */
    const char *in = name;

    if (*in == '/')
        return false;
    while (*in) {
        size_t n = strcspn(in, "/");
        if (n == 2 && !strncmp(in, "..", 2)) {
            if (out == name)
                return false;
            while (out > name && *--out != '/')
                continue;
        } else if (n > 0 && !(n == 1 && *in == '.')) {
            if (out > name)
                *out++ = '/';
            memmove(out, in, n);
            out += n;
        }
        in += n;
        if (*in == '/')
            in++;
    }
    *out = '\0';
    return out > name;
}

static bool is_known(const struct gltf_files *files, const char *name)
{
    for (size_t i = 0; i < files->count; i++)
        if (!strcmp(files->files[i].name, name))
            return true;
    return false;
}

/* Joins, checks and adds one file by its normalised name, which is taken. */
static bool add_named(struct search *search, const char *where, char *name)
{
    char *path = NULL, *resolved = NULL;
    size_t folder_length = strlen(search->folder);
    struct stat status;

    if (is_known(search->files, name)) {
        free(name);
        return true;
    }
    if (asprintf(&path, "%s/%s", search->folder, name) < 0) {
        free(name);
        return fail_no_memory(search->failure);
    }
    resolved = realpath(path, NULL);
    if (!resolved)
        fail(search->failure, EXIT_CODE_NO_INPUT, "%s: %s names '%s': %s", search->gltf, where,
             name, strerror(errno));
    else if (strncmp(resolved, search->folder, folder_length) != 0 ||
             (resolved[folder_length] != '/' && folder_length > 1))
        fail(search->failure, EXIT_CODE_REFUSED, "%s: %s names '%s', a link out of its folder",
             search->gltf, where, name);
    else if (stat(resolved, &status) != 0 || !S_ISREG(status.st_mode))
        fail(search->failure, EXIT_CODE_REFUSED, "%s: %s names '%s', which is no ordinary file",
             search->gltf, where, name);
    free(path);
    if (!search->failure->exit_code)
        return add(search, name, resolved);
    free(name);
    free(resolved);
    return false;
}

static bool add_uri(struct search *search, const char *where, const char *uri)
{
    char *name;

    if (!strncasecmp(uri, "data:", 5))
        return true;
    if (has_scheme(uri))
        return fail(search->failure, EXIT_CODE_REFUSED,
                    "%s: %s is '%.200s'; only files below its own folder can be sent", search->gltf,
                    where, uri);
    name = percent_decode(uri);
    if (!name || !name_normalise(name)) {
        free(name);
        return fail(search->failure, EXIT_CODE_REFUSED, "%s: %s '%.200s' leads out of its folder",
                    search->gltf, where, uri);
    }
    if (strlen(name) > LIMIT_FILE_NAME_BYTES) {
        free(name);
        return fail(search->failure, EXIT_CODE_REFUSED, "%s: %s is a name of more than %d bytes",
                    search->gltf, where, LIMIT_FILE_NAME_BYTES);
    }
    return add_named(search, where, name);
}

static bool add_table(struct search *search, const json_t *root, const char *table)
{
    const json_t *entries = json_object_get(root, table);
    const json_t *entry;
    size_t index;

    json_array_foreach(entries, index, entry)
    {
        const char *uri = json_string_value(json_object_get(entry, "uri"));
        char where[64];
        snprintf(where, sizeof where, "/%s/%zu/uri", table, index);
        if (uri && !add_uri(search, where, uri))
            return false;
        if (search->files->count > LIMIT_UPLOAD_FILES)
            return fail(search->failure, EXIT_CODE_REFUSED, "%s: more than %d files", search->gltf,
                        LIMIT_UPLOAD_FILES);
    }
    return true;
}

/* ---- Wavefront OBJ: its libraries of materials, and their textures ---- */

/* A file that old programs name as they like: one that is not below the folder is left to the
 * server to miss. *is_new: it is sent, and was not before. */
static bool add_loose(struct search *search, const char *text, size_t length, bool *is_new)
{
    char *name = strndup(text, length), *path = NULL, *resolved;
    size_t folder_length = strlen(search->folder);
    struct stat status;

    *is_new = false;
    if (!name)
        return fail_no_memory(search->failure);
    for (char *at = name; (at = strchr(at, '\\'));)
        *at = '/';
    if (!name_normalise(name) || strlen(name) > LIMIT_FILE_NAME_BYTES ||
        is_known(search->files, name) || search->files->count >= LIMIT_UPLOAD_FILES) {
        free(name);
        return true;
    }
    if (asprintf(&path, "%s/%s", search->folder, name) < 0) {
        free(name);
        return fail_no_memory(search->failure);
    }
    resolved = realpath(path, NULL);
    free(path);
    if (resolved && !strncmp(resolved, search->folder, folder_length) &&
        (resolved[folder_length] == '/' || folder_length == 1) && stat(resolved, &status) == 0 &&
        S_ISREG(status.st_mode)) {
        *is_new = true;
        return add(search, name, resolved);
    }
    free(name);
    free(resolved);
    return true;
}

/* What follows the options of a map, as "-s 1 1 1" or "-clamp on". */
static const char *skip_map_options(const char *at)
{
    while (*at == '-' && isalpha((unsigned char)at[1])) {
        at += strcspn(at, " \t");
        at += strspn(at, " \t");
        for (;;) { /* its values: numbers, on, off, and letters of channels */
            size_t length = strcspn(at, " \t");
            bool is_value = length > 0 && (strspn(at, "0123456789+-.eE") >= length || length == 1 ||
                                           !strncmp(at, "on ", 3) || !strncmp(at, "off ", 4));
            if (!is_value || !at[length])
                break;
            at += length;
            at += strspn(at, " \t");
        }
    }
    return at;
}

static bool is_map(const char *word, size_t length)
{
    static const char *const words[] = {"bump", "norm", "disp", "decal", "refl"};

    if (length > 4 && !strncasecmp(word, "map_", 4))
        return true;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strlen(words[i]) == length && !strncasecmp(words[i], word, length))
            return true;
    return false;
}

static bool add_text_files(struct search *search, const char *path, bool is_library);

/* One line of an .obj, or of an .mtl; without its end. */
static bool add_line(struct search *search, char *line, bool is_library)
{
    char *word = line + strspn(line, " \t");
    size_t length = strcspn(word, " \t");
    const char *rest = word + length + strspn(word + length, " \t");
    size_t rest_length = strlen(rest);
    bool is_new = false;

    while (rest_length > 0 && strchr(" \t\r\n", rest[rest_length - 1]))
        rest_length--;
    if (rest_length == 0)
        return true;
    if (is_library && is_map(word, length)) {
        const char *name = skip_map_options(rest);
        return add_loose(search, name, rest_length - (size_t)(name - rest), &is_new);
    }
    if (is_library || length != 6 || strncasecmp(word, "mtllib", 6) != 0)
        return true;
    if (!add_loose(search, rest, rest_length, &is_new))
        return false;
    return !is_new ||
           add_text_files(search, search->files->files[search->files->count - 1].path, true);
}

static bool add_text_files(struct search *search, const char *path, bool is_library)
{
    FILE *stream = fopen(path, "rbe");
    char *line = NULL;
    size_t room = 0;
    bool is_ok = true;

    if (!stream)
        return fail(search->failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", path,
                    strerror(errno));
    while (is_ok && getline(&line, &room, stream) >= 0)
        is_ok = add_line(search, line, is_library);
    free(line);
    fclose(stream);
    return is_ok;
}

/* Splits the resolved path of the .gltf into its folder and the first file. */
static bool add_gltf(struct search *search, char *resolved)
{
    const char *slash = strrchr(resolved, '/');

    search->folder = strndup(resolved, slash == resolved ? 1 : (size_t)(slash - resolved));
    if (!search->folder) {
        free(resolved);
        return fail_no_memory(search->failure);
    }
    return add(search, strdup(slash + 1), resolved);
}

static bool add_tables(struct search *search)
{
    json_error_t problem;
    json_t *root = json_load_file(search->gltf, JSON_ALLOW_NUL, &problem);
    bool is_ok = root ? add_table(search, root, "buffers") && add_table(search, root, "images")
                      : fail(search->failure, EXIT_CODE_REFUSED, "%s: not glTF: line %d: %s",
                             search->gltf, problem.line, problem.text);

    json_decref(root);
    return is_ok;
}

bool gltf_files_find(struct gltf_files *files, const char *path, struct failure *failure)
{
    struct search search = {.files = files, .gltf = path, .failure = failure};
    char *resolved = realpath(path, NULL);
    enum scene_format format = SCENE_FORMAT_GLTF;
    bool is_ok = false;

    *files = (struct gltf_files){0};
    if (!resolved)
        return fail(failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", path, strerror(errno));
    scene_format_of_file(path, &format);
    if (add_gltf(&search, resolved))
        is_ok = format == SCENE_FORMAT_GLTF  ? add_tables(&search)
                : format == SCENE_FORMAT_OBJ ? add_text_files(&search, path, false)
                                             : true;
    free(search.folder);
    if (!is_ok)
        gltf_files_finish(files);
    return is_ok;
}
