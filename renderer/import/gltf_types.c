/* SPDX-License-Identifier: MIT */
/* Tables of members and their types, and a walk over the text by them. */
#include "renderer/import/gltf_types.h"

#include <stdio.h>
#include <string.h>

enum kind {        /* of a value */
            WHOLE, /* a whole number from 0 on: counts, offsets, indices */
            NUMBER,
            BOOLEAN,
            TEXT,
            ITEM, /* an object with the members of `fields` */
            MAP,  /* an object: every member is a WHOLE */
};

struct field {
    const char *name;
    enum kind kind;
    bool is_list;    /* an array of such values */
    int least, most; /* lists: how many; most 0: any number */
    const struct field *fields;
};

#define LIST(name, kind)             \
    {                                \
        name, kind, true, 0, 0, NULL \
    }
#define VECTOR(name, count)                    \
    {                                          \
        name, NUMBER, true, count, count, NULL \
    }
#define ONE(name, kind)               \
    {                                 \
        name, kind, false, 0, 0, NULL \
    }
#define OBJECT(name, fields)            \
    {                                   \
        name, ITEM, false, 0, 0, fields \
    }
#define OBJECTS(name, fields)          \
    {                                  \
        name, ITEM, true, 0, 0, fields \
    }
#define END                            \
    {                                  \
        NULL, WHOLE, false, 0, 0, NULL \
    }

static const struct field sparse_part[] = {ONE("bufferView", WHOLE), ONE("byteOffset", WHOLE),
                                           ONE("componentType", WHOLE), END};
static const struct field sparse[] = {ONE("count", WHOLE), OBJECT("indices", sparse_part),
                                      OBJECT("values", sparse_part), END};
static const struct field accessor[] = {ONE("bufferView", WHOLE),
                                        ONE("byteOffset", WHOLE),
                                        ONE("componentType", WHOLE),
                                        ONE("count", WHOLE),
                                        ONE("normalized", BOOLEAN),
                                        ONE("type", TEXT),
                                        LIST("min", NUMBER),
                                        LIST("max", NUMBER),
                                        OBJECT("sparse", sparse),
                                        ONE("name", TEXT),
                                        END};
static const struct field buffer_view[] = {ONE("buffer", WHOLE),
                                           ONE("byteOffset", WHOLE),
                                           ONE("byteLength", WHOLE),
                                           ONE("byteStride", WHOLE),
                                           ONE("target", WHOLE),
                                           ONE("name", TEXT),
                                           END};
static const struct field perspective[] = {ONE("aspectRatio", NUMBER), ONE("yfov", NUMBER),
                                           ONE("zfar", NUMBER), ONE("znear", NUMBER), END};
static const struct field orthographic[] = {ONE("xmag", NUMBER), ONE("ymag", NUMBER),
                                            ONE("zfar", NUMBER), ONE("znear", NUMBER), END};
static const struct field camera[] = {ONE("type", TEXT), OBJECT("perspective", perspective),
                                      OBJECT("orthographic", orthographic), ONE("name", TEXT), END};
static const struct field texture_info[] = {ONE("index", WHOLE), ONE("texCoord", WHOLE),
                                            ONE("scale", NUMBER), ONE("strength", NUMBER), END};
static const struct field metallic_roughness[] = {VECTOR("baseColorFactor", 4),
                                                  OBJECT("baseColorTexture", texture_info),
                                                  ONE("metallicFactor", NUMBER),
                                                  ONE("roughnessFactor", NUMBER),
                                                  OBJECT("metallicRoughnessTexture", texture_info),
                                                  END};
static const struct field material[] = {OBJECT("pbrMetallicRoughness", metallic_roughness),
                                        OBJECT("normalTexture", texture_info),
                                        OBJECT("occlusionTexture", texture_info),
                                        OBJECT("emissiveTexture", texture_info),
                                        VECTOR("emissiveFactor", 3),
                                        ONE("alphaMode", TEXT),
                                        ONE("alphaCutoff", NUMBER),
                                        ONE("doubleSided", BOOLEAN),
                                        ONE("name", TEXT),
                                        END};
static const struct field primitive[] = {ONE("attributes", MAP), ONE("indices", WHOLE),
                                         ONE("material", WHOLE), ONE("mode", WHOLE),
                                         LIST("targets", MAP),   END};
static const struct field mesh[] = {OBJECTS("primitives", primitive), LIST("weights", NUMBER),
                                    ONE("name", TEXT), END};
static const struct field node[] = {LIST("children", WHOLE),
                                    ONE("camera", WHOLE),
                                    ONE("skin", WHOLE),
                                    ONE("mesh", WHOLE),
                                    VECTOR("matrix", 16),
                                    VECTOR("rotation", 4),
                                    VECTOR("scale", 3),
                                    VECTOR("translation", 3),
                                    LIST("weights", NUMBER),
                                    ONE("name", TEXT),
                                    END};
static const struct field sampler[] = {ONE("magFilter", WHOLE), ONE("minFilter", WHOLE),
                                       ONE("wrapS", WHOLE),     ONE("wrapT", WHOLE),
                                       ONE("name", TEXT),       END};
static const struct field texture[] = {ONE("sampler", WHOLE), ONE("source", WHOLE),
                                       ONE("name", TEXT), END};
static const struct field scene[] = {LIST("nodes", WHOLE), ONE("name", TEXT), END};
static const struct field document[] = {OBJECTS("accessors", accessor),
                                        OBJECTS("bufferViews", buffer_view),
                                        OBJECTS("cameras", camera),
                                        OBJECTS("materials", material),
                                        OBJECTS("meshes", mesh),
                                        OBJECTS("nodes", node),
                                        OBJECTS("samplers", sampler),
                                        OBJECTS("textures", texture),
                                        OBJECTS("scenes", scene),
                                        ONE("scene", WHOLE),
                                        LIST("extensionsUsed", TEXT),
                                        LIST("extensionsRequired", TEXT),
                                        END};

enum { DEPTH = 6 }; /* of what is passed over inside; more than any of these objects has */

/* Where the walk is. */
struct walk {
    const struct field *field, *fields; /* the member being read; the members of an object */
    const char *list;                   /* of the document: its name ... */
    size_t element;                     /* ... and how many of its elements came before */
    bool is_in_list;                    /* an element of the document's list is being read */
    int count;                          /* of a list within: elements seen */
};

static bool refuse(struct scanner *s, const struct walk *walk, const char *expected)
{
    char reason[160];
    if (!walk->is_in_list)
        snprintf(reason, sizeof reason, "%s must be %s", walk->list, expected);
    else if (walk->field->name == walk->list)
        snprintf(reason, sizeof reason, "%s[%zu] must be %s", walk->list, walk->element, expected);
    else
        snprintf(reason, sizeof reason, "%s of %s[%zu] must be %s", walk->field->name, walk->list,
                 walk->element, expected);
    return scanner_refuse(s, reason);
}

/* The literal that comes next, such as a number or true; empty before anything else. */
static struct span peek_literal(struct scanner *s)
{
    scanner_skip_space(s);
    struct span literal = {s->at, s->at};
    while (literal.end < s->end && !strchr(" \t\r\n,:]}[{\"", *literal.end))
        literal.end++;
    return literal;
}

static bool is_only(struct span text, const char *characters)
{
    for (const char *at = text.begin; at < text.end; at++)
        if (!strchr(characters, *at))
            return false;
    return text.begin < text.end;
}

/* Its grammar is tinygltf's to check. */
static bool scan_literal(struct scanner *s, const struct walk *walk)
{
    struct span text = peek_literal(s);
    enum kind kind = walk->field->kind;
    if (kind == BOOLEAN ? !span_is(text, "true") && !span_is(text, "false")
                        : !is_only(text, "0123456789+-.eE"))
        return refuse(s, walk, kind == BOOLEAN ? "true or false" : "a number");
    s->at = text.end;
    return scanner_count(s);
}

static bool scan_whole(struct scanner *s, const struct walk *walk)
{
    struct span text = peek_literal(s);
    if (!is_only(text, "0123456789"))
        return refuse(s, walk, "a whole number, not negative");
    s->at = text.end;
    return scanner_count(s);
}

static bool scan_value(struct scanner *s, struct walk *walk);

static bool scan_member(struct scanner *s, struct span key, void *object)
{
    const struct walk *owner = object;
    struct walk walk = *owner;
    for (const struct field *field = owner->fields; field->name; field++)
        if (span_is(key, field->name)) {
            walk.field = field;
            return scan_value(s, &walk);
        }
    return scanner_skip(s, DEPTH);
}

static bool scan_mapped(struct scanner *s, struct span key, void *object)
{
    (void)key;
    return scan_whole(s, object);
}

static bool begins_with(struct scanner *s, char c)
{
    scanner_skip_space(s);
    return s->at < s->end && *s->at == c;
}

static bool scan_single(struct scanner *s, struct walk *walk)
{
    struct span ignored;
    enum kind kind = walk->field->kind;
    if (kind == WHOLE)
        return scan_whole(s, walk);
    if (kind == NUMBER || kind == BOOLEAN)
        return scan_literal(s, walk);
    if (kind == TEXT)
        return (begins_with(s, '"') || refuse(s, walk, "a string")) && scanner_count(s) &&
               scanner_string(s, &ignored);
    if (!begins_with(s, '{'))
        return refuse(s, walk, "an object");
    if (kind == MAP)
        return scanner_object(s, scan_mapped, walk);
    walk->fields = walk->field->fields;
    return scanner_object(s, scan_member, walk);
}

static bool scan_element(struct scanner *s, void *list)
{
    struct walk *walk = list;
    struct walk inside = *walk;
    walk->count++;
    return scan_single(s, &inside);
}

/* An element of the document's own list. */
static bool scan_top_element(struct scanner *s, void *list)
{
    struct walk *walk = list;
    struct walk inside = *walk;
    inside.is_in_list = true;
    bool is_good = scan_single(s, &inside);
    walk->element++;
    return is_good;
}

static bool scan_value(struct scanner *s, struct walk *walk)
{
    const struct field *field = walk->field;
    if (!field->is_list)
        return scan_single(s, walk);
    if (!begins_with(s, '['))
        return refuse(s, walk, "an array");
    walk->count = 0;
    if (!scanner_array(s, scan_element, walk))
        return false;
    if (field->most && (walk->count < field->least || walk->count > field->most)) {
        char expected[32];
        snprintf(expected, sizeof expected, "%d numbers", field->most);
        return refuse(s, walk, expected);
    }
    return true;
}

bool gltf_types_scan(struct scanner *s, struct span key)
{
    for (const struct field *field = document; field->name; field++) {
        struct walk walk = {.field = field, .list = field->name};
        if (!span_is(key, field->name))
            continue;
        if (!field->is_list)
            return scan_single(s, &walk);
        return begins_with(s, '[') ? scanner_array(s, scan_top_element, &walk)
                                   : refuse(s, &walk, "an array");
    }
    return scanner_skip(s, 1);
}
