/* SPDX-License-Identifier: MIT */
/* How an image was made, as one JSON text for its file (protocol/provenance_file.h). Thread: any.
 */
#ifndef VITRAIL_PROTOCOL_PROVENANCE_H
#define VITRAIL_PROTOCOL_PROVENANCE_H

#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "protocol/render_request.h"

struct provenance_desc {
    const struct render_request *request; /* as it was drawn, with the format of the file */
    json_t *asked_quality; /* borrowed; what stands in the place of the request's; or NULL */
    const struct frame_stats *stats;
    const char *version; /* of this program */
};

/* {"software", "device", "scene", "request", "error"}: what the bits of the image depend on, and no
 * time and no guess of one, so that equal requests give equal files. "request" is null, and
 * "request_bytes" is beside it, where the whole would be longer than PROVENANCE_TEXT_MAX; "error"
 * is that of the frame's stats, or null. malloc'ed; NULL: no memory. */
MUST_CHECK char *provenance_make(const struct provenance_desc *desc);

/* That of a picture which was joined from tiles, by the text of one of them: without the tile, in
 * the format of the picture's file, with its quality in [1, 100], or 0 where none was asked for.
 * Where no single render makes the picture, "tiles" says how large its tiles may be, as a job takes
 * it: sums of their lights are rounded in an order of their own. malloc'ed; NULL: no memory, or the
 * text is none. */
MUST_CHECK char *provenance_of_picture(const char *text, size_t length, const char *format,
                                       int quality_percent);

#endif
