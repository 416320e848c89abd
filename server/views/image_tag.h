/* SPDX-License-Identifier: MIT */
/* Entity tags and priorities, which images of renders and of views have in common. Thread: any. */
#ifndef VITRAIL_SERVER_VIEWS_IMAGE_TAG_H
#define VITRAIL_SERVER_VIEWS_IMAGE_TAG_H

#include "protocol/render_request.h"
#include "renderer/image/image.h"
#include "server/base/digest.h"
#include "server/front/render_queue.h"
#include "server/front/supervisor.h"

enum { IMAGE_TAG_BYTES = DIGEST_TEXT_BYTES + 2 };

/* Of a canonical request, and of what the worker chooses from (NULL: nothing). For a target it
 * tells equal requests apart from others, but not the picture: that is known by
 * render_outcome.drawn once it is there. "" for
 * want of memory. */
void image_digest(const char *text, const json_t *offer, char digest[DIGEST_TEXT_BYTES]);

/* The strong tag, with its quotes, of everything that decides pixels: the digest of the request,
 * which names the scene, the program, the device and the budgets of its memory. False while no
 * device is known; then the tag still tells requests apart. */
struct image_tag_desc { /* the first three are required, borrowed */
    struct supervisor *supervisor;
    const char *build_id, *request_digest;
    int worker; /* of an image that is made: the worker that made it; 0: it is not made yet */
};
MUST_CHECK bool image_tag_make(const struct image_tag_desc *desc, char tag[IMAGE_TAG_BYTES]);

/* Value of the Priority header (RFC 9218): urgency 0 to 7, 3 without one. NULL is none. */
enum render_priority image_priority(const char *priority);

enum request_format request_format_of_image(enum image_format format);

#endif
