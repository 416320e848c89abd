// SPDX-License-Identifier: MIT
// Whether a PLY file has what its header tells (Turk 1994, "The PLY Polygon File Format"). Assimp
// makes up what is missing, and so this is asked first.
#include "renderer/import/assimp/conversion.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace vitrail
{

namespace
{

// Bytes of one value; 0: there is no such type.
size_t type_bytes(std::string_view type)
{
    static const struct {
        const char *name;
        size_t bytes;
    } types[] = {{"char", 1},  {"uchar", 1},  {"short", 2},   {"ushort", 2},
                 {"int", 4},   {"uint", 4},   {"float", 4},   {"double", 8},
                 {"int8", 1},  {"uint8", 1},  {"int16", 2},   {"uint16", 2},
                 {"int32", 4}, {"uint32", 4}, {"float32", 4}, {"float64", 8}};
    for (const auto &known : types)
        if (type == known.name)
            return known.bytes;
    return 0;
}

bool is_float(std::string_view type)
{
    return type[0] == 'f' || type[0] == 'd';
}

struct property {
    size_t bytes, count_bytes; // count_bytes above 0: a list with such a count in front
};
struct element {
    std::string name;
    uint64_t count;
    std::vector<property> properties;
};

struct ply_reader {
    std::string_view bytes;
    size_t at = 0;
    bool is_ascii = false, is_big = false;
    std::vector<element> elements;

    std::string_view line();
    std::string_view word(std::string_view &rest) const;
    void add_property(std::string_view rest);
    void add_element(std::string_view rest);
    void read_header();
    uint64_t read_count(const element &of, uint64_t index, size_t count_bytes);
    void check_binary(const element &of);
    void check_text(const element &of);
};

std::string_view ply_reader::line()
{
    if (at >= bytes.size())
        refuse("the file ends within its header");
    size_t end = bytes.find('\n', at);
    std::string_view found = bytes.substr(at, end == bytes.npos ? end : end - at);
    at = end == bytes.npos ? bytes.size() : end + 1;
    return found;
}

std::string_view ply_reader::word(std::string_view &rest) const
{
    size_t begin = rest.find_first_not_of(" \t\r");
    if (begin == rest.npos)
        return rest = {};
    rest.remove_prefix(begin);
    size_t length = std::min(rest.find_first_of(" \t\r"), rest.size());
    std::string_view found = rest.substr(0, length);
    rest.remove_prefix(length);
    return found;
}

void ply_reader::add_property(std::string_view rest)
{
    std::string_view type = word(rest), count_type;
    if (type == "list") {
        count_type = word(rest);
        type = word(rest);
        if (type_bytes(count_type) == 0 || is_float(count_type))
            refuse("its header has a list that is counted by '%.40s'",
                   std::string(count_type).c_str());
    }
    if (type_bytes(type) == 0)
        refuse("its header has a property of the unknown type '%.40s'", std::string(type).c_str());
    if (elements.empty())
        refuse("its header has a property before the first element");
    elements.back().properties.push_back(
        {type_bytes(type), count_type.empty() ? 0 : type_bytes(count_type)});
}

void ply_reader::add_element(std::string_view rest)
{
    std::string name(word(rest)), count(word(rest));
    if (count.empty() || count.find_first_not_of("0123456789") != count.npos || count.size() > 18)
        refuse("its header tells '%.40s' elements '%.40s'", count.c_str(), name.c_str());
    elements.push_back({name, strtoull(count.c_str(), nullptr, 10), {}});
}

void ply_reader::read_header()
{
    std::string_view first = line();
    if (word(first) != "ply")
        refuse("it does not begin with 'ply'");
    for (bool has_format = false;;) {
        std::string_view rest = line(), key = word(rest);
        if (key == "format") {
            std::string form(word(rest));
            is_ascii = form == "ascii";
            is_big = form == "binary_big_endian";
            if (!is_ascii && !is_big && form != "binary_little_endian")
                refuse("its format is '%.40s'", form.c_str());
            has_format = true;
        } else if (key == "element") {
            add_element(rest);
        } else if (key == "property") {
            add_property(rest);
        } else if (key == "end_header") {
            if (!has_format)
                refuse("its header names no format");
            return;
        } else if (!key.empty() && key != "comment" && key != "obj_info") {
            refuse("its header has a line '%.40s'", std::string(key).c_str());
        }
    }
}

[[noreturn]] void refuse_end(const element &of, uint64_t index)
{
    refuse("the file ends at %s %llu; its header tells %llu", of.name.substr(0, 40).c_str(),
           static_cast<unsigned long long>(index), static_cast<unsigned long long>(of.count));
}

uint64_t ply_reader::read_count(const element &of, uint64_t index, size_t count_bytes)
{
    if (count_bytes > bytes.size() - at)
        refuse_end(of, index);
    uint64_t count = 0;
    for (size_t i = 0; i < count_bytes; i++)
        count =
            count << 8 | static_cast<unsigned char>(bytes[at + (is_big ? i : count_bytes - 1 - i)]);
    at += count_bytes;
    return count;
}

void ply_reader::check_binary(const element &of)
{
    for (uint64_t i = 0; i < of.count; i++)
        for (const property &part : of.properties) {
            uint64_t values = part.count_bytes ? read_count(of, i, part.count_bytes) : 1;
            if (values > (bytes.size() - at) / part.bytes)
                refuse_end(of, i);
            at += values * part.bytes;
        }
}

// One line each, with as many values as its properties have. Blank lines are passed over.
void ply_reader::check_text(const element &of)
{
    for (uint64_t i = 0; i < of.count; i++) {
        std::string_view rest;
        do {
            if (at >= bytes.size())
                refuse_end(of, i);
            rest = line();
        } while (rest.find_first_not_of(" \t\r") == rest.npos);
        for (const property &part : of.properties) {
            uint64_t values = 1;
            if (part.count_bytes)
                values = strtoull(std::string(word(rest)).c_str(), nullptr, 10);
            for (uint64_t k = 0; k < values; k++)
                if (word(rest).empty())
                    refuse("%s %llu has fewer values than its properties",
                           of.name.substr(0, 40).c_str(), static_cast<unsigned long long>(i));
        }
        if (!word(rest).empty())
            refuse("%s %llu has more values than its properties", of.name.substr(0, 40).c_str(),
                   static_cast<unsigned long long>(i));
    }
}

} // namespace

void check_ply(std::string_view bytes)
{
    ply_reader reader;
    reader.bytes = bytes;
    reader.read_header();
    for (const element &of : reader.elements) {
        if (of.properties.empty() && of.count > 0)
            refuse("its header tells no property of '%.40s'", of.name.c_str());
        if (reader.is_ascii)
            reader.check_text(of);
        else
            reader.check_binary(of);
    }
    size_t rest = reader.is_ascii ? bytes.find_first_not_of(" \t\r\n", reader.at) : reader.at;
    if (rest < bytes.size())
        refuse("after what its header tells, %zu bytes follow", bytes.size() - rest);
}

} // namespace vitrail
