/* SPDX-License-Identifier: MIT */
/* One upload on its way to a scene or an environment map: streamed into an unnamed file, hashed as
 * it comes, never whole in memory. Thread: any, one upload on one thread at a time.
 *
 * The id of what was uploaded: a single file has the SHA-256 of its bytes. Several files have the
 * SHA-256 of a manifest: the line "vitrail-scene-1", then for each file, sorted by the bytes of its
 * name, "SHA-256 SIZE NAME", each line ended by one line feed. Where one scene of the file was
 * chosen, the id is the SHA-256 of the line "vitrail-scene-of-1" and the line "ID SCENE", ID being
 * that of the above. Where the scene is not glTF, that of the line "vitrail-scene-as-1" and the
 * line "ID FORMAT UNIT UP", the unit in metres, and "-" for what was not asked for. */
#ifndef VITRAIL_SERVER_FRONT_UPLOAD_H
#define VITRAIL_SERVER_FRONT_UPLOAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/scene_format.h"
#include "server/base/digest.h"
#include "server/front/resource_kind.h"

struct upload_file {
    char *name; /* owned by the upload; relative, '/' separated; "" when the body was the file */
    uint64_t offset_bytes; /* into the spool, multiple of 16 */
    uint64_t size_bytes;
    char sha256[DIGEST_TEXT_BYTES];
};

struct upload;

/* Takes spool_fd, also on failure. content_type chooses how the body is read: of a scene one
 * of the media types of scene formats, application/octet-stream (a GLB by its first bytes, or what
 * upload_read_as tells) or multipart/form-data; of an environment map image/vnd.radiance,
 * image/x-exr or application/octet-stream, each an HDR or EXR by its first bytes; else
 * ERROR_UNSUPPORTED_MEDIA_TYPE. */
struct upload *upload_create(enum resource_kind kind, const char *content_type, int spool_fd,
                             struct error *err);
void upload_destroy(struct upload *upload); /* accepts NULL */

/* For http_body_sink. */
MUST_CHECK bool upload_write(void *upload, const void *bytes, size_t size_bytes, struct error *err);

/* The body is over: checks that it is whole and works out its id. */
MUST_CHECK bool upload_end(struct upload *upload, char id[DIGEST_TEXT_BYTES], struct error *err);

enum resource_kind upload_kind(const struct upload *upload);
/* After upload_end. Borrowed. */
int upload_fd(const struct upload *upload);
const struct upload_file *upload_files(const struct upload *upload, size_t *count);
uint64_t upload_size_bytes(const struct upload *upload); /* of all files */
/* Sets what it is called; copied. */
MUST_CHECK bool upload_set_name(struct upload *upload, const char *name, struct error *err);
/* Chooses the scene of the file; copied. Before upload_end. */
MUST_CHECK bool upload_choose_scene(struct upload *upload, const char *scene, struct error *err);
/* How the scene is to be read. Zeroed: by its media type or name, and as it tells itself. */
struct upload_reading {
    bool has_format;
    enum scene_format format;
    double unit_m;     /* 0: not asked for */
    char up;           /* 0: not asked for */
    double deflection; /* 0: not asked for */
};
/* Before upload_end, which refuses with ERROR_INVALID_REQUEST what glTF fixes. */
void upload_read_as(struct upload *upload, const struct upload_reading *reading);
/* After upload_end, with its format. */
const struct upload_reading *upload_reading(const struct upload *upload);
const char *upload_scene(const struct upload *upload); /* NULL: the file's own choice */
/* The name that was set; else that of the file that is the scene; "" when the body was the file. */
const char *upload_name(const struct upload *upload);

#endif
