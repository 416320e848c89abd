/* SPDX-License-Identifier: MIT */
/* Files, ids and names. The only home of libcrypto in this program. */
#include "clients/vitrail/resource.h"

#include <errno.h>
#include <jansson.h>
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { HASH_BYTES = 32, BLOCK_BYTES = 1 << 16 };

FILE *resource_open(const char *path, struct failure *failure)
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

bool resource_hash(struct session *session, const char *path, char id[SCENE_ID_BYTES],
                   struct failure *failure)
{
    unsigned char digest[HASH_BYTES], block[BLOCK_BYTES];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    FILE *stream = resource_open(path, failure);
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

bool resource_is_there(struct session *session, const char *folder, const char *id, bool *answer,
                       struct failure *failure)
{
    struct http_reply reply;
    char path[128];

    snprintf(path, sizeof path, "/v1/%s/%s", folder, id);
    if (!http_send(session->client, &(struct http_request){.method = "HEAD", .path = path}, &reply,
                   failure))
        return false;
    *answer = reply.status == 200;
    http_reply_finish(&reply);
    return true;
}

/* The id is in the body, and in the address of the new scene. */
bool resource_read_id(const struct http_reply *reply, const char *task, char id[SCENE_ID_BYTES],
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
             "%s was answered without an id; is this a vitrail server?", task);
    json_decref(body);
    return is_ok;
}

void resource_add_query(char *address, size_t address_bytes, const char *key, const char *value)
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

void resource_name_from_path(const char *path, char name[RESOURCE_NAME_BYTES])
{
    const char *slash = strrchr(path, '/');
    text_copy_printable(name, RESOURCE_NAME_BYTES, slash ? slash + 1 : path);
}

bool resource_rename(struct session *session, const char *folder, const char *id, const char *name,
                     struct failure *failure)
{
    char path[128], task[128];
    struct http_reply reply = {0};
    json_t *patch = json_pack("{s:s}", "name", name);
    char *text = patch ? json_dumps(patch, JSON_COMPACT) : NULL;
    bool is_ok;

    snprintf(path, sizeof path, "/v1/%s/%s", folder, id);
    snprintf(task, sizeof task, "the name of %.12s", id);
    is_ok = (text || fail(failure, EXIT_CODE_USAGE, "a name is UTF-8")) &&
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
