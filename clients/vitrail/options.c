/* SPDX-License-Identifier: MIT */
/* Parses a command line by a table of options, and prints the table as help. */
#include "clients/vitrail/options.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/nearest.h"

static const struct option COMMON_OPTIONS[] = {
    {OPTION_TEXT, "server", 0, "URL",
     "the server to use; else $VITRAIL_SERVER, else http://127.0.0.1:8090",
     offsetof(struct common_options, server)},
    {OPTION_FLAG, "spawn", 0, NULL, "start a private vitraild for this call, and end it after",
     offsetof(struct common_options, spawn)},
    {OPTION_TEXT, "state-dir", 0, "DIR",
     "with --spawn: keep scenes there between calls\n(default: a temporary folder)",
     offsetof(struct common_options, state_dir)},
    {OPTION_NUMBER, "timeout", 0, "S", "give up after S seconds with exit code 75; 0 means never",
     offsetof(struct common_options, timeout_s)},
    {OPTION_FLAG, "json", 0, NULL, "results on stdout and errors on stderr as JSON",
     offsetof(struct common_options, json)},
    {OPTION_FLAG, "quiet", 'q', NULL, "no progress and no summary",
     offsetof(struct common_options, quiet)},
    {OPTION_TEXT, "progress", 0, "KIND",
     "on stderr: auto (a bar on a terminal), none, plain, json, afanasy",
     offsetof(struct common_options, progress)},
    {0},
};

static const struct option HELP_OPTION[] = {
    {OPTION_FLAG, "help", 'h', NULL, "this text", offsetof(struct common_options, help)},
    {0},
};

enum { TABLE_COUNT = 3 };

static void tables_of(const struct command *command, const struct option *tables[TABLE_COUNT])
{
    tables[0] = command->options;
    tables[1] = command->is_remote ? COMMON_OPTIONS : NULL;
    tables[2] = HELP_OPTION;
}

/* By name of `length` bytes, or by letter when name is NULL. */
static const struct option *find(const struct command *command, const char *name, size_t length,
                                 char letter)
{
    const struct option *tables[TABLE_COUNT];

    tables_of(command, tables);
    for (int t = 0; t < TABLE_COUNT; t++)
        for (const struct option *o = tables[t]; o && o->kind != OPTION_END; o++) {
            if (name && strlen(o->name) == length && !strncmp(o->name, name, length))
                return o;
            if (!name && o->letter == letter)
                return o;
        }
    return NULL;
}

bool number_parse(const char *text, double *value)
{
    char *end;

    /* strtod also takes "nan", "inf", hexadecimal and leading blanks: none of them is meant here.
     */
    if (!*text || strspn(text, "+-.0123456789eE") != strlen(text))
        return false;
    *value = strtod(text, &end);
    return end != text && !*end && isfinite(*value);
}

bool text_list_add(struct text_list *list, const char *text, struct failure *failure)
{
    const char **items = reallocarray(list->items, list->count + 1, sizeof *items);

    if (!items)
        return fail_no_memory(failure);
    list->items = items;
    items[list->count++] = text;
    return true;
}

void text_list_finish(struct text_list *list)
{
    free(list->items);
    *list = (struct text_list){0};
}

static bool apply(const struct option *option, const char *text, void *options,
                  struct failure *failure)
{
    void *member = (char *)options + option->offset;

    if (option->kind == OPTION_FLAG) {
        *(bool *)member = true;
    } else if (option->kind == OPTION_TEXT) {
        *(const char **)member = text;
    } else if (option->kind == OPTION_LIST) {
        return text_list_add(member, text, failure);
    } else {
        struct option_number *number = member;
        if (!number_parse(text, &number->value))
            return fail(failure, EXIT_CODE_USAGE, "--%s: '%s' is not a number", option->name, text);
        number->is_given = true;
    }
    return true;
}

static bool fail_unknown(const struct command *command, const char *name, size_t length,
                         struct failure *failure)
{
    const struct option *tables[TABLE_COUNT];
    char given[64]; /* of a longer one nothing is near */
    struct nearest nearest = {.text = given};

    snprintf(given, sizeof given, "%.*s", (int)length, name);
    tables_of(command, tables);
    for (int t = 0; t < TABLE_COUNT; t++)
        for (const struct option *o = tables[t]; o && o->kind != OPTION_END; o++)
            nearest_offer(&nearest, o->name);
    if (nearest.name)
        return fail(failure, EXIT_CODE_USAGE,
                    "no such option: --%.*s; did you mean --%s? See 'vitrail %s --help'",
                    (int)length, name, nearest.name, command->name);
    return fail(failure, EXIT_CODE_USAGE, "no such option: --%.*s; see 'vitrail %s --help'",
                (int)length, name, command->name);
}

/* "--name", "--name=value" or "--name value"; advances *index past a value that was taken. */
static bool parse_long(const struct command *command, char **argv, int *index, void *options,
                       struct failure *failure)
{
    const char *name = argv[*index] + 2;
    size_t length = strcspn(name, "=");
    const struct option *option = find(command, name, length, 0);
    const char *value = NULL;

    if (!option)
        return fail_unknown(command, name, length, failure);
    if (name[length])
        value = name + length + 1;
    if (option->kind == OPTION_FLAG && value)
        return fail(failure, EXIT_CODE_USAGE, "--%s takes no value", option->name);
    if (option->kind != OPTION_FLAG && !value)
        value = argv[++*index];
    if (option->kind != OPTION_FLAG && !value)
        return fail(failure, EXIT_CODE_USAGE, "--%s needs a value: %s", option->name,
                    option->argument);
    return apply(option, value, options, failure);
}

/* "-q", "-o value" or "-ovalue"; flags do not combine. */
static bool parse_short(const struct command *command, char **argv, int *index, void *options,
                        struct failure *failure)
{
    const char *text = argv[*index];
    const struct option *option = find(command, NULL, 0, text[1]);
    const char *value = text[2] ? text + 2 : NULL;

    if (!option || (option->kind == OPTION_FLAG && value))
        return fail(failure, EXIT_CODE_USAGE, "no such option: %s; see 'vitrail %s --help'", text,
                    command->name);
    if (option->kind != OPTION_FLAG && !value)
        value = argv[++*index];
    if (option->kind != OPTION_FLAG && !value)
        return fail(failure, EXIT_CODE_USAGE, "-%c needs a value: %s", option->letter,
                    option->argument);
    return apply(option, value, options, failure);
}

static bool check_common(struct common_options *common, struct failure *failure)
{
    static const char *const NAMES[] = {"auto", "none", "plain", "json", "afanasy"};
    const char *wanted = common->progress ? common->progress : "auto";

    if (common->spawn && common->server)
        return fail(failure, EXIT_CODE_USAGE, "--spawn and --server exclude each other");
    if (common->state_dir && !common->spawn)
        return fail(failure, EXIT_CODE_USAGE, "--state-dir needs --spawn");
    if (common->timeout_s.value < 0)
        return fail(failure, EXIT_CODE_USAGE, "--timeout: seconds, from 0");
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++)
        if (!strcmp(wanted, NAMES[i])) {
            common->progress_kind = (enum progress_kind)i;
            if (common->quiet && common->progress_kind == PROGRESS_AUTO)
                common->progress_kind = PROGRESS_NONE;
            return true;
        }
    return fail(failure, EXIT_CODE_USAGE,
                "--progress: '%s' is none of auto, none, plain, json, afanasy", wanted);
}

static bool check_operands(const struct command *command, const struct text_list *operands,
                           struct failure *failure)
{
    int count = operands->count < 1u << 30 ? (int)operands->count : 1 << 30;

    if (count < command->operands_min)
        return fail(failure, EXIT_CODE_USAGE, "usage: vitrail %s %s", command->name,
                    command->synopsis);
    if (command->operands_max >= 0 && count > command->operands_max)
        return fail(failure, EXIT_CODE_USAGE, "'%s' is one too many; usage: vitrail %s %s",
                    operands->items[command->operands_max], command->name, command->synopsis);
    return true;
}

bool options_parse(const struct command *command, int argc, char **argv, void *options,
                   struct text_list *operands, struct failure *failure)
{
    struct common_options *common = options;
    bool options_ended = false;

    common->arguments = argv;
    for (int i = 1; i < argc; i++) {
        const char *text = argv[i];
        bool is_ok;
        if (options_ended || text[0] != '-' || !text[1]) {
            is_ok = text_list_add(operands, text, failure);
        } else if (!strcmp(text, "--")) {
            options_ended = true;
            is_ok = true;
        } else if (text[1] == '-') {
            is_ok = parse_long(command, argv, &i, options, failure);
        } else {
            is_ok = parse_short(command, argv, &i, options, failure);
        }
        if (!is_ok)
            return false;
        if (common->help)
            return true;
    }
    return check_common(common, failure) && check_operands(command, operands, failure);
}

void options_finish(const struct command *command, void *options)
{
    for (const struct option *o = command->options; o && o->kind != OPTION_END; o++)
        if (o->kind == OPTION_LIST)
            text_list_finish((struct text_list *)(void *)((char *)options + o->offset));
}

/* As much of the text as one line takes: up to its end, or to the last blank that fits. */
static size_t line_length(const char *text)
{
    enum { MOST = 72 };
    size_t length = strcspn(text, "\n");
    if (length <= MOST)
        return length;
    for (length = MOST; length && text[length] != ' '; length--)
        continue;
    return length ? length : strcspn(text, "\n");
}

static void print_option(const struct option *option)
{
    char left[64];
    const char *line = option->help;
    int used = 0;

    if (option->letter)
        used = snprintf(left, sizeof left, "-%c, ", option->letter);
    snprintf(left + used, sizeof left - (size_t)used, "--%s%s%s", option->name,
             option->argument ? " " : "", option->argument ? option->argument : "");
    printf("  %-26s", left);
    if (strlen(left) >= 26)
        printf("\n%28s", "");
    for (;;) {
        size_t length = line_length(line);
        printf("%.*s\n", (int)length, line);
        if (!line[length])
            return;
        line += length + 1;
        printf("%28s", "");
    }
}

void options_print_help(const struct command *command)
{
    const struct option *tables[TABLE_COUNT];

    printf("vitrail %s %s\n\n%s.\n\nOptions:\n", command->name, command->synopsis,
           command->summary);
    tables_of(command, tables);
    for (int t = 0; t < TABLE_COUNT; t++)
        for (const struct option *o = tables[t]; o && o->kind != OPTION_END; o++)
            print_option(o);
    if (command->details)
        printf("\n%s\n", command->details);
}
