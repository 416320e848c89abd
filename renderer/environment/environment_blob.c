/* SPDX-License-Identifier: MIT */
/* The header: eight letters, the version, columns and rows, and zeros. */
#include "renderer/environment/environment_blob.h"

#include <string.h>

static const char letters[8] = {'V', 'I', 'T', 'R', 'E', 'N', 'V', 'M'};

struct header {
    char letters[8];
    uint32_t version, width, height, zeros[3];
};
_Static_assert(sizeof(struct header) == ENVIRONMENT_BLOB_HEADER_BYTES, "the header has no gaps");

void environment_blob_write_header(int width, int height,
                                   uint8_t bytes[ENVIRONMENT_BLOB_HEADER_BYTES])
{
    struct header header = {
        .version = ENVIRONMENT_BLOB_VERSION, .width = (uint32_t)width, .height = (uint32_t)height};
    memcpy(header.letters, letters, sizeof letters);
    memcpy(bytes, &header, sizeof header);
}

bool environment_blob_open(const void *bytes, size_t size_bytes, struct environment_desc *desc,
                           struct error *err)
{
    struct header header;
    if (size_bytes < sizeof header)
        return error_set(err, ERROR_INVALID_ENVIRONMENT, "a blob of %zu bytes has no header",
                         size_bytes);
    memcpy(&header, bytes, sizeof header);
    if (memcmp(header.letters, letters, sizeof letters) != 0 ||
        header.version != ENVIRONMENT_BLOB_VERSION)
        return error_set(err, ERROR_INVALID_ENVIRONMENT, "no blob of version %d",
                         ENVIRONMENT_BLOB_VERSION);
    if (header.width < 2 || header.width > ENVIRONMENT_WIDTH_MAX || header.height < 1 ||
        header.height > ENVIRONMENT_HEIGHT_MAX ||
        size_bytes - sizeof header !=
            3 * sizeof(float) * (size_t)header.width * (size_t)header.height)
        return error_set(err, ERROR_INVALID_ENVIRONMENT,
                         "a blob of %zu bytes does not hold %u x %u texels", size_bytes,
                         header.width, header.height);
    *desc = (struct environment_desc){.pixels = (const float *)bytes + sizeof header / 4,
                                      .width = (int)header.width,
                                      .height = (int)header.height};
    return true;
}
