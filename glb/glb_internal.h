/* SPDX-License-Identifier: MIT */
/* What the files of the GLB builder share; nothing outside glb includes it. */
#ifndef VITRAIL_GLB_INTERNAL_H
#define VITRAIL_GLB_INTERNAL_H

#include <jansson.h>

#include "glb/glb_builder.h"

enum glb_kind {
    GLB_KIND_IMAGE,
    GLB_KIND_SAMPLER,
    GLB_KIND_TEXTURE,
    GLB_KIND_MATERIAL,
    GLB_KIND_ACCESSOR,
    GLB_KIND_VIEW,
    GLB_KIND_MESH,
    GLB_KIND_LIGHT,
    GLB_KIND_GRID,
    GLB_KIND_CAMERA,
    GLB_KIND_NODE,
    GLB_KIND_COUNT
};

struct glb_builder {
    struct error failure;           /* the first one; nothing is added after it */
    json_t *arrays[GLB_KIND_COUNT]; /* owned; the top-level arrays of the glTF */
    json_t *roots;                  /* owned; indices of the nodes without a parent */
    json_t *extensions;             /* owned; names used, in order of first use */
    char *scene_name;               /* owned; NULL = none */
    unsigned char *binary;          /* owned; the BIN chunk */
    size_t binary_bytes, binary_capacity;
};

/* A number that reads back to the same f64: whole numbers short, others with 17 digits. NULL and an
 * error naming field when it is not finite. */
json_t *glb_number(struct glb_builder *builder, double value, const char *field);
json_t *glb_numbers(struct glb_builder *builder, const double *values, size_t count,
                    const char *field);

/* Steals value, which may be NULL after a failure. */
void glb_put(struct glb_builder *builder, json_t *object, const char *key, json_t *value);
void glb_put_name(struct glb_builder *builder, json_t *object, const char *name);

/* A new object, or NULL with the failure recorded. */
json_t *glb_object(struct glb_builder *builder);

/* Refuses a value outside [low, high] (also NaN) with a message that names field. */
bool glb_check_range(struct glb_builder *builder, double value, double low, double high,
                     const char *field);
/* Refuses an id that is neither 0 nor one already given out. */
bool glb_check_id(struct glb_builder *builder, enum glb_kind kind, int id, const char *field);

/* Steals element; returns its id, or 0 when the builder has failed. */
int glb_append(struct glb_builder *builder, enum glb_kind kind, json_t *element);
void glb_use_extension(struct glb_builder *builder, const char *name);

/* Copies bytes into the BIN chunk, 4-byte aligned, as a buffer view; returns its id. target: GL
 * binding point of the data, 0 = none. */
int glb_add_view(struct glb_builder *builder, const void *bytes, size_t size_bytes, int target);

/* An accessor of all of a view; NULL after a failure. component: GL_FLOAT, say, as a number. */
json_t *glb_accessor(struct glb_builder *builder, int view, int component, size_t count,
                     const char *type);

int glb_fail_memory(struct glb_builder *builder);

#endif
