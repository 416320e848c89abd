/* SPDX-License-Identifier: MIT */
/* Tells files from ids, and uploads. */
#include "clients/vitrail/environment_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/resource.h"

static const char hdr_type[] = "image/vnd.radiance", exr_type[] = "image/x-exr";

/* The media type of a map by its first bytes; NULL: it is none, or cannot be read. */
static const char *media_type(const char *path, struct failure *failure)
{
    char magic[10] = {0};
    FILE *stream = resource_open(path, failure);

    if (!stream)
        return NULL;
    size_t length = fread(magic, 1, sizeof magic, stream);
    fclose(stream);
    if (length >= 6 && (!memcmp(magic, "#?RADIANCE", 10) || !memcmp(magic, "#?RGBE", 6)))
        return hdr_type;
    return length >= 4 && !memcmp(magic, "\x76\x2F\x31\x01", 4) ? exr_type : NULL;
}

bool environment_source_is_map(const char *path, bool *answer, struct failure *failure)
{
    *answer = media_type(path, failure) != NULL;
    return !failure->exit_code;
}

static const char *needed_type(const char *path, struct failure *failure)
{
    const char *type = media_type(path, failure);
    if (!type && !failure->exit_code)
        fail(failure, EXIT_CODE_NO_INPUT,
             "'%s' is no environment map: neither Radiance HDR nor OpenEXR", path);
    return type;
}

static bool upload(struct session *session, const char *path, const struct file_options *options,
                   const char *type, char id[SCENE_ID_BYTES], struct failure *failure)
{
    struct http_reply reply;
    char address[sizeof "/v1/environments?name=" + 3 * RESOURCE_NAME_BYTES] = "/v1/environments";
    char file_name[RESOURCE_NAME_BYTES], task[256];

    resource_name_from_path(path, file_name);
    resource_add_query(address, sizeof address, "name",
                       options->name ? options->name
                       : *file_name  ? file_name
                                     : NULL);
    snprintf(task, sizeof task, "the environment map '%.200s'", path);
    if (!upload_watch_ask(
            session,
            &(struct http_request){
                .method = "POST", .path = address, .body_path = path, .content_type = type},
            task, &reply, failure))
        return false;
    bool is_ok = resource_read_id(&reply, task, id, failure);
    http_reply_finish(&reply);
    return is_ok;
}

bool environment_source_push(struct session *session, const char *path,
                             const struct file_options *options, struct scene_push *push,
                             struct failure *failure)
{
    const char *type = needed_type(path, failure);
    bool is_there = false;

    *push = (struct scene_push){0};
    if (!type)
        return false;
    if (!options->force &&
        (!resource_hash(session, path, push->id, failure) ||
         !resource_is_there(session, "environments", push->id, &is_there, failure)))
        return false;
    if (is_there)
        return !options->name ||
               resource_rename(session, "environments", push->id, options->name, failure);
    push->was_sent = true;
    return upload(session, path, options, type, push->id, failure);
}

static const char *image_of(const json_t *request)
{
    return json_string_value(json_object_get(json_object_get(request, "environment"), "image"));
}

/* Whether `image` is a file's name: not the map that is built in, and nothing of the server. */
static bool is_file(const char *image)
{
    struct stat status;
    return image && strcmp(image, "studio") != 0 &&
           (stat(image, &status) == 0 || !environment_reference_is_plain(image));
}

bool environment_source_check(const json_t *request, struct failure *failure)
{
    const char *image = image_of(request);
    return !is_file(image) || needed_type(image, failure);
}

bool environment_source_bring(struct session *session, json_t *request, struct failure *failure)
{
    const char *image = image_of(request);
    struct scene_push push = {0};

    if (!image || strcmp(image, "studio") == 0)
        return true;
    if (!(is_file(image)
              ? environment_source_push(session, image, &(struct file_options){0}, &push, failure)
              : environment_reference_resolve(session, image, push.id, failure)))
        return false;
    return json_object_set_new(json_object_get(request, "environment"), "image",
                               json_string(push.id)) == 0 ||
           fail_no_memory(failure);
}
