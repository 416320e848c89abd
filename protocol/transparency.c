/* SPDX-License-Identifier: MIT */
/* The rows as a table. */
#include "protocol/transparency.h"

#include <stddef.h>
#include <string.h>

const struct transparency_row transparency_rows[TRANSPARENCIES_COUNT] = {
#define ROW(id, wire_name, abilities, says) \
    [TRANSPARENCY_##id] = {.name = (wire_name), .can = (abilities), .sentence = (says)},
    TRANSPARENCIES(ROW)
#undef ROW
};

const char *transparency_name(int transparency)
{
    bool is_there = transparency >= 0 && transparency < TRANSPARENCIES_COUNT;
    return is_there ? transparency_rows[transparency].name : NULL;
}

enum transparency transparency_find(const char *name)
{
    int found = TRANSPARENCIES_COUNT - 1;
    while (found > TRANSPARENCY_AUTO && strcmp(transparency_rows[found].name, name) != 0)
        found--;
    return (enum transparency)found;
}

const char *transparency_can_name(int bit)
{
    static const char *const names[] = {"media", "traced_shadows", "outputs",     "refraction",
                                        "haze",  "deep_images",    "ground_plane"};
    return bit >= 0 && bit < (int)(sizeof names / sizeof *names) ? names[bit] : NULL;
}
