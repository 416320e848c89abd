/* SPDX-License-Identifier: MIT */
/* vitrail push: brings scenes to the server and prints their ids. */
#include <jansson.h>
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_source.h"

struct push_options {
    struct common_options common;
    bool force;
};

static void print_push(const struct push_options *options, const char *path,
                       const struct scene_push *push)
{
    if (!options->common.json) {
        puts(push->id);
    } else {
        json_t *line =
            json_pack("{s:s, s:s, s:b}", "file", path, "id", push->id, "sent", push->was_sent);
        json_print(line, true);
        json_decref(line);
    }
    fflush(stdout);
}

static bool push_run(void *context, const struct text_list *files, struct failure *failure)
{
    const struct push_options *options = context;
    struct session session = {0};
    bool is_ok = true;

    for (size_t i = 0; i < files->count && is_ok; i++)
        is_ok = scene_source_check(files->items[i], failure);
    is_ok = is_ok && session_begin(&session, &options->common, failure);
    for (size_t i = 0; i < files->count && is_ok; i++) {
        struct scene_push push;
        is_ok = scene_source_push(&session, files->items[i], options->force, &push, failure);
        progress_hide(&session.progress);
        if (is_ok)
            print_push(options, files->items[i], &push);
    }
    session_end(&session);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_FLAG, "force", 0, NULL, "send even what the server has already",
     offsetof(struct push_options, force)},
    {0},
};

const struct command COMMAND_PUSH = {
    .name = "push",
    .synopsis = "FILE...",
    .summary = "Send scenes (.glb, or .gltf with its files) and print their ids",
    .details = "Prints one id per line, in the order of the files. A .glb that the server has\n"
               "already is not sent again.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = -1,
    .options_bytes = sizeof(struct push_options),
    .run = push_run,
};
