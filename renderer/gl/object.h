/* SPDX-License-Identifier: MIT */
/* Buffers, textures and framebuffers: the only owners of GL names. Thread: GL. Immutable storage,
 * labelled at birth. init fails with ERROR_NO_MEMORY where a storage of a MiB or more has no room:
 * for smaller ones gl_context_check says so. finish accepts zeroed objects. */
#ifndef VITRAIL_RENDERER_GL_OBJECT_H
#define VITRAIL_RENDERER_GL_OBJECT_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

struct gl_buffer {
    uint32_t name; /* tells nothing of the storage: drivers give names of deleted buffers again */
    uint32_t storage; /* how many storages this buffer has had: survives gl_buffer_finish */
    uint64_t size_bytes;
    bool is_uploaded; /* of its desc */
};

struct gl_buffer_desc {
    const char *label;   /* required, e.g. "shadow.deep.heads" */
    uint64_t size_bytes; /* 0 becomes 16, so that an empty list can still be bound */
    const void *data;    /* optional, copied */
    bool is_dynamic;     /* gl_buffer_write will be used */
    bool is_uploaded;    /* the same, and shaders never write to it: no write waits for them */
    bool is_mappable;    /* read through gl_buffer_map: in memory of the host's */
};

MUST_CHECK bool gl_buffer_init(struct gl_buffer *buffer, const struct gl_buffer_desc *desc,
                               struct error *err);
void gl_buffer_finish(struct gl_buffer *buffer);
/* Grows (never shrinks) to at least size_bytes, by half again; contents are lost unless keep. */
MUST_CHECK bool gl_buffer_reserve(struct gl_buffer *buffer, const struct gl_buffer_desc *desc,
                                  bool keep, struct error *err);
/* The size of a buffer after gl_buffer_reserve for so many bytes. */
uint64_t gl_buffer_reserved_bytes(const struct gl_buffer *buffer, uint64_t bytes);
/* The functions below take effect after all earlier writes of shaders to these buffers, and need no
 * memory barrier. (GL needs none either for later reads of shaders.) */
void gl_buffer_write(struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                     const void *data);
void gl_buffer_read(const struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                    void *data);
/* Later writes of shaders are ordered after all their earlier reads and writes. */
void gl_buffer_clear_u32(struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                         uint32_t value);
void gl_buffer_copy(const struct gl_buffer *from, uint64_t from_bytes, struct gl_buffer *to,
                    uint64_t to_bytes, uint64_t size_bytes);
void gl_buffer_bind_storage(const struct gl_buffer *buffer, uint32_t binding); /* whole, as SSBO */
/* A part, from a multiple of GL_BUFFER_ALIGNMENT on, and no further than the buffer goes. */
enum { GL_BUFFER_ALIGNMENT = 256 }; /* no device may ask for more */
void gl_buffer_bind_storage_range(const struct gl_buffer *buffer, uint64_t offset_bytes,
                                  uint64_t size_bytes, uint32_t binding);
/* Likewise as a uniform block. */
void gl_buffer_bind_uniform(const struct gl_buffer *buffer, uint64_t offset_bytes,
                            uint64_t size_bytes, uint32_t binding);
/* The first bytes of a mappable buffer, as the device left them: waits for it. Until
 * gl_buffer_unmap the buffer is not used otherwise. NULL where the context is lost, or without
 * memory. */
const void *gl_buffer_map(const struct gl_buffer *buffer, uint64_t size_bytes);
bool gl_buffer_unmap(const struct gl_buffer *buffer); /* false: what was read is worth nothing */

/* A point in the stream of commands. Zeroed = none, which has passed. */
struct gl_fence {
    void *sync;
};
void gl_fence_set(struct gl_fence *fence); /* behind all commands so far, which go to the device */
/* Whether the device is there, after waiting so long at most. True as well where it will never be,
 * because the context is lost: gl_context_check tells. */
bool gl_fence_wait(const struct gl_fence *fence, uint64_t timeout_ns);
void gl_fence_finish(struct gl_fence *fence);

struct gl_texture {
    uint32_t name;
    uint32_t target, format;
    int width, height, layers, levels, samples;
    uint32_t storage;    /* of the buffer that it views */
    uint64_t size_bytes; /* estimate, all levels */
};

struct gl_texture_desc {
    const char *label; /* required */
    uint32_t format;   /* required; sized internal format, e.g. GL_RGBA32F */
    int width, height; /* required */
    int layers;        /* 0: plain 2D; > 0: 2D array */
    int levels;        /* 0 means 1 */
    int samples;       /* 0: not multisampled; > 0: fixed sample locations */
};

MUST_CHECK bool gl_texture_init(struct gl_texture *texture, const struct gl_texture_desc *desc,
                                struct error *err);
/* A view of a buffer as texels, for read-only lists (on llvmpipe 3x cheaper than storage
 * buffers). */
MUST_CHECK bool gl_texture_init_buffer(struct gl_texture *texture, const char *label,
                                       uint32_t format, const struct gl_buffer *buffer,
                                       struct error *err);
/* The same for a buffer that grows: creates the view anew only if the buffer has new storage since
 * the view was created. A view follows one buffer in one format. */
MUST_CHECK bool gl_texture_follow_buffer(struct gl_texture *view, const char *label,
                                         uint32_t format, const struct gl_buffer *buffer,
                                         struct error *err);
void gl_texture_finish(struct gl_texture *texture);
void gl_texture_bind(const struct gl_texture *texture, uint32_t unit);

struct gl_framebuffer {
    uint32_t name;
};

struct gl_framebuffer_desc {
    const char *label;                  /* required */
    const struct gl_texture *colors[5]; /* NULL ends the list */
    const struct gl_texture *depth;     /* optional */
    const struct gl_texture *stencil;   /* optional; GL_STENCIL_INDEX8 */
    int layer;                          /* of array textures the one that is drawn to ... */
    bool is_layered;                    /* ... else all of them: the vertex stage chooses */
    int width, height, samples;         /* of a framebuffer without attachments */
};

MUST_CHECK bool gl_framebuffer_init(struct gl_framebuffer *framebuffer,
                                    const struct gl_framebuffer_desc *desc, struct error *err);
void gl_framebuffer_finish(struct gl_framebuffer *framebuffer);
/* To be called for a framebuffer that was cleared and not drawn to: zink (Mesa 25.0.7) defers the
 * clear until the next draw, and compute shaders read the old texels meanwhile. */
void gl_framebuffer_apply_clears(void);
/* Turns off what a pass before may have left on between triangles and what is written: blending,
 * scissor and stencil tests, offsets and clamps of depth, coverage by alpha, discarding. Depth
 * tests and culling are each pass's own. */
void gl_disable_fragment_stages(void);

struct gl_vertex_array {
    uint32_t name;
};
void gl_vertex_array_init(struct gl_vertex_array *array, const char *label);
void gl_vertex_array_finish(struct gl_vertex_array *array);

struct gl_sampler {
    uint32_t name;
};
struct gl_sampler_desc {
    const char *label;                               /* required */
    uint32_t mag_filter, min_filter, wrap_s, wrap_t; /* required; GL enums */
};
void gl_sampler_init(struct gl_sampler *sampler, const struct gl_sampler_desc *desc);
void gl_sampler_finish(struct gl_sampler *sampler);

#endif
