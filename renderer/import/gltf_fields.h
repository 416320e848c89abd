/* SPDX-License-Identifier: MIT */
/* The members of glTF objects that are read, and what each must be. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_FIELDS_H
#define VITRAIL_RENDERER_IMPORT_GLTF_FIELDS_H

#include <stdbool.h>

/* Of a value. */
enum field_kind {
    FIELD_INDEX, /* a whole number from 0 to INT32_MAX */
    FIELD_SIZE,  /* a whole number from 0 on: counts, offsets, lengths */
    FIELD_NUMBER,
    FIELD_BOOLEAN,
    FIELD_TEXT,
    FIELD_ITEM,  /* an object with the members of `fields` */
    FIELD_MAP,   /* an object: every member is a FIELD_INDEX */
    FIELD_LOOSE, /* anything; an object is read as a FIELD_ITEM */
};

struct field {
    const char *name;
    enum field_kind kind;
    bool is_list;               /* an array of such values */
    bool is_needed;             /* its object makes no sense without it */
    int count;                  /* of a list: how many; 0: any number */
    const struct field *fields; /* up to one without a name; at most 32 */
};

/* Those of the document. */
extern const struct field gltf_document_fields[];

#endif
