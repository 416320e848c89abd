/* SPDX-License-Identifier: MIT */
/* Tables of the members of glTF objects: glTF 2.0, section 5, and the extensions that are read. */
#include "renderer/import/gltf_fields.h"

#include <stddef.h>

/* clang-format off */
#define ONE(name, kind) {name, FIELD_##kind, false, false, 0, NULL}
#define NEEDED(name, kind) {name, FIELD_##kind, false, true, 0, NULL}
#define LIST(name, kind) {name, FIELD_##kind, true, false, 0, NULL}
#define NEEDED_LIST(name, kind) {name, FIELD_##kind, true, true, 0, NULL}
#define VECTOR(name, count) {name, FIELD_NUMBER, true, false, count, NULL}
#define OBJECT(name, fields) {name, FIELD_ITEM, false, false, 0, fields}
#define OBJECTS(name, fields) {name, FIELD_ITEM, true, false, 0, fields}
#define LOOSE(name, fields) {name, FIELD_LOOSE, false, false, 0, fields}
#define TEXTURE(name) OBJECT(name, texture_info)
#define END {NULL, FIELD_INDEX, false, false, 0, NULL}
/* clang-format on */

static const struct field nothing[] = {END};

/* ---- accessors and buffer views ---- */

static const struct field sparse_part[] = {ONE("bufferView", INDEX), ONE("byteOffset", SIZE),
                                           ONE("componentType", INDEX), END};
static const struct field sparse[] = {ONE("count", SIZE), OBJECT("indices", sparse_part),
                                      OBJECT("values", sparse_part), END};
static const struct field accessor[] = {ONE("bufferView", INDEX),
                                        ONE("byteOffset", SIZE),
                                        ONE("componentType", INDEX),
                                        ONE("count", SIZE),
                                        ONE("normalized", BOOLEAN),
                                        ONE("type", TEXT),
                                        LIST("min", NUMBER),
                                        LIST("max", NUMBER),
                                        OBJECT("sparse", sparse),
                                        ONE("name", TEXT),
                                        END};
static const struct field meshopt[] = {NEEDED("buffer", INDEX),     ONE("byteOffset", INDEX),
                                       NEEDED("byteLength", INDEX), NEEDED("byteStride", INDEX),
                                       NEEDED("count", INDEX),      NEEDED("mode", TEXT),
                                       ONE("filter", TEXT),         END};
static const struct field view_extensions[] = {OBJECT("EXT_meshopt_compression", meshopt),
                                               OBJECT("KHR_meshopt_compression", meshopt), END};
static const struct field buffer_view[] = {ONE("buffer", INDEX),
                                           ONE("byteOffset", SIZE),
                                           ONE("byteLength", SIZE),
                                           ONE("byteStride", SIZE),
                                           ONE("target", INDEX),
                                           ONE("name", TEXT),
                                           OBJECT("extensions", view_extensions),
                                           END};

/* ---- cameras, lights and density grids ---- */

static const struct field perspective[] = {ONE("aspectRatio", NUMBER), ONE("yfov", NUMBER),
                                           ONE("zfar", NUMBER), ONE("znear", NUMBER), END};
static const struct field orthographic[] = {ONE("xmag", NUMBER), ONE("ymag", NUMBER),
                                            ONE("zfar", NUMBER), ONE("znear", NUMBER), END};
static const struct field camera[] = {ONE("type", TEXT), OBJECT("perspective", perspective),
                                      OBJECT("orthographic", orthographic), ONE("name", TEXT), END};
static const struct field spot[] = {ONE("innerConeAngle", NUMBER), ONE("outerConeAngle", NUMBER),
                                    END};
static const struct field light[] = {NEEDED("type", TEXT),
                                     VECTOR("color", 3),
                                     ONE("intensity", NUMBER),
                                     ONE("range", NUMBER),
                                     OBJECT("spot", spot),
                                     ONE("name", TEXT),
                                     END};
static const struct field lights[] = {OBJECTS("lights", light), END};
static const struct field light_of_node[] = {NEEDED("light", INDEX), END};

static const struct field procedure[] = {NEEDED("type", TEXT), ONE("seed", SIZE),
                                         ONE("detail", SIZE), END};
static const struct field grid[] = {ONE("name", TEXT),
                                    {"size", FIELD_SIZE, true, true, 3, NULL},
                                    ONE("values", INDEX),
                                    OBJECT("procedure", procedure),
                                    {"min", FIELD_NUMBER, true, true, 3, NULL},
                                    {"max", FIELD_NUMBER, true, true, 3, NULL},
                                    ONE("density", NUMBER),
                                    VECTOR("extinction", 3),
                                    VECTOR("color", 3),
                                    ONE("anisotropy", NUMBER),
                                    END};
static const struct field grids[] = {OBJECTS("grids", grid), END};
static const struct field grid_of_node[] = {NEEDED("grid", INDEX), END};

/* ---- materials and textures ---- */

static const struct field texture_transform[] = {VECTOR("offset", 2), ONE("rotation", NUMBER),
                                                 VECTOR("scale", 2), ONE("texCoord", INDEX), END};
static const struct field texture_info_extensions[] = {
    OBJECT("KHR_texture_transform", texture_transform), END};
static const struct field texture_info[] = {NEEDED("index", INDEX),
                                            ONE("texCoord", INDEX),
                                            ONE("scale", NUMBER),
                                            ONE("strength", NUMBER),
                                            OBJECT("extensions", texture_info_extensions),
                                            END};
static const struct field metallic_roughness[] = {
    VECTOR("baseColorFactor", 4),        TEXTURE("baseColorTexture"),
    ONE("metallicFactor", NUMBER),       ONE("roughnessFactor", NUMBER),
    TEXTURE("metallicRoughnessTexture"), END};
static const struct field anisotropy[] = {ONE("anisotropyStrength", NUMBER),
                                          ONE("anisotropyRotation", NUMBER),
                                          TEXTURE("anisotropyTexture"), END};
static const struct field clearcoat[] = {
    ONE("clearcoatFactor", NUMBER),          TEXTURE("clearcoatTexture"),
    ONE("clearcoatRoughnessFactor", NUMBER), TEXTURE("clearcoatRoughnessTexture"),
    TEXTURE("clearcoatNormalTexture"),       END};
static const struct field diffuse_transmission[] = {
    ONE("diffuseTransmissionFactor", NUMBER), TEXTURE("diffuseTransmissionTexture"),
    VECTOR("diffuseTransmissionColorFactor", 3), TEXTURE("diffuseTransmissionColorTexture"), END};
static const struct field dispersion[] = {ONE("dispersion", NUMBER), END};
static const struct field emissive_strength[] = {ONE("emissiveStrength", NUMBER), END};
static const struct field ior[] = {ONE("ior", NUMBER), END};
static const struct field iridescence[] = {ONE("iridescenceFactor", NUMBER),
                                           TEXTURE("iridescenceTexture"),
                                           ONE("iridescenceIor", NUMBER),
                                           ONE("iridescenceThicknessMinimum", NUMBER),
                                           ONE("iridescenceThicknessMaximum", NUMBER),
                                           TEXTURE("iridescenceThicknessTexture"),
                                           END};
static const struct field sheen[] = {VECTOR("sheenColorFactor", 3), TEXTURE("sheenColorTexture"),
                                     ONE("sheenRoughnessFactor", NUMBER),
                                     TEXTURE("sheenRoughnessTexture"), END};
static const struct field specular[] = {ONE("specularFactor", NUMBER), TEXTURE("specularTexture"),
                                        VECTOR("specularColorFactor", 3),
                                        TEXTURE("specularColorTexture"), END};
static const struct field transmission[] = {ONE("transmissionFactor", NUMBER),
                                            TEXTURE("transmissionTexture"), END};
static const struct field volume[] = {ONE("thicknessFactor", NUMBER), TEXTURE("thicknessTexture"),
                                      ONE("attenuationDistance", NUMBER),
                                      VECTOR("attenuationColor", 3), END};
static const struct field material_extensions[] = {
    OBJECT("KHR_materials_anisotropy", anisotropy),
    OBJECT("KHR_materials_clearcoat", clearcoat),
    OBJECT("KHR_materials_diffuse_transmission", diffuse_transmission),
    OBJECT("KHR_materials_dispersion", dispersion),
    OBJECT("KHR_materials_emissive_strength", emissive_strength),
    OBJECT("KHR_materials_ior", ior),
    OBJECT("KHR_materials_iridescence", iridescence),
    OBJECT("KHR_materials_sheen", sheen),
    OBJECT("KHR_materials_specular", specular),
    OBJECT("KHR_materials_transmission", transmission),
    OBJECT("KHR_materials_unlit", nothing),
    OBJECT("KHR_materials_volume", volume),
    END};
static const struct field pass_through[] = {ONE("model", TEXT), VECTOR("edge_color", 3),
                                            ONE("edge_exponent", NUMBER), END};
static const struct field vitrail[] = {OBJECT("pass_through", pass_through), END};
static const struct field material_extras[] = {OBJECT("vitrail", vitrail), END};
static const struct field material[] = {OBJECT("pbrMetallicRoughness", metallic_roughness),
                                        TEXTURE("normalTexture"),
                                        TEXTURE("occlusionTexture"),
                                        TEXTURE("emissiveTexture"),
                                        VECTOR("emissiveFactor", 3),
                                        ONE("alphaMode", TEXT),
                                        ONE("alphaCutoff", NUMBER),
                                        ONE("doubleSided", BOOLEAN),
                                        ONE("name", TEXT),
                                        OBJECT("extensions", material_extensions),
                                        LOOSE("extras", material_extras),
                                        END};
static const struct field sampler[] = {ONE("magFilter", INDEX), ONE("minFilter", INDEX),
                                       ONE("wrapS", INDEX),     ONE("wrapT", INDEX),
                                       ONE("name", TEXT),       END};
static const struct field source[] = {ONE("source", INDEX), END};
static const struct field texture_extensions[] = {OBJECT("EXT_texture_webp", source),
                                                  OBJECT("KHR_texture_basisu", source), END};
static const struct field texture[] = {ONE("sampler", INDEX), ONE("source", INDEX),
                                       ONE("name", TEXT), OBJECT("extensions", texture_extensions),
                                       END};

/* ---- meshes and nodes ---- */

static const struct field draco[] = {NEEDED("bufferView", INDEX), NEEDED("attributes", MAP), END};
static const struct field mapping[] = {NEEDED("material", INDEX), NEEDED_LIST("variants", INDEX),
                                       END};
static const struct field mappings[] = {OBJECTS("mappings", mapping), END};
static const struct field primitive_extensions[] = {
    OBJECT("KHR_draco_mesh_compression", draco), OBJECT("KHR_materials_variants", mappings), END};
static const struct field primitive[] = {ONE("attributes", MAP),
                                         ONE("indices", INDEX),
                                         ONE("material", INDEX),
                                         ONE("mode", INDEX),
                                         LIST("targets", MAP),
                                         OBJECT("extensions", primitive_extensions),
                                         END};
static const struct field mesh[] = {OBJECTS("primitives", primitive), LIST("weights", NUMBER),
                                    ONE("name", TEXT), END};
static const struct field instancing[] = {NEEDED("attributes", MAP), END};
static const struct field visibility[] = {ONE("visible", BOOLEAN), END};
static const struct field node_extensions[] = {
    OBJECT("EXT_mesh_gpu_instancing", instancing), OBJECT("KHR_lights_punctual", light_of_node),
    OBJECT("KHR_node_visibility", visibility), OBJECT("VITRAIL_density_grids", grid_of_node), END};
static const struct field node[] = {LIST("children", INDEX),
                                    ONE("camera", INDEX),
                                    ONE("skin", INDEX),
                                    ONE("mesh", INDEX),
                                    VECTOR("matrix", 16),
                                    VECTOR("rotation", 4),
                                    VECTOR("scale", 3),
                                    VECTOR("translation", 3),
                                    LIST("weights", NUMBER),
                                    ONE("name", TEXT),
                                    OBJECT("extensions", node_extensions),
                                    END};

/* ---- the document ---- */

static const struct field scene[] = {LIST("nodes", INDEX), ONE("name", TEXT), END};
static const struct field variant[] = {NEEDED("name", TEXT), END};
static const struct field variants[] = {OBJECTS("variants", variant), END};
static const struct field document_extensions[] = {OBJECT("KHR_lights_punctual", lights),
                                                   OBJECT("KHR_materials_variants", variants),
                                                   OBJECT("VITRAIL_density_grids", grids), END};
const struct field gltf_document_fields[] = {OBJECTS("accessors", accessor),
                                             OBJECTS("bufferViews", buffer_view),
                                             OBJECTS("cameras", camera),
                                             OBJECTS("materials", material),
                                             OBJECTS("meshes", mesh),
                                             OBJECTS("nodes", node),
                                             OBJECTS("samplers", sampler),
                                             OBJECTS("textures", texture),
                                             OBJECTS("scenes", scene),
                                             ONE("scene", INDEX),
                                             LIST("extensionsUsed", TEXT),
                                             LIST("extensionsRequired", TEXT),
                                             OBJECT("extensions", document_extensions),
                                             END};
