/* SPDX-License-Identifier: MIT */
/* The one table of formats, and that of units. */
#include "protocol/scene_format.h"

#include <math.h>
#include <string.h>
#include <strings.h>

static const struct scene_format_info formats[SCENE_FORMAT_COUNT] = {
    [SCENE_FORMAT_GLTF] = {"gltf", "glTF", ".gltf .glb", "model/gltf-binary model/gltf+json", NULL,
                           true},
    [SCENE_FORMAT_OBJ] = {"obj", "Wavefront OBJ", ".obj", "model/obj", "assimp",
                          VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_PLY] = {"ply", "PLY", ".ply", NULL, "assimp", VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_FBX] = {"fbx", "FBX", ".fbx", NULL, "assimp", VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_COLLADA] = {"collada", "COLLADA", ".dae", "model/vnd.collada+xml", "assimp",
                              VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_INVENTOR] = {"iv", "Open Inventor", ".iv", NULL, "assimp", VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_STEP] = {"step", "STEP", ".step .stp", "model/step", "opencascade",
                           VITRAIL_WITH_OPENCASCADE},
    [SCENE_FORMAT_IGES] = {"iges", "IGES", ".iges .igs", "model/iges", "opencascade",
                           VITRAIL_WITH_OPENCASCADE},
    [SCENE_FORMAT_OPENVDB] = {"vdb", "OpenVDB", ".vdb", NULL, "openvdb", VITRAIL_WITH_OPENVDB},
    [SCENE_FORMAT_3MF] = {"3mf", "3MF", ".3mf", "model/3mf", "assimp", VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_3DS] = {"3ds", "3DS", ".3ds", NULL, "assimp", VITRAIL_WITH_ASSIMP},
    [SCENE_FORMAT_STL] = {"stl", "STL", ".stl", "model/stl", "assimp", VITRAIL_WITH_ASSIMP},
};

static const struct {
    const char *name;
    double unit_m;
} units[] = {{"mm", 0.001}, {"cm", 0.01}, {"m", 1}, {"in", 0.0254}, {"ft", 0.3048}};
enum { UNITS = sizeof units / sizeof *units };

const struct scene_format_info *scene_format_describe(enum scene_format format)
{
    return &formats[format];
}

/* One of the words, with a blank between two. */
static bool is_among(const char *words, const char *word)
{
    size_t length = strlen(word);
    while (*words) {
        size_t next = strcspn(words, " ");
        if (next == length && strncasecmp(words, word, length) == 0)
            return true;
        words += next + strspn(words + next, " ");
    }
    return false;
}

bool scene_format_of_file(const char *file_name, enum scene_format *format)
{
    const char *suffix = strrchr(file_name, '.');
    for (int i = 0; suffix && i < SCENE_FORMAT_COUNT; i++)
        if (is_among(formats[i].suffixes, suffix)) {
            *format = (enum scene_format)i;
            return true;
        }
    return false;
}

bool scene_format_from_name(const char *name, enum scene_format *format)
{
    for (int i = 0; i < SCENE_FORMAT_COUNT; i++)
        if (strcmp(formats[i].name, name) == 0) {
            *format = (enum scene_format)i;
            return true;
        }
    return false;
}

bool scene_format_takes_deflection(enum scene_format format)
{
    return format == SCENE_FORMAT_STEP || format == SCENE_FORMAT_IGES;
}

double scene_unit_from_name(const char *name)
{
    for (int i = 0; i < UNITS; i++)
        if (strcmp(units[i].name, name) == 0)
            return units[i].unit_m;
    return 0;
}

const char *scene_unit_name(double unit_m)
{
    for (int i = 0; i < UNITS; i++)
        if (fabs(unit_m - units[i].unit_m) <= 1e-6 * units[i].unit_m) /* files keep floats */
            return units[i].name;
    return "other";
}

const char *scene_word_name(enum scene_word word)
{
    static const char *const names[SCENE_WORD_COUNT] = {"default", "file", "request"};
    return names[word];
}
