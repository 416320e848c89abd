/* SPDX-License-Identifier: MIT */
/* What this server can do, as /v1/capabilities tells it: device, limits, techniques, formats.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_CAPABILITIES_H
#define VITRAIL_PROTOCOL_CAPABILITIES_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum {
    CAPABILITIES_NAME_BYTES = 128,
    CAPABILITIES_TEXT_BYTES = 200,
    CAPABILITIES_DEVICES = 8,
    CAPABILITIES_LINE_BYTES = 240,
};

/* What `shadows: auto` goes by. Zeroed = "raster". */
struct device_auto {
    char policy[16];                    /* "measured", "raster", "raytraced" */
    char note[CAPABILITIES_TEXT_BYTES]; /* when the speed was measured, or why it is not known */
    bool is_measured;                   /* the numbers are there */
    bool is_pending;                    /* they will be */
    double frame_ms;                    /* of a rasterised frame with nothing to do */
    /* Times over those of the machine of the fit (docs/explanation/cost-model.md). */
    double shade, maps, trace, build;
    /* Of the work that decides, here; ns: a pixel without light, looking into a map for a light, a
     * texel and an event of a shadow map, a camera ray, a shadow ray, a triangle of the ray
     * tracer's structure. */
    uint64_t learned; /* print of what was learned of frames since; 0: nothing. Not in the JSON */
    double pixel_ns, lookup_ns, texel_ns, event_ns, camera_ray_ns, shadow_ray_ns, triangle_ns;
};

/* Compressed textures, and what the device was measured to gain by them. */
struct device_blocks {
    char policy[16];                    /* "off", "on", "auto" */
    char note[CAPABILITIES_TEXT_BYTES]; /* where the numbers are from, or why there are none */
    int from_levels;                    /* that the budget would withhold else; 0: never */
    bool is_measured;                   /* the numbers are there */
    double whole_ns, bc1_ns, bc3_ns;    /* of one sample */
    double encode_bytes_per_ms;         /* of RGBA8, on one thread */
};

/* The device as the worker found it. Fixed size, so that it can be kept and sent by value. */
struct device_capabilities {
    char vendor[CAPABILITIES_NAME_BYTES], renderer[CAPABILITIES_NAME_BYTES],
        version[CAPABILITIES_NAME_BYTES];
    char driver[CAPABILITIES_NAME_BYTES]; /* EGL platform in use */
    int device_count;
    bool is_software;
    /* A line on each that EGL lists, and why it was passed over; "" ends them. */
    char devices[CAPABILITIES_DEVICES][CAPABILITIES_LINE_BYTES];
    uint32_t passed_over;                  /* set of bits: those of these lines that say so */
    char warning[CAPABILITIES_LINE_BYTES]; /* of software beside hardware; "": none */
    int max_texture_size, max_samples;
    int vector_bits; /* of the processor's loops over surfaces of rays and over pixels: 128, 256 or
                        512 */
    uint64_t max_storage_block_bytes;
    uint64_t gpu_budget_bytes, gpu_used_bytes;
    char gpu_budget_source[CAPABILITIES_NAME_BYTES]; /* where the budget is from */
    uint64_t upload_bytes_per_ms;                    /* levels of textures, measured */
    bool compresses_textures; /* asked to, and able to, beyond their budget */
    bool has_true_timers, has_post_depth_coverage, is_robust;
    bool has_program_binaries; /* the driver gives compiled programs, to be kept */
    char wide_floats[16];      /* how layers are added up: "f64", "pairs", "pairs-split" */
    double pairs_over_f64;     /* time of pairs to that of f64; 0: not measured */
    struct device_auto automatic;
    struct device_blocks blocks;
};

struct capabilities {
    const char *version;                      /* required, borrowed: of the program */
    const struct device_capabilities *device; /* borrowed; NULL while no worker has a device */
    uint64_t max_upload_bytes;                /* as configured */
    const char *const *extensions;            /* borrowed, NULL-terminated, may be NULL: those of
                                                 glTF that are evaluated */
};

/* Techniques, outputs, formats and the limits of a request are added from the tables that the
 * parser reads. A new reference; NULL only when memory runs out. */
MUST_CHECK json_t *capabilities_to_json(const struct capabilities *capabilities);

/* The lines of devices that were passed over. */
MUST_CHECK json_t *device_passed_over_to_json(const struct device_capabilities *device);

/* The "device" member alone, both ways (worker to front). */
MUST_CHECK json_t *device_capabilities_to_json(const struct device_capabilities *device);
MUST_CHECK bool device_capabilities_from_json(json_t *json, struct device_capabilities *device,
                                              struct error *err);

#endif
