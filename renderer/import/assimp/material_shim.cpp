// SPDX-License-Identifier: MIT
// From the materials of Phong's days to metallic-roughness: docs/reference/scene-formats.md has the
// rules and their reasons.
#include "renderer/import/assimp/conversion.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <tuple>

#include <assimp/GltfMaterial.h>
#include <assimp/ObjMaterial.h>
#include <assimp/material.h>
#include <assimp/scene.h>

namespace vitrail
{

namespace
{

constexpr float DEFAULT_GREY = 0.8f, DEFAULT_ROUGHNESS = 0.5f; // where the file has no material
constexpr float OPAQUE = 0.9999f;                              // files keep decimals

struct phong {
    std::string name;
    bool is_default; // made up by assimp
    float kd[3], ks[3], ke[3];
    float exponent;            // Ns; 0: not given
    float dissolve;            // d
    float filter[3];           // Tf
    float ior;                 // Ni
    int illum;                 // of OBJ; -1: not given
    float roughness, metallic; // below 0: not given
    bool is_filter;            // filter is all that passes
};

void read_color(const aiMaterial &material, const char *key, unsigned type, unsigned index,
                float color[3])
{
    aiColor4D value(color[0], color[1], color[2], 1);
    material.Get(key, type, index, value);
    color[0] = value.r;
    color[1] = value.g;
    color[2] = value.b;
}

void check_factors(conversion_state &state, const char *what, const std::string &name,
                   float *values, int count, float most)
{
    for (int i = 0; i < count; i++) {
        if (!std::isfinite(values[i]))
            refuse("material '%.80s': %s is %g", name.c_str(), what, double(values[i]));
        float clamped = std::min(std::max(values[i], 0.0f), most);
        if (clamped != values[i])
            state.warn(text("material '%.80s': %s is clamped from %g to %g", name.c_str(), what,
                            double(values[i]), double(clamped)));
        values[i] = clamped;
    }
}

// IEC 61966-2-1.
float linear_of(float srgb)
{
    return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
}

// Colours of 3MF are those of pictures and have the coverage with them (Core Specification 1.3,
// section 5.1). COLLADA and FBX multiply what passes by a colour, and assimp has made one number of
// that; where the colour says more, it is taken back.
void settle_by_format(conversion_state &state, const aiMaterial &material, phong &out)
{
    if (state.input->format == SCENE_FORMAT_3MF) {
        aiColor4D color(1, 1, 1, 1);
        material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
        for (float &channel : out.kd)
            channel = linear_of(channel);
        out.dissolve = color.a;
    }
    if (state.input->format != SCENE_FORMAT_COLLADA && state.input->format != SCENE_FORMAT_FBX)
        return;
    float most = std::max({out.filter[0], out.filter[1], out.filter[2]});
    bool is_grey = most - std::min({out.filter[0], out.filter[1], out.filter[2]}) < 0.004f;
    std::string_view bytes(static_cast<const char *>(state.input->root->bytes),
                           state.input->root->size_bytes);
    bool is_shut =
        state.input->format == SCENE_FORMAT_COLLADA && bytes.find("RGB_ONE") != bytes.npos;
    if (out.dissolve < OPAQUE && !is_grey && is_shut)
        state.warn(text("material '%.80s': its transparent colour (RGB_ONE) is read as one number",
                        out.name.c_str()));
    if (is_grey || is_shut || out.dissolve >= OPAQUE) {
        out.filter[0] = out.filter[1] = out.filter[2] = 1;
        return;
    }
    float luminance =
        0.212671f * out.filter[0] + 0.715160f * out.filter[1] + 0.072169f * out.filter[2];
    float share = state.input->format == SCENE_FORMAT_COLLADA && luminance > 0
                      ? std::min((1 - out.dissolve) / luminance, 1 / most)
                      : 1;
    for (float &channel : out.filter)
        channel *= share;
    out.dissolve = 1;
    out.is_filter = true;
}

phong read_phong(conversion_state &state, const aiMaterial &material)
{
    phong out = {"", false, {1, 1, 1}, {0, 0, 0}, {0, 0, 0}, 0, 1, {1, 1, 1}, 1, -1, -1, -1, false};
    aiString name;
    material.Get(AI_MATKEY_NAME, name);
    out.name = name.C_Str();
    out.is_default = out.name == AI_DEFAULT_MATERIAL_NAME || out.name.empty();
    if (out.is_default)
        out.name = "default";
    read_color(material, AI_MATKEY_COLOR_DIFFUSE, out.kd);
    read_color(material, AI_MATKEY_COLOR_SPECULAR, out.ks);
    read_color(material, AI_MATKEY_COLOR_EMISSIVE, out.ke);
    read_color(material, AI_MATKEY_COLOR_TRANSPARENT, out.filter);
    material.Get(AI_MATKEY_SHININESS, out.exponent);
    material.Get(AI_MATKEY_OPACITY, out.dissolve);
    material.Get(AI_MATKEY_REFRACTI, out.ior);
    material.Get(AI_MATKEY_OBJ_ILLUM, out.illum);
    material.Get(AI_MATKEY_ROUGHNESS_FACTOR, out.roughness);
    material.Get(AI_MATKEY_METALLIC_FACTOR, out.metallic);
    settle_by_format(state, material, out);
    check_factors(state, "Kd", out.name, out.kd, 3, 1);
    check_factors(state, "Ks", out.name, out.ks, 3, 1);
    check_factors(state, "Ke", out.name, out.ke, 3, 1e6f);
    check_factors(state, "Tf", out.name, out.filter, 3, 1);
    check_factors(state, "Ns", out.name, &out.exponent, 1, 1e6f);
    check_factors(state, "d", out.name, &out.dissolve, 1, 1);
    return out;
}

float most_of(const float color[3])
{
    return std::max({color[0], color[1], color[2]});
}

// The filter says something: it is neither clear nor shut.
bool has_filter(const phong &from)
{
    return most_of(from.filter) > 0 &&
           std::min({from.filter[0], from.filter[1], from.filter[2]}) < OPAQUE;
}

// Light passes through what the illumination models of glass are asked for (4, 6, 7 and 9 of the
// MTL format), or what dissolves and has a filter colour.
bool is_glass(const phong &from)
{
    return from.is_filter || from.illum == 4 || from.illum == 6 || from.illum == 7 ||
           from.illum == 9 || (from.dissolve < OPAQUE && has_filter(from));
}

// Blinn's exponent n has the width of Beckmann's and GGX's alpha = sqrt(2 / (n + 2)) (Walter et al.
// 2007, "Microfacet Models for Refraction through Rough Surfaces", section 5.2), and glTF's
// roughness is the root of alpha.
float roughness_of(const phong &from)
{
    if (from.roughness >= 0)
        return std::min(from.roughness, 1.0f);
    if (from.exponent > 0)
        return std::pow(2 / (from.exponent + 2), 0.25f);
    return is_glass(from) ? 0 : most_of(from.ks) > 0 ? DEFAULT_ROUGHNESS : 1;
}

bool begins_with(const void *bytes, size_t size_bytes, const char *letters, size_t count)
{
    return size_bytes > count && memcmp(bytes, letters, count) == 0;
}

// PNG, JPEG, WebP and BMP are recognised by their first bytes, TGA by its name: it has no letters.
bool is_readable_image(const void *bytes, size_t size_bytes, const std::string &suffix)
{
    return begins_with(bytes, size_bytes, "\x89PNG\r\n\x1a\n", 8) ||
           begins_with(bytes, size_bytes, "\xff\xd8\xff", 3) ||
           begins_with(bytes, size_bytes, "BM", 2) ||
           (begins_with(bytes, size_bytes, "RIFF", 4) && size_bytes > 12 &&
            memcmp(static_cast<const char *>(bytes) + 8, "WEBP", 4) == 0) ||
           suffix == "tga" || suffix == "vda" || suffix == "icb" || suffix == "vst";
}

// In lower case, of a path or, of an embedded texture, what the scene calls its format.
std::string suffix_of(const aiTexture *embedded, const std::string &path)
{
    size_t dot = path.rfind('.');
    std::string suffix = embedded && *embedded->achFormatHint ? embedded->achFormatHint
                         : dot == path.npos                   ? ""
                                                              : path.substr(dot + 1);
    for (char &c : suffix)
        c = char(std::tolower(static_cast<unsigned char>(c)));
    return suffix;
}

std::string percent_encoded(const char *path)
{
    std::string out;
    for (; *path; path++) {
        unsigned char c = static_cast<unsigned char>(*path);
        if (strchr("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/", c))
            out += char(c);
        else
            out += text("%%%02X", c);
    }
    return out;
}

// The source of an image: of the scene itself, or a file of the upload. "": left out, with a
// warning.
std::string image_source(conversion_state &state, const aiScene &scene, const std::string &path,
                         texture_table &textures)
{
    const aiTexture *embedded = scene.GetEmbeddedTexture(path.c_str());
    const struct scene_file *file = embedded ? nullptr : state.find(path);
    if (embedded && embedded->mHeight > 0) {
        state.warn(text("texture '%.120s' is left out: bare pixels are not read", path.c_str()));
        return "";
    }
    if (!embedded && !file) {
        state.warn(
            text("texture '%.120s' is left out: it is not among the uploaded files", path.c_str()));
        return "";
    }
    const void *bytes = embedded ? embedded->pcData : file->bytes;
    size_t size_bytes = embedded ? embedded->mWidth : file->size_bytes;
    if (!is_readable_image(bytes, size_bytes, suffix_of(embedded, path))) {
        state.warn(text("texture '%.120s' is left out: it is none of PNG, JPEG, WebP, BMP and TGA",
                        path.c_str()));
        return "";
    }
    if (file)
        return "\"uri\":" + json_string(percent_encoded(file->name));
    textures.embedded.emplace_back(bytes, size_bytes);
    return text("\"bufferView\":%zu", textures.embedded.size() - 1);
}

int texture_of(conversion_state &state, const aiScene &scene, const std::string &path,
               texture_table &textures)
{
    auto known = textures.index.find(path);
    if (known != textures.index.end())
        return known->second;
    std::string source = image_source(state, scene, path, textures);
    int index = -1;
    if (!source.empty()) {
        index = int(textures.textures.size());
        textures.images.push_back("{\"name\":" + json_string(path) + "," + source + "}");
        textures.textures.push_back(text("{\"source\":%d}", index));
    }
    textures.index[path] = index;
    return index;
}

struct texture_slot {
    aiTextureType type;
    const char *name; // in a warning
};

// The member of glTF with the first texture of that kind, with its comma in front; "": none.
std::string texture_member(conversion_state &state, const aiScene &scene,
                           const aiMaterial &material, aiTextureType type, const char *member,
                           texture_table &textures)
{
    aiString path;
    unsigned set = 0;
    if (material.GetTexture(type, 0, &path, nullptr, &set) != aiReturn_SUCCESS)
        return "";
    int index = texture_of(state, scene, path.C_Str(), textures);
    if (index < 0)
        return "";
    return text(",\"%s\":{\"index\":%d%s}", member, index, set == 1 ? ",\"texCoord\":1" : "");
}

void warn_of_left_out(conversion_state &state, const aiMaterial &material, const std::string &name)
{
    static const texture_slot slots[] = {
        {aiTextureType_SPECULAR, "specular"},
        {aiTextureType_SHININESS, "shininess"},
        {aiTextureType_OPACITY, "opacity"},
        {aiTextureType_HEIGHT, "bump"},
        {aiTextureType_DISPLACEMENT, "displacement"},
        {aiTextureType_REFLECTION, "reflection"},
        {aiTextureType_METALNESS, "metalness"},
        {aiTextureType_DIFFUSE_ROUGHNESS, "roughness"},
    };
    for (const texture_slot &slot : slots)
        if (material.GetTextureCount(slot.type) > 0)
            state.warn(
                text("material '%.80s': its %s texture is left out", name.c_str(), slot.name));
}

// What passes through glass is tinted by the filter, or by the diffuse colour where there is none.
void base_color_of(const phong &from, const surface_use &use, bool has_texture, float out[4])
{
    const float *color = from.kd;
    static const float white[3] = {1, 1, 1};
    if (is_glass(from))
        color = has_filter(from) ? from.filter : most_of(from.kd) > 0 ? from.kd : white;
    else if (from.is_default && use.has_colors)
        color = white;
    for (int i = 0; i < 3; i++)
        out[i] = from.is_default && !use.has_colors && !is_glass(from) && !has_texture
                     ? DEFAULT_GREY
                     : color[i];
    out[3] = is_glass(from) ? 1 : from.dissolve;
}

std::string extensions_of(const phong &from)
{
    std::string out;
    float emission = most_of(from.ke);
    if (is_glass(from)) {
        float share = from.dissolve < OPAQUE ? 1 - from.dissolve : 1;
        out += text(",\"KHR_materials_transmission\":{\"transmissionFactor\":%.9g}", double(share));
        if (from.ior > 1 && std::isfinite(from.ior))
            out += text(",\"KHR_materials_ior\":{\"ior\":%.9g}", double(from.ior));
    }
    if (emission > 1)
        out += text(",\"KHR_materials_emissive_strength\":{\"emissiveStrength\":%.9g}",
                    double(emission));
    return out.empty() ? "" : ",\"extensions\":{" + out.substr(1) + "}";
}

} // namespace

bool surface_use::operator<(const surface_use &other) const
{
    return std::tie(has_colors, has_alpha, is_closed) <
           std::tie(other.has_colors, other.has_alpha, other.is_closed);
}

std::string write_material(conversion_state &state, const aiScene &scene,
                           const aiMaterial &material, const surface_use &use,
                           texture_table &textures)
{
    phong from = read_phong(state, material);
    bool is_clear = is_glass(from);
    warn_of_left_out(state, material, from.name);
    std::string color_texture =
        texture_member(state, scene, material, aiTextureType_DIFFUSE, "baseColorTexture", textures);
    float base[4];
    base_color_of(from, use, !color_texture.empty(), base);
    std::string out = "{\"name\":" + json_string(from.name) + ",\"pbrMetallicRoughness\":{" +
                      "\"baseColorFactor\":" + json_numbers(base, 4) +
                      text(",\"metallicFactor\":%.9g,\"roughnessFactor\":%.9g",
                           double(std::min(std::max(from.metallic, 0.0f), 1.0f)),
                           double(from.is_default ? DEFAULT_ROUGHNESS : roughness_of(from))) +
                      color_texture + "}";
    float emission = std::max(most_of(from.ke), 1.0f);
    const float emissive[3] = {from.ke[0] / emission, from.ke[1] / emission, from.ke[2] / emission};
    if (most_of(emissive) > 0)
        out += ",\"emissiveFactor\":" + json_numbers(emissive, 3) +
               texture_member(state, scene, material, aiTextureType_EMISSIVE, "emissiveTexture",
                              textures);
    out += texture_member(state, scene, material, aiTextureType_NORMALS, "normalTexture", textures);
    if (!is_clear && (from.dissolve < OPAQUE || use.has_alpha))
        out += ",\"alphaMode\":\"BLEND\"";
    // A body that is closed is seen from outside, and its far walls filter nothing once more.
    bool is_transparent = is_clear || from.dissolve < OPAQUE || use.has_alpha;
    if (!is_transparent || !use.is_closed)
        out += ",\"doubleSided\":true";
    return out + extensions_of(from) + "}";
}

} // namespace vitrail
