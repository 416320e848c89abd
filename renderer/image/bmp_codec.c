/* SPDX-License-Identifier: MIT */
/* A header of the file, one of the bitmap, a palette or bit fields, rows of 4 bytes each. */
#include "renderer/image/bmp_codec.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/image/little_endian.h"

enum {
    FILE_HEADER_BYTES = 14,
    CORE_BYTES = 12, /* bitmap headers: of OS/2 1, of Windows 3, with four bit fields */
    INFO_BYTES = 40,
    FIELDS_BYTES = 56,
    PLAIN = 0, /* compressions */
    RUNS_8 = 1,
    RUNS_4 = 2,
    FIELDS = 3,
    FIELDS_AND_ALPHA = 6,
    SIDE_MOST = 1 << 24, /* pixels: sizes in bytes stay within 64 bits */
    RUN_MOST = 255,      /* pixels that two bytes can tell of */
};

struct bmp {
    uint32_t width, height;
    bool is_from_top;
    int bits, compression;
    uint32_t masks[4]; /* R, G, B, A; of 16 and 32 bits */
    const uint8_t *palette;
    uint32_t entry_bytes, entry_count;
    uint64_t row_bytes; /* of the file */
    const uint8_t *at, *end;
};

static bool is_with_palette(const struct bmp *bmp)
{
    return bmp->bits <= 8;
}

static bool are_supported(int bits, int compression)
{
    switch (compression) {
    case PLAIN:
        return bits == 1 || bits == 4 || bits == 8 || bits == 16 || bits == 24 || bits == 32;
    case RUNS_8:
        return bits == 8;
    case RUNS_4:
        return bits == 4;
    case FIELDS:
    case FIELDS_AND_ALPHA:
        return bits == 16 || bits == 32;
    default:
        return false;
    }
}

static bool read_core(struct bmp *bmp, const uint8_t *b, size_t size)
{
    if (size < FILE_HEADER_BYTES + CORE_BYTES)
        return false;
    bmp->width = le16(b + 18);
    bmp->height = le16(b + 20);
    bmp->bits = (int)le16(b + 24);
    bmp->entry_bytes = 3;
    bmp->palette = b + FILE_HEADER_BYTES + CORE_BYTES;
    return true;
}

static void set_masks(struct bmp *bmp, const uint8_t *b, uint32_t header_bytes)
{
    static const uint32_t usual[2][3] = {{0x7C00, 0x3E0, 0x1F}, {0xFF0000, 0xFF00, 0xFF}};
    bool is_told = bmp->compression == FIELDS || bmp->compression == FIELDS_AND_ALPHA;
    for (int i = 0; i < 3; i++)
        bmp->masks[i] = is_told ? le32(b + 54 + 4 * i) : usual[bmp->bits == 32][i];
    if (is_told && (header_bytes >= FIELDS_BYTES || bmp->compression == FIELDS_AND_ALPHA))
        bmp->masks[3] = le32(b + 66);
}

static bool read_info(struct bmp *bmp, const uint8_t *b, size_t size, uint32_t header_bytes)
{
    if (header_bytes < INFO_BYTES || header_bytes > size - FILE_HEADER_BYTES)
        return false;
    int32_t width = (int32_t)le32(b + 18), height = (int32_t)le32(b + 22);
    uint32_t compression = le32(b + 30), count = le32(b + 46);
    if (width <= 0 || height == 0 || height == INT32_MIN || compression > FIELDS_AND_ALPHA)
        return false;
    bmp->width = (uint32_t)width;
    bmp->height = (uint32_t)abs(height);
    bmp->is_from_top = height < 0;
    bmp->bits = (int)le16(b + 28);
    bmp->compression = (int)compression;
    size_t fields = bmp->compression == FIELDS ? 12 : bmp->compression == FIELDS_AND_ALPHA ? 16 : 0;
    if (fields && size < FILE_HEADER_BYTES + INFO_BYTES + fields)
        return false;
    set_masks(bmp, b, header_bytes);
    bmp->entry_bytes = 4;
    bmp->entry_count = count;
    bmp->palette = b + FILE_HEADER_BYTES + header_bytes;
    return true;
}

static bool bmp_init(struct bmp *bmp, const uint8_t *b, size_t size)
{
    *bmp = (struct bmp){.end = b + size};
    if (size < FILE_HEADER_BYTES + 4)
        return false;
    uint32_t pixels_at = le32(b + 10), header_bytes = le32(b + 14);
    if (header_bytes == CORE_BYTES ? !read_core(bmp, b, size)
                                   : !read_info(bmp, b, size, header_bytes))
        return false;
    if (!are_supported(bmp->bits, bmp->compression) || pixels_at > size || !bmp->width ||
        !bmp->height || bmp->width > SIDE_MOST || bmp->height > SIDE_MOST)
        return false;
    if (is_with_palette(bmp)) {
        uint32_t most = 1u << bmp->bits,
                 there = (uint32_t)((size_t)(bmp->end - bmp->palette) / bmp->entry_bytes);
        if (!bmp->entry_count || bmp->entry_count > most)
            bmp->entry_count = most;
        if (bmp->entry_count > there) /* else pixels name what is not there */
            return false;
    }
    bmp->row_bytes = ((uint64_t)bmp->width * (uint64_t)bmp->bits + 31) / 32 * 4;
    bmp->at = b + pixels_at;
    bool has_runs = bmp->compression == RUNS_8 || bmp->compression == RUNS_4;
    uint64_t least =
        has_runs ? (uint64_t)bmp->width * bmp->height / RUN_MOST * 2 : bmp->row_bytes * bmp->height;
    return least <= size - pixels_at;
}

bool bmp_header_read(struct image_header *header, const uint8_t *bytes, size_t size_bytes)
{
    struct bmp bmp;
    if (!bmp_init(&bmp, bytes, size_bytes))
        return false;
    header->width_px = bmp.width;
    header->height_px = bmp.height;
    return true;
}

/* The bits of the mask, scaled to 0 to 255. */
static uint8_t field_of(uint32_t word, uint32_t mask)
{
    uint32_t most = mask, value = word & mask;
    if (!mask)
        return 0;
    for (; !(most & 1); most >>= 1)
        value >>= 1;
    return (uint8_t)(((uint64_t)value * 255 + most / 2) / most);
}

static bool read_entry(const struct bmp *bmp, uint32_t index, uint8_t out[4], struct error *err)
{
    if (index >= bmp->entry_count)
        return error_set(err, ERROR_INVALID_SCENE, "bmp: there is no colour %u, the palette has %u",
                         index, bmp->entry_count);
    const uint8_t *entry = bmp->palette + (size_t)index * bmp->entry_bytes;
    out[0] = entry[2];
    out[1] = entry[1];
    out[2] = entry[0];
    out[3] = 255;
    return true;
}

static bool read_pixel(const struct bmp *bmp, const uint8_t *row, uint32_t x, uint8_t out[4],
                       struct error *err)
{
    if (is_with_palette(bmp)) {
        uint32_t bit = x * (uint32_t)bmp->bits;
        uint32_t shift = 8 - (uint32_t)bmp->bits - bit % 8;
        return read_entry(bmp, (row[bit / 8] >> shift) & ((1u << bmp->bits) - 1), out, err);
    }
    const uint8_t *from = row + (size_t)x * (size_t)(bmp->bits / 8);
    if (bmp->bits == 24) {
        out[0] = from[2];
        out[1] = from[1];
        out[2] = from[0];
        out[3] = 255;
        return true;
    }
    uint32_t word = bmp->bits == 16 ? le16(from) : le32(from);
    for (int i = 0; i < 4; i++)
        out[i] = field_of(word, bmp->masks[i]);
    if (!bmp->masks[3])
        out[3] = 255;
    return true;
}

static uint8_t *row_of(const struct bmp *bmp, struct image *image, uint32_t y)
{
    size_t row = bmp->is_from_top ? y : bmp->height - 1 - y;
    return (uint8_t *)image->pixels + 4 * row * bmp->width;
}

static bool read_rows(const struct bmp *bmp, struct image *image, struct error *err)
{
    for (uint32_t y = 0; y < bmp->height; y++) {
        uint8_t *out = row_of(bmp, image, y);
        for (uint32_t x = 0; x < bmp->width; x++)
            if (!read_pixel(bmp, bmp->at + y * bmp->row_bytes, x, out + 4 * (size_t)x, err))
                return false;
    }
    return true;
}

/* ---- run lengths ---- */

struct run_writer {
    const struct bmp *bmp;
    struct image *image;
    uint32_t x, y;
};

/* The pixels of a run take the colours of `bytes` in turn; those beyond the row are not there. */
static bool put_run(struct run_writer *to, uint32_t count, const uint8_t *bytes, bool is_absolute,
                    struct error *err)
{
    const struct bmp *bmp = to->bmp;
    for (uint32_t i = 0; i < count && to->x < bmp->width && to->y < bmp->height; i++, to->x++) {
        uint32_t index = bmp->compression == RUNS_8 ? bytes[is_absolute ? i : 0]
                         : i % 2                    ? bytes[is_absolute ? i / 2 : 0] & 15
                                                    : bytes[is_absolute ? i / 2 : 0] >> 4;
        if (!read_entry(bmp, index, row_of(bmp, to->image, to->y) + 4 * (size_t)to->x, err))
            return false;
    }
    return true;
}

/* What is left out has the first colour. */
static bool clear(const struct bmp *bmp, struct image *image, struct error *err)
{
    uint8_t first[4], *out = image->pixels;
    if (!read_entry(bmp, 0, first, err))
        return false;
    for (uint64_t i = 0; i < (uint64_t)bmp->width * bmp->height; i++)
        memcpy(out + 4 * i, first, 4);
    return true;
}

static bool read_runs(const struct bmp *bmp, struct image *image, struct error *err)
{
    enum { END_OF_ROW, END, DELTA };
    struct run_writer to = {.bmp = bmp, .image = image};
    const uint8_t *at = bmp->at;
    if (!clear(bmp, image, err))
        return false;
    while (bmp->end - at >= 2) {
        uint32_t count = at[0], what = at[1];
        at += 2;
        if (count > 0) {
            if (!put_run(&to, count, at - 1, false, err))
                return false;
        } else if (what == END_OF_ROW) {
            to.x = 0;
            to.y++;
        } else if (what == END) {
            return true;
        } else if (what == DELTA && bmp->end - at >= 2) {
            to.x += at[0];
            to.y += at[1];
            at += 2;
        } else {
            size_t bytes = bmp->compression == RUNS_8 ? what : (what + 1) / 2;
            if ((size_t)(bmp->end - at) < bytes || what == DELTA)
                break;
            if (!put_run(&to, what, at, true, err))
                return false;
            at += (bytes + 1) / 2 * 2 < (size_t)(bmp->end - at) ? (bytes + 1) / 2 * 2 : bytes;
        }
    }
    return to.y >= bmp->height || (to.y + 1 == bmp->height && to.x >= bmp->width) ||
           error_set(err, ERROR_INVALID_SCENE, "bmp: the file ends in row %u of %u", to.y,
                     bmp->height);
}

bool bmp_decode(const uint8_t *bytes, size_t size_bytes, struct image *image, struct error *err)
{
    struct bmp bmp;
    memset(image, 0, sizeof *image);
    if (!bmp_init(&bmp, bytes, size_bytes))
        return error_set(err, ERROR_INVALID_SCENE, "the BMP file is broken or cut off");
    if (!image_init(image, (int)bmp.width, (int)bmp.height, 4, IMAGE_U8, err))
        return false;
    bool has_runs = bmp.compression == RUNS_8 || bmp.compression == RUNS_4;
    if (has_runs ? read_runs(&bmp, image, err) : read_rows(&bmp, image, err)) {
        image_make_opaque_if_clear(image);
        return true;
    }
    image_finish(image);
    return false;
}
