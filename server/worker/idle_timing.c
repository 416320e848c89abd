/* SPDX-License-Identifier: MIT */
/* The message of a view's last picture, and its timing by the runner-up. */
#include "server/worker/idle_timing.h"

#include <string.h>

#include "protocol/render_request.h"
#include "server/mapping/view_mapping.h"

void idle_timing_note(struct idle_timing *timing, struct ipc_message *message)
{
    const char *op = json_string_value(json_object_get(message->json, "op"));
    if (!op || strcmp(op, "render") != 0 || message->fd_count < 1 ||
        json_object_get(message->json, "offer") || /* its technique was chosen by other times */
        !json_is_true(json_object_get(message->json, "reuse")))
        return;
    ipc_message_finish(&timing->last);
    timing->last = (struct ipc_message){.json = json_incref(message->json),
                                        .fds = {ipc_message_take_fd(message, 0)},
                                        .fd_count = 1};
}

const json_t *idle_timing_message(const struct idle_timing *timing)
{
    return timing->last.json;
}

static enum runner_up_outcome time_picture(const struct ipc_message *message,
                                           const struct idle_timing_desc *desc)
{
    struct ipc_mapping text = {0};
    struct render_request request = {0};
    struct view_storage storage = {0};
    struct view view;
    struct error ignored = {0}; /* reported to whoever asked for the picture */
    const struct runner_up_desc by = {.shall_stop = desc->shall_stop, .context = desc->context};
    enum runner_up_outcome outcome = RUNNER_UP_NONE;
    if (ipc_mapping_init(&text, message->fds[0], &ignored) &&
        render_request_parse(text.bytes, text.size_bytes, &request, &ignored) &&
        view_from_request(&request, &storage, &view, &ignored)) {
        view.quality.expects_reuse = true;
        view.quality.may_be_coarse = json_is_true(json_object_get(message->json, "coarse"));
        outcome = renderer_time_runner_up(desc->renderer, request.scene, &view, &by);
    }
    view_storage_finish(&storage);
    render_request_finish(&request);
    ipc_mapping_finish(&text);
    return outcome;
}

bool idle_timing_run(struct idle_timing *timing, const struct idle_timing_desc *desc)
{
    enum runner_up_outcome outcome = RUNNER_UP_NONE;
    if (timing->last.json && desc->has_scenes)
        outcome = time_picture(&timing->last, desc);
    ipc_message_finish(&timing->last);
    timing->timed += outcome == RUNNER_UP_TIMED;
    timing->stopped += outcome == RUNNER_UP_STOPPED;
    return outcome != RUNNER_UP_NONE;
}

void idle_timing_finish(struct idle_timing *timing)
{
    ipc_message_finish(&timing->last);
}
