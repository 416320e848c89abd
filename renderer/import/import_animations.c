/* SPDX-License-Identifier: MIT */
/* Animations of nodes and of the weights of morph targets: channels become keys of poses and of
 * deformed nodes. What no channel of ours can say (targets of extensions, weights of nodes without
 * morph targets) is counted and told. */
#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_animations.h"
#include "renderer/import/importer.h"

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
            if (channel->path <= GLTF_WEIGHTS && channel->node >= 0 &&
                (size_t)channel->node >= count)
                return error_set(err, ERROR_INVALID_SCENE,
                                 "animation %zu, channel %zu: there is no node %d", a, c,
                                 channel->node);
            if (!is_of_nodes(channel)) {
                importer->unmoved_channels +=
                    channel->path > GLTF_WEIGHTS ||
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

/* weights: of the node that the channel moves, for GLTF_WEIGHTS. */
static bool open_keys(const struct importer *importer, const struct gltf_animation_sampler *sampler,
                      enum gltf_path path, uint32_t weights, struct accessor *times,
                      struct accessor *values, struct error *err)
{
    int components = path == GLTF_ROTATION ? 4 : path == GLTF_WEIGHTS ? 1 : 3;
    uint64_t per_key = sampler->interpolation == GLTF_CUBICSPLINE ? 3 : 1;
    if (!accessor_open(&importer->source, sampler->input, times, err) ||
        !accessor_open(&importer->source, sampler->output, values, err))
        return false;
    if (times->components != 1 || times->component != GLTF_FLOAT)
        return error_set(err, ERROR_INVALID_SCENE, "its times are no float scalars");
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

static bool write_channel(struct importer *importer, const struct gltf_animation *animation,
                          const struct gltf_channel *from, const struct pose_map *map,
                          struct error *err)
{
    static const uint32_t interpolations[] = {
        [GLTF_STEP] = SCENE_STEP, [GLTF_LINEAR] = SCENE_LINEAR, [GLTF_CUBICSPLINE] = SCENE_CUBIC};
    struct accessor times, values;
    if (from->sampler < 0 || (size_t)from->sampler >= animation->sampler_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no sampler %d", from->sampler);
    const struct gltf_animation_sampler *sampler = &animation->samplers[from->sampler];
    const struct scene_deformed_node *nodes =
        importer->writer.sections[SCENE_DEFORMED_NODES].records;
    bool moves_weights = from->path == GLTF_WEIGHTS;
    int32_t target = moves_weights ? map->deformed[from->node] : map->pose[from->node];
    if (!open_keys(importer, sampler, from->path, moves_weights ? nodes[target].weight_count : 0,
                   &times, &values, err))
        return false;
    uint64_t first = importer->writer.sections[SCENE_KEYS].count;
    uint64_t count = times.count + (uint64_t)values.count * (uint64_t)values.components;
    float *numbers = blob_writer_append(&importer->writer, SCENE_KEYS, count, err);
    if (!numbers)
        return false;
    if (first + count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "more than %u numbers in animations", UINT32_MAX);
    if (!read_times(&times, numbers, err) || !read_values(&values, numbers + times.count, err))
        return false;
    float end_s = numbers[times.count - 1];
    struct scene_channel channel = {.path = from->path, /* same order */
                                    .interpolation = interpolations[sampler->interpolation],
                                    .key_count = times.count,
                                    .first_key = (uint32_t)first};
    for (; target >= 0; target = moves_weights ? map->next[target] : -1) {
        channel.pose = (uint32_t)target;
        if (!append_channel(importer, &channel, end_s, err))
            return false;
    }
    return true;
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
        bool moves = is_of_nodes(channel) ? map->blob_node[channel->node] >= 0
                                          : channel->path == GLTF_WEIGHTS && channel->node >= 0 &&
                                                map->deformed[channel->node] >= 0;
        if (moves && !write_channel(importer, animation, channel, map, err))
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
