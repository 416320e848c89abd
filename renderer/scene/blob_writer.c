/* SPDX-License-Identifier: MIT */
/* Growing sections and the final layout of a scene blob. */
#include "renderer/scene/blob_writer.h"

#include <stdlib.h>
#include <string.h>

enum { ALIGNMENT = 16 };

static const size_t record_bytes[SCENE_SECTION_COUNT] = {
    [SCENE_STRINGS] = 1,
    [SCENE_NODES] = sizeof(struct scene_node),
    [SCENE_MESHES] = sizeof(struct scene_mesh),
    [SCENE_PRIMITIVES] = sizeof(struct scene_primitive),
    [SCENE_MATERIALS] = sizeof(struct scene_material),
    [SCENE_TEXTURES] = sizeof(struct scene_texture),
    [SCENE_IMAGES] = sizeof(struct scene_image),
    [SCENE_PIXELS] = 1,
    [SCENE_LIGHTS] = sizeof(struct scene_light),
    [SCENE_CAMERAS] = sizeof(struct scene_camera),
    [SCENE_INDICES] = sizeof(uint32_t),
    [SCENE_POSITIONS] = 3 * sizeof(float),
    [SCENE_NORMALS] = 3 * sizeof(float),
    [SCENE_TANGENTS] = 4 * sizeof(float),
    [SCENE_TEXCOORDS_0] = 2 * sizeof(float),
    [SCENE_TEXCOORDS_1] = 2 * sizeof(float),
    [SCENE_COLORS] = 4 * sizeof(float),
    [SCENE_EXTENSIONS_USED] = sizeof(uint32_t),
    [SCENE_EXTENSIONS_IGNORED] = sizeof(uint32_t),
    [SCENE_WARNINGS] = sizeof(uint32_t),
    [SCENE_POSES] = sizeof(struct scene_pose),
    [SCENE_ANIMATIONS] = sizeof(struct scene_animation),
    [SCENE_CHANNELS] = sizeof(struct scene_channel),
    [SCENE_KEYS] = sizeof(float),
    [SCENE_SKINS] = sizeof(struct scene_skin),
    [SCENE_JOINTS] = sizeof(struct scene_joint),
    [SCENE_DEFORMATIONS] = sizeof(struct scene_deformation),
    [SCENE_INFLUENCES] = sizeof(struct scene_influence),
    [SCENE_TARGETS] = sizeof(struct scene_target),
    [SCENE_DELTAS] = sizeof(struct scene_delta),
    [SCENE_DEFORMED_NODES] = sizeof(struct scene_deformed_node),
    [SCENE_TARGET_WEIGHTS] = sizeof(float),
    [SCENE_VARIANTS] = sizeof(uint32_t),
    [SCENE_VARIANT_MATERIALS] = sizeof(struct scene_variant_material),
    [SCENE_HIDDEN_NODES] = sizeof(uint32_t),
    [SCENE_GRIDS] = sizeof(struct scene_grid),
    [SCENE_GRID_BRICKS] = sizeof(struct scene_grid_brick),
    [SCENE_GRID_VALUES] = SCENE_BRICK_VALUES * sizeof(float),
};

size_t blob_record_bytes(enum scene_section section)
{
    return record_bytes[section];
}

bool blob_writer_init(struct blob_writer *writer, uint64_t max_bytes, struct error *err)
{
    memset(writer, 0, sizeof *writer);
    writer->max_bytes = max_bytes;
    return blob_writer_append(writer, SCENE_STRINGS, 1, err) != NULL; /* offset 0 is "" */
}

void blob_writer_finish(struct blob_writer *writer)
{
    for (int i = 0; i < SCENE_SECTION_COUNT; i++)
        free(writer->sections[i].records);
    memset(writer, 0, sizeof *writer);
}

static bool reserve(struct blob_section *section, uint64_t count, size_t stride, struct error *err)
{
    if (count <= section->capacity)
        return true;
    uint64_t capacity = section->capacity * 2 > count ? section->capacity * 2 : count;
    /* Bounded by max_bytes: no overflow. */
    void *records = realloc(section->records, capacity * stride);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "scene section of %llu bytes",
                         (unsigned long long)capacity * stride);
    section->records = records;
    section->capacity = capacity;
    return true;
}

static bool take_room(struct blob_writer *writer, uint64_t count, size_t stride, struct error *err)
{
    if (count <= (writer->max_bytes - writer->size_bytes) / stride)
        return true;
    return error_set(err, ERROR_TOO_LARGE, "the decoded scene needs more than %llu bytes",
                     (unsigned long long)writer->max_bytes);
}

bool blob_writer_reserve_pixels(struct blob_writer *writer, uint64_t size_bytes, uint64_t *offset,
                                struct error *err)
{
    if (!take_room(writer, size_bytes, 1, err))
        return false;
    *offset = writer->sections[SCENE_PIXELS].count;
    writer->sections[SCENE_PIXELS].count += size_bytes;
    writer->size_bytes += size_bytes;
    return true;
}

void *blob_writer_append(struct blob_writer *writer, enum scene_section which, uint64_t count,
                         struct error *err)
{
    struct blob_section *section = &writer->sections[which];
    size_t stride = record_bytes[which];
    if (!take_room(writer, count, stride, err) ||
        !reserve(section, section->count + count, stride, err))
        return NULL;
    char *first = (char *)section->records + section->count * stride;
    memset(first, 0, count * stride);
    section->count += count;
    writer->size_bytes += count * stride;
    return first;
}

bool blob_writer_add_text(struct blob_writer *writer, const char *text, uint32_t *offset,
                          struct error *err)
{
    *offset = 0;
    size_t length = strlen(text);
    if (length == 0)
        return true;
    uint64_t at = writer->sections[SCENE_STRINGS].count;
    if (at + length + 1 > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "the names of the scene need more than 4 GiB");
    char *room = blob_writer_append(writer, SCENE_STRINGS, length + 1, err);
    if (!room)
        return false;
    memcpy(room, text, length + 1);
    *offset = (uint32_t)at;
    return true;
}

bool blob_writer_add_line(struct blob_writer *writer, enum scene_section section, const char *text,
                          struct error *err)
{
    uint32_t offset, *record;
    if (!blob_writer_add_text(writer, text, &offset, err) ||
        !(record = blob_writer_append(writer, section, 1, err)))
        return false;
    *record = offset;
    return true;
}

static uint64_t align(uint64_t offset)
{
    return (offset + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

/* Fills in where each section is; returns the size of all but the pixels. */
static uint64_t place_sections(const struct blob_writer *writer, struct scene_header *head)
{
    uint64_t size = align(sizeof *head);
    for (int i = 0; i < SCENE_SECTION_COUNT; i++) {
        head->sections[i] = (struct scene_section_range){.offset = size,
                                                         .count = writer->sections[i].count,
                                                         .stride = (uint32_t)record_bytes[i]};
        if (i != SCENE_PIXELS)
            size = align(size + writer->sections[i].count * record_bytes[i]);
    }
    head->sections[SCENE_PIXELS].offset = size;
    head->size_bytes = align(size + writer->sections[SCENE_PIXELS].count);
    return size;
}

bool blob_writer_write(struct blob_writer *writer, const struct scene_header *header,
                       bool only_head, void **blob, size_t *size_bytes, struct error *err)
{
    struct scene_header head = *header;
    memcpy(head.magic, SCENE_BLOB_MAGIC, sizeof head.magic);
    head.version = SCENE_BLOB_VERSION;
    head.section_count = SCENE_SECTION_COUNT;
    uint64_t head_bytes = place_sections(writer, &head);
    uint64_t size = only_head ? head_bytes : head.size_bytes;
    char *bytes = calloc(1, size); /* gaps are zero: the same scene gives the same bytes */
    if (!bytes)
        return error_set(err, ERROR_NO_MEMORY, "scene of %llu bytes", (unsigned long long)size);
    memcpy(bytes, &head, sizeof head);
    for (int i = 0; i < SCENE_SECTION_COUNT; i++) {
        struct blob_section *section = &writer->sections[i];
        if (section->records)
            memcpy(bytes + head.sections[i].offset, section->records,
                   section->count * record_bytes[i]);
        free(section->records);
        memset(section, 0, sizeof *section);
    }
    *blob = bytes;
    *size_bytes = size;
    return true;
}
