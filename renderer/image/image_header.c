/* SPDX-License-Identifier: MIT */
/* Magic bytes and dimensions of PNG, JPEG, WebP, EXR, HDR and BMP; TGA has no magic bytes. */
#include "renderer/image/image_header.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/image/bmp_codec.h"
#include "renderer/image/little_endian.h"
#include "renderer/image/tga_codec.h"

static uint32_t be16(const uint8_t *b)
{
    return (uint32_t)b[0] << 8 | b[1];
}
static uint32_t be32(const uint8_t *b)
{
    return be16(b) << 16 | be16(b + 2);
}

/* PNG specification 5.3 and 11.2.2: IHDR is the first chunk, and chunks follow whole until IEND.
 * (Where the bytes end early the reader of OpenImageIO would jump over, and leak, a string of its
 * own.) */
static bool read_png(struct image_header *header, const uint8_t *b, size_t size)
{
    enum { SIGNATURE_BYTES = 8, CHUNK_BYTES = 12 }; /* length, name and CRC around the data */
    if (size < 33 || memcmp(b + 12, "IHDR", 4) != 0)
        return false;
    header->width_px = be32(b + 16);
    header->height_px = be32(b + 20);
    header->bits = b[24];
    header->channels = b[25] == 0 ? 1 : b[25] == 4 ? 2 : b[25] == 6 ? 4 : 3;
    for (size_t at = SIGNATURE_BYTES; size - at >= CHUNK_BYTES;) {
        uint32_t length = be32(b + at);
        if (length > size - at - CHUNK_BYTES)
            return false;
        if (memcmp(b + at + 4, "IEND", 4) == 0)
            return true;
        if (memcmp(b + at + 4, "tRNS", 4) == 0 && header->channels % 2)
            header->channels++; /* 11.3.2.1: alpha, of one grey, one colour or a palette */
        at += CHUNK_BYTES + length;
    }
    return false;
}

/* ITU-T T.81 B.1 and B.2.2: the first start-of-frame marker, after segments that carry their
 * length, and an end-of-image marker behind it (libjpeg would make up what is missing). */
static bool read_jpeg(struct image_header *header, const uint8_t *b, size_t size)
{
    size_t at = 2;
    while (at + 4 <= size) {
        if (b[at] != 0xFF)
            return false;
        uint8_t marker = b[at + 1];
        if (marker == 0xFF) { /* fill byte */
            at++;
            continue;
        }
        bool is_bare = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8);
        if (is_bare) {
            at += 2;
            continue;
        }
        uint32_t length = be16(b + at + 2);
        bool is_frame =
            marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (length < 2 || marker == 0xD9 || marker == 0xDA)
            return false;
        if (is_frame) {
            if (length < 8 || size - at < 10)
                return false;
            header->bits = b[at + 4];
            header->channels = b[at + 9];
            header->height_px = be16(b + at + 5);
            header->width_px = be16(b + at + 7);
            return memmem(b + at, size - at, "\xFF\xD9", 2) != NULL;
        }
        at += 2 + length;
    }
    return false;
}

/* RFC 9649: lossy, lossless, or extended. */
static bool read_webp(struct image_header *header, const uint8_t *b, size_t size)
{
    if (size < 30)
        return false;
    if (memcmp(b + 12, "VP8 ", 4) == 0) {
        header->width_px = le16(b + 26) & 0x3FFF;
        header->height_px = le16(b + 28) & 0x3FFF;
        return b[23] == 0x9D && b[24] == 0x01 && b[25] == 0x2A;
    }
    if (memcmp(b + 12, "VP8L", 4) == 0) {
        uint32_t bits = le32(b + 21);
        header->width_px = (bits & 0x3FFF) + 1;
        header->height_px = (bits >> 14 & 0x3FFF) + 1;
        return b[20] == 0x2F;
    }
    header->width_px = le24(b + 24) + 1;
    header->height_px = le24(b + 27) + 1;
    return memcmp(b + 12, "VP8X", 4) == 0;
}

/* OpenEXR file layout: attributes of NUL-terminated name and type, then a size; dataWindow is a
 * box2i. */
static bool read_exr(struct image_header *header, const uint8_t *b, size_t size)
{
    const uint8_t *at = b + 8, *end = b + size;
    while (at < end && *at) {
        const uint8_t *name = at;
        at = memchr(at, 0, (size_t)(end - at));
        at = at ? memchr(at + 1, 0, (size_t)(end - at - 1)) : NULL;
        if (!at || end - at < 5)
            return false;
        uint32_t length = le32(at + 1);
        at += 5;
        if (length > (size_t)(end - at))
            return false;
        if (strcmp((const char *)name, "dataWindow") == 0 && length == 16) {
            int64_t width = (int64_t)(int32_t)le32(at + 8) - (int32_t)le32(at) + 1;
            int64_t height = (int64_t)(int32_t)le32(at + 12) - (int32_t)le32(at + 4) + 1;
            if (width < 1 || height < 1 || width > INT32_MAX || height > INT32_MAX)
                return false;
            header->width_px = (uint32_t)width;
            header->height_px = (uint32_t)height;
            return true;
        }
        at += length;
    }
    return false;
}

/* Radiance: text lines, an empty one, then "-Y height +X width". Turned images are not read. */
static bool read_hdr(struct image_header *header, const uint8_t *b, size_t size)
{
    const uint8_t *blank = memmem(b, size < 4096 ? size : 4096, "\n\n", 2);
    char line[64] = "";
    if (!blank)
        return false;
    size_t left = size - (size_t)(blank + 2 - b);
    memcpy(line, blank + 2, left < sizeof line - 1 ? left : sizeof line - 1);
    if (strncmp(line, "-Y ", 3) != 0)
        return false;
    char *end;
    unsigned long height = strtoul(line + 3, &end, 10);
    if (strncmp(end, " +X ", 4) != 0)
        return false;
    unsigned long width = strtoul(end + 4, NULL, 10);
    header->width_px = width > INT32_MAX ? 0 : (uint32_t)width;
    header->height_px = height > INT32_MAX ? 0 : (uint32_t)height;
    return true;
}

struct signature {
    const char *name;
    const char *magic;
    size_t magic_bytes;
    /* NULL: known, but not read. */
    bool (*read)(struct image_header *header, const uint8_t *bytes, size_t size);
    enum image_kind kind;
};

static const struct signature signatures[] = {
    {"PNG", "\x89PNG\r\n\x1A\n", 8, read_png, IMAGE_KIND_PNG},
    {"JPEG", "\xFF\xD8\xFF", 3, read_jpeg, IMAGE_KIND_JPEG},
    {"EXR", "\x76\x2F\x31\x01", 4, read_exr, IMAGE_KIND_EXR},
    {"HDR", "#?RADIANCE", 10, read_hdr, IMAGE_KIND_HDR},
    {"HDR", "#?RGBE", 6, read_hdr, IMAGE_KIND_HDR},
    {"KTX2", "\xABKTX 20\xBB", 8, NULL, IMAGE_KIND_PNG},
    {"DDS", "DDS ", 4, NULL, IMAGE_KIND_PNG},
    {"GIF", "GIF8", 4, NULL, IMAGE_KIND_PNG},
    {"BMP", "BM", 2, NULL, IMAGE_KIND_PNG},
    {"TIFF", "II*\0", 4, NULL, IMAGE_KIND_PNG},
    {"TIFF", "MM\0*", 4, NULL, IMAGE_KIND_PNG},
    {"SVG", "<svg", 4, NULL, IMAGE_KIND_PNG},
};
static const struct signature webp = {"WebP", "", 0, read_webp, IMAGE_KIND_WEBP};

static const struct signature *find_signature(const uint8_t *bytes, size_t size)
{
    if (size >= 12 && memcmp(bytes, "RIFF", 4) == 0 && memcmp(bytes + 8, "WEBP", 4) == 0)
        return &webp;
    for (size_t i = 0; i < sizeof signatures / sizeof *signatures; i++)
        if (size >= signatures[i].magic_bytes &&
            memcmp(bytes, signatures[i].magic, signatures[i].magic_bytes) == 0)
            return &signatures[i];
    return NULL;
}

static bool read_as(struct image_header *header, const uint8_t *bytes, size_t size_bytes,
                    const struct signature *signature, struct error *err)
{
    header->kind = signature->kind;
    return (signature->read(header, bytes, size_bytes) && header->width_px > 0 &&
            header->height_px > 0) ||
           error_set(err, ERROR_INVALID_SCENE, "the %s file is broken or cut off", signature->name);
}

bool image_header_read(struct image_header *header, const void *bytes, size_t size_bytes,
                       struct error *err)
{
    memset(header, 0, sizeof *header);
    if (size_bytes == 0)
        return error_set(err, ERROR_INVALID_SCENE, "the image is empty");
    const struct signature *signature = find_signature(bytes, size_bytes);
    if (!signature)
        return error_set(err, ERROR_INVALID_SCENE, "not an image of a known format");
    if (!signature->read)
        return error_set(err, ERROR_UNSUPPORTED, "%s images are not read, only PNG, JPEG and WebP",
                         signature->name);
    return read_as(header, bytes, size_bytes, signature, err);
}

bool image_header_read_old(struct image_header *header, const void *bytes, size_t size_bytes,
                           struct error *err)
{
    static const struct signature bmp = {"BMP", "BM", 2, bmp_header_read, IMAGE_KIND_BMP};
    memset(header, 0, sizeof *header);
    header->kind = IMAGE_KIND_TGA;
    if (size_bytes >= bmp.magic_bytes && memcmp(bytes, bmp.magic, bmp.magic_bytes) == 0)
        return read_as(header, bytes, size_bytes, &bmp, err);
    return (!find_signature(bytes, size_bytes) && tga_header_read(header, bytes, size_bytes)) ||
           image_header_read(header, bytes, size_bytes, err);
}
