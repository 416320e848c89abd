/* SPDX-License-Identifier: MIT */
/* Hashes, asks and uploads. The only home of libcrypto in this program. */
#include "clients/vitrail/scene_source.h"

#include <errno.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "clients/vitrail/gltf_files.h"
#include "protocol/limits.h"

enum {
    HASH_BYTES = 32,
    BLOCK_BYTES = 1 << 16,
    SCENE_NAME_BYTES = LIMIT_FILE_NAME_BYTES + 1,
};

bool scene_source_is_on_server(const char *text)
{
    struct stat status;

    return scene_reference_is_plain(text) && stat(text, &status) != 0;
}

static FILE *open_source(const char *path, struct failure *failure)
{
    struct stat status;
    FILE *stream = fopen(path, "rbe");

    if (stream && fstat(fileno(stream), &status) == 0 && S_ISREG(status.st_mode))
        return stream;
    if (stream) {
        fclose(stream);
        errno = S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
    }
    fail(failure, EXIT_CODE_NO_INPUT, "cannot read '%s': %s", path, strerror(errno));
    return NULL;
}

/* A GLB says so in its first four bytes (glTF 2.0, 4.4.2); anything else has to be JSON. */
static bool is_glb(const char *path, bool *answer, struct failure *failure)
{
    char magic[4] = {0};
    FILE *stream = open_source(path, failure);
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

/* Hexadecimal SHA-256 of the file. Checks for signals: a scene may be gigabytes. */
static bool hash_file(struct session *session, const char *path, char id[SCENE_ID_BYTES],
                      struct failure *failure)
{
    unsigned char digest[HASH_BYTES], block[BLOCK_BYTES];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    FILE *stream = open_source(path, failure);
    bool is_ok = hash && stream && EVP_DigestInit_ex(hash, EVP_sha256(), NULL);
    size_t length;

    while (is_ok && (length = fread(block, 1, sizeof block, stream)) > 0)
        is_ok =
            EVP_DigestUpdate(hash, block, length) && interrupt_check(&session->interrupt, failure);
    if (is_ok && ferror(stream))
        is_ok = fail(failure, EXIT_CODE_NO_INPUT, "cannot read '%s'", path);
    if (is_ok)
        is_ok = EVP_DigestFinal_ex(hash, digest, NULL);
    if (is_ok)
        for (int i = 0; i < HASH_BYTES; i++)
            snprintf(id + 2 * i, 3, "%02x", digest[i]);
    if (stream)
        fclose(stream);
    EVP_MD_CTX_free(hash);
    return is_ok || fail_no_memory(failure); /* the first failure wins */
}

/* True in *answer when the server has it. An answer other than yes or no is left to the upload to
 * explain. */
static bool server_has(struct session *session, const char *id, bool *answer,
                       struct failure *failure)
{
    struct http_reply reply;
    char path[128];

    snprintf(path, sizeof path, "/v1/scenes/%s", id);
    if (!http_send(session->client, &(struct http_request){.method = "HEAD", .path = path}, &reply,
                   failure))
        return false;
    *answer = reply.status == 200;
    http_reply_finish(&reply);
    return true;
}

/* The id is in the body, and in the address of the new scene. */
static bool read_id(const struct http_reply *reply, const char *task, char id[SCENE_ID_BYTES],
                    struct failure *failure)
{
    json_t *body = json_loadb(reply->body ? reply->body : "", reply->body_bytes, 0, NULL);
    const char *text = json_string_value(json_object_get(body, "id"));
    const char *slash = strrchr(reply->location, '/');
    bool is_ok;

    if (!text && slash)
        text = slash + 1;
    is_ok = text && scene_id_is_valid(text);
    if (is_ok)
        memcpy(id, text, SCENE_ID_BYTES);
    else
        fail(failure, EXIT_CODE_UNAVAILABLE,
             "%s was answered without a scene id; is this a vitrail server?", task);
    json_decref(body);
    return is_ok;
}

/* Adds a member to the query of an address, its value escaped (RFC 3986, 2.1): all but the
 * unreserved characters as "%XX". Without a value, nothing. */
static void add_query(char *address, size_t address_bytes, const char *key, const char *value)
{
    static const char unreserved[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    size_t used = strlen(address);
    if (!value)
        return;
    used += (size_t)snprintf(address + used, address_bytes - used,
                             "%c%s=", strchr(address, '?') ? '&' : '?', key);
    for (const char *at = value; *at && used + 4 <= address_bytes; at++)
        used += (size_t)snprintf(address + used, address_bytes - used,
                                 strchr(unreserved, *at) ? "%c" : "%%%02X", (unsigned char)*at);
}

/* The name of a file without its folders, as the server takes names of scenes: not every name that
 * a file may have is UTF-8 without control characters. */
static void name_from_path(const char *path, char name[SCENE_NAME_BYTES])
{
    const char *slash = strrchr(path, '/');
    text_copy_printable(name, SCENE_NAME_BYTES, slash ? slash + 1 : path);
}

static bool upload(struct session *session, const char *path, const struct gltf_files *files,
                   const struct scene_wish *wish, char id[SCENE_ID_BYTES], struct failure *failure)
{
    struct http_reply reply;
    const char *name = wish->name;
    char address[sizeof "/v1/scenes?name=&scene=&unit=&up=" + 7 * SCENE_NAME_BYTES] = "/v1/scenes";
    struct http_request request = {.method = "POST",
                                   .path = address,
                                   .sending = PROGRESS_STAGE_UPLOAD,
                                   .waiting = PROGRESS_STAGE_DECODE};
    char task[256], file_name[SCENE_NAME_BYTES];
    bool is_ok;

    if (!files && !name) { /* the server knows the names of several files */
        name_from_path(path, file_name);
        name = *file_name ? file_name : NULL;
    }
    add_query(address, sizeof address, "name", name);
    add_query(address, sizeof address, "scene", wish->scene);
    add_query(address, sizeof address, "unit", wish->unit);
    add_query(address, sizeof address, "up", wish->up);
    if (files) {
        request.parts = files->files;
        request.part_count = files->count;
    } else {
        request.body_path = path;
        request.content_type = "model/gltf-binary";
    }
    snprintf(task, sizeof task, "the scene '%.200s'", path);
    if (!session_ask(session, &request, task, &reply, failure))
        return false;
    is_ok = read_id(&reply, task, id, failure);
    http_reply_finish(&reply);
    return is_ok;
}

static bool rename_scene(struct session *session, const char *id, const char *name,
                         struct failure *failure)
{
    char path[128], task[128];
    struct http_reply reply = {0};
    json_t *patch = json_pack("{s:s}", "name", name);
    char *text = patch ? json_dumps(patch, JSON_COMPACT) : NULL;
    bool is_ok;

    snprintf(path, sizeof path, "/v1/scenes/%s", id);
    snprintf(task, sizeof task, "the name of scene %.12s", id);
    is_ok = (text || fail(failure, EXIT_CODE_USAGE, "the name of a scene is UTF-8")) &&
            session_ask(session,
                        &(struct http_request){.method = "PATCH",
                                               .path = path,
                                               .content_type = "application/merge-patch+json",
                                               .body = text},
                        task, &reply, failure);
    if (is_ok)
        http_reply_finish(&reply);
    free(text);
    json_decref(patch);
    return is_ok;
}

bool scene_source_push(struct session *session, const char *path, const struct scene_wish *wish,
                       struct scene_push *push, struct failure *failure)
{
    struct gltf_files files;
    bool is_binary, is_there = false, is_ok;

    *push = (struct scene_push){0};
    if (!is_glb(path, &is_binary, failure))
        return false;
    if (is_binary) {
        if (!wish->force && !wish->scene && !wish->unit && !wish->up &&
            (!hash_file(session, path, push->id, failure) ||
             !server_has(session, push->id, &is_there, failure)))
            return false;
        if (is_there)
            return !wish->name || rename_scene(session, push->id, wish->name, failure);
        push->was_sent = true;
        return upload(session, path, NULL, wish, push->id, failure);
    }
    if (!gltf_files_find(&files, path, failure))
        return false;
    push->was_sent = true;
    is_ok = upload(session, path, &files, wish, push->id, failure);
    gltf_files_finish(&files);
    return is_ok;
}

bool scene_source_push_demo(struct session *session, const char *name, struct scene_push *push,
                            struct failure *failure)
{
    char address[sizeof "/v1/scenes/demo?name=" + 3 * SCENE_NAME_BYTES] = "/v1/scenes/demo";
    struct http_reply reply;
    bool is_ok;

    *push = (struct scene_push){0};
    add_query(address, sizeof address, "name", name);
    if (!session_ask(session,
                     &(struct http_request){
                         .method = "POST", .path = address, .waiting = PROGRESS_STAGE_DECODE},
                     "the demo scene", &reply, failure))
        return false;
    is_ok = read_id(&reply, "the demo scene", push->id, failure);
    http_reply_finish(&reply);
    return is_ok;
}

bool scene_source_check_all(const char *source, const struct scene_wish *wish,
                            const json_t *request, struct failure *failure)
{
    const char *name;
    json_t *part;

    if (source && wish && (wish->scene || wish->unit || wish->up) &&
        scene_source_is_on_server(source))
        return fail(failure, EXIT_CODE_USAGE,
                    "--%s says how a FILE is read, and '%s' is a scene of the server",
                    wish->scene  ? "scene"
                    : wish->unit ? "unit"
                                 : "up",
                    source);
    if (source && !scene_source_is_on_server(source) && !scene_source_check(source, failure))
        return false;
    json_object_foreach(json_object_get(request, "parts"), name, part)
    {
        const char *scene = json_string_value(json_object_get(part, "scene"));
        if (scene && !scene_source_is_on_server(scene) && !scene_source_check(scene, failure))
            return false;
    }
    return true;
}

/* Names what `source` is in `object` as "scene", when the server has it. */
static bool bring(struct session *session, const char *source, const struct scene_wish *wish,
                  json_t *object, struct scene_push *push, struct failure *failure)
{
    bool is_ok = scene_source_is_on_server(source)
                     ? scene_reference_resolve(session, source, push->id, failure)
                     : scene_source_push(session, source, wish, push, failure);
    if (!is_ok)
        return false;
    return json_object_set_new(object, "scene", json_string(push->id)) == 0 ||
           fail_no_memory(failure);
}

bool scene_source_bring_parts(struct session *session, json_t *request, struct failure *failure)
{
    const char *name;
    json_t *part;

    json_object_foreach(json_object_get(request, "parts"), name, part)
    {
        struct scene_push push = {0};
        const char *given = json_string_value(json_object_get(part, "scene"));
        if (!given || scene_source_is_on_server(given))
            continue;
        char *scene = strdup(given); /* `given` ends where its place is taken */
        if (!scene)
            return fail_no_memory(failure);
        bool is_ok = bring(session, scene, &(struct scene_wish){0}, part, &push, failure);
        free(scene);
        if (!is_ok)
            return false;
    }
    return true;
}

bool scene_source_bring(struct session *session, const char *source, const struct scene_wish *wish,
                        json_t *request, struct scene_push *push, struct failure *failure)
{
    return scene_source_bring_parts(session, request, failure) &&
           bring(session, source, wish, request, push, failure);
}
