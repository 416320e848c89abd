/* SPDX-License-Identifier: MIT */
/* Warnings of scenes and frames: fetched, printed, and taken for failures where asked. */
#include "clients/vitrail/warnings.h"

#include <stdio.h>

#include "clients/vitrail/json_text.h"
#include "clients/vitrail/scene_defaults.h"

json_t *warnings_of_scene(struct session *session, const char *scene, struct failure *failure)
{
    json_t *description = scene_describe(session, scene, failure);
    json_t *warnings = json_incref(json_object_get(description, "warnings"));
    json_decref(description);
    return warnings;
}

json_t *warnings_of_environment(struct session *session, const char *id, struct failure *failure)
{
    struct failure ignored = {0};
    char path[128];
    snprintf(path, sizeof path, "/v1/environments/%s", id);
    json_t *summary = session_get_json(session, path, "the environment map", &ignored);
    if (ignored.exit_code >= EXIT_CODE_SIGNAL_BASE)
        *failure = ignored;
    json_t *warnings = json_incref(json_object_get(summary, "warnings"));
    json_decref(summary);
    return warnings;
}

void warnings_print(const json_t *warnings, const char *of)
{
    const json_t *warning;
    size_t index;
    json_array_foreach(warnings, index, warning)
    {
        char text[FAILURE_MESSAGE_BYTES];
        if (!json_is_string(warning))
            continue;
        text_copy_printable(text, sizeof text, json_string_value(warning));
        fprintf(stderr, "vitrail: warning: %s%s%s\n", of ? of : "", of ? ": " : "", text);
    }
}

bool warnings_refuse(const json_t *of_scene, const json_t *of_frame, struct failure *failure)
{
    size_t count = json_array_size(of_scene) + json_array_size(of_frame);
    if (!count)
        return true;
    const char *first =
        json_string_value(json_array_get(json_array_size(of_scene) ? of_scene : of_frame, 0));
    char text[FAILURE_MESSAGE_BYTES / 2];
    text_copy_printable(text, sizeof text, first ? first : "");
    return fail(failure, EXIT_CODE_REFUSED, "--strict: %zu warning%s: %s", count,
                count > 1 ? "s, the first" : "", text);
}
