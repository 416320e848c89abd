/* SPDX-License-Identifier: MIT */
/* A scanner of JSON text, for the parts of a glTF file that we read ourselves. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_SCANNER_H
#define VITRAIL_RENDERER_IMPORT_GLTF_SCANNER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

struct span { /* of the text, borrowed */
    const char *begin, *end;
};

struct scanner {
    const char *text, *at, *end; /* borrowed; at moves from text to end */
    size_t values;               /* seen so far; GLTF_JSON_VALUES_MAX is the limit */
    struct error *err;
};

/* ERROR_INVALID_SCENE with the place and the reason; false. */
bool scanner_refuse(struct scanner *s, const char *reason);

void scanner_skip_space(struct scanner *s);

/* To be called for each value; ERROR_TOO_LARGE above the limit. */
MUST_CHECK bool scanner_count(struct scanner *s);

/* Passes a string; its inside, still escaped, is in *inside. */
MUST_CHECK bool scanner_string(struct scanner *s, struct span *inside);

/* Passes one value of any kind: brackets must match in kind, and stay within the depth. */
MUST_CHECK bool scanner_skip(struct scanner *s, int depth);

/* Passes an object: scan_member is called behind the colon of each member, and passes its value. */
MUST_CHECK bool
scanner_object(struct scanner *s,
               bool (*scan_member)(struct scanner *s, struct span key, void *object), void *object);

/* Passes an array: scan_element is called at each element, and passes it. */
MUST_CHECK bool scanner_array(struct scanner *s,
                              bool (*scan_element)(struct scanner *s, void *list), void *list);

/* Room for one more item, by doubling; count items are there. NULL with the scanner's err. */
void *scanner_grow(struct scanner *s, void *items, size_t count, size_t size_bytes);

/* Passes a string and unescapes it into new memory, the caller's; *text must be NULL. */
MUST_CHECK bool scanner_text(struct scanner *s, char **text);

/* Passes a whole number that is not negative. */
MUST_CHECK bool scanner_unsigned(struct scanner *s, uint64_t *number);

bool span_is(struct span key, const char *name);

#endif
