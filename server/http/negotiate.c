/* SPDX-License-Identifier: MIT */
/* Content negotiation and entity tags, as RFC 9110 has them. */
#include "server/http/negotiate.h"

#include <assert.h>
#include <ctype.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const enum image_format preference[] = {IMAGE_FORMAT_PNG, IMAGE_FORMAT_WEBP,
                                               IMAGE_FORMAT_JPEG, IMAGE_FORMAT_EXR};
static_assert(sizeof preference / sizeof preference[0] == IMAGE_FORMAT_COUNT,
              "a format has no preference");

/* One element of a comma-separated list, without surrounding blanks. */
struct slice {
    const char *text;
    size_t length;
};

static bool next_element(const char **at, struct slice *element)
{
    while (**at == ',' || **at == ' ' || **at == '\t')
        (*at)++;
    if (!**at)
        return false;
    bool is_quoted = false;
    element->text = *at;
    for (; **at && (is_quoted || **at != ','); (*at)++)
        is_quoted ^= **at == '"';
    element->length = (size_t)(*at - element->text);
    while (element->length > 0 && isspace((unsigned char)element->text[element->length - 1]))
        element->length--;
    return true;
}

/* The q parameter, 1 without one, 0 when it is malformed. */
static double quality_of(const struct slice *element, size_t *type_length)
{
    const char *end = element->text + element->length;
    const char *at = memchr(element->text, ';', element->length);
    *type_length = at ? (size_t)(at - element->text) : element->length;
    while (*type_length > 0 && isspace((unsigned char)element->text[*type_length - 1]))
        (*type_length)--;
    while (at && at < end) {
        at++;
        while (at < end && (*at == ' ' || *at == '\t'))
            at++;
        if (end - at > 2 && tolower((unsigned char)*at) == 'q' && at[1] == '=') {
            char number[8] = "";
            size_t length = strspn(at + 2, "0123456789.");
            if (length == 0 || length >= sizeof number || at + 2 + length > end)
                return 0;
            memcpy(number, at + 2, length);
            double q = strtod(number, NULL);
            return q > 1 ? 0 : q;
        }
        at = memchr(at, ';', (size_t)(end - at));
    }
    return 1;
}

/* How closely a media range names a type: 3 exactly, 2 by its main type, 1 as any type, 0 not at
 * all. */
static int specificity(const struct slice *element, size_t type_length, const char *type)
{
    size_t main_length = strcspn(type, "/") + 1;
    if (type_length == strlen(type) && strncasecmp(element->text, type, type_length) == 0)
        return 3;
    if (type_length == main_length + 1 && strncasecmp(element->text, type, main_length) == 0 &&
        element->text[main_length] == '*')
        return 2;
    return type_length == 3 && strncmp(element->text, "*/*", 3) == 0;
}

static int max_int(int a, int b)
{
    return a > b ? a : b;
}

/* The quality that Accept gives a type: that of its most specific range. alternative: another name
 * of the type, or NULL. */
static double type_quality(const char *accept, const char *type, const char *alternative)
{
    double quality = 0;
    int best = 0;
    struct slice element;
    for (const char *at = accept; next_element(&at, &element);) {
        size_t type_length;
        double q = quality_of(&element, &type_length);
        int closeness = specificity(&element, type_length, type);
        if (alternative)
            closeness = max_int(closeness, specificity(&element, type_length, alternative));
        if (closeness > best) {
            best = closeness;
            quality = q;
        }
    }
    return quality;
}

static double format_quality(const char *accept, enum image_format format)
{
    return type_quality(accept, image_format_media_type(format),
                        format == IMAGE_FORMAT_EXR ? "image/exr" : NULL);
}

static bool accepts_all(const char *accept)
{
    return !accept || !accept[strspn(accept, " \t,")];
}

bool negotiate_type(const char *accept, const char *const *types, int *chosen, struct error *err)
{
    double best = 0;
    char offered[160] = "";
    for (int i = 0; types[i]; i++) {
        size_t used = strlen(offered);
        snprintf(offered + used, sizeof offered - used, "%s%s", used ? ", " : "", types[i]);
        double quality = accepts_all(accept) ? 1 : type_quality(accept, types[i], NULL);
        if (quality > best) {
            best = quality;
            *chosen = i;
        }
    }
    return best > 0 || error_set(err, ERROR_NOT_ACCEPTABLE,
                                 "Accept allows none of the forms that there are: %s", offered);
}

bool negotiate_format(const char *accept, unsigned allowed, enum image_format *format,
                      struct error *err)
{
    bool takes_all = accepts_all(accept);
    double best = 0;
    char offered[128] = "";
    for (int i = 0; i < IMAGE_FORMAT_COUNT; i++) {
        enum image_format candidate = preference[i];
        if (!(allowed & 1u << candidate))
            continue;
        size_t used = strlen(offered);
        snprintf(offered + used, sizeof offered - used, "%s%s", used ? ", " : "",
                 image_format_media_type(candidate));
        double quality = takes_all ? 1 : format_quality(accept, candidate);
        if (quality > best) {
            best = quality;
            *format = candidate;
        }
    }
    return best > 0 || error_set(err, ERROR_NOT_ACCEPTABLE,
                                 "Accept allows none of the formats of this image: %s", offered);
}

bool negotiate_tag_matches(const char *if_none_match, const char *tag)
{
    struct slice element;
    for (const char *at = if_none_match ? if_none_match : ""; next_element(&at, &element);) {
        if (element.length == 1 && element.text[0] == '*')
            return true;
        if (element.length > 2 && strncmp(element.text, "W/", 2) == 0) {
            element.text += 2;
            element.length -= 2;
        }
        if (element.length == strlen(tag) && memcmp(element.text, tag, element.length) == 0)
            return true;
    }
    return false;
}

bool negotiate_if_match(const char *if_match, const char *tag)
{
    struct slice element;
    if (!if_match)
        return true;
    for (const char *at = if_match; next_element(&at, &element);)
        if ((element.length == 1 && element.text[0] == '*') ||
            (element.length == strlen(tag) && memcmp(element.text, tag, element.length) == 0))
            return true;
    return false;
}

bool negotiate_is_type(const char *content_type, const char *type)
{
    if (!content_type)
        return false;
    content_type += strspn(content_type, " \t");
    size_t length = strcspn(content_type, "; \t");
    return length == strlen(type) && strncasecmp(content_type, type, length) == 0;
}
