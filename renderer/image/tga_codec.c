/* SPDX-License-Identifier: MIT */
/* A header of 18 bytes, a comment, a palette, pixels. */
#include "renderer/image/tga_codec.h"

#include <string.h>

#include "renderer/image/little_endian.h"

enum {
    HEADER_BYTES = 18,
    RUN_MOST = 128, /* pixels of a packet */
    HAS_RUNS = 8,   /* in the type */
    PALETTE = 1,    /* types without that */
    COLOR = 2,
    GREY = 3,
    FROM_RIGHT = 0x10, /* in the last byte of the header */
    FROM_TOP = 0x20,
    INTERLEAVED = 0xC0,
};

struct tga {
    uint32_t width, height;
    int type; /* PALETTE, COLOR or GREY */
    bool has_runs;
    size_t pixel_bytes, entry_bytes; /* of the file's pixels; of the palette's colours */
    uint32_t first_entry, entry_count;
    int order;              /* FROM_RIGHT, FROM_TOP */
    const uint8_t *palette; /* of the file's bytes */
    const uint8_t *at, *end;
};

/* Of 15 bits the second byte has one more that says nothing. */
static size_t color_bytes(int bits)
{
    return bits == 15 || bits == 16 ? 2 : bits == 24 ? 3 : bits == 32 ? 4 : 0;
}

static size_t find_pixel_bytes(int type, int bits)
{
    if (type == COLOR)
        return color_bytes(bits);
    return bits == 8 || bits == 16 ? (size_t)bits / 8 : 0;
}

static bool tga_init(struct tga *tga, const uint8_t *b, size_t size)
{
    if (size < HEADER_BYTES || b[1] > 1 || (b[2] & ~HAS_RUNS) < PALETTE ||
        (b[2] & ~HAS_RUNS) > GREY || b[17] & INTERLEAVED)
        return false;
    *tga = (struct tga){.width = le16(b + 12),
                        .height = le16(b + 14),
                        .type = b[2] & ~HAS_RUNS,
                        .has_runs = b[2] & HAS_RUNS,
                        .first_entry = le16(b + 3),
                        .order = b[17],
                        .end = b + size};
    tga->pixel_bytes = find_pixel_bytes(tga->type, b[16]);
    size_t skipped = HEADER_BYTES + (size_t)b[0], palette_bytes = 0;
    if (b[1]) { /* some files of true colour have a palette, too */
        tga->entry_bytes = color_bytes(b[7]);
        tga->entry_count = le16(b + 5);
        palette_bytes = tga->entry_bytes * tga->entry_count;
    }
    if (!tga->pixel_bytes || (tga->type == PALETTE && !palette_bytes) ||
        size < skipped + palette_bytes)
        return false;
    tga->palette = b + skipped;
    tga->at = tga->palette + palette_bytes;
    uint64_t pixels = (uint64_t)tga->width * tga->height;
    uint64_t least =
        tga->has_runs ? pixels / RUN_MOST * (1 + tga->pixel_bytes) : pixels * tga->pixel_bytes;
    return pixels > 0 && least <= (uint64_t)(tga->end - tga->at);
}

bool tga_header_read(struct image_header *header, const uint8_t *bytes, size_t size_bytes)
{
    struct tga tga;
    if (!tga_init(&tga, bytes, size_bytes))
        return false;
    header->width_px = tga.width;
    header->height_px = tga.height;
    return true;
}

static uint8_t widen(uint32_t five_bits)
{
    return (uint8_t)(((five_bits & 31) * 255 + 15) / 31);
}

static void read_color(const uint8_t *from, size_t bytes, uint8_t out[4])
{
    uint32_t word = le16(from);
    if (bytes == 2) {
        out[0] = widen(word >> 10);
        out[1] = widen(word >> 5);
        out[2] = widen(word);
    } else {
        out[0] = from[2];
        out[1] = from[1];
        out[2] = from[0];
    }
    out[3] = bytes == 4 ? from[3] : 255;
}

/* False: the palette does not have it. */
static bool read_pixel(const struct tga *tga, const uint8_t *from, uint8_t out[4])
{
    if (tga->type == COLOR) {
        read_color(from, tga->pixel_bytes, out);
        return true;
    }
    if (tga->type == GREY) {
        out[0] = out[1] = out[2] = from[0];
        out[3] = tga->pixel_bytes == 2 ? from[1] : 255;
        return true;
    }
    uint32_t index = tga->pixel_bytes == 2 ? le16(from) : from[0];
    if (index < tga->first_entry || index - tga->first_entry >= tga->entry_count)
        return false;
    read_color(tga->palette + (index - tga->first_entry) * tga->entry_bytes, tga->entry_bytes, out);
    return true;
}

/* Where the pixel with that number in the file is. */
static uint8_t *place_of(const struct tga *tga, struct image *image, uint64_t number)
{
    uint64_t x = number % tga->width, y = number / tga->width;
    if (tga->order & FROM_RIGHT)
        x = tga->width - 1 - x;
    if (!(tga->order & FROM_TOP))
        y = tga->height - 1 - y;
    return (uint8_t *)image->pixels + 4 * (y * tga->width + x);
}

/* A packet: `count` pixels, each of its own or all alike. */
static bool read_packet(struct tga *tga, struct image *image, uint64_t first, uint64_t count,
                        bool is_run, struct error *err)
{
    uint64_t own = is_run ? 1 : count;
    if ((uint64_t)(tga->end - tga->at) < own * tga->pixel_bytes)
        return error_set(err, ERROR_INVALID_SCENE, "tga: the file ends at pixel %llu of %llu",
                         (unsigned long long)first, (unsigned long long)tga->width * tga->height);
    for (uint64_t i = 0; i < count; i++) {
        const uint8_t *from = tga->at + (is_run ? 0 : i * tga->pixel_bytes);
        if (!read_pixel(tga, from, place_of(tga, image, first + i)))
            return error_set(err, ERROR_INVALID_SCENE,
                             "tga: pixel %llu has a colour that the palette does not have",
                             (unsigned long long)(first + i));
    }
    tga->at += own * tga->pixel_bytes;
    return true;
}

static bool read_pixels(struct tga *tga, struct image *image, struct error *err)
{
    uint64_t total = (uint64_t)tga->width * tga->height;
    if (!tga->has_runs)
        return read_packet(tga, image, 0, total, false, err);
    for (uint64_t first = 0, count; first < total; first += count) {
        uint8_t packet = tga->at < tga->end ? *tga->at++ : 0;
        count = 1 + (packet & 127);
        if (count > total - first)
            count = total - first; /* some writers end so */
        if (!read_packet(tga, image, first, count, packet & 128, err))
            return false;
    }
    return true;
}

bool tga_decode(const uint8_t *bytes, size_t size_bytes, struct image *image, struct error *err)
{
    struct tga tga;
    memset(image, 0, sizeof *image);
    if (!tga_init(&tga, bytes, size_bytes))
        return error_set(err, ERROR_INVALID_SCENE, "the TGA file is broken or cut off");
    if (!image_init(image, (int)tga.width, (int)tga.height, 4, IMAGE_U8, err))
        return false;
    if (read_pixels(&tga, image, err)) {
        image_make_opaque_if_clear(image);
        return true;
    }
    image_finish(image);
    return false;
}
