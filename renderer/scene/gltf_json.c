/* SPDX-License-Identifier: MIT */
/* A scanner of glTF JSON: limits, balance, and the elements of "buffers" and "images". */
#include "renderer/scene/gltf_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CUTS_MAX = 4 }; /* buffers, images, skins, animations */

struct span {
    const char *begin, *end;
};

struct scanner {
    const char *text, *at, *end;
    size_t values;
    struct span cuts[CUTS_MAX];
    int cut_count;
    struct error *err;
};

static bool refuse(struct scanner *s, const char *reason)
{
    return error_set(s->err, ERROR_INVALID_SCENE, "glTF JSON, byte %zu: %s",
                     (size_t)(s->at - s->text), reason);
}

static void skip_space(struct scanner *s)
{
    while (s->at < s->end && (*s->at == ' ' || *s->at == '\t' || *s->at == '\n' || *s->at == '\r'))
        s->at++;
}

static bool take(struct scanner *s, char c)
{
    skip_space(s);
    if (s->at == s->end || *s->at != c)
        return false;
    s->at++;
    return true;
}

static bool count_value(struct scanner *s)
{
    if (++s->values > GLTF_JSON_VALUES_MAX)
        return error_set(s->err, ERROR_TOO_LARGE, "glTF JSON holds more than %d values",
                         GLTF_JSON_VALUES_MAX);
    return true;
}

/* Passes a string; its inside, still escaped, is in *inside. */
static bool scan_string(struct scanner *s, struct span *inside)
{
    if (!take(s, '"'))
        return refuse(s, "a string is expected");
    inside->begin = s->at;
    while (s->at < s->end && *s->at != '"') {
        if ((unsigned char)*s->at < 0x20)
            return refuse(s, "control character in a string");
        s->at += *s->at == '\\' ? 2 : 1;
    }
    if (s->at >= s->end) {
        s->at = s->end;
        return refuse(s, "a string does not end");
    }
    inside->end = s->at++;
    return true;
}

/* Passes one value of any kind: brackets must match in kind, and stay within the depth. */
static bool skip_value(struct scanner *s, int depth)
{
    char closers[GLTF_JSON_DEPTH_MAX];
    int open = 0;
    struct span ignored;
    do {
        skip_space(s);
        if (s->at == s->end)
            return refuse(s, "the text ends inside a value");
        char c = *s->at;
        if (c == '"') {
            if (!count_value(s) || !scan_string(s, &ignored))
                return false;
        } else if (c == '{' || c == '[') {
            if (depth + open >= GLTF_JSON_DEPTH_MAX)
                return refuse(s, "nested too deeply");
            if (!count_value(s))
                return false;
            closers[open++] = c == '{' ? '}' : ']';
            s->at++;
        } else if (c == '}' || c == ']') {
            if (open == 0 || closers[open - 1] != c)
                return refuse(s, "brackets do not match");
            open--;
            s->at++;
        } else if (open > 0 && (c == ',' || c == ':')) {
            s->at++;
        } else {
            const char *start = s->at;
            while (s->at < s->end && !strchr(" \t\r\n,:]}[{\"", *s->at))
                s->at++;
            if (s->at == start)
                return refuse(s, "a value is expected");
            if (!count_value(s))
                return false;
        }
    } while (open > 0);
    return true;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Four hex digits at *at, or -1. */
static long read_unit(const char **at, const char *end)
{
    if (end - *at < 4)
        return -1;
    long unit = 0;
    for (int i = 0; i < 4; i++) {
        int digit = hex_digit((*at)[i]);
        if (digit < 0)
            return -1;
        unit = unit * 16 + digit;
    }
    *at += 4;
    return unit;
}

static char *write_utf8(char *out, long code)
{
    if (code < 0x80) {
        *out++ = (char)code;
    } else if (code < 0x800) {
        *out++ = (char)(0xC0 | code >> 6);
        *out++ = (char)(0x80 | (code & 0x3F));
    } else if (code < 0x10000) {
        *out++ = (char)(0xE0 | code >> 12);
        *out++ = (char)(0x80 | (code >> 6 & 0x3F));
        *out++ = (char)(0x80 | (code & 0x3F));
    } else {
        *out++ = (char)(0xF0 | code >> 18);
        *out++ = (char)(0x80 | (code >> 12 & 0x3F));
        *out++ = (char)(0x80 | (code >> 6 & 0x3F));
        *out++ = (char)(0x80 | (code & 0x3F));
    }
    return out;
}

/* The code point after "\u", joining surrogates; -1 when malformed, or zero (our texts end there).
 */
static long read_escape(const char **at, const char *end)
{
    long code = read_unit(at, end);
    if (code >= 0xD800 && code < 0xDC00) {
        if (end - *at < 6 || (*at)[0] != '\\' || (*at)[1] != 'u')
            return -1;
        *at += 2;
        long low = read_unit(at, end);
        if (low < 0xDC00 || low > 0xDFFF)
            return -1;
        return 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
    }
    return code == 0 || (code >= 0xDC00 && code < 0xE000) ? -1 : code;
}

static int simple_escape(char kind)
{
    switch (kind) {
    case '"':
    case '\\':
    case '/':
        return kind;
    case 'b':
        return '\b';
    case 'f':
        return '\f';
    case 'n':
        return '\n';
    case 'r':
        return '\r';
    case 't':
        return '\t';
    default:
        return -1;
    }
}

/* Unescapes into new memory. An escape never grows: six bytes at least become four at most. */
static char *unescape(struct scanner *s, struct span inside)
{
    char *text = malloc((size_t)(inside.end - inside.begin) + 1);
    if (!text) {
        error_set(s->err, ERROR_NO_MEMORY, "glTF JSON string");
        return NULL;
    }
    char *out = text;
    const char *at = inside.begin;
    while (at < inside.end) {
        if (*at != '\\') {
            *out++ = *at++;
            continue;
        }
        char kind = at[1];
        at += 2;
        long code = kind == 'u' ? read_escape(&at, inside.end) : simple_escape(kind);
        if (code < 0) {
            refuse(s, "bad escape in a string");
            free(text);
            return NULL;
        }
        out = write_utf8(out, code);
    }
    *out = '\0';
    return text;
}

static bool scan_text(struct scanner *s, char **text)
{
    struct span inside;
    if (*text)
        return refuse(s, "a member is there twice");
    if (!count_value(s) || !scan_string(s, &inside))
        return false;
    *text = unescape(s, inside);
    return *text != NULL;
}

static bool scan_unsigned(struct scanner *s, uint64_t *number)
{
    skip_space(s);
    uint64_t value = 0;
    const char *start = s->at;
    for (; s->at < s->end && *s->at >= '0' && *s->at <= '9'; s->at++) {
        if (value > (UINT64_MAX >> 8) / 10)
            return refuse(s, "number too large");
        value = value * 10 + (uint64_t)(*s->at - '0');
    }
    if (s->at == start || (s->at < s->end && strchr(".eE-+", *s->at)))
        return refuse(s, "a whole number, not negative, is expected");
    *number = value;
    return count_value(s);
}

static bool span_is(struct span key, const char *name)
{
    size_t length = strlen(name);
    return (size_t)(key.end - key.begin) == length && memcmp(key.begin, name, length) == 0;
}

static bool scan_source_member(struct scanner *s, struct span key, struct gltf_source *source)
{
    if (span_is(key, "name"))
        return scan_text(s, &source->name);
    if (span_is(key, "uri"))
        return scan_text(s, &source->uri);
    if (span_is(key, "mimeType"))
        return scan_text(s, &source->mime_type);
    if (span_is(key, "byteLength"))
        return scan_unsigned(s, &source->byte_length);
    if (span_is(key, "bufferView")) {
        uint64_t view;
        if (!scan_unsigned(s, &view))
            return false;
        source->buffer_view = view > INT32_MAX ? INT32_MAX : (int64_t)view;
        return true;
    }
    return skip_value(s, 3);
}

static bool scan_source(struct scanner *s, struct gltf_source *source)
{
    source->buffer_view = -1;
    if (!count_value(s) || !take(s, '{'))
        return refuse(s, "an object is expected");
    if (take(s, '}'))
        return true;
    do {
        struct span key;
        if (!scan_string(s, &key))
            return false;
        if (!take(s, ':'))
            return refuse(s, "':' is expected");
        if (!scan_source_member(s, key, source))
            return false;
    } while (take(s, ','));
    return take(s, '}') || refuse(s, "'}' or ',' is expected");
}

/* Grows by doubling; count elements are there. */
static struct gltf_source *sources_grow(struct scanner *s, struct gltf_source **sources,
                                        size_t count)
{
    if ((count & (count - 1)) == 0) {
        size_t capacity = count ? count * 2 : 1;
        struct gltf_source *grown = realloc(*sources, capacity * sizeof *grown);
        if (!grown) {
            error_set(s->err, ERROR_NO_MEMORY, "glTF JSON");
            return NULL;
        }
        *sources = grown;
    }
    memset(*sources + count, 0, sizeof **sources);
    return *sources + count;
}

/* Elements go to *sources, or are only counted when that is NULL. */
static bool scan_array(struct scanner *s, struct gltf_source **sources, size_t *count)
{
    if (!take(s, '['))
        return refuse(s, "an array is expected");
    if (take(s, ']'))
        return true;
    do {
        if (sources) {
            struct gltf_source *source = sources_grow(s, sources, *count);
            if (!source)
                return false;
            ++*count;
            if (!scan_source(s, source))
                return false;
        } else {
            ++*count;
            if (!skip_value(s, 2))
                return false;
        }
    } while (take(s, ','));
    return take(s, ']') || refuse(s, "']' or ',' is expected");
}

static bool scan_cut(struct scanner *s, struct gltf_source **sources, size_t *count)
{
    skip_space(s);
    if (s->cut_count == CUTS_MAX || *count)
        return refuse(s, "a member is there twice");
    struct span *cut = &s->cuts[s->cut_count++];
    cut->begin = s->at;
    if (!scan_array(s, sources, count))
        return false;
    cut->end = s->at;
    return true;
}

static bool scan_member(struct scanner *s, struct gltf_json *json)
{
    struct span key;
    if (!scan_string(s, &key))
        return false;
    if (memchr(key.begin, '\\', (size_t)(key.end - key.begin)))
        return refuse(s, "a top-level key has an escape"); /* could hide a name we take out */
    if (!take(s, ':'))
        return refuse(s, "':' is expected");
    if (span_is(key, "buffers"))
        return scan_cut(s, &json->buffers, &json->buffer_count);
    if (span_is(key, "images"))
        return scan_cut(s, &json->images, &json->image_count);
    if (span_is(key, "skins"))
        return scan_cut(s, NULL, &json->skin_count);
    if (span_is(key, "animations"))
        return scan_cut(s, NULL, &json->animation_count);
    return skip_value(s, 1);
}

static bool scan_document(struct scanner *s, struct gltf_json *json)
{
    if (!take(s, '{'))
        return refuse(s, "an object is expected");
    if (!take(s, '}')) {
        do {
            if (!scan_member(s, json))
                return false;
        } while (take(s, ','));
        if (!take(s, '}'))
            return refuse(s, "'}' or ',' is expected");
    }
    skip_space(s);
    while (s->at < s->end && *s->at == '\0') /* some GLB writers pad their JSON with zeros */
        s->at++;
    return s->at == s->end || refuse(s, "something follows the document");
}

/* Unicode 15, table 3-7. */
static bool check_utf8(struct scanner *s)
{
    const unsigned char *at = (const unsigned char *)s->text, *end = (const unsigned char *)s->end;
    while (at < end) {
        if (*at < 0x80) {
            at++;
            continue;
        }
        int more = *at >= 0xC2 && *at <= 0xDF   ? 1
                   : *at >= 0xE0 && *at <= 0xEF ? 2
                   : *at >= 0xF0 && *at <= 0xF4 ? 3
                                                : 0;
        bool is_good = more > 0 && end - at > more;
        for (int i = 1; is_good && i <= more; i++)
            is_good = (at[i] & 0xC0) == 0x80;
        if (is_good && more > 1) {
            unsigned lead = at[0], second = at[1];
            is_good = !(lead == 0xE0 && second < 0xA0) && !(lead == 0xED && second > 0x9F) &&
                      !(lead == 0xF0 && second < 0x90) && !(lead == 0xF4 && second > 0x8F);
        }
        if (!is_good) {
            s->at = (const char *)at;
            return refuse(s, "not UTF-8");
        }
        at += more + 1;
    }
    return true;
}

static bool write_rest(struct scanner *s, struct gltf_json *json)
{
    const char *end = s->end;
    while (end > s->text && end[-1] == '\0')
        end--;
    char *out = json->rest = malloc((size_t)(end - s->text) + 1);
    if (!out)
        return error_set(s->err, ERROR_NO_MEMORY, "glTF JSON");
    const char *from = s->text;
    for (int i = 0; i < s->cut_count; i++) { /* each cut is at least "[]" long */
        size_t length = (size_t)(s->cuts[i].begin - from);
        memcpy(out, from, length);
        memcpy(out + length, "[]", 2);
        out += length + 2;
        from = s->cuts[i].end;
    }
    memcpy(out, from, (size_t)(end - from));
    out += end - from;
    *out = '\0';
    json->rest_length = (size_t)(out - json->rest);
    return true;
}

bool gltf_json_init(struct gltf_json *json, const char *text, size_t length, struct error *err)
{
    memset(json, 0, sizeof *json);
    if (length > GLTF_JSON_BYTES_MAX)
        return error_set(err, ERROR_TOO_LARGE, "glTF JSON of %zu bytes, limit is %u", length,
                         GLTF_JSON_BYTES_MAX);
    if (length >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0) {
        text += 3;
        length -= 3;
    }
    struct scanner s = {.text = text, .at = text, .end = text + length, .err = err};
    if (check_utf8(&s) && scan_document(&s, json) && write_rest(&s, json))
        return true;
    gltf_json_finish(json);
    return false;
}

static void sources_free(struct gltf_source *sources, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        free(sources[i].name);
        free(sources[i].uri);
        free(sources[i].mime_type);
    }
    free(sources);
}

void gltf_json_finish(struct gltf_json *json)
{
    sources_free(json->buffers, json->buffer_count);
    sources_free(json->images, json->image_count);
    free(json->rest);
    memset(json, 0, sizeof *json);
}
