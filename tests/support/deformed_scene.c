/* SPDX-License-Identifier: MIT */
/* Fills the numbers of the bar. */
#include "tests/support/deformed_scene.h"

#include <stdio.h>
#include <string.h>

static const float corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};

static void add_vertex(struct bar *bar, int v, int corner, int ring, const float normal[3])
{
    bar->positions[v][0] = BAR_HALF * corners[corner][0];
    bar->positions[v][1] = (float)ring;
    bar->positions[v][2] = BAR_HALF * corners[corner][1];
    memcpy(bar->normals[v], normal, sizeof bar->normals[v]);
    bar->joints[v][1] = 1;
    bar->weights[v][0] = 1 - 0.5f * (float)ring;
    bar->weights[v][1] = 0.5f * (float)ring;
    bar->narrow[v][0] = (uint8_t)(ring == 0 ? 200 : ring == 1 ? 100 : 0);
    bar->narrow[v][1] = (uint8_t)(ring == 0 ? 0 : ring == 1 ? 100 : 50);
}

/* Side s lies between corners s and s + 1. */
static const float side_normals[4][3] = {{0, 0, -1}, {1, 0, 0}, {0, 0, 1}, {-1, 0, 0}};

static void add_sides(struct bar *bar)
{
    uint16_t *index = bar->indices;
    for (int ring = 0; ring < BAR_RINGS; ring++)
        for (int side = 0; side < 4; side++)
            for (int end = 0; end < 2; end++)
                add_vertex(bar, 8 * ring + 2 * side + end, (side + end) % 4, ring,
                           side_normals[side]);
    for (int ring = 0; ring + 1 < BAR_RINGS; ring++)
        for (int side = 0; side < 4; side++) {
            int a = 8 * ring + 2 * side, quad[6] = {a, a + 8, a + 1, a + 1, a + 8, a + 9};
            for (int k = 0; k < 6; k++)
                *index++ = (uint16_t)quad[k];
        }
}

static void add_ends(struct bar *bar)
{
    uint16_t *index = bar->indices + 6 * 4 * (BAR_RINGS - 1);
    for (int end = 0; end < 2; end++) {
        int first = 8 * BAR_RINGS + 4 * end;
        const float normal[3] = {0, end ? 1 : -1, 0};
        for (int corner = 0; corner < 4; corner++)
            add_vertex(bar, first + corner, corner, end ? BAR_RINGS - 1 : 0, normal);
        const int up[6] = {0, 2, 1, 0, 3, 2}, down[6] = {0, 1, 2, 0, 2, 3};
        for (int k = 0; k < 6; k++)
            *index++ = (uint16_t)(first + (end ? up[k] : down[k]));
    }
}

void bar_fill(struct bar *bar)
{
    const float half = 0.70710678f;
    memset(bar, 0, sizeof *bar);
    add_sides(bar);
    add_ends(bar);
    for (int joint = 0; joint < 2; joint++) {
        for (int k = 0; k < 4; k++)
            bar->matrices[joint][5 * k] = 1;
        bar->matrices[joint][13] = (float)-joint;
        bar->turns[2 * joint][3] = 1;
    }
    bar->turns[1][2] = bar->turns[1][3] = half;
    bar->times[1] = 1;
    bar->times[2] = 2;
    for (int v = 0; v < BAR_VERTICES; v++) {
        bar->targets[0][v][0] = bar->positions[v][0]; /* twice as wide */
        bar->targets[1][v][2] = 0.5f;                 /* of normals: leaning to +Z */
    }
}

void bar_write_head(char *json, size_t capacity)
{
    char *at = json, *end = json + capacity;
    at += snprintf(at, (size_t)(end - at),
                   "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],'bufferViews':[",
                   sizeof(struct bar));
    const struct {
        size_t offset, size;
    } views[] = {
#define ROW(member) {offsetof(struct bar, member), sizeof(((struct bar *)NULL)->member)}
        ROW(positions), ROW(normals), ROW(joints),  ROW(weights), ROW(indices), ROW(matrices),
        ROW(times),     ROW(turns),   ROW(targets), ROW(amounts), ROW(narrow),
    };
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        at += snprintf(at, (size_t)(end - at), "%s{'buffer':0,'byteOffset':%zu,'byteLength':%zu}",
                       i ? "," : "", views[i].offset, views[i].size);
    const struct {
        int view, component, count;
        const char *type;
        size_t offset;
    } accessors[] = {
        {0, 5126, BAR_VERTICES, "VEC3", 0},
        {1, 5126, BAR_VERTICES, "VEC3", 0},
        {2, 5121, BAR_VERTICES, "VEC4", 0},
        {3, 5126, BAR_VERTICES, "VEC4", 0},
        {4, 5123, BAR_INDICES, "SCALAR", 0},
        {5, 5126, 2, "MAT4", 0},
        {6, 5126, 3, "SCALAR", 0},
        {7, 5126, 3, "VEC4", 0},
        {8, 5126, BAR_VERTICES, "VEC3", 0},
        {8, 5126, BAR_VERTICES, "VEC3", sizeof(float[BAR_VERTICES][3])},
        {9, 5126, 6, "SCALAR", 0},
        {10, 5121, BAR_VERTICES, "VEC4", 0},
        {9, 5126, 18, "SCALAR", 0},
    };
    at += snprintf(at, (size_t)(end - at), "],'accessors':[");
    for (size_t i = 0; i < sizeof accessors / sizeof *accessors; i++)
        at += snprintf(at, (size_t)(end - at),
                       "%s{'bufferView':%d,'byteOffset':%zu,'componentType':%d,'count':%d,'type':"
                       "'%s'%s}",
                       i ? "," : "", accessors[i].view, accessors[i].offset, accessors[i].component,
                       accessors[i].count, accessors[i].type,
                       accessors[i].view == 10 ? ",'normalized':true" : "");
    snprintf(at, (size_t)(end - at), "],");
}
