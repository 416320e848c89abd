// SPDX-License-Identifier: MIT
// From an OpenVDB file in memory to one dense volume. The library neither maps the file nor delays
// what it reads, as it has no file system here.
#include "renderer/import/openvdb/volume.h"

#include <cmath>
#include <cstring>
#include <istream>
#include <sstream>
#include <streambuf>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

namespace vitrail
{

namespace
{

constexpr size_t MAGIC_BYTES = 4;
constexpr char MAGIC[] = " BDV"; // OPENVDB_MAGIC, low byte first

class memory_buffer : public std::streambuf
{
  public:
    memory_buffer(const void *bytes, size_t size_bytes)
    {
        char *begin = static_cast<char *>(const_cast<void *>(bytes));
        setg(begin, begin, begin + size_bytes); // which is only read
    }

  protected:
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override
    {
        off_type base = from == std::ios_base::beg   ? 0
                        : from == std::ios_base::cur ? gptr() - eback()
                                                     : egptr() - eback();
        off_type size = egptr() - eback();
        if (offset < -base || offset > size - base)
            return pos_type(off_type(-1));
        setg(eback(), eback() + base + offset, egptr());
        return pos_type(base + offset);
    }

    pos_type seekpos(pos_type at, std::ios_base::openmode mode) override
    {
        return seekoff(off_type(at), std::ios_base::beg, mode);
    }
};

openvdb::GridPtrVecPtr read_grids(const void *bytes, size_t size_bytes)
{
    memory_buffer buffer(bytes, size_bytes);
    std::istream stream(&buffer);
    // the library goes on where a read was short
    stream.exceptions(std::ios_base::failbit | std::ios_base::badbit | std::ios_base::eofbit);
    return openvdb::io::Stream(stream, false).getGrids();
}

openvdb::GridPtrVecPtr read_file(const struct scene_file &file)
{
    if (file.size_bytes < MAGIC_BYTES || memcmp(file.bytes, MAGIC, MAGIC_BYTES) != 0)
        refuse("it does not begin as an OpenVDB file does");
    try {
        return read_grids(file.bytes, file.size_bytes);
    } catch (const std::ios_base::failure &) {
        refuse("it ends before its grids do: the file is cut or broken");
    } catch (const openvdb::Exception &problem) {
        refuse("%.150s", problem.what());
    }
}

bool is_scalar(const openvdb::GridBase &grid)
{
    return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>();
}

bool is_density(const openvdb::GridBase &grid)
{
    return is_scalar(grid) && grid.getGridClass() != openvdb::GRID_LEVEL_SET &&
           grid.getGridClass() != openvdb::GRID_STAGGERED;
}

std::string reason_of(const openvdb::GridBase &grid)
{
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET)
        return "a level set, not a density";
    if (!is_scalar(grid))
        return "of type " + grid.valueType() + ", not a scalar density";
    return "a staggered grid, not a density";
}

std::string name_of(const openvdb::GridBase &grid)
{
    return grid.getName().empty() ? "density" : grid.getName();
}

// Of a density: how far it goes before others where none is named.
int rank_of(const openvdb::GridBase &grid)
{
    if (grid.getName() == "density")
        return 2;
    return grid.getGridClass() == openvdb::GRID_FOG_VOLUME;
}

// The densities of the file, in its order.
openvdb::GridPtrVec find_densities(const openvdb::GridPtrVec &grids, std::string *warnings)
{
    openvdb::GridPtrVec densities;
    std::string lines;
    for (const openvdb::GridBase::Ptr &grid : grids)
        if (grid && is_density(*grid))
            densities.push_back(grid);
        else if (grid)
            lines += text("grid '%.80s' is left out: it is ", grid->getName().c_str()) +
                     reason_of(*grid) + "\n";
    if (densities.empty() && grids.empty())
        refuse("it holds no grid");
    if (densities.empty())
        refuse("it holds no grid of densities: %s", lines.substr(0, lines.find('\n')).c_str());
    *warnings += lines;
    return densities;
}

// The place that is meant, as the importer finds the scene of that place: by names first, as they
// stand in glTF. Their count: none.
size_t find_wanted(const openvdb::GridPtrVec &densities, const char *wanted)
{
    size_t place = 0;
    while (place < densities.size() &&
           json_string(name_of(*densities[place])) != json_string(wanted))
        place++;
    return place < densities.size() ? place : scene_place(wanted, densities.size());
}

size_t choose(const openvdb::GridPtrVec &densities, const char *wanted, std::string *warnings)
{
    size_t best = 0;
    for (size_t i = 1; i < densities.size(); i++)
        if (rank_of(*densities[i]) > rank_of(*densities[best]))
            best = i;
    size_t said = wanted ? find_wanted(densities, wanted) : densities.size();
    best = said < densities.size() ? said : best;
    for (size_t i = 0; i < densities.size(); i++)
        if (i != best) {
            std::string name = name_of(*densities[i]);
            *warnings += text("grid '%.80s' is left out: one is read, and ?scene=%.80s reads it\n",
                              name.c_str(), name.c_str());
        }
    return best;
}

void read_transform(const openvdb::GridBase &grid, volume *out)
{
    const char *name = out->name.c_str();
    openvdb::math::MapBase::ConstPtr map = grid.transform().baseMap();
    if (!map->isLinear())
        refuse("grid '%.80s' has a frustum for its transform (%s), which is not read", name,
               map->type().c_str());
    const openvdb::Vec3d units[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    std::array<openvdb::Vec3d, 4> columns = {};
    for (size_t axis = 0; axis < 3; axis++)
        columns[axis] = map->applyJacobian(units[axis]);
    columns[3] = map->applyMap(openvdb::Vec3d(0, 0, 0));
    for (size_t i = 0; i < 16; i++)
        out->from_index[i] = i % 4 < 3 ? columns[i / 4][int(i % 4)] : i == 15;
    const std::array<double, 16> &m = out->from_index;
    double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                         m[2] * (m[4] * m[9] - m[5] * m[8]);
    bool is_good = std::fabs(determinant) > 0;
    for (double element : m)
        is_good = is_good && std::isfinite(element);
    if (!is_good)
        refuse("grid '%.80s' has a singular transform", name);
}

// One voxel more on each side, where the density is 0, so that it ends without a step.
void measure(const openvdb::GridBase &grid, volume *out)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    if (box.empty())
        refuse("grid '%.80s' has no active voxel", out->name.c_str());
    double voxels = 1, sides[3];
    for (int axis = 0; axis < 3; axis++) {
        sides[axis] = double(box.max()[axis]) - double(box.min()[axis]) + 3;
        voxels *= sides[axis];
        out->first[size_t(axis)] = double(box.min()[axis]) - 1;
    }
    for (double side : sides)
        if (side > VOLUME_SIDE_MAX || voxels > VOLUME_VOXELS_MAX)
            refuse("grid '%.80s' is %.0f x %.0f x %.0f voxels, the limits are %.0f along an axis "
                   "and %.0f in all",
                   out->name.c_str(), sides[0], sides[1], sides[2], VOLUME_SIDE_MAX,
                   VOLUME_VOXELS_MAX);
    for (size_t axis = 0; axis < 3; axis++)
        out->size[axis] = size_t(sides[axis]);
}

// Takes values into a volume.
struct filler {
    volume *out;

    size_t along(int axis, std::int64_t index) const
    {
        return size_t(index - std::int64_t(out->first[size_t(axis)]));
    }

    void put(const openvdb::CoordBBox &box, double value) const
    {
        float single = float(value);
        if (!std::isfinite(single))
            refuse("voxel (%d, %d, %d) of grid '%.80s' is not finite", box.min().x(), box.min().y(),
                   box.min().z(), out->name.c_str());
        // which may go to the end of 32 bits
        for (std::int64_t z = box.min().z(); z <= box.max().z(); z++)
            for (std::int64_t y = box.min().y(); y <= box.max().y(); y++) {
                size_t row = (along(2, z) * out->size[1] + along(1, y)) * out->size[0];
                for (std::int64_t x = box.min().x(); x <= box.max().x(); x++)
                    memcpy(&out->values[(row + along(0, x)) * sizeof single], &single,
                           sizeof single);
            }
    }
};

template <typename grid_type> void fill(const grid_type &grid, volume *out, std::string *warnings)
{
    filler filler{out};
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel)
            filler.put({voxel.getCoord(), voxel.getCoord()}, double(*voxel));
    auto tile = grid.tree().cbeginValueOn();
    for (tile.setMaxDepth(grid_type::TreeType::ValueOnCIter::LEAF_DEPTH - 1); tile; ++tile) {
        openvdb::CoordBBox box;
        tile.getBoundingBox(box);
        filler.put(box, double(*tile));
    }
    if (grid.background() != 0)
        *warnings +=
            text("grid '%.80s' has the density %g wherever nothing is active: taken as 0\n",
                 out->name.c_str(), double(grid.background()));
}

} // namespace

volume read_volume(const struct scene_file &file, const char *wanted, std::string *warnings)
{
    openvdb::GridPtrVec densities = find_densities(*read_file(file), warnings);
    volume out = {};
    out.place = choose(densities, wanted, warnings);
    for (const openvdb::GridBase::Ptr &density : densities)
        out.names.push_back(name_of(*density));
    openvdb::GridBase::Ptr grid = densities[out.place];
    densities.clear(); // the others are freed before the values are spread out
    out.name = out.names[out.place];
    read_transform(*grid, &out);
    measure(*grid, &out);
    out.values.resize(out.size[0] * out.size[1] * out.size[2] * sizeof(float));
    if (grid->isType<openvdb::FloatGrid>())
        fill(static_cast<const openvdb::FloatGrid &>(*grid), &out, warnings);
    else
        fill(static_cast<const openvdb::DoubleGrid &>(*grid), &out, warnings);
    return out;
}

void prepare_library()
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    grid->tree().setValueOn(openvdb::Coord(0, 0, 0), 1);
    std::ostringstream written(std::ios_base::binary);
    openvdb::io::Stream(written).write(openvdb::GridPtrVec{grid});
    const std::string bytes = written.str();
    read_grids(bytes.data(), bytes.size());
}

} // namespace vitrail
