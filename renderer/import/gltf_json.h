/* SPDX-License-Identifier: MIT */
/* Looks over glTF JSON before tinygltf sees it, and takes out the arrays whose bytes we resolve
 * ourselves. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_JSON_H
#define VITRAIL_RENDERER_IMPORT_GLTF_JSON_H

#include <stddef.h>
#include <stdint.h>

#include "renderer/import/gltf_scanner.h"

enum {
    GLTF_JSON_DEPTH_MAX = 64,       /* nesting; tinygltf converts recursively */
    GLTF_JSON_VALUES_MAX = 8 << 20, /* of any kind; tinygltf needs some 200 bytes for one */
};
#define GLTF_JSON_BYTES_MAX (1u << 30) /* buffers may be inside, as base64 */

/* One element of "buffers" or "images". Texts are owned, UTF-8 without escapes, and NULL when
 * absent. */
struct gltf_source {
    char *name, *uri, *mime_type;
    uint64_t byte_length; /* 0 when absent */
    int64_t buffer_view;  /* -1 when absent */
};

/* Zeroed = empty. */
struct gltf_json {
    struct gltf_source *buffers, *images;
    size_t buffer_count, image_count;
    size_t skin_count, animation_count;
    /* Their arrays in the text given; balanced, else unchecked; empty when absent:
     * renderer/import/import_skins.c and gltf_animations.h. */
    struct span skins, animations;
    char *rest; /* owned: the document with these four arrays emptied */
    size_t rest_length;
};

/* Refuses what is not one JSON object in UTF-8 within the limits above. What is left in `rest` is
 * balanced, but its grammar is tinygltf's to check. */
MUST_CHECK bool gltf_json_init(struct gltf_json *json, const char *text, size_t length,
                               struct error *err);
void gltf_json_finish(struct gltf_json *json);

#endif
