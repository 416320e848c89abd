/* SPDX-License-Identifier: MIT */
/* The name that a misspelt one probably meant, for messages of errors. Thread: any. */
#ifndef VITRAIL_PROTOCOL_NEAREST_H
#define VITRAIL_PROTOCOL_NEAREST_H

#include <stddef.h>

/* A search over candidate names, which are offered one by one. Zeroed apart from `text`. */
struct nearest {
    const char *text; /* required, borrowed: what was written */
    const char *name; /* the best candidate so far, borrowed; NULL: none is near */
    size_t distance;  /* of `name` */
};

/* Takes `name` where its distance from the text is less than that of all before, and small enough
 * to be a slip: a third of the longer of both names, at least 1. The distance is that of Damerau
 * 1964, "A technique for computer detection and correction of spelling errors", restricted to
 * adjacent transpositions, without regard to ASCII case. Names of over 64 bytes are never near. */
void nearest_offer(struct nearest *nearest, const char *name);

#endif
