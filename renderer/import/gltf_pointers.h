/* SPDX-License-Identifier: MIT */
/* What the pointers of KHR_animation_pointer mean. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_POINTERS_H
#define VITRAIL_RENDERER_IMPORT_GLTF_POINTERS_H

#include "renderer/import/gltf_animations.h"
#include "renderer/import/gltf_shim.h"

#define EMISSIVE_FACTOR "/emissiveFactor"

/* Gives each channel with a pointer the node and path, or the record and member, that it points at;
 * a pointer that nothing here can follow becomes GLTF_OTHER_PATH. ERROR_INVALID_SCENE where a node,
 * material or light is not there, ERROR_NO_MEMORY. */
MUST_CHECK bool gltf_pointers_resolve(struct gltf_animations *animations,
                                      const struct gltf_document *document, struct error *err);

#endif
