/* SPDX-License-Identifier: MIT */
/* Programs that passes need, listed before anything is compiled. No GL. Thread: any. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_LIST_H
#define VITRAIL_RENDERER_GL_PROGRAM_LIST_H

#include <stddef.h>

#include "renderer/gl/program.h"

enum { PROGRAM_DEFINES_BYTES = 512 };

struct listed_program {
    const char *pass; /* of the plan; as all texts but the defines, never freed */
    const char *label, *vertex, *tessellation[2], *geometry, *fragment, *compute;
    char defines[PROGRAM_DEFINES_BYTES];
    bool is_conditional; /* whether it is needed depends on what the frame counts */
    enum program_place place;
};

struct program_list {             /* zeroed = empty */
    struct listed_program *items; /* owned; in the order of passes */
    size_t count, capacity;
    char device_defines[DEVICE_DEFINES_BYTES]; /* of the cache that they are for */
    bool has_failed;                           /* memory ran out: some are missing */
};

/* A pass has each program once, for certain where it was added so once. Strings of desc but its
 * defines must outlive the list. */
void program_list_add(struct program_list *list, const char *pass, const struct program_desc *desc,
                      bool is_conditional);
/* Whether they are one program, for whatever pass. */
bool program_list_is_same(const struct listed_program *a, const struct listed_program *b);
/* A listed program's description; its defines are borrowed. */
struct program_desc program_list_desc(const struct listed_program *program);
/* ERROR_NO_MEMORY where some are missing. */
MUST_CHECK bool program_list_check(const struct program_list *list, struct error *err);
void program_list_finish(struct program_list *list);

#endif
