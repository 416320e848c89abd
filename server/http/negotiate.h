/* SPDX-License-Identifier: MIT */
/* Reads the headers by which a client chooses: the image format by Accept, and whether an entity
 * tag matches. Thread: any. */
#ifndef VITRAIL_SERVER_HTTP_NEGOTIATE_H
#define VITRAIL_SERVER_HTTP_NEGOTIATE_H

#include <stdbool.h>

#include "protocol/error.h"
#include "renderer/image/image.h"

/* Picks the format with the highest q-value (RFC 9110 12.5.1); a tie goes to PNG, then WebP, JPEG,
 * EXR. NULL or "" accepts all. allowed is a bit set of 1u << enum image_format.
 * ERROR_NOT_ACCEPTABLE lists what there is. */
MUST_CHECK bool negotiate_format(const char *accept, unsigned allowed, enum image_format *format,
                                 struct error *err);

/* The same for any types, NULL-terminated, in order of preference. */
MUST_CHECK bool negotiate_type(const char *accept, const char *const *types, int *chosen,
                               struct error *err);

/* If-None-Match against a strong tag given with its quotes: weak comparison (RFC 9110 13.1.2), "*"
 * matches. */
bool negotiate_tag_matches(const char *if_none_match, const char *tag);

/* If-Match: strong comparison (RFC 9110 13.1.1), "*" matches. NULL, an absent header, matches. */
bool negotiate_if_match(const char *if_match, const char *tag);

/* True when the media type of a Content-Type value equals type, parameters and case aside. */
bool negotiate_is_type(const char *content_type, const char *type);

#endif
