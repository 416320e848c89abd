/* SPDX-License-Identifier: MIT */
/* Signed edge counts of a mesh by hashing its vertices and its edges. */
#include "renderer/scene/edge_table.h"

#include <stdlib.h>
#include <string.h>

static const uint32_t no_slot = UINT32_MAX;

/* Finaliser of SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t mix(uint64_t z)
{
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static uint64_t hash_position(const float *p)
{
    uint64_t hash = 0x9e3779b97f4a7c15u;
    for (int k = 0; k < 3; k++) {
        float value = p[k] == 0 ? 0 : p[k]; /* -0 is 0 */
        uint32_t bits;
        memcpy(&bits, &value, sizeof bits);
        hash = mix(hash + bits);
    }
    return hash;
}

static const float *position_of(const struct edge_mesh *mesh, uint32_t corner)
{
    return mesh->positions + 3 * (size_t)mesh->indices[corner];
}

/* Slots of an open-addressing table for `count` entries: a power of two, at most half full. */
static size_t slot_count(size_t count)
{
    size_t slots = 16;
    while (slots < 2 * count)
        slots *= 2;
    return slots;
}

static uint32_t *slots_create(size_t slots, struct error *err)
{
    uint32_t *table = malloc(slots * sizeof *table);
    if (!table)
        error_set(err, ERROR_NO_MEMORY, "a table of %zu edges or vertices", slots);
    else
        memset(table, 0xff, slots * sizeof *table);
    return table;
}

/* welded[v] becomes the lowest used vertex with the position of v. */
static bool weld(const struct edge_mesh *mesh, uint32_t *welded, struct error *err)
{
    size_t slots = slot_count(mesh->vertex_count);
    uint32_t *table = slots_create(slots, err);
    if (!table)
        return false;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const float *p = mesh->positions + 3 * (size_t)v;
        size_t at = hash_position(p) & (slots - 1);
        while (table[at] != no_slot) {
            const float *q = mesh->positions + 3 * (size_t)table[at];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2])
                break;
            at = (at + 1) & (slots - 1);
        }
        if (table[at] == no_slot)
            table[at] = v;
        welded[v] = table[at];
    }
    free(table);
    return true;
}

struct edge_builder {
    struct edge_table *out;
    uint32_t *slots;
    size_t slot_count;
};

static void cross_edge(struct edge_builder *builder, uint32_t from, uint32_t to, uint32_t face)
{
    if (from == to)
        return;
    uint32_t low = from < to ? from : to, high = from < to ? to : from;
    size_t mask = builder->slot_count - 1, at = mix((uint64_t)low << 32 | high) & mask;
    struct edge_record *records = builder->out->records;
    while (builder->slots[at] != no_slot &&
           (records[builder->slots[at]].low != low || records[builder->slots[at]].high != high))
        at = (at + 1) & mask;
    if (builder->slots[at] == no_slot) {
        builder->slots[at] = builder->out->count++;
        records[builder->slots[at]] = (struct edge_record){.low = low, .high = high};
    }
    struct edge_record *record = &records[builder->slots[at]];
    if (builder->out->faces && record->uses < 2)
        builder->out->faces[builder->slots[at]][record->uses] = face;
    record->signed_count += from == low ? 1 : -1;
    record->uses++;
}

bool edge_table_init(struct edge_table *table, const struct edge_mesh *mesh, struct error *err)
{
    *table = (struct edge_table){0};
    struct edge_builder builder = {.out = table, .slot_count = slot_count(mesh->index_count)};
    uint32_t *welded = calloc((size_t)mesh->vertex_count + 1, sizeof *welded);
    table->records = calloc((size_t)mesh->index_count + 1, sizeof *table->records);
    builder.slots = slots_create(builder.slot_count, err);
    size_t face_bytes = ((size_t)mesh->index_count + 1) * sizeof *table->faces;
    table->faces = mesh->wants_faces ? malloc(face_bytes) : NULL;
    bool ok = welded && table->records && builder.slots && (table->faces || !mesh->wants_faces);
    if (ok && table->faces)
        memset(table->faces, 0xff, face_bytes);
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "the edges of %u triangles", mesh->index_count / 3);
    ok = ok && weld(mesh, welded, err);
    for (uint32_t i = 0; ok && i < mesh->index_count; i++) {
        uint32_t next = i % 3 == 2 ? i - 2 : i + 1;
        cross_edge(&builder, welded[mesh->indices[i]], welded[mesh->indices[next]], i / 3);
    }
    free(welded);
    free(builder.slots);
    if (!ok)
        edge_table_finish(table);
    return ok;
}

void edge_table_finish(struct edge_table *table)
{
    free(table->records);
    free(table->faces);
    *table = (struct edge_table){0};
}

/* A number per directed edge, minus that of its reverse, summed over all crossings modulo 2^64:
 * not zero proves that some edge's signed count is not. */
static bool may_be_closed(const struct edge_mesh *mesh)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < mesh->index_count; i += 3) {
        uint64_t h[3];
        for (uint32_t k = 0; k < 3; k++)
            h[k] = hash_position(position_of(mesh, i + k));
        for (int k = 0; k < 3; k++) {
            uint64_t from = h[k], to = h[(k + 1) % 3];
            sum += mix(from + 3 * to) - mix(to + 3 * from);
        }
    }
    return sum == 0;
}

/* Six times the enclosed volume, counter-clockwise sides outward. */
static double volume_of(const struct edge_mesh *mesh)
{
    double sum = 0;
    const float *origin = position_of(mesh, 0);
    for (uint32_t i = 0; i < mesh->index_count; i += 3) {
        double v[3][3];
        for (uint32_t c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                v[c][k] = (double)position_of(mesh, i + c)[k] - (double)origin[k];
        sum += v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
               v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
               v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
    }
    return sum;
}

bool edge_mesh_is_closed(const struct edge_mesh *mesh, bool *is_closed, struct error *err)
{
    *is_closed = mesh->index_count > 0 && may_be_closed(mesh) && volume_of(mesh) > 0;
    if (!*is_closed || mesh->index_count > EDGE_MESH_EXACT_MAX)
        return true;
    struct edge_table table;
    if (!edge_table_init(&table, mesh, err))
        return false;
    for (uint32_t i = 0; i < table.count; i++)
        *is_closed = *is_closed && table.records[i].signed_count == 0;
    edge_table_finish(&table);
    return true;
}
