/* SPDX-License-Identifier: MIT */
/* Scanning JSON text: strings, whole numbers, and values that are passed over. */
#include "renderer/import/gltf_scanner.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_json.h"

bool scanner_refuse(struct scanner *s, const char *reason)
{
    return error_set(s->err, ERROR_INVALID_SCENE, "glTF JSON, byte %zu: %s",
                     (size_t)(s->at - s->text), reason);
}

void scanner_skip_space(struct scanner *s)
{
    while (s->at < s->end && (*s->at == ' ' || *s->at == '\t' || *s->at == '\n' || *s->at == '\r'))
        s->at++;
}

/* Passes space, and the character if it comes next; says whether it did. */
static bool take(struct scanner *s, char c)
{
    scanner_skip_space(s);
    if (s->at == s->end || *s->at != c)
        return false;
    s->at++;
    return true;
}

bool scanner_count(struct scanner *s)
{
    if (++s->values > GLTF_JSON_VALUES_MAX)
        return error_set(s->err, ERROR_TOO_LARGE, "glTF JSON holds more than %d values",
                         GLTF_JSON_VALUES_MAX);
    return true;
}

/* Passes a string; its inside, still escaped, is in *inside. */
bool scanner_string(struct scanner *s, struct span *inside)
{
    if (!take(s, '"'))
        return scanner_refuse(s, "a string is expected");
    inside->begin = s->at;
    while (s->at < s->end && *s->at != '"') {
        if ((unsigned char)*s->at < 0x20)
            return scanner_refuse(s, "control character in a string");
        s->at += *s->at == '\\' ? 2 : 1;
    }
    if (s->at >= s->end) {
        s->at = s->end;
        return scanner_refuse(s, "a string does not end");
    }
    inside->end = s->at++;
    return true;
}

/* Passes one value of any kind: brackets must match in kind, and stay within the depth. */
bool scanner_skip(struct scanner *s, int depth)
{
    char closers[GLTF_JSON_DEPTH_MAX];
    int open = 0;
    struct span ignored;
    do {
        scanner_skip_space(s);
        if (s->at == s->end)
            return scanner_refuse(s, "the text ends inside a value");
        char c = *s->at;
        if (c == '"') {
            if (!scanner_count(s) || !scanner_string(s, &ignored))
                return false;
        } else if (c == '{' || c == '[') {
            if (depth + open >= GLTF_JSON_DEPTH_MAX)
                return scanner_refuse(s, "nested too deeply");
            if (!scanner_count(s))
                return false;
            closers[open++] = c == '{' ? '}' : ']';
            s->at++;
        } else if (c == '}' || c == ']') {
            if (open == 0 || closers[open - 1] != c)
                return scanner_refuse(s, "brackets do not match");
            open--;
            s->at++;
        } else if (open > 0 && (c == ',' || c == ':')) {
            s->at++;
        } else {
            const char *start = s->at;
            while (s->at < s->end && !strchr(" \t\r\n,:]}[{\"", *s->at))
                s->at++;
            if (s->at == start)
                return scanner_refuse(s, "a value is expected");
            if (!scanner_count(s))
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

/* The code point after "\u", joining surrogates; -1 if malformed or zero, which ends texts. */
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
            scanner_refuse(s, "bad escape in a string");
            free(text);
            return NULL;
        }
        out = write_utf8(out, code);
    }
    *out = '\0';
    return text;
}

bool scanner_text(struct scanner *s, char **text)
{
    struct span inside;
    if (*text)
        return scanner_refuse(s, "a member is there twice");
    if (!scanner_count(s) || !scanner_string(s, &inside))
        return false;
    *text = unescape(s, inside);
    return *text != NULL;
}

bool scanner_unsigned(struct scanner *s, uint64_t *number)
{
    scanner_skip_space(s);
    uint64_t value = 0;
    const char *start = s->at;
    for (; s->at < s->end && *s->at >= '0' && *s->at <= '9'; s->at++) {
        if (value > (UINT64_MAX >> 8) / 10)
            return scanner_refuse(s, "number too large");
        value = value * 10 + (uint64_t)(*s->at - '0');
    }
    if (s->at == start || (s->at < s->end && strchr(".eE-+", *s->at)))
        return scanner_refuse(s, "a whole number, not negative, is expected");
    *number = value;
    return scanner_count(s);
}

bool span_is(struct span key, const char *name)
{
    size_t length = strlen(name);
    return (size_t)(key.end - key.begin) == length && memcmp(key.begin, name, length) == 0;
}

bool scanner_object(struct scanner *s,
                    bool (*scan_member)(struct scanner *s, struct span key, void *object),
                    void *object)
{
    if (!scanner_count(s) || !take(s, '{'))
        return scanner_refuse(s, "an object is expected");
    if (take(s, '}'))
        return true;
    do {
        struct span key;
        if (!scanner_string(s, &key))
            return false;
        if (!take(s, ':'))
            return scanner_refuse(s, "':' is expected");
        if (!scan_member(s, key, object))
            return false;
    } while (take(s, ','));
    return take(s, '}') || scanner_refuse(s, "'}' or ',' is expected");
}

bool scanner_array(struct scanner *s, bool (*scan_element)(struct scanner *s, void *list),
                   void *list)
{
    if (!scanner_count(s) || !take(s, '['))
        return scanner_refuse(s, "an array is expected");
    if (take(s, ']'))
        return true;
    do {
        if (!scan_element(s, list))
            return false;
    } while (take(s, ','));
    return take(s, ']') || scanner_refuse(s, "']' or ',' is expected");
}

void *scanner_grow(struct scanner *s, void *items, size_t count, size_t size_bytes)
{
    if (count & (count - 1))
        return items;
    void *grown = reallocarray(items, count ? 2 * count : 1, size_bytes);
    if (!grown)
        error_set(s->err, ERROR_NO_MEMORY, "glTF JSON");
    return grown;
}
