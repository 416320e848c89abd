/* SPDX-License-Identifier: MIT */
/* The members of materials and lights that animations change (KHR_animation_pointer), by the names
 * that glTF has for them. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_ANIMATED_MEMBERS_H
#define VITRAIL_RENDERER_SCENE_ANIMATED_MEMBERS_H

#include <stddef.h>
#include <stdint.h>

enum animated_owner { ANIMATED_MATERIAL, ANIMATED_LIGHT };

struct animated_member {
    enum animated_owner owner;
    const char *pointer; /* JSON pointer from the material or light on */
    uint32_t count;      /* numbers */
    float least, most;   /* of each */
    uint32_t offset;     /* bytes into struct scene_material or scene_light */
    uint32_t stride;     /* bytes from one number to the next; 0 means side by side */
};

/* NULL where there is none. The order is part of the blob's meaning. */
const struct animated_member *animated_member(uint32_t index);

/* The index of the member of that pointer, or -1. */
int32_t animated_member_find(enum animated_owner owner, const char *pointer);

/* Sets the member in a struct scene_material or scene_light, within its range. */
void animated_member_set(const struct animated_member *member, const double *values, void *record);

#endif
