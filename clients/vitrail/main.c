/* SPDX-License-Identifier: MIT */
/* vitrail: the command-line client. Finds the command, runs it, and turns its outcome into an exit
 * code. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "protocol/nearest.h"

static const struct command *const COMMANDS[] = {
    &COMMAND_RENDER,       &COMMAND_VIEW,         &COMMAND_ORBIT,      &COMMAND_JOB,
    &COMMAND_FARM,         &COMMAND_EXPLAIN,      &COMMAND_TRADEOFF,   &COMMAND_PUSH,
    &COMMAND_SCENES,       &COMMAND_ENVIRONMENTS, &COMMAND_DELETE,     &COMMAND_STATS,
    &COMMAND_CAPABILITIES, &COMMAND_HEALTH,       &COMMAND_DEMO_SCENE, &COMMAND_COMPARE,
    &COMMAND_VERIFY,
};

enum { COMMAND_COUNT = sizeof COMMANDS / sizeof *COMMANDS };

static void print_help(void)
{
    printf("vitrail COMMAND [OPTIONS] ...\n\n"
           "Renders light through transparent things on a vitrail server.\n\nCommands:\n");
    for (int i = 0; i < COMMAND_COUNT; i++)
        printf("  %-14s%s\n", COMMANDS[i]->name, COMMANDS[i]->summary);
    printf("\n'vitrail COMMAND --help' tells more.\n\n"
           "Exit codes: 0 done; 1 scene or render refused; 2 wrong command line; 3 images too\n"
           "different; 66 input cannot be read; 69 no server; 71 out of a resource of this\n"
           "machine; 73 output cannot be written; 75 failed for now, try again; 128+N ended by\n"
           "signal N.\n");
}

static const struct command *find_command(const char *name)
{
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (!strcmp(COMMANDS[i]->name, name))
            return COMMANDS[i];
    return NULL;
}

static bool fail_unknown(const char *name, struct failure *failure)
{
    struct nearest nearest = {.text = name};

    for (int i = 0; i < COMMAND_COUNT; i++)
        nearest_offer(&nearest, COMMANDS[i]->name);
    if (nearest.name)
        return fail(failure, EXIT_CODE_USAGE,
                    "no such command: '%s'; did you mean '%s'? See 'vitrail --help'", name,
                    nearest.name);
    return fail(failure, EXIT_CODE_USAGE, "no such command: '%s'; see 'vitrail --help'", name);
}

static bool run_command(const struct command *command, int argc, char **argv, void *options,
                        struct failure *failure)
{
    const struct common_options *common = options;
    struct text_list operands = {0};
    bool is_ok = options_parse(command, argc, argv, options, &operands, failure);

    if (is_ok && common->help)
        options_print_help(command);
    else if (is_ok)
        is_ok = command->run(options, &operands, failure);
    text_list_finish(&operands);
    options_finish(command, options);
    return is_ok;
}

int main(int argc, char **argv)
{
    struct failure failure = {0};
    const struct command *command = argc > 1 ? find_command(argv[1]) : NULL;
    struct common_options *options = NULL;

    if (argc > 1 &&
        (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help"))) {
        command = argc > 2 ? find_command(argv[2]) : NULL;
        if (command)
            options_print_help(command);
        else
            print_help();
    } else if (argc > 1 && !strcmp(argv[1], "--version")) {
        puts("vitrail " VITRAIL_VERSION);
    } else if (argc < 2) {
        fail(&failure, EXIT_CODE_USAGE, "no command; see 'vitrail --help'");
    } else if (!command) {
        fail_unknown(argv[1], &failure);
    } else {
        options = calloc(1, command->options_bytes);
        if (!options)
            fail_no_memory(&failure);
        else
            run_command(command, argc - 1, argv + 1, options, &failure);
    }
    if (fflush(stdout) != 0 || ferror(stdout))
        fail(&failure, EXIT_CODE_CANT_CREATE, "cannot write to stdout");
    if (failure.exit_code)
        failure_print(&failure, options && options->json);
    free(options);
    return failure.exit_code;
}
