// SPDX-License-Identifier: MIT
// What assimp (5.1 to 6) gets wrong in COLLADA is put right in the text before: morph controllers,
// which it loses with their meshes, and channels of animations that move no node.
#include "renderer/import/assimp/conversion.h"

#include <algorithm>
#include <cstring>

namespace vitrail
{

namespace
{

// The value of an attribute of a tag; "": it has none of that name.
std::string_view attribute(std::string_view tag, std::string_view name)
{
    for (size_t at = tag.find(name); at != tag.npos; at = tag.find(name, at + 1)) {
        size_t open = at + name.size();
        bool is_whole = at > 0 && strchr(" \t\r\n", tag[at - 1]) && open + 1 < tag.size() &&
                        tag[open] == '=' && strchr("\"'", tag[open + 1]);
        if (is_whole)
            return tag.substr(open + 2, tag.find(tag[open + 1], open + 2) - open - 2);
    }
    return "";
}

// The next tag of that beginning from there on, with where it ends; "": there is none.
std::string_view next_tag(std::string_view xml, std::string_view begin, size_t *at)
{
    size_t from = xml.find(begin, *at);
    if (from == xml.npos)
        return "";
    *at = std::min(xml.find('>', from), xml.size());
    return xml.substr(from, *at - from);
}

// Assimp ends a channel without a word where a time is no number.
void check_times(std::string_view bytes)
{
    std::set<std::string_view> times;
    std::string_view tag;
    for (size_t at = 0; !(tag = next_tag(bytes, "<input", &at)).empty();)
        if (attribute(tag, "semantic") == "INPUT" && attribute(tag, "source").size() > 1)
            times.insert(attribute(tag, "source").substr(1));
    for (size_t at = 0; !times.empty() && !(tag = next_tag(bytes, "<source", &at)).empty();) {
        if (times.count(attribute(tag, "id")) == 0)
            continue;
        size_t begin = at;
        next_tag(bytes, "<float_array", &begin);
        std::string_view numbers = bytes.substr(begin, bytes.find('<', begin) - begin);
        size_t letter = numbers.find_first_of("nNiI#");
        if (letter != numbers.npos)
            refuse("the times '%.80s' of an animation have one that is no number: '%.16s'",
                   std::string(attribute(tag, "id")).c_str(),
                   std::string(numbers.substr(letter, 16)).c_str());
    }
}

struct morph_controller {
    size_t begin, end;   // in the text
    std::string_view of; // what it morphs, by id
};

std::map<std::string_view, morph_controller> find_morphs(std::string_view bytes)
{
    static const std::string_view end = "</controller>";
    std::map<std::string_view, morph_controller> found;
    std::string_view tag;
    for (size_t at = 0; !(tag = next_tag(bytes, "<controller", &at)).empty();) {
        size_t close = bytes.find(end, at), inside = at;
        if (close == bytes.npos)
            break;
        std::string_view morph = next_tag(bytes.substr(0, close), "<morph", &inside);
        std::string_view of = attribute(morph, "source");
        if (of.size() > 1 && of[0] == '#')
            found[attribute(tag, "id")] = {size_t(tag.data() - bytes.data()), close + end.size(),
                                           of.substr(1)};
    }
    return found;
}

// What the text has in quotes, from the place after the quote on.
std::string_view quoted(std::string_view bytes, size_t at)
{
    return bytes.substr(at, std::min(bytes.find(bytes[at - 1], at), bytes.size()) - at);
}

// Leaves the controllers out, and names what they morph in their place.
std::string drop_morphs(std::string_view bytes,
                        const std::map<std::string_view, morph_controller> &morphs)
{
    if (morphs.empty())
        return std::string(bytes);
    std::map<size_t, size_t> ends; // by begin
    for (const auto &morph : morphs)
        ends[morph.second.begin] = morph.second.end;
    std::string out;
    out.reserve(bytes.size());
    for (size_t at = 0; at < bytes.size();) {
        auto drop = ends.find(bytes[at] == '<' ? at : bytes.npos);
        if (drop != ends.end()) {
            at = drop->second;
            continue;
        }
        out += bytes[at++];
        bool is_reference = at < bytes.size() && bytes[at] == '#' && strchr("\"'", bytes[at - 1]);
        if (!is_reference)
            continue;
        std::string_view name = quoted(bytes, at).substr(1), of = name;
        for (size_t i = 0; i < morphs.size() && morphs.count(of); i++)
            of = morphs.at(of).of;
        if (of != name) {
            (out += '#') += of;
            at += 1 + name.size();
        }
    }
    return out;
}

// Assimp takes a channel without a part for one of any node whose name it begins with, and writes
// beyond its memory for one of weights.
std::string drop_channels(conversion_state &state, const std::string &bytes)
{
    std::string out;
    size_t done = 0, count = 0;
    std::string_view tag, whole = bytes;
    for (size_t at = 0; !(tag = next_tag(whole, "<channel", &at)).empty();) {
        std::string_view target = attribute(tag, "target");
        bool moves_node =
            target.find('/') != target.npos && target.find("morph-weights") == target.npos;
        if (target.empty() || moves_node)
            continue;
        size_t begin = size_t(target.data() - whole.data());
        out += whole.substr(done, begin - done);
        out += text(" %zu/ ", count++); // no two alike: assimp joins those that differ
        done = begin + target.size();
        state.warn(text("the animation of '%.80s' is left out: it is no transform of a node",
                        std::string(target).c_str()));
    }
    return out += whole.substr(done);
}

} // namespace

std::string prepare_collada(conversion_state &state, std::string_view bytes)
{
    check_times(bytes);
    std::map<std::string_view, morph_controller> morphs = find_morphs(bytes);
    if (!morphs.empty())
        state.warn(text("morph targets are left out, of controllers: %zu; assimp does not read "
                        "those of COLLADA",
                        morphs.size()));
    return drop_channels(state, drop_morphs(bytes, morphs));
}

} // namespace vitrail
