/* SPDX-License-Identifier: MIT */
/* The figure's numbers and its document. */
#include "tests/bench/skinned_figure.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/import_support.h"

static const double PI = 3.14159265358979323846, HEIGHT_M = 2, RADIUS_M = 0.2;

enum { KEYS = 3, BOX_INDICES = 36 };

/* What follows the vertices in the binary chunk, after them in this order. */
struct tail {
    float matrices[FIGURE_JOINTS][16], times[KEYS], turns[KEYS][4], corners[8][3];
    uint32_t box[BOX_INDICES];
};

struct vertex {
    float position[3], normal[3], weights[4];
    uint16_t joints[4];
};

static void fill_vertices(struct vertex *vertices, int rings)
{
    for (int i = 0; i < rings * FIGURE_SIDES; i++) {
        struct vertex *v = &vertices[i];
        double turn = 2 * PI * (i % FIGURE_SIDES) / FIGURE_SIDES;
        double up = (double)(i / FIGURE_SIDES) / (rings - 1), along = up * (FIGURE_JOINTS - 1);
        int joint = (int)fmin(floor(along), FIGURE_JOINTS - 2);
        v->normal[0] = (float)cos(turn);
        v->normal[2] = (float)sin(turn);
        v->position[0] = (float)(RADIUS_M * cos(turn));
        v->position[1] = (float)(HEIGHT_M * up);
        v->position[2] = (float)(RADIUS_M * sin(turn));
        v->joints[0] = (uint16_t)joint;
        v->joints[1] = (uint16_t)(joint + 1);
        v->weights[1] = (float)(along - joint);
        v->weights[0] = 1 - v->weights[1];
    }
}

static void fill_indices(uint32_t *index, int rings)
{
    for (int ring = 0; ring + 1 < rings; ring++)
        for (int side = 0; side < FIGURE_SIDES; side++) {
            uint32_t a = (uint32_t)(ring * FIGURE_SIDES + side);
            uint32_t b = (uint32_t)(ring * FIGURE_SIDES + (side + 1) % FIGURE_SIDES);
            const uint32_t quad[6] = {a, a + FIGURE_SIDES, b,
                                      b, a + FIGURE_SIDES, b + FIGURE_SIDES};
            memcpy(index, quad, sizeof quad);
            index += 6;
        }
}

static void fill_tail(struct tail *tail)
{
    static const uint32_t box[BOX_INDICES] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                              2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    const double half = 5 * PI / 180;
    memset(tail, 0, sizeof *tail);
    for (int joint = 0; joint < FIGURE_JOINTS; joint++) {
        for (int k = 0; k < 4; k++)
            tail->matrices[joint][5 * k] = 1;
        tail->matrices[joint][13] = (float)(-HEIGHT_M * joint / (FIGURE_JOINTS - 1));
    }
    for (int key = 0; key < KEYS; key++) {
        tail->times[key] = (float)key;
        tail->turns[key][2] = key == 1 ? (float)sin(half) : 0;
        tail->turns[key][3] = key == 1 ? (float)cos(half) : 1;
    }
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            tail->corners[i][k] = (i >> k & 1) ? 0.1f : -0.1f;
    memcpy(tail->box, box, sizeof box);
}

/* The buffer, its views and what reads them. */
static void write_head(FILE *json, int rings)
{
    size_t vertices = (size_t)rings * FIGURE_SIDES, indices = (vertices - FIGURE_SIDES) * 6;
    size_t vertex_bytes = vertices * sizeof(struct vertex), index_bytes = indices * 4;
    size_t tail = vertex_bytes + index_bytes;
    fprintf(json,
            "{'asset':{'version':'2.0'},'scene':0,'buffers':[{'byteLength':%zu}],'bufferViews':["
            "{'buffer':0,'byteLength':%zu,'byteStride':%zu},"
            "{'buffer':0,'byteOffset':%zu,'byteLength':%zu},"
            "{'buffer':0,'byteOffset':%zu,'byteLength':%zu}],'accessors':[",
            tail + sizeof(struct tail), vertex_bytes, sizeof(struct vertex), vertex_bytes,
            index_bytes, tail, sizeof(struct tail));
    const struct {
        int view, component;
        size_t count;
        const char *type;
        size_t offset;
    } rows[] = {
        {0, 5126, vertices, "VEC3", offsetof(struct vertex, position)},
        {0, 5126, vertices, "VEC3", offsetof(struct vertex, normal)},
        {0, 5123, vertices, "VEC4", offsetof(struct vertex, joints)},
        {0, 5126, vertices, "VEC4", offsetof(struct vertex, weights)},
        {1, 5125, indices, "SCALAR", 0},
        {2, 5126, FIGURE_JOINTS, "MAT4", offsetof(struct tail, matrices)},
        {2, 5126, KEYS, "SCALAR", offsetof(struct tail, times)},
        {2, 5126, KEYS, "VEC4", offsetof(struct tail, turns)},
        {2, 5126, 8, "VEC3", offsetof(struct tail, corners)},
        {2, 5125, BOX_INDICES, "SCALAR", offsetof(struct tail, box)},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        fprintf(json,
                "%s{'bufferView':%d,'byteOffset':%zu,'componentType':%d,'count':%zu,'type':'%s'}",
                i ? "," : "", rows[i].view, rows[i].offset, rows[i].component, rows[i].count,
                rows[i].type);
}

static void write_scene(FILE *json, int parts)
{
    fprintf(json,
            "],'materials':[{'pbrMetallicRoughness':{'metallicFactor':0}}],'meshes':[{'primitives'"
            ":[{'attributes':{'POSITION':0,'NORMAL':1,'JOINTS_0':2,'WEIGHTS_0':3},'indices':4,"
            "'material':0}]},{'primitives':[{'attributes':{'POSITION':8},'indices':9,'material':0}]"
            "}],'skins':[{'inverseBindMatrices':5,'joints':[");
    for (int i = 0; i < FIGURE_JOINTS; i++)
        fprintf(json, "%s%d", i ? "," : "", 1 + i);
    fprintf(json, "]}],'animations':[{'samplers':[{'input':6,'output':7}],'channels':[");
    for (int i = 0; i < FIGURE_JOINTS; i++)
        fprintf(json, "%s{'sampler':0,'target':{'node':%d,'path':'rotation'}}", i ? "," : "",
                1 + i);
    fprintf(json, "]}],'nodes':[{'mesh':0,'skin':0}");
    for (int i = 0; i < FIGURE_JOINTS; i++) {
        fprintf(json, ",{'translation':[0,%.9g,0]", i ? HEIGHT_M / (FIGURE_JOINTS - 1) : 0);
        if (i + 1 < FIGURE_JOINTS)
            fprintf(json, ",'children':[%d]", 2 + i);
        fprintf(json, "}");
    }
    for (int i = 0; i < parts; i++) {
        double turn = 2.39996 * i, far_m = 0.8 + 0.15 * sqrt(i); /* like seeds in a sunflower */
        fprintf(json, ",{'mesh':1,'translation':[%.9g,0.1,%.9g]}", far_m * cos(turn),
                far_m * sin(turn));
    }
    fprintf(json, "],'scenes':[{'nodes':[0,1");
    for (int i = 0; i < parts; i++)
        fprintf(json, ",%d", 1 + FIGURE_JOINTS + i);
    fprintf(json, "]}]}");
}

void *skinned_figure_build(const struct skinned_figure_desc *desc, size_t *size_bytes)
{
    size_t vertices = (size_t)desc->rings * FIGURE_SIDES, indices = (vertices - FIGURE_SIDES) * 6;
    size_t vertex_bytes = vertices * sizeof(struct vertex), length;
    size_t bytes = vertex_bytes + indices * sizeof(uint32_t) + sizeof(struct tail);
    unsigned char *numbers = calloc(1, bytes);
    struct tail tail;
    char *text = NULL;
    FILE *json = open_memstream(&text, &length);
    if (!numbers || !json)
        abort();
    fill_vertices((struct vertex *)numbers, desc->rings);
    fill_indices((uint32_t *)(numbers + vertex_bytes), desc->rings);
    fill_tail(&tail);
    memcpy(numbers + bytes - sizeof tail, &tail, sizeof tail);
    write_head(json, desc->rings);
    write_scene(json, desc->parts);
    if (fclose(json) != 0)
        abort();
    void *glb = glb_make(text, numbers, bytes, size_bytes);
    free(text);
    free(numbers);
    return glb;
}
