/* SPDX-License-Identifier: MIT */
/* Camera and exposure of scenes that bring none. */
#include "clients/vitrail/scene_defaults.h"

#include <stdio.h>

#include "clients/vitrail/json_text.h"

static bool has_none(const json_t *description, const char *count)
{
    const json_t *number = json_object_get(description, count);
    return json_is_integer(number) && json_integer_value(number) == 0;
}

static bool is_unlit(const json_t *description, const json_t *request)
{
    return has_none(description, "light_count") ||
           json_is_false(json_object_get(request, "scene_lights"));
}

static bool needs_camera(const json_t *request)
{
    return !json_object_get(request, "camera");
}

static bool needs_exposure(const json_t *request)
{
    return !json_object_get(request, "exposure_ev") && !json_object_get(request, "environment") &&
           !json_array_size(json_object_get(request, "lights"));
}

json_t *scene_describe(struct session *session, const char *scene, struct failure *failure)
{
    struct failure ignored = {0};
    char path[128];

    snprintf(path, sizeof path, "/v1/scenes/%s", scene);
    json_t *description = session_get_json(session, path, "the scene", &ignored);
    if (ignored.exit_code >= EXIT_CODE_SIGNAL_BASE)
        *failure = ignored;
    return description;
}

bool scene_defaults_put(const json_t *description, json_t *request, struct failure *failure)
{
    bool is_ok = true;

    if (!description || json_object_get(request, "parts"))
        return true;
    if (needs_camera(request) && has_none(description, "camera_count"))
        is_ok =
            json_object_set_new(request, "camera", json_pack("{s:s}", "fit", "three-quarter")) == 0;
    if (is_ok && needs_exposure(request) && is_unlit(description, request))
        is_ok = json_object_set_new(request, "exposure_ev", json_string("auto")) == 0;
    return is_ok || fail_no_memory(failure);
}

bool scene_defaults_ask(struct session *session, const char *scene, json_t *request,
                        struct failure *failure)
{
    json_t *description = scene_describe(session, scene, failure);
    bool is_ok = !failure->exit_code && scene_defaults_put(description, request, failure);

    json_decref(description);
    return is_ok;
}
