/* SPDX-License-Identifier: MIT */
/* Reads a file whole, decodes it, and picks the channels of one layer in a known order. */
#include "clients/compare/input.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/metrics.h"
#include "renderer/image/image_header.h"
#include "renderer/image/linear.h"

#define FILE_BYTES_MAX (4ull << 30) /* 256 million floats: four times what is decoded */

enum { BLOCK_BYTES = 1 << 20, LAYERS_TEXT_BYTES = 256 };

#define IDS_MAX (1u << 24) /* whole numbers up to here are exact as floats */

bool compare_fail(struct failure *failure, const struct error *err, const char *file)
{
    int code = err->code == ERROR_NO_MEMORY ? EXIT_CODE_OS_ERROR : EXIT_CODE_NO_INPUT;
    return fail(failure, code, "'%s': %s", file, err->message);
}

/* ---- bytes ---- */

static bool read_stream(FILE *stream, const char *file, uint8_t **bytes, size_t *size_bytes,
                        struct failure *failure)
{
    size_t capacity = 0, length;
    do {
        if (*size_bytes + BLOCK_BYTES > capacity) {
            capacity = capacity ? 2 * capacity : BLOCK_BYTES;
            uint8_t *grown = realloc(*bytes, capacity);
            if (!grown)
                return fail_no_memory(failure);
            *bytes = grown;
        }
        length = fread(*bytes + *size_bytes, 1, BLOCK_BYTES, stream);
        *size_bytes += length;
        if (*size_bytes > FILE_BYTES_MAX)
            return fail(failure, EXIT_CODE_NO_INPUT, "'%s' has more than %llu bytes", file,
                        FILE_BYTES_MAX);
    } while (length > 0);
    if (ferror(stream))
        return fail(failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", file, strerror(errno));
    return true;
}

static bool read_file(const char *file, uint8_t **bytes, size_t *size_bytes,
                      struct failure *failure)
{
    bool is_stdin = !strcmp(file, "-");
    FILE *stream = is_stdin ? stdin : fopen(file, "rbe");
    if (!stream)
        return fail(failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", file, strerror(errno));
    bool is_ok = read_stream(stream, file, bytes, size_bytes, failure);
    if (!is_stdin)
        fclose(stream);
    return is_ok;
}

/* ---- layers ---- */

static bool is_any_of(const char *name, const char *const *names, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!strcmp(name, names[i]))
            return true;
    return false;
}

static void layer_of(const char *channel, char layer[COMPARE_LAYER_BYTES])
{
    static const char *const color[] = {"R", "G", "B", "A", "Y", ""};
    const char *dot = strrchr(channel, '.');
    if (is_any_of(channel, color, sizeof color / sizeof *color))
        snprintf(layer, COMPARE_LAYER_BYTES, "color");
    else if (!strcmp(channel, "Z"))
        snprintf(layer, COMPARE_LAYER_BYTES, "depth");
    else
        snprintf(layer, COMPARE_LAYER_BYTES, "%.*s", (int)(dot ? dot - channel : 31), channel);
}

/* Where a channel stands in its layer: R G B A, X Y Z, then others as they come. */
static int rank_of(const char *channel)
{
    static const char order[] = "RGBAXYZ";
    const char *dot = strrchr(channel, '.'), *name = dot ? dot + 1 : channel;
    const char *found = name[0] && !name[1] ? strchr(order, name[0]) : NULL;
    return found ? (int)(found - order) : (int)sizeof order;
}

/* Channels of a layer in their order; returns how many. */
static int channels_of(const struct image *image, const char *layer,
                       int channels[IMAGE_CHANNELS_MAX])
{
    int count = 0;
    for (int rank = 0; rank <= rank_of("?"); rank++)
        for (int c = 0; c < image->channels; c++) {
            char own[COMPARE_LAYER_BYTES];
            layer_of(image->channel_names[c], own);
            if (!strcmp(own, layer) && rank_of(image->channel_names[c]) == rank)
                channels[count++] = c;
        }
    return count;
}

/* "color, depth"; returns how many there are, the first one goes to `first`. */
static int list_layers(const struct image *image, char text[LAYERS_TEXT_BYTES],
                       char first[COMPARE_LAYER_BYTES])
{
    int count = 0;
    size_t used = 0;
    text[0] = '\0';
    for (int c = 0; c < image->channels; c++) {
        char layer[COMPARE_LAYER_BYTES], before[COMPARE_LAYER_BYTES];
        bool is_new = true;
        layer_of(image->channel_names[c], layer);
        for (int i = 0; i < c && is_new; i++) {
            layer_of(image->channel_names[i], before);
            is_new = strcmp(layer, before) != 0;
        }
        if (!is_new)
            continue;
        if (!count++)
            memcpy(first, layer, sizeof layer);
        if (used < LAYERS_TEXT_BYTES)
            used += (size_t)snprintf(text + used, LAYERS_TEXT_BYTES - used, "%s%s",
                                     count > 1 ? ", " : "", layer);
    }
    return count;
}

static bool choose_layer(struct compare_input *input, const struct image *decoded,
                         const char *wanted, int channels[IMAGE_CHANNELS_MAX], int *count,
                         struct failure *failure)
{
    char text[LAYERS_TEXT_BYTES], first[COMPARE_LAYER_BYTES] = "";
    int layers = list_layers(decoded, text, first);
    const char *layer = wanted ? wanted : "color";
    *count = channels_of(decoded, layer, channels);
    if (!*count && !wanted && layers == 1)
        *count = channels_of(decoded, layer = first, channels);
    if (!*count && !wanted)
        return fail(failure, EXIT_CODE_REFUSED,
                    "'%s' has several outputs: %s; choose with --output", input->file, text);
    if (!*count)
        return fail(failure, EXIT_CODE_REFUSED, "'%s' has no output '%s', only: %s", input->file,
                    wanted, text);
    snprintf(input->layer, sizeof input->layer, "%s", layer);
    return true;
}

/* ---- numbers ---- */

static bool extract(struct compare_input *input, const struct image *decoded, const int *channels,
                    int count, struct failure *failure)
{
    struct error err = {0};
    struct image *image = &input->image;
    if (!image_init(image, decoded->width_px, decoded->height_px, count, IMAGE_F32, &err))
        return compare_fail(failure, &err, input->file);
    for (int i = 0; i < count; i++)
        memcpy(image->channel_names[i], decoded->channel_names[channels[i]],
               IMAGE_CHANNEL_NAME_BYTES);
    size_t pixels = (size_t)decoded->width_px * (size_t)decoded->height_px;
    float *to = image->pixels;
    for (size_t pixel = 0; pixel < pixels; pixel++)
        for (int i = 0; i < count; i++) {
            size_t at = pixel * (size_t)decoded->channels + (size_t)channels[i];
            if (decoded->component == IMAGE_F32) {
                *to++ = ((const float *)decoded->pixels)[at];
                continue;
            }
            uint32_t id = ((const uint32_t *)decoded->pixels)[at];
            if (id > IDS_MAX)
                return fail(failure, EXIT_CODE_REFUSED,
                            "'%s': the whole number %u is above %u, too large to compare",
                            input->file, id, IDS_MAX);
            *to++ = (float)id;
        }
    return true;
}

/* Of linearised RGBA that was grey: so that it is taken for no colour. */
static bool make_grey(struct compare_input *input, bool has_alpha, struct failure *failure)
{
    struct image *image = &input->image;
    size_t pixels = (size_t)image->width_px * (size_t)image->height_px;
    float *pixel = image->pixels;
    for (size_t i = 0; i < pixels; i++, pixel += 4)
        pixel[1] = pixel[3];
    memcpy(image->channel_names[0], "Y", sizeof "Y");
    memcpy(image->channel_names[1], "A", sizeof "A");
    return compare_input_cut(input, has_alpha ? 2 : 1, failure);
}

/* 16 bits: grey are numbers as they are (depth, ids), colours are sRGB. */
static bool linearise_16_bits(struct compare_input *input, const struct image *decoded,
                              struct failure *failure)
{
    static const char *const names[] = {"Y", "YA", "RGB", "RGBA"};
    struct error err = {0};
    int n = decoded->channels, colors = n - (n % 2 == 0);
    if (!image_init(&input->image, decoded->width_px, decoded->height_px, n, IMAGE_F32, &err))
        return compare_fail(failure, &err, input->file);
    for (int c = 0; c < n; c++)
        input->image.channel_names[c][0] = names[n - 1][c];
    size_t pixels = (size_t)decoded->width_px * (size_t)decoded->height_px;
    const uint16_t *in = decoded->pixels;
    float *out = input->image.pixels;
    for (size_t i = 0; i < pixels; i++, in += n, out += n) {
        double alpha = colors < n ? in[n - 1] / 65535. : 1;
        for (int c = 0; c < colors; c++) {
            double x = in[c] / 65535.;
            out[c] = (float)((n < 3 ? x : srgb_to_linear(x)) * alpha);
        }
        if (colors < n)
            out[n - 1] = (float)alpha;
    }
    return true;
}

/* 8-bit images are RGBA after decoding; alpha counts only where the file can have one. */
static bool linearise(struct compare_input *input, const struct image_header *header,
                      const struct image *decoded, const char *wanted, struct failure *failure)
{
    static const char names[4][2] = {"R", "G", "B", "A"};
    struct error err = {0};
    if (wanted && strcmp(wanted, "color") != 0)
        return fail(failure, EXIT_CODE_REFUSED,
                    "'%s' has no output '%s': a %s file holds one picture, compared as color",
                    input->file, wanted, input->format);
    bool are_numbers = decoded->component == IMAGE_U16 && decoded->channels < 3;
    snprintf(input->layer, sizeof input->layer, are_numbers ? "numbers" : "color");
    input->is_display = !are_numbers;
    if (decoded->component == IMAGE_U16)
        return linearise_16_bits(input, decoded, failure);
    if (!image_linear_from_srgb(decoded, &input->image, &err))
        return compare_fail(failure, &err, input->file);
    if (header->channels == 1 || header->channels == 2)
        return make_grey(input, header->channels == 2, failure);
    for (int i = 0; i < 4; i++)
        memcpy(input->image.channel_names[i], names[i], sizeof names[i]);
    return strcmp(input->format, "jpeg") != 0 || compare_input_cut(input, 3, failure);
}

static bool decode(struct compare_input *input, const uint8_t *bytes, size_t size_bytes,
                   const char *wanted, struct failure *failure)
{
    static const char *const formats[] = {[IMAGE_KIND_PNG] = "png",
                                          [IMAGE_KIND_JPEG] = "jpeg",
                                          [IMAGE_KIND_WEBP] = "webp",
                                          [IMAGE_KIND_EXR] = "exr",
                                          [IMAGE_KIND_HDR] = "hdr"};
    struct image_header header;
    struct image decoded;
    struct error err = {0};
    int channels[IMAGE_CHANNELS_MAX], count;
    if (!image_header_read(&header, bytes, size_bytes, &err) ||
        !image_decode(bytes, size_bytes,
                      &(struct image_decode_desc){.keep_float = true, .keep_16_bits = true},
                      &decoded, &err))
        return compare_fail(failure, &err, input->file);
    input->format = formats[header.kind];
    bool is_ok = decoded.component == IMAGE_U8 || decoded.component == IMAGE_U16
                     ? linearise(input, &header, &decoded, wanted, failure)
                     : choose_layer(input, &decoded, wanted, channels, &count, failure) &&
                           extract(input, &decoded, channels, count, failure);
    image_finish(&decoded);
    return is_ok;
}

bool compare_input_load(struct compare_input *input, const char *file, const char *layer,
                        struct failure *failure)
{
    uint8_t *bytes = NULL;
    size_t size_bytes = 0;
    *input = (struct compare_input){.file = file};
    bool is_ok = read_file(file, &bytes, &size_bytes, failure) &&
                 decode(input, bytes, size_bytes, layer, failure);
    free(bytes);
    if (is_ok)
        input->hash = image_metrics_hash(&input->image);
    return is_ok;
}

void compare_input_finish(struct compare_input *input)
{
    image_finish(&input->image);
}

bool compare_input_cut(struct compare_input *input, int channels, struct failure *failure)
{
    struct error err = {0};
    struct image cut, *image = &input->image;
    if (!image_init(&cut, image->width_px, image->height_px, channels, IMAGE_F32, &err))
        return compare_fail(failure, &err, input->file);
    memcpy(cut.channel_names, image->channel_names, sizeof cut.channel_names);
    const float *from = image->pixels;
    float *to = cut.pixels;
    size_t pixels = (size_t)image->width_px * (size_t)image->height_px;
    for (size_t i = 0; i < pixels; i++, from += image->channels, to += channels)
        memcpy(to, from, (size_t)channels * sizeof *to);
    image_finish(image);
    *image = cut;
    return true;
}

bool compare_input_is_color(const struct compare_input *input)
{
    return !strcmp(input->layer, "color");
}

const char *compare_input_channel(const struct compare_input *input, int channel)
{
    const char *name = input->image.channel_names[channel], *dot = strrchr(name, '.');
    if (dot && dot[1])
        return dot + 1;
    return *name ? name : "Y";
}
