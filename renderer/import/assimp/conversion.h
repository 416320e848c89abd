// SPDX-License-Identifier: MIT
// What the shims around assimp share: one conversion under way. C++, private to the module. Thread:
// one per conversion. Faults of the file are thrown as `fault`; assimp_shim.cpp catches everything.
#ifndef VITRAIL_RENDERER_IMPORT_ASSIMP_CONVERSION_H
#define VITRAIL_RENDERER_IMPORT_ASSIMP_CONVERSION_H

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/import/module/module.h"

struct aiCamera;
struct aiLight;
struct aiMaterial;
struct aiScene;

namespace vitrail
{

// A list of JSON written out, as text.
std::string json_numbers(const float *values, size_t count);

struct conversion_state {
    const struct converter_input *input;
    std::vector<std::string> warnings; // each once, in the order in which they came
    std::set<std::string> missing;     // files that were asked for, and are not in the upload
    std::string broken; // what assimp said of a fault that it went on over; "": nothing

    void warn(const std::string &line);
    // By the name that the scene gives it: relative to the scene, with slashes of either kind; else
    // by its last segment, as scenes keep paths of the machine that wrote them. NULL: not there.
    const struct scene_file *find(const std::string &name) const;
};

// Checks by the bytes of the file what assimp would pass over or make up.
void check_source(const struct converter_input &input);
void check_ply(std::string_view bytes);
void check_mtl(const struct scene_file &file); // a library of materials
// The text of a COLLADA scene as assimp can read it.
std::string prepare_collada(conversion_state &state, std::string_view bytes);
// The unit of a 3MF package, which assimp does not pass on; 0: it names none, or is broken.
double read_3mf_unit(std::string_view bytes);
// The unit and the axis that the file names, and what assimp has made of them already.
struct file_units {
    struct scene_origin origin;
    double applied_unit_m;
    char applied_up;
};
file_units read_units(const struct converter_input &input, const aiScene &scene);

// The images and textures that materials name.
struct texture_table {
    std::vector<std::string> images; // JSON objects; texture i shows image i / 1
    std::vector<std::string> textures;
    std::map<std::string, int> index;                      // by path: of a texture, -1: left out
    std::vector<std::pair<const void *, size_t>> embedded; // bytes of images in the scene
};

// How the triangles that have a material are: what its glTF form depends on.
struct surface_use {
    bool has_colors, has_alpha; // vertex colours; of which some are not opaque
    bool is_closed;             // and faces outward
    bool operator<(const surface_use &other) const;
};

// The glTF material as a JSON object, its textures added to the table.
std::string write_material(conversion_state &state, const aiScene &scene,
                           const aiMaterial &material, const surface_use &use,
                           texture_table &textures);

// A light or camera of glTF, and where it is below its node, as members without braces. "": left
// out, with a warning.
std::string write_light(conversion_state &state, const aiLight &light, double unit_m,
                        std::string *placing);
std::string write_camera(conversion_state &state, const aiCamera &camera, double unit_m,
                         std::string *placing);

struct gltf_text {
    std::string json;
    std::vector<unsigned char> buffer;
};
// The whole scene under a node that turns the unit and axis into metres and +Y, less what is
// applied.
gltf_text write_gltf(conversion_state &state, const aiScene &scene, const file_units &units);

} // namespace vitrail

#endif
