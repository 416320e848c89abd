/* SPDX-License-Identifier: MIT */
/* Records in storage buffers, std430, shared by C and GLSL. Positions are in view space for shading
 * and in the light's for shadow passes, along axes that turn with them: what leads there is
 * composed in f64 on the CPU. */
#ifndef VITRAIL_SHADERS_SHARED_RECORDS_H
#define VITRAIL_SHADERS_SHARED_RECORDS_H

struct draw_record {          /* one primitive of one node, in one space */
    vec4 row_0, row_1, row_2; /* position there = rows * (model position, 1), in the scene's unit */
    vec4 normal_0, normal_1, normal_2; /* cofactor rows for normals; .w of normal_0: sign of the
                                          determinant; of normal_1: 1 where vertices
                                          of a triangle differ in their normals */
    uint material;                     /* index into material_record[] */
    uint node;                         /* index of the scene's node */
    uint primitive;                    /* index of the scene's primitive */
    uint object;                       /* node index again, narrowed by flags: see shadow flags */
};
LAYOUT(draw_record, row_0, 0)
LAYOUT(draw_record, normal_0, 48)
LAYOUT(draw_record, material, 96)
LAYOUT_SIZE(draw_record, 112)

#define FACE_PLANES_MAX 8

/* Tries for a spin lock. A thousand holders that each walk a list of a thousand elements, at 0.5 us
 * per element, take 0.5 s; as many tries, at 0.5 us for the read of the lock alone, take as long.
 */
#define LOCK_TRIES 0x100000u

struct face_record { /* one face of a light, as its casters are drawn. Axes are those of the light
                      */
    vec4 axis_x, axis_y, axis_z; /* rows of face_from_light, of 0, 1 and -1; w: metres of the
                                    scene's unit; farthest: no event is deeper [m]; 1 for
                                    perspective faces, 0 for orthographic ones */
    vec4 clip;                   /* x' = x * clip.x, y' = y * clip.y, z' = clip.z + z * clip.w */
    vec4 cut_planes[FACE_PLANES_MAX]; /* that cut casters [m] */
    uint first_count;                 /* where the counts, or the list heads, of its texels start */
    uint event_base;                  /* first event, or element, of the light ... */
    uint event_count;                 /* ... and those that there is room for */
    uint slot;                        /* linked lists: of the light in the statistics */
    uint resolution;                  /* texels per side */
    uint layer;                       /* of the target */
    uint scatters;                    /* deep lists: 1 in the second pass */
    uint blend_filter;
    uint lock_tries; /* linked lists with locks: tries of an element */
    uint first_end;  /* deep lists: where the ends of its texels' lists start in the pool */
    uint seed;       /* of the face's noise: shadow_noise.glsl */
    uint part;       /* of what a pass draws part by part: shadow_texel.frag.glsl */
    vec4 depths;     /* of moments; x: the nearest depth [m], y: depths per metre, [0, 2] to the
                        farthest; the rest is unused: records are parts of a uniform buffer,
                        GL_BUFFER_ALIGNMENT */
};
LAYOUT(face_record, clip, 48)
LAYOUT(face_record, cut_planes, 64)
LAYOUT(face_record, first_count, 192)
LAYOUT(face_record, blend_filter, 220)
LAYOUT(face_record, depths, 240)
LAYOUT_SIZE(face_record, 256)

#define MATERIAL_UNLIT 1u
#define MATERIAL_DOUBLE_SIDED 2u
#define MATERIAL_MASK 4u
#define MATERIAL_BLEND 8u
#define MATERIAL_TRANSMISSION 16u
#define MATERIAL_PASS_SLAB 32u
#define MATERIAL_PASS_EDGE 64u
#define MATERIAL_NO_SELF_SHADOW 128u
#define MATERIAL_CAST_ONCE 256u
#define MATERIAL_VOLUME 512u  /* thickness > 0 */
#define MATERIAL_MEDIUM 1024u /* of a medium's item: attenuation acts along the way inside */

#define MATERIAL_SPECULAR 2048u  /* other than the dielectric's own reflection */
#define MATERIAL_CLEARCOAT 4096u /* a coat over all */
#define MATERIAL_SHEEN 8192u     /* fibres over the base */
#define MATERIAL_FILM 16384u     /* a thin film over the base (KHR_materials_iridescence) */

#define MATERIAL_GRAIN 32768u /* anisotropic: KHR_materials_anisotropy */
#define MATERIAL_TRANSLUCENT \
    0x20000u /* diffuses light from behind: KHR_materials_diffuse_transmission */

/* What is seen through it is refracted or scattered; of the item: it is a side of a closed body. */
#define MATERIAL_BENDS 0x40000u
#define MATERIAL_SOLID 0x80000u
/* Lets through what lies behind it, as far as
 * light arrives on it. */
#define MATERIAL_GROUND 0x100000u
#define BEND_ROUGHNESS_LEAST 0.07 /* smoother surfaces count as smooth */

/* Those with the second word of four of lobes.glsl. */
#define MATERIAL_MORE_LOBES (MATERIAL_FILM | MATERIAL_GRAIN | MATERIAL_TRANSLUCENT)
#define MATERIAL_LOBES \
    (MATERIAL_SPECULAR | MATERIAL_CLEARCOAT | MATERIAL_SHEEN | MATERIAL_MORE_LOBES)

#define MATERIAL_KIND_METAL 0x10000u /* of no record: in masks of kinds, see material.glsl */

#define ENTRY_HIDDEN                                                             \
    0x80000000u /* of a list key's coverage: the surface of a medium that is cut \
                   away or behind something, there for the medium alone */

#define ENTRY_BENDS 0x40000000u /* likewise: of MATERIAL_BENDS, and seen */

struct material_record {
    vec4 base_color;
    vec4 emissive_alpha_cutoff; /* rgb [nt]; w cutoff */
    vec4 metallic_roughness_normal_occlusion;
    vec4 transmission_f0_thickness; /* x transmission; y f0 of the dielectric; z thickness [m]; w
                                       edge exponent */
    vec4 attenuation;               /* rgb: extinction sigma [1/m] of the medium; w its index */
    vec4 edge_color;    /* w: how much lower the index is for red, and higher for blue */
    uint flags;         /* MATERIAL_* */
    uint lobes;         /* of MATERIAL_LOBES: the record with LOBES_... and uv_transforms of slots
                           SLOTS_OF_BASE on; of MATERIAL_MORE_LOBES: the next record has those of
                           slots 2 * SLOTS_OF_BASE on */
    uint texcoord_mask; /* bit set: slot uses TEXCOORD_1 */
    uint source;        /* index of the scene's material: scaled copies share one */
    vec4 uv_transforms[14]; /* two rows per slot: (a, b, c, -) */
};
#define SLOTS_OF_BASE 7 /* of enum scene_texture_slot */
/* What a record holds that another names as its lobes. */
#define LOBES_SPECULAR \
    base_color /* rgb: tint of the dielectric's f0; w: weight of its reflection */
/* x coat, y its roughness, z that of the sheen, w scale of the coat's normal map */
#define LOBES_COAT_SHEEN emissive_alpha_cutoff
#define LOBES_SHEEN_COLOR metallic_roughness_normal_occlusion /* w unused */
/* x weight of the film, y its index of refraction, z and w thickness [nm] where the texture is 0
 * and 1 */
#define LOBES_FILM transmission_f0_thickness
#define LOBES_TRANSLUCENT attenuation /* rgb colour of what is diffused; w its share */
#define LOBES_GRAIN edge_color        /* x strength; y, z cosine and sine of its turn; w unused */
LAYOUT(material_record, flags, 96)
LAYOUT(material_record, uv_transforms, 112)
LAYOUT_SIZE(material_record, 336)

#define LIGHT_DIRECTIONAL 0u
#define LIGHT_POINT 1u
#define LIGHT_SPOT 2u
#define LIGHT_AREA 3u /* a Lambertian emitter: all of it, or seen from area_samples points */
#define NO_SHADOW 0xffffffffu

struct light_record {
    vec4 position_range; /* xyz view space [m]; w range [m], 0 = unbounded */
    vec4 color;          /* rgb: tint * intensity [cd or lx; area: nt m2]; w unused */
    vec4 direction_cone; /* xyz: direction of travel, unit, view space; w spot scale: 1 / max(cos_in
                            - cos_out, 1e-3) */
    uint type;           /* LIGHT_* */
    uint shadow;         /* index of shadow_record, where shadows are traced any; or NO_SHADOW */
    float spot_offset;   /* -cos_out * scale */
    uint dims_in_grids;  /* not 0: density grids shadow it */
};
LAYOUT(light_record, color, 16)
LAYOUT(light_record, type, 48)
LAYOUT_SIZE(light_record, 64)

/* A density grid in view space, read as GRID_RECORD_TEXELS of UNIT_GRID_RECORDS. */
#define GRID_RECORD_TEXELS 6
#define GRIDS_MAX 8           /* that a rasterised picture shows */
#define GRID_BRICK_TEXELS 648 /* 8 x 9 x 9 pairs: renderer/scene/grid_texels.h */
struct grid_record {
    vec4 row_0, row_1, row_2; /* voxels = rows * (view position, 1) */
    uvec4 size_brick;         /* xyz: voxels; w: first of its bricks */
    vec4 sigma_dark;          /* rgb: extinction of a value of 1 [1/m]; w: the integral of the value
                                 behind which nothing is seen [m] */
    vec4 color_anisotropy;    /* rgb: the share that scatters */
};
LAYOUT(grid_record, size_brick, 48)
LAYOUT(grid_record, color_anisotropy, 80)
LAYOUT_SIZE(grid_record, 96)

struct area_record { /* beside each light_record; zero where that is no area */
    vec4 half_u;     /* xyz: from the centre, view space [m]; w 1: the inscribed disk */
    vec4 half_v;     /* likewise; w: 1 over its area [1/m2] */
};
LAYOUT(area_record, half_u, 0)
LAYOUT_SIZE(area_record, 32)

/* The GGX lobe of a roughness and a view, as a linear transform M of the cosine lobe:
 * M = turn about y by `turn`, counted from the mirrored view * [[a, 0, skew], [0, c, 0], [0, 0,
 * 1]], with a = along * alpha and c = across * alpha * sqrt(n_dot_v^2 (1 - alpha^2) + alpha^2). Row
 * i of AREA_LOBE_SIDE has the roughness AREA_LOBE_LEAST + (1 - AREA_LOBE_LEAST) * i /
 * (AREA_LOBE_SIDE - 1), column k the cosine 1 - (k / (AREA_LOBE_SIDE - 1))^2 of the view. */
#define AREA_LOBE_SIDE 32
#define AREA_LOBE_LEAST 0.0316227766 /* the root of MIN_ALPHA */
struct area_lobe_record {
    vec4 along_across_skew_turn;
    vec4 energy_cosines; /* x: of a uniform light from everywhere, the share that is sent on if all
                            reflect; y: the cosine at which Schlick's weight is its mean over the
                            lobe; z: likewise over Lambert's lobe; w unused */
};
LAYOUT(area_lobe_record, energy_cosines, 16)
LAYOUT_SIZE(area_lobe_record, 32)

#define SHADOW_ONE_FACE 0u /* perspective along the light's axis */
#define SHADOW_CUBE 1u     /* six perspective faces, +X -X +Y -Y +Z -Z */
#define SHADOW_ORTHOGRAPHIC 2u

#define SHADOW_FLAG_RAW 1u   /* raw transmittances and objects are kept, to leave objects out */
#define SHADOW_FLAG_MEDIA 2u /* events say which extinction acts behind them */
#define SHADOW_FLAG_NODES 4u /* nodes of a compressed function instead of events */
#define SHADOW_RECORD_TEXELS 6
#define SHADOW_TEXEL_FAR 3e38 /* the depth of texels without a transparent caster */
/* Moments have a part for each colour, this one, and no other. */
#define SHADOW_PART_TOTAL 3u
#define SHADOW_ALL_LIT                                                         \
    0xffffffffu /* no layer: nothing is nearer to the light than the partition \
                 */

/* A list of n deep events that starts at `event` of the pool has n / 2 words of keys beside it,
 * which no other list uses: those of its events 1 and 2, 3 and 4, ... (counted from 0), the first
 * of two in the lower half; a missing last one is SHADOW_KEY_NONE. A key is the depth in steps:
 * shadow_key.glsl. */
#define SHADOW_KEYS_AT(event) (((event) + 1) / 2)
#define SHADOW_KEY_MOST 32766
#define SHADOW_KEY_NONE 32767u

struct shadow_record {           /* read as SHADOW_RECORD_TEXELS of UNIT_SHADOW_RECORDS */
    vec4 axis_x, axis_y, axis_z; /* rows of light_from_view: light coordinate = dot(axis.xyz, p) +
                                    axis.w for p in view space [m]; the light looks along +z */
    vec4 projection; /* perspective: x = 1/tan(half), y = width of a texel at distance 1,
                        z = near [m];
                        orthographic: x, y = 1/half extents, z = depth range [m];
                        w = keys per metre of deep events */
    uint technique_shape_flags_resolution; /* number of the technique | SHADOW_ONE_FACE ... << 4 |
                                         SHADOW_FLAG_* << 8 | texels per side of a face << 16 */
    uint depth_base; /* of a texel: depth_base + (face * resolution + y) * resolution + x */
    uint head_base;  /* likewise */
    uint event_base; /* first event in the pools */
    vec4 sigma;      /* rgb: extinction where the light stands [1/m], with SHADOW_FLAG_MEDIA */
};
LAYOUT(shadow_record, projection, 48)
LAYOUT(shadow_record, technique_shape_flags_resolution, 64)
LAYOUT(shadow_record, sigma, 80)
LAYOUT_SIZE(shadow_record, 96)

struct deep_light {             /* one of the lights whose lists are built together */
    vec4 sigma_high, sigma_low; /* rgb: extinction where the light stands [1/m]: their sum */
    uint first_count, texels;   /* its counts in the pool */
    uint first_tile;            /* of those that a scan divides the counts of all lights into */
    uint shortest;              /* events from which on a list must be finished */
    uint event_base;            /* first event in the pools */
    float keys_per_m;
    uint first_head;               /* of its texels in the pool */
    uint event_room, longest_room; /* that there is room for: events, and those of one list */
    uint pad[3];
};
LAYOUT(deep_light, sigma_low, 16)
LAYOUT(deep_light, first_count, 32)
LAYOUT(deep_light, event_base, 48)
LAYOUT(deep_light, longest_room, 64)
LAYOUT_SIZE(deep_light, 80)

#define SHADOW_POINT_PIXEL_BITS 24 /* windows have at most 2^21 pixels */
#define SHADOW_POINT_UNLIT 1u      /* no light is asked for it */
#define SHADOW_POINT_TRANSMITS 2u  /* light from behind counts, too */
#define SHADOW_POINT_EXCLUDED_NODE \
    2 /* shift: a node, and one, that casts no shadow here; 0: none */

struct shadow_point { /* one surface of a pixel, or one entry of its list, that asks for shadows */
    vec4 position_offset; /* xyz view space [m]; w how far its surface may lie above it [m] */
    uint geo_normal;      /* of the triangle and for shading: pack.glsl, on the viewer's side */
    uint normal;
    /* Row * width + column of the window, row 0 at the bottom, and above that the roughness in 8
     * bits. */
    uint pixel_roughness;
    uint flags; /* SHADOW_POINT_* */
};
LAYOUT(shadow_point, geo_normal, 16)
LAYOUT(shadow_point, flags, 28)
LAYOUT_SIZE(shadow_point, 32)

/* lobes over which rays find what is left of the light of an environment map */
#define VISIBILITY_DIFFUSE 0
#define VISIBILITY_MIRRORED 1
#define VISIBILITY_BEHIND 2 /* where some material is MATERIAL_TRANSLUCENT */
#define VISIBILITY_LOBES 3
/* Traced transmittance in two words: 19 bits for each channel's share of 2^(1 - e), and 7 for e. */
#define TRACED_FILTER_BITS 19
#define TRACED_EXPONENT_MAX 100

/* The grid of what blocks a light (shaders/shadows/area_grid.glsl). */
#define AREA_SIDE 128     /* cells a side: light on one side of a plane, or parallel */
#define AREA_FACE_SIDE 64 /* likewise of each of the six faces around a point */
#define AREA_FACES 6
#define AREA_FACE_WORDS 7 /* of a face: bounds, farthest depth, how far rays may start aside */
#define AREA_SLOTS 4096   /* even parts of an axis of a face, which belong to cells */
#define AREA_BOUND_WORDS (AREA_FACES * AREA_FACE_WORDS)
#define AREA_HEAD_WORDS                                                      \
    (AREA_BOUND_WORDS + AREA_FACES * 2 * AREA_SLOTS) /* bounds, slots' cells \
                                                      */
#define AREA_RECTANGLE 0 /* kinds of light: an area on a plane, a point, parallel */
#define AREA_POINT 1
#define AREA_PARALLEL 2
#define AREA_FLAT 0x80008000u /* the first normal's word of a triangle whose vertices share one */
#define AREA_NOWHERE 0xffffffffu
#define AREA_TABLE_SIDE 1024    /* angles, and places, of lines on a light in a table of them */
#define AREA_TABLE_REACH 1.4143 /* of their places, in units of half the light's sides */
#define AREA_LOG_ONE (1 << 20)  /* filters are sums of -log2 in this unit, which never ... */
#define AREA_LOG_MOST (1 << 30) /* ... exceed this: nothing passes */
#define AREA_CASTER_OPAQUE 1u
#define AREA_CASTER_WHOLE 2u /* clip planes do not cut it: it closes a cut */
#define AREA_CASTER_NODE 2   /* shift: its node, and one */

struct area_caster {          /* all triangles of one item */
    uint flags;               /* AREA_CASTER_* */
    uint log_r, log_g, log_b; /* what one crossing takes: AREA_LOG_ONE */
};
LAYOUT(area_caster, log_r, 4)
LAYOUT_SIZE(area_caster, 16)

struct area_start {     /* where the shadow rays of a point begin */
    vec4 origin_offset; /* from the scene's origin; w: how far off the surface [m] */
    float normal_x, normal_y, normal_z; /* unit */
    uint skip;                          /* the triangle that it lies on, where it is known */
};
LAYOUT(area_start, normal_x, 16)
LAYOUT(area_start, skip, 28)
LAYOUT_SIZE(area_start, 32)

struct area_statistics { /* of one light */
    uint pairs[2];       /* triangles in cells: low and high word */
    uint longest;        /* most in one cell */
    uint filters;        /* of all points of the chunk */
};
LAYOUT(area_statistics, longest, 8)
LAYOUT(area_statistics, filters, 12)
LAYOUT_SIZE(area_statistics, 16)

#endif
