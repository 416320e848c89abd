// SPDX-License-Identifier: MIT
// What the shims around assimp share: one conversion under way. C++, private to the module. Thread:
// one per conversion. Faults of the file are thrown as `fault`; assimp_shim.cpp catches everything.
#ifndef VITRAIL_RENDERER_IMPORT_ASSIMP_CONVERSION_H
#define VITRAIL_RENDERER_IMPORT_ASSIMP_CONVERSION_H

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/import/converter.h"

struct aiMaterial;
struct aiScene;

namespace vitrail
{

// What is wrong with the file, for its sender.
struct fault : std::runtime_error {
    using std::runtime_error::runtime_error;
};
[[noreturn]] void refuse(const char *format, ...) __attribute__((format(printf, 1, 2)));
std::string text(const char *format, ...) __attribute__((format(printf, 1, 2)));

// A few elements of JSON written out, as text.
std::string json_string(const std::string &utf8); // with its quotes; what is not UTF-8 is replaced
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
// Where the file itself tells its unit or axis.
void read_source_units(const struct converter_input &input, struct scene_origin *origin);

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

struct gltf_text {
    std::string json;
    std::vector<unsigned char> buffer;
};
// The whole scene under a node that turns the origin's unit and axis into metres and +Y.
gltf_text write_gltf(conversion_state &state, const aiScene &scene,
                     const struct scene_origin &origin);

} // namespace vitrail

#endif
