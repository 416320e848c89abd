/* SPDX-License-Identifier: MIT */
/* An image file as linear floats: one output (layer) of it. */
#ifndef VITRAIL_CLIENTS_COMPARE_INPUT_H
#define VITRAIL_CLIENTS_COMPARE_INPUT_H

#include "clients/vitrail/failure.h"
#include "renderer/image/image.h"

enum { COMPARE_LAYER_BYTES = IMAGE_CHANNEL_NAME_BYTES };

/* Zeroed = empty. */
struct compare_input {
    const char *file;   /* borrowed, as given */
    const char *format; /* "exr", "png" ... */
    bool is_display;    /* was a picture of 8 or 16 bits: no light above 1 */
    char layer[COMPARE_LAYER_BYTES];
    struct image image; /* F32; a color layer has R, G, B, or Y, and A where the file has it */
    uint64_t hash;      /* of `image`, image_metrics_hash */
};

/* Reads PNG, JPEG, WebP, EXR or HDR by its content. Layers are named as the server names outputs:
 * channels R G B A or Y are "color", Z is "depth", others go by what stands before their last dot.
 * layer: NULL means color, or else the file's only layer. The failure names the file and, where a
 * layer is missing, those that are there. */
bool compare_input_load(struct compare_input *input, const char *file, const char *layer,
                        struct failure *failure);
void compare_input_finish(struct compare_input *input);

/* Keeps the first `channels` channels. */
bool compare_input_cut(struct compare_input *input, int channels, struct failure *failure);

bool compare_input_is_color(const struct compare_input *input);

/* "R", "X" ...; never empty. */
const char *compare_input_channel(const struct compare_input *input, int channel);

/* An image library's error as a failure about this file. Always returns false. */
bool compare_fail(struct failure *failure, const struct error *err, const char *file);

#endif
