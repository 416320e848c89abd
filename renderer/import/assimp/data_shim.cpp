// SPDX-License-Identifier: MIT
// The lists, buffer and accessors of a glTF that is written.
#include "renderer/import/assimp/moving.h"

#include <algorithm>
#include <cmath>

namespace vitrail
{

namespace
{

constexpr size_t ALIGNMENT = 4;

} // namespace

bool is_finite(const aiVector3D &vector)
{
    return std::isfinite(vector.x) && std::isfinite(vector.y) && std::isfinite(vector.z);
}

bool is_finite(const aiMatrix4x4 &matrix)
{
    for (unsigned row = 0; row < 4; row++)
        for (unsigned column = 0; column < 4; column++)
            if (!std::isfinite(matrix[row][column]))
                return false;
    return true;
}

void put_matrix(const aiMatrix4x4 &matrix, float out[16])
{
    for (unsigned column = 0; column < 4; column++)
        for (unsigned row = 0; row < 4; row++)
            out[4 * column + row] = float(matrix[row][column]);
}

std::string json_numbers(const float *values, size_t count)
{
    std::string list = "[";
    for (size_t i = 0; i < count; i++)
        list += text(i ? ",%.9g" : "%.9g", double(values[i]));
    return list + "]";
}

size_t json_list::add(const std::string &value)
{
    if (count > 0)
        text += ',';
    text += value;
    return count++;
}

std::string json_list::member(const char *name) const
{
    return count == 0 ? "" : std::string(",\"") + name + "\":[" + text + "]";
}

int gltf_data::add_view(const void *bytes, size_t size_bytes)
{
    buffer.resize((buffer.size() + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT);
    size_t offset = buffer.size();
    const unsigned char *from = static_cast<const unsigned char *>(bytes);
    buffer.insert(buffer.end(), from, from + size_bytes);
    return int(views.add(
        text("{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", offset, size_bytes)));
}

int gltf_data::add_accessor(int component, const char *type, size_t count, const void *bytes,
                            size_t size_bytes, const std::string &rest)
{
    int view = add_view(bytes, size_bytes);
    return int(accessors.add(text("{\"bufferView\":%d,\"componentType\":%d,\"count\":%zu,"
                                  "\"type\":\"%s\"",
                                  view, component, count, type) +
                             rest + "}"));
}

int gltf_data::add_floats(const char *type, size_t count, const std::vector<float> &values)
{
    return add_accessor(FLOATS, type, count, values.data(), values.size() * sizeof(float), "");
}

int gltf_data::add_places(const std::vector<float> &values)
{
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    for (size_t i = 0; i < values.size(); i++) {
        low[i % 3] = i < 3 ? values[i] : std::min(low[i % 3], values[i]);
        high[i % 3] = i < 3 ? values[i] : std::max(high[i % 3], values[i]);
    }
    return add_accessor(FLOATS, "VEC3", values.size() / 3, values.data(),
                        values.size() * sizeof(float),
                        ",\"min\":" + json_numbers(low, 3) + ",\"max\":" + json_numbers(high, 3));
}

} // namespace vitrail
