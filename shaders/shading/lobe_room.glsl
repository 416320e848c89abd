// SPDX-License-Identifier: MIT
// Room in memory of the group for the lobes of the surface that each thread lights, where registers
// are scarce: all lobes together have 25 numbers, each light asks for them, and none is needed
// while its shadow is looked up. They are left there once, and taken part by part where they are
// used; so is what sample_room.glsl has of the surface already. Without SAMPLES_IN_TURN all of it
// stays in brdf_input.
// Needs: HAS_LOBES, brdf_input.glsl; 64 threads in a group; sample_room.glsl before it where that
// is used.
// Provides: lobes_leave; lobes_take_base: normal, base and what belongs to it; lobes_take_cover:
// normal, fibres and coat; lobes_take_normal; lobes_take_geo_normal, of the triangle.
#ifdef SAMPLES_IN_TURN
#define LOBE_ROOM gl_LocalInvocationIndex
shared vec4 room_specular[64], room_sheen[64], room_coat[64]; // brdf_input's, and their roughness
shared vec4 room_normal[64]; // w: alpha
shared vec2 room_below[64]; // below_sheen, below_coat
#ifdef HAS_MORE_LOBES
shared vec4 room_film[64], room_translucent[64], room_grain[64];
#endif

void lobes_leave(brdf_input b)
{
    room_normal[LOBE_ROOM] = vec4(b.normal, b.alpha);
    if (MATERIAL_MAY_BE(MATERIAL_SPECULAR))
        room_specular[LOBE_ROOM] = b.specular;
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN))
        room_sheen[LOBE_ROOM] = vec4(b.sheen, b.sheen_roughness);
    if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT))
        room_coat[LOBE_ROOM] = vec4(b.coat_normal, b.coat_alpha);
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN | MATERIAL_CLEARCOAT))
        room_below[LOBE_ROOM] = vec2(b.below_sheen, b.below_coat);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_FILM))
        room_film[LOBE_ROOM] = vec4(b.film, 0.0);
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
        room_translucent[LOBE_ROOM] = b.translucent;
    if (MATERIAL_MAY_BE(MATERIAL_GRAIN))
        room_grain[LOBE_ROOM] = b.grain;
#endif
}

// The barriers keep compilers from holding in registers what was left.
void lobes_take_normal(inout brdf_input b)
{
    memoryBarrierShared();
    vec4 word = room_normal[LOBE_ROOM];
    b.normal = word.xyz;
    b.alpha = word.w;
}

void lobes_take_base(inout brdf_input b)
{
    lobes_take_normal(b);
#ifdef SURFACE_WORDS
    b.base = surface_unpack(SURFACE_WORDS(room_sample), uvec4(0u)).base;
#endif
    if (MATERIAL_MAY_BE(MATERIAL_SPECULAR))
        b.specular = room_specular[LOBE_ROOM];
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_FILM))
        b.film = room_film[LOBE_ROOM].xyz;
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT))
        b.translucent = room_translucent[LOBE_ROOM];
    if (MATERIAL_MAY_BE(MATERIAL_GRAIN))
        b.grain = room_grain[LOBE_ROOM];
#endif
}

void lobes_take_cover(inout brdf_input b)
{
    lobes_take_normal(b);
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN)) {
        vec4 fibres = room_sheen[LOBE_ROOM];
        b.sheen = fibres.rgb;
        b.sheen_roughness = fibres.w;
    }
    if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT)) {
        vec4 coat = room_coat[LOBE_ROOM];
        b.coat_normal = coat.xyz;
        b.coat_alpha = coat.w;
    }
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN | MATERIAL_CLEARCOAT)) {
        b.below_sheen = room_below[LOBE_ROOM].x;
        b.below_coat = room_below[LOBE_ROOM].y;
    }
}

#ifdef SURFACE_WORDS
void lobes_take_geo_normal(inout vec3 geo_normal)
{
    geo_normal = unpack_unit(SURFACE_WORDS(room_sample).y);
}
#else
void lobes_take_geo_normal(vec3 geo_normal) {}
#endif
#else
void lobes_leave(brdf_input b) {}
void lobes_take_normal(brdf_input b) {}
void lobes_take_geo_normal(vec3 geo_normal) {}
void lobes_take_base(brdf_input b) {}
void lobes_take_cover(brdf_input b) {}
#endif
