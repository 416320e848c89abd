/* SPDX-License-Identifier: MIT */
/* The names, in the order of the enum. */
#include "protocol/upload_stage.h"

#include <stddef.h>
#include <string.h>

static const char *const names[UPLOAD_STAGE_COUNT] = {"conversion", "file",   "meshes",
                                                      "nodes",      "images", "outline"};

const char *upload_stage_name(int stage)
{
    return stage >= 0 && stage < UPLOAD_STAGE_COUNT ? names[stage] : NULL;
}

int upload_stage_find(const char *name)
{
    int stage = 0;
    while (stage < UPLOAD_STAGE_COUNT && strcmp(names[stage], name) != 0)
        stage++;
    return stage;
}
