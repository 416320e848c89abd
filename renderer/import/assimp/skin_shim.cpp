// SPDX-License-Identifier: MIT
// Bones of assimp as skins of glTF, its meshes of animation as morph targets.
#include "renderer/base/fnv.h"
#include "renderer/import/assimp/moving.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace vitrail
{

namespace
{

constexpr unsigned INFLUENCES_MAX = 8; // of a vertex: the two sets that are read
constexpr size_t JOINTS_MAX = 65536;   // of a skin: what JOINTS_n of glTF can name
constexpr float RESTS_AT_ANY = 1.0f;   // what assimp tells for 0 as well

// The strongest bones of each vertex.
class influence_list
{
  public:
    explicit influence_list(size_t vertex_count)
        : weights(vertex_count * INFLUENCES_MAX), joints(weights.size()), used(vertex_count)
    {
    }
    void add(unsigned vertex, size_t joint, float weight)
    {
        size_t first = size_t(vertex) * INFLUENCES_MAX, end = first + used[vertex];
        for (size_t i = first; i < end; i++)
            if (joints[i] == joint) { // named twice
                weights[i] += weight;
                return;
            }
        size_t at = end;
        if (used[vertex] == INFLUENCES_MAX) {
            at = size_t(
                std::min_element(weights.begin() + long(first), weights.begin() + long(end)) -
                weights.begin());
            left_out++;
            if (weights[at] >= weight)
                return;
        } else {
            used[vertex]++;
        }
        weights[at] = weight;
        joints[at] = uint16_t(joint);
    }
    // Four of each vertex: those from `first` on, or zeros.
    std::string write(gltf_data &data, unsigned set) const
    {
        std::vector<uint16_t> names;
        std::vector<float> shares;
        names.reserve(4 * used.size());
        shares.reserve(4 * used.size());
        for (size_t v = 0; v < used.size(); v++)
            for (size_t i = v * INFLUENCES_MAX + 4 * size_t(set), k = 0; k < 4; k++) {
                names.push_back(joints[i + k]);
                shares.push_back(weights[i + k]);
            }
        int joint = data.add_accessor(JOINTS, "VEC4", used.size(), names.data(),
                                      names.size() * sizeof names[0], "");
        int weight = data.add_floats("VEC4", used.size(), shares);
        return text(",\"JOINTS_%u\":%d,\"WEIGHTS_%u\":%d", set, joint, set, weight);
    }
    unsigned most() const
    {
        return used.empty() ? 0 : *std::max_element(used.begin(), used.end());
    }
    size_t left_out = 0;

  private:
    std::vector<float> weights;
    std::vector<uint16_t> joints;
    std::vector<uint8_t> used; // per vertex
};

void check_bone(const aiMesh &mesh, const aiBone &bone, const aiNode *node)
{
    if (!node)
        refuse("mesh '%.60s': there is no node '%.60s', which is one of its bones",
               mesh.mName.C_Str(), bone.mName.C_Str());
    if (!is_finite(bone.mOffsetMatrix))
        refuse("mesh '%.60s': the offset matrix of bone '%.60s' is not finite", mesh.mName.C_Str(),
               bone.mName.C_Str());
    for (unsigned w = 0; w < bone.mNumWeights; w++)
        if (bone.mWeights[w].mVertexId >= mesh.mNumVertices ||
            !std::isfinite(bone.mWeights[w].mWeight))
            refuse("mesh '%.60s': bone '%.60s' has the weight %g of vertex %u, of %u",
                   mesh.mName.C_Str(), bone.mName.C_Str(), double(bone.mWeights[w].mWeight),
                   bone.mWeights[w].mVertexId, mesh.mNumVertices);
}

} // namespace

int skin_table::take(const aiMesh &mesh, int into)
{
    skin taken = into >= 0 ? skins[size_t(into)] : skin();
    for (unsigned b = 0; b < mesh.mNumBones; b++) {
        const aiBone &bone = *mesh.mBones[b];
        const aiNode *node = nodes.find(bone.mName.C_Str());
        check_bone(mesh, bone, node);
        auto known = taken.index.find(node);
        if (known != taken.index.end()) {
            if (taken.joints[known->second].offset != bone.mOffsetMatrix)
                return -1;
            continue;
        }
        if (taken.joints.size() == JOINTS_MAX)
            refuse("mesh '%.80s': its skin has more than %zu bones", mesh.mName.C_Str(),
                   JOINTS_MAX);
        taken.index[node] = taken.joints.size();
        taken.joints.push_back({node, bone.mOffsetMatrix});
    }
    if (into < 0) {
        into = int(skins.size());
        skins.emplace_back();
    }
    skins[size_t(into)] = std::move(taken);
    return into;
}

std::string skin_table::influences(gltf_data &data, const aiMesh &mesh, int of) const
{
    const skin &own = skins[size_t(of)];
    influence_list list(mesh.mNumVertices);
    size_t negative = 0;
    for (unsigned b = 0; b < mesh.mNumBones; b++) {
        const aiBone &bone = *mesh.mBones[b];
        size_t place = own.index.at(nodes.find(bone.mName.C_Str()));
        for (unsigned w = 0; w < bone.mNumWeights; w++) {
            negative += bone.mWeights[w].mWeight < 0;
            if (bone.mWeights[w].mWeight > 0)
                list.add(bone.mWeights[w].mVertexId, place, bone.mWeights[w].mWeight);
        }
    }
    if (negative > 0)
        state.warn(text("mesh '%.80s': weights of bones that are negative become 0: %zu",
                        mesh.mName.C_Str(), negative));
    if (list.left_out > 0)
        state.warn(text("mesh '%.80s': vertices follow their %u strongest bones; weights that are "
                        "left out: %zu",
                        mesh.mName.C_Str(), INFLUENCES_MAX, list.left_out));
    std::string out = list.write(data, 0);
    return list.most() > 4 ? out + list.write(data, 1) : out;
}

json_list skin_table::write(gltf_data &data) const
{
    json_list list;
    for (const skin &own : skins) {
        std::vector<float> matrices(16 * own.joints.size());
        json_list joints;
        for (size_t i = 0; i < own.joints.size(); i++) {
            put_matrix(own.joints[i].offset, &matrices[16 * i]);
            joints.add(std::to_string(nodes.written.at(own.joints[i].node)));
        }
        int accessor = data.add_floats("MAT4", own.joints.size(), matrices);
        list.add(text("{\"inverseBindMatrices\":%d", accessor) + joints.member("joints") + "}");
    }
    return list;
}

void check_targets(const aiMesh &mesh, unsigned index)
{
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; t++) {
        const aiAnimMesh &target = *mesh.mAnimMeshes[t];
        if (target.mVertices && target.mNumVertices != mesh.mNumVertices)
            refuse("mesh %u '%.60s': morph target '%.60s' has %u vertices, the mesh has %u", index,
                   mesh.mName.C_Str(), target.mName.C_Str(), target.mNumVertices,
                   mesh.mNumVertices);
        for (unsigned v = 0; target.mVertices && v < target.mNumVertices; v++)
            if (!is_finite(target.mVertices[v]))
                refuse("mesh %u '%.60s': vertex %u of morph target '%.60s' is not finite", index,
                       mesh.mName.C_Str(), v, target.mName.C_Str());
    }
}

namespace
{

// Of all that moves each vertex.
std::vector<uint64_t> digest_motions(const aiMesh &mesh)
{
    std::vector<uint64_t> motions(mesh.mNumVertices, FNV_BEGIN);
    for (unsigned b = 0; b < mesh.mNumBones; b++)
        for (unsigned w = 0; w < mesh.mBones[b]->mNumWeights; w++) {
            const aiVertexWeight &weight = mesh.mBones[b]->mWeights[w];
            if (weight.mVertexId >= mesh.mNumVertices)
                continue;
            uint64_t &motion = motions[weight.mVertexId];
            motion = fnv_add(motion, &b, sizeof b);
            motion = fnv_add(motion, &weight.mWeight, sizeof weight.mWeight);
        }
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; t++)
        for (const aiVector3D *of : {mesh.mAnimMeshes[t]->mVertices, mesh.mAnimMeshes[t]->mNormals})
            for (unsigned v = 0; of && v < mesh.mNumVertices; v++)
                motions[v] = fnv_add(motions[v], &of[v], sizeof of[v]);
    return motions;
}

} // namespace

void keep_apart(aiMesh &mesh)
{
    if (mesh.mNumBones == 0 && mesh.mNumAnimMeshes == 0)
        return;
    std::vector<uint64_t> motions = digest_motions(mesh);
    delete[] mesh.mTangents;
    delete[] mesh.mBitangents;
    mesh.mTangents = mesh.mBitangents = nullptr;
    mesh.mTangents = new aiVector3D[mesh.mNumVertices];
    mesh.mBitangents = new aiVector3D[mesh.mNumVertices];
    for (unsigned v = 0; v < mesh.mNumVertices; v++) {
        mesh.mTangents[v] = aiVector3D(float(motions[v] & 0xFFFF), float(motions[v] >> 16 & 0xFFFF),
                                       float(motions[v] >> 32 & 0xFFFF));
        mesh.mBitangents[v] = aiVector3D(float(motions[v] >> 48), 0, 0);
    }
}

// FBX has shapes between none and the whole of a channel, which assimp lists one after another by
// the name of the channel: the last is the whole.
std::vector<morph_target> targets_of(conversion_state &state, const aiMesh &mesh)
{
    std::vector<morph_target> taken;
    for (unsigned t = 0; t < mesh.mNumAnimMeshes; t++) {
        const aiAnimMesh *target = mesh.mAnimMeshes[t];
        bool is_between = state.input->format == SCENE_FORMAT_FBX && t + 1 < mesh.mNumAnimMeshes &&
                          target->mName == mesh.mAnimMeshes[t + 1]->mName;
        if (is_between)
            state.warn(text("mesh '%.60s': the shapes between none and the whole of morph target "
                            "'%.60s' are left out",
                            mesh.mName.C_Str(), target->mName.C_Str()));
        else
            taken.push_back({t, unsigned(taken.size())});
    }
    auto name = [&](const morph_target &target) {
        return std::string_view(mesh.mAnimMeshes[target.index]->mName.C_Str());
    };
    std::stable_sort(taken.begin(), taken.end(),
                     [&](const auto &a, const auto &b) { return name(a) < name(b); });
    return taken;
}

namespace
{

// Each with that of the mesh subtracted, where the file does not have differences already.
int add_differences(gltf_data &data, const aiMesh &mesh, const aiVector3D *target,
                    const aiVector3D *base)
{
    std::vector<float> values;
    values.reserve(3 * size_t(mesh.mNumVertices));
    bool is_relative = mesh.mMethod == aiMorphingMethod_MORPH_RELATIVE;
    for (unsigned v = 0; v < mesh.mNumVertices; v++)
        for (unsigned i = 0; i < 3; i++) {
            float value = float(is_relative ? target[v][i] : target[v][i] - base[v][i]);
            values.push_back(std::isfinite(value) ? value : 0);
        }
    return data.add_places(values);
}

} // namespace

std::string write_targets(conversion_state &state, gltf_data &data, const aiMesh &mesh)
{
    json_list list;
    bool has_normals = mesh.mNormals && mesh.mMethod != aiMorphingMethod_MORPH_RELATIVE;
    for (const morph_target &taken : targets_of(state, mesh)) {
        const aiAnimMesh &target = *mesh.mAnimMeshes[taken.index];
        std::string object;
        if (target.mVertices)
            object += text(",\"POSITION\":%d",
                           add_differences(data, mesh, target.mVertices, mesh.mVertices));
        if (target.mNormals && has_normals)
            object +=
                text(",\"NORMAL\":%d", add_differences(data, mesh, target.mNormals, mesh.mNormals));
        list.add("{" + (object.empty() ? object : object.substr(1)) + "}");
    }
    return list.member("targets");
}

// Readers of both formats that have targets tell a weight of 1 for those that weigh nothing.
std::vector<float> target_weights(conversion_state &state, const aiMesh &mesh)
{
    std::vector<float> weights;
    for (const morph_target &taken : targets_of(state, mesh)) {
        const aiAnimMesh &target = *mesh.mAnimMeshes[taken.index];
        float weight = target.mWeight;
        if (!std::isfinite(weight))
            refuse("mesh '%.60s': the weight of morph target '%.60s' is %g", mesh.mName.C_Str(),
                   target.mName.C_Str(), double(weight));
        if (weight == RESTS_AT_ANY) {
            state.warn(
                text("mesh '%.80s': assimp does not tell the weights of all morph targets at "
                     "rest; 0 is assumed",
                     mesh.mName.C_Str()));
            weight = 0;
        }
        weights.push_back(weight);
    }
    return weights;
}

} // namespace vitrail
