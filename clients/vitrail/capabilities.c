/* SPDX-License-Identifier: MIT */
/* vitrail capabilities: device, limits, techniques and formats of the server. */
#include <jansson.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/session.h"

struct capabilities_options {
    struct common_options common;
};

static bool capabilities_run(void *context, const struct text_list *operands,
                             struct failure *failure)
{
    const struct capabilities_options *options = context;
    struct session session = {0};
    json_t *answer = NULL;

    (void)operands;
    if (session_begin(&session, &options->common, failure))
        answer =
            session_get_json(&session, "/v1/capabilities", "the list of capabilities", failure);
    progress_hide(&session.progress);
    if (answer)
        json_print(answer, options->common.json);
    session_end(&session);
    json_decref(answer);
    return answer != NULL;
}

const struct command COMMAND_CAPABILITIES = {
    .name = "capabilities",
    .synopsis = "",
    .summary = "Print device, limits, techniques and formats of the server",
    .is_remote = true,
    .options_bytes = sizeof(struct capabilities_options),
    .run = capabilities_run,
};
