// SPDX-License-Identifier: MIT
// The one home of tinygltf (2.7 to 2.9): from glTF JSON to the plain C arrays of gltf_shim.h.
//
// Known traps of these versions and why they cannot bite: it opens any URI (CVE-2022-3008, issue
// 373) and copies the BIN chunk once per buffer, but is given a document without buffers and
// images; its GLB reader (issue 372) is not called; its recursive conversions are bounded by the
// depth that gltf_json.c allows. The callbacks below refuse everything, as the second line of
// defence.
#include "renderer/import/gltf_shim.h"

#include <exception>
#include <map>
#include <new>
#include <string>
#include <vector>

#include <tiny_gltf.h>

static_assert(int(GLTF_FLOAT) == TINYGLTF_COMPONENT_TYPE_FLOAT,
              "components keep the numbers of glTF");

namespace
{

struct holder {
    gltf_document document; // first: gltf_document_destroy casts back
    tinygltf::Model model;
    std::vector<const char *> used, required, variants;
    std::vector<gltf_buffer_view> views;
    std::vector<gltf_accessor> accessors;
    std::vector<std::vector<gltf_primitive>> primitives;
    std::vector<std::vector<gltf_target>> targets;           // per primitive
    std::vector<std::vector<gltf_variant_mapping>> mappings; // per primitive
    std::vector<gltf_mesh> meshes;
    std::vector<gltf_node> nodes;
    std::vector<gltf_scene> scenes;
    std::vector<gltf_material> materials;
    std::vector<gltf_texture> textures;
    std::vector<gltf_sampler> samplers;
    std::vector<gltf_light> lights;
    std::vector<gltf_camera> cameras;
    std::vector<gltf_grid> grids;
    std::vector<std::vector<double>> numbers; // arrays that came out of extensions and extras
    std::vector<std::vector<int>> integers;   // likewise
};

bool refuse_exists(const std::string &, void *)
{
    return false;
}
std::string refuse_expand(const std::string &, void *)
{
    return std::string();
}

bool refuse_read(std::vector<unsigned char> *, std::string *, const std::string &, void *)
{
    return false;
}

bool refuse_write(std::string *, const std::string &, const std::vector<unsigned char> &, void *)
{
    return false;
}

// tinygltf has a fifth callback since 2.9, and then takes all of them or none.
template <typename callbacks>
auto refuse_sizes(callbacks &fs, int) -> decltype(fs.GetFileSizeInBytes, void())
{
    fs.GetFileSizeInBytes = [](size_t *, std::string *, const std::string &, void *) {
        return false;
    };
}

template <typename callbacks> void refuse_sizes(callbacks &, long) {}

// The result of SetFsCallbacks, which older versions do not have.
template <typename loader>
auto take_callbacks(loader &gltf, const tinygltf::FsCallbacks &fs, int)
    -> decltype(bool(gltf.SetFsCallbacks(fs)))
{
    return gltf.SetFsCallbacks(fs);
}

template <typename loader> bool take_callbacks(loader &gltf, const tinygltf::FsCallbacks &fs, long)
{
    gltf.SetFsCallbacks(fs);
    return true;
}

// False where tinygltf would go on opening files by itself.
bool refuse_files(tinygltf::TinyGLTF &loader)
{
    tinygltf::FsCallbacks fs{};
    fs.FileExists = refuse_exists;
    fs.ExpandFilePath = refuse_expand;
    fs.ReadWholeFile = refuse_read;
    fs.WriteWholeFile = refuse_write;
    refuse_sizes(fs, 0);
    return take_callbacks(loader, fs, 0);
}

bool refuse_image(tinygltf::Image *, const int, std::string *, std::string *, int, int,
                  const unsigned char *, int, void *)
{
    return false;
}

gltf_numbers numbers_of(const std::vector<double> &values)
{
    return {values.data(), values.size()};
}
gltf_indices indices_of(const std::vector<int> &values)
{
    return {values.data(), values.size()};
}

const tinygltf::Value *member(const tinygltf::Value *object, const char *name)
{
    return object && object->IsObject() && object->Has(name) ? &object->Get(name) : nullptr;
}

const tinygltf::Value *extension(const tinygltf::ExtensionMap &map, const char *name)
{
    auto found = map.find(name);
    return found == map.end() ? nullptr : &found->second;
}

double number(const tinygltf::Value *object, const char *name, double fallback)
{
    const tinygltf::Value *value = member(object, name);
    return value && value->IsNumber() ? value->GetNumberAsDouble() : fallback;
}

int integer(const tinygltf::Value *object, const char *name, int fallback)
{
    const tinygltf::Value *value = member(object, name);
    return value && value->IsInt() ? value->GetNumberAsInt() : fallback;
}

const char *text(const tinygltf::Value *object, const char *name, const char *fallback)
{
    const tinygltf::Value *value = member(object, name);
    return value && value->IsString() ? value->Get<std::string>().c_str() : fallback;
}

gltf_numbers number_array(holder &h, const tinygltf::Value *object, const char *name)
{
    const tinygltf::Value *value = member(object, name);
    if (!value || !value->IsArray())
        return {nullptr, 0};
    std::vector<double> values;
    for (size_t i = 0; i < value->ArrayLen(); i++) {
        const tinygltf::Value &element = value->Get(int(i));
        if (element.IsNumber())
            values.push_back(element.GetNumberAsDouble());
    }
    h.numbers.push_back(std::move(values));
    return numbers_of(h.numbers.back());
}

void read_transform(holder &h, gltf_texture_ref &ref, const tinygltf::Value *transform)
{
    if (!transform)
        return;
    ref.has_transform = true;
    ref.offset = number_array(h, transform, "offset");
    ref.scale = number_array(h, transform, "scale");
    ref.rotation_rad = number(transform, "rotation", 0);
    ref.texcoord = integer(transform, "texCoord", ref.texcoord);
}

template <typename info> gltf_texture_ref texture_ref(holder &h, const info &texture)
{
    gltf_texture_ref ref = {};
    ref.texture = texture.index;
    ref.texcoord = texture.texCoord;
    read_transform(h, ref, extension(texture.extensions, "KHR_texture_transform"));
    return ref;
}

gltf_texture_ref texture_ref_in(holder &h, const tinygltf::Value *object, const char *name)
{
    const tinygltf::Value *info = member(object, name);
    gltf_texture_ref ref = {};
    ref.texture = integer(info, "index", -1);
    ref.texcoord = integer(info, "texCoord", 0);
    read_transform(h, ref, member(member(info, "extensions"), "KHR_texture_transform"));
    return ref;
}

void convert_textures(holder &h, const tinygltf::Material &m, gltf_material &out)
{
    const tinygltf::PbrMetallicRoughness &pbr = m.pbrMetallicRoughness;
    out.textures[GLTF_TEXTURE_BASE_COLOR] = texture_ref(h, pbr.baseColorTexture);
    out.textures[GLTF_TEXTURE_METALLIC_ROUGHNESS] = texture_ref(h, pbr.metallicRoughnessTexture);
    out.textures[GLTF_TEXTURE_NORMAL] = texture_ref(h, m.normalTexture);
    out.textures[GLTF_TEXTURE_OCCLUSION] = texture_ref(h, m.occlusionTexture);
    out.textures[GLTF_TEXTURE_EMISSIVE] = texture_ref(h, m.emissiveTexture);
    out.textures[GLTF_TEXTURE_TRANSMISSION] = texture_ref_in(
        h, extension(m.extensions, "KHR_materials_transmission"), "transmissionTexture");
    out.textures[GLTF_TEXTURE_THICKNESS] =
        texture_ref_in(h, extension(m.extensions, "KHR_materials_volume"), "thicknessTexture");
}

// Lobes beside that of metallic-roughness: KHR_materials_specular, _clearcoat, _sheen.
void convert_lobes(holder &h, const tinygltf::Material &m, gltf_material &out)
{
    const tinygltf::Value *specular = extension(m.extensions, "KHR_materials_specular");
    const tinygltf::Value *coat = extension(m.extensions, "KHR_materials_clearcoat");
    const tinygltf::Value *sheen = extension(m.extensions, "KHR_materials_sheen");
    out.has_specular = specular != nullptr;
    out.specular = number(specular, "specularFactor", 1);
    out.specular_color = number_array(h, specular, "specularColorFactor");
    out.has_clearcoat = coat != nullptr;
    out.clearcoat = number(coat, "clearcoatFactor", 0);
    out.clearcoat_roughness = number(coat, "clearcoatRoughnessFactor", 0);
    out.has_sheen = sheen != nullptr;
    out.sheen_color = number_array(h, sheen, "sheenColorFactor");
    out.sheen_roughness = number(sheen, "sheenRoughnessFactor", 0);
    gltf_texture_ref *textures = out.textures;
    textures[GLTF_TEXTURE_SPECULAR] = texture_ref_in(h, specular, "specularTexture");
    textures[GLTF_TEXTURE_SPECULAR_COLOR] = texture_ref_in(h, specular, "specularColorTexture");
    textures[GLTF_TEXTURE_CLEARCOAT] = texture_ref_in(h, coat, "clearcoatTexture");
    textures[GLTF_TEXTURE_CLEARCOAT_ROUGHNESS] =
        texture_ref_in(h, coat, "clearcoatRoughnessTexture");
    textures[GLTF_TEXTURE_CLEARCOAT_NORMAL] = texture_ref_in(h, coat, "clearcoatNormalTexture");
    out.clearcoat_normal_scale = number(member(coat, "clearcoatNormalTexture"), "scale", 1);
    textures[GLTF_TEXTURE_SHEEN_COLOR] = texture_ref_in(h, sheen, "sheenColorTexture");
    textures[GLTF_TEXTURE_SHEEN_ROUGHNESS] = texture_ref_in(h, sheen, "sheenRoughnessTexture");
}

void convert_iridescence(holder &h, const tinygltf::Material &m, gltf_material &out)
{
    const tinygltf::Value *film = extension(m.extensions, "KHR_materials_iridescence");
    out.iridescence = number(film, "iridescenceFactor", 0);
    out.iridescence_ior = number(film, "iridescenceIor", 1.3);
    out.iridescence_least_nm = number(film, "iridescenceThicknessMinimum", 100);
    out.iridescence_most_nm = number(film, "iridescenceThicknessMaximum", 400);
    out.textures[GLTF_TEXTURE_IRIDESCENCE] = texture_ref_in(h, film, "iridescenceTexture");
    out.textures[GLTF_TEXTURE_IRIDESCENCE_THICKNESS] =
        texture_ref_in(h, film, "iridescenceThicknessTexture");
}

void convert_diffuse_transmission(holder &h, const tinygltf::Material &m, gltf_material &out)
{
    const tinygltf::Value *passed = extension(m.extensions, "KHR_materials_diffuse_transmission");
    out.diffuse_transmission = number(passed, "diffuseTransmissionFactor", 0);
    out.diffuse_transmission_color = number_array(h, passed, "diffuseTransmissionColorFactor");
    out.textures[GLTF_TEXTURE_DIFFUSE_TRANSMISSION] =
        texture_ref_in(h, passed, "diffuseTransmissionTexture");
    out.textures[GLTF_TEXTURE_DIFFUSE_TRANSMISSION_COLOR] =
        texture_ref_in(h, passed, "diffuseTransmissionColorTexture");
}

void convert_anisotropy(holder &h, const tinygltf::Material &m, gltf_material &out)
{
    const tinygltf::Value *grain = extension(m.extensions, "KHR_materials_anisotropy");
    out.anisotropy = number(grain, "anisotropyStrength", 0);
    out.anisotropy_rad = number(grain, "anisotropyRotation", 0);
    out.textures[GLTF_TEXTURE_ANISOTROPY] = texture_ref_in(h, grain, "anisotropyTexture");
}

void convert_material(holder &h, const tinygltf::Material &m)
{
    const tinygltf::PbrMetallicRoughness &pbr = m.pbrMetallicRoughness;
    const tinygltf::Value *volume = extension(m.extensions, "KHR_materials_volume");
    const tinygltf::Value *pass = member(member(&m.extras, "vitrail"), "pass_through");
    const tinygltf::Value *model = member(pass, "model");
    gltf_material out = {};
    out.name = m.name.c_str();
    out.alpha_mode = m.alphaMode.c_str();
    out.alpha_cutoff = m.alphaCutoff;
    out.is_double_sided = m.doubleSided;
    out.is_unlit = extension(m.extensions, "KHR_materials_unlit") != nullptr;
    out.base_color = numbers_of(pbr.baseColorFactor);
    out.emissive = numbers_of(m.emissiveFactor);
    out.metallic = pbr.metallicFactor;
    out.roughness = pbr.roughnessFactor;
    out.normal_scale = m.normalTexture.scale;
    out.occlusion_strength = m.occlusionTexture.strength;
    out.emissive_strength =
        number(extension(m.extensions, "KHR_materials_emissive_strength"), "emissiveStrength", 1);
    out.transmission =
        number(extension(m.extensions, "KHR_materials_transmission"), "transmissionFactor", 0);
    out.ior = number(extension(m.extensions, "KHR_materials_ior"), "ior", 1.5);
    out.dispersion = number(extension(m.extensions, "KHR_materials_dispersion"), "dispersion", 0);
    out.thickness = number(volume, "thicknessFactor", 0);
    out.has_attenuation_distance = member(volume, "attenuationDistance") != nullptr;
    out.attenuation_distance = number(volume, "attenuationDistance", 0);
    out.attenuation_color = number_array(h, volume, "attenuationColor");
    out.pass_through = model && model->IsString() ? model->Get<std::string>().c_str()
                       : pass                     ? "?"
                                                  : "";
    out.edge_color = number_array(h, pass, "edge_color");
    out.edge_exponent = number(pass, "edge_exponent", 1);
    convert_lobes(h, m, out);
    convert_iridescence(h, m, out);
    convert_anisotropy(h, m, out);
    convert_diffuse_transmission(h, m, out);
    convert_textures(h, m, out);
    h.materials.push_back(out);
}

gltf_meshopt meshopt_of(const tinygltf::BufferView &v)
{
    gltf_meshopt out = {};
    const tinygltf::Value *object = nullptr;
    for (const char *name : {"KHR_meshopt_compression", "EXT_meshopt_compression"})
        if (!object && (object = extension(v.extensions, name)))
            out.extension = name;
    out.buffer = integer(object, "buffer", -1);
    out.byte_offset = integer(object, "byteOffset", 0);
    out.byte_length = integer(object, "byteLength", -1);
    out.byte_stride = integer(object, "byteStride", -1);
    out.count = integer(object, "count", -1);
    out.mode = text(object, "mode", "");
    out.filter = text(object, "filter", "NONE");
    return out;
}

int component_count(int type)
{
    switch (type) {
    case TINYGLTF_TYPE_SCALAR:
        return 1;
    case TINYGLTF_TYPE_VEC2:
        return 2;
    case TINYGLTF_TYPE_VEC3:
        return 3;
    case TINYGLTF_TYPE_VEC4:
        return 4;
    default:
        return 0;
    }
}

void convert_accessor(holder &h, const tinygltf::Accessor &a)
{
    gltf_accessor out = {};
    out.buffer_view = a.bufferView;
    out.byte_offset = a.byteOffset;
    out.count = a.count;
    out.component = a.componentType;
    out.components = component_count(a.type);
    out.is_matrix_4x4 = a.type == TINYGLTF_TYPE_MAT4;
    out.is_normalized = a.normalized;
    out.is_sparse = a.sparse.isSparse;
    if (out.is_sparse) {
        out.sparse_count = a.sparse.count;
        out.sparse_index_view = a.sparse.indices.bufferView;
        out.sparse_index_offset = a.sparse.indices.byteOffset;
        out.sparse_index_component = a.sparse.indices.componentType;
        out.sparse_value_view = a.sparse.values.bufferView;
        out.sparse_value_offset = a.sparse.values.byteOffset;
    }
    h.accessors.push_back(out);
}

const char *const names[GLTF_ATTRIBUTE_COUNT] = {"POSITION",   "NORMAL",   "TANGENT",  "TEXCOORD_0",
                                                 "TEXCOORD_1", "COLOR_0",  "JOINTS_0", "WEIGHTS_0",
                                                 "JOINTS_1",   "WEIGHTS_1"};

gltf_texture texture_of(const tinygltf::Texture &t)
{
    const tinygltf::Value *webp = extension(t.extensions, "EXT_texture_webp");
    return {t.name.c_str(), integer(webp, "source", t.source), t.sampler,
            extension(t.extensions, "KHR_texture_basisu") != nullptr};
}

int attribute_of(const std::map<std::string, int> &attributes, const char *name)
{
    auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

size_t array_length(const tinygltf::Value *value)
{
    return value && value->IsArray() ? value->ArrayLen() : 0;
}

void convert_variants(holder &h)
{
    const tinygltf::Value *list =
        member(extension(h.model.extensions, "KHR_materials_variants"), "variants");
    for (size_t i = 0; i < array_length(list); i++)
        h.variants.push_back(text(&list->Get(int(i)), "name", ""));
}

void convert_mappings(holder &h, const tinygltf::Primitive &p, gltf_primitive &out)
{
    const tinygltf::Value *list =
        member(extension(p.extensions, "KHR_materials_variants"), "mappings");
    std::vector<gltf_variant_mapping> mappings;
    for (size_t i = 0; i < array_length(list); i++) {
        const tinygltf::Value *variants = member(&list->Get(int(i)), "variants");
        std::vector<int> indices;
        for (size_t k = 0; k < array_length(variants); k++) {
            const tinygltf::Value &variant = variants->Get(int(k));
            indices.push_back(variant.IsInt() ? variant.GetNumberAsInt() : -1);
        }
        h.integers.push_back(std::move(indices));
        mappings.push_back(
            {integer(&list->Get(int(i)), "material", -1), indices_of(h.integers.back())});
    }
    h.mappings.push_back(std::move(mappings));
    out.mappings = h.mappings.back().data();
    out.mapping_count = h.mappings.back().size();
}

gltf_primitive convert_primitive(holder &h, const tinygltf::Primitive &p)
{
    gltf_primitive out = {};
    for (int i = 0; i < GLTF_ATTRIBUTE_COUNT; i++)
        out.attributes[i] = attribute_of(p.attributes, names[i]);
    std::vector<gltf_target> targets;
    for (const std::map<std::string, int> &target : p.targets)
        targets.push_back({attribute_of(target, "POSITION"), attribute_of(target, "NORMAL"),
                           attribute_of(target, "TANGENT")});
    h.targets.push_back(std::move(targets));
    out.targets = h.targets.back().data();
    out.indices = p.indices;
    out.material = p.material;
    out.mode = p.mode;
    out.target_count = p.targets.size();
    convert_mappings(h, p, out);
    out.has_more_joints = attribute_of(p.attributes, "JOINTS_2") != -1;
    const tinygltf::Value *draco = extension(p.extensions, "KHR_draco_mesh_compression");
    out.is_draco = draco != nullptr;
    out.draco_view = integer(draco, "bufferView", -1);
    for (int i = 0; i < GLTF_ATTRIBUTE_COUNT; i++)
        out.draco_attributes[i] = integer(member(draco, "attributes"), names[i], -1);
    return out;
}

bool is_visible(const tinygltf::Node &n)
{
    const tinygltf::Value *visible =
        member(extension(n.extensions, "KHR_node_visibility"), "visible");
    return !visible || !visible->IsBool() || visible->Get<bool>();
}

void convert_node(holder &h, const tinygltf::Node &n)
{
    gltf_node out = {};
    out.name = n.name.c_str();
    out.mesh = n.mesh;
    out.camera = n.camera;
    out.light = integer(extension(n.extensions, "KHR_lights_punctual"), "light", -1);
    out.grid = integer(extension(n.extensions, "VITRAIL_density_grids"), "grid", -1);
    out.skin = n.skin;
    out.is_visible = is_visible(n);
    static const char *const instance_names[GLTF_INSTANCE_ATTRIBUTE_COUNT] = {"TRANSLATION",
                                                                              "ROTATION", "SCALE"};
    const tinygltf::Value *instancing = extension(n.extensions, "EXT_mesh_gpu_instancing");
    out.is_instanced = instancing != nullptr;
    for (int i = 0; i < GLTF_INSTANCE_ATTRIBUTE_COUNT; i++)
        out.instance_attributes[i] =
            integer(member(instancing, "attributes"), instance_names[i], -1);
    out.children = indices_of(n.children);
    out.matrix = numbers_of(n.matrix);
    out.translation = numbers_of(n.translation);
    out.rotation = numbers_of(n.rotation);
    out.scale = numbers_of(n.scale);
    out.weights = numbers_of(n.weights);
    h.nodes.push_back(out);
}

void convert_camera(holder &h, const tinygltf::Camera &c)
{
    gltf_camera out = {};
    out.name = c.name.c_str();
    out.is_orthographic = c.type == "orthographic";
    out.y_fov_rad = c.perspective.yfov;
    out.aspect = c.perspective.aspectRatio;
    out.x_mag = c.orthographic.xmag;
    out.y_mag = c.orthographic.ymag;
    out.z_near = out.is_orthographic ? c.orthographic.znear : c.perspective.znear;
    out.z_far = out.is_orthographic ? c.orthographic.zfar : c.perspective.zfar;
    h.cameras.push_back(out);
}

void convert_light(holder &h, const tinygltf::Light &l)
{
    gltf_light out = {};
    out.name = l.name.c_str();
    out.type = l.type.c_str();
    out.color = numbers_of(l.color);
    out.intensity = l.intensity;
    out.range = l.range;
    out.inner_cone_rad = l.spot.innerConeAngle;
    out.outer_cone_rad = l.spot.outerConeAngle;
    h.lights.push_back(out);
}

void convert_grids(holder &h)
{
    const tinygltf::Value *list =
        member(extension(h.model.extensions, "VITRAIL_density_grids"), "grids");
    for (size_t i = 0; i < array_length(list); i++) {
        const tinygltf::Value *g = &list->Get(int(i));
        gltf_grid out = {};
        out.name = text(g, "name", "");
        out.size = number_array(h, g, "size");
        out.values = integer(g, "values", -1);
        const tinygltf::Value *procedure = member(g, "procedure");
        out.procedure = text(procedure, "type", nullptr);
        out.seed = number(procedure, "seed", 0);
        out.detail = number(procedure, "detail", 4);
        out.min = number_array(h, g, "min");
        out.max = number_array(h, g, "max");
        out.density = number(g, "density", 1);
        out.extinction = number_array(h, g, "extinction");
        out.color = number_array(h, g, "color");
        out.anisotropy = number(g, "anisotropy", 0);
        h.grids.push_back(out);
    }
}

void convert_meshes(holder &h)
{
    for (const tinygltf::Mesh &m : h.model.meshes) {
        std::vector<gltf_primitive> list;
        for (const tinygltf::Primitive &p : m.primitives)
            list.push_back(convert_primitive(h, p));
        h.primitives.push_back(std::move(list));
        h.meshes.push_back({m.name.c_str(), h.primitives.back().data(), h.primitives.back().size(),
                            numbers_of(m.weights)});
    }
}

void convert(holder &h)
{
    const tinygltf::Model &m = h.model;
    for (const std::string &name : m.extensionsUsed)
        h.used.push_back(name.c_str());
    for (const std::string &name : m.extensionsRequired)
        h.required.push_back(name.c_str());
    for (const tinygltf::BufferView &v : m.bufferViews)
        h.views.push_back({v.buffer, v.byteOffset, v.byteLength, v.byteStride, meshopt_of(v)});
    convert_variants(h);
    for (const tinygltf::Accessor &a : m.accessors)
        convert_accessor(h, a);
    convert_meshes(h);
    for (const tinygltf::Node &n : m.nodes)
        convert_node(h, n);
    for (const tinygltf::Scene &s : m.scenes)
        h.scenes.push_back({s.name.c_str(), indices_of(s.nodes)});
    for (const tinygltf::Material &material : m.materials)
        convert_material(h, material);
    for (const tinygltf::Texture &t : m.textures)
        h.textures.push_back(texture_of(t));
    for (const tinygltf::Sampler &s : m.samplers)
        h.samplers.push_back({s.magFilter, s.minFilter, s.wrapS, s.wrapT});
    for (const tinygltf::Light &l : m.lights)
        convert_light(h, l);
    for (const tinygltf::Camera &c : m.cameras)
        convert_camera(h, c);
    convert_grids(h);
}

void publish(holder &h)
{
    gltf_document &d = h.document;
    d.extensions_used = h.used.data();
    d.extension_used_count = h.used.size();
    d.extensions_required = h.required.data();
    d.extension_required_count = h.required.size();
    d.variants = h.variants.data();
    d.variant_count = h.variants.size();
    d.views = h.views.data();
    d.view_count = h.views.size();
    d.accessors = h.accessors.data();
    d.accessor_count = h.accessors.size();
    d.meshes = h.meshes.data();
    d.mesh_count = h.meshes.size();
    d.nodes = h.nodes.data();
    d.node_count = h.nodes.size();
    d.scenes = h.scenes.data();
    d.scene_count = h.scenes.size();
    d.materials = h.materials.data();
    d.material_count = h.materials.size();
    d.textures = h.textures.data();
    d.texture_count = h.textures.size();
    d.samplers = h.samplers.data();
    d.sampler_count = h.samplers.size();
    d.lights = h.lights.data();
    d.light_count = h.lights.size();
    d.cameras = h.cameras.data();
    d.camera_count = h.cameras.size();
    d.grids = h.grids.data();
    d.grid_count = h.grids.size();
    d.default_scene = h.model.defaultScene;
}

bool check_required(const tinygltf::Model &model, const char *const *known, struct error *err)
{
    for (const std::string &name : model.extensionsRequired) {
        const char *const *at = known;
        while (*at && name != *at)
            at++;
        if (!*at)
            return error_set(err, ERROR_UNSUPPORTED,
                             "the file requires the extension %s, which is not supported",
                             name.c_str());
    }
    return true;
}

bool check_version(const tinygltf::Asset &asset, struct error *err)
{
    if (asset.version.compare(0, 2, "2.") != 0)
        return error_set(err, ERROR_UNSUPPORTED, "asset.version is '%s', only glTF 2 is read",
                         asset.version.c_str());
    if (!asset.minVersion.empty() && asset.minVersion != "2.0")
        return error_set(err, ERROR_UNSUPPORTED, "asset.minVersion is '%s', this program reads 2.0",
                         asset.minVersion.c_str());
    return true;
}

// tinygltf adds to its error text also where it goes on (a primitive it leaves out, say): any text
// is a failure.
bool load(holder &h, const char *json, size_t length, const char *const *known, struct error *err)
{
    tinygltf::TinyGLTF loader;
    if (!refuse_files(loader))
        return error_set(err, ERROR_INTERNAL, "tinygltf does not let its file access be replaced");
    loader.SetImageLoader(refuse_image, nullptr);
    std::string problem, warning;
    bool is_loaded = loader.LoadASCIIFromString(&h.model, &problem, &warning, json,
                                                unsigned(length), "", tinygltf::REQUIRE_VERSION);
    if (!check_required(h.model, known, err))
        return false;
    if (!is_loaded || !problem.empty()) {
        problem = problem.substr(0, problem.find('\n'));
        return error_set(err, ERROR_INVALID_SCENE, "glTF: %s",
                         problem.empty() ? "malformed" : problem.c_str());
    }
    return check_version(h.model.asset, err);
}

} // namespace

const char *gltf_attribute_name(int attribute)
{
    return names[attribute];
}

gltf_document *gltf_document_create(const char *json, size_t json_length, const char *const *known,
                                    struct error *err)
{
    holder *h = new (std::nothrow) holder();
    if (!h) {
        error_set(err, ERROR_NO_MEMORY, "glTF document");
        return nullptr;
    }
    try {
        if (load(*h, json, json_length, known, err)) {
            convert(*h);
            publish(*h);
            return &h->document;
        }
    } catch (const std::bad_alloc &) {
        error_set(err, ERROR_NO_MEMORY, "glTF document of %zu bytes of JSON", json_length);
    } catch (const std::exception &e) {
        error_set(err, ERROR_INVALID_SCENE, "glTF: %s", e.what());
    } catch (...) {
        error_set(err, ERROR_INTERNAL, "glTF: unknown exception");
    }
    delete h;
    return nullptr;
}

void gltf_document_put_indices(gltf_document *document, gltf_indices indices)
{
    size_t next = 0;
    for (std::vector<gltf_primitive> &list : reinterpret_cast<holder *>(document)->primitives)
        for (gltf_primitive &primitive : list)
            if (next < indices.count)
                primitive.indices = indices.values[next++];
}

void gltf_document_destroy(gltf_document *document)
{
    delete reinterpret_cast<holder *>(document);
}
