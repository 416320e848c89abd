// SPDX-License-Identifier: MIT
// The one home of Draco: from a stream to indices and attributes. No exception leaves this file.
//
// Draco sizes its tables by the counts in front of a stream before it has read what follows, so
// that these counts are read here first (Draco Bitstream Specification 2.2, sections 3 and 4).
#include "renderer/import/draco_shim.h"

#include <cstring>
#include <exception>
#include <memory>
#include <new>

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

struct draco_mesh {
    std::unique_ptr<draco::Mesh> mesh;
};

namespace
{

// What Draco holds for a triangle and a point at once: corner tables, maps of vertices and points,
// and values before and after their transforms. Chosen as half as much again as what a mesh of
// 262,267 triangles and 216,235 points with normals and texture coordinates took, which was 33 MB.
constexpr uint64_t TRIANGLE_BYTES = 100, POINT_BYTES = 100;

struct stream_counts {
    uint32_t triangles, points; // points of an edgebreaker stream: at least so many
    bool are_points_exact;
};

bool refuse_stream(struct error *err)
{
    return error_set(err, ERROR_INVALID_SCENE, "its Draco stream is broken");
}

bool read_header(draco::DecoderBuffer &buffer, draco::DracoHeader &header, struct error *err)
{
    if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok() ||
        header.encoder_type != draco::TRIANGULAR_MESH)
        return error_set(err, ERROR_INVALID_SCENE, "its Draco stream is no stream of a mesh");
    if (header.version_major != 2 || header.version_minor != 2)
        return error_set(err, ERROR_UNSUPPORTED,
                         "its Draco stream has version %d.%d, only 2.2 is read",
                         header.version_major, header.version_minor);
    draco::GeometryMetadata metadata;
    buffer.set_bitstream_version(draco::kDracoMeshBitstreamVersion);
    if ((header.flags & METADATA_FLAG_MASK) &&
        !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata))
        return refuse_stream(err);
    return true;
}

bool read_counts(const draco_desc &desc, stream_counts &counts, struct error *err)
{
    draco::DecoderBuffer buffer;
    draco::DracoHeader header;
    buffer.Init(reinterpret_cast<const char *>(desc.bytes), desc.size_bytes);
    if (!read_header(buffer, header, err))
        return false;
    uint8_t traversal;
    bool is_read;
    counts.are_points_exact = header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING;
    if (counts.are_points_exact)
        is_read = draco::DecodeVarint(&counts.triangles, &buffer) &&
                  draco::DecodeVarint(&counts.points, &buffer);
    else
        is_read = buffer.Decode(&traversal) && draco::DecodeVarint(&counts.points, &buffer) &&
                  draco::DecodeVarint(&counts.triangles, &buffer);
    return is_read || refuse_stream(err);
}

bool refuse_points(uint64_t points, const draco_desc &desc, struct error *err)
{
    return error_set(err, ERROR_INVALID_SCENE, "its Draco stream has %llu points, POSITION has %u",
                     static_cast<unsigned long long>(points), desc.points);
}

bool check_counts(const draco_desc &desc, struct error *err)
{
    stream_counts counts = {};
    if (!read_counts(desc, counts, err))
        return false;
    if (desc.triangles && counts.triangles != desc.triangles)
        return error_set(err, ERROR_INVALID_SCENE,
                         "its Draco stream has %u triangles, its indices make %llu",
                         counts.triangles, static_cast<unsigned long long>(desc.triangles));
    if (counts.are_points_exact ? counts.points != desc.points : counts.points > desc.points)
        return refuse_points(counts.points, desc, err);
    uint64_t need = counts.triangles * TRIANGLE_BYTES + desc.points * POINT_BYTES;
    return need <= desc.max_bytes ||
           error_set(err, ERROR_TOO_LARGE,
                     "its Draco stream needs about %llu bytes, %llu are left of the limit",
                     static_cast<unsigned long long>(need),
                     static_cast<unsigned long long>(desc.max_bytes));
}

std::unique_ptr<draco::Mesh> decode(const draco_desc &desc, struct error *err)
{
    draco::DecoderBuffer buffer;
    draco::Decoder decoder;
    buffer.Init(reinterpret_cast<const char *>(desc.bytes), desc.size_bytes);
    auto result = decoder.DecodeMeshFromBuffer(&buffer);
    if (!result.ok()) {
        error_set(err, ERROR_INVALID_SCENE, "its Draco stream is broken: %.80s",
                  result.status().error_msg());
        return nullptr;
    }
    std::unique_ptr<draco::Mesh> mesh = std::move(result).value();
    if (mesh->num_points() != desc.points) {
        refuse_points(mesh->num_points(), desc, err);
        return nullptr;
    }
    return mesh;
}

// Where point `point` has its value, NULL where the stream left it without one.
const uint8_t *value_at(const draco::PointAttribute &attribute, uint32_t point)
{
    draco::AttributeValueIndex value = attribute.mapped_index(draco::PointIndex(point));
    return value.value() < attribute.size() ? attribute.GetAddress(value) : nullptr;
}

template <typename number>
bool convert(const draco::PointAttribute &attribute, draco::DataType type, uint32_t points,
             int components, void *out)
{
    number *to = static_cast<number *>(out);
    size_t value_bytes = sizeof(number) * size_t(components);
    bool is_same = attribute.data_type() == type;
    for (uint32_t i = 0; i < points; i++, to += components) {
        const uint8_t *from = value_at(attribute, i);
        if (!from)
            return false;
        if (is_same)
            memcpy(to, from, value_bytes);
        else if (!attribute.ConvertValue<number>(attribute.mapped_index(draco::PointIndex(i)),
                                                 int8_t(components), to))
            return false;
    }
    return true;
}

bool convert_to(const draco::PointAttribute &attribute, int component, uint32_t points,
                int components, void *out)
{
    switch (component) {
    case GLTF_BYTE:
        return convert<int8_t>(attribute, draco::DT_INT8, points, components, out);
    case GLTF_UNSIGNED_BYTE:
        return convert<uint8_t>(attribute, draco::DT_UINT8, points, components, out);
    case GLTF_SHORT:
        return convert<int16_t>(attribute, draco::DT_INT16, points, components, out);
    case GLTF_UNSIGNED_SHORT:
        return convert<uint16_t>(attribute, draco::DT_UINT16, points, components, out);
    case GLTF_UNSIGNED_INT:
        return convert<uint32_t>(attribute, draco::DT_UINT32, points, components, out);
    case GLTF_FLOAT:
        return convert<float>(attribute, draco::DT_FLOAT32, points, components, out);
    default:
        return false;
    }
}

bool are_values_there(const draco::PointAttribute &attribute, uint32_t points)
{
    uint64_t stride = uint64_t(attribute.byte_stride());
    uint64_t least =
        draco::DataTypeLength(attribute.data_type()) * uint64_t(attribute.num_components());
    return attribute.buffer() && stride >= least && attribute.byte_offset() == 0 &&
           attribute.size() * stride <= attribute.buffer()->data_size() &&
           (attribute.is_mapping_identity() || attribute.indices_map_size() >= points);
}

} // namespace

draco_mesh *draco_mesh_create(const draco_desc *desc, struct error *err)
{
    try {
        if (!check_counts(*desc, err))
            return nullptr;
        std::unique_ptr<draco_mesh> mesh(new draco_mesh());
        mesh->mesh = decode(*desc, err);
        return mesh->mesh ? mesh.release() : nullptr;
    } catch (const std::bad_alloc &) {
        error_set(err, ERROR_INVALID_SCENE,
                  "its Draco stream of %zu bytes asks for more memory than there is",
                  desc->size_bytes);
    } catch (const std::exception &e) {
        error_set(err, ERROR_INVALID_SCENE, "its Draco stream is broken: %.80s", e.what());
    } catch (...) {
        refuse_stream(err);
    }
    return nullptr;
}

void draco_mesh_destroy(draco_mesh *mesh)
{
    delete mesh;
}

uint64_t draco_mesh_triangles(const draco_mesh *mesh)
{
    return mesh->mesh->num_faces();
}

void draco_mesh_indices(const draco_mesh *mesh, uint32_t *out)
{
    for (uint32_t i = 0; i < mesh->mesh->num_faces(); i++) {
        const draco::Mesh::Face &face = mesh->mesh->face(draco::FaceIndex(i));
        for (int corner = 0; corner < 3; corner++)
            *out++ = face[corner].value();
    }
}

bool draco_mesh_attribute(const draco_mesh *mesh, int id, int component, int components, void *out,
                          struct error *err)
{
    const draco::PointAttribute *attribute =
        id < 0 ? nullptr : mesh->mesh->GetAttributeByUniqueId(uint32_t(id));
    uint32_t points = mesh->mesh->num_points();
    if (!attribute)
        return error_set(err, ERROR_INVALID_SCENE, "the Draco stream has no attribute %d", id);
    if (attribute->num_components() != components)
        return error_set(err, ERROR_INVALID_SCENE,
                         "attribute %d of the Draco stream has %d components, its accessor %d", id,
                         attribute->num_components(), components);
    return (are_values_there(*attribute, points) &&
            convert_to(*attribute, component, points, components, out)) ||
           error_set(err, ERROR_INVALID_SCENE,
                     "attribute %d of the Draco stream cannot be had in component type %d", id,
                     component);
}
