/* SPDX-License-Identifier: MIT */
/* Tags are SHA-256 over the parts, each with its NUL, so that parts cannot run together. */
#include "server/views/image_tag.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void image_digest(const char *text, const json_t *offer, char digest[DIGEST_TEXT_BYTES])
{
    struct digest *made = digest_create(NULL);
    char *rows = offer ? json_dumps(offer, JSON_COMPACT) : NULL;
    digest[0] = '\0';
    if (made && (rows || !offer)) {
        digest_write(made, text, strlen(text));
        if (rows)
            digest_write(made, rows, strlen(rows) + 1);
        digest_end(made, digest);
    }
    digest_destroy(made);
    free(rows);
}

bool image_tag_make(const struct image_tag_desc *desc, char tag[IMAGE_TAG_BYTES])
{
    struct device_capabilities device = {0};
    bool has_device = supervisor_get_device(desc->supervisor, &device);
    struct digest *digest = digest_create(NULL);
    tag[0] = '\0';
    if (!digest)
        return false;
    if (desc->worker) /* others may have learned more, or less */
        device.automatic.learned = supervisor_get_learned(desc->supervisor, desc->worker);
    char automatic[256]; /* what decides between techniques */
    snprintf(automatic, sizeof automatic, "%s %.17g %.17g %.17g %.17g %.17g %" PRIx64,
             device.automatic.policy, device.automatic.frame_ms, device.automatic.shade,
             device.automatic.maps, device.automatic.trace, device.automatic.build,
             device.automatic.learned);
    const struct supervisor_budgets budgets = supervisor_get_budgets(desc->supervisor);
    char memory[96]; /* budgets that decide about texture levels and compression */
    snprintf(memory, sizeof memory, "%d %" PRIu64 " %" PRIu64, device.blocks.from_levels,
             budgets.gpu, budgets.textures);
    const char *parts[] = {desc->request_digest, desc->build_id, device.vendor, device.renderer,
                           device.version,       automatic,      memory};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        digest_write(digest, parts[i], strlen(parts[i]) + 1);
    tag[0] = '"';
    digest_end(digest, tag + 1);
    digest_destroy(digest);
    memcpy(tag + DIGEST_TEXT_BYTES, "\"", 2);
    return has_device;
}

enum render_priority image_priority(const char *priority)
{
    const char *urgency = priority ? strstr(priority, "u=") : NULL;
    if (!urgency || urgency[2] < '0' || urgency[2] > '7' || urgency[2] == '3')
        return RENDER_NORMAL;
    return urgency[2] < '3' ? RENDER_INTERACTIVE : RENDER_BATCH;
}

enum request_format request_format_of_image(enum image_format format)
{
    static const enum request_format as_request[] = {[IMAGE_FORMAT_PNG] = REQUEST_FORMAT_PNG,
                                                     [IMAGE_FORMAT_JPEG] = REQUEST_FORMAT_JPEG,
                                                     [IMAGE_FORMAT_WEBP] = REQUEST_FORMAT_WEBP,
                                                     [IMAGE_FORMAT_EXR] = REQUEST_FORMAT_EXR};
    return as_request[format];
}
