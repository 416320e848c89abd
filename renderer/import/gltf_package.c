/* SPDX-License-Identifier: MIT */
/* Root file, GLB container (glTF 2.0 specification, section 4) and URIs (RFC 3986, RFC 2397) of an
 * upload. */
#include "renderer/import/gltf_package.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    GLB_HEADER_BYTES = 12,
    CHUNK_HEADER_BYTES = 8,
    /* Two uploaded names (LIMIT_FILE_NAME_BYTES), one of them the root's folder. */
    PATH_BYTES_MAX = 1024,
    URI_SHOWN_BYTES = 80, /* of a URI in a message */
};
#define GLB_VERSION 2u
#define CHUNK_JSON 0x4E4F534Au
#define CHUNK_BIN 0x004E4942u

static uint32_t read_u32(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static bool has_suffix(const char *name, const char *suffix)
{
    size_t length = strlen(name), suffix_length = strlen(suffix);
    return length >= suffix_length && strcasecmp(name + length - suffix_length, suffix) == 0;
}

static bool is_glb(const struct scene_file *file)
{
    return file->size_bytes >= 4 && memcmp(file->bytes, "glTF", 4) == 0;
}

static bool is_named_root(const struct scene_file *file)
{
    return has_suffix(file->name, ".gltf") || has_suffix(file->name, ".glb");
}

static bool find_root(struct gltf_package *package, struct error *err)
{
    /* names decide; only without one, the magic */
    for (int pass = 0; pass < 2 && !package->root; pass++)
        for (size_t i = 0; i < package->file_count; i++) {
            const struct scene_file *file = &package->files[i];
            if (pass == 0 ? !is_named_root(file) : !is_glb(file) && package->file_count > 1)
                continue;
            if (package->root)
                return error_set(err, ERROR_INVALID_SCENE,
                                 "both '%s' and '%s' are glTF files, one is expected",
                                 package->root->name, file->name);
            package->root = file;
        }
    if (!package->root)
        return error_set(err, ERROR_INVALID_SCENE, "no .gltf or .glb file among the %zu uploaded",
                         package->file_count);
    return true;
}

static bool read_chunks(struct gltf_package *package, const uint8_t *at, const uint8_t *end,
                        struct error *err)
{
    for (int index = 0; at < end; index++) {
        if (end - at < CHUNK_HEADER_BYTES)
            return error_set(err, ERROR_INVALID_SCENE, "GLB: chunk %d has no whole header", index);
        uint32_t length = read_u32(at), kind = read_u32(at + 4);
        at += CHUNK_HEADER_BYTES;
        if (length > (size_t)(end - at))
            return error_set(err, ERROR_INVALID_SCENE, "GLB: chunk %d says %u bytes, %zu are left",
                             index, length, (size_t)(end - at));
        if ((index == 0) != (kind == CHUNK_JSON))
            return error_set(err, ERROR_INVALID_SCENE,
                             "GLB: the first chunk, and no other, must be JSON");
        if (kind == CHUNK_JSON) {
            package->json = (const char *)at;
            package->json_length = length;
        } else if (kind == CHUNK_BIN && !package->bin) {
            package->bin = at;
            package->bin_length = length;
        }
        at += length;
    }
    if (!package->json)
        return error_set(err, ERROR_INVALID_SCENE, "GLB: there is no JSON chunk");
    return true;
}

static bool read_glb(struct gltf_package *package, struct error *err)
{
    const uint8_t *bytes = package->root->bytes;
    size_t size = package->root->size_bytes;
    if (size < GLB_HEADER_BYTES)
        return error_set(err, ERROR_INVALID_SCENE, "GLB: %zu bytes are no whole header", size);
    uint32_t version = read_u32(bytes + 4), length = read_u32(bytes + 8);
    if (version != GLB_VERSION)
        return error_set(err, ERROR_UNSUPPORTED, "GLB: version %u, only 2 is read", version);
    if (length > size || length < GLB_HEADER_BYTES)
        return error_set(err, ERROR_INVALID_SCENE,
                         "GLB: the header says %u bytes, the file has %zu", length, size);
    return read_chunks(package, bytes + GLB_HEADER_BYTES, bytes + length, err);
}

/* What follows is the JSON scanner's to judge. */
static bool begins_like_json(const struct gltf_package *package)
{
    const char *at = package->json, *end = at + package->json_length;
    if (end - at >= 3 && memcmp(at, "\xEF\xBB\xBF", 3) == 0)
        at += 3;
    while (at < end && *at && strchr(" \t\r\n", *at))
        at++;
    return at < end && *at == '{';
}

bool gltf_package_init(struct gltf_package *package, const struct scene_file *files,
                       size_t file_count, struct error *err)
{
    *package = (struct gltf_package){.files = files, .file_count = file_count};
    if (!find_root(package, err))
        return false;
    if (is_glb(package->root))
        return read_glb(package, err);
    package->json = package->root->bytes;
    package->json_length = package->root->size_bytes;
    return begins_like_json(package) ||
           error_set(err, ERROR_INVALID_SCENE,
                     "the upload is neither a GLB ('glTF' in front) nor a .gltf (a JSON object)");
}

static bool refuse(struct error *err, const char *uri, const char *reason)
{
    return error_set(err, ERROR_INVALID_SCENE, "URI '%.*s%s' %s", URI_SHOWN_BYTES, uri,
                     strlen(uri) > URI_SHOWN_BYTES ? "..." : "", reason);
}

static int base64_digit(char c)
{
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static bool decode_base64(const char *text, const char *uri, struct gltf_bytes *bytes,
                          struct error *err)
{
    size_t length = strlen(text);
    while (length > 0 && text[length - 1] == '=')
        length--;
    if (length % 4 == 1)
        return refuse(err, uri, "is not base64");
    uint8_t *out = malloc(length / 4 * 3 + 3);
    if (!out)
        return error_set(err, ERROR_NO_MEMORY, "data: URI of %zu bytes", length);
    uint32_t bits = 0;
    size_t size = 0;
    for (size_t i = 0; i < length; i++) {
        int digit = base64_digit(text[i]);
        if (digit < 0) {
            free(out);
            return refuse(err, uri, "is not base64");
        }
        bits = bits << 6 | (uint32_t)digit;
        if (i % 4 > 0)
            out[size++] = (uint8_t)(bits >> (6 - i % 4 * 2));
    }
    *bytes = (struct gltf_bytes){.bytes = out, .size_bytes = size, .owned = out};
    return true;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c = (char)tolower((unsigned char)c);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* False when it does not fit, a percent sign has no two digits after it, or a zero byte appears. */
static bool decode_percent(const char *uri, char *out, size_t out_bytes)
{
    size_t length = 0;
    for (const char *at = uri; *at; at++) {
        int c = (unsigned char)*at;
        if (c == '%') {
            int high = hex_digit(at[1]), low = high < 0 ? -1 : hex_digit(at[2]);
            if (low < 0)
                return false;
            c = high * 16 + low;
            at += 2;
        }
        if (c == 0 || length + 1 >= out_bytes)
            return false;
        out[length++] = (char)c;
    }
    out[length] = '\0';
    return true;
}

/* Appends the segments of a path to one already normal: '.' and '' vanish, '..' takes one away.
 * False when that would leave the upload, or the result does not fit. */
static bool append_path(char *normal, size_t normal_bytes, const char *path, size_t path_length)
{
    size_t length = strlen(normal);
    for (size_t at = 0; at < path_length;) {
        const char *segment = path + at, *slash = memchr(segment, '/', path_length - at);
        size_t segment_length = slash ? (size_t)(slash - segment) : path_length - at;
        at += segment_length + 1;
        if (segment_length == 0 || (segment_length == 1 && segment[0] == '.'))
            continue;
        if (segment_length == 2 && memcmp(segment, "..", 2) == 0) {
            if (length == 0)
                return false;
            char *last = memrchr(normal, '/', length);
            length = last ? (size_t)(last - normal) : 0;
        } else {
            if (length + segment_length + 2 > normal_bytes)
                return false;
            if (length > 0)
                normal[length++] = '/';
            memcpy(normal + length, segment, segment_length);
            length += segment_length;
        }
        normal[length] = '\0';
    }
    return true;
}

static const struct scene_file *find_file(const struct gltf_package *package, const char *normal)
{
    for (size_t i = 0; i < package->file_count; i++) {
        char name[PATH_BYTES_MAX] = "";
        const struct scene_file *file = &package->files[i];
        if (append_path(name, sizeof name, file->name, strlen(file->name)) &&
            strcmp(name, normal) == 0)
            return file;
    }
    return NULL;
}

static bool has_scheme(const char *uri)
{
    if (!isalpha((unsigned char)*uri))
        return false;
    while (isalnum((unsigned char)*uri) || *uri == '+' || *uri == '-' || *uri == '.')
        uri++;
    return *uri == ':';
}

bool gltf_package_resolve(const struct gltf_package *package, const char *uri,
                          struct gltf_bytes *bytes, struct error *err)
{
    memset(bytes, 0, sizeof *bytes);
    if (strncasecmp(uri, "data:", 5) == 0) {
        const char *comma = strchr(uri, ',');
        if (!comma || comma - uri < 7 || strncasecmp(comma - 7, ";base64", 7) != 0)
            return refuse(err, uri, "is not base64");
        return decode_base64(comma + 1, uri, bytes, err);
    }
    if (has_scheme(uri))
        return refuse(err, uri, "has a scheme; only data: and uploaded files are read");
    char path[PATH_BYTES_MAX] = "", normal[PATH_BYTES_MAX] = "";
    if (!decode_percent(uri, path, sizeof path))
        return refuse(err, uri, "is too long or badly escaped");
    if (path[0] == '/')
        return refuse(err, uri, "is an absolute path; only uploaded files are read");
    const char *root = package->root->name, *slash = strrchr(root, '/');
    if (!append_path(normal, sizeof normal, root, slash ? (size_t)(slash - root) : 0) ||
        !append_path(normal, sizeof normal, path, strlen(path)))
        return refuse(err, uri, "leads out of the upload");
    const struct scene_file *file = find_file(package, normal);
    if (!file)
        return refuse(err, uri, "is not among the uploaded files");
    bytes->bytes = file->bytes;
    bytes->size_bytes = file->size_bytes;
    return true;
}
