/* SPDX-License-Identifier: MIT */
/* Animations of nodes, of the weights of morph targets and, by pointers, of members of materials
 * and lights: channels become keys of poses, deformed nodes and such. What no channel of ours can
 * say (other pointers, weights of nodes without morph targets) is counted, with a warning. */
#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_animations.h"
#include "renderer/import/gltf_pointers.h"
#include "renderer/import/importer.h"
#include "renderer/scene/animated_members.h"

/* Per glTF node. */
struct pose_map {
    int32_t *blob_node; /* -1 when the scene does not show it */
    int32_t *pose;      /* -1 while nothing moves it */
    int32_t *deformed;  /* of SCENE_DEFORMED_NODES; -1 when it has no morph targets */
    int32_t *next;      /* per deformed node: another one of the same glTF node, or -1 */
};

static bool is_of_nodes(const struct gltf_channel *channel)
{
    return channel->path <= GLTF_SCALE && channel->node >= 0;
}

static bool has_targets(const struct importer *importer, int node)
{
    int mesh = importer->document->nodes[node].mesh;
    return mesh >= 0 && (size_t)mesh < importer->document->mesh_count &&
           importer->document->meshes[mesh].primitive_count > 0 &&
           importer->document->meshes[mesh].primitives[0].target_count > 0;
}

/* ---- poses ---- */

static bool mark_targets(struct importer *importer, const struct gltf_animations *animations,
                         struct pose_map *map, struct error *err)
{
    size_t count = importer->document->node_count;
    for (size_t a = 0; a < animations->count; a++)
        for (size_t c = 0; c < animations->items[a].channel_count; c++) {
            const struct gltf_channel *channel = &animations->items[a].channels[c];
            if (channel->path != GLTF_OTHER_PATH && channel->node >= 0 &&
                (size_t)channel->node >= count)
                return error_set(err, ERROR_INVALID_SCENE,
                                 "animation %zu, channel %zu: there is no node %d", a, c,
                                 channel->node);
            if (!is_of_nodes(channel)) {
                importer->unmoved_channels +=
                    channel->path == GLTF_OTHER_PATH ||
                    (channel->path == GLTF_WEIGHTS &&
                     (channel->node < 0 || !has_targets(importer, channel->node)));
                continue;
            }
            if (importer->document->nodes[channel->node].matrix.count)
                return error_set(err, ERROR_INVALID_SCENE,
                                 "animation %zu, channel %zu: node %d has a matrix, so nothing can "
                                 "move it",
                                 a, c, channel->node);
            map->pose[channel->node] = 0;
        }
    return true;
}

/* In the order of the blob's nodes. */
static bool write_poses(struct importer *importer, struct pose_map *map, struct error *err)
{
    int32_t count = 0;
    for (uint32_t i = 0; i < importer->node_count; i++) {
        uint32_t source = importer->node_order[i];
        map->blob_node[source] = (int32_t)i;
        if (map->pose[source] < 0)
            continue;
        struct scene_pose *pose = blob_writer_append(&importer->writer, SCENE_POSES, 1, err);
        if (!pose)
            return false;
        pose->node = i;
        if (!import_pose(&importer->document->nodes[source], pose, err))
            return error_wrap(err, "node %u", source);
        map->pose[source] = count++;
    }
    return true;
}

/* A node of the file is several where it has instances. */
static bool find_deformed(const struct importer *importer, struct pose_map *map, struct error *err)
{
    const struct blob_section *section = &importer->writer.sections[SCENE_DEFORMED_NODES];
    const struct scene_deformed_node *deformed = section->records;
    const struct scene_node *nodes = importer->writer.sections[SCENE_NODES].records;
    map->next = malloc((section->count + 1) * sizeof *map->next);
    if (!map->next)
        return error_set(err, ERROR_NO_MEMORY, "%llu nodes that deform",
                         (unsigned long long)section->count);
    for (uint64_t i = 0; i < section->count; i++) {
        int32_t *first = &map->deformed[nodes[deformed[i].node].source_index];
        if (!deformed[i].weight_count)
            continue;
        map->next[i] = *first;
        *first = (int32_t)i;
    }
    return true;
}

/* ---- keys ---- */

/* Of a value of the file; of weights, of one of them. */
static int file_components(const struct gltf_channel *channel)
{
    switch (channel->path) {
    case GLTF_ROTATION:
        return 4;
    case GLTF_WEIGHTS:
    case GLTF_VISIBILITY:
        return 1;
    case GLTF_MEMBER:
        return channel->is_of_product ? 1 : (int)animated_member(channel->member)->count;
    default:
        return 3;
    }
}

/* weights: of the node that the channel moves, for GLTF_WEIGHTS. */
static bool open_keys(const struct importer *importer, const struct gltf_animation_sampler *sampler,
                      const struct gltf_channel *channel, uint32_t weights, struct accessor *times,
                      struct accessor *values, struct error *err)
{
    enum gltf_path path = channel->path;
    int components = file_components(channel);
    uint64_t per_key = sampler->interpolation == GLTF_CUBICSPLINE ? 3 : 1;
    if (!accessor_open(&importer->source, sampler->input, times, err) ||
        !accessor_open(&importer->source, sampler->output, values, err))
        return false;
    if (times->components != 1 || times->component != GLTF_FLOAT)
        return error_set(err, ERROR_INVALID_SCENE, "its times are no float scalars");
    if (path == GLTF_VISIBILITY && sampler->interpolation != GLTF_STEP)
        return error_set(err, ERROR_INVALID_SCENE, "visibility goes by STEP alone");
    if (values->components != components)
        return error_set(err, ERROR_INVALID_SCENE, "its values have %d components, not %d",
                         values->components, components);
    if (path != GLTF_WEIGHTS && values->count != per_key * times->count)
        return error_set(err, ERROR_INVALID_SCENE, "%u values for %u times", values->count,
                         times->count);
    if (path == GLTF_WEIGHTS && values->count != per_key * times->count * weights)
        return error_set(err, ERROR_INVALID_SCENE, "%u values for %u times and %u morph targets",
                         values->count, times->count, weights);
    return true;
}

static bool read_times(const struct accessor *times, float *out, struct error *err)
{
    for (uint32_t i = 0; i < times->count; i++) {
        float value[4];
        if (!accessor_read(times, i, value, err))
            return false;
        out[i] = value[0];
        if (out[i] < 0 || (i > 0 && out[i] < out[i - 1]))
            return error_set(err, ERROR_INVALID_SCENE,
                             "its times are negative or not ascending at key %u", i);
    }
    return true;
}

static bool read_values(const struct accessor *values, float *out, struct error *err)
{
    for (uint32_t i = 0; i < values->count; i++) {
        float value[4];
        if (!accessor_read(values, i, value, err))
            return false;
        memcpy(out + (size_t)i * (size_t)values->components, value,
               (size_t)values->components * sizeof *out);
    }
    return true;
}

/* To the animation that was appended last. */
static bool append_channel(struct importer *importer, const struct scene_channel *channel,
                           float end_s, struct error *err)
{
    struct scene_channel *to = blob_writer_append(&importer->writer, SCENE_CHANNELS, 1, err);
    if (!to)
        return false;
    *to = *channel;
    struct blob_section *animations = &importer->writer.sections[SCENE_ANIMATIONS];
    struct scene_animation *record =
        (struct scene_animation *)animations->records + animations->count - 1;
    record->channel_count++;
    if (end_s > record->duration_s)
        record->duration_s = end_s;
    return true;
}

/* Multiplies what is kept as a product: emissiveFactor times emissiveStrength. The file's values
 * are the last of the numbers and grow to three each where they are strengths. */
static void multiply_emission(const struct importer *importer, const struct gltf_channel *channel,
                              uint32_t count, float *numbers)
{
    const struct gltf_material *material = &importer->document->materials[channel->record];
    const struct gltf_numbers *factor = &material->emissive;
    for (uint32_t i = channel->is_of_product ? count : 0; i-- > 0;)
        for (uint32_t k = 3; k-- > 0;)
            numbers[3 * i + k] =
                (float)((double)numbers[i] * (factor->count == 3 ? factor->values[k] : 0));
    for (uint32_t i = 0; !channel->is_of_product && i < 3 * count; i++)
        numbers[i] = (float)((double)numbers[i] * material->emissive_strength);
}

/* Of values, tangents left out: those may be anything. */
static bool check_range(const struct gltf_channel *channel, enum gltf_interpolation interpolation,
                        uint32_t count, const float *numbers, struct error *err)
{
    const struct animated_member *member = animated_member(channel->member);
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < member->count; k++) {
            float value = numbers[(size_t)i * member->count + k];
            if (!(interpolation == GLTF_CUBICSPLINE && i % 3 != 1) &&
                !(value >= member->least && value <= member->most))
                return error_set(err, ERROR_INVALID_SCENE, "%s: value %u is %g, not in [%g, %g]",
                                 channel->pointer, i, (double)value, (double)member->least,
                                 (double)member->most);
        }
    return true;
}

static bool is_emission(const struct gltf_channel *channel)
{
    return channel->path == GLTF_MEMBER &&
           (int32_t)channel->member == animated_member_find(ANIMATED_MATERIAL, EMISSIVE_FACTOR);
}

/* Of values, tangents left out. A rotation without a direction would be drawn as none. */
static bool check_rotations(enum gltf_interpolation interpolation, uint32_t count,
                            const float *numbers, struct error *err)
{
    for (uint32_t i = 0; i < count; i++) {
        const float *q = numbers + 4 * (size_t)i;
        if (!(interpolation == GLTF_CUBICSPLINE && i % 3 != 1) && q[0] == 0 && q[1] == 0 &&
            q[2] == 0 && q[3] == 0)
            return error_set(err, ERROR_INVALID_SCENE, "its rotation %u has no direction", i);
    }
    return true;
}

/* Times and values of a channel, from `first` of SCENE_KEYS on. */
static bool write_keys(struct importer *importer, const struct gltf_animation_sampler *sampler,
                       const struct gltf_channel *from, const struct accessor *times,
                       const struct accessor *values, uint64_t first, struct error *err)
{
    uint64_t components = from->path == GLTF_MEMBER ? animated_member(from->member)->count
                                                    : (uint64_t)values->components;
    uint64_t count = times->count + (uint64_t)values->count * components;
    float *numbers = blob_writer_append(&importer->writer, SCENE_KEYS, count, err);
    if (!numbers)
        return false;
    if (first + count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "more than %u numbers in animations", UINT32_MAX);
    float *own = numbers + times->count;
    if (!read_times(times, numbers, err) || !read_values(values, own, err))
        return false;
    if (is_emission(from))
        multiply_emission(importer, from, values->count, own);
    if (from->path == GLTF_ROTATION)
        return check_rotations(sampler->interpolation, values->count, own, err);
    return from->path != GLTF_MEMBER ||
           check_range(from, sampler->interpolation, values->count, own, err);
}

static int32_t target_of(const struct gltf_channel *channel, const struct pose_map *map)
{
    switch (channel->path) {
    case GLTF_WEIGHTS:
        return map->deformed[channel->node];
    case GLTF_VISIBILITY:
        return map->blob_node[channel->node];
    case GLTF_MEMBER:
        return channel->record;
    default:
        return map->pose[channel->node];
    }
}

static bool write_channel(struct importer *importer, const struct gltf_animation *animation,
                          const struct gltf_channel *from, const struct pose_map *map,
                          struct error *err)
{
    static const uint32_t interpolations[] = {
        [GLTF_STEP] = SCENE_STEP, [GLTF_LINEAR] = SCENE_LINEAR, [GLTF_CUBICSPLINE] = SCENE_CUBIC};
    static const uint32_t paths[] = {[GLTF_TRANSLATION] = SCENE_TRANSLATION,
                                     [GLTF_ROTATION] = SCENE_ROTATION,
                                     [GLTF_SCALE] = SCENE_SCALE,
                                     [GLTF_WEIGHTS] = SCENE_WEIGHTS,
                                     [GLTF_VISIBILITY] = SCENE_VISIBILITY,
                                     [GLTF_MEMBER] = SCENE_MEMBER};
    struct accessor times, values;
    if (from->sampler < 0 || (size_t)from->sampler >= animation->sampler_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no sampler %d", from->sampler);
    const struct gltf_animation_sampler *sampler = &animation->samplers[from->sampler];
    const struct scene_deformed_node *nodes =
        importer->writer.sections[SCENE_DEFORMED_NODES].records;
    bool moves_weights = from->path == GLTF_WEIGHTS;
    int32_t target = target_of(from, map);
    if (!open_keys(importer, sampler, from, moves_weights ? nodes[target].weight_count : 0, &times,
                   &values, err))
        return false;
    uint64_t first = importer->writer.sections[SCENE_KEYS].count;
    if (!write_keys(importer, sampler, from, &times, &values, first, err))
        return false;
    const float *numbers = importer->writer.sections[SCENE_KEYS].records;
    float end_s = numbers[first + times.count - 1];
    struct scene_channel channel = {.path = paths[from->path],
                                    .interpolation = interpolations[sampler->interpolation],
                                    .key_count = times.count,
                                    .first_key = (uint32_t)first,
                                    .member = from->path == GLTF_MEMBER ? from->member : 0};
    for (; target >= 0; target = moves_weights ? map->next[target] : -1) {
        channel.target = (uint32_t)target;
        if (!append_channel(importer, &channel, end_s, err))
            return false;
    }
    return true;
}

/* Whether the channel moves what the scene shows. */
static bool is_heard(const struct gltf_channel *channel, const struct pose_map *map)
{
    if (channel->path == GLTF_MEMBER)
        return true;
    if (channel->node < 0 || channel->path == GLTF_OTHER_PATH)
        return false;
    return channel->path == GLTF_WEIGHTS ? map->deformed[channel->node] >= 0
                                         : map->blob_node[channel->node] >= 0;
}

static bool write_animation(struct importer *importer, const struct gltf_animation *animation,
                            const struct pose_map *map, struct error *err)
{
    struct scene_animation record = {.first_channel =
                                         (uint32_t)importer->writer.sections[SCENE_CHANNELS].count};
    if (!blob_writer_add_text(&importer->writer, animation->name ? animation->name : "",
                              &record.name, err))
        return false;
    struct scene_animation *to = blob_writer_append(&importer->writer, SCENE_ANIMATIONS, 1, err);
    if (!to)
        return false;
    *to = record;
    for (size_t c = 0; c < animation->channel_count; c++) {
        const struct gltf_channel *channel = &animation->channels[c];
        if (is_heard(channel, map) && !write_channel(importer, animation, channel, map, err))
            return error_wrap(err, "channel %zu", c);
    }
    return true;
}

static bool write_all(struct importer *importer, const struct gltf_animations *animations,
                      struct pose_map *map, struct error *err)
{
    if (!mark_targets(importer, animations, map, err) || !write_poses(importer, map, err) ||
        !find_deformed(importer, map, err))
        return false;
    for (size_t i = 0; i < animations->count; i++)
        if (!write_animation(importer, &animations->items[i], map, err))
            return error_wrap(err, "animation %zu", i);
    return true;
}

bool import_animations(struct importer *importer, struct error *err)
{
    struct gltf_animations animations;
    size_t count = importer->document->node_count;
    if (!gltf_animations_init(&animations, &importer->json, err))
        return false;
    if (!gltf_pointers_resolve(&animations, importer->document, err)) {
        gltf_animations_finish(&animations);
        return false;
    }
    struct pose_map map = {.blob_node = malloc((count + 1) * sizeof *map.blob_node),
                           .pose = malloc((count + 1) * sizeof *map.pose),
                           .deformed = malloc((count + 1) * sizeof *map.deformed)};
    bool is_done = map.blob_node && map.pose && map.deformed;
    if (!is_done)
        error_set(err, ERROR_NO_MEMORY, "animations of %zu nodes", count);
    for (size_t i = 0; is_done && i < count; i++)
        map.blob_node[i] = map.pose[i] = map.deformed[i] = -1;
    is_done = is_done && write_all(importer, &animations, &map, err);
    free(map.blob_node);
    free(map.pose);
    free(map.deformed);
    free(map.next);
    gltf_animations_finish(&animations);
    return is_done;
}
