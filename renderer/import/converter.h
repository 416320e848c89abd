/* SPDX-License-Identifier: MIT */
/* Files of other formats become glTF in memory, which the importer then reads like any other: its
 * limits and checks hold for all. The libraries that read them live in modules of their own, which
 * a process loads when it first meets such a file. */
#ifndef VITRAIL_RENDERER_IMPORT_CONVERTER_H
#define VITRAIL_RENDERER_IMPORT_CONVERTER_H

#include <stdlib.h>

#include "renderer/import/import.h"

#ifdef __cplusplus
extern "C" {
#endif

struct converter_input {
    const struct scene_file *files; /* of the upload; borrowed */
    size_t file_count;
    const struct scene_file *root; /* which of them is the scene */
    enum scene_format format;
    double unit_m;     /* 0: the file's own word, else metres */
    char up;           /* 0: the file's own word, else 'y' */
    double deflection; /* 0: in proportion to the parts */
    const char *scene; /* which of the file is wanted, as in scene_import_desc; a module whose file
                          has several may write one alone, the others without nodes */
};

/* The place that "#1" means among so many scenes; their count: none. */
static inline size_t scene_place(const char *text, size_t count)
{
    char *end = NULL;
    if (text[0] != '#' || text[1] < '0' || text[1] > '9')
        return count;
    unsigned long long place = strtoull(text + 1, &end, 10);
    return *end == '\0' && place < count ? (size_t)place : count;
}

/* What a module hands back: each malloc'ed, also where it failed. */
struct converter_output {
    char *json; /* glTF 2.0; its one buffer has no URI, its images name files of the upload */
    size_t json_bytes;
    void *buffer;
    size_t buffer_bytes;
    char *warnings; /* lines, each ended by a line feed; NULL: none */
    struct scene_origin origin;
};

struct converter_functions {
    /* Reads something small, so that all that the library loads or sets up is there. */
    void (*warm_up)(void);
    /* ERROR_INVALID_SCENE or ERROR_NO_MEMORY. Opens no file, starts no thread. */
    bool (*convert)(const struct converter_input *input, struct converter_output *output,
                    struct error *err);
};
/* Exported by a module. */
const struct converter_functions *converter_get_functions(void);

/* An upload that was converted. Zeroed = empty. */
struct conversion {
    struct converter_output output;
    struct scene_file *files; /* owned: a GLB, then those of the upload */
    size_t file_count;
    void *glb; /* owned */
};
void conversion_finish(struct conversion *conversion);

/* Of a desc whose format is not glTF. Errors as those of scene_import. Thread: any. */
MUST_CHECK bool conversion_init(struct conversion *conversion, const struct scene_import_desc *desc,
                                struct error *err);

#ifdef __cplusplus
}
#endif
#endif
