// SPDX-License-Identifier: MIT
// Animations of assimp as those of glTF: keys in seconds from 0 on, linear between.
#include "renderer/import/assimp/moving.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace vitrail
{

namespace
{

constexpr double TICKS_DEFAULT = 25; // assimp's convention, where a file tells no rate
constexpr double TICKS_OF_3DS = 30;  // frames of 3D Studio
constexpr double SHEAR_MOST = 1e-4;  // of a matrix, against its largest number

// What a channel of weights moves. FBX: "name of the node*number of its geometry".
std::string morphed_name(const conversion_state &state, const aiMeshMorphAnim &channel)
{
    std::string name = channel.mName.C_Str();
    size_t star = name.rfind('*');
    bool is_numbered = state.input->format == SCENE_FORMAT_FBX && star != name.npos;
    return is_numbered ? name.substr(0, star) : name;
}

// Several of the file, which become one.
using animation_group = std::vector<const aiAnimation *>;

bool moves_any_of(const aiAnimation &animation, const std::set<std::string> &names)
{
    for (unsigned c = 0; c < animation.mNumChannels; c++)
        if (names.count(animation.mChannels[c]->mNodeName.C_Str()))
            return true;
    for (unsigned c = 0; c < animation.mNumMorphMeshChannels; c++)
        if (names.count(animation.mMorphMeshChannels[c]->mName.C_Str()))
            return true;
    return false;
}

void add_names(const aiAnimation &animation, std::set<std::string> *names)
{
    for (unsigned c = 0; c < animation.mNumChannels; c++)
        names->insert(animation.mChannels[c]->mNodeName.C_Str());
    for (unsigned c = 0; c < animation.mNumMorphMeshChannels; c++)
        names->insert(animation.mMorphMeshChannels[c]->mName.C_Str());
}

// COLLADA without clips has one course of time (1.4.1 specification, chapter 5, animation_clip);
// assimp makes several animations of it.
std::vector<animation_group> group_animations(const conversion_state &state, const aiScene &scene)
{
    std::string_view bytes(static_cast<const char *>(state.input->root->bytes),
                           state.input->root->size_bytes);
    bool is_one =
        state.input->format == SCENE_FORMAT_COLLADA && bytes.find("<animation_clip") == bytes.npos;
    std::vector<animation_group> groups;
    std::vector<std::set<std::string>> moved;
    for (unsigned a = 0; a < scene.mNumAnimations; a++) {
        const aiAnimation &animation = *scene.mAnimations[a];
        size_t into = 0;
        while (into < groups.size() && (!is_one || moves_any_of(animation, moved[into])))
            into++;
        if (into == groups.size()) {
            groups.emplace_back();
            moved.emplace_back();
        }
        groups[into].push_back(&animation);
        add_names(animation, &moved[into]);
    }
    return groups;
}

struct animation_writer {
    conversion_state &state;
    gltf_data &data;
    const node_table &nodes;
    const aiAnimation *animation; // the one that is written
    double first_s;               // of its keys, where that is below 0
    json_list samplers, channels;
    std::vector<float> last_times; // accessor of which is:
    int last_accessor;

    double seconds(double ticks, const char *of, unsigned key) const;
    int add_times(const std::vector<float> &times);
    void add_channel(int input, int output, size_t node, const char *path);
    template <class key_type>
    std::vector<float> times_of(const key_type *keys, unsigned count, const char *of) const;
    void add_vectors(const aiVectorKey *keys, unsigned count, const aiNodeAnim &of, size_t node,
                     const char *path);
    void add_rotations(const aiNodeAnim &of, size_t node);
    void add_node(const aiNodeAnim &channel);
    void add_weights(const aiMeshMorphAnim &channel);
    std::string write(const animation_group &group);
};

double animation_writer::seconds(double ticks, const char *of, unsigned key) const
{
    double rate = animation->mTicksPerSecond;
    if (!(rate > 0) || !std::isfinite(rate))
        rate = state.input->format == SCENE_FORMAT_3DS ? TICKS_OF_3DS : TICKS_DEFAULT;
    double time_s = ticks / rate;
    if (!std::isfinite(float(time_s)))
        refuse("animation '%.60s': the time of key %u of '%.60s' is %g", animation->mName.C_Str(),
               key, of, time_s);
    return time_s;
}

int animation_writer::add_times(const std::vector<float> &times)
{
    if (times == last_times)
        return last_accessor;
    last_times = times;
    last_accessor = data.add_accessor(FLOATS, "SCALAR", times.size(), times.data(),
                                      times.size() * sizeof(float),
                                      ",\"min\":" + json_numbers(&times.front(), 1) +
                                          ",\"max\":" + json_numbers(&times.back(), 1));
    return last_accessor;
}

void animation_writer::add_channel(int input, int output, size_t node, const char *path)
{
    size_t sampler = samplers.add(text("{\"input\":%d,\"output\":%d}", input, output));
    channels.add(
        text("{\"sampler\":%zu,\"target\":{\"node\":%zu,\"path\":\"%s\"}}", sampler, node, path));
}

template <class key_type>
std::vector<float> animation_writer::times_of(const key_type *keys, unsigned count,
                                              const char *of) const
{
    std::vector<float> times(count);
    for (unsigned k = 0; k < count; k++) {
        times[k] = float(seconds(keys[k].mTime, of, k) - first_s);
        if (k > 0 && times[k] < times[k - 1])
            refuse("animation '%.60s': key %u of '%.60s' is at %g s, the one before at %g s",
                   animation->mName.C_Str(), k, of, double(times[k]), double(times[k - 1]));
    }
    return times;
}

void animation_writer::add_vectors(const aiVectorKey *keys, unsigned count, const aiNodeAnim &of,
                                   size_t node, const char *path)
{
    if (count == 0)
        return;
    const char *name = of.mNodeName.C_Str();
    std::vector<float> values;
    for (unsigned k = 0; k < count; k++) {
        if (!is_finite(keys[k].mValue))
            refuse("animation '%.60s': the %s of key %u of '%.60s' is not finite",
                   animation->mName.C_Str(), path, k, name);
        for (unsigned i = 0; i < 3; i++)
            values.push_back(float(keys[k].mValue[i]));
    }
    int input = add_times(times_of(keys, count, name));
    add_channel(input, data.add_floats("VEC3", count, values), node, path);
}

void animation_writer::add_rotations(const aiNodeAnim &of, size_t node)
{
    if (of.mNumRotationKeys == 0)
        return;
    const char *name = of.mNodeName.C_Str();
    std::vector<float> values;
    for (unsigned k = 0; k < of.mNumRotationKeys; k++) {
        const aiQuaternion &q = of.mRotationKeys[k].mValue;
        double all[4] = {double(q.x), double(q.y), double(q.z), double(q.w)};
        double length =
            std::sqrt(all[0] * all[0] + all[1] * all[1] + all[2] * all[2] + all[3] * all[3]);
        if (!std::isfinite(length) || length < 1e-6)
            refuse("animation '%.60s': the rotation of key %u of '%.60s' is none",
                   animation->mName.C_Str(), k, name);
        for (double value : all)
            values.push_back(float(value / length));
    }
    int input = add_times(times_of(of.mRotationKeys, of.mNumRotationKeys, name));
    add_channel(input, data.add_floats("VEC4", of.mNumRotationKeys, values), node, "rotation");
}

void animation_writer::add_node(const aiNodeAnim &channel)
{
    const aiNode *node = nodes.find(channel.mNodeName.C_Str());
    if (!node)
        return; // which moved_nodes told
    size_t index = nodes.written.at(node);
    add_vectors(channel.mPositionKeys, channel.mNumPositionKeys, channel, index, "translation");
    add_rotations(channel, index);
    add_vectors(channel.mScalingKeys, channel.mNumScalingKeys, channel, index, "scale");
}

// One target's weights over time.
struct weight_track {
    std::vector<float> times, weights;
    float at(float time) const
    {
        if (times.empty())
            return 0;
        size_t after = size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin());
        if (after == 0 || after == times.size())
            return after == 0 ? weights.front() : weights.back();
        float span = times[after] - times[after - 1];
        float share = span > 0 ? (time - times[after - 1]) / span : 1;
        return weights[after - 1] + share * (weights[after] - weights[after - 1]);
    }
};

// A key of FBX tells those targets alone that have one at its time.
void animation_writer::add_weights(const aiMeshMorphAnim &channel)
{
    std::string name = morphed_name(state, channel);
    const aiNode *node = nodes.find(name.c_str());
    auto morphs = nodes.morphs.find(node);
    if (morphs == nodes.morphs.end() || channel.mNumKeys == 0) {
        state.warn(text("animation '%.60s': '%.60s' has no morph targets to move",
                        animation->mName.C_Str(), name.c_str()));
        return;
    }
    std::vector<float> times = times_of(channel.mKeys, channel.mNumKeys, name.c_str());
    std::map<unsigned, weight_track> tracks;
    for (unsigned k = 0; k < channel.mNumKeys; k++)
        for (unsigned i = 0; i < channel.mKeys[k].mNumValuesAndWeights; i++) {
            weight_track &track = tracks[channel.mKeys[k].mValues[i]];
            track.times.push_back(times[k]);
            track.weights.push_back(float(channel.mKeys[k].mWeights[i]));
            if (!std::isfinite(track.weights.back()))
                refuse("animation '%.60s': a weight of key %u of '%.60s' is not finite",
                       animation->mName.C_Str(), k, name.c_str());
        }
    int input = add_times(times);
    for (const node_table::morphed &morphed : morphs->second) {
        std::vector<float> values;
        for (float time : times)
            for (unsigned c : morphed.channels)
                values.push_back(tracks[c].at(time));
        int output = data.add_floats("SCALAR", values.size(), values);
        add_channel(input, output, morphed.node, "weights");
    }
}

std::string animation_writer::write(const animation_group &group)
{
    first_s = 0;
    for (const aiAnimation *part : group) {
        animation = part;
        for (unsigned c = 0; c < part->mNumChannels; c++) {
            const aiNodeAnim &channel = *part->mChannels[c];
            const char *name = channel.mNodeName.C_Str();
            for (unsigned k = 0; k < channel.mNumPositionKeys; k++)
                first_s = std::min(first_s, seconds(channel.mPositionKeys[k].mTime, name, k));
            for (unsigned k = 0; k < channel.mNumRotationKeys; k++)
                first_s = std::min(first_s, seconds(channel.mRotationKeys[k].mTime, name, k));
            for (unsigned k = 0; k < channel.mNumScalingKeys; k++)
                first_s = std::min(first_s, seconds(channel.mScalingKeys[k].mTime, name, k));
        }
        for (unsigned c = 0; c < part->mNumMorphMeshChannels; c++)
            for (unsigned k = 0; k < part->mMorphMeshChannels[c]->mNumKeys; k++)
                first_s = std::min(first_s, seconds(part->mMorphMeshChannels[c]->mKeys[k].mTime,
                                                    part->mMorphMeshChannels[c]->mName.C_Str(), k));
    }
    if (first_s < 0)
        state.warn(text("animation '%.80s' has keys before 0 s: it begins with the first of them",
                        group.front()->mName.C_Str()));
    for (const aiAnimation *part : group) {
        animation = part;
        for (unsigned c = 0; c < part->mNumChannels; c++)
            add_node(*part->mChannels[c]);
        for (unsigned c = 0; c < part->mNumMorphMeshChannels; c++)
            add_weights(*part->mMorphMeshChannels[c]);
    }
    if (channels.count == 0)
        return "";
    return "{\"name\":" + json_string(group.front()->mName.C_Str()) + samplers.member("samplers") +
           channels.member("channels") + "}";
}

} // namespace

node_table::node_table(const aiScene &scene)
{
    std::vector<const aiNode *> open = {scene.mRootNode};
    while (!open.empty()) {
        const aiNode *node = open.back();
        open.pop_back();
        by_name.emplace(node->mName.C_Str(), node);
        for (unsigned c = node->mNumChildren; c-- > 0;)
            open.push_back(node->mChildren[c]);
    }
}

const aiNode *node_table::find(const char *name) const
{
    auto known = by_name.find(name);
    return known == by_name.end() ? nullptr : known->second;
}

std::set<const aiNode *> moved_nodes(conversion_state &state, const aiScene &scene,
                                     const node_table &nodes)
{
    std::set<const aiNode *> moved;
    for (unsigned a = 0; a < scene.mNumAnimations; a++)
        for (unsigned c = 0; c < scene.mAnimations[a]->mNumChannels; c++) {
            const aiString &name = scene.mAnimations[a]->mChannels[c]->mNodeName;
            const aiNode *node = nodes.find(name.C_Str());
            if (node)
                moved.insert(node);
            else
                state.warn(text("animation '%.60s': there is no node '%.60s' to move",
                                scene.mAnimations[a]->mName.C_Str(), name.C_Str()));
        }
    return moved;
}

std::string write_rest(conversion_state &state, const aiNode &node)
{
    aiVector3D scale, place;
    aiQuaternion q;
    node.mTransformation.Decompose(scale, q, place);
    q.Normalize();
    float rotation[4] = {float(q.x), float(q.y), float(q.z), float(q.w)};
    bool is_rotation =
        std::all_of(rotation, rotation + 4, [](float x) { return std::isfinite(x); });
    if (!is_rotation) {
        q = aiQuaternion();
        const float none[4] = {0, 0, 0, 1};
        memcpy(rotation, none, sizeof rotation);
    }
    aiMatrix4x4 made(scale, q, place);
    double most = 0, off = 0;
    for (unsigned row = 0; row < 3; row++)
        for (unsigned column = 0; column < 3; column++) {
            double value = double(node.mTransformation[row][column]);
            most = std::max(most, std::fabs(value));
            off = std::max(off, std::fabs(value - double(made[row][column])));
        }
    if (off > SHEAR_MOST * most)
        state.warn(text("node '%.80s' is moved by an animation: the shear that it has at rest is "
                        "left out",
                        node.mName.C_Str()));
    const float places[3] = {float(place.x), float(place.y), float(place.z)};
    const float scales[3] = {float(scale.x), float(scale.y), float(scale.z)};
    return ",\"translation\":" + json_numbers(places, 3) +
           ",\"rotation\":" + json_numbers(rotation, 4) + ",\"scale\":" + json_numbers(scales, 3);
}

json_list write_animations(conversion_state &state, const aiScene &scene, gltf_data &data,
                           const node_table &nodes)
{
    json_list list;
    for (const animation_group &group : group_animations(state, scene)) {
        animation_writer writer = {state, data, nodes, nullptr, 0, {}, {}, {}, -1};
        std::string object = writer.write(group);
        if (!object.empty())
            list.add(object);
    }
    return list;
}

} // namespace vitrail
