// SPDX-License-Identifier: MIT
// In which unit and with which axis up a file says that it is.
#include "renderer/import/assimp/conversion.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <assimp/scene.h>
#include <zlib.h>

namespace vitrail
{

namespace
{

constexpr size_t HEAD_BYTES = 1 << 16; // of an XML text in which its unit is looked for
constexpr double UNIT_LEAST_M = 1e-9, UNIT_MOST_M = 1e9;

bool is_unit(double unit_m)
{
    return unit_m >= UNIT_LEAST_M && unit_m <= UNIT_MOST_M;
}

// The value of the attribute in the first element of that name.
std::string attribute(std::string_view xml, std::string_view element, std::string_view name)
{
    size_t begin = xml.find(element);
    if (begin == xml.npos)
        return "";
    std::string_view tag = xml.substr(begin, xml.find('>', begin) - begin);
    size_t at = tag.find(name);
    if (at == tag.npos)
        return "";
    size_t open = tag.find_first_of("\"'", at);
    size_t close = open == tag.npos ? open : tag.find(tag[open], open + 1);
    return close == tag.npos ? "" : std::string(tag.substr(open + 1, close - open - 1));
}

void read_collada(std::string_view bytes, struct scene_origin *origin)
{
    std::string_view head = bytes.substr(0, HEAD_BYTES);
    double meter = strtod(attribute(head, "<unit", " meter=").c_str(), nullptr);
    if (is_unit(meter)) {
        origin->unit_m = meter;
        origin->unit_by = SCENE_WORD_FILE;
    }
    size_t at = head.find("<up_axis>");
    if (at != head.npos) {
        size_t axis = head.find_first_not_of(" \t\r\n", at + strlen("<up_axis>"));
        std::string_view word = axis == head.npos ? "" : head.substr(axis, 4);
        origin->up = word == "X_UP" ? 'x' : word == "Z_UP" ? 'z' : 'y';
        origin->up_by = SCENE_WORD_FILE;
    }
}

// Some versions of assimp (5.4, not 5.2) turn the root, that of assimp's own making, by the axes of
// the file. Its scenes have the same form here whatever the version.
void undo_turn_of_root(const aiScene &scene)
{
    if (scene.mRootNode)
        scene.mRootNode->mTransformation = aiMatrix4x4();
}

void read_fbx(const aiScene &scene, struct scene_origin *origin)
{
    float factor = 1;
    double wide = 1;
    int axis = 1, sign = 1;
    if (!scene.mMetaData)
        return;
    if (scene.mMetaData->Get("UnitScaleFactor", wide))
        factor = float(wide);
    else
        scene.mMetaData->Get("UnitScaleFactor", factor);
    if (is_unit(double(factor) / 100)) { // centimetres
        origin->unit_m = double(factor) / 100;
        origin->unit_by = SCENE_WORD_FILE;
    }
    scene.mMetaData->Get("UpAxis", axis);
    scene.mMetaData->Get("UpAxisSign", sign);
    if (axis < 0 || axis > 2 || sign < 0)
        refuse("its axis that points up is number %d of sign %d; only +X, +Y and +Z are read", axis,
               sign);
    origin->up = char('x' + axis);
    origin->up_by = SCENE_WORD_FILE;
}

uint32_t little(std::string_view bytes, size_t at, size_t count)
{
    uint32_t value = 0;
    for (size_t i = count; i-- > 0;)
        value =
            value << 8 | (at + i < bytes.size() ? static_cast<unsigned char>(bytes[at + i]) : 0);
    return value;
}

// The first bytes of the entry at a place of a ZIP archive (APPNOTE 6.3, sections 4.3.7 and 4.4.5).
std::string entry_head(std::string_view bytes, size_t at, uint32_t method, uint32_t packed)
{
    size_t begin = at + 30 + little(bytes, at + 26, 2) + little(bytes, at + 28, 2);
    if (begin >= bytes.size())
        return "";
    std::string_view data = bytes.substr(begin, packed);
    if (method == 0)
        return std::string(data.substr(0, HEAD_BYTES));
    std::string out(HEAD_BYTES, '\0');
    z_stream stream = {};
    if (method != 8 || inflateInit2(&stream, -MAX_WBITS) != Z_OK)
        return "";
    stream.next_in = reinterpret_cast<Bytef *>(const_cast<char *>(data.data()));
    stream.avail_in = uInt(data.size());
    stream.next_out = reinterpret_cast<Bytef *>(&out[0]);
    stream.avail_out = uInt(out.size());
    inflate(&stream, Z_SYNC_FLUSH);
    out.resize(out.size() - stream.avail_out);
    inflateEnd(&stream);
    return out;
}

struct scene_origin default_origin(const struct converter_input &input)
{
    struct scene_origin origin = {input.format, 1, 'y', SCENE_WORD_DEFAULT, SCENE_WORD_DEFAULT, 0};
    if (input.format == SCENE_FORMAT_3DS)
        origin.up = 'z';                       // every program that writes it means that
    if (input.format == SCENE_FORMAT_INVENTOR) // its nodes of type Units say otherwise in place
        origin.unit_by = origin.up_by = SCENE_WORD_FILE;
    if (input.format == SCENE_FORMAT_3MF) // 3MF Core Specification 1.3, sections 3.3 and 3.4
        origin = {input.format, 0.001, 'z', SCENE_WORD_FILE, SCENE_WORD_FILE, 0};
    return origin;
}

} // namespace

double read_3mf_unit(std::string_view bytes)
{
    static const struct {
        const char *name;
        double unit_m;
    } units[] = {{"micron", 1e-6}, {"millimeter", 0.001}, {"centimeter", 0.01},
                 {"inch", 0.0254}, {"foot", 0.3048},      {"meter", 1}};
    size_t end = bytes.rfind("PK\5\6");
    if (end == bytes.npos)
        return 0;
    size_t at = little(bytes, end + 16, 4), count = little(bytes, end + 10, 2);
    for (size_t i = 0; i < count && at + 46 <= bytes.size(); i++) {
        size_t name_bytes = little(bytes, at + 28, 2);
        std::string_view name = bytes.substr(at + 46, name_bytes);
        if (name.size() > 6 && name.substr(name.size() - 6) == ".model") {
            std::string unit =
                attribute(entry_head(bytes, little(bytes, at + 42, 4), little(bytes, at + 10, 2),
                                     little(bytes, at + 20, 4)),
                          "<model", " unit=");
            for (const auto &known : units)
                if (unit == known.name)
                    return known.unit_m;
            return 0;
        }
        at += 46 + name_bytes + little(bytes, at + 30, 2) + little(bytes, at + 32, 2);
    }
    return 0;
}

file_units read_units(const struct converter_input &input, const aiScene &scene)
{
    std::string_view bytes(static_cast<const char *>(input.root->bytes), input.root->size_bytes);
    file_units units = {default_origin(input), 1, 'y'};
    if (input.format == SCENE_FORMAT_COLLADA) {
        read_collada(bytes, &units.origin);
        units.applied_unit_m = units.origin.unit_m;
        units.applied_up = units.origin.up;
    } else if (input.format == SCENE_FORMAT_FBX) {
        undo_turn_of_root(scene);
        read_fbx(scene, &units.origin);
    } else if (input.format == SCENE_FORMAT_3MF) {
        double unit_m = read_3mf_unit(bytes);
        if (unit_m > 0)
            units.origin.unit_m = unit_m;
    } else if (input.format == SCENE_FORMAT_3DS) {
        units.applied_up = 'z';
    }
    return units;
}

} // namespace vitrail
