// SPDX-License-Identifier: MIT
// Encodes by Draco's own encoder, as programs that write glTF do.
#include "tests/support/draco_encoder_shim.h"

#include <cstdlib>
#include <cstring>

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>

static int add(draco::Mesh &mesh, draco::GeometryAttribute::Type type, const float *values,
               uint32_t points, int components)
{
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, int8_t(components), draco::DT_FLOAT32, false,
                   int64_t(sizeof(float)) * components, 0);
    int id = mesh.AddAttribute(attribute, true, points);
    for (uint32_t i = 0; i < points; i++)
        mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                              values + size_t(i) * size_t(components));
    return id;
}

void *draco_encode(const struct draco_encoder_desc *desc, size_t *size_bytes)
{
    draco::Mesh mesh;
    mesh.set_num_points(desc->points);
    mesh.SetNumFaces(desc->triangles);
    for (uint32_t i = 0; i < desc->triangles; i++) {
        const uint32_t *corner = desc->indices + size_t(3) * i;
        mesh.SetFace(draco::FaceIndex(i),
                     {draco::PointIndex(corner[0]), draco::PointIndex(corner[1]),
                      draco::PointIndex(corner[2])});
    }
    add(mesh, draco::GeometryAttribute::POSITION, desc->positions, desc->points, 3);
    if (desc->normals)
        add(mesh, draco::GeometryAttribute::NORMAL, desc->normals, desc->points, 3);
    draco::Encoder encoder;
    draco::EncoderBuffer buffer;
    encoder.SetEncodingMethod(desc->is_sequential ? draco::MESH_SEQUENTIAL_ENCODING
                                                  : draco::MESH_EDGEBREAKER_ENCODING);
    if (desc->position_bits)
        encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, desc->position_bits);
    if (!encoder.EncodeMeshToBuffer(mesh, &buffer).ok())
        return nullptr;
    void *bytes = malloc(buffer.size());
    if (bytes)
        memcpy(bytes, buffer.data(), buffer.size());
    *size_bytes = buffer.size();
    return bytes;
}

uint32_t draco_decode(const void *bytes, size_t size_bytes)
{
    draco::DecoderBuffer buffer;
    draco::Decoder decoder;
    buffer.Init(static_cast<const char *>(bytes), size_bytes);
    auto result = decoder.DecodeMeshFromBuffer(&buffer);
    return result.ok() ? result.value()->num_points() : 0;
}
