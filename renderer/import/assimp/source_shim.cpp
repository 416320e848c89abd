// SPDX-License-Identifier: MIT
// What the bytes of a file tell before assimp reads them.
#include "renderer/import/assimp/conversion.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace vitrail
{

namespace
{

constexpr size_t STL_HEAD_BYTES = 84, STL_FACET_BYTES = 50;

std::string_view bytes_of(const struct scene_file &file)
{
    return {static_cast<const char *>(file.bytes), file.size_bytes};
}

bool is_text(std::string_view bytes)
{
    return std::none_of(bytes.begin(), bytes.end(),
                        [](char c) {
                            return static_cast<unsigned char>(c) < 0x20 && !strchr("\t\n\v\f\r", c);
                        }) &&
           bytes.find('\0') == bytes.npos;
}

// A text begins with "solid"; but so do the heads of some binary files, so that the size decides
// first, as it does in assimp.
void check_stl(std::string_view bytes)
{
    uint32_t facets = 0;
    if (bytes.size() >= STL_HEAD_BYTES)
        memcpy(&facets, bytes.data() + STL_HEAD_BYTES - sizeof facets, sizeof facets);
    uint64_t declared = STL_HEAD_BYTES + uint64_t(STL_FACET_BYTES) * facets;
    if (bytes.size() >= STL_HEAD_BYTES && declared == bytes.size())
        return;
    size_t begin = bytes.find_first_not_of(" \t\r\n");
    bool is_solid = begin != bytes.npos && bytes.substr(begin, 5) == "solid";
    if (is_solid && is_text(bytes.substr(0, 512)))
        return;
    if (bytes.size() < STL_HEAD_BYTES)
        refuse("%zu bytes are neither a text that begins with 'solid' nor a head of %zu bytes",
               bytes.size(), STL_HEAD_BYTES);
    refuse("its head declares %u triangles, which take %llu bytes; the file has %zu", facets,
           static_cast<unsigned long long>(declared), bytes.size());
}

} // namespace

// Assimp writes what comes before the first material nowhere.
void check_mtl(const struct scene_file &file)
{
    std::string_view bytes = bytes_of(file);
    for (size_t at = 0, end; at < bytes.size(); at = end + 1) {
        end = std::min(bytes.find('\n', at), bytes.size());
        std::string_view line = bytes.substr(at, end - at);
        size_t begin = line.find_first_not_of(" \t\r");
        if (begin == line.npos || line[begin] == '#')
            continue;
        if (line.substr(begin, 6) != "newmtl")
            refuse("'%.80s' begins with '%.40s', not with newmtl", file.name,
                   std::string(line.substr(begin, 40)).c_str());
        return;
    }
}

void check_source(const struct converter_input &input)
{
    std::string_view bytes = bytes_of(*input.root);
    if (bytes.empty())
        refuse("the file is empty");
    if (input.format == SCENE_FORMAT_STL)
        check_stl(bytes);
    if (input.format == SCENE_FORMAT_PLY)
        check_ply(bytes);
    if (input.format == SCENE_FORMAT_OBJ && bytes.find('\0') != bytes.npos)
        refuse("byte %zu is zero, so that it is no text", bytes.find('\0'));
}

} // namespace vitrail
