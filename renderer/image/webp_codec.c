/* SPDX-License-Identifier: MIT */
/* The one home of libwebp. */
#include "renderer/image/webp_codec.h"

#include <stdlib.h>
#include <string.h>
#include <webp/decode.h>
#include <webp/encode.h>
#include <webp/mux.h>

enum {
    /* Of 0 to 6: near the size of 4 in half its time, for frames that are looked at once. */
    LOSSY_METHOD = 2,
    LOSSLESS_LEVEL = 1, /* of 0 to 9: higher ones take seconds for a few per cent */
};

static bool configure(WebPConfig *config, int quality)
{
    if (!WebPConfigInit(config))
        return false;
    if (quality == 100) {
        config->exact = 1; /* colours under full transparency, too */
        return WebPConfigLosslessPreset(config, LOSSLESS_LEVEL);
    }
    config->quality = (float)quality;
    config->method = LOSSY_METHOD;
    return true;
}

static bool encode_picture(const struct image *image, WebPConfig *config, WebPPicture *picture,
                           struct error *err)
{
    int stride = image->width_px * image->channels;
    picture->width = image->width_px;
    picture->height = image->height_px;
    picture->use_argb = config->lossless;
    bool is_imported = image->channels == 4 ? WebPPictureImportRGBA(picture, image->pixels, stride)
                                            : WebPPictureImportRGB(picture, image->pixels, stride);
    if (!is_imported)
        return error_set(err, ERROR_NO_MEMORY, "webp of %d x %d", image->width_px,
                         image->height_px);
    if (!WebPEncode(config, picture))
        return error_set(err,
                         picture->error_code == VP8_ENC_ERROR_OUT_OF_MEMORY ? ERROR_NO_MEMORY
                                                                            : ERROR_INTERNAL,
                         "writing webp: libwebp error %d", (int)picture->error_code);
    return true;
}

/* The file with the packet in it. */
static bool add_xmp(const WebPMemoryWriter *memory, const struct webp_file_desc *desc,
                    WebPData *file)
{
    const WebPData pixels = {memory->mem, memory->size};
    const WebPData packet = {(const uint8_t *)desc->xmp, desc->xmp_bytes};
    WebPMux *mux = WebPMuxCreate(&pixels, 0);
    bool is_done = mux && WebPMuxSetChunk(mux, "XMP ", &packet, 0) == WEBP_MUX_OK &&
                   WebPMuxAssemble(mux, file) == WEBP_MUX_OK;
    WebPMuxDelete(mux);
    return is_done;
}

/* A copy for the caller's free(). */
static bool take_bytes(const uint8_t *from, size_t size, void **bytes, size_t *size_bytes,
                       struct error *err)
{
    *bytes = malloc(size ? size : 1);
    if (!*bytes)
        return error_set(err, ERROR_NO_MEMORY, "webp of %zu bytes", size);
    memcpy(*bytes, from, size);
    *size_bytes = size;
    return true;
}

bool webp_encode(const struct image *image, const struct webp_file_desc *desc, void **bytes,
                 size_t *size_bytes, struct error *err)
{
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter memory;
    WebPData file;
    if (image->width_px > WEBP_MAX_DIMENSION || image->height_px > WEBP_MAX_DIMENSION)
        return error_set(err, ERROR_NOT_ACCEPTABLE,
                         "webp holds images up to %d pixels a side, this is %d x %d",
                         WEBP_MAX_DIMENSION, image->width_px, image->height_px);
    if (!configure(&config, desc->quality) || !WebPPictureInit(&picture))
        return error_set(err, ERROR_INTERNAL, "libwebp is of another version than its header");
    WebPDataInit(&file);
    WebPMemoryWriterInit(&memory);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &memory;
    bool is_done = encode_picture(image, &config, &picture, err);
    WebPPictureFree(&picture);
    if (is_done && desc->xmp && !add_xmp(&memory, desc, &file))
        is_done = error_set(err, ERROR_NO_MEMORY, "webp with %zu bytes of XMP", desc->xmp_bytes);
    const uint8_t *from = desc->xmp ? file.bytes : memory.mem;
    size_t size = desc->xmp ? file.size : memory.size;
    is_done = is_done && take_bytes(from, size, bytes, size_bytes, err);
    WebPDataClear(&file);
    WebPMemoryWriterClear(&memory);
    return is_done;
}

bool webp_decode(const void *bytes, size_t size_bytes, struct image *image, struct error *err)
{
    WebPBitstreamFeatures features;
    memset(image, 0, sizeof *image);
    if (WebPGetFeatures(bytes, size_bytes, &features) != VP8_STATUS_OK)
        return error_set(err, ERROR_INVALID_SCENE, "the WebP header is broken or cut off");
    if (features.has_animation)
        return error_set(err, ERROR_UNSUPPORTED, "animated WebP images are not read");
    if (!image_init(image, features.width, features.height, 4, IMAGE_U8, err))
        return false;
    if (WebPDecodeRGBAInto(bytes, size_bytes, image->pixels, image_size_bytes(image),
                           image->width_px * 4))
        return true;
    image_finish(image);
    return error_set(err, ERROR_INVALID_SCENE, "webp: broken or cut off");
}
