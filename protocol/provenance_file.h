/* SPDX-License-Identifier: MIT */
/* Where the files of images hold their provenance (protocol/provenance.h), an ASCII text without
 * '<', '>' and '&', which each of them takes as it is: PNG in a tEXt chunk, EXR in an attribute of
 * the header, JPEG and WebP in an XMP packet. Thread: any. */
#ifndef VITRAIL_PROTOCOL_PROVENANCE_FILE_H
#define VITRAIL_PROTOCOL_PROVENANCE_FILE_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"

#define PROVENANCE_PNG_KEYWORD "Vitrail"   /* of a tEXt chunk (PNG, section 11.3.3.2) */
#define PROVENANCE_EXR_ATTRIBUTE "vitrail" /* of type string */

enum {
    /* With the packet around it below the 65,502 bytes of XMP in a JPEG (XMP part 3, 1.1.3). */
    PROVENANCE_TEXT_MAX = 60000,
    PROVENANCE_PACKET_MAX = PROVENANCE_TEXT_MAX + 512,
};

/* The XMP packet of a text. False where it is longer than PROVENANCE_TEXT_MAX. */
MUST_CHECK bool provenance_packet(const char *text, char packet[PROVENANCE_PACKET_MAX],
                                  size_t *length);

/* The text in the bytes of an image file (PNG, JPEG, WebP or EXR by their first bytes), borrowed;
 * false where there is none, or where the file is broken before it. */
MUST_CHECK bool provenance_find(const void *bytes, size_t size_bytes, const char **text,
                                size_t *length);

#endif
