/* SPDX-License-Identifier: MIT */
/* Checking, cutting and cleaning UTF-8. */
#include "protocol/utf8.h"

#include <string.h>

static size_t expected_bytes(unsigned char lead)
{
    if (lead < 0x80)
        return lead ? 1 : 0;
    if (lead >= 0xC2 && lead <= 0xDF)
        return 2;
    if ((lead & 0xF0) == 0xE0)
        return 3;
    return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

size_t utf8_sequence_bytes(const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    size_t bytes = expected_bytes(s[0]);
    for (size_t i = 1; i < bytes; i++)
        if ((s[i] & 0xC0) != 0x80)
            return 0;
    bool is_overlong = (s[0] == 0xE0 && s[1] < 0xA0) || (s[0] == 0xF0 && s[1] < 0x90);
    bool is_surrogate = s[0] == 0xED && s[1] > 0x9F;
    bool is_beyond = s[0] == 0xF4 && s[1] > 0x8F;
    return is_overlong || is_surrogate || is_beyond ? 0 : bytes;
}

size_t utf8_prefix_bytes(const char *text, size_t max_bytes)
{
    size_t length = strnlen(text, max_bytes + 1);
    if (length <= max_bytes)
        return length;
    size_t cut = max_bytes;
    while (cut > 0 && max_bytes - cut < 4 && ((unsigned char)text[cut] & 0xC0) == 0x80)
        cut--;
    return cut;
}

/* The text ends inside a sequence that was right so far. */
static bool is_unfinished(const char *text)
{
    size_t length = strnlen(text, 4);
    if (length >= expected_bytes((unsigned char)text[0]))
        return false;
    for (size_t i = 1; i < length; i++)
        if (((unsigned char)text[i] & 0xC0) != 0x80)
            return false;
    return true;
}

void utf8_sanitize(char *text, bool was_cut)
{
    for (char *at = text; *at;) {
        size_t bytes = utf8_sequence_bytes(at);
        if (bytes == 0 && was_cut && is_unfinished(at)) {
            *at = '\0';
            return;
        }
        if (bytes == 0 || (unsigned char)*at < 0x20 || *at == 0x7F)
            *at = '?';
        at += bytes ? bytes : 1;
    }
}

void utf8_copy(char *buffer, size_t size_bytes, const char *text)
{
    size_t length = utf8_prefix_bytes(text, size_bytes - 1);
    memmove(buffer, text, length);
    buffer[length] = '\0';
    utf8_sanitize(buffer, false);
}
