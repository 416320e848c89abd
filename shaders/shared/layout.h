/* SPDX-License-Identifier: MIT */
/* What lets one struct definition be read by C and by GLSL. Included by every file in
 * shaders/shared. */
#ifndef VITRAIL_SHADERS_SHARED_LAYOUT_H
#define VITRAIL_SHADERS_SHARED_LAYOUT_H
#ifdef GL_core_profile
#define LAYOUT(type, member, offset)
#define LAYOUT_SIZE(type, size)
#else
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h> /* uint */
typedef struct {
    float v[4];
} vec4;
typedef struct {
    uint32_t v[4];
} uvec4;
#define LAYOUT(type, member, offset) \
    _Static_assert(offsetof(struct type, member) == (offset), #type "." #member);
#define LAYOUT_SIZE(type, size) \
    _Static_assert(sizeof(struct type) == (size) && (size) % 16 == 0, "size of " #type);
#endif
#endif
