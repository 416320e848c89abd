/* SPDX-License-Identifier: MIT */
/* From the bytes of an image to a blob and a summary with warnings. */
#include "server/decoder/environment_job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/environment_summary.h"
#include "renderer/environment/environment_blob.h"
#include "renderer/environment/environment_import.h"
#include "server/base/ipc.h"

static bool write_parts(const struct environment *environment, int fd, struct error *err)
{
    uint8_t header[ENVIRONMENT_BLOB_HEADER_BYTES];
    struct environment_blob_part parts[ENVIRONMENT_BLOB_ARRAYS];
    environment_blob_parts(environment, header, parts);
    uint64_t at = sizeof header;
    bool is_written = ipc_pwrite_all(fd, header, sizeof header, 0, err);
    for (int i = 0; is_written && i < ENVIRONMENT_BLOB_ARRAYS; i++) {
        is_written = ipc_pwrite_all(fd, parts[i].bytes, parts[i].size_bytes, at, err);
        at += parts[i].size_bytes;
    }
    return is_written || error_wrap(err, "storing the environment map");
}

static bool write_blob(const struct environment_import *import, int fd, struct error *err)
{
    const struct environment_desc desc = {
        .pixels = import->pixels, .width = import->width, .height = import->height};
    struct environment *environment = environment_create(&desc, err);
    bool is_written = environment && write_parts(environment, fd, err);
    environment_destroy(environment);
    return is_written;
}

static bool add_warnings(const struct environment_import *import,
                         struct environment_summary *summary, struct error *err)
{
    char text[200];
    if (import->negative_texels > 0) {
        snprintf(text, sizeof text, "%llu texels have channels below 0, which count as 0",
                 (unsigned long long)import->negative_texels);
        if (!name_list_add(&summary->warnings, text, err))
            return false;
    }
    if (import->width != import->source_width || import->height != import->source_height) {
        snprintf(text, sizeof text, "the map of %d x %d texels is reduced to %d x %d",
                 import->source_width, import->source_height, import->width, import->height);
        if (!name_list_add(&summary->warnings, text, err))
            return false;
    }
    if (import->source_width == 2 * import->source_height)
        return true;
    snprintf(text, sizeof text,
             "the map has %d x %d texels; one of all directions is twice as wide as high, and this "
             "one is stretched",
             import->source_width, import->source_height);
    return name_list_add(&summary->warnings, text, err);
}

static bool write_summary(const struct environment_import *import, int fd, struct error *err)
{
    struct environment_summary summary = {.width = (uint64_t)import->width,
                                          .height = (uint64_t)import->height,
                                          .source_width = (uint64_t)import->source_width,
                                          .source_height = (uint64_t)import->source_height,
                                          .peak_radiance = import->peak};
    memcpy(summary.mean_radiance, import->mean, sizeof summary.mean_radiance);
    bool is_good = add_warnings(import, &summary, err);
    char *text = is_good ? environment_summary_to_json_text(&summary) : NULL;
    if (is_good)
        is_good = text ? ipc_write_all(fd, text, strlen(text), err)
                       : error_set(err, ERROR_NO_MEMORY, "summary of the environment map");
    free(text);
    environment_summary_finish(&summary);
    return is_good;
}

bool environment_job_run(const struct scene_file *file, int blob_fd, int summary_fd,
                         struct error *err)
{
    struct environment_import import = {0};
    bool is_good = environment_import(file->bytes, file->size_bytes, &import, err) &&
                   write_blob(&import, blob_fd, err) && write_summary(&import, summary_fd, err);
    environment_import_finish(&import);
    return is_good;
}
