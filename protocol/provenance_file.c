/* SPDX-License-Identifier: MIT */
/* The XMP packet of a provenance, and the way back: the four containers are walked part by part, up
 * to the pixels; no part is believed to be longer than what is there. */
#include "protocol/provenance_file.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* The envelope is that of Adobe, "XMP Specification", part 1, 2012. */
bool provenance_packet(const char *text, char packet[PROVENANCE_PACKET_MAX], size_t *length)
{
    if (strlen(text) > PROVENANCE_TEXT_MAX)
        return false;
    int printed = snprintf(packet, PROVENANCE_PACKET_MAX,
                           "<?xpacket begin=\"\xef\xbb\xbf\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>"
                           "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">"
                           "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">"
                           "<rdf:Description rdf:about=\"\" xmlns:vitrail=\"urn:vitrail:1\">"
                           "<vitrail:provenance>%s</vitrail:provenance>"
                           "</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end=\"r\"?>",
                           text);
    *length = (size_t)printed;
    return printed > 0 && printed < PROVENANCE_PACKET_MAX;
}

/* ---- finding it ---- */

/* What is left of the file. */
struct rest {
    const uint8_t *at;
    size_t bytes;
};

static bool starts_with(const struct rest *rest, const void *magic, size_t bytes)
{
    return rest->bytes >= bytes && memcmp(rest->at, magic, bytes) == 0;
}

static bool skip(struct rest *rest, size_t bytes)
{
    if (bytes > rest->bytes)
        return false;
    rest->at += bytes;
    rest->bytes -= bytes;
    return true;
}

static size_t big_endian(const uint8_t *at, int bytes)
{
    size_t value = 0;
    for (int i = 0; i < bytes; i++)
        value = value << 8 | at[i];
    return value;
}

static size_t little_endian_32(const uint8_t *at)
{
    return at[0] | (size_t)at[1] << 8 | (size_t)at[2] << 16 | (size_t)at[3] << 24;
}

/* A NUL-terminated name of at most 255 bytes; the rest goes on behind it. */
static bool take_name(struct rest *rest, const char **name)
{
    size_t most = rest->bytes < 256 ? rest->bytes : 256;
    const uint8_t *end = most ? memchr(rest->at, 0, most) : NULL;
    *name = (const char *)rest->at;
    return end && skip(rest, (size_t)(end - rest->at) + 1);
}

static bool find_in_packet(const struct rest *packet, const char **text, size_t *length)
{
    static const char before[] = "<vitrail:provenance>", after[] = "</vitrail:provenance>";
    const char *begin = memmem(packet->at, packet->bytes, before, sizeof before - 1);
    if (!begin)
        return false;
    begin += sizeof before - 1;
    size_t left = packet->bytes - (size_t)(begin - (const char *)packet->at);
    const char *end = memmem(begin, left, after, sizeof after - 1);
    *text = begin;
    *length = end ? (size_t)(end - begin) : 0;
    return end;
}

/* Chunks of length, type, data, CRC (PNG, section 5.3). */
static bool find_in_png(struct rest rest, const char **text, size_t *length)
{
    static const char keyword[] = PROVENANCE_PNG_KEYWORD; /* with its NUL */
    if (!skip(&rest, 8))
        return false;
    while (rest.bytes >= 12) {
        size_t bytes = big_endian(rest.at, 4);
        struct rest data = {rest.at + 8, bytes};
        if (bytes > rest.bytes - 12 || memcmp(rest.at + 4, "IDAT", 4) == 0)
            return false;
        if (memcmp(rest.at + 4, "tEXt", 4) == 0 && starts_with(&data, keyword, sizeof keyword)) {
            *text = (const char *)data.at + sizeof keyword;
            *length = bytes - sizeof keyword;
            return true;
        }
        if (!skip(&rest, bytes + 12))
            return false;
    }
    return false;
}

/* Segments of marker, length with itself, data, up to the scan (ITU-T T.81, B.1.1.4). */
static bool find_in_jpeg(struct rest rest, const char **text, size_t *length)
{
    static const char name[] = "http://ns.adobe.com/xap/1.0/"; /* with its NUL */
    if (!skip(&rest, 2))
        return false;
    while (rest.bytes >= 4 && rest.at[0] == 0xff && rest.at[1] != 0xda) {
        size_t bytes = big_endian(rest.at + 2, 2);
        struct rest data = {rest.at + 4, bytes - 2};
        if (bytes < 2 || bytes + 2 > rest.bytes)
            return false;
        if (rest.at[1] == 0xe1 && starts_with(&data, name, sizeof name) &&
            skip(&data, sizeof name) && find_in_packet(&data, text, length))
            return true;
        if (!skip(&rest, bytes + 2))
            return false;
    }
    return false;
}

/* Chunks of type, length, data, padded to even lengths (RFC 9649, 2.3). */
static bool find_in_webp(struct rest rest, const char **text, size_t *length)
{
    if (!skip(&rest, 12))
        return false;
    while (rest.bytes >= 8) {
        size_t bytes = little_endian_32(rest.at + 4), padded = bytes + (bytes & 1);
        struct rest data = {rest.at + 8, bytes};
        if (bytes > rest.bytes - 8)
            return false;
        if (memcmp(rest.at, "XMP ", 4) == 0)
            return find_in_packet(&data, text, length);
        if (!skip(&rest, 8) || !skip(&rest, padded))
            return false;
    }
    return false;
}

/* Attributes of name, type, length, value, up to an empty name (OpenEXR File Layout, "Header"). */
static bool find_in_exr(struct rest rest, const char **text, size_t *length)
{
    const char *name, *type;
    if (!skip(&rest, 8))
        return false;
    while (take_name(&rest, &name) && name[0] && take_name(&rest, &type) && rest.bytes >= 4) {
        size_t bytes = little_endian_32(rest.at);
        struct rest value = {rest.at + 4, bytes};
        if (!skip(&rest, 4) || !skip(&rest, bytes))
            return false;
        if (strcmp(name, PROVENANCE_EXR_ATTRIBUTE) == 0 && strcmp(type, "string") == 0) {
            *text = (const char *)value.at;
            *length = bytes;
            return true;
        }
    }
    return false;
}

bool provenance_find(const void *bytes, size_t size_bytes, const char **text, size_t *length)
{
    const struct rest file = {bytes, size_bytes};
    *text = NULL;
    *length = 0;
    if (starts_with(&file, "\x89PNG\r\n\x1a\n", 8))
        return find_in_png(file, text, length);
    if (starts_with(&file, "\xff\xd8", 2))
        return find_in_jpeg(file, text, length);
    if (starts_with(&file, "RIFF", 4) && size_bytes >= 12 && memcmp(file.at + 8, "WEBP", 4) == 0)
        return find_in_webp(file, text, length);
    if (starts_with(&file, "\x76\x2f\x31\x01", 4))
        return find_in_exr(file, text, length);
    return false;
}
