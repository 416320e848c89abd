/* SPDX-License-Identifier: MIT */
/* What the reading of an upload is at, as GET /v1/uploads/{id} says it: in this order. Thread: any.
 */
#ifndef VITRAIL_PROTOCOL_UPLOAD_STAGE_H
#define VITRAIL_PROTOCOL_UPLOAD_STAGE_H

enum upload_stage {
    UPLOAD_STAGE_CONVERSION, /* from another format to glTF */
    UPLOAD_STAGE_FILE,       /* the JSON of glTF */
    UPLOAD_STAGE_MESHES,
    UPLOAD_STAGE_NODES,
    UPLOAD_STAGE_IMAGES,
    UPLOAD_STAGE_OUTLINE, /* is written and stored */
    UPLOAD_STAGE_COUNT
};

const char *upload_stage_name(int stage); /* NULL past the last */
int upload_stage_find(const char *name);  /* UPLOAD_STAGE_COUNT: there is none of that name */

#endif
