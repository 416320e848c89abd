/* SPDX-License-Identifier: MIT */
/* A PNG file in memory. libpng leaves by longjmp, so all that must be freed then lives in one
 * struct outside of the function that it leaves. */
#include "renderer/image/png_codec.h"

#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/provenance_file.h"
#include "renderer/image/png_plain.h"

enum { PROBLEM_BYTES = 160 };

struct png_file {
    png_structp png;
    png_infop info;
    unsigned char *bytes;
    size_t size, capacity;
    bool is_out_of_memory;
    char problem[PROBLEM_BYTES];
};

struct png_source {
    png_structp png;
    png_infop info;
    const unsigned char *bytes;
    size_t size, at;
    struct image *image;
    char problem[PROBLEM_BYTES];
};

/* The error pointer of libpng is where the text goes. */
static void keep_problem(png_structp png, const char *text)
{
    char *problem = png_get_error_ptr(png);
    strncpy(problem, text, PROBLEM_BYTES - 1);
    longjmp(png_jmpbuf(png), 1);
}

static void ignore_warning(png_structp png, const char *text)
{
    (void)png;
    (void)text;
}

static void append(png_structp png, png_bytep data, size_t length)
{
    struct png_file *file = png_get_io_ptr(png);
    if (file->size + length > file->capacity) {
        size_t grown = 2 * (file->size + length) + 4096;
        unsigned char *moved = realloc(file->bytes, grown);
        if (!moved) {
            file->is_out_of_memory = true;
            png_error(png, "out of memory");
        }
        file->bytes = moved;
        file->capacity = grown;
    }
    memcpy(file->bytes + file->size, data, length);
    file->size += length;
}

static void flush_nothing(png_structp png)
{
    (void)png;
}

/* libpng copies the text. */
static void write_text(const struct png_file *file, const char *keyword, const char *value)
{
    png_text text = {.compression = PNG_TEXT_COMPRESSION_NONE,
                     .key = (char *)(uintptr_t)keyword,
                     .text = (char *)(uintptr_t)value,
                     .text_length = strlen(value)};
    png_set_text(file->png, file->info, &text, 1);
}

static void write_header(const struct png_file *file, const struct image *image,
                         const struct png_file_desc *desc)
{
    static const int colors[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                 PNG_COLOR_TYPE_RGB_ALPHA};
    png_set_compression_level(file->png, desc->level);
    png_set_filter(file->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    png_set_IHDR(file->png, file->info, (png_uint_32)image->width_px, (png_uint_32)image->height_px,
                 image->component == IMAGE_U16 ? 16 : 8, colors[image->channels - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(file->png, file->info, PNG_sRGB_INTENT_ABSOLUTE);
    if (desc->description)
        write_text(file, "Description", desc->description);
    if (desc->provenance)
        write_text(file, PROVENANCE_PNG_KEYWORD, desc->provenance);
    png_write_info(file->png, file->info);
    if (image->component == IMAGE_U16 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__)
        png_set_swap(file->png);
}

/* False after a problem of libpng. Nothing here is to be freed. */
static bool write_file(struct png_file *file, const struct image *image,
                       const struct png_file_desc *desc)
{
    size_t row = image_size_bytes(image) / (size_t)image->height_px;
    if (setjmp(png_jmpbuf(file->png))) /* NOLINT(cert-err52-cpp): libpng knows no other way */
        return false;
    png_set_write_fn(file->png, file, append, flush_nothing);
    write_header(file, image, desc);
    for (int y = 0; y < image->height_px; y++)
        png_write_row(file->png, (png_const_bytep)image->pixels + (size_t)y * row);
    png_write_end(file->png, file->info);
    return true;
}

bool png_file_encode(const struct image *image, const struct png_file_desc *desc, void **bytes,
                     size_t *size_bytes, struct error *err)
{
    struct png_file file = {0};
    file.png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, file.problem, keep_problem, ignore_warning);
    file.info = file.png ? png_create_info_struct(file.png) : NULL;
    bool is_done = file.info && write_file(&file, image, desc);
    if (!file.info || file.is_out_of_memory)
        error_set(err, ERROR_NO_MEMORY, "png of %d x %d", image->width_px, image->height_px);
    else if (!is_done)
        error_set(err, ERROR_INTERNAL, "writing png: %s", file.problem);
    png_destroy_write_struct(&file.png, &file.info);
    if (!is_done) {
        free(file.bytes);
        return false;
    }
    *bytes = file.bytes;
    *size_bytes = file.size;
    return true;
}

static void take(png_structp png, png_bytep data, size_t length)
{
    struct png_source *source = png_get_io_ptr(png);
    if (length > source->size - source->at)
        png_error(png, "the file ends early");
    memcpy(data, source->bytes + source->at, length);
    source->at += length;
}

/* Nothing is decompressed but pixels: texts and profiles may be made to fill the memory. */
static void skip_other_chunks(png_structp png)
{
    static const png_byte names[] = "bKGD\0cHRM\0eXIf\0gAMA\0hIST\0iCCP\0iTXt\0oFFs\0pCAL\0"
                                    "pHYs\0sBIT\0sCAL\0sPLT\0sRGB\0tEXt\0tIME\0zTXt";
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, NULL, 0);
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, names, sizeof names / 5);
}

/* How rows are to come: in the file's channels of 16 bits, or as U8 RGBA. */
static void choose_form(const struct png_source *source, bool is_deep)
{
    png_set_expand(source->png);
    if (!is_deep) {
        png_set_scale_16(source->png);
        png_set_gray_to_rgb(source->png);
        png_set_add_alpha(source->png, 255, PNG_FILLER_AFTER);
    } else if (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) {
        png_set_swap(source->png);
    }
}

/* False after a problem: that of libpng, else err is set. Nothing here is to be freed. */
static bool read_file(struct png_source *source, bool keep_16_bits, struct error *err)
{
    if (setjmp(png_jmpbuf(source->png))) /* NOLINT(cert-err52-cpp): libpng knows no other way */
        return false;
    png_structp png = source->png;
    png_set_read_fn(png, source, take);
#ifdef PNG_IGNORE_ADLER32 /* a newer libpng may be built without */
    /* The CRC of each chunk has guarded the same bytes. */
    png_set_option(png, PNG_IGNORE_ADLER32, PNG_OPTION_ON);
#endif
    skip_other_chunks(png);
    png_read_info(png, source->info);
    bool is_deep = keep_16_bits && png_get_bit_depth(png, source->info) == 16;
    choose_form(source, is_deep);
    int passes = png_set_interlace_handling(png);
    png_read_update_info(png, source->info);
    struct image *image = source->image;
    if (!image_init(image, (int)png_get_image_width(png, source->info),
                    (int)png_get_image_height(png, source->info),
                    png_get_channels(png, source->info), is_deep ? IMAGE_U16 : IMAGE_U8, err))
        return false;
    size_t row = png_get_rowbytes(png, source->info);
    if (row * (size_t)image->height_px != image_size_bytes(image))
        png_error(png, "rows of another size than they should have");
    for (int pass = 0; pass < passes; pass++)
        for (int y = 0; y < image->height_px; y++)
            png_read_row(png, (png_bytep)image->pixels + (size_t)y * row, NULL);
    return true;
}

bool png_file_decode(const void *bytes, size_t size_bytes, bool keep_16_bits, struct image *image,
                     struct error *err)
{
    struct png_source source = {.bytes = bytes, .size = size_bytes, .image = image};
    memset(image, 0, sizeof *image);
#if VITRAIL_WITH_LIBDEFLATE
    if (png_plain_decode(bytes, size_bytes, image))
        return true;
#endif
    source.png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, source.problem, keep_problem, ignore_warning);
    source.info = source.png ? png_create_info_struct(source.png) : NULL;
    bool is_done = source.info && read_file(&source, keep_16_bits, err);
    if (!source.info)
        error_set(err, ERROR_NO_MEMORY, "png of %zu bytes", size_bytes);
    else if (source.problem[0])
        error_set(err, ERROR_INVALID_SCENE, "png: %s", source.problem);
    png_destroy_read_struct(&source.png, &source.info, NULL);
    if (!is_done)
        image_finish(image);
    return is_done;
}
