/* SPDX-License-Identifier: MIT */
/* The order of files is that of list_fds in server/front/supervisor_messages.c: the request, its
 * scene, those of parts, the environment map, the reference. */
#include "server/worker/message_files.h"

#include <string.h>

#include "protocol/limits.h"

static const char *environment_of(const json_t *message)
{
    const char *image = json_string_value(json_object_get(message, "environment"));
    return image ? image : "";
}

/* The place of the file behind those of scenes. */
static size_t after_scenes(const struct ipc_message *message)
{
    return 2 + json_array_size(json_object_get(message->json, "parts"));
}

static int file_at(const struct ipc_message *message, size_t index)
{
    return (size_t)message->fd_count > index ? message->fds[index] : -1;
}

static bool attach_scenes(struct mapped_scenes *scenes, const struct ipc_message *message,
                          const char *scene, struct error *err)
{
    const json_t *parts = json_object_get(message->json, "parts"), *part;
    const char *keys[LIMIT_PART_SCENES + 1] = {scene};
    int fds[LIMIT_PART_SCENES + 1] = {file_at(message, 1)};
    size_t i, count = 1;
    json_array_foreach(parts, i, part)
    {
        const char *key = json_string_value(part);
        if (!key || count > LIMIT_PART_SCENES || (size_t)message->fd_count < i + 3)
            return error_set(err, ERROR_INTERNAL, "worker: malformed parts in the message");
        if (strcmp(key, scene) == 0)
            continue;
        keys[count] = key;
        fds[count++] = message->fds[i + 2];
    }
    return mapped_scenes_attach(
        scenes, &(struct mapped_scenes_desc){.keys = keys, .blob_fds = fds, .count = count}, err);
}

bool message_files_attach(const struct message_files *files, const struct ipc_message *message,
                          const struct render_request *request, struct error *err)
{
    const char *image = request->environment.image;
    return attach_scenes(files->scenes, message, request->scene, err) &&
           (!*image || mapped_environments_attach(files->environments, image,
                                                  file_at(message, after_scenes(message)), err));
}

bool message_files_are_at_hand(const struct message_files *files, const json_t *message)
{
    const char *scene = json_string_value(json_object_get(message, "scene"));
    const char *environment = environment_of(message);
    bool is_there = scene && mapped_scenes_has(files->scenes, scene) &&
                    (!*environment || mapped_environments_has(files->environments, environment));
    const json_t *part;
    size_t i;
    json_array_foreach(json_object_get(message, "parts"), i, part)
    {
        is_there = is_there && json_is_string(part) &&
                   mapped_scenes_has(files->scenes, json_string_value(part));
    }
    return is_there;
}

int message_files_reference(const struct ipc_message *message)
{
    bool has_map = request_environment_is_uploaded(environment_of(message->json));
    return file_at(message, after_scenes(message) + has_map);
}

void message_files_forget(const struct message_files *files, const json_t *ids)
{
    const json_t *id;
    size_t i;
    json_array_foreach(ids, i, id)
    {
        if (!json_is_string(id))
            continue;
        mapped_scenes_forget(files->scenes, json_string_value(id));
        mapped_environments_forget(files->environments, json_string_value(id));
    }
}
