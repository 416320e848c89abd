/* SPDX-License-Identifier: MIT */
/* The part of GL's state that says which memory a command touches: objects by name with their
 * labels, bindings, and what each program reads and writes. Thread: GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_MIRROR_H
#define VITRAIL_TESTS_SUPPORT_GL_MIRROR_H

#include "tests/support/gl_hooks.h"

enum {
    GL_LABEL_BYTES = 64,
    GL_UNITS = 96, /* texture units and indexed bindings that are followed */
    GL_IMAGES = 16,
    GL_ATTACHMENTS = 5, /* four of colour, and depth */
    GL_STREAMS = 16,    /* buffers of a vertex array, the elements last */
    GL_RESOURCES = 48,  /* of one program */
    GL_TOUCHES = 128,   /* of one command */
};

/* How a command comes to memory. Each way has its bit of glMemoryBarrier (OpenGL 4.5, 7.13.2). */
enum gl_way {
    GL_WAY_STORAGE,   /* shader storage blocks */
    GL_WAY_FETCH,     /* samplers, those of buffers among them */
    GL_WAY_IMAGE,     /* image loads, stores and atomics */
    GL_WAY_UNIFORM,   /* uniform blocks */
    GL_WAY_ATTRIBUTE, /* vertex attributes */
    GL_WAY_ELEMENT,   /* vertex indices */
    GL_WAY_COMMAND,   /* arguments of indirect draws and dispatches */
    GL_WAY_BUFFER,    /* glBufferSubData, copies, clears, reads and mapping of buffers */
    GL_WAY_PIXEL,     /* pack and unpack buffers */
    GL_WAY_TEXTURE,   /* glTexSubImage, copies and reads of textures */
    GL_WAY_TARGET,    /* attachments of framebuffers */
    GL_WAY_COUNT
};

struct gl_access; /* gl_access.c */

/* A buffer or texture. Never freed: messages name objects that are gone. */
struct gl_object {
    GLuint name;
    bool is_texture, is_gone;
    char label[GL_LABEL_BYTES];
    uint64_t size_bytes;               /* of a buffer */
    struct gl_object *source;          /* of a texture: the buffer whose bytes it shows */
    uint64_t source_begin, source_end; /* which of them */
    struct gl_access *accesses;        /* the tracker's; owned */
    int access_count, access_capacity;
    uint64_t written_at;     /* the counts': number of the last command that wrote to it */
    struct gl_object *older; /* made before; all are kept, so that users of deleted ones are told */
};

struct gl_slot { /* an indexed binding */
    struct gl_object *object;
    uint64_t begin, end;
    GLint level, layer; /* and what follows: of an image */
    bool is_layered;
    GLenum access, format;
};

/* A storage block, uniform block, sampler or image of a program. */
struct gl_resource {
    enum gl_way way;
    char name[GL_LABEL_BYTES];
    GLint location, count; /* of samplers and images; elements of an array */
    GLint binding;         /* of the first element */
    bool reads, writes;
};

struct gl_shape { /* of a linked program; never freed, as objects */
    GLuint name;
    char label[GL_LABEL_BYTES];
    char variant[512]; /* its defines, separated by spaces */
    struct gl_resource resources[GL_RESOURCES];
    int resource_count;
    struct gl_shape *older; /* gone before it */
};

struct gl_vertex_streams {
    struct gl_object *buffers[GL_STREAMS];
};

struct gl_attachments {
    char label[GL_LABEL_BYTES];
    struct gl_object *textures[GL_ATTACHMENTS];
};

struct gl_mirror {
    struct gl_slot storage[GL_UNITS], uniforms[GL_UNITS], images[GL_IMAGES];
    struct gl_object *textures[GL_UNITS];
    GLuint samplers[GL_UNITS];
    struct gl_object *pack, *unpack, *commands;
    GLuint program, vertex_array, framebuffer; /* names */
};

/* As of the last call of GL that came through. */
const struct gl_mirror *gl_mirror_state(void);
struct gl_object *gl_mirror_buffer(GLuint name); /* NULL where it is unknown, as for 0 */
struct gl_object *gl_mirror_texture(GLuint name);
struct gl_shape *gl_mirror_program(GLuint name);
const struct gl_attachments *gl_mirror_framebuffer(GLuint name);

/* What a command touches: bytes [begin, end) of a buffer, or a whole texture. */
struct gl_touch {
    struct gl_object *object;
    struct gl_object *view; /* the texture through which a buffer is fetched, or NULL */
    enum gl_way way;
    bool reads, writes;
    uint64_t begin, end;
};

struct gl_touches {
    struct gl_touch items[GL_TOUCHES];
    int count;
};

/* Adds what the current program touches through its resources; and the rest of a draw's. */
void gl_mirror_add_program(struct gl_touches *touches);
void gl_mirror_add_draw(struct gl_touches *touches, bool has_elements, bool has_commands);

#endif
