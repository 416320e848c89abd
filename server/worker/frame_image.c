/* SPDX-License-Identifier: MIT */
/* Outputs as images: EXR takes numbers as they are, the others take what a screen can show. */
#include "server/worker/frame_image.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/image/tone_map.h"
#include "server/mapping/format_mapping.h"
#include "server/mapping/view_mapping.h"

static_assert((int)REQUEST_OUTPUT_COUNT == (int)VIEW_OUTPUT_COUNT,
              "outputs of protocol and renderer differ");

/* Channel names in EXR. The first layer has the standard ones, the others are prefixed (OpenEXR,
 * "Layers"). */
static const char *const channel_names[VIEW_OUTPUT_COUNT][5] = {
    [VIEW_OUTPUT_COLOR] = {"R", "G", "B", "A"},
    [VIEW_OUTPUT_DEPTH] = {"Z"},
    [VIEW_OUTPUT_NORMAL] = {"normal.X", "normal.Y", "normal.Z"},
    [VIEW_OUTPUT_ALBEDO] = {"albedo.R", "albedo.G", "albedo.B"},
    [VIEW_OUTPUT_NODE] = {"node.id"},
    [VIEW_OUTPUT_MATERIAL] = {"material.id"},
    [VIEW_OUTPUT_POSITION] = {"position.X", "position.Y", "position.Z"},
    [VIEW_OUTPUT_TRANSMITTANCE] = {"transmittance.R", "transmittance.G", "transmittance.B"},
    [VIEW_OUTPUT_LIGHTS] = {"lights.count"},
    [VIEW_OUTPUT_LAYERS] = {"layers.count"},
    [VIEW_OUTPUT_OPTICAL_DEPTH] = {"optical_depth.R", "optical_depth.G", "optical_depth.B"},
};

static size_t pixel_count(const struct image *image)
{
    return (size_t)image->width_px * (size_t)image->height_px;
}

static void name_channels(struct image *image, int first, enum view_output output)
{
    for (int i = 0; i < 4 && channel_names[output][i] && first + i < image->channels; i++)
        snprintf(image->channel_names[first + i], IMAGE_CHANNEL_NAME_BYTES, "%s",
                 channel_names[output][i]);
}

/* ---- EXR ---- */

static int channels_of(enum view_output output)
{
    int count = 0;
    while (channel_names[output][count])
        count++;
    return count;
}

/* Copies one output's channels beside those of others. Ids are whole floats: exact below 2^24. */
static void interleave(struct image *to, int first, const struct image *from, int count)
{
    float *target = to->pixels;
    size_t pixels = pixel_count(to);
    for (size_t pixel = 0; pixel < pixels; pixel++)
        for (int i = 0; i < count; i++) {
            size_t source = pixel * (size_t)from->channels + (size_t)i;
            target[pixel * (size_t)to->channels + (size_t)(first + i)] =
                from->component == IMAGE_U32 ? (float)((const uint32_t *)from->pixels)[source]
                                             : ((const float *)from->pixels)[source];
        }
}

static bool combine(struct image *image, const struct frame *frame, uint32_t outputs,
                    struct error *err)
{
    int channels = 0;
    const struct image *any = NULL;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (outputs & 1u << i) {
            channels += channels_of((enum view_output)i);
            any = &frame->outputs[i];
        }
    if (!image_init(image, any->width_px, any->height_px, channels, IMAGE_F32, err))
        return false;
    int first = 0;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (outputs & 1u << i) {
            int count = channels_of((enum view_output)i);
            assert(frame->outputs[i].channels >= count);
            interleave(image, first, &frame->outputs[i], count);
            name_channels(image, first, (enum view_output)i);
            first += count;
        }
    return true;
}

/* ---- what a screen can show ---- */

/* Grey: the nearest surface is white, twice as far is half as bright, and where nothing is it is
 * black. */
static bool show_depth(struct image *image, const struct image *depth, bool is_16_bit,
                       struct error *err)
{
    if (!image_init(image, depth->width_px, depth->height_px, is_16_bit ? 1 : 3,
                    is_16_bit ? IMAGE_U16 : IMAGE_U8, err))
        return false;
    const float *z = depth->pixels;
    size_t pixels = pixel_count(depth);
    float nearest = INFINITY;
    for (size_t i = 0; i < pixels; i++)
        if (z[i] > 0 && z[i] < nearest)
            nearest = z[i];
    for (size_t i = 0; i < pixels; i++) {
        float grey = isfinite(z[i]) && z[i] > 0 ? nearest / z[i] : 0;
        if (is_16_bit)
            ((uint16_t *)image->pixels)[i] = (uint16_t)lrintf(grey * 65535.f);
        else
            memset((uint8_t *)image->pixels + 3 * i, (int)lrintf(grey * 255.f), 3);
    }
    return true;
}

/* x, y, z from [-1, 1] to [0, 255]; where nothing is it is black. */
static bool show_normal(struct image *image, const struct image *normal, struct error *err)
{
    if (!image_init(image, normal->width_px, normal->height_px, 3, IMAGE_U8, err))
        return false;
    const float *n = normal->pixels;
    uint8_t *shown = image->pixels;
    size_t pixels = pixel_count(normal);
    for (size_t i = 0; i < pixels; i++) {
        const float *vector = n + i * (size_t)normal->channels;
        bool is_there = vector[0] != 0 || vector[1] != 0 || vector[2] != 0;
        for (int c = 0; is_there && c < 3; c++)
            shown[3 * i + (size_t)c] =
                (uint8_t)lrintf(127.5f + 127.5f * fminf(fmaxf(vector[c], -1), 1));
    }
    return true;
}

/* Linear RGB in [0, 1] as sRGB, opaque. */
static bool show_linear(struct image *image, const struct image *rgb, struct error *err)
{
    struct image linear = {0};
    if (!image_init(&linear, rgb->width_px, rgb->height_px, 4, IMAGE_F32, err))
        return false;
    float *target = linear.pixels;
    const float *source = rgb->pixels;
    size_t pixels = pixel_count(rgb);
    for (size_t i = 0; i < pixels; i++) {
        memcpy(target + 4 * i, source + i * (size_t)rgb->channels, 3 * sizeof(float));
        target[4 * i + 3] = 1;
    }
    bool is_good =
        tone_map(&linear, &(struct tone_map_desc){.operator_ = TONE_MAPPING_NONE}, image, err);
    image_finish(&linear);
    return is_good;
}

/* The share of light, in [0, 1], that an optical depth takes away: what is clear is black. */
static bool show_optical_depth(struct image *image, const struct image *depth, struct error *err)
{
    struct image lost = {0};
    if (!image_init(&lost, depth->width_px, depth->height_px, 3, IMAGE_F32, err))
        return false;
    const float *tau = depth->pixels;
    float *share = lost.pixels;
    size_t count = 3 * pixel_count(depth);
    for (size_t i = 0; i < count; i++)
        share[i] = -expm1f(-tau[i]);
    bool is_good = show_linear(image, &lost, err);
    image_finish(&lost);
    return is_good;
}

/* A heat map on one scale for all images: black is 0, and each colour of the ramp is four times the
 * count of the one before it. */
static bool show_counts(struct image *image, const struct image *counts, struct error *err)
{
    static const uint8_t ramp[][3] = {
        {0, 0, 0},      /* 0 */
        {28, 40, 150},  /* 1 */
        {0, 140, 200},  /* 4 */
        {20, 170, 70},  /* 16 */
        {245, 215, 40}, /* 64 */
        {220, 40, 30},  /* 256 */
        {255, 255, 255} /* 1024 and more */
    };
    enum { LAST = sizeof ramp / sizeof *ramp - 1 };
    if (!image_init(image, counts->width_px, counts->height_px, 3, IMAGE_U8, err))
        return false;
    const uint32_t *count = counts->pixels;
    uint8_t *shown = image->pixels;
    size_t pixels = pixel_count(counts);
    for (size_t i = 0; i < pixels; i++) {
        float at = count[i] ? fminf(1 + log2f((float)count[i]) / 2, LAST) : 0;
        int below = at < LAST ? (int)at : LAST - 1;
        for (int c = 0; c < 3; c++)
            shown[3 * i + (size_t)c] =
                (uint8_t)lrintf((float)ramp[below][c] +
                                (at - (float)below) * (float)(ramp[below + 1][c] - ramp[below][c]));
    }
    return true;
}

static bool show_ids(struct image *image, const struct image *ids, struct error *err)
{
    const uint32_t *id = ids->pixels;
    size_t pixels = pixel_count(ids);
    for (size_t i = 0; i < pixels; i++)
        if (id[i] > 65535)
            return error_set(err, ERROR_UNSUPPORTED,
                             "id %u does not fit into 16-bit PNG; ask for image/x-exr", id[i]);
    if (!image_init(image, ids->width_px, ids->height_px, 1, IMAGE_U16, err))
        return false;
    for (size_t i = 0; i < pixels; i++)
        ((uint16_t *)image->pixels)[i] = (uint16_t)id[i];
    return true;
}

/* Tone mapped on the device, or here. */
static bool show_color(struct image *image, struct image *color,
                       const struct render_request *request, enum image_format format,
                       struct error *err)
{
    if (color->component == IMAGE_U8) {
        *image = *color;
        *color = (struct image){0};
        return true;
    }
    const struct view_screen screen = view_screen_from_request(request, format);
    const struct tone_map_desc mapping = view_screen_code(&screen);
    return tone_map(color, &mapping, image, err);
}

static bool show(struct image *image, struct frame *frame, const struct render_request *request,
                 enum image_format format, struct error *err)
{
    if (request->outputs & 1u << VIEW_OUTPUT_COLOR)
        return show_color(image, &frame->outputs[VIEW_OUTPUT_COLOR], request, format, err);
    if (request->outputs & 1u << VIEW_OUTPUT_DEPTH)
        return show_depth(image, &frame->outputs[VIEW_OUTPUT_DEPTH], format == IMAGE_FORMAT_PNG,
                          err);
    if (request->outputs & 1u << VIEW_OUTPUT_NORMAL)
        return show_normal(image, &frame->outputs[VIEW_OUTPUT_NORMAL], err);
    int only = __builtin_ctz(request->outputs);
    const struct image *output = &frame->outputs[only];
    if (only == VIEW_OUTPUT_ALBEDO || only == VIEW_OUTPUT_TRANSMITTANCE)
        return show_linear(image, output, err);
    if (only == VIEW_OUTPUT_OPTICAL_DEPTH)
        return show_optical_depth(image, output, err);
    if (only == VIEW_OUTPUT_LIGHTS || only == VIEW_OUTPUT_LAYERS)
        return show_counts(image, output, err);
    return show_ids(image, output, err);
}

bool frame_image_init(struct image *image, struct frame *frame,
                      const struct render_request *request, enum image_format format,
                      struct error *err)
{
    uint32_t outputs = request->outputs;
    assert(outputs != 0 && (frame_image_formats(outputs) & 1u << format));
    if (format != IMAGE_FORMAT_EXR)
        return show(image, frame, request, format, err);
    if (outputs & (outputs - 1))
        return combine(image, frame, outputs, err);
    int only = __builtin_ctz(outputs);
    *image = frame->outputs[only];
    frame->outputs[only] = (struct image){0};
    name_channels(image, 0, (enum view_output)only);
    return true;
}
