/* SPDX-License-Identifier: MIT */
/* Light geometry of the faithful light linked lists: closed triangle soups that enclose a sphere
 * and a spherical sector, wound counter-clockwise seen from outside (in view space with z forward
 * taken as right-handed). */
#ifndef VITRAIL_RENDERER_LIGHTS_LIGHT_MESH_H
#define VITRAIL_RENDERER_LIGHTS_LIGHT_MESH_H

enum {
    LIGHT_MESH_SPHERE_VERTICES = 20 * 16 * 3, /* icosahedron, split twice */
    LIGHT_MESH_CONE_SEGMENTS = 24,
    LIGHT_MESH_CONE_RINGS = 4,
    LIGHT_MESH_CONE_VERTICES = 2 * LIGHT_MESH_CONE_RINGS * LIGHT_MESH_CONE_SEGMENTS * 3,
    LIGHT_MESH_VERTICES = LIGHT_MESH_SPHERE_VERTICES + LIGHT_MESH_CONE_VERTICES, /* sphere first */
};

/* Sphere: xyz, grown so that every facet stays outside the unit sphere. Cone: as
 * light_linked_list_mesh.vert.glsl reads it. */
void light_mesh_make(float vertices[LIGHT_MESH_VERTICES][4]);

#endif
