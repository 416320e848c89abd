/* SPDX-License-Identifier: MIT */
/* Asks and uploads. */
#include "clients/vitrail/scene_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "clients/vitrail/environment_source.h"
#include "clients/vitrail/gltf_files.h"
#include "clients/vitrail/render_watch.h"
#include "clients/vitrail/resource.h"
#include "clients/vitrail/specs.h"

bool scene_source_is_on_server(const char *text)
{
    struct stat status;

    return scene_reference_is_plain(text) && stat(text, &status) != 0;
}

/* A GLB says so in its first four bytes (glTF 2.0, 4.4.2); anything else has to be JSON. */
static bool is_glb(const char *path, bool *answer, struct failure *failure)
{
    char magic[4] = {0};
    FILE *stream = resource_open(path, failure);
    size_t length;

    if (!stream)
        return false;
    length = fread(magic, 1, sizeof magic, stream);
    *answer = length == sizeof magic && !memcmp(magic, "glTF", 4);
    fclose(stream);
    return true;
}

bool scene_source_check(const char *path, struct failure *failure)
{
    struct gltf_files files;
    bool is_binary;

    if (!is_glb(path, &is_binary, failure))
        return false;
    if (is_binary)
        return true;
    if (!gltf_files_find(&files, path, failure))
        return false;
    gltf_files_finish(&files);
    return true;
}

/* Asks for a new scene, and reads its id. */
static bool send_new(struct session *session, const struct http_request *request, const char *task,
                     char id[SCENE_ID_BYTES], struct failure *failure)
{
    struct http_reply reply;
    if (!upload_watch_ask(session, request, task, &reply, failure))
        return false;
    bool is_ok = resource_read_id(&reply, task, id, failure);
    http_reply_finish(&reply);
    return is_ok;
}

static bool upload(struct session *session, const char *path, const struct gltf_files *files,
                   const struct file_options *options, char id[SCENE_ID_BYTES],
                   struct failure *failure)
{
    const char *name = options->name;
    char address[sizeof "/v1/scenes?name=&scene=&unit=&up=&deflection=" + 9 * RESOURCE_NAME_BYTES] =
        "/v1/scenes";
    struct http_request request = {.method = "POST", .path = address};
    char task[256], file_name[RESOURCE_NAME_BYTES];

    if (!files && !name) { /* the server knows the names of several files */
        resource_name_from_path(path, file_name);
        name = *file_name ? file_name : NULL;
    }
    resource_add_query(address, sizeof address, "name", name);
    resource_add_query(address, sizeof address, "scene", options->scene);
    resource_add_query(address, sizeof address, "unit", options->unit);
    resource_add_query(address, sizeof address, "up", options->up);
    resource_add_query(address, sizeof address, "deflection", options->deflection);
    if (files) {
        request.parts = files->files;
        request.part_count = files->count;
    } else {
        request.body_path = path;
        request.content_type = "model/gltf-binary";
    }
    snprintf(task, sizeof task, "the scene '%.200s'", path);
    return send_new(session, &request, task, id, failure);
}

/* Which option says how a file is read; NULL: none does. */
static const char *reading_option(const struct file_options *options)
{
    return options->scene        ? "scene"
           : options->unit       ? "unit"
           : options->up         ? "up"
           : options->deflection ? "deflection"
                                 : NULL;
}

bool scene_source_push(struct session *session, const char *path,
                       const struct file_options *options, struct scene_push *push,
                       struct failure *failure)
{
    struct gltf_files files;
    bool is_binary, is_there = false, is_ok;

    *push = (struct scene_push){0};
    if (!is_glb(path, &is_binary, failure))
        return false;
    if (is_binary) {
        if (!options->force && !reading_option(options) &&
            (!resource_hash(session, path, push->id, failure) ||
             !resource_is_there(session, "scenes", push->id, &is_there, failure)))
            return false;
        if (is_there)
            return !options->name ||
                   resource_rename(session, "scenes", push->id, options->name, failure);
        push->was_sent = true;
        return upload(session, path, NULL, options, push->id, failure);
    }
    if (!gltf_files_find(&files, path, failure))
        return false;
    push->was_sent = true;
    is_ok = upload(session, path, &files, options, push->id, failure);
    gltf_files_finish(&files);
    return is_ok;
}

bool scene_source_push_demo(struct session *session, const char *name, struct scene_push *push,
                            struct failure *failure)
{
    char address[sizeof "/v1/scenes/demo?name=" + 3 * RESOURCE_NAME_BYTES] = "/v1/scenes/demo";
    struct http_reply reply;
    bool is_ok;

    *push = (struct scene_push){0};
    resource_add_query(address, sizeof address, "name", name);
    if (!session_ask(session,
                     &(struct http_request){
                         .method = "POST", .path = address, .waiting = PROGRESS_STAGE_DECODE},
                     "the demo scene", &reply, failure))
        return false;
    is_ok = resource_read_id(&reply, "the demo scene", push->id, failure);
    http_reply_finish(&reply);
    return is_ok;
}

bool scene_source_push_grid(struct session *session, const json_t *grid, const char *name,
                            struct scene_push *push, struct failure *failure)
{
    static const char extension[] = "VITRAIL_density_grids";
    char address[sizeof "/v1/scenes?name=" + 3 * RESOURCE_NAME_BYTES] = "/v1/scenes";
    const char *own = json_string_value(json_object_get(grid, "name"));

    *push = (struct scene_push){.was_sent = true};
    json_t *document = json_pack(
        "{s:{s:s}, s:[s], s:{s:{s:[O]}}, s:i, s:[{s:[i]}], s:[{s:s, s:{s:{s:i}}}]}", "asset",
        "version", "2.0", "extensionsUsed", extension, "extensions", extension, "grids", grid,
        "scene", 0, "scenes", "nodes", 0, "nodes", "name", own, "extensions", extension, "grid", 0);
    char *text = document ? json_dumps(document, JSON_COMPACT) : NULL;
    json_decref(document);
    if (!text)
        return fail_no_memory(failure);
    resource_add_query(address, sizeof address, "name", name ? name : own);
    const struct http_request request = {
        .method = "POST", .path = address, .content_type = "model/gltf+json", .body = text};
    bool is_ok = send_new(session, &request, "the procedure", push->id, failure);
    free(text);
    return is_ok;
}

static const char *part_text(const json_t *part, const char *member)
{
    return json_string_value(json_object_get(part, member));
}

/* As the part says, which lends the texts. */
static struct file_options part_file_options(const json_t *part)
{
    return (struct file_options){.scene = part_text(part, PART_FILE_SCENE),
                                 .unit = part_text(part, PART_FILE_UNIT),
                                 .up = part_text(part, PART_FILE_UP),
                                 .deflection = part_text(part, PART_FILE_DEFLECTION)};
}

static void drop_file_options(json_t *part)
{
    static const char *const members[] = {PART_FILE_SCENE, PART_FILE_UNIT, PART_FILE_UP,
                                          PART_FILE_DEFLECTION};
    for (size_t i = 0; i < sizeof members / sizeof *members; i++)
        json_object_del(part, members[i]);
}

static bool check_part(const json_t *part, struct failure *failure)
{
    const struct file_options options = part_file_options(part);
    const char *scene = part_text(part, "scene"), *option = reading_option(&options);
    if (!scene)
        return true;
    if (!scene_source_is_on_server(scene))
        return scene_source_check(scene, failure);
    return !option ||
           fail(failure, EXIT_CODE_USAGE,
                "--part: %s= says how a FILE is read, and '%.200s' is a scene of the server",
                option, scene);
}

bool scene_source_check_all(const char *source, const struct file_options *options,
                            const json_t *request, struct failure *failure)
{
    const char *name, *option = options ? reading_option(options) : NULL;
    json_t *part;

    if (source && option && scene_source_is_on_server(source))
        return fail(failure, EXIT_CODE_USAGE,
                    "--%s says how a FILE is read, and '%s' is a scene of the server", option,
                    source);
    if (source && !scene_source_is_on_server(source) && !scene_source_check(source, failure))
        return false;
    json_object_foreach(json_object_get(request, "parts"), name, part)
    {
        if (!check_part(part, failure))
            return false;
    }
    return environment_source_check(request, failure);
}

/* Names what `source` is in `object` as "scene", when the server has it. */
static bool bring(struct session *session, const char *source, const struct file_options *options,
                  json_t *object, struct scene_push *push, struct failure *failure)
{
    bool is_ok = scene_source_is_on_server(source)
                     ? scene_reference_resolve(session, source, push->id, failure)
                     : scene_source_push(session, source, options, push, failure);
    if (!is_ok)
        return false;
    return json_object_set_new(object, "scene", json_string(push->id)) == 0 ||
           fail_no_memory(failure);
}

bool scene_source_bring_beside(struct session *session, json_t *request, struct failure *failure)
{
    const char *name;
    json_t *part;

    json_object_foreach(json_object_get(request, "parts"), name, part)
    {
        struct scene_push push = {0};
        const struct file_options options = part_file_options(part);
        const char *given = part_text(part, "scene");
        if (!given || scene_source_is_on_server(given))
            continue;
        char *scene = strdup(given); /* `given` ends where its place is taken */
        if (!scene)
            return fail_no_memory(failure);
        bool is_ok = bring(session, scene, &options, part, &push, failure);
        free(scene);
        drop_file_options(part);
        if (!is_ok)
            return false;
    }
    return environment_source_bring(session, request, failure);
}

bool scene_source_bring(struct session *session, const char *source,
                        const struct file_options *options, json_t *request,
                        struct scene_push *push, struct failure *failure)
{
    return scene_source_bring_beside(session, request, failure) &&
           bring(session, source, options, request, push, failure);
}
