/* SPDX-License-Identifier: MIT */
/* Notes of images, IMAGE.json beside them or the provenance inside: what an image shows and how it
 * was made. By a note beside it a later call knows that an image is whole and of its request; by
 * either 'vitrail verify' makes it again. */
#ifndef VITRAIL_CLIENTS_VITRAIL_IMAGE_NOTE_H
#define VITRAIL_CLIENTS_VITRAIL_IMAGE_NOTE_H

#include <jansson.h>

#include "clients/vitrail/session.h"

/* What is known of an image: {"sha256", "request", "scene", "version", "device", "techniques",
 * "chosen", "error", "frame"}. request: the body of POST /v1/renders; frame: the report, or NULL;
 * version: of the server. New reference; NULL on failure. */
json_t *image_note_make(const char *sha256, const json_t *request, const json_t *frame,
                        const char *version, struct failure *failure);

/* Writes the note of an image that is there. */
bool image_note_write(struct session *session, const char *path, const json_t *request,
                      const json_t *frame, const char *version, struct failure *failure);

/* The note of an image; NULL with EXIT_CODE_NO_INPUT. */
json_t *image_note_read(const char *path, struct failure *failure);

/* The note beside an image, or what the image holds itself in the form of a note, which has no
 * "sha256" and no "techniques", but the size of its "tiles" where it is too large for one render;
 * NULL with EXIT_CODE_NO_INPUT where there is neither. */
json_t *image_note_find(const char *path, struct failure *failure);

/* Whether the image is there, whole and of this request, as its note says. */
bool image_note_matches(struct session *session, const char *path, const json_t *request);

/* The version of the server, copied; "" where it is not known. */
void image_note_version(struct session *session, char *version, size_t capacity);

#endif
