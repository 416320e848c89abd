/* SPDX-License-Identifier: MIT */
/* An environment on the device: its means over lobes, and what is seen of it behind a scene, for
 * shaders/shading/environment.glsl. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_ENVIRONMENT_MAPS_H
#define VITRAIL_RENDERER_SHADING_ENVIRONMENT_MAPS_H

#include "renderer/environment/environment.h"
#include "renderer/gl/object.h"
#include "renderer/gl/program.h"

struct environment_maps { /* zeroed: none */
    struct gl_texture diffuse, specular;
    struct gl_texture radiance; /* of those that were seen */
};

/* The bytes that environment_maps_prepare would add, about. */
uint64_t environment_maps_missing_bytes(const struct environment_maps *maps,
                                        const struct environment_light *light);
/* Brings what the light needs and is not there yet. */
MUST_CHECK bool environment_maps_prepare(struct environment_maps *maps,
                                         const struct environment_light *light, struct error *err);
uint64_t environment_maps_size_bytes(const struct environment_maps *maps);
void environment_maps_finish(struct environment_maps *maps); /* accepts zeroed */

/* Textures and uniforms of the light; the world's axes are others' to set. */
void environment_maps_bind(const struct environment_maps *maps,
                           const struct environment_light *light, const struct gl_program *program);

#endif
