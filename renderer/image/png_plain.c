/* SPDX-License-Identifier: MIT */
/* All pixel data is inflated at once, to the end of the memory that the picture fills from its
 * begin: each row is taken out before a pixel is written over it. Filters: PNG specification (third
 * edition), section 9. */
#include "renderer/image/png_plain.h"

#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

/* Beyond these libpng may refuse what is here not looked at. */
enum { SIDE_MAX = 32768, OTHER_CHUNK_MAX_BYTES = 1 << 20 };
enum { SIGNATURE_BYTES = 8, HEADER_BYTES = 13, CHUNK_BYTES = 12 };
enum { FILTER_NONE, FILTER_SUB, FILTER_UP, FILTER_AVERAGE, FILTER_PAETH };

struct chunk {
    const uint8_t *name, *data;
    uint32_t size;
};

struct png_plain {
    const uint8_t *bytes;
    size_t size;
    uint32_t width, height;
    size_t channels; /* 1, 3 or 4 */
    uint8_t *stream; /* owned: of all IDAT chunks */
    size_t stream_size;
};

static uint32_t read_u32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static bool is_named(const struct chunk *chunk, const char *name)
{
    return memcmp(chunk->name, name, 4) == 0;
}

static bool is_letter(uint8_t byte)
{
    return (byte | 32) >= 'a' && (byte | 32) <= 'z';
}

/* The chunk at *at, which moves behind it. False: there is no whole one, or an odd one. */
static bool next_chunk(const struct png_plain *file, size_t *at, struct chunk *chunk)
{
    if (file->size - *at < CHUNK_BYTES)
        return false;
    const uint8_t *bytes = file->bytes + *at;
    *chunk = (struct chunk){.size = read_u32(bytes), .name = bytes + 4, .data = bytes + 8};
    if (chunk->size > file->size - *at - CHUNK_BYTES)
        return false;
    *at += CHUNK_BYTES + (size_t)chunk->size;
    for (int i = 0; i < 4; i++)
        if (!is_letter(chunk->name[i]))
            return false;
    return !(chunk->name[2] & 32); /* reserved: some versions of libpng refuse it */
}

static bool is_intact(const struct chunk *chunk)
{
    return libdeflate_crc32(0, chunk->name, 4 + (size_t)chunk->size) ==
           read_u32(chunk->data + chunk->size);
}

/* One that changes no pixel: bit 5 of the first letter says so of all but tRNS. */
static bool is_beside(const struct chunk *chunk)
{
    return (chunk->name[0] & 32) && !is_named(chunk, "tRNS") &&
           chunk->size <= OTHER_CHUNK_MAX_BYTES;
}

static bool read_header(struct png_plain *file, size_t *at)
{
    static const size_t channels[] = {[0] = 1, [2] = 3, [6] = 4};
    struct chunk chunk;
    *at = SIGNATURE_BYTES;
    if (file->size < SIGNATURE_BYTES ||
        memcmp(file->bytes, "\x89PNG\r\n\x1a\n", SIGNATURE_BYTES) != 0 ||
        !next_chunk(file, at, &chunk) || !is_named(&chunk, "IHDR") || chunk.size != HEADER_BYTES ||
        !is_intact(&chunk))
        return false;
    const uint8_t *data = chunk.data;
    bool is_plain = data[8] == 8 && data[9] <= 6 && !data[10] && !data[11] && !data[12];
    file->width = read_u32(data);
    file->height = read_u32(data + 4);
    file->channels = is_plain ? channels[data[9]] : 0;
    return file->channels && file->width && file->height && file->width <= SIDE_MAX &&
           file->height <= SIDE_MAX;
}

/* Pixel data must lie in one piece, but for the frames of its chunks. */
static bool read_stream(struct png_plain *file, size_t at)
{
    struct chunk chunk;
    file->stream = malloc(file->size);
    bool is_good = file->stream != NULL, is_over = false;
    while (is_good && !is_over) {
        is_good = next_chunk(file, &at, &chunk);
        if (is_good && is_named(&chunk, "IDAT")) {
            is_good = is_intact(&chunk);
            memcpy(file->stream + file->stream_size, chunk.data, chunk.size);
            file->stream_size += chunk.size;
        } else if (is_good && !file->stream_size) {
            is_good = is_beside(&chunk);
        } else {
            is_over = true;
        }
    }
    return is_over && file->stream_size > 0;
}

static bool inflate_stream(const struct png_plain *file, uint8_t *raw, size_t raw_bytes)
{
    struct libdeflate_decompressor *decompressor = libdeflate_alloc_decompressor();
    bool is_good =
        decompressor && libdeflate_zlib_decompress(decompressor, file->stream, file->stream_size,
                                                   raw, raw_bytes, NULL) == LIBDEFLATE_SUCCESS;
    libdeflate_free_decompressor(decompressor);
    return is_good;
}

static inline int distance(int a, int b)
{
    return a < b ? b - a : a - b;
}

/* Section 9.4: whichever of left, up and up left is nearest to left + up - up left. */
static inline int paeth(int left, int up, int up_left)
{
    int to_left = distance(up, up_left), to_up = distance(left, up_left);
    int to_up_left = distance(left + up, 2 * up_left);
    int nearest = to_up <= to_up_left ? up : up_left;
    return to_left <= to_up && to_left <= to_up_left ? left : nearest;
}

static inline int predict(int filter, int left, int up, int up_left)
{
    return filter == FILTER_SUB       ? left
           : filter == FILTER_AVERAGE ? (left + up) / 2
                                      : paeth(left, up, up_left);
}

/* One of the filters by the pixel to the left, with constants for a loop of its own. */
static inline __attribute__((always_inline)) void
undo_leftward(int filter, size_t channels, const uint8_t *above, uint8_t *row, size_t width)
{
    int left[4] = {0}, up_left[4] = {0};
    for (size_t x = 0; x < width; x++, row += channels, above += channels)
        for (size_t c = 0; c < channels; c++) {
            left[c] = (row[c] + predict(filter, left[c], above[c], up_left[c])) & 255;
            up_left[c] = above[c];
            row[c] = (uint8_t)left[c];
        }
}

static inline __attribute__((always_inline)) void
undo_filter_of(int filter, size_t channels, const uint8_t *above, uint8_t *row, size_t width)
{
    if (filter == FILTER_SUB)
        undo_leftward(FILTER_SUB, channels, above, row, width);
    else if (filter == FILTER_AVERAGE)
        undo_leftward(FILTER_AVERAGE, channels, above, row, width);
    else if (filter == FILTER_PAETH)
        undo_leftward(FILTER_PAETH, channels, above, row, width);
    for (size_t i = 0; filter == FILTER_UP && i < channels * width; i++)
        row[i] = (uint8_t)(row[i] + above[i]);
}

static void undo_filter(int filter, size_t channels, const uint8_t *above, uint8_t *row,
                        size_t width)
{
    if (channels == 1)
        undo_filter_of(filter, 1, above, row, width);
    else if (channels == 3)
        undo_filter_of(filter, 3, above, row, width);
    else
        undo_filter_of(filter, 4, above, row, width);
}

/* Four bytes are read of each pixel, also where it has three. */
static void widen(size_t channels, const uint8_t *row, uint8_t *rgba, size_t width)
{
    static const uint8_t opaque_bytes[] = {0, 0, 0, 255};
    uint32_t opaque, pixel;
    memcpy(&opaque, opaque_bytes, sizeof opaque);
    if (channels == 4)
        memcpy(rgba, row, 4 * width);
    for (size_t x = 0; channels == 3 && x < width; x++) {
        memcpy(&pixel, row + 3 * x, sizeof pixel);
        pixel |= opaque;
        memcpy(rgba + 4 * x, &pixel, sizeof pixel);
    }
    for (size_t x = 0; channels == 1 && x < width; x++) {
        pixel = row[x] * UINT32_C(0x01010101) | opaque;
        memcpy(rgba + 4 * x, &pixel, sizeof pixel);
    }
}

/* raw: the end of the memory that begins at rgba. rows: two with a byte to spare each, zeroed. */
static bool unpack(const struct png_plain *file, const uint8_t *raw, uint8_t *rgba, uint8_t *rows)
{
    size_t row_bytes = file->channels * file->width;
    uint8_t *above = rows, *row = rows + row_bytes + 1;
    for (uint32_t y = 0; y < file->height; y++) {
        int filter = *raw++;
        if (filter > FILTER_PAETH)
            return false;
        memcpy(row, raw, row_bytes);
        raw += row_bytes;
        undo_filter(filter, file->channels, above, row, file->width);
        widen(file->channels, row, rgba, file->width);
        rgba += 4 * (size_t)file->width;
        uint8_t *done = row;
        row = above;
        above = done;
    }
    return true;
}

static bool decode_pixels(const struct png_plain *file, struct image *image)
{
    size_t row_bytes = file->channels * file->width;
    size_t raw_bytes = (1 + row_bytes) * file->height;
    size_t rgba_bytes = 4 * (size_t)file->width * file->height;
    size_t bytes = raw_bytes > rgba_bytes ? raw_bytes : rgba_bytes;
    uint8_t *rows = calloc(2, row_bytes + 1), *pixels = malloc(bytes);
    uint8_t *raw = pixels ? pixels + bytes - raw_bytes : NULL;
    bool is_good =
        rows && raw && inflate_stream(file, raw, raw_bytes) && unpack(file, raw, pixels, rows);
    free(rows);
    if (!is_good) {
        free(pixels);
        return false;
    }
    *image = (struct image){.width_px = (int)file->width,
                            .height_px = (int)file->height,
                            .channels = 4,
                            .component = IMAGE_U8,
                            .pixels = pixels};
    return true;
}

bool png_plain_decode(const void *bytes, size_t size_bytes, struct image *image)
{
    struct png_plain file = {.bytes = bytes, .size = size_bytes};
    size_t at;
    bool is_done = read_header(&file, &at) && read_stream(&file, at) && decode_pixels(&file, image);
    free(file.stream);
    return is_done;
}
