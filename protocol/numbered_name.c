/* SPDX-License-Identifier: MIT */
/* The pattern never reaches printf as a format. */
#include "protocol/numbered_name.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool numbered_name_is_pattern(const char *pattern)
{
    const char *percent = strchr(pattern, '%');
    const char *end = percent ? percent + 1 + strspn(percent + 1, "0123456789") : NULL;
    return percent && end - percent <= 3 && *end == 'd' && !strchr(end, '%');
}

int numbered_name_width(const char *pattern)
{
    return atoi(strchr(pattern, '%') + 1);
}

int numbered_name_print(char *name, size_t size_bytes, const char *pattern, int number)
{
    const char *percent = strchr(pattern, '%');
    return snprintf(name, size_bytes, "%.*s%0*d%s", (int)(percent - pattern), pattern,
                    numbered_name_width(pattern), number, strchr(percent, 'd') + 1);
}
