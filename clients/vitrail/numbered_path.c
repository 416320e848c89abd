/* SPDX-License-Identifier: MIT */
/* Patterns of the command line, with its failures. */
#include "clients/vitrail/numbered_path.h"

#include <stdlib.h>

#include "protocol/numbered_name.h"

bool numbered_path_check(const char *pattern, struct failure *failure)
{
    return numbered_name_is_pattern(pattern) ||
           fail(failure, EXIT_CODE_USAGE, "'%s' must hold one %%d, such as view_%%02d.png",
                pattern);
}

char *numbered_path_make(const char *pattern, int number)
{
    int length = numbered_name_print(NULL, 0, pattern, number);
    char *path = length < 0 ? NULL : malloc((size_t)length + 1);
    if (path)
        numbered_name_print(path, (size_t)length + 1, pattern, number);
    return path;
}
