/* SPDX-License-Identifier: MIT */
/* A headless, robust OpenGL 4.5 core context on one of EGL's devices. Thread: the one that created
 * it. */
#ifndef VITRAIL_RENDERER_GL_CONTEXT_H
#define VITRAIL_RENDERER_GL_CONTEXT_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "renderer/base/device_choice.h"

struct gl_context;

struct gl_context_desc {
    const char *device;       /* optional, borrowed during create: what gl_device_parse takes */
    bool hides_coverage;      /* tests: as on a device without GL_ARB_post_depth_coverage */
    bool hides_multisampling; /* tests: as on a device with one sample per pixel */
    bool is_strict; /* a GL error or undefined-behaviour message aborts the process (tests); without
                       it the driver is asked for no messages */
    bool poses_as_hardware; /* tests: is_software is false, whatever the device */
    /* Optional, borrowed during create: those of its devices with a reason are not tried. Where
     * none can be had it holds all that are listed afterwards, and why not. */
    struct gl_device_list *devices;
    const struct gl_device_watch *watch; /* optional, borrowed during create */
};

struct gl_limits {
    char vendor[128], renderer[128], version[128], platform[32];
    int device_count;
    int max_texture_size, max_texture_layers, max_samples, max_integer_samples;
    int64_t max_storage_block_bytes, max_texture_buffer_texels;
    int64_t max_whole_block_bytes; /* at least that: of what cannot be divided into blocks */
    int max_compute_groups;
    int max_geometry_blocks, max_tessellation_blocks; /* storage blocks of these stages; maybe 0 */
    int program_formats; /* in which the driver gives linked programs; 0: it does not */
    bool has_post_depth_coverage;
    bool compiles_in_parallel; /* on threads of the driver's, which are not those that draw */
    bool has_vertex_layer;     /* the vertex stage chooses the layer of a layered framebuffer */
    bool is_robust;
    bool is_software;     /* rasterised by the CPU: glDispatchCompute runs on our cores */
    bool has_true_timers; /* timestamps are of use; set by the self-test, never where is_software */
};

/* Elements that a storage block takes: one that is larger loses what is written beyond it. */
static inline uint64_t gl_limits_block(const struct gl_limits *limits, uint64_t element_bytes)
{
    return (uint64_t)limits->max_storage_block_bytes / element_bytes;
}

/* Likewise, of what cannot be divided. llvmpipe and lavapipe tell the 2^27 bytes that OpenGL 4.5
 * asks for (table 23.64), and hold accesses to the size of the buffer alone, up to 2 GiB: what has
 * to be in one block is refused only beyond that. */
static inline uint64_t gl_limits_whole_block(const struct gl_limits *limits, uint64_t element_bytes)
{
    return (uint64_t)limits->max_whole_block_bytes / element_bytes;
}

/* Hardware before software; a device that cannot be had is passed over for the next, but for one
 * that was asked for. ERROR_NO_DEVICE names those that there are. ERROR_INTERNAL where another one,
 * of whomever, is current on the thread. */
struct gl_context *gl_context_create(const struct gl_context_desc *desc, struct error *err);
void gl_context_destroy(struct gl_context *context);

const struct gl_limits *gl_context_limits(const struct gl_context *context);
/* All listed devices, and why some were passed over. */
const struct gl_device_list *gl_context_devices(const struct gl_context *context);
/* gl_device_warning. */
const char *gl_context_warning(const struct gl_context *context);
/* Puts the devices and the reason of the one that is open on the list for the next context. False
 * where it was asked for, and nothing else would do. */
bool gl_context_pass_over(const struct gl_context *context, const char *reason,
                          struct gl_device_list *devices);
/* Tells the watch, which may be NULL, what is done with the device that is open. */
void gl_context_tell(const struct gl_context *context, const struct gl_device_watch *watch,
                     enum gl_device_step step);
void gl_context_set_true_timers(struct gl_context *context, bool has_true_timers);

/* False with ERROR_NO_DEVICE when the context was reset or lost, ERROR_INTERNAL on any pending GL
 * error. */
MUST_CHECK bool gl_context_check(struct gl_context *context, const char *doing, struct error *err);
/* To be called after a failure: if the context was lost, err names that as the reason. */
void gl_context_blame(struct gl_context *context, const char *doing, struct error *err);

#endif
