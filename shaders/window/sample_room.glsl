// SPDX-License-Identifier: MIT
// Room in memory of the group for each sample of a thread's pixel, where samples are shaded in
// turn. The first sample of a group (sample_groups.glsl) has the group's surface and depth there,
// and then each sample its colour and its light: none of that is in registers while a surface is
// lit. Surfaces are fetched before any is lit: DG2 takes the address of a multisampled texel in
// halves of registers, and Mesa's compiler keeps those for as long as the loop goes round that
// writes them, ten registers of 128 for each fetch.
// Needs: SAMPLES (4), SAMPLES_APART. Provides: SURFACE_WORDS, GROUP_DEPTH and, with SAMPLES_APART,
// GROUP_NORMAL, which are read before OPAQUE_COLOR, KEEP_COLOR and LIGHT_WORD of a group's samples.
#define ROOM gl_LocalInvocationIndex
int room_sample = 0; // the first of the group that is lit
shared uvec4 room_words[SAMPLES][64]; // those of surface_pack_0, or a colour
#define SURFACE_WORDS(i) room_words[i][ROOM]
#define OPAQUE_COLOR(i) uintBitsToFloat(room_words[i][ROOM])
#define KEEP_COLOR(i, color) room_words[i][ROOM] = floatBitsToUint(color);
#ifdef SAMPLES_APART
shared vec4 room_normals[SAMPLES][64]; // at the samples' places, and depths
#define GROUP_NORMAL(i) room_normals[i][ROOM].xyz
#define GROUP_DEPTH(i) room_normals[i][ROOM].w
#define KEEP_GROUP(i, depth, normal) room_normals[i][ROOM] = vec4(normal, depth);
#else
shared uint room_depths[SAMPLES][64]; // bits of a depth, or a word of light
#define GROUP_DEPTH(i) uintBitsToFloat(room_depths[i][ROOM])
#define KEEP_GROUP(i, depth) room_depths[i][ROOM] = floatBitsToUint(depth);
#define LIGHT_WORD(i) room_depths[i][ROOM]
#endif
