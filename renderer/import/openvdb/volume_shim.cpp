// SPDX-License-Identifier: MIT
// The only user of OpenVDB (10.0; MPL 2.0), with read_shim.cpp: from a .vdb file in memory to glTF
// with a density grid (VITRAIL_density_grids). No exception leaves this file, and no file but that
// of the upload is seen.
#include "renderer/import/openvdb/volume.h"

#include <oneapi/tbb/global_control.h>

namespace vitrail
{

namespace
{

// The library frees its trees by a pool of threads, which would be started in the cage.
void keep_to_one_thread()
{
    using oneapi::tbb::global_control;
    static const global_control control(global_control::max_allowed_parallelism, 1);
}

// The format tells neither.
struct scene_origin origin_of(const struct converter_input &input)
{
    struct scene_origin origin = {input.format, 1, 'y', SCENE_WORD_DEFAULT, SCENE_WORD_DEFAULT, 0};
    if (input.unit_m > 0) {
        origin.unit_m = input.unit_m;
        origin.unit_by = SCENE_WORD_REQUEST;
    }
    if (input.up) {
        origin.up = input.up;
        origin.up_by = SCENE_WORD_REQUEST;
    }
    return origin;
}

template <typename list> std::string numbers(const list &values)
{
    std::string out;
    for (double value : values)
        out += (out.empty() ? "[" : ",") + text("%.17g", value);
    return out + "]";
}

// The outer faces of the voxels, in indices.
struct index_box {
    std::array<double, 3> min, max;
};

index_box box_of(const volume &volume)
{
    index_box box = {};
    for (size_t axis = 0; axis < 3; axis++) {
        box.min[axis] = volume.first[axis] - 0.5;
        box.max[axis] = box.min[axis] + double(volume.size[axis]);
    }
    return box;
}

// Whether the transform scales and moves alone, and keeps the directions of the axes.
bool is_plain(const std::array<double, 16> &m)
{
    for (size_t i = 0; i < 12; i++)
        if (i % 5 == 0 ? !(m[i] > 0) : m[i] != 0)
            return false;
    return true;
}

// Each density of the file is a scene of its name; the one that was read has the node.
std::string write_scenes(const volume &volume, bool is_turned)
{
    std::string scenes;
    for (size_t i = 0; i < volume.names.size(); i++)
        scenes += std::string(i ? "," : "") + "{\"name\":" + json_string(volume.names[i]) +
                  (i != volume.place ? "}"
                   : is_turned       ? ",\"nodes\":[1]}"
                                     : ",\"nodes\":[0]}");
    return "\"scene\":" + std::to_string(volume.place) + ",\"scenes\":[" + scenes + "]";
}

// A plain transform goes into the box; any other is the matrix of the node.
std::string write_gltf(const volume &volume, const struct scene_origin &origin)
{
    index_box box = box_of(volume);
    const std::array<double, 16> &m = volume.from_index;
    std::string matrix;
    for (size_t axis = 0; is_plain(m) && axis < 3; axis++) {
        box.min[axis] = box.min[axis] * m[5 * axis] + m[12 + axis];
        box.max[axis] = box.max[axis] * m[5 * axis] + m[12 + axis];
    }
    if (!is_plain(m))
        matrix = ",\"matrix\":" + numbers(m);
    std::string name = json_string(volume.name);
    std::string nodes =
        "{\"name\":" + name + matrix + ",\"extensions\":{\"VITRAIL_density_grids\":{\"grid\":0}}}";
    bool is_turned = origin.unit_m != 1 || origin.up != 'y';
    if (is_turned) {
        double u = origin.unit_m;
        bool z_up = origin.up == 'z';
        const std::array<double, 16> turn = {
            u, 0, 0, 0, 0, z_up ? 0 : u, z_up ? -u : 0, 0, 0, z_up ? u : 0, z_up ? 0 : u,
            0, 0, 0, 0, 1};
        nodes += ",{\"name\":\"unit and axis of the file\",\"children\":[0],\"matrix\":" +
                 numbers(turn) + "}";
    }
    std::string bytes = std::to_string(volume.values.size());
    return "{\"asset\":{\"version\":\"2.0\"},\"extensionsUsed\":[\"VITRAIL_density_grids\"]," +
           write_scenes(volume, is_turned) + ",\"nodes\":[" + nodes +
           "],\"extensions\":{\"VITRAIL_density_grids\":{\"grids\":[{\"name\":" + name +
           ",\"size\":" + numbers(volume.size) + ",\"values\":0,\"min\":" + numbers(box.min) +
           ",\"max\":" + numbers(box.max) + text(",\"density\":%.17g", 1 / origin.unit_m) +
           "}]}},\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"type\":\"SCALAR\","
           "\"count\":" +
           std::to_string(volume.values.size() / sizeof(float)) +
           "}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":" + bytes +
           "}],\"buffers\":[{\"byteLength\":" + bytes + "}]}";
}

void convert_all(const struct converter_input *input, struct converter_output *output)
{
    keep_to_one_thread();
    std::string lines;
    volume volume = read_volume(*input->root, input->scene, &lines);
    output->origin = origin_of(*input);
    if (output->origin.unit_by == SCENE_WORD_DEFAULT)
        lines +=
            "the file does not tell the unit of its coordinates: metres are assumed (?unit=)\n";
    give(output, write_gltf(volume, output->origin), volume.values, lines);
}

bool convert(const struct converter_input *input, struct converter_output *output,
             struct error *err)
{
    *output = {};
    return guarded(
        "OpenVDB", [&] { convert_all(input, output); }, err);
}

void warm_up()
{
    try {
        keep_to_one_thread();
        prepare_library();
    } catch (...) {
        return; // the conversion will tell
    }
}

} // namespace

} // namespace vitrail

extern "C" const struct converter_functions *converter_get_functions(void)
{
    static const struct converter_functions functions = {vitrail::warm_up, vitrail::convert};
    return &functions;
}
