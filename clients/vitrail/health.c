/* SPDX-License-Identifier: MIT */
/* vitrail health: whether a server lives and can render, as an exit code. */
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/session.h"

#define PATIENCE_S 5. /* a probe that hangs is an answer, too */

struct health_options {
    struct common_options common;
};

static bool probe(struct session *session, const char *path, const char *task,
                  struct failure *failure)
{
    struct http_reply reply;

    if (!session_ask(session, &(struct http_request){.method = "GET", .path = path}, task, &reply,
                     failure))
        return false;
    http_reply_finish(&reply);
    return true;
}

static bool health_run(void *context, const struct text_list *operands, struct failure *failure)
{
    struct health_options *options = context;
    struct session session = {0};
    bool is_ok;

    (void)operands;
    if (!options->common.timeout_s.is_given && !options->common.spawn)
        options->common.timeout_s = (struct option_number){.is_given = true, .value = PATIENCE_S};
    is_ok = session_begin(&session, &options->common, failure) &&
            probe(&session, "/healthz", "the question whether it lives", failure) &&
            probe(&session, "/readyz", "the question whether it is ready", failure);
    progress_hide(&session.progress);
    if (is_ok && options->common.json)
        printf("{\"ready\":true,\"server\":\"%s\"}\n", http_client_url(session.client));
    else if (is_ok && !options->common.quiet)
        printf("ready: %s\n", http_client_url(session.client));
    session_end(&session);
    return is_ok;
}

const struct command COMMAND_HEALTH = {
    .name = "health",
    .synopsis = "",
    .summary = "Tell by the exit code whether the server lives and can render",
    .details = "0: it can render. 75: it lives, but is not ready, or hangs. 69: nobody there.\n"
               "Gives up after 5 s unless --timeout says otherwise.",
    .is_remote = true,
    .options_bytes = sizeof(struct health_options),
    .run = health_run,
};
