// SPDX-License-Identifier: MIT
// What the shims around OpenVDB share: a volume that was read, dense. C++, private to the module.
// Faults of the file are thrown as `fault`; volume_shim.cpp catches everything.
#ifndef VITRAIL_RENDERER_IMPORT_OPENVDB_VOLUME_H
#define VITRAIL_RENDERER_IMPORT_OPENVDB_VOLUME_H

#include <array>
#include <string>
#include <vector>

#include "renderer/import/module/module.h"

namespace vitrail
{

// Limits of the importer (renderer/scene/scene_blob.h), which are asked before memory is taken.
constexpr double VOLUME_SIDE_MAX = 8192;
constexpr double VOLUME_VOXELS_MAX = 1 << 29;

struct volume {
    std::string name;
    std::vector<std::string> names;    // of all densities of the file, in its order
    size_t place;                      // of this one among them
    std::array<size_t, 3> size;        // voxels: the active ones and one around them
    std::array<double, 3> first;       // index of the voxel that is the first of the values
    std::array<double, 16> from_index; // columns: units of the file from indices
    std::vector<unsigned char> values; // floats, x fastest
};

// The grid that is wanted, by its name or "#1", its place among the densities of the file. Else,
// and where nothing is wanted (NULL), the one called density, else the first fog volume, else the
// first of unknown class. Adds lines on what is left out.
volume read_volume(const struct scene_file &file, const char *wanted, std::string *warnings);

// Registers the types of grids and reads a small one.
void prepare_library();

} // namespace vitrail

#endif
