// SPDX-License-Identifier: MIT
// Writes the OpenVDB files that tests read into a folder: vdb_files FOLDER. The density of a voxel
// (x, y, z) is (1 + x + 2y + 4z) / 64 where nothing else is said.
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

namespace
{

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::GridBase;

std::string folder;

void write(const char *name, const openvdb::GridPtrVec &grids, uint32_t compression)
{
    openvdb::io::File file(folder + "/" + name + ".vdb");
    file.setCompression(compression);
    file.write(grids);
    file.close();
}

void write(const char *name, const openvdb::GridPtrVec &grids)
{
    write(name, grids, openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP);
}

// Of the voxels [-2, 0, 3] to [7, 4, 4].
template <typename grid_type> typename grid_type::Ptr block(const char *name)
{
    typename grid_type::Ptr grid = grid_type::create(0);
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    for (int z = 3; z <= 4; z++)
        for (int y = 0; y <= 4; y++)
            for (int x = -2; x <= 7; x++)
                grid->tree().setValueOn(Coord(x, y, z),
                                        typename grid_type::ValueType(1 + x + 2 * y + 4 * z) / 64);
    return grid;
}

FloatGrid::Ptr placed(const double (&matrix)[16]) // columns
{
    FloatGrid::Ptr grid = block<FloatGrid>("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(openvdb::Mat4d(matrix)));
    return grid;
}

FloatGrid::Ptr changed(const std::function<void(FloatGrid &)> &change)
{
    FloatGrid::Ptr grid = block<FloatGrid>("density");
    change(*grid);
    return grid;
}

GridBase::Ptr level_set()
{
    FloatGrid::Ptr grid = block<FloatGrid>("surface");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

GridBase::Ptr velocity()
{
    openvdb::Vec3SGrid::Ptr grid = openvdb::Vec3SGrid::create();
    grid->setName("velocity");
    grid->tree().setValueOn(Coord(0, 0, 0), openvdb::Vec3s(1, 2, 3));
    return grid;
}

void write_kinds()
{
    write("block", {block<FloatGrid>("density")});
    write("double", {block<openvdb::DoubleGrid>("density")});
    FloatGrid::Ptr half = block<FloatGrid>("density");
    half->setSaveFloatAsHalf(true);
    write("half", {half});
    write("plain", {block<FloatGrid>("density")}, openvdb::io::COMPRESS_NONE);
    write("blosc", {block<FloatGrid>("density")},
          openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC);
    write("several", {velocity(), block<FloatGrid>("flame"), level_set(),
                      block<FloatGrid>("density"), block<openvdb::Int32Grid>("count")});
    write("fire", {velocity(), block<FloatGrid>("flame")});
    write("surfaces", {level_set(), velocity()});
    write("none", {});
    write("tile", {changed([](FloatGrid &grid) {
              grid.tree().clear();
              grid.tree().addTile(1, Coord(8, 16, 24), 0.25f, true);
          })});
}

void write_transforms()
{
    write("scaled", {placed({0.5, 0, 0, 0, 0, 0.25, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1})});
    write("turned", {placed({0, 0.5, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0, 1, 2, 3, 1})});
    openvdb::math::MapBase::Ptr frustum(
        new openvdb::math::NonlinearFrustumMap(openvdb::BBoxd({0, 0, 0}, {9, 9, 9}), 0.5, 10));
    write("frustum", {changed([&](FloatGrid &grid) {
              grid.setTransform(
                  openvdb::math::Transform::Ptr(new openvdb::math::Transform(frustum)));
          })});
}

void write_bad()
{
    write("empty", {FloatGrid::create(0)});
    write("far", {changed([](FloatGrid &grid) { grid.tree().setValueOn(Coord(9000, 0, 0), 1); })});
    write("large",
          {changed([](FloatGrid &grid) { grid.tree().setValueOn(Coord(1500, 1500, 1500), 1); })});
    FloatGrid::Ptr edge = FloatGrid::create(0);
    edge->setName("density");
    edge->tree().setValueOn(Coord(2147483647, -2147483647, 0), 1);
    write("edge", {edge});
    write("limits", {changed([](FloatGrid &grid) {
              grid.tree().setValueOn(Coord(2147483647, 0, 0), 1);
              grid.tree().setValueOn(Coord(0, -2147483647, 0), 1);
          })});
    write("nan", {changed([](FloatGrid &grid) {
              grid.tree().setValueOn(Coord(1, 2, 3), std::numeric_limits<float>::quiet_NaN());
          })});
    openvdb::DoubleGrid::Ptr wide = block<openvdb::DoubleGrid>("density");
    wide->tree().setValueOn(Coord(0, 1, 4), 1e300);
    write("wide", {wide});
    write("negative",
          {changed([](FloatGrid &grid) { grid.tree().setValueOn(Coord(1, 2, 3), -1); })});
    FloatGrid::Ptr everywhere = FloatGrid::create(0.5f);
    everywhere->setName("density");
    everywhere->tree().setValueOn(Coord(0, 0, 0), 1);
    write("everywhere", {everywhere});
}

} // namespace

int main(int argc, char **argv)
{
    if (argc != 2)
        return 2;
    folder = argv[1];
    openvdb::initialize();
    write_kinds();
    write_transforms();
    write_bad();
    return 0;
}
