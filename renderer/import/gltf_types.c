/* SPDX-License-Identifier: MIT */
/* A walk over the text of a glTF document by the tables of its members. */
#include "renderer/import/gltf_types.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_fields.h"

enum { DEPTH = 12 }; /* of what is passed over inside; more than any of these objects has */

/* A value that is being read. */
struct walk {
    const struct walk *outer;  /* the object that it is a member of; NULL: the document itself */
    const struct field *field; /* what it must be */
    long element;              /* of a list that it is in; -1: of none */
    struct span key;           /* of a FIELD_MAP: the member being read; empty elsewhere */
    uint32_t seen;             /* of an object: a bit for each member that was there */
};

/* ---- refusals ---- */

struct path {
    char text[200];
    size_t length;
};

static void put(struct path *path, const char *text, int length)
{
    int written =
        snprintf(path->text + path->length, sizeof path->text - path->length, "%.*s", length, text);
    path->length += (size_t)written;
    if (path->length >= sizeof path->text)
        path->length = sizeof path->text - 1;
}

static bool is_only(struct span text, const char *characters)
{
    for (const char *at = text.begin; at < text.end; at++)
        if (!strchr(characters, *at))
            return false;
    return text.begin < text.end;
}

/* Such as "meshes[0].primitives[1].attributes.POSITION". */
static void put_place(struct path *path, const struct walk *walk)
{
    char element[32];
    if (!walk->outer)
        return;
    put_place(path, walk->outer);
    if (path->length)
        put(path, ".", 1);
    put(path, walk->field->name, (int)strlen(walk->field->name));
    if (walk->element >= 0)
        put(path, element, snprintf(element, sizeof element, "[%ld]", walk->element));
    bool is_plain = walk->key.end - walk->key.begin <= 40 &&
                    is_only(walk->key, "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_");
    if (is_plain) {
        put(path, ".", 1);
        put(path, walk->key.begin, (int)(walk->key.end - walk->key.begin));
    }
}

/* "PLACE must be a number". */
static bool refuse(struct scanner *s, const struct walk *walk, const char *what)
{
    struct path path = {.length = 0};
    put_place(&path, walk);
    put(&path, " ", 1);
    put(&path, what, (int)strlen(what));
    return scanner_refuse(s, path.text);
}

/* ---- literals ---- */

/* The literal that comes next, such as a number or true; empty before anything else. */
static struct span peek_literal(struct scanner *s)
{
    scanner_skip_space(s);
    struct span literal = {s->at, s->at};
    while (literal.end < s->end && !strchr(" \t\r\n,:]}[{\"", *literal.end))
        literal.end++;
    return literal;
}

/* Only an exponent makes a number infinite in so few characters. */
static bool is_finite(struct span number)
{
    char text[64];
    size_t length = (size_t)(number.end - number.begin);
    if (length >= sizeof text || is_only(number, "0123456789+-."))
        return true;
    memcpy(text, number.begin, length);
    text[length] = '\0';
    return isfinite(strtod(text, NULL));
}

/* Its grammar is tinygltf's to check. */
static bool scan_number(struct scanner *s, const struct walk *walk)
{
    struct span text = peek_literal(s);
    if (!is_only(text, "0123456789+-.eE"))
        return refuse(s, walk, "must be a number");
    if (!is_finite(text))
        return refuse(s, walk, "must be a finite number");
    s->at = text.end;
    return scanner_count(s);
}

static bool scan_boolean(struct scanner *s, const struct walk *walk)
{
    struct span text = peek_literal(s);
    if (!span_is(text, "true") && !span_is(text, "false"))
        return refuse(s, walk, "must be true or false");
    s->at = text.end;
    return scanner_count(s);
}

/* tinygltf would take the lowest 32 bits of an index. */
static bool scan_whole(struct scanner *s, const struct walk *walk, bool is_index)
{
    struct span text = peek_literal(s);
    if (!is_only(text, "0123456789"))
        return refuse(s, walk, "must be a whole number, not negative");
    uint64_t number = 0;
    for (const char *at = text.begin; at < text.end && number <= INT32_MAX; at++)
        number = 10 * number + (uint64_t)(*at - '0');
    if (is_index && number > INT32_MAX)
        return refuse(s, walk, "must be a whole number of at most 2147483647");
    s->at = text.end;
    return scanner_count(s);
}

/* ---- objects and lists ---- */

static bool scan_value(struct scanner *s, struct walk *walk);

static bool scan_member(struct scanner *s, struct span key, void *object)
{
    struct walk *owner = object;
    const struct field *fields = owner->field->fields;
    if (memchr(key.begin, '\\', (size_t)(key.end - key.begin))) /* could hide a name of ours */
        return refuse(s, owner, "has a member whose name has an escape");
    for (int i = 0; fields && fields[i].name; i++)
        if (span_is(key, fields[i].name)) {
            struct walk walk = {.outer = owner, .field = &fields[i], .element = -1};
            owner->seen |= UINT32_C(1) << i;
            return scan_value(s, &walk);
        }
    return scanner_skip(s, DEPTH);
}

static bool scan_object(struct scanner *s, struct walk *walk)
{
    const struct field *fields = walk->field->fields;
    if (!scanner_object(s, scan_member, walk))
        return false;
    for (int i = 0; fields && fields[i].name; i++)
        if (fields[i].is_needed && !(walk->seen & UINT32_C(1) << i)) {
            char what[60];
            snprintf(what, sizeof what, "has no %s", fields[i].name);
            return refuse(s, walk, what);
        }
    return true;
}

static bool scan_mapped(struct scanner *s, struct span key, void *object)
{
    struct walk walk = *(const struct walk *)object;
    walk.key = key;
    return scan_whole(s, &walk, true);
}

static bool begins_with(struct scanner *s, char c)
{
    scanner_skip_space(s);
    return s->at < s->end && *s->at == c;
}

static bool scan_text(struct scanner *s, const struct walk *walk)
{
    struct span ignored;
    return (begins_with(s, '"') || refuse(s, walk, "must be a string")) && scanner_count(s) &&
           scanner_string(s, &ignored);
}

static bool scan_single(struct scanner *s, struct walk *walk)
{
    bool is_object = begins_with(s, '{');
    switch (walk->field->kind) {
    case FIELD_INDEX:
    case FIELD_SIZE:
        return scan_whole(s, walk, walk->field->kind == FIELD_INDEX);
    case FIELD_NUMBER:
        return scan_number(s, walk);
    case FIELD_BOOLEAN:
        return scan_boolean(s, walk);
    case FIELD_TEXT:
        return scan_text(s, walk);
    case FIELD_ITEM:
        return (is_object || refuse(s, walk, "must be an object")) && scan_object(s, walk);
    case FIELD_MAP:
        return (is_object || refuse(s, walk, "must be an object")) &&
               scanner_object(s, scan_mapped, walk);
    case FIELD_LOOSE:
        break;
    }
    return is_object ? scan_object(s, walk) : scanner_skip(s, DEPTH);
}

static bool scan_element(struct scanner *s, void *list)
{
    struct walk *walk = list;
    walk->element++;
    walk->seen = 0;
    return scan_single(s, walk);
}

static bool scan_value(struct scanner *s, struct walk *walk)
{
    const struct field *field = walk->field;
    if (!field->is_list)
        return scan_single(s, walk);
    if (!begins_with(s, '['))
        return refuse(s, walk, "must be an array");
    if (!scanner_array(s, scan_element, walk))
        return false;
    if (field->count && walk->element + 1 != field->count) {
        char what[40];
        snprintf(what, sizeof what, "must be %d numbers", field->count);
        walk->element = -1;
        return refuse(s, walk, what);
    }
    return true;
}

bool gltf_types_scan(struct scanner *s, struct span key)
{
    static const struct field root = {.kind = FIELD_ITEM, .fields = gltf_document_fields};
    struct walk document = {.field = &root, .element = -1};
    return scan_member(s, key, &document);
}
