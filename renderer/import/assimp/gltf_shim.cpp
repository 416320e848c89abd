// SPDX-License-Identifier: MIT
// Writes what assimp read as glTF 2.0.
#include "renderer/import/assimp/conversion.h"

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

enum { FLOATS = 5126, INDICES = 5125 }; // component types of glTF
enum { MODE_POINTS = 0, MODE_LINES = 1, MODE_TRIANGLES = 4 };
constexpr size_t ALIGNMENT = 4;
constexpr float OPAQUE = 0.9999f;

// A list of JSON values.
class json_list
{
  public:
    size_t add(const std::string &value)
    {
        if (count > 0)
            text += ',';
        text += value;
        return count++;
    }
    // The member with its comma in front; nothing for an empty list.
    std::string member(const char *name) const
    {
        return count == 0 ? "" : std::string(",\"") + name + "\":[" + text + "]";
    }
    size_t count = 0;

  private:
    std::string text;
};

class gltf_writer
{
  public:
    gltf_writer(conversion_state &conversion, const aiScene &from, const told_units &by)
        : state(conversion), scene(from), units(by)
    {
    }
    gltf_text write();

  private:
    int add_view(const void *bytes, size_t size_bytes);
    int add_accessor(int component, const char *type, size_t count, const void *bytes,
                     size_t size_bytes, const std::string &rest);
    int add_vectors(const aiVector3D *from, size_t count, int components);
    int add_positions(const aiMesh &mesh);
    int add_colors(const aiMesh &mesh);
    int add_indices(const aiMesh &mesh, unsigned corners);
    int add_material(unsigned index, const surface_use &use);
    std::string primitive_of(const aiMesh &mesh);
    int add_mesh(const aiNode &node);
    size_t add_node(const aiNode &node, const std::string &children);
    size_t add_nodes();
    std::string root_matrix() const;
    void warn_of_left_out();
    void add_placed();

    conversion_state &state;
    const aiScene &scene;
    const told_units &units;
    gltf_text out;
    json_list views, accessors, meshes, nodes, materials, lights, cameras;
    std::map<std::string, std::string> placed; // by name of node: indices of lights and cameras
    texture_table textures;
    std::map<unsigned, std::string> primitives;   // by mesh of assimp
    std::map<std::vector<unsigned>, int> mesh_of; // by the meshes of a node
    std::map<std::pair<unsigned, surface_use>, int> material_of;
};

int gltf_writer::add_view(const void *bytes, size_t size_bytes)
{
    out.buffer.resize((out.buffer.size() + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT);
    size_t offset = out.buffer.size();
    const unsigned char *from = static_cast<const unsigned char *>(bytes);
    out.buffer.insert(out.buffer.end(), from, from + size_bytes);
    return int(views.add(
        text("{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", offset, size_bytes)));
}

int gltf_writer::add_accessor(int component, const char *type, size_t count, const void *bytes,
                              size_t size_bytes, const std::string &rest)
{
    int view = add_view(bytes, size_bytes);
    return int(accessors.add(text("{\"bufferView\":%d,\"componentType\":%d,\"count\":%zu,"
                                  "\"type\":\"%s\"",
                                  view, component, count, type) +
                             rest + "}"));
}

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
    return add_accessor(FLOATS, components == 2 ? "VEC2" : "VEC3", count, values.data(),
                        values.size() * sizeof(float), "");
}

int gltf_writer::add_positions(const aiMesh &mesh)
{
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    std::vector<float> values;
    values.reserve(3 * size_t(mesh.mNumVertices));
    for (unsigned v = 0; v < mesh.mNumVertices; v++)
        for (unsigned i = 0; i < 3; i++) {
            float value = float(mesh.mVertices[v][i]);
            low[i] = v == 0 ? value : std::min(low[i], value);
            high[i] = v == 0 ? value : std::max(high[i], value);
            values.push_back(value);
        }
    return add_accessor(FLOATS, "VEC3", mesh.mNumVertices, values.data(),
                        values.size() * sizeof(float),
                        ",\"min\":" + json_numbers(low, 3) + ",\"max\":" + json_numbers(high, 3));
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
    return add_accessor(FLOATS, "VEC4", mesh.mNumVertices, values.data(),
                        values.size() * sizeof(float), "");
}

int gltf_writer::add_indices(const aiMesh &mesh, unsigned corners)
{
    std::vector<uint32_t> values;
    values.reserve(size_t(mesh.mNumFaces) * corners);
    for (unsigned f = 0; f < mesh.mNumFaces; f++)
        if (mesh.mFaces[f].mNumIndices == corners)
            values.insert(values.end(), mesh.mFaces[f].mIndices, mesh.mFaces[f].mIndices + corners);
    return add_accessor(INDICES, "SCALAR", values.size(), values.data(),
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

std::string gltf_writer::primitive_of(const aiMesh &mesh)
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
    surface_use use = {mesh.mColors[0] != nullptr, has_alpha(mesh),
                       corners == 3 && is_closed_body(mesh)};
    std::string primitive = text("{\"mode\":%d,\"indices\":%d", mode, add_indices(mesh, corners));
    if (mesh.mMaterialIndex < scene.mNumMaterials)
        primitive += text(",\"material\":%d", add_material(mesh.mMaterialIndex, use));
    return primitive + ",\"attributes\":{" + attributes + "}}";
}

// The meshes of a node are one of glTF, which nodes that have the same share. -1: none.
int gltf_writer::add_mesh(const aiNode &node)
{
    if (node.mNumMeshes == 0)
        return -1;
    std::vector<unsigned> key;
    for (unsigned i = 0; i < node.mNumMeshes; i++)
        key.push_back(node.mMeshes[i]);
    auto known = mesh_of.find(key);
    if (known != mesh_of.end())
        return known->second;
    json_list list;
    for (unsigned index : key) {
        if (index >= scene.mNumMeshes || scene.mMeshes[index]->mNumFaces == 0)
            continue;
        if (primitives.find(index) == primitives.end())
            primitives[index] = primitive_of(*scene.mMeshes[index]);
        list.add(primitives[index]);
    }
    int added = -1;
    if (list.count > 0) {
        const aiString &own = scene.mMeshes[key[0]]->mName;
        added = int(meshes.add("{\"name\":" + json_string((own.length ? own : node.mName).C_Str()) +
                               list.member("primitives") + "}"));
    }
    mesh_of[key] = added;
    return added;
}

bool is_finite(const aiMatrix4x4 &matrix)
{
    for (unsigned row = 0; row < 4; row++)
        for (unsigned column = 0; column < 4; column++)
            if (!std::isfinite(matrix[row][column]))
                return false;
    return true;
}

std::string matrix_text(const aiMatrix4x4 &matrix)
{
    float values[16];
    for (unsigned column = 0; column < 4; column++)
        for (unsigned row = 0; row < 4; row++)
            values[4 * column + row] = float(matrix[row][column]);
    return ",\"matrix\":" + json_numbers(values, 16);
}

// children: a JSON list without brackets.
size_t gltf_writer::add_node(const aiNode &node, const std::string &children)
{
    const aiMatrix4x4 &matrix = node.mTransformation;
    if (!is_finite(matrix))
        refuse("node '%.80s': its transform is not finite", node.mName.C_Str());
    std::string object = "{\"name\":" + json_string(node.mName.C_Str());
    if (!matrix.IsIdentity())
        object += matrix_text(matrix);
    int mesh = add_mesh(node);
    if (mesh >= 0)
        object += text(",\"mesh\":%d", mesh);
    std::string below = children;
    auto own = placed.find(node.mName.C_Str());
    if (own != placed.end() && !own->second.empty()) {
        below += (below.empty() ? "" : ",") + own->second;
        own->second.clear(); // a second node of that name has none
    }
    if (!below.empty())
        object += ",\"children\":[" + below + "]";
    return nodes.add(object + "}");
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

void gltf_writer::warn_of_left_out()
{
    unsigned skinned = 0, morphed = 0;
    for (unsigned m = 0; m < scene.mNumMeshes; m++) {
        skinned += scene.mMeshes[m]->mNumBones > 0;
        morphed += scene.mMeshes[m]->mNumAnimMeshes > 0;
    }
    if (scene.mNumAnimations > 0)
        state.warn(text("animations are left out: %u", scene.mNumAnimations));
    if (skinned > 0)
        state.warn(text("skins are left out, of meshes: %u", skinned));
    if (morphed > 0)
        state.warn(text("morph targets are left out, of meshes: %u", morphed));
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
    size_t first_image_view = views.count;
    for (const auto &image : textures.embedded)
        add_view(image.first, image.second);
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
    warn_of_left_out();
    static const char used[] =
        ",\"extensionsUsed\":[\"KHR_materials_transmission\",\"KHR_materials_ior\","
        "\"KHR_materials_emissive_strength\",\"KHR_lights_punctual\"]";
    std::string buffers =
        out.buffer.empty() ? "" : text(",\"buffers\":[{\"byteLength\":%zu}]", out.buffer.size());
    std::string light_list = lights.member("lights");
    if (!light_list.empty())
        light_list = ",\"extensions\":{\"KHR_lights_punctual\":{" + light_list.substr(1) + "}}";
    out.json = "{\"asset\":{\"version\":\"2.0\"}" + std::string(used) +
               text(",\"scene\":0,\"scenes\":[{\"nodes\":[%zu]}]", root) + buffers +
               views.member("bufferViews") + accessors.member("accessors") +
               materials.member("materials") + images.member("images") +
               texture_list.member("textures") + meshes.member("meshes") +
               cameras.member("cameras") + nodes.member("nodes") + light_list + "}";
    return std::move(out);
}

} // namespace

std::string json_numbers(const float *values, size_t count)
{
    std::string list = "[";
    for (size_t i = 0; i < count; i++)
        list += text(i ? ",%.9g" : "%.9g", double(values[i]));
    return list + "]";
}

// Bytes that are no UTF-8 are taken for Latin-1, as old files keep it.
std::string json_string(const std::string &utf8)
{
    std::string out = "\"";
    for (size_t i = 0; i < utf8.size();) {
        unsigned char c = static_cast<unsigned char>(utf8[i]);
        size_t length = c < 0x80                ? 1
                        : c >= 0xC2 && c < 0xE0 ? 2
                        : c >= 0xE0 && c < 0xF0 ? 3
                        : c >= 0xF0 && c < 0xF5 ? 4
                                                : 0;
        bool is_whole = length > 0 && i + length <= utf8.size();
        for (size_t k = 1; is_whole && k < length; k++)
            is_whole = (static_cast<unsigned char>(utf8[i + k]) & 0xC0) == 0x80;
        if (!is_whole || length == 1) {
            bool is_plain = c >= 0x20 && c < 0x7F && c != '"' && c != '\\';
            out += is_plain ? std::string(1, char(c)) : text("\\u%04x", c);
            i++;
        } else {
            out += utf8.substr(i, length);
            i += length;
        }
    }
    return out + "\"";
}

gltf_text write_gltf(conversion_state &state, const aiScene &scene, const told_units &units)
{
    return gltf_writer(state, scene, units).write();
}

} // namespace vitrail
