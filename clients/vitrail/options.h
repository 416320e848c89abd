/* SPDX-License-Identifier: MIT */
/* Command-line options from one table per command, which is both the parser and the help text. */
#ifndef VITRAIL_CLIENTS_VITRAIL_OPTIONS_H
#define VITRAIL_CLIENTS_VITRAIL_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "clients/vitrail/failure.h"

/* Values of an option that may be given more than once, in order. Zeroed = none. */
struct text_list {
    const char **items; /* owned array of strings borrowed from argv */
    size_t count;
};
bool text_list_add(struct text_list *list, const char *text, struct failure *failure);
void text_list_finish(struct text_list *list);

/* What the member at `offset` of the command's options is. */
enum option_kind {
    OPTION_END,    /* ends a table */
    OPTION_FLAG,   /* bool, set to true */
    OPTION_TEXT,   /* const char *, borrowed from argv; the last one given wins */
    OPTION_NUMBER, /* struct option_number */
    OPTION_LIST,   /* struct text_list, appended to */
};

struct option_number {
    bool is_given;
    double value; /* finite */
};

struct option {
    enum option_kind kind;
    const char *name;     /* without the dashes */
    char letter;          /* short form, or 0 */
    const char *argument; /* placeholder for help; NULL for a flag */
    const char *help;     /* '\n' starts another line */
    size_t offset;
};

enum progress_kind {
    PROGRESS_AUTO,
    PROGRESS_NONE,
    PROGRESS_PLAIN,
    PROGRESS_JSON,
    PROGRESS_AFANASY,
};

/* First member of every command's options. */
struct common_options {
    const char *server;
    const char *state_dir;
    const char *progress; /* as given */
    char **arguments;     /* the whole command line, argv[0] the command; borrowed, NULL-ended */
    struct option_number timeout_s;
    bool spawn, json, quiet, help;
    enum progress_kind progress_kind; /* by options_parse */
};

struct command {
    const char *name;               /* "render" */
    const char *synopsis;           /* what follows the name in the usage line */
    const char *summary;            /* one line */
    const char *details;            /* text after the options; NULL means none */
    const struct option *options;   /* own options, ended by OPTION_END; NULL means none */
    bool is_remote;                 /* talks to a server: has the common options as well */
    int operands_min, operands_max; /* max -1: any number */
    size_t options_bytes;           /* of the struct that offsets point into */
    bool (*run)(void *options, const struct text_list *operands, struct failure *failure);
};

/* Fills the zeroed struct at `options` and the operands from argv[1..]. With --help only `help`
 * counts. Options and operands may be mixed; "--" ends the options. */
bool options_parse(const struct command *command, int argc, char **argv, void *options,
                   struct text_list *operands, struct failure *failure);
void options_finish(const struct command *command, void *options);

void options_print_help(const struct command *command);

/* Strict: the whole text is one finite decimal number. */
bool number_parse(const char *text, double *value);

#endif
