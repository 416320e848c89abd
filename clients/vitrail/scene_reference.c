/* SPDX-License-Identifier: MIT */
/* Looks scenes and environment maps up in the server's lists. */
#include "clients/vitrail/scene_reference.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

struct kind {
    const char *prefix;
    const char *folder; /* the route, and the list in its answer */
    const char *noun;
};
static const struct kind scene_kind = {"scene:", "scenes", "scene"};
static const struct kind environment_kind = {"environment:", "environments", "environment map"};
static const char digits[] = "0123456789abcdef";
enum {
    LISTED_MAX = 4, /* that the refusal of an ambiguous name lists */
    NAME_SHOWN_BYTES = 64,
};

static bool are_digits(const char *text)
{
    size_t length = strlen(text);
    return length >= SCENE_ID_DIGITS_LEAST && length < SCENE_ID_BYTES &&
           strspn(text, digits) == length;
}

bool scene_id_is_valid(const char *text)
{
    return are_digits(text) && strlen(text) == SCENE_ID_BYTES - 1;
}

static bool is_plain(const struct kind *kind, const char *text)
{
    return strncmp(text, kind->prefix, strlen(kind->prefix)) == 0 || are_digits(text);
}

bool scene_reference_is_plain(const char *text)
{
    return is_plain(&scene_kind, text);
}

bool environment_reference_is_plain(const char *text)
{
    return is_plain(&environment_kind, text);
}

static const char *text_of(const json_t *scene, const char *member)
{
    const char *text = json_string_value(json_object_get(scene, member));
    return text ? text : "";
}

static bool is_meant(const json_t *scene, const char *text)
{
    return strcmp(text_of(scene, "name"), text) == 0 ||
           (are_digits(text) && strncmp(text_of(scene, "id"), text, strlen(text)) == 0);
}

/* "33fb471c... box.glb", once more in a list of its kind. */
static void add_to_list(char *list, size_t list_bytes, const json_t *scene)
{
    char name[NAME_SHOWN_BYTES];
    size_t used = strlen(list);
    text_copy_printable(name, sizeof name, text_of(scene, "name"));
    snprintf(list + used, list_bytes - used, "%s%.12s %s", used ? ", " : "", text_of(scene, "id"),
             name);
}

static bool choose(const struct kind *kind, const json_t *scenes, const char *text,
                   char id[SCENE_ID_BYTES], struct failure *failure)
{
    char list[LISTED_MAX * (NAME_SHOWN_BYTES + 16)] = "";
    size_t index, count = 0;
    const json_t *scene;

    json_array_foreach(scenes, index, scene)
    {
        if (!is_meant(scene, text) || !scene_id_is_valid(text_of(scene, "id")))
            continue;
        if (count++ < LISTED_MAX)
            add_to_list(list, sizeof list, scene);
        memcpy(id, text_of(scene, "id"), SCENE_ID_BYTES);
    }
    if (count == 1)
        return true;
    if (count == 0)
        return fail(failure, EXIT_CODE_NO_INPUT,
                    "the server has no %s that is called '%s' or whose id begins so", kind->noun,
                    text);
    return fail(failure, EXIT_CODE_USAGE, "'%s' means %zu %ss: %s%s", text, count, kind->noun, list,
                count > LISTED_MAX ? ", ..." : "");
}

static bool resolve(struct session *session, const struct kind *kind, const char *text,
                    char id[SCENE_ID_BYTES], struct failure *failure)
{
    json_t *answer;
    char path[32], task[64];
    bool is_ok;

    if (strncmp(text, kind->prefix, strlen(kind->prefix)) == 0)
        text += strlen(kind->prefix);
    if (scene_id_is_valid(text)) {
        memcpy(id, text, SCENE_ID_BYTES);
        return true;
    }
    snprintf(path, sizeof path, "/v1/%s", kind->folder);
    snprintf(task, sizeof task, "the list of %ss", kind->noun);
    answer = session_get_json(session, path, task, failure);
    progress_hide(&session->progress);
    is_ok = answer && choose(kind, json_object_get(answer, kind->folder), text, id, failure);
    json_decref(answer);
    return is_ok;
}

bool scene_reference_resolve(struct session *session, const char *text, char id[SCENE_ID_BYTES],
                             struct failure *failure)
{
    return resolve(session, &scene_kind, text, id, failure);
}

bool environment_reference_resolve(struct session *session, const char *text,
                                   char id[SCENE_ID_BYTES], struct failure *failure)
{
    return resolve(session, &environment_kind, text, id, failure);
}
