// SPDX-License-Identifier: MIT
// How what moves is written as glTF: skins, morph targets and animations, and the buffer into which
// their numbers go with those of meshes. C++, private to the module. Thread: one per conversion.
#ifndef VITRAIL_RENDERER_IMPORT_ASSIMP_MOVING_H
#define VITRAIL_RENDERER_IMPORT_ASSIMP_MOVING_H

#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include <assimp/scene.h>

#include "renderer/import/assimp/conversion.h"

namespace vitrail
{

enum { FLOATS = 5126, INDICES = 5125, JOINTS = 5123 }; // component types of glTF

bool is_finite(const aiVector3D &vector);
bool is_finite(const aiMatrix4x4 &matrix);
// Column by column, as glTF has it.
void put_matrix(const aiMatrix4x4 &matrix, float out[16]);

// A list of JSON values.
class json_list
{
  public:
    size_t add(const std::string &value);
    // The member with its comma in front; nothing for an empty list.
    std::string member(const char *name) const;
    size_t count = 0;

  private:
    std::string text;
};

// The buffer of a glTF with its views and accessors.
class gltf_data
{
  public:
    int add_view(const void *bytes, size_t size_bytes);
    int add_accessor(int component, const char *type, size_t count, const void *bytes,
                     size_t size_bytes, const std::string &rest);
    int add_floats(const char *type, size_t count, const std::vector<float> &values);
    // Vectors of three, with their bounds.
    int add_places(const std::vector<float> &values);
    std::vector<unsigned char> buffer;
    json_list views, accessors;
};

// The nodes of the file, by name, and what became of them. A name that several have is that of the
// first, from the root down.
struct node_table {
    struct morphed {
        size_t node;                    // of glTF
        std::vector<unsigned> channels; // of each target, by their number in assimp
    };
    explicit node_table(const aiScene &scene);
    const aiNode *find(const char *name) const;
    std::unordered_map<const aiNode *, size_t> written;
    std::map<const aiNode *, std::vector<morphed>> morphs;

  private:
    std::map<std::string, const aiNode *> by_name;
};

// Which meshes of a node become one of glTF: such that have the same morph targets, and all bones
// or none, of which one skin can be made.
struct mesh_group {
    std::vector<unsigned> meshes;
    std::vector<unsigned> channels; // of each morph target
    int skin;                       // of the table of skins, -1: none
};

class skin_table
{
  public:
    explicit skin_table(conversion_state &conversion, const node_table &table)
        : state(conversion), nodes(table)
    {
    }
    // Adds the bones of the mesh to that skin (-1: to a new one), which is returned; -1: a bone has
    // another place there.
    int take(const aiMesh &mesh, int skin);
    // JOINTS and WEIGHTS of the mesh, each with a comma in front.
    std::string influences(gltf_data &data, const aiMesh &mesh, int skin) const;
    json_list write(gltf_data &data) const; // once all nodes are written

  private:
    struct joint {
        const aiNode *node;
        aiMatrix4x4 offset;
    };
    struct skin {
        std::vector<joint> joints;
        std::map<const aiNode *, size_t> index;
    };
    conversion_state &state;
    const node_table &nodes;
    std::vector<skin> skins;
};

// A morph target of a mesh that is taken: its number among those of the mesh in assimp, and that of
// the channel by which animations move it.
struct morph_target {
    unsigned index, channel;
};
// In the order of their names: newer versions of assimp list the same file's in another order each
// time.
std::vector<morph_target> targets_of(conversion_state &state, const aiMesh &mesh);
void check_targets(const aiMesh &mesh, unsigned index); // before assimp's steps work on them
// Assimp joins vertices of one place and normal, however these move. Such as move differently get
// tangents that differ, which nothing else reads.
void keep_apart(aiMesh &mesh);
// Of a primitive; with a comma in front. "": there are none.
std::string write_targets(conversion_state &state, gltf_data &data, const aiMesh &mesh);
// What they weigh at rest.
std::vector<float> target_weights(conversion_state &state, const aiMesh &mesh);

// Nodes that some animation moves: glTF wants these without a matrix.
std::set<const aiNode *> moved_nodes(conversion_state &state, const aiScene &scene,
                                     const node_table &nodes);
// Place, rotation and scale, each with a comma in front.
std::string write_rest(conversion_state &state, const aiNode &node);
json_list write_animations(conversion_state &state, const aiScene &scene, gltf_data &data,
                           const node_table &nodes);

} // namespace vitrail

#endif
