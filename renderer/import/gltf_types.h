/* SPDX-License-Identifier: MIT */
/* The types of the members of glTF objects (glTF 2.0, 5). tinygltf passes over a member whose type
 * is another one, and its default would be drawn. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_TYPES_H
#define VITRAIL_RENDERER_IMPORT_GLTF_TYPES_H

#include "renderer/import/gltf_scanner.h"

/* Passes the value of the top-level member `key`. ERROR_INVALID_SCENE names the place, such as
 * "materials[2].extensions.KHR_materials_ior.ior", of what has a wrong type, is not finite, is
 * negative where only 0 and more has a meaning, or lacks a member that it needs. Members that
 * neither glTF nor an extension that is read knows may be anything. */
MUST_CHECK bool gltf_types_scan(struct scanner *s, struct span key);

#endif
