/* SPDX-License-Identifier: MIT */
/* A bar on two joints, as a GLB of JSON and numbers that tests may change. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_DEFORMED_SCENE_H
#define VITRAIL_TESTS_SUPPORT_DEFORMED_SCENE_H

#include <stddef.h>
#include <stdint.h>

/* The bar stands on the origin, a square of side 2 * BAR_HALF, from y = 0 to y = 2 in rings of
 * eight vertices, two for each corner. The lower ring hangs on joint 0, which is at the origin, the
 * upper one on joint 1, which is at (0, 1, 0), the middle one at y = 1 on both alike. */
enum {
    BAR_RINGS = 3,
    BAR_VERTICES = 8 * BAR_RINGS + 8,
    BAR_INDICES = 6 * 4 * (BAR_RINGS - 1) + 12
};
#define BAR_HALF 0.25f

/* The BIN chunk. Accessors of the document, in this order: positions 0, normals 1, joints 2,
 * weights 3, indices 4, matrices 5, times 6, turns 7 (two rotations), targets 8 and 9 (positions
 * and normals), amounts 10 (of two targets at three times), narrow 11 (weights as bytes), amounts
 * 12 (all of them, as cubic splines have it). */
struct bar {
    float positions[BAR_VERTICES][3], normals[BAR_VERTICES][3];
    uint8_t joints[BAR_VERTICES][4];
    float weights[BAR_VERTICES][4];
    uint16_t indices[BAR_INDICES];
    float matrices[2][16]; /* inverse bind matrices */
    float times[3];        /* 0, 1, 2 s */
    float turns[3][4];     /* of joint 1 about Z by 0, 90 and 0 degrees */
    float targets[2][BAR_VERTICES][3];
    float amounts[18];
    uint8_t narrow[BAR_VERTICES][4];
};
void bar_fill(struct bar *bar);

/* All of a document but its nodes, meshes, skins and animations, from the brace on, with a comma
 * at the end. */
void bar_write_head(char *json, size_t capacity);

/* The attributes of the skinned bar. */
#define BAR_ATTRIBUTES "'POSITION':0,'NORMAL':1,'JOINTS_0':2,'WEIGHTS_0':3"
/* Node 0 has the mesh and the skin, nodes 1 and 2 are its joints; joint 1 is turned by 90 degrees.
 */
#define BAR_NODES                                                                               \
    "'scenes':[{'nodes':[0,1]}],'nodes':[{'name':'Bar','mesh':0,'skin':0,'translation':[7,7,7]" \
    "},{'name':'Foot','children':[2]},{'name':'Knee','translation':[0,1,0],'rotation':[0,0,"    \
    "0.70710678118654752,0.70710678118654752]}]"
#define BAR_MESH "'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES "},'indices':4}]}]"
#define BAR_SKIN "'skins':[{'joints':[1,2],'inverseBindMatrices':5}]"

#endif
