/* SPDX-License-Identifier: MIT */
/* Distances between names: rows of the matrix of edits, three at a time. */
#include "protocol/nearest.h"

#include <string.h>

enum { NAME_BYTES_MAX = 64 };

static int lower(char c)
{
    return c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c;
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Insertions, deletions, substitutions and swaps of neighbours that turn a into b. */
static size_t distance_between(const char *a, size_t a_bytes, const char *b, size_t b_bytes)
{
    size_t rows[3][NAME_BYTES_MAX + 1];
    size_t *before = rows[0], *last = rows[1], *row = rows[2];
    for (size_t j = 0; j <= b_bytes; j++)
        last[j] = before[j] = j;
    for (size_t i = 1; i <= a_bytes; i++) {
        row[0] = i;
        for (size_t j = 1; j <= b_bytes; j++) {
            size_t substituted = last[j - 1] + (lower(a[i - 1]) != lower(b[j - 1]));
            row[j] = least(substituted, least(last[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                lower(a[i - 2]) == lower(b[j - 1]))
                row[j] = least(row[j], before[j - 2] + 1);
        }
        size_t *free_row = before;
        before = last;
        last = row;
        row = free_row;
    }
    return last[b_bytes];
}

void nearest_offer(struct nearest *nearest, const char *name)
{
    size_t text_bytes = strlen(nearest->text), name_bytes = strlen(name);
    if (text_bytes > NAME_BYTES_MAX || name_bytes > NAME_BYTES_MAX)
        return;
    size_t longer = text_bytes > name_bytes ? text_bytes : name_bytes;
    size_t allowed = longer / 3 ? longer / 3 : 1;
    size_t distance = distance_between(nearest->text, text_bytes, name, name_bytes);
    if (distance > allowed || distance >= longer ||
        (nearest->name && distance >= nearest->distance))
        return;
    nearest->name = name;
    nearest->distance = distance;
}
