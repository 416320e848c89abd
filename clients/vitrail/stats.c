/* SPDX-License-Identifier: MIT */
/* vitrail stats: totals of the server, or what one frame cost and why. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/session.h"

struct stats_options {
    struct common_options common;
};

static bool stats_run(void *context, const struct text_list *frames, struct failure *failure)
{
    const struct stats_options *options = context;
    const char *frame = frames->count ? frames->items[0] : NULL;
    struct session session = {0};
    json_t *answer = NULL;
    char path[160] = "/v1/stats";

    if (frame &&
        (!*frame || strlen(frame) > 64 ||
         strspn(frame, "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-_") !=
             strlen(frame)))
        return fail(failure, EXIT_CODE_USAGE, "'%s' is not a frame id", frame);
    if (frame)
        snprintf(path, sizeof path, "/v1/frames/%s", frame);
    if (session_begin(&session, &options->common, failure))
        answer = session_get_json(&session, path, frame ? "the frame" : "the totals", failure);
    progress_hide(&session.progress);
    if (answer)
        json_print(answer, options->common.json);
    session_end(&session);
    json_decref(answer);
    return answer != NULL;
}

const struct command COMMAND_STATS = {
    .name = "stats",
    .synopsis = "[FRAME-ID]",
    .summary = "Print totals of the server, or the cost of one frame",
    .details = "A render prints its frame id with --json; the server keeps the last frames only.",
    .is_remote = true,
    .operands_max = 1,
    .options_bytes = sizeof(struct stats_options),
    .run = stats_run,
};
