/* SPDX-License-Identifier: MIT */
/* The formats of scene files: their names, and the units and axes that they may be in. Thread: any.
 */
#ifndef VITRAIL_PROTOCOL_SCENE_FORMAT_H
#define VITRAIL_PROTOCOL_SCENE_FORMAT_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum scene_format {
    SCENE_FORMAT_GLTF, /* read by the importer itself; the others are converted to it */
    SCENE_FORMAT_OBJ,
    SCENE_FORMAT_PLY,
    SCENE_FORMAT_STL,
    SCENE_FORMAT_FBX,
    SCENE_FORMAT_COLLADA,
    SCENE_FORMAT_3MF,
    SCENE_FORMAT_3DS,
    SCENE_FORMAT_INVENTOR,
    SCENE_FORMAT_STEP,
    SCENE_FORMAT_IGES,
    SCENE_FORMAT_OPENVDB,
    SCENE_FORMAT_COUNT
};

struct scene_format_info {
    const char *name;        /* of ?format= and of a summary */
    const char *title;       /* for people */
    const char *suffixes;    /* of file names, with their dots and a blank between two */
    const char *media_types; /* with a blank between two; NULL: it has none */
    const char *converter;   /* the library that reads it; NULL: the importer itself */
    bool is_built;           /* whether this build has that */
};
const struct scene_format_info *scene_format_describe(enum scene_format format);

/* By the suffix of a file name, in any case; by its name. False: of none. */
bool scene_format_of_file(const char *file_name, enum scene_format *format);
bool scene_format_from_name(const char *name, enum scene_format *format);

/* mm, cm, m, in and ft: metres of one; 0: there is no such unit. */
double scene_unit_from_name(const char *name);
/* The name of a unit of so many metres; "other" where it has none. */
const char *scene_unit_name(double unit_m);

/* Who said in which unit or with which axis up a file is to be read. */
enum scene_word { SCENE_WORD_DEFAULT, SCENE_WORD_FILE, SCENE_WORD_REQUEST, SCENE_WORD_COUNT };
const char *scene_word_name(enum scene_word word); /* default, file, request */

/* How a file was read. */
struct scene_origin {
    enum scene_format format;
    double unit_m; /* metres of one unit of the file, above 0 */
    char up;       /* the axis of the file that points up: 'x', 'y' or 'z' */
    enum scene_word unit_by, up_by;
    double deflection; /* that was asked for, in units of the file; 0: none was */
};

/* Whether its surfaces are no triangles, and become some within a deflection. */
bool scene_format_takes_deflection(enum scene_format format);
#define SCENE_DEFLECTION_LEAST 1e-9 /* units of the file */
#define SCENE_DEFLECTION_MOST 1e9

#ifdef __cplusplus
}
#endif
#endif
