/* SPDX-License-Identifier: MIT */
/* How a scene's vertices and indices lie on a device: as the scene has them, in fewer bytes. No
 * number changes: a stream takes the narrowest type that has all its values, indices of primitives
 * of up to 65,536 vertices take 16 bits, and a stream ends with the last vertex that has it, for
 * which primitives are ordered by what they have. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_DRAW_VERTEX_LAYOUT_H
#define VITRAIL_RENDERER_DRAW_VERTEX_LAYOUT_H

#include "renderer/scene/scene.h"

/* The numbers of the vertex attributes. */
enum vertex_stream {
    VERTEX_POSITION,
    VERTEX_NORMAL,
    VERTEX_TANGENT, /* this one and those after it are optional */
    VERTEX_TEXCOORD_0,
    VERTEX_TEXCOORD_1,
    VERTEX_COLOR,
    VERTEX_STREAM_COUNT
};

/* Sets of optional streams: bit k is stream VERTEX_TANGENT + k, as in scene_primitive_flags. */
enum { VERTEX_OPTIONALS = 15 };

enum vertex_type { VERTEX_F32, VERTEX_U8, VERTEX_I8, VERTEX_U16, VERTEX_I16 };

struct vertex_format {
    enum vertex_type type;
    bool is_normalized; /* of an unsigned type: its greatest number means 1 */
    uint32_t components;
    uint32_t stride_bytes; /* a multiple of 4 */
    uint64_t count;        /* vertices stored, the first of all; 0: none has it */
};

struct vertex_range { /* where a primitive is on the device */
    uint32_t first_vertex;
    uint32_t first_index; /* in units of its indices */
    bool has_short_indices;
};

struct vertex_run; /* vertices that stay together */

struct vertex_layout {
    struct vertex_format formats[VERTEX_STREAM_COUNT];
    struct vertex_range *ranges; /* owned: per primitive of the scene */
    uint32_t optionals;          /* those stored for some vertices */
    /* 16-bit indices come first, an even number of them, then those of 32 bits. */
    uint64_t short_count, long_count;
    const struct scene *scene; /* borrowed */
    struct vertex_run *runs;   /* owned */
    uint32_t run_count;
};

/* Takes time in the size of the scene at most, mostly much less. The scene's vertices must be in
 * memory. ERROR_NO_MEMORY. */
MUST_CHECK bool vertex_layout_init(struct vertex_layout *layout, const struct scene *scene,
                                   struct error *err);
void vertex_layout_finish(struct vertex_layout *layout); /* accepts zeroed */

uint64_t vertex_layout_stream_bytes(const struct vertex_layout *layout, enum vertex_stream stream);
uint64_t vertex_layout_index_bytes(const struct vertex_layout *layout);

/* The scene's own memory where it holds the very bytes of a stream, else NULL. */
const void *vertex_layout_borrow(const struct vertex_layout *layout, enum vertex_stream stream);
/* Fill as many bytes as the two functions above say. */
void vertex_layout_write(const struct vertex_layout *layout, enum vertex_stream stream, void *out);
void vertex_layout_write_indices(const struct vertex_layout *layout, void *out);

#endif
