// SPDX-License-Identifier: MIT
// Writes what assimp read as glTF 2.0.
#include "renderer/import/assimp/conversion.h"
#include "renderer/import/assimp/moving.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <tuple>
#include <unordered_map>

#include <assimp/scene.h>

namespace vitrail
{

namespace
{

enum { MODE_POINTS = 0, MODE_LINES = 1, MODE_TRIANGLES = 4 };
constexpr float OPAQUE = 0.9999f;

class gltf_writer
{
  public:
    gltf_writer(conversion_state &conversion, const aiScene &from, const file_units &by)
        : state(conversion), scene(from), units(by), table(from), skins(conversion, table),
          moved(moved_nodes(conversion, from, table))
    {
    }
    gltf_text write();

  private:
    int add_vectors(const aiVector3D *from, size_t count, int components);
    int add_positions(const aiMesh &mesh);
    int add_colors(const aiMesh &mesh);
    int add_indices(const aiMesh &mesh, unsigned corners);
    int add_material(unsigned index, const surface_use &use);
    std::string primitive_of(const aiMesh &mesh, int skin);
    std::string write_mesh(const aiNode &node, const mesh_group &group);
    const std::vector<mesh_group> &group_meshes(const aiNode &node);
    std::string add_mesh(const aiNode &node, const mesh_group &group);
    std::string add_meshes(const aiNode &node, std::string *below);
    void note_morphed(const aiNode &node, size_t index, const mesh_group &group);
    size_t add_node(const aiNode &node, const std::string &children);
    size_t add_nodes();
    std::string root_matrix() const;
    void add_placed();

    conversion_state &state;
    const aiScene &scene;
    const file_units &units;
    node_table table;
    skin_table skins;
    std::set<const aiNode *> moved; // by animations
    gltf_data data;
    json_list meshes, nodes, materials, lights, cameras;
    std::map<std::string, std::string> placed; // by name of node: indices of lights and cameras
    texture_table textures;
    std::map<std::pair<unsigned, int>, std::string> primitives; // by mesh of assimp and skin
    std::map<std::vector<unsigned>, std::vector<mesh_group>> groups_of; // by the meshes of a node
    std::map<std::vector<unsigned>, int> mesh_of;                       // by those of a group
    std::map<std::pair<unsigned, surface_use>, int> material_of;
};

int gltf_writer::add_vectors(const aiVector3D *from, size_t count, int components)
{
    std::vector<float> values;
    values.reserve(count * size_t(components));
    for (size_t i = 0; i < count; i++) {
        values.push_back(float(from[i].x));
        // texture coordinates begin at the bottom in assimp, at the top in glTF
        values.push_back(components == 2 ? 1 - float(from[i].y) : float(from[i].y));
        if (components == 3)
            values.push_back(float(from[i].z));
    }
    return data.add_floats(components == 2 ? "VEC2" : "VEC3", count, values);
}

int gltf_writer::add_positions(const aiMesh &mesh)
{
    std::vector<float> values;
    values.reserve(3 * size_t(mesh.mNumVertices));
    for (unsigned v = 0; v < mesh.mNumVertices; v++)
        for (unsigned i = 0; i < 3; i++)
            values.push_back(float(mesh.mVertices[v][i]));
    return data.add_places(values);
}

// IEC 61966-2-1.
float linear_of(float srgb)
{
    return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
}

// Colours of vertices are those of pictures in every format that has them: sRGB.
int gltf_writer::add_colors(const aiMesh &mesh)
{
    std::vector<float> values;
    values.reserve(4 * size_t(mesh.mNumVertices));
    for (unsigned v = 0; v < mesh.mNumVertices; v++) {
        const aiColor4D &color = mesh.mColors[0][v];
        const float channels[4] = {color.r, color.g, color.b, color.a};
        for (int i = 0; i < 4; i++) {
            if (!std::isfinite(channels[i]))
                refuse("mesh '%.80s': the colour of vertex %u is (%g, %g, %g, %g)",
                       mesh.mName.C_Str(), v, double(channels[0]), double(channels[1]),
                       double(channels[2]), double(channels[3]));
            values.push_back(i < 3 ? linear_of(channels[i]) : channels[i]);
        }
    }
    return data.add_floats("VEC4", mesh.mNumVertices, values);
}

int gltf_writer::add_indices(const aiMesh &mesh, unsigned corners)
{
    std::vector<uint32_t> values;
    values.reserve(size_t(mesh.mNumFaces) * corners);
    for (unsigned f = 0; f < mesh.mNumFaces; f++)
        if (mesh.mFaces[f].mNumIndices == corners)
            values.insert(values.end(), mesh.mFaces[f].mIndices, mesh.mFaces[f].mIndices + corners);
    return data.add_accessor(INDICES, "SCALAR", values.size(), values.data(),
                             values.size() * sizeof(uint32_t), "");
}

bool has_alpha(const aiMesh &mesh)
{
    for (unsigned v = 0; mesh.mColors[0] && v < mesh.mNumVertices; v++)
        if (mesh.mColors[0][v].a < OPAQUE)
            return true;
    return false;
}

struct position_hash {
    size_t operator()(const std::array<float, 3> &at) const
    {
        size_t hash = 0;
        for (float value : at)
            hash = hash * 1000003 + std::hash<float>()(value);
        return hash;
    }
};

// One number for the vertices of one place.
std::vector<uint32_t> places_of(const aiMesh &mesh)
{
    std::unordered_map<std::array<float, 3>, uint32_t, position_hash> known;
    std::vector<uint32_t> places(mesh.mNumVertices);
    for (unsigned v = 0; v < mesh.mNumVertices; v++) {
        const aiVector3D &at = mesh.mVertices[v];
        std::array<float, 3> key = {float(at.x) + 0.0f, float(at.y) + 0.0f, float(at.z) + 0.0f};
        places[v] = known.emplace(key, uint32_t(known.size())).first->second;
    }
    return places;
}

// Each edge is passed once in either direction, and the enclosed volume is positive (the divergence
// theorem over the triangles).
bool is_closed_body(const aiMesh &mesh)
{
    std::vector<uint32_t> places = places_of(mesh);
    std::unordered_map<uint64_t, int> edges; // from the lower to the higher place: ups less downs
    double volume = 0;
    for (unsigned f = 0; f < mesh.mNumFaces; f++) {
        const aiFace &face = mesh.mFaces[f];
        if (face.mNumIndices != 3)
            return false;
        const aiVector3D &a = mesh.mVertices[face.mIndices[0]],
                         &b = mesh.mVertices[face.mIndices[1]],
                         &c = mesh.mVertices[face.mIndices[2]];
        volume += double(a * (b ^ c));
        for (unsigned i = 0; i < 3; i++) {
            uint64_t from = places[face.mIndices[i]], to = places[face.mIndices[(i + 1) % 3]];
            if (from != to)
                edges[std::min(from, to) << 32 | std::max(from, to)] += from < to ? 1 : -1;
        }
    }
    return volume > 0 && std::all_of(edges.begin(), edges.end(),
                                     [](const auto &edge) { return edge.second == 0; });
}

int gltf_writer::add_material(unsigned index, const surface_use &use)
{
    auto known = material_of.find({index, use});
    if (known != material_of.end())
        return known->second;
    int added =
        int(materials.add(write_material(state, scene, *scene.mMaterials[index], use, textures)));
    material_of[{index, use}] = added;
    return added;
}

std::string gltf_writer::primitive_of(const aiMesh &mesh, int skin)
{
    unsigned corners = mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE ? 3
                       : mesh.mPrimitiveTypes & aiPrimitiveType_LINE   ? 2
                                                                       : 1;
    int mode = corners == 3 ? MODE_TRIANGLES : corners == 2 ? MODE_LINES : MODE_POINTS;
    std::string attributes = text("\"POSITION\":%d", add_positions(mesh));
    if (mesh.mNormals && corners == 3)
        attributes += text(",\"NORMAL\":%d", add_vectors(mesh.mNormals, mesh.mNumVertices, 3));
    for (unsigned set = 0; set < 2; set++)
        if (mesh.mTextureCoords[set])
            attributes += text(",\"TEXCOORD_%u\":%d", set,
                               add_vectors(mesh.mTextureCoords[set], mesh.mNumVertices, 2));
    if (mesh.mColors[0])
        attributes += text(",\"COLOR_0\":%d", add_colors(mesh));
    if (skin >= 0)
        attributes += skins.influences(data, mesh, skin);
    surface_use use = {mesh.mColors[0] != nullptr, has_alpha(mesh),
                       corners == 3 && is_closed_body(mesh)};
    std::string primitive = text("{\"mode\":%d,\"indices\":%d", mode, add_indices(mesh, corners));
    if (mesh.mMaterialIndex < scene.mNumMaterials)
        primitive += text(",\"material\":%d", add_material(mesh.mMaterialIndex, use));
    return primitive + ",\"attributes\":{" + attributes + "}" + write_targets(state, data, mesh) +
           "}";
}

// Those that have faces. Mostly all meshes of a node are one of glTF.
const std::vector<mesh_group> &gltf_writer::group_meshes(const aiNode &node)
{
    std::vector<unsigned> key(node.mMeshes, node.mMeshes + node.mNumMeshes);
    auto known = groups_of.find(key);
    if (known != groups_of.end())
        return known->second;
    std::vector<mesh_group> groups;
    for (unsigned index : key) {
        if (index >= scene.mNumMeshes || scene.mMeshes[index]->mNumFaces == 0)
            continue;
        const aiMesh &mesh = *scene.mMeshes[index];
        mesh_group *into = nullptr;
        std::vector<unsigned> channels;
        for (const morph_target &target : targets_of(state, mesh))
            channels.push_back(target.channel);
        for (mesh_group &group : groups)
            if (!into && group.channels == channels && (group.skin >= 0) == (mesh.mNumBones > 0) &&
                (group.skin < 0 || skins.take(mesh, group.skin) >= 0))
                into = &group;
        if (into) {
            into->meshes.push_back(index);
            continue;
        }
        groups.push_back({{index}, channels, mesh.mNumBones > 0 ? skins.take(mesh, -1) : -1});
    }
    return groups_of[key] = groups;
}

std::string gltf_writer::write_mesh(const aiNode &node, const mesh_group &group)
{
    json_list list;
    for (unsigned index : group.meshes) {
        auto key = std::make_pair(index, group.skin);
        if (primitives.find(key) == primitives.end())
            primitives[key] = primitive_of(*scene.mMeshes[index], group.skin);
        list.add(primitives[key]);
    }
    const aiMesh &first = *scene.mMeshes[group.meshes[0]];
    std::string object =
        "{\"name\":" + json_string((first.mName.length ? first.mName : node.mName).C_Str()) +
        list.member("primitives");
    std::vector<float> weights = target_weights(state, first);
    if (!weights.empty())
        object += ",\"weights\":" + json_numbers(weights.data(), weights.size());
    return object + "}";
}

// The members by which a node of glTF shows the group. Nodes that have the same meshes share one.
std::string gltf_writer::add_mesh(const aiNode &node, const mesh_group &group)
{
    std::vector<unsigned> key = group.meshes;
    key.push_back(unsigned(group.skin));
    auto known = mesh_of.find(key);
    if (known == mesh_of.end())
        known = mesh_of.emplace(key, int(meshes.add(write_mesh(node, group)))).first;
    std::string members = text(",\"mesh\":%d", known->second);
    return group.skin < 0 ? members : members + text(",\"skin\":%d", group.skin);
}

void gltf_writer::note_morphed(const aiNode &node, size_t index, const mesh_group &group)
{
    if (!group.channels.empty())
        table.morphs[&node].push_back({index, group.channels});
}

// The members of the first group; each other one becomes a node below.
std::string gltf_writer::add_meshes(const aiNode &node, std::string *below)
{
    const std::vector<mesh_group> &groups = group_meshes(node);
    for (size_t i = 1; i < groups.size(); i++) {
        const aiString &name = scene.mMeshes[groups[i].meshes[0]]->mName;
        std::string object = "{\"name\":" + json_string((name.length ? name : node.mName).C_Str());
        size_t index = nodes.add(object + add_mesh(node, groups[i]) + "}");
        note_morphed(node, index, groups[i]);
        *below += (below->empty() ? "" : ",") + std::to_string(index);
    }
    return groups.empty() ? "" : add_mesh(node, groups[0]);
}

std::string matrix_text(const aiMatrix4x4 &matrix)
{
    float values[16];
    put_matrix(matrix, values);
    return ",\"matrix\":" + json_numbers(values, 16);
}

// children: a JSON list without brackets.
size_t gltf_writer::add_node(const aiNode &node, const std::string &children)
{
    const aiMatrix4x4 &matrix = node.mTransformation;
    if (!is_finite(matrix))
        refuse("node '%.80s': its transform is not finite", node.mName.C_Str());
    std::string object = "{\"name\":" + json_string(node.mName.C_Str());
    if (moved.count(&node))
        object += write_rest(state, node);
    else if (!matrix.IsIdentity())
        object += matrix_text(matrix);
    std::string below = children;
    object += add_meshes(node, &below);
    auto own = placed.find(node.mName.C_Str());
    if (own != placed.end() && !own->second.empty()) {
        below += (below.empty() ? "" : ",") + own->second;
        own->second.clear(); // a second node of that name has none
    }
    if (!below.empty())
        object += ",\"children\":[" + below + "]";
    size_t index = nodes.add(object + "}");
    table.written[&node] = index;
    const std::vector<mesh_group> &groups = group_meshes(node);
    if (!groups.empty())
        note_morphed(node, index, groups[0]);
    return index;
}

// Children first, without recursion: hierarchies of files can be deep.
size_t gltf_writer::add_nodes()
{
    struct level {
        const aiNode *node;
        unsigned next;
        std::string children;
    };
    std::vector<level> stack = {{scene.mRootNode, 0, ""}};
    for (;;) {
        level &top = stack.back();
        if (top.next < top.node->mNumChildren) {
            stack.push_back({top.node->mChildren[top.next++], 0, ""});
            continue;
        }
        size_t added = add_node(*top.node, top.children);
        stack.pop_back();
        if (stack.empty())
            return added;
        std::string &siblings = stack.back().children;
        siblings += (siblings.empty() ? "" : ",") + std::to_string(added);
    }
}

// What turns that axis of the file into +Y; turns, so that no body is mirrored.
aiMatrix4x4 upright(char axis)
{
    if (axis == 'z')
        return aiMatrix4x4(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1);
    if (axis == 'x')
        return aiMatrix4x4(0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
    return aiMatrix4x4();
}

// From the units and axes of the file to metres and +Y up; "" where they are that.
std::string gltf_writer::root_matrix() const
{
    aiMatrix4x4 applied = upright(units.applied_up), scale;
    float factor = float(units.origin.unit_m / units.applied_unit_m);
    aiMatrix4x4 matrix = aiMatrix4x4::Scaling(aiVector3D(factor), scale) *
                         upright(units.origin.up) * applied.Transpose();
    return matrix.IsIdentity() ? "" : matrix_text(matrix);
}

// Each as a node of its own, listed by the name of the one that it belongs to.
void gltf_writer::add_placed()
{
    for (unsigned i = 0; i < scene.mNumLights + scene.mNumCameras; i++) {
        bool is_light = i < scene.mNumLights;
        unsigned index = is_light ? i : i - scene.mNumLights;
        const aiString &name =
            is_light ? scene.mLights[index]->mName : scene.mCameras[index]->mName;
        std::string placing, object;
        if (is_light)
            object = write_light(state, *scene.mLights[index], units.origin.unit_m, &placing);
        else
            object = write_camera(state, *scene.mCameras[index], units.origin.unit_m, &placing);
        if (object.empty())
            continue;
        size_t added = (is_light ? lights : cameras).add(object);
        std::string node =
            is_light ? text(",\"extensions\":{\"KHR_lights_punctual\":{\"light\":%zu}}", added)
                     : text(",\"camera\":%zu", added);
        std::string whole = "{\"name\":" + json_string(name.C_Str());
        whole += "," + placing;
        whole += node + "}";
        std::string &own = placed[name.C_Str()];
        own += (own.empty() ? "" : ",") + std::to_string(nodes.add(whole));
    }
}

gltf_text gltf_writer::write()
{
    if (!scene.mRootNode)
        refuse("it has no nodes");
    add_placed();
    size_t root = add_nodes();
    std::string matrix = root_matrix();
    if (!matrix.empty())
        root = nodes.add(text("{\"name\":\"unit and axis of the file\",\"children\":[%zu]", root) +
                         matrix + "}");
    json_list skin_list = skins.write(data);
    json_list animations = write_animations(state, scene, data, table);
    size_t first_image_view = data.views.count;
    for (const auto &image : textures.embedded)
        data.add_view(image.first, image.second);
    json_list images, texture_list;
    for (std::string image : textures.images) {
        size_t at = image.find("\"bufferView\":");
        if (at != image.npos) { // counted from the first of them until now
            size_t own = std::stoul(image.substr(at + 13));
            image = image.substr(0, at + 13) + std::to_string(first_image_view + own) + "}";
        }
        images.add(image);
    }
    for (const std::string &texture : textures.textures)
        texture_list.add(texture);
    static const char used[] =
        ",\"extensionsUsed\":[\"KHR_materials_transmission\",\"KHR_materials_ior\","
        "\"KHR_materials_emissive_strength\",\"KHR_lights_punctual\"]";
    std::string buffers =
        data.buffer.empty() ? "" : text(",\"buffers\":[{\"byteLength\":%zu}]", data.buffer.size());
    std::string light_list = lights.member("lights");
    if (!light_list.empty())
        light_list = ",\"extensions\":{\"KHR_lights_punctual\":{" + light_list.substr(1) + "}}";
    gltf_text out;
    out.json = "{\"asset\":{\"version\":\"2.0\"}" + std::string(used) +
               text(",\"scene\":0,\"scenes\":[{\"nodes\":[%zu]}]", root) + buffers +
               data.views.member("bufferViews") + data.accessors.member("accessors") +
               materials.member("materials") + images.member("images") +
               texture_list.member("textures") + meshes.member("meshes") +
               cameras.member("cameras") + nodes.member("nodes") + skin_list.member("skins") +
               animations.member("animations") + light_list + "}";
    out.buffer = std::move(data.buffer);
    return out;
}

} // namespace

gltf_text write_gltf(conversion_state &state, const aiScene &scene, const file_units &units)
{
    return gltf_writer(state, scene, units).write();
}

} // namespace vitrail
