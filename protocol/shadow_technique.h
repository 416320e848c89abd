/* SPDX-License-Identifier: MIT */
/* The shadow techniques, a row of plain data each. The enum, the names on the wire, what requests
 * may combine, /v1/capabilities and the help of the command line come from here. Pure functions.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_SHADOW_TECHNIQUE_H
#define VITRAIL_PROTOCOL_SHADOW_TECHNIQUE_H

#include <stdbool.h>
#include <stddef.h>

/* Sets of bits. */
enum shadow_can {
    SHADOW_CAN_COLOR = 1 << 0,        /* transparent casters colour the light that passes */
    SHADOW_CAN_MEDIA = 1 << 1,        /* closed volumes attenuate light on its way */
    SHADOW_CAN_AREA_LIGHTS = 1 << 2,  /* soft shadows of rect and disk lights */
    SHADOW_CAN_REFERENCE = 1 << 3,    /* `reference` goes with it */
    SHADOW_CAN_MANY_SAMPLES = 1 << 4, /* 64 and 256 samples per pixel */
    SHADOW_CAN_LINKED_LISTS = 1 << 5, /* `light_lists: linked` goes with it */
    SHADOW_CAN_ATMOSPHERE = 1 << 6,   /* `atmosphere` goes with it */
    SHADOW_CAN_GRIDS = 1 << 7,        /* density grids of the scene are seen, and cast shadows */
    SHADOW_CAN_FILTER = 1 << 8,       /* transparent casters dim the light that passes */
    SHADOW_CAN_LAYERS = 1 << 9,       /* each transparent surface has the light that gets to it */
    SHADOW_CAN_SELF_SHADOW = 1 << 10, /* `self_shadow` and `cast_once` of materials hold */
    SHADOW_CAN_BE_SMOOTH = 1 << 11,   /* light behind transparent casters is free of noise */
    SHADOW_CAN_INSIDE = 1 << 12, /* light is right within one transparent mesh and in haze, too */
};

/* Members of `quality` that change the pictures of a technique. */
enum shadow_parameter {
    SHADOW_HAS_RESOLUTION = 1 << 0,
    SHADOW_HAS_TAPS = 1 << 1,
    SHADOW_HAS_COMPRESSION = 1 << 2,
    SHADOW_HAS_PREFILTER = 1 << 3,
    SHADOW_HAS_FALLBACK = 1 << 4,
    SHADOW_HAS_AREA_SAMPLES = 1 << 5,
    SHADOW_HAS_MAP = SHADOW_HAS_RESOLUTION | SHADOW_HAS_TAPS,
    SHADOW_HAS_LISTS = SHADOW_HAS_COMPRESSION | SHADOW_HAS_PREFILTER | SHADOW_HAS_FALLBACK,
    SHADOW_HAS_ALL = (1 << 6) - 1,
};

/* What sorted lists and rays can tell of light in glass. */
#define SHADOW_CAN_GLASS                                                                 \
    (SHADOW_CAN_COLOR | SHADOW_CAN_FILTER | SHADOW_CAN_LAYERS | SHADOW_CAN_SELF_SHADOW | \
     SHADOW_CAN_BE_SMOOTH | SHADOW_CAN_INSIDE)

/* How far a technique is from the default in a trade-off, whose settings are measured from the
 * nearest on: 0 is the default, 1 what may take its place, 4 is for comparison alone.
 *
 * The candidates of `auto` have the words by which it tells of their times; NULL: it does not
 * choose the technique.
 *
 * ROW(id, name on the wire, enum shadow_can, enum shadow_parameter, distance, words of a candidate,
 * one sentence) */
#define SHADOW_TECHNIQUES(ROW)                                                                     \
    ROW(AUTO, "auto",                                                                              \
        SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA | SHADOW_CAN_AREA_LIGHTS | SHADOW_CAN_REFERENCE |      \
            SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,                    \
        SHADOW_HAS_ALL, 0, NULL,                                                                   \
        "the faster by forecast: rays, or deep where a light has a transparent caster, else map")  \
    ROW(NONE, "none",                                                                              \
        SHADOW_CAN_BE_SMOOTH | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS, \
        0, 1, NULL, "no shadows: every light passes everything")                                   \
    ROW(MAP, "map",                                                                                \
        SHADOW_CAN_BE_SMOOTH | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS, \
        SHADOW_HAS_MAP, 3, NULL,                                                                   \
        "one depth per texel (Williams 1978); transparent casters cast none")                      \
    ROW(DEEP, "deep",                                                                              \
        SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE |    \
            SHADOW_CAN_GRIDS,                                                                      \
        SHADOW_HAS_MAP | SHADOW_HAS_LISTS, 0, "rasterised",                                        \
        "every transmittance event of a texel, sorted, in one contiguous list; exact")             \
    ROW(DEEP_LINKED, "deep-linked",                                                                \
        SHADOW_CAN_GLASS | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,     \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "linked lists sorted on insertion (Lindbeck 2015), for comparison")                        \
    ROW(RAYTRACED, "raytraced",                                                                    \
        SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA | SHADOW_CAN_AREA_LIGHTS | SHADOW_CAN_REFERENCE |      \
            SHADOW_CAN_MANY_SAMPLES | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE |            \
            SHADOW_CAN_GRIDS,                                                                      \
        SHADOW_HAS_AREA_SAMPLES, 1, "ray traced",                                                  \
        "rays on the CPU (Embree), no maps: the ground truth that the others are compared with")   \
    ROW(RAYTRACED_SHADOWS, "raytraced-shadows",                                                    \
        SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA | SHADOW_CAN_AREA_LIGHTS | SHADOW_CAN_ATMOSPHERE,      \
        SHADOW_HAS_AREA_SAMPLES, 1, "with traced shadows",                                         \
        "rasterised surfaces and layers; rays on the CPU for the shadow of each light, no maps")   \
    ROW(TRANSLUCENT, "translucent",                                                                \
        SHADOW_CAN_COLOR | SHADOW_CAN_FILTER | SHADOW_CAN_BE_SMOOTH | SHADOW_CAN_LINKED_LISTS |    \
            SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,                                              \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "the nearest transparent depth and one colour per texel (Filion and McNaughton 2008)")     \
    ROW(STOCHASTIC, "stochastic",                                                                  \
        SHADOW_CAN_FILTER | SHADOW_CAN_LAYERS | SHADOW_CAN_INSIDE | SHADOW_CAN_LINKED_LISTS |      \
            SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,                                              \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "four depths per texel that casters take by chance (Enderton et al. 2010); grey, noisy")   \
    ROW(COLORED_STOCHASTIC, "colored-stochastic",                                                  \
        SHADOW_CAN_COLOR | SHADOW_CAN_FILTER | SHADOW_CAN_LAYERS | SHADOW_CAN_INSIDE |             \
            SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,                    \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "a depth for each colour of a texel, by chance (McGuire and Enderton 2011); noisy")        \
    ROW(COMPOSITED, "composited",                                                                  \
        SHADOW_CAN_COLOR | SHADOW_CAN_FILTER | SHADOW_CAN_LAYERS | SHADOW_CAN_BE_SMOOTH |          \
            SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS,                    \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "a translucent map for each partition of the meshes (Modisett 2023)")                      \
    ROW(AREA, "area", SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA | SHADOW_CAN_AREA_LIGHTS,                \
        SHADOW_HAS_AREA_SAMPLES, 4, "by grids",                                                    \
        "triangles rasterised onto each light's samples at every point, on the GPU (Wang et al. "  \
        "2014)")                                                                                   \
    ROW(VOLUME, "volume", SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA, 0, 4, "by volumes",                 \
        "shadow volumes that add what surfaces take away (Kim, Kim and Turk); sharp, no maps")     \
    ROW(MOMENTS, "moments",                                                                        \
        SHADOW_CAN_COLOR | SHADOW_CAN_FILTER | SHADOW_CAN_LAYERS | SHADOW_CAN_INSIDE |             \
            SHADOW_CAN_BE_SMOOTH | SHADOW_CAN_LINKED_LISTS | SHADOW_CAN_ATMOSPHERE |               \
            SHADOW_CAN_GRIDS,                                                                      \
        SHADOW_HAS_MAP, 4, NULL,                                                                   \
        "four moments of absorbance per texel and colour; two surfaces exact, more approximate")   \
    ROW(SILHOUETTE, "silhouette", SHADOW_CAN_GLASS | SHADOW_CAN_MEDIA, 0, 4, "by silhouettes",     \
        "shadow volumes of silhouettes that count surfaces (Lexolights, Peciva); sharp, no maps")

enum shadow_technique {
#define SHADOW_TECHNIQUE_ID(id, name, can, parameters, distance, candidate, sentence) SHADOWS_##id,
    SHADOW_TECHNIQUES(SHADOW_TECHNIQUE_ID)
#undef SHADOW_TECHNIQUE_ID
        SHADOWS_COUNT,
    SHADOWS_RASTER_DEFAULT = SHADOWS_DEEP /* what `auto` is where nothing else gains: its distance
                                             is 0 */
};

struct shadow_technique_row {
    const char *name; /* on the wire */
    unsigned can, parameters;
    int distance;          /* from the default, in trade-offs */
    const char *candidate; /* "rasterised"; NULL: none of `auto` */
    const char *sentence;
};
extern const struct shadow_technique_row shadow_technique_rows[SHADOWS_COUNT];

/* "auto, none, map": a constant, for help texts. */
#define SHADOW_TECHNIQUE_NEXT(id, name, can, parameters, distance, candidate, sentence) ", " name
#define SHADOW_TECHNIQUE_NAMES (&(SHADOW_TECHNIQUES(SHADOW_TECHNIQUE_NEXT))[2])

const char *shadow_technique_name(int technique);              /* NULL: none has this number */
enum shadow_technique shadow_technique_find(const char *name); /* SHADOWS_COUNT: none */
bool shadow_technique_can(enum shadow_technique technique, unsigned can);        /* all of these */
bool shadow_technique_has(enum shadow_technique technique, unsigned parameters); /* likewise */

/* What finds the shadows, which decides what pictures cost. */
enum shadow_family {
    SHADOW_FAMILY_MAPS,   /* maps of each light; `auto`, too, where nothing is chosen yet */
    SHADOW_FAMILY_RAYS,   /* rays draw the whole picture */
    SHADOW_FAMILY_POINTS, /* the points of a rasterised picture are asked for */
    SHADOW_FAMILY_NONE,   /* no shadows */
    SHADOW_FAMILIES
};
enum shadow_family shadow_technique_family(enum shadow_technique technique);
/* Whether it makes the whole picture, and not the shadows of one that is rasterised. */
bool shadow_technique_is_renderer(enum shadow_technique technique);
bool shadow_technique_is_candidate(enum shadow_technique technique); /* `auto` may choose it */

/* Texels that a lookup averages: what was said, or the default where nothing was: 0. */
int shadow_technique_taps(enum shadow_technique technique, int said);

/* The names of those that can and have all of this: "auto, map or deep". */
enum { SHADOW_TECHNIQUES_TEXT_BYTES = 160 };
void shadow_techniques_text(unsigned can, unsigned parameters,
                            char text[SHADOW_TECHNIQUES_TEXT_BYTES]);
/* Likewise of those under which pictures are rasterised, whatever is chosen. */
void shadow_techniques_rasterised_text(char text[SHADOW_TECHNIQUES_TEXT_BYTES]);

/* The names on the wire of the set bits, from the lowest on; NULL behind the last. */
const char *shadow_can_name(int bit);
const char *shadow_parameter_name(int bit);

#endif
