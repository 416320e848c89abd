/* SPDX-License-Identifier: MIT */
/* Every binding number, once. Storage buffers and texture units are separate spaces. */
#ifndef VITRAIL_SHADERS_SHARED_BINDINGS_H
#define VITRAIL_SHADERS_SHARED_BINDINGS_H

/* vertex attributes: 0 to 5 are streams of the mesh, and a struct draw_record is read per instance,
 * four words to an attribute. On llvmpipe an instance's attribute is fetched once for all vertices,
 * while a storage buffer is read word by word and lane by lane. */
#define ATTRIBUTE_DRAW 6
/* Where all faces of lights are drawn in one pass, an instance is an item as one face sees it, and
 * has two numbers instead: of its record and of its face. */
#define ATTRIBUTE_INSTANCE 13

/* uniform blocks */
#define UNIFORM_FACE 0 /* struct face_record */

/* storage buffers (at most 16 per stage on the reference device) */
#define BIND_MATERIALS 1    /* struct material_record[] */
#define BIND_LIGHTS 2       /* struct light_record[] */
#define BIND_SHADOWS 3      /* struct shadow_record[]; read through UNIT_SHADOW_RECORDS */
#define BIND_PIXEL_COUNTS 4 /* transparency: u32 per pixel: end of its list */
#define BIND_ENTRY_KEYS 5   /* transparency: uvec4 per entry: depth, coverage, ... */
#define BIND_ENTRY_SURFACE_0 6
#define BIND_ENTRY_SURFACE_1 7
/* two vec4 per entry: radiance; word of filter_word.glsl and coverage */
#define BIND_ENTRY_COLORS 8
/* uvec4: transmission, thickness (of a medium: both hold transmission and slopes of the depth),
 * pixel, depth */
#define BIND_ENTRY_SURFACE_2 9
#define BIND_ENTRY_LOBES 13     /* shaders/draw/lobes.glsl, where materials have any */
#define BIND_ENTRY_MORE_LOBES 0 /* likewise */

/* building shadows and lists; numbers above are not in use at that time and may be shared */
#define BIND_DEEP_LIGHTS 5          /* struct deep_light[] */
#define BIND_DEEP_LISTS 6           /* u32 per class and light: its first list of texels */
#define BIND_DRAWS 4                /* struct draw_record[]: shadow casters of all faces at once */
#define BIND_SHADOW_FACES 8         /* struct face_record[], likewise */
#define BIND_SHADOW_MEDIA 7         /* uvec4 per event: medium, later extinction */
#define BIND_SHADOW_SCRATCH_MEDIA 8 /* u32 per event */
#define BIND_SHADOW_COUNTS 9        /* deep build: u32 per texel; in the pool of depths */
#define BIND_SHADOW_EVENTS 10       /* vec4 per event: depth, transmittance */
#define BIND_SHADOW_KEYS 11         /* u32 per two events: SHADOW_KEYS_AT */
#define BIND_SHADOW_HEADS 11        /* while counts are scanned: u32 per texel, and one */
#define BIND_SHADOW_EVENTS_ID 12
#define BIND_SCAN 13        /* block sums of a scan */
#define BIND_LIGHT_HEADS 13 /* linked light lists: counter and heads under construction */
/* the grid of a light's blockers (shaders/shadows/area_grid.glsl), beside BIND_TRACED_POINTS;
 * materials stay bound */
#define BIND_AREA_CORNERS 0   /* uvec4, three per triangle: position, normal */
#define BIND_AREA_OWNERS 13   /* u32 per triangle: its caster */
#define BIND_AREA_CASTERS 2   /* struct area_caster[] */
#define BIND_AREA_CELLS 3     /* u32: AREA_HEAD_WORDS, then the farthest depth in each cell */
#define BIND_AREA_COUNTS 4    /* u32 per slot: points; then per cell: triangles without a place */
#define BIND_AREA_FIRSTS 5    /* u32 per cell, and one: its first pair */
#define BIND_AREA_STARTS 6    /* struct area_start[], per point */
#define BIND_AREA_PLACES 7    /* uvec2 per point: its cell, its first filter */
#define BIND_AREA_PAIRS 8     /* u32: triangles, by cell */
#define BIND_AREA_TABLE 9     /* uvec2 per point, as UNIT_TRACED_POINTS */
#define BIND_AREA_MASKS 9     /* uvec4, area_table.h; once points have their cells */
#define BIND_AREA_FILTERS 10  /* uvec2, as UNIT_TRACED_FILTERS */
#define BIND_AREA_LIGHTS 12   /* u32 per light: filters that it has at a point */
#define BIND_TRACED_POINTS 11 /* points that traced shadows are asked for */
#define BIND_TRACED_HEADS 12  /* u32 per pixel: its first point << 3 | their number */
/* shadow volumes, after points were collected (renderer/shadows/finder_volume.c) */
#define BIND_VOLUME_TABLE 0      /* uvec2 per point: first filter, cluster */
#define BIND_VOLUME_VERTICES 2   /* vec4, view space */
#define BIND_VOLUME_EDGES 3      /* uvec4: vertices, first side, sides */
#define BIND_VOLUME_LIGHTS 3     /* u32 per light: 1 where it is shadowed; by points */
#define BIND_VOLUME_SIDES 4      /* uvec2: vertex opposite, triangle */
#define BIND_VOLUME_TRIANGLES 5  /* uvec4: vertices, item */
#define BIND_VOLUME_SIGNS 11     /* i32 per triangle: on which side the light is */
#define BIND_VOLUME_WEIGHTS 6    /* uvec4 per item: struct volume_weight, or its group */
#define BIND_VOLUME_GROUPS 6     /* vec4 per group: its filter; by points */
#define BIND_VOLUME_FACES 7      /* struct volume_face, of silhouettes and then of triangles */
#define BIND_VOLUME_SPANS 8      /* uvec2: face, tiles */
#define BIND_VOLUME_PARTS 8      /* uvec2: edge, which of its patches; where faces are drawn */
#define BIND_VOLUME_STARTS 9     /* vec4 per point: off its surface, and the light's filter */
#define BIND_VOLUME_SUMS 10      /* i32, six per point */
#define BIND_VOLUME_ENDS 13      /* u32 per pixel: end of its layers; while faces are crossed */
#define BIND_VOLUME_REACH 13     /* u32: bits of items; while faces are made */
#define BIND_VOLUME_TILES 12     /* u32 per tile: depth, volume_window.glsl; likewise */
#define BIND_VOLUME_SMALL 15     /* uvec2: face, pixels; while faces are made and crossed */
#define BIND_VOLUME_FILTERS 15   /* uvec2 */
#define BIND_VISIBILITY 11       /* while surfaces are lit: uvec2 per point and lobe */
#define BIND_STATISTICS 14       /* counters read back by the report */
#define BIND_PIXEL_LEFT 10       /* u32 per pixel: entries counted, and not yet written */
#define BIND_SCREEN 10           /* u32: the window as a screen shows it */
#define BIND_APART 10            /* u32: pixels whose samples are shaded apart */
#define BIND_CANDIDATES 11       /* likewise: pixels that may be such, */
#define BIND_APART_FOUND 11      /* and those that are, while they are read through BIND_APART */
#define BIND_TONE_BUCKETS 11     /* struct tone_bucket[] */
#define BIND_LIST_NODES 15       /* linked techniques: elements under construction */
#define BIND_FILLED 15           /* u32: what is filled before it is built */
#define BIND_ATMOSPHERE 11       /* while haze is lit: f32, three per slice of a column */
#define BIND_ATMOSPHERE_REACH 10 /* likewise: f32 per column: farthest surface in it */
#define BIND_SMOKE_LIGHT 11      /* while density grids are lit: vec4 per node of a column */
#define BIND_SMOKE_DEPTHS 11     /* before: shaders/shading/smoke_depths.glsl */
#define BIND_PEELED 12           /* transparency: u32 per pixel: peeled_state.glsl */
#define BIND_PEELED_SUMS 15      /* vec4 per sample: peeled_sums.glsl; haze is not there */
#define BIND_ATMOSPHERE_GLOW 12  /* likewise, and in the picture: atmosphere_glow_store.glsl */
#define BIND_ATMOSPHERE_SUMS 15  /* while haze is lit: vec4 per slice of a corner */

/* words of the counters of shadow volumes; before: spans. Six of what the eye's light loses. */
#define VOLUME_OF_EYE 1u
/* Two each: of the pixels with points that the light gets to, the first's complement, and the end.
 */
#define VOLUME_FIRST_PIXEL 7u
#define VOLUME_END_PIXEL 9u
/* How far a way's end is seen from its pixel's middle, at most: bits of a float [px]. */
#define VOLUME_BORDER 11u
#define VOLUME_SMALL 12u    /* faces of a few pixels; */
#define VOLUME_EDGES 13u    /* those whose triangles do not cancel */
#define VOLUME_OVERFLOW 14u /* set where a stencil has counted as far as it can */
#define VOLUME_COUNTERS 15
#define VOLUME_STENCIL_MOST 255u
#define VOLUME_TILE_PX 8u
/* Where faces are drawn as often as they count: of an edge in one go. A tessellator makes 64
 * segments at the most, and the last of 32 quads ends with the 63rd. */
#define VOLUME_PATCH_QUADS 32u

/* words of the statistics of a window's layers; before: how many there are, and of one pixel */
#define STATISTICS_PEELING 2 /* set where a pixel may have more layers than are peeled */

/* texture units */
#define UNIT_GBUFFER_SIGNATURE 7
#define UNIT_MATERIAL_0 0 /* units 0..20: slots in the order of enum scene_texture_slot */
#define UNIT_GBUFFER_0 8
#define UNIT_GBUFFER_1 9
#define UNIT_GBUFFER_DEPTH 10
#define UNIT_GBUFFER_LOBES 6
#define UNIT_GBUFFER_MORE_LOBES 5
#define UNIT_VOLUME_SURFACES 0 /* sampler2D: what ways to surfaces gained; by points */
#define UNIT_VOLUME_LAYERS 1   /* likewise to the nearest layer */
#define UNIT_VOLUME_STENCIL 0  /* usampler2D: faces that a way crosses; by pixels */
#define UNIT_SHADOW_DEPTH 11   /* samplerBuffer R32F: nearest opaque caster */
#define UNIT_SHADOW_HEADS 12   /* usamplerBuffer */
#define UNIT_SHADOW_EVENTS 13  /* samplerBuffer RGBA32F: depth, transmittance */
#define UNIT_SHADOW_KEYS 14    /* usamplerBuffer RGBA32UI: SHADOW_KEYS_AT, four words each */
#define UNIT_SHADOW_ID 15      /* usamplerBuffer */
#define UNIT_LIGHT_HEADS 16    /* usamplerBuffer RG32UI: offset and count, or head */
#define UNIT_LIGHT_ITEMS 17    /* usamplerBuffer: light indices (or list nodes) */
#define UNIT_LIGHT 11 /* usampler2DArray R32UI: light of opaque surfaces, after they are shaded */
/* traced shadows take the place of all maps */
#define UNIT_TRACED_HEADS 12   /* usamplerBuffer R32UI: as BIND_TRACED_HEADS */
#define UNIT_TRACED_POINTS 13  /* usamplerBuffer RG32UI: first filter, cluster */
#define UNIT_TRACED_FILTERS 14 /* usamplerBuffer RG32UI: a light's filter, in 64 bits */
#define UNIT_SHADOW_NODES 18   /* usamplerBuffer RGBA32UI: linked shadow list nodes */
#define UNIT_SHADOW_RECORDS 19 /* usamplerBuffer RGBA32UI: struct shadow_record, 6 texels each */
#define UNIT_LIGHT_RECORDS 20  /* linked light lists: samplerBuffer RGBA32F, 6 texels per light */
#define UNIT_LIGHT_MESH 21     /* linked light lists: samplerBuffer RGBA32F, triangle soup */
#define UNIT_SHADOW_MEDIA 23   /* usamplerBuffer RGBA32UI: extinction behind each event */
#define UNIT_ENVIRONMENT_DIFFUSE 24  /* sampler2D: environment_diffuse_map */
#define UNIT_ENVIRONMENT_SPECULAR 25 /* sampler2D: a level per step of roughness */
#define UNIT_ENVIRONMENT_RADIANCE 26 /* sampler2D: what is seen of it */
#define UNIT_LIGHT_AREAS 27          /* samplerBuffer RGBA32F: struct area_record, 2 texels each */
#define UNIT_AREA_LOBES 28 /* samplerBuffer RGBA32F: struct area_lobe_record, 2 texels each */
#define UNIT_REFRACTION_LEVELS 29 /* sampler2D: the picture without what bends light */
#define UNIT_SHADOW_TEXELS 30     /* samplerBuffer RGBA32F: shadow_texel.glsl */
/* density grids, while surfaces are lit and composited, when no texture of a material is bound */
#define UNIT_GRID_RECORDS 0    /* usamplerBuffer RGBA32UI: struct grid_record */
#define UNIT_GRID_BRICKS 1     /* usamplerBuffer R32UI: 1 + index of the values; 0: empty */
#define UNIT_GRID_VALUES 2     /* samplerBuffer RG32F: GRID_BRICK_TEXELS per brick */
#define UNIT_SMOKE_LIGHT 3     /* samplerBuffer RGBA32F: as BIND_SMOKE_LIGHT */
#define UNIT_SMOKE_DEPTHS 3    /* before: samplerBuffer RG16F: as BIND_SMOKE_DEPTHS */
#define UNIT_ATMOSPHERE_SUMS 4 /* samplerBuffer RGBA32F: as BIND_ATMOSPHERE_SUMS; likewise */
#define UNIT_LIGHT_FRONT 22    /* linked light lists: sampler2D R32F, depth of front faces */

#endif
