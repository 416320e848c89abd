// SPDX-License-Identifier: MIT
// What the stages about the tessellator tell each other of a patch. Needs: PATCH: patch in, or out.
const uint VOLUME_FACE_COLUMNS = 4u;
#ifdef HAS_CAP
const uint VOLUME_PATCH_FACES = 4u;
#else
const uint VOLUME_PATCH_FACES = 3u;
#endif
PATCH float p_columns;   // less one: the last one's number
PATCH vec4 p_corners[8]; // two for each face: of a strip, in clip space
PATCH uvec2 p_told[4];   // of each face; of an edge without what is counted
PATCH ivec3 p_log2;      // of an edge: what it counts,
PATCH ivec3 p_stops;
PATCH uint p_first;      // and which of that comes first
