/* SPDX-License-Identifier: MIT */
/* The "animations" of a glTF file, which tinygltf does not see: it refuses channels whose target an
 * extension names. Every index is whatever the file says. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_ANIMATIONS_H
#define VITRAIL_RENDERER_IMPORT_GLTF_ANIMATIONS_H

#include "renderer/import/gltf_json.h"

enum gltf_path {
    GLTF_TRANSLATION,
    GLTF_ROTATION,
    GLTF_SCALE,
    GLTF_WEIGHTS,
    GLTF_POINTER, /* KHR_animation_pointer; the two that follow are what a pointer may mean */
    GLTF_VISIBILITY,
    GLTF_MEMBER,
    GLTF_OTHER_PATH, /* unknown */
};

enum gltf_interpolation { GLTF_STEP, GLTF_LINEAR, GLTF_CUBICSPLINE };

struct gltf_channel {
    int sampler, node; /* -1 when absent; a channel without a node has no effect */
    enum gltf_path path;
    char *pointer; /* owned; of KHR_animation_pointer, or NULL */
    /* As import_animations finds them for GLTF_MEMBER: */
    int record;         /* the material or light */
    uint32_t member;    /* renderer/scene/animated_members.h */
    bool is_of_product; /* emissiveStrength, which is kept multiplied with emissiveFactor */
};

struct gltf_animation_sampler {
    int input, output; /* accessors; -1 when absent */
    enum gltf_interpolation interpolation;
};

struct gltf_animation {
    char *name; /* owned; NULL when absent */
    struct gltf_channel *channels;
    size_t channel_count;
    struct gltf_animation_sampler *samplers;
    size_t sampler_count;
};

struct gltf_animations { /* zeroed = none; owns all of it */
    struct gltf_animation *items;
    size_t count;
};

/* Reads json->animations, whose text must still be there. ERROR_INVALID_SCENE where the grammar is
 * not that of glTF 2.0, section 5.5 to 5.7. */
MUST_CHECK bool gltf_animations_init(struct gltf_animations *animations,
                                     const struct gltf_json *json, struct error *err);
void gltf_animations_finish(struct gltf_animations *animations); /* accepts half-built */

#endif
