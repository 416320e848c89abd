/* SPDX-License-Identifier: MIT */
/* The decoder's words are data like any other: they are parsed by the protocol's readers. */
#include "server/front/decoded_summary.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "protocol/environment_summary.h"
#include "protocol/scene_summary.h"
#include "server/base/ipc.h"

enum { SUMMARY_BYTES_MAX = 64 << 20 };

struct known {
    const char *id;
    char *name; /* owned until a summary has it; NULL: none */
    uint64_t upload_bytes, decoded_bytes;
    int64_t created_unix_s;
};

static json_t *read_scene(const struct ipc_mapping *text, struct known *known, struct error *err)
{
    struct scene_summary summary = {0};
    if (!scene_summary_from_json_text(text->bytes, text->size_bytes, &summary, err))
        return NULL;
    memcpy(summary.id, known->id, sizeof summary.id);
    free(summary.name);
    summary.name = known->name;
    known->name = NULL;
    summary.upload_bytes = known->upload_bytes;
    summary.decoded_bytes = known->decoded_bytes;
    summary.created_unix_s = known->created_unix_s;
    json_t *json = scene_summary_to_json(&summary);
    scene_summary_finish(&summary);
    return json;
}

static json_t *read_environment(const struct ipc_mapping *text, struct known *known,
                                struct error *err)
{
    struct environment_summary summary = {0};
    if (!environment_summary_from_json_text(text->bytes, text->size_bytes, &summary, err))
        return NULL;
    memcpy(summary.id, known->id, sizeof summary.id);
    free(summary.name);
    summary.name = known->name;
    known->name = NULL;
    summary.upload_bytes = known->upload_bytes;
    summary.decoded_bytes = known->decoded_bytes;
    summary.created_unix_s = known->created_unix_s;
    json_t *json = environment_summary_to_json(&summary);
    environment_summary_finish(&summary);
    return json;
}

json_t *decoded_summary_read(const struct upload *upload, const char *id, int summary_fd,
                             int blob_fd, struct error *err)
{
    const struct resource_info *info = resource_info(upload_kind(upload));
    const char *name = upload_name(upload);
    struct ipc_mapping text = {0};
    struct stat blob = {0};
    struct error unreadable = {0};
    struct known known = {.id = id,
                          .name = *name ? strdup(name) : NULL,
                          .upload_bytes = upload_size_bytes(upload),
                          .created_unix_s = (int64_t)time(NULL)};
    json_t *json = NULL;
    bool has_room = !*name || known.name;
    if (has_room && ipc_mapping_init(&text, summary_fd, &unreadable) &&
        text.size_bytes <= SUMMARY_BYTES_MAX && fstat(blob_fd, &blob) == 0 && blob.st_size > 0) {
        known.decoded_bytes = (uint64_t)blob.st_size;
        json = upload_kind(upload) == RESOURCE_SCENE ? read_scene(&text, &known, &unreadable)
                                                     : read_environment(&text, &known, &unreadable);
        has_room = json || unreadable.code != ERROR_NONE;
    }
    ipc_mapping_finish(&text);
    free(known.name);
    if (!has_room)
        error_set(err, ERROR_NO_MEMORY, "summary of a %s", info->noun);
    else if (!json)
        error_set(err, info->broken, "the decoder left no usable %s: %s", info->noun,
                  unreadable.message);
    return json;
}
