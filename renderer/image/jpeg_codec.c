/* SPDX-License-Identifier: MIT */
/* The one home of libjpeg. It leaves by longjmp, so all that must be freed then lives in one struct
 * outside of the function that it leaves. */
#include "renderer/image/jpeg_codec.h"

#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jerror.h>
#include <jpeglib.h>

enum { FIRST_BYTES = 65536 }; /* of a file: as much as a frame of 640 x 360 mostly has */

/* What is kept of libjpeg's problem: the client data of both kinds of its objects. */
struct jpeg_way {
    struct jpeg_error_mgr errors;
    jmp_buf way_out;
    bool has_failed, is_out_of_memory;
    char problem[JMSG_LENGTH_MAX];
};

struct jpeg_source {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_way way;
    struct image *image;
};

struct jpeg_file {
    struct jpeg_compress_struct jpeg;
    struct jpeg_way way;
    struct jpeg_destination_mgr destination;
    unsigned char *bytes;
    size_t size, capacity;
};

struct jpeg_writer {
    struct jpeg_compress_struct jpeg;
    struct jpeg_way way;
    FILE *file;
    size_t row_bytes;
};

static void keep_problem(j_common_ptr jpeg)
{
    struct jpeg_way *way = jpeg->client_data;
    jpeg->err->format_message(jpeg, way->problem);
    way->has_failed = true;
    way->is_out_of_memory = jpeg->err->msg_code == JERR_OUT_OF_MEMORY;
    longjmp(way->way_out, 1);
}

static void ignore_message(j_common_ptr jpeg)
{
    (void)jpeg;
}

static struct jpeg_error_mgr *open_way(struct jpeg_way *way)
{
    struct jpeg_error_mgr *errors = jpeg_std_error(&way->errors);
    errors->error_exit = keep_problem;
    errors->output_message = ignore_message;
    return errors;
}

/* Of four inks; Adobe's programs, which write nearly all such files, store how much light is left.
 */
static void lay_on_ink(const struct jpeg_decompress_struct *jpeg, uint8_t *row)
{
    const int flip = jpeg->saw_Adobe_marker ? 0 : 255;
    for (JDIMENSION x = 0; x < jpeg->output_width; x++, row += 4) {
        int black = row[3] ^ flip;
        for (int c = 0; c < 3; c++)
            row[c] = (uint8_t)(((row[c] ^ flip) * black + 127) / 255);
        row[3] = 255;
    }
}

/* False after a problem: that of libjpeg, else err is set. Nothing here is to be freed. */
static bool read_file(struct jpeg_source *source, const void *bytes, size_t size_bytes,
                      struct error *err)
{
    struct jpeg_decompress_struct *jpeg = &source->jpeg;
    if (setjmp(source->way.way_out)) /* NOLINT(cert-err52-cpp): libjpeg knows no other way */
        return false;
    jpeg_create_decompress(jpeg);
    jpeg_mem_src(jpeg, bytes, size_bytes);
    jpeg_read_header(jpeg, TRUE);
    bool has_ink = jpeg->num_components == 4;
    jpeg->out_color_space = has_ink ? JCS_CMYK : JCS_EXT_RGBA;
    jpeg_start_decompress(jpeg);
    if (!image_init(source->image, (int)jpeg->output_width, (int)jpeg->output_height, 4, IMAGE_U8,
                    err))
        return false;
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = (JSAMPROW)source->image->pixels +
                       4 * (size_t)jpeg->output_scanline * jpeg->output_width;
        jpeg_read_scanlines(jpeg, &row, 1);
        if (has_ink)
            lay_on_ink(jpeg, row);
    }
    return true;
}

bool jpeg_file_decode(const void *bytes, size_t size_bytes, struct image *image, struct error *err)
{
    struct jpeg_source source = {.image = image};
    memset(image, 0, sizeof *image);
    source.jpeg.err = open_way(&source.way);
    source.jpeg.client_data = &source.way;
    bool is_done = read_file(&source, bytes, size_bytes, err);
    if (source.way.has_failed)
        error_set(err, source.way.is_out_of_memory ? ERROR_NO_MEMORY : ERROR_INVALID_SCENE,
                  "jpeg: %s", source.way.problem);
    jpeg_destroy_decompress(&source.jpeg);
    if (!is_done)
        image_finish(image);
    return is_done;
}

/* libjpeg's own destination in memory loses the memory that it holds when it leaves. */
static struct jpeg_file *file_of(j_compress_ptr jpeg)
{
    return (struct jpeg_file *)((char *)jpeg - offsetof(struct jpeg_file, jpeg));
}

/* Twice as much as there is, or the first part. */
static boolean grow(j_compress_ptr jpeg)
{
    struct jpeg_file *file = file_of(jpeg);
    size_t grown = file->capacity ? 2 * file->capacity : FIRST_BYTES;
    unsigned char *moved = realloc(file->bytes, grown);
    if (!moved)
        ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 10);
    file->bytes = moved;
    file->destination.next_output_byte = moved + file->capacity; /* all before is written */
    file->destination.free_in_buffer = grown - file->capacity;
    file->capacity = grown;
    return TRUE;
}

static void begin_output(j_compress_ptr jpeg)
{
    grow(jpeg);
}

static void end_output(j_compress_ptr jpeg)
{
    struct jpeg_file *file = file_of(jpeg);
    file->size = file->capacity - file->destination.free_in_buffer;
}

static void describe(j_compress_ptr jpeg, int width_px, int height_px, int channels)
{
    jpeg->image_width = (JDIMENSION)width_px;
    jpeg->image_height = (JDIMENSION)height_px;
    jpeg->input_components = channels;
    jpeg->in_color_space = channels == 4 ? JCS_EXT_RGBX : JCS_RGB;
    jpeg_set_defaults(jpeg);
}

/* A segment of XMP has its place behind the header of JFIF (XMP part 3, 1.1.3). */
static void begin_file(j_compress_ptr jpeg, const struct jpeg_file_desc *desc)
{
    static const char name[] = "http://ns.adobe.com/xap/1.0/"; /* with its NUL */
    jpeg_set_quality(jpeg, desc->quality, TRUE);
    jpeg_start_compress(jpeg, TRUE);
    if (desc->xmp) {
        jpeg_write_m_header(jpeg, JPEG_APP0 + 1, (unsigned)(sizeof name + desc->xmp_bytes));
        for (size_t i = 0; i < sizeof name; i++)
            jpeg_write_m_byte(jpeg, name[i]);
        for (size_t i = 0; i < desc->xmp_bytes; i++)
            jpeg_write_m_byte(jpeg, desc->xmp[i]);
    }
    if (desc->description)
        jpeg_write_marker(jpeg, JPEG_COM, (const JOCTET *)desc->description,
                          (unsigned)strlen(desc->description));
}

/* False after a problem of libjpeg. Nothing here is to be freed. */
static bool write_file(struct jpeg_file *file, const struct image *image,
                       const struct jpeg_file_desc *desc)
{
    struct jpeg_compress_struct *jpeg = &file->jpeg;
    const size_t row_bytes = (size_t)image->width_px * (size_t)image->channels;
    if (setjmp(file->way.way_out)) /* NOLINT(cert-err52-cpp): libjpeg knows no other way */
        return false;
    jpeg_create_compress(jpeg);
    jpeg->dest = &file->destination;
    describe(jpeg, image->width_px, image->height_px, image->channels);
    begin_file(jpeg, desc);
    while (jpeg->next_scanline < jpeg->image_height) {
        JSAMPROW row = (JSAMPROW)image->pixels + row_bytes * jpeg->next_scanline;
        jpeg_write_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_compress(jpeg);
    return true;
}

static bool check_sides(int width_px, int height_px, struct error *err)
{
    if (width_px > JPEG_MAX_DIMENSION || height_px > JPEG_MAX_DIMENSION)
        return error_set(err, ERROR_NOT_ACCEPTABLE,
                         "jpeg holds images up to %ld pixels a side, this is %d x %d",
                         JPEG_MAX_DIMENSION, width_px, height_px);
    return true;
}

bool jpeg_file_encode(const struct image *image, const struct jpeg_file_desc *desc, void **bytes,
                      size_t *size_bytes, struct error *err)
{
    struct jpeg_file file = {.destination = {.init_destination = begin_output,
                                             .empty_output_buffer = grow,
                                             .term_destination = end_output}};
    if (!check_sides(image->width_px, image->height_px, err))
        return false;
    file.jpeg.err = open_way(&file.way);
    file.jpeg.client_data = &file.way;
    bool is_done = write_file(&file, image, desc);
    if (!is_done)
        error_set(err, file.way.is_out_of_memory ? ERROR_NO_MEMORY : ERROR_INTERNAL,
                  "writing jpeg: %s", file.way.problem);
    jpeg_destroy_compress(&file.jpeg);
    if (!is_done) {
        free(file.bytes);
        return false;
    }
    *bytes = file.bytes;
    *size_bytes = file.size;
    return true;
}

static bool tell_problem(const struct jpeg_writer *writer, struct error *err)
{
    return error_set(err, writer->way.is_out_of_memory ? ERROR_NO_MEMORY : ERROR_IO,
                     "writing jpeg: %s", writer->way.problem);
}

/* False after a problem of libjpeg. */
static bool begin_writer(struct jpeg_writer *writer, int width_px, int height_px,
                         const struct jpeg_file_desc *desc)
{
    if (setjmp(writer->way.way_out)) /* NOLINT(cert-err52-cpp): libjpeg knows no other way */
        return false;
    jpeg_create_compress(&writer->jpeg);
    jpeg_stdio_dest(&writer->jpeg, writer->file);
    describe(&writer->jpeg, width_px, height_px, 3);
    begin_file(&writer->jpeg, desc);
    return true;
}

struct jpeg_writer *jpeg_writer_create(int fd, int width_px, int height_px,
                                       const struct jpeg_file_desc *desc, struct error *err)
{
    if (!check_sides(width_px, height_px, err))
        return NULL;
    struct jpeg_writer *writer = calloc(1, sizeof *writer);
    int own = writer ? dup(fd) : -1;
    if (own >= 0 && !(writer->file = fdopen(own, "wb")))
        close(own);
    if (!writer || !writer->file) {
        error_set(err, ERROR_IO, "writing jpeg: the file cannot be opened");
        free(writer);
        return NULL;
    }
    writer->row_bytes = 3 * (size_t)width_px;
    writer->jpeg.err = open_way(&writer->way);
    writer->jpeg.client_data = &writer->way;
    if (begin_writer(writer, width_px, height_px, desc))
        return writer;
    tell_problem(writer, err);
    jpeg_writer_destroy(writer);
    return NULL;
}

bool jpeg_writer_put(struct jpeg_writer *writer, const void *rows, int row_count, struct error *err)
{
    const unsigned char *const first = rows;
    if (setjmp(writer->way.way_out)) /* NOLINT(cert-err52-cpp): libjpeg knows no other way */
        return tell_problem(writer, err);
    for (size_t i = 0; i < (size_t)row_count; i++) {
        JSAMPROW row = (JSAMPROW)(uintptr_t)(first + i * writer->row_bytes);
        jpeg_write_scanlines(&writer->jpeg, &row, 1);
    }
    return true;
}

bool jpeg_writer_end(struct jpeg_writer *writer, struct error *err)
{
    if (setjmp(writer->way.way_out)) /* NOLINT(cert-err52-cpp): libjpeg knows no other way */
        return tell_problem(writer, err);
    jpeg_finish_compress(&writer->jpeg);
    return true;
}

void jpeg_writer_destroy(struct jpeg_writer *writer)
{
    if (!writer)
        return;
    jpeg_destroy_compress(&writer->jpeg);
    fclose(writer->file); /* libjpeg has flushed it, and told what failed */
    free(writer);
}
