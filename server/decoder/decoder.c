/* SPDX-License-Identifier: MIT */
/* The decoder: the job is received, libraries that it needs are loaded, the cage closes, and only
 * then is the upload parsed. */
#include "server/decoder/decoder.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/upload_stage.h"
#include "renderer/image/image.h"
#include "renderer/import/import.h"
#include "renderer/scene/scene.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/decoder/environment_job.h"
#include "server/decoder/sandbox.h"
#include "server/mapping/scene_mapping.h"

enum { FD_SPOOL, FD_BLOB, FD_SUMMARY, FD_COUNT };
enum { ADVANCE_MS = 200 }; /* between two messages of how far it is */

struct decode_work {
    int socket; /* of the front */
    struct ipc_message job;
    struct ipc_mapping spool;
    struct scene_file *files; /* names and bytes are borrowed from job and spool */
    size_t file_count;
};

/* A map of 1 x 1 texel: HDR is read, but never written. */
static void warm_up_hdr(void)
{
    static const char text[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81";
    struct image back = {0};
    if (image_decode(text, sizeof text - 1, &(struct image_decode_desc){.keep_float = true}, &back,
                     NULL))
        image_finish(&back);
}

static void warm_up_exr(void)
{
    struct image image = {0}, back = {0};
    void *bytes = NULL;
    size_t size_bytes = 0;
    if (image_init(&image, 2, 2, 4, IMAGE_F32, NULL) &&
        image_encode(&image, &(struct image_encode_desc){.format = IMAGE_FORMAT_EXR}, &bytes,
                     &size_bytes, NULL) &&
        image_decode(bytes, size_bytes, &(struct image_decode_desc){.keep_float = true}, &back,
                     NULL))
        image_finish(&back);
    free(bytes);
    image_finish(&image);
}

/* The table of files; every range is checked against the spool. */
static bool read_files(struct decode_work *work, struct error *err)
{
    const json_t *files = json_object_get(work->job.json, "files");
    work->file_count = json_array_size(files);
    work->files = calloc(work->file_count + 1, sizeof *work->files);
    if (!work->files)
        return error_set(err, ERROR_NO_MEMORY, "table of files");
    for (size_t i = 0; i < work->file_count; i++) {
        const json_t *file = json_array_get(files, i);
        const char *name = json_string_value(json_object_get(file, "name"));
        uint64_t offset = (uint64_t)json_integer_value(json_object_get(file, "offset"));
        uint64_t size = (uint64_t)json_integer_value(json_object_get(file, "size"));
        if (!name || offset > work->spool.size_bytes || size > work->spool.size_bytes - offset)
            return error_set(err, ERROR_INTERNAL, "decoder: file %zu is not within the spool", i);
        work->files[i] =
            (struct scene_file){name, (const char *)work->spool.bytes + offset, (size_t)size};
    }
    return true;
}

static bool enter_cage(const struct decode_work *work, struct error *err)
{
    json_int_t memory = json_integer_value(json_object_get(work->job.json, "memory_bytes"));
    json_int_t timeout = json_integer_value(json_object_get(work->job.json, "timeout_s"));
    return sandbox_enter(&(struct sandbox_desc){.memory_bytes = (uint64_t)memory,
                                                .file_bytes = LIMIT_SCENE_BLOB_BYTES,
                                                .cpu_s = (int)timeout + 1},
                         err);
}

/* How the front wants the files to be read. */
static void read_reading(const struct decode_work *work, struct scene_import_desc *desc)
{
    const char *name = json_string_value(json_object_get(work->job.json, "format"));
    if (!name || !scene_format_from_name(name, &desc->format))
        desc->format = SCENE_FORMAT_GLTF;
    desc->unit_m = json_number_value(json_object_get(work->job.json, "unit_m"));
    desc->up = (char)json_integer_value(json_object_get(work->job.json, "up"));
    desc->deflection = json_number_value(json_object_get(work->job.json, "deflection"));
}

static bool is_scene(const struct decode_work *work)
{
    const char *kind = json_string_value(json_object_get(work->job.json, "kind"));
    return kind && strcmp(kind, "scene") == 0;
}

/* What reads the files is loaded before the cage forbids to load more: the converter of the format
 * by its name alone; and for an environment map the image library with its plugins and locales, by
 * an image of each format that it reads. Textures need nothing that is not linked. */
static bool prepare(const struct decode_work *work, struct error *err)
{
    struct scene_import_desc desc = {.files = work->files, .file_count = work->file_count};
    read_reading(work, &desc);
    if (!is_scene(work)) {
        warm_up_hdr();
        warm_up_exr();
    }
    return scene_import_prepare(desc.format, err);
}

/* What the import hands over on its way. */
struct outcome {
    int blob_fd, socket;
    struct scene_summary summary;
    int64_t reported_ms; /* when the front was sent the progress */
    int reported_stage;
};

static bool say(int socket, json_t *message);

/* Sends the progress to the front a few times a second. A front that does not read it is no reason
 * to end. */
static void report_stage(struct outcome *outcome, int stage, double share)
{
    int64_t reported_ms = now_ms();
    if (stage == outcome->reported_stage && reported_ms - outcome->reported_ms < ADVANCE_MS)
        return;
    outcome->reported_ms = reported_ms;
    outcome->reported_stage = stage;
    say(outcome->socket, json_pack("{s:s,s:f}", "stage", upload_stage_name(stage), "share", share));
}

static void report_advance(void *context, enum scene_import_stage stage, double share)
{
    static const enum upload_stage stages[] = {
        [SCENE_IMPORT_CONVERSION] = UPLOAD_STAGE_CONVERSION,
        [SCENE_IMPORT_FILE] = UPLOAD_STAGE_FILE,
        [SCENE_IMPORT_MESHES] = UPLOAD_STAGE_MESHES,
        [SCENE_IMPORT_NODES] = UPLOAD_STAGE_NODES,
        [SCENE_IMPORT_IMAGES] = UPLOAD_STAGE_IMAGES,
    };
    report_stage(context, (int)stages[stage], share);
}

static bool add_scene(void *context, const char *name, bool is_shown, struct error *err)
{
    struct scene_summary *summary = &((struct outcome *)context)->summary;
    return scene_summary_add_file_scene(summary, name, is_shown, err);
}

static bool set_origin(void *context, const struct scene_origin *origin, struct error *err)
{
    struct scene_summary *summary = &((struct outcome *)context)->summary;
    (void)err;
    summary->source = *origin;
    return true;
}

static bool write_summary(const struct scene *scene, struct outcome *outcome, int fd,
                          struct error *err)
{
    struct scene_summary *summary = &outcome->summary;
    report_stage(outcome, UPLOAD_STAGE_OUTLINE, 0);
    if (!scene_summary_from_scene(scene, summary, err))
        return false;
    char *text = scene_summary_to_json_text(summary);
    bool is_good = text ? ipc_write_all(fd, text, strlen(text), err)
                        : error_set(err, ERROR_NO_MEMORY, "summary of the scene");
    free(text);
    return is_good;
}

static bool write_blob(void *context, uint64_t offset_bytes, const void *bytes, size_t size_bytes,
                       struct error *err)
{
    const struct outcome *outcome = context;
    if (!ipc_pwrite_all(outcome->blob_fd, bytes, size_bytes, offset_bytes, err))
        return error_wrap(err, "storing the scene");
    /* The disk begins while the next image is decoded; the front waits for it at the end. */
    (void)sync_file_range(outcome->blob_fd, (off_t)offset_bytes, (off_t)size_bytes,
                          SYNC_FILE_RANGE_WRITE);
    return true;
}

/* The last bytes may be a gap. */
static bool set_blob_size(int fd, uint64_t size_bytes, struct error *err)
{
    return ftruncate(fd, (off_t)size_bytes) == 0 ||
           error_set(err, ERROR_IO, "writing the scene: %s", strerror(errno));
}

/* Pixels go to the file as they are decoded; the rest of the blob comes last. */
static bool decode_scene(const struct decode_work *work, struct error *err)
{
    void *blob = NULL;
    size_t size_bytes = 0;
    struct scene scene;
    struct outcome outcome = {
        .blob_fd = work->job.fds[FD_BLOB], .socket = work->socket, .reported_stage = -1};
    struct scene_import_desc desc = {
        .files = work->files,
        .file_count = work->file_count,
        .max_blob_bytes = LIMIT_SCENE_BLOB_BYTES,
        .scene = json_string_value(json_object_get(work->job.json, "scene")),
        .tell_scene = add_scene,
        .tell_origin = set_origin,
        .write = write_blob,
        .advance = report_advance,
        .context = &outcome};
    read_reading(work, &desc);
    bool is_good =
        scene_import(&desc, &blob, &size_bytes, err) &&
        (scene_open_head(&scene, blob, size_bytes, err) || error_wrap(err, "the decoded scene")) &&
        write_summary(&scene, &outcome, work->job.fds[FD_SUMMARY], err) &&
        write_blob(&outcome, 0, blob, size_bytes, err) &&
        set_blob_size(outcome.blob_fd, scene.header->size_bytes, err);
    scene_summary_finish(&outcome.summary);
    free(blob);
    return is_good;
}

static bool decode_environment(const struct decode_work *work, struct error *err)
{
    return work->file_count == 1
               ? environment_job_run(&work->files[0], work->job.fds[FD_BLOB],
                                     work->job.fds[FD_SUMMARY], err)
               : error_set(err, ERROR_INTERNAL, "decoder: %zu files of an environment map",
                           work->file_count);
}

static bool decode(const struct decode_work *work, struct error *err)
{
    const char *kind = json_string_value(json_object_get(work->job.json, "kind"));
    if (kind && strcmp(kind, "environment") == 0)
        return decode_environment(work, err);
    return is_scene(work) ? decode_scene(work, err)
                          : error_set(err, ERROR_INTERNAL, "decoder: an unknown kind of upload");
}

/* Takes the reference. */
static bool say(int socket, json_t *message)
{
    bool is_sent = message && ipc_send(socket, message, NULL, 0, NULL);
    json_decref(message);
    return is_sent;
}

static bool answer(int socket, const struct error *problem)
{
    return say(socket, problem->code == ERROR_NONE
                           ? json_pack("{s:b}", "ok", 1)
                           : json_pack("{s:o}", "error", ipc_error_to_json(problem)));
}

int decoder_main(int socket)
{
    mallopt(M_ARENA_MAX, 1); /* one for each thread would take 64 MiB of the limit each */
    struct error problem = {0};
    struct decode_work work = {.socket = socket};
    if (ipc_receive(socket, &work.job, &problem) != IPC_MESSAGE ||
        !say(socket, json_pack("{s:b}", "began", 1)))
        return EXIT_FAILURE;
    if (work.job.fd_count != FD_COUNT)
        error_set(&problem, ERROR_INTERNAL, "decoder: %d descriptors instead of %d",
                  work.job.fd_count, FD_COUNT);
    else if (ipc_mapping_init(&work.spool, work.job.fds[FD_SPOOL], &problem) &&
             read_files(&work, &problem) && prepare(&work, &problem) &&
             enter_cage(&work, &problem) && !decode(&work, &problem))
        assert(problem.code != ERROR_NONE);
    bool is_answered = answer(socket, &problem);
    _exit(is_answered ? EXIT_SUCCESS : EXIT_FAILURE); /* no destructor may trip over the cage */
}
