// SPDX-License-Identifier: MIT
// Provides: the tiles of a light linked list under construction.
uniform vec4 u_window; // corners of the tiles, x0 y0 x1 y1: tangents, or metres when orthographic
uniform vec4 u_tiles;  // xy: columns, rows; z: 1 when orthographic
