// SPDX-License-Identifier: MIT
// Provides FACE, the face of a light that a caster is drawn for. LAYERED: all faces are drawn in
// one pass, and FACE_INDEX, which the stage defines, is that of this one; else the face is bound.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

#ifdef LAYERED
layout(std430, binding = BIND_SHADOW_FACES) readonly buffer face_buffer { face_record faces[]; };
#define FACE faces[FACE_INDEX]
#else
layout(std140, binding = UNIFORM_FACE) uniform face_block { face_record FACE; };
#endif
