/* SPDX-License-Identifier: MIT */
/* vitrail compare: hands over to vitrail-compare, so that every other command starts without an
 * image library and the hundreds of libraries behind it. */
#include "clients/vitrail/compare.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/program_path.h"

static bool compare_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct compare_options *options = context;
    char *path = program_path_find("vitrail-compare");

    (void)operands;
    if (!path)
        return fail(failure, EXIT_CODE_OS_ERROR,
                    "no vitrail-compare beside this program, and none in PATH");
    execv(path, options->common.arguments);
    fail(failure, EXIT_CODE_OS_ERROR, "cannot start '%s': %s", path, strerror(errno));
    free(path);
    return false;
}

const struct command COMMAND_COMPARE = {COMPARE_COMMAND, .run = compare_run};
