/* SPDX-License-Identifier: MIT */
/* The methods of drawing transparent surfaces, a row of plain data each. The enum, the names on the
 * wire, /v1/capabilities and the help of the command line come from here. Pure functions.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_TRANSPARENCY_H
#define VITRAIL_PROTOCOL_TRANSPARENCY_H

#include <stdbool.h>

/* Sets of bits: what the surfaces that a method finds are good for. */
enum transparency_can {
    TRANSPARENCY_CAN_MEDIA = 1 << 0,          /* closed volumes attenuate the light between them */
    TRANSPARENCY_CAN_TRACED_SHADOWS = 1 << 1, /* rays find the shadows on each of them */
    TRANSPARENCY_CAN_OUTPUTS = 1 << 2,        /* auxiliary outputs show them */
    TRANSPARENCY_CAN_REFRACTION = 1 << 3,     /* surfaces bend and scatter what is behind them */
    TRANSPARENCY_CAN_HAZE = 1 << 4,           /* haze shines between them */
    TRANSPARENCY_CAN_DEEP = 1 << 5,           /* a deep image, over itself, is the picture */
    TRANSPARENCY_CAN_GROUND = 1 << 6, /* what the ground plane lets through, by all lights */
    TRANSPARENCY_CAN_ALL = (1 << 7) - 1,
};

/* ROW(id, name on the wire, enum transparency_can, one sentence) */
#define TRANSPARENCIES(ROW)                                                                    \
    ROW(AUTO, "auto", TRANSPARENCY_CAN_ALL, "the most exact available: lists")                 \
    ROW(LISTS, "lists", TRANSPARENCY_CAN_ALL,                                                  \
        "every transparent layer of a pixel, sorted; exact for any number of layers")          \
    ROW(WEIGHTED_BLENDED, "weighted-blended",                                                  \
        TRANSPARENCY_CAN_TRACED_SHADOWS | TRANSPARENCY_CAN_OUTPUTS | TRANSPARENCY_CAN_GROUND,  \
        "layers averaged by weights of their distance instead of their order; for comparison") \
    ROW(DEPTH_PEELING, "depth-peeling", 0,                                                     \
        "layers found and lit one at a time, front to back; as lists, in bounded memory")      \
    ROW(DUAL_DEPTH_PEELING, "dual-depth-peeling", 0,                                           \
        "layers found and lit two at a time, from both sides; as lists, in bounded memory")    \
    ROW(STOCHASTIC, "stochastic",                                                              \
        TRANSPARENCY_CAN_TRACED_SHADOWS | TRANSPARENCY_CAN_OUTPUTS | TRANSPARENCY_CAN_GROUND,  \
        "layers that cover parts of a sample by chance instead of an order; for comparison")   \
    ROW(MOMENT_BASED, "moment-based",                                                          \
        TRANSPARENCY_CAN_TRACED_SHADOWS | TRANSPARENCY_CAN_OUTPUTS | TRANSPARENCY_CAN_GROUND,  \
        "layers seen through what six moments of absorbance say is before; for comparison")    \
    ROW(SORTED, "sorted", TRANSPARENCY_CAN_TRACED_SHADOWS | TRANSPARENCY_CAN_GROUND,           \
        "objects blended as wholes, back to front; wrong where they interlock; for comparison")

enum transparency {
#define TRANSPARENCY_ID(id, name, can, sentence) TRANSPARENCY_##id,
    TRANSPARENCIES(TRANSPARENCY_ID)
#undef TRANSPARENCY_ID
        TRANSPARENCIES_COUNT
};

struct transparency_row {
    const char *name; /* on the wire */
    unsigned can;
    const char *sentence;
};
extern const struct transparency_row transparency_rows[TRANSPARENCIES_COUNT];

/* "auto, lists": a constant, for help texts. */
#define TRANSPARENCY_NEXT(id, name, can, sentence) ", " name
#define TRANSPARENCY_NAMES (&(TRANSPARENCIES(TRANSPARENCY_NEXT))[2])

const char *transparency_name(int transparency); /* NULL: none has this number */
/* AUTO for a name that none has. */
enum transparency transparency_find(const char *name);
/* The name on the wire of a bit; NULL behind the last. */
const char *transparency_can_name(int bit);

#endif
