/* SPDX-License-Identifier: MIT */
/* Reading animations, channels and samplers from their JSON. */
#include "renderer/import/gltf_animations.h"

#include <stdlib.h>
#include <string.h>

enum { DEPTH = 8 /* of what is passed over, from the root of the document */ };

static bool scan_index(struct scanner *s, int *index)
{
    uint64_t number;
    if (!scanner_unsigned(s, &number))
        return false;
    *index = number > INT32_MAX ? INT32_MAX : (int)number;
    return true;
}

/* One of the texts of a NULL-terminated list, or the list's length. */
static bool scan_word(struct scanner *s, const char *const *words, int *index)
{
    char *text = NULL;
    if (!scanner_text(s, &text))
        return false;
    for (*index = 0; words[*index] && strcmp(words[*index], text) != 0;)
        ++*index;
    free(text);
    return true;
}

/* ---- channels ---- */

static bool scan_pointer_member(struct scanner *s, struct span key, void *object)
{
    struct gltf_channel *channel = object;
    if (!span_is(key, "pointer"))
        return scanner_skip(s, DEPTH);
    free(channel->pointer);
    channel->pointer = NULL;
    return scanner_text(s, &channel->pointer);
}

static bool scan_target_extension(struct scanner *s, struct span key, void *object)
{
    return span_is(key, "KHR_animation_pointer") ? scanner_object(s, scan_pointer_member, object)
                                                 : scanner_skip(s, DEPTH);
}

static bool scan_target_member(struct scanner *s, struct span key, void *object)
{
    static const char *const paths[] = {"translation", "rotation", "scale",
                                        "weights",     "pointer",  NULL};
    struct gltf_channel *channel = object;
    int path;
    if (span_is(key, "node"))
        return scan_index(s, &channel->node);
    if (span_is(key, "extensions"))
        return scanner_object(s, scan_target_extension, channel);
    if (!span_is(key, "path"))
        return scanner_skip(s, DEPTH);
    if (!scan_word(s, paths, &path))
        return false;
    channel->path = paths[path] ? (enum gltf_path)path : GLTF_OTHER_PATH;
    return true;
}

static bool scan_channel_member(struct scanner *s, struct span key, void *object)
{
    struct gltf_channel *channel = object;
    if (span_is(key, "sampler"))
        return scan_index(s, &channel->sampler);
    if (span_is(key, "target"))
        return scanner_object(s, scan_target_member, channel);
    return scanner_skip(s, DEPTH);
}

static bool scan_channel(struct scanner *s, void *list)
{
    struct gltf_animation *animation = list;
    struct gltf_channel *channels =
        scanner_grow(s, animation->channels, animation->channel_count, sizeof *channels);
    if (!channels)
        return false;
    animation->channels = channels;
    struct gltf_channel *channel = &channels[animation->channel_count++];
    *channel = (struct gltf_channel){.sampler = -1, .node = -1, .path = GLTF_OTHER_PATH};
    return scanner_object(s, scan_channel_member, channel);
}

/* ---- samplers ---- */

static bool scan_sampler_member(struct scanner *s, struct span key, void *object)
{
    static const char *const words[] = {
        [GLTF_STEP] = "STEP", [GLTF_LINEAR] = "LINEAR", [GLTF_CUBICSPLINE] = "CUBICSPLINE", NULL};
    struct gltf_animation_sampler *sampler = object;
    int word;
    if (span_is(key, "input"))
        return scan_index(s, &sampler->input);
    if (span_is(key, "output"))
        return scan_index(s, &sampler->output);
    if (!span_is(key, "interpolation"))
        return scanner_skip(s, DEPTH);
    if (!scan_word(s, words, &word))
        return false;
    if (!words[word])
        return scanner_refuse(s, "the interpolation is not STEP, LINEAR or CUBICSPLINE");
    sampler->interpolation = (enum gltf_interpolation)word;
    return true;
}

static bool scan_sampler(struct scanner *s, void *list)
{
    struct gltf_animation *animation = list;
    struct gltf_animation_sampler *samplers =
        scanner_grow(s, animation->samplers, animation->sampler_count, sizeof *samplers);
    if (!samplers)
        return false;
    animation->samplers = samplers;
    struct gltf_animation_sampler *sampler = &samplers[animation->sampler_count++];
    *sampler =
        (struct gltf_animation_sampler){.input = -1, .output = -1, .interpolation = GLTF_LINEAR};
    return scanner_object(s, scan_sampler_member, sampler);
}

/* ---- animations ---- */

static bool scan_animation_member(struct scanner *s, struct span key, void *object)
{
    struct gltf_animation *animation = object;
    if (span_is(key, "name"))
        return scanner_text(s, &animation->name);
    if (span_is(key, "channels"))
        return scanner_array(s, scan_channel, animation);
    if (span_is(key, "samplers"))
        return scanner_array(s, scan_sampler, animation);
    return scanner_skip(s, DEPTH);
}

static bool scan_animation(struct scanner *s, void *list)
{
    struct gltf_animations *animations = list;
    struct gltf_animation *items =
        scanner_grow(s, animations->items, animations->count, sizeof *items);
    if (!items)
        return false;
    animations->items = items;
    struct gltf_animation *animation = &items[animations->count++];
    *animation = (struct gltf_animation){.name = NULL};
    return scanner_object(s, scan_animation_member, animation);
}

bool gltf_animations_init(struct gltf_animations *animations, const struct gltf_json *json,
                          struct error *err)
{
    struct span text = json->animations;
    struct scanner s = {.text = text.begin, .at = text.begin, .end = text.end, .err = err};
    *animations = (struct gltf_animations){.items = NULL};
    if (!text.begin || scanner_array(&s, scan_animation, animations))
        return true;
    gltf_animations_finish(animations);
    return error_wrap(err, "animations");
}

void gltf_animations_finish(struct gltf_animations *animations)
{
    for (size_t i = 0; i < animations->count; i++) {
        for (size_t c = 0; c < animations->items[i].channel_count; c++)
            free(animations->items[i].channels[c].pointer);
        free(animations->items[i].name);
        free(animations->items[i].channels);
        free(animations->items[i].samplers);
    }
    free(animations->items);
    *animations = (struct gltf_animations){.items = NULL};
}
