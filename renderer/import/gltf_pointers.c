/* SPDX-License-Identifier: MIT */
/* Pointers into nodes, materials, lights and cameras. */
#include "renderer/import/gltf_pointers.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/scene/animated_members.h"

#define NODES "/nodes/"
#define MATERIALS "/materials/"
#define CAMERAS "/cameras/"
#define LIGHTS "/extensions/KHR_lights_punctual/lights/"
#define EMISSIVE_STRENGTH "/extensions/KHR_materials_emissive_strength/emissiveStrength"

/* What follows the index that follows the prefix; NULL where the pointer begins otherwise. */
static const char *after_index(const char *pointer, const char *prefix, int *index)
{
    size_t length = strlen(prefix);
    char *end = NULL;
    if (strncmp(pointer, prefix, length) != 0 || pointer[length] < '0' || pointer[length] > '9')
        return NULL;
    unsigned long long number = strtoull(pointer + length, &end, 10);
    *index = number > INT32_MAX ? INT32_MAX : (int)number;
    return end;
}

static bool is_there(int index, size_t count, const char *what, const struct gltf_channel *channel,
                     struct error *err)
{
    return (size_t)index < count || error_set(err, ERROR_INVALID_SCENE, "%.100s: there is no %s %d",
                                              channel->pointer, what, index);
}

static void point_at_node(struct gltf_channel *channel, int node, const char *rest)
{
    static const char *const words[] = {[GLTF_TRANSLATION] = "/translation",
                                        [GLTF_ROTATION] = "/rotation",
                                        [GLTF_SCALE] = "/scale",
                                        [GLTF_WEIGHTS] = "/weights",
                                        [GLTF_VISIBILITY] =
                                            "/extensions/KHR_node_visibility/visible"};
    for (int path = 0; path <= GLTF_VISIBILITY; path++)
        if (words[path] && strcmp(words[path], rest) == 0) {
            channel->path = (enum gltf_path)path;
            channel->node = node;
        }
}

static void point_at_member(struct gltf_channel *channel, enum animated_owner owner, int record,
                            const char *rest)
{
    bool is_strength = owner == ANIMATED_MATERIAL && strcmp(rest, EMISSIVE_STRENGTH) == 0;
    int32_t member = animated_member_find(owner, is_strength ? EMISSIVE_FACTOR : rest);
    if (member < 0)
        return;
    channel->path = GLTF_MEMBER;
    channel->record = record;
    channel->member = (uint32_t)member;
    channel->is_of_product = is_strength;
}

static bool is_of_specular(const char *rest)
{
    return strncmp(rest, "/extensions/KHR_materials_specular/", 35) == 0;
}

static bool resolve(struct gltf_channel *channel, const struct gltf_document *document,
                    struct error *err)
{
    int index = 0;
    const char *rest, *pointer = channel->pointer ? channel->pointer : "";
    channel->path = GLTF_OTHER_PATH;
    if ((rest = after_index(pointer, NODES, &index))) {
        if (!is_there(index, document->node_count, "node", channel, err))
            return false;
        point_at_node(channel, index, rest);
    } else if ((rest = after_index(pointer, MATERIALS, &index))) {
        if (!is_there(index, document->material_count, "material", channel, err))
            return false;
        if (!is_of_specular(rest) || document->materials[index].has_specular)
            point_at_member(channel, ANIMATED_MATERIAL, index, rest);
    } else if ((rest = after_index(pointer, LIGHTS, &index))) {
        if (!is_there(index, document->light_count, "light", channel, err))
            return false;
        point_at_member(channel, ANIMATED_LIGHT, index, rest);
    } else if ((rest = after_index(pointer, CAMERAS, &index))) {
        if (!is_there(index, document->camera_count, "camera", channel, err))
            return false;
        bool is_of_orthographic = strncmp(rest, "/orthographic/", 14) == 0;
        if (is_of_orthographic == document->cameras[index].is_orthographic)
            point_at_member(channel, ANIMATED_CAMERA, index, rest);
    }
    return true;
}

/* Factor and strength of an emission are kept as their product, so that one animation can change
 * but one of the two: the strength is left out where both change. changed: per material, the number
 * of the last animation, counted from 1, that changes its factor. */
static void leave_out_strengths(struct gltf_animation *animation, size_t number, size_t *changed)
{
    int32_t factor = animated_member_find(ANIMATED_MATERIAL, EMISSIVE_FACTOR);
    for (int pass = 0; pass < 2; pass++)
        for (size_t c = 0; c < animation->channel_count; c++) {
            struct gltf_channel *channel = &animation->channels[c];
            if (channel->path != GLTF_MEMBER || (int32_t)channel->member != factor)
                continue;
            if (pass == 0 && !channel->is_of_product)
                changed[channel->record] = number;
            if (pass == 1 && channel->is_of_product && changed[channel->record] == number)
                channel->path = GLTF_OTHER_PATH;
        }
}

bool gltf_pointers_resolve(struct gltf_animations *animations, const struct gltf_document *document,
                           struct error *err)
{
    size_t *changed = calloc(document->material_count + 1, sizeof *changed);
    bool is_ok =
        changed || error_set(err, ERROR_NO_MEMORY, "%zu materials", document->material_count);
    for (size_t a = 0; is_ok && a < animations->count; a++) {
        struct gltf_animation *animation = &animations->items[a];
        for (size_t c = 0; is_ok && c < animation->channel_count; c++)
            if (animation->channels[c].path == GLTF_POINTER)
                is_ok = resolve(&animation->channels[c], document, err) ||
                        error_wrap(err, "animation %zu, channel %zu", a, c);
        if (is_ok)
            leave_out_strengths(animation, a + 1, changed);
    }
    free(changed);
    return is_ok;
}
