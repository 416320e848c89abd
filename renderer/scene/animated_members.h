/* SPDX-License-Identifier: MIT */
/* The members of materials, lights and cameras that animations change (KHR_animation_pointer), by
 * the names that glTF has for them. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_ANIMATED_MEMBERS_H
#define VITRAIL_RENDERER_SCENE_ANIMATED_MEMBERS_H

#include <stddef.h>
#include <stdint.h>

enum animated_owner { ANIMATED_MATERIAL, ANIMATED_LIGHT, ANIMATED_CAMERA };

struct animated_member {
    enum animated_owner owner;
    const char *pointer; /* JSON pointer from the material, light or camera on */
    uint32_t count;      /* numbers */
    float least, most;   /* of each */
    uint32_t offset;     /* bytes into struct scene_material, scene_light or scene_camera */
    uint32_t stride;     /* bytes from one number to the next; 0 means side by side */
    uint32_t turned;     /* bytes into struct scene_material of the struct scene_texture_ref whose
                            matrix depends on the member; 0 means none */
};

/* NULL where there is none. The order is part of the blob's meaning. */
const struct animated_member *animated_member(uint32_t index);

/* The index of the member of that pointer, or -1. */
int32_t animated_member_find(enum animated_owner owner, const char *pointer);

/* Sets the member in a struct scene_material, scene_light or scene_camera, within its range, and
 * what depends on it. */
void animated_member_set(const struct animated_member *member, const double *values, void *record);

#endif
