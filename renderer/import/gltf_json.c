/* SPDX-License-Identifier: MIT */
/* Limits and balance of glTF JSON, and the elements of "buffers" and "images". */
#include "renderer/import/gltf_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_types.h"

enum { CUTS_MAX = 4 }; /* buffers, images, skins, animations */

struct cutter {
    struct gltf_json *json;
    struct span cuts[CUTS_MAX];
    int cut_count;
};

/* What becomes of an array that is cut out. */
struct source_list {
    struct gltf_source **sources; /* NULL: elements are only counted */
    size_t *count;
};

static bool scan_source_member(struct scanner *s, struct span key, void *object)
{
    struct gltf_source *source = object;
    if (span_is(key, "name"))
        return scanner_text(s, &source->name);
    if (span_is(key, "uri"))
        return scanner_text(s, &source->uri);
    if (span_is(key, "mimeType"))
        return scanner_text(s, &source->mime_type);
    if (span_is(key, "byteLength"))
        return scanner_unsigned(s, &source->byte_length);
    if (span_is(key, "bufferView")) {
        uint64_t view;
        if (!scanner_unsigned(s, &view))
            return false;
        source->buffer_view = view > INT32_MAX ? INT32_MAX : (int64_t)view;
        return true;
    }
    return scanner_skip(s, 3);
}

static bool scan_source(struct scanner *s, void *object)
{
    struct source_list *list = object;
    if (!list->sources) {
        ++*list->count;
        return scanner_skip(s, 2);
    }
    struct gltf_source *sources =
        scanner_grow(s, *list->sources, *list->count, sizeof **list->sources);
    if (!sources)
        return false;
    *list->sources = sources;
    struct gltf_source *source = &sources[(*list->count)++];
    *source = (struct gltf_source){.buffer_view = -1};
    return scanner_object(s, scan_source_member, source);
}

static bool scan_cut(struct scanner *s, struct cutter *cutter, struct gltf_source **sources,
                     size_t *count)
{
    scanner_skip_space(s);
    if (cutter->cut_count == CUTS_MAX || *count)
        return scanner_refuse(s, "a member is there twice");
    struct span *cut = &cutter->cuts[cutter->cut_count++];
    cut->begin = s->at;
    if (!scanner_array(s, scan_source, &(struct source_list){sources, count}))
        return false;
    cut->end = s->at;
    return true;
}

/* An array that another file reads from the text. */
static bool scan_kept_cut(struct scanner *s, struct cutter *cutter, struct span *text,
                          size_t *count)
{
    int cut = cutter->cut_count;
    if (!scan_cut(s, cutter, NULL, count))
        return false;
    *text = cutter->cuts[cut];
    return true;
}

static bool scan_member(struct scanner *s, struct span key, void *object)
{
    struct cutter *cutter = object;
    struct gltf_json *json = cutter->json;
    if (memchr(key.begin, '\\', (size_t)(key.end - key.begin))) /* could hide a name we take out */
        return scanner_refuse(s, "a top-level key has an escape");
    if (span_is(key, "buffers"))
        return scan_cut(s, cutter, &json->buffers, &json->buffer_count);
    if (span_is(key, "images"))
        return scan_cut(s, cutter, &json->images, &json->image_count);
    if (span_is(key, "skins"))
        return scan_kept_cut(s, cutter, &json->skins, &json->skin_count);
    if (span_is(key, "animations"))
        return scan_kept_cut(s, cutter, &json->animations, &json->animation_count);
    return gltf_types_scan(s, key);
}

static bool scan_document(struct scanner *s, struct cutter *cutter)
{
    if (!scanner_object(s, scan_member, cutter))
        return false;
    scanner_skip_space(s);
    while (s->at < s->end && *s->at == '\0') /* some GLB writers pad their JSON with zeros */
        s->at++;
    return s->at == s->end || scanner_refuse(s, "something follows the document");
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
            return scanner_refuse(s, "not UTF-8");
        }
        at += more + 1;
    }
    return true;
}

static bool write_rest(const struct scanner *s, const struct cutter *cutter)
{
    struct gltf_json *json = cutter->json;
    const char *end = s->end;
    while (end > s->text && end[-1] == '\0')
        end--;
    char *out = json->rest = malloc((size_t)(end - s->text) + 1);
    if (!out)
        return error_set(s->err, ERROR_NO_MEMORY, "glTF JSON");
    const char *from = s->text;
    for (int i = 0; i < cutter->cut_count; i++) { /* each cut is at least "[]" long */
        size_t length = (size_t)(cutter->cuts[i].begin - from);
        memcpy(out, from, length);
        memcpy(out + length, "[]", 2);
        out += length + 2;
        from = cutter->cuts[i].end;
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
    struct cutter cutter = {.json = json};
    if (check_utf8(&s) && scan_document(&s, &cutter) && write_rest(&s, &cutter))
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
