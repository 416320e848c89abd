/* SPDX-License-Identifier: MIT */
/* Uploads: the body's pieces go to the spool file and the digest, part by part. */
#include "server/front/upload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/utf8.h"
#include "server/base/ipc.h"
#include "server/http/multipart.h"
#include "server/http/negotiate.h"

enum { FILE_ALIGNMENT = 16 /* readers may map the spool and read words */ };

struct upload {
    enum resource_kind kind;
    int fd;
    struct digest *digest;
    struct multipart *multipart; /* NULL when the body is the file */
    bool must_be_glb;            /* unless the request says that it is something else */
    struct upload_reading reading;
    uint64_t end_bytes; /* of the spool */
    struct upload_file *files;
    size_t count, capacity;
    char magic[10]; /* first bytes of the body */
    char *name;     /* owned; what it is to be called, NULL: as its file */
    char *scene;    /* owned; which of the file, NULL: its own choice */
};

static bool spool_write(struct upload *upload, const void *bytes, size_t size_bytes,
                        struct error *err)
{
    digest_write(upload->digest, bytes, size_bytes);
    if (!ipc_pwrite_all(upload->fd, bytes, size_bytes, upload->end_bytes, err))
        return error_wrap(err, "storing the upload");
    upload->end_bytes += size_bytes;
    return true;
}

/* ---- names ---- */

/* A part's file name: a filename with folders wins; else a name that looks like a path; else the
 * filename. curl and browsers strip folders from filenames, so the name is where they survive. */
static const char *choose_name(const struct multipart_part *part)
{
    if (strchr(part->filename, '/') || !part->name[0])
        return part->filename;
    if (strpbrk(part->name, "/.") || !part->filename[0])
        return part->name;
    return part->filename;
}

/* A segment that is empty (also before a leading slash), "." or "..". */
static bool has_bad_segment(const char *name)
{
    for (;;) {
        size_t length = strcspn(name, "/");
        if (length == 0 || (length == 1 && name[0] == '.') ||
            (length == 2 && memcmp(name, "..", 2) == 0))
            return true;
        if (!name[length])
            return false;
        name += length + 1;
    }
}

static bool check_name(const char *name, struct error *err)
{
    size_t length = strlen(name);
    if (length == 0)
        return error_set(err, ERROR_INVALID_REQUEST, "multipart: a file has no name");
    if (length > LIMIT_FILE_NAME_BYTES)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: a file name has more than %d bytes", LIMIT_FILE_NAME_BYTES);
    for (const char *at = name; *at; at += utf8_sequence_bytes(at)) {
        if (utf8_sequence_bytes(at) == 0)
            return error_set(err, ERROR_INVALID_REQUEST, "multipart: a file name is not UTF-8");
        if ((unsigned char)*at < 0x20 || *at == 0x7f || *at == '\\')
            return error_set(err, ERROR_INVALID_REQUEST,
                             "multipart: file name with a control character or backslash");
    }
    if (has_bad_segment(name))
        return error_set(
            err, ERROR_INVALID_REQUEST,
            "multipart: file name '%.200s' is not a plain relative path (no '..', no leading '/')",
            name);
    return true;
}

/* ---- files ---- */

static bool add_file(struct upload *upload, const char *name, struct error *err)
{
    if (upload->count >= LIMIT_UPLOAD_FILES)
        return error_set(err, ERROR_TOO_LARGE, "multipart: more than %d files", LIMIT_UPLOAD_FILES);
    for (size_t i = 0; i < upload->count; i++)
        if (strcmp(upload->files[i].name, name) == 0)
            return error_set(err, ERROR_INVALID_REQUEST, "multipart: file '%.200s' comes twice",
                             name);
    if (upload->count == upload->capacity) {
        size_t capacity = upload->capacity ? 2 * upload->capacity : 8;
        struct upload_file *files = realloc(upload->files, capacity * sizeof *files);
        if (!files)
            return error_set(err, ERROR_NO_MEMORY, "upload of %zu files", capacity);
        upload->files = files;
        upload->capacity = capacity;
    }
    upload->end_bytes = (upload->end_bytes + FILE_ALIGNMENT - 1) / FILE_ALIGNMENT * FILE_ALIGNMENT;
    struct upload_file *file = &upload->files[upload->count];
    *file = (struct upload_file){.name = strdup(name), .offset_bytes = upload->end_bytes};
    if (!file->name)
        return error_set(err, ERROR_NO_MEMORY, "upload");
    upload->count++;
    return true;
}

static void end_file(struct upload *upload)
{
    struct upload_file *file = &upload->files[upload->count - 1];
    file->size_bytes = upload->end_bytes - file->offset_bytes;
    digest_end(upload->digest, file->sha256);
}

static bool on_part(void *context, const struct multipart_part *part, struct error *err)
{
    const char *name = choose_name(part);
    while (strncmp(name, "./", 2) == 0)
        name += 2;
    return check_name(name, err) && add_file(context, name, err);
}

static bool on_data(void *context, const void *bytes, size_t size_bytes, struct error *err)
{
    return spool_write(context, bytes, size_bytes, err);
}

static bool on_part_end(void *context, struct error *err)
{
    (void)err;
    end_file(context);
    return true;
}

/* ---- format ---- */

/* Whether it is the media type of a format, which is noted. */
static bool take_media_type(struct upload *upload, const char *content_type)
{
    for (int i = 0; i < SCENE_FORMAT_COUNT; i++) {
        char types[80] = "", *rest = types;
        const char *all = scene_format_describe((enum scene_format)i)->media_types;
        snprintf(types, sizeof types, "%s", all ? all : "");
        for (char *type; (type = strsep(&rest, " "));)
            if (*type && negotiate_is_type(content_type, type)) {
                upload->reading.format = (enum scene_format)i;
                return true;
            }
    }
    return false;
}

/* Of several files the glTF is the scene, else the first of another format. */
static const struct upload_file *find_scene(const struct upload *upload, enum scene_format *format)
{
    const struct upload_file *found = NULL;
    for (size_t i = 0; i < upload->count; i++) {
        enum scene_format own;
        if (!scene_format_of_file(upload->files[i].name, &own))
            continue;
        if (own == SCENE_FORMAT_GLTF || !found) {
            found = &upload->files[i];
            *format = own;
        }
        if (own == SCENE_FORMAT_GLTF)
            break;
    }
    return found;
}

static bool settle_format(struct upload *upload, struct error *err)
{
    struct upload_reading *reading = &upload->reading;
    bool is_glb = memcmp(upload->magic, "glTF", 4) == 0;
    if (upload->multipart && !reading->has_format)
        find_scene(upload, &reading->format);
    if (upload->must_be_glb && !reading->has_format && !is_glb)
        return error_set(err, ERROR_UNSUPPORTED_MEDIA_TYPE,
                         "application/octet-stream is taken for binary glTF, but this is none; "
                         "?format= names another format");
    if (reading->format == SCENE_FORMAT_GLTF && (reading->unit_m > 0 || reading->up))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "?%s= is for other formats: glTF is in metres, with +Y up",
                         reading->unit_m > 0 ? "unit" : "up");
    return reading->deflection == 0 || scene_format_takes_deflection(reading->format) ||
           error_set(err, ERROR_INVALID_REQUEST,
                     "?deflection= is for STEP and IGES, whose surfaces become triangles; %s has "
                     "its own",
                     scene_format_describe(reading->format)->title);
}

/* ---- life ---- */

static bool choose_map_reader(struct upload *upload, const char *content_type, struct error *err)
{
    static const char *const types[] = {"image/vnd.radiance", "image/x-exr",
                                        "application/octet-stream"};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (negotiate_is_type(content_type, types[i]))
            return add_file(upload, "", err);
    return error_set(err, ERROR_UNSUPPORTED_MEDIA_TYPE,
                     "Content-Type '%.80s': an environment map is image/vnd.radiance, image/x-exr "
                     "or application/octet-stream",
                     content_type ? content_type : "");
}

static bool choose_scene_reader(struct upload *upload, const char *content_type, struct error *err)
{
    upload->must_be_glb = negotiate_is_type(content_type, "application/octet-stream");
    if (negotiate_is_type(content_type, "multipart/form-data")) {
        upload->multipart = multipart_create(
            content_type,
            &(struct multipart_events){
                .context = upload, .begin_part = on_part, .data = on_data, .end_part = on_part_end},
            err);
        return upload->multipart != NULL;
    }
    if (!upload->must_be_glb && !take_media_type(upload, content_type))
        return error_set(err, ERROR_UNSUPPORTED_MEDIA_TYPE,
                         "Content-Type '%.80s': a scene is model/gltf-binary, model/gltf+json, "
                         "multipart/form-data, or application/octet-stream with ?format=",
                         content_type ? content_type : "");
    bool is_json = negotiate_is_type(content_type, "model/gltf+json");
    /* The importer tells JSON by its name. */
    return add_file(upload, is_json ? "scene.gltf" : "", err);
}

struct upload *upload_create(enum resource_kind kind, const char *content_type, int spool_fd,
                             struct error *err)
{
    bool (*choose_reader)(struct upload * upload, const char *content_type, struct error *err) =
        kind == RESOURCE_SCENE ? choose_scene_reader : choose_map_reader;
    struct upload *upload = calloc(1, sizeof *upload);
    if (!upload) {
        close(spool_fd);
        error_set(err, ERROR_NO_MEMORY, "upload");
        return NULL;
    }
    upload->kind = kind;
    upload->fd = spool_fd;
    upload->digest = digest_create(err);
    if (!upload->digest || !choose_reader(upload, content_type, err)) {
        upload_destroy(upload);
        return NULL;
    }
    return upload;
}

void upload_destroy(struct upload *upload)
{
    if (!upload)
        return;
    for (size_t i = 0; i < upload->count; i++)
        free(upload->files[i].name);
    free(upload->files);
    free(upload->name);
    free(upload->scene);
    multipart_destroy(upload->multipart);
    digest_destroy(upload->digest);
    close(upload->fd);
    free(upload);
}

bool upload_write(void *context, const void *bytes, size_t size_bytes, struct error *err)
{
    struct upload *upload = context;
    if (upload->multipart)
        return multipart_write(upload->multipart, bytes, size_bytes, err);
    for (size_t i = 0; i < size_bytes && upload->end_bytes + i < sizeof upload->magic; i++)
        upload->magic[upload->end_bytes + i] = ((const char *)bytes)[i];
    return spool_write(upload, bytes, size_bytes, err);
}

static int compare_names(const void *left, const void *right)
{
    const struct upload_file *const *a = left, *const *b = right;
    return strcmp((*a)->name, (*b)->name);
}

static bool digest_manifest(struct upload *upload, char id[DIGEST_TEXT_BYTES], struct error *err)
{
    const struct upload_file **sorted = calloc(upload->count, sizeof(const struct upload_file *));
    if (!sorted)
        return error_set(err, ERROR_NO_MEMORY, "manifest of the upload");
    for (size_t i = 0; i < upload->count; i++)
        sorted[i] = &upload->files[i];
    qsort(sorted, upload->count, sizeof(const struct upload_file *), compare_names);
    digest_write(upload->digest, "vitrail-scene-1\n", 16);
    for (size_t i = 0; i < upload->count; i++) {
        char line[DIGEST_TEXT_BYTES + LIMIT_FILE_NAME_BYTES + 32];
        int length = snprintf(line, sizeof line, "%s %llu %s\n", sorted[i]->sha256,
                              (unsigned long long)sorted[i]->size_bytes, sorted[i]->name);
        digest_write(upload->digest, line, (size_t)length);
    }
    free(sorted);
    digest_end(upload->digest, id);
    return true;
}

/* Of one scene of what has the id. */
static void digest_scene(struct upload *upload, char id[DIGEST_TEXT_BYTES])
{
    digest_write(upload->digest, "vitrail-scene-of-1\n", 19);
    digest_write(upload->digest, id, DIGEST_TEXT_BYTES - 1);
    digest_write(upload->digest, " ", 1);
    digest_write(upload->digest, upload->scene, strlen(upload->scene));
    digest_write(upload->digest, "\n", 1);
    digest_end(upload->digest, id);
}

/* By the first bytes, where the type of the body leaves that open. */
static bool check_magic(const struct upload *upload, struct error *err)
{
    return upload->kind == RESOURCE_SCENE || upload->end_bytes == 0 ||
           memcmp(upload->magic, "#?RADIANCE", 10) == 0 ||
           memcmp(upload->magic, "#?RGBE", 6) == 0 ||
           memcmp(upload->magic, "\x76\x2F\x31\x01", 4) == 0 ||
           error_set(err, ERROR_UNSUPPORTED_MEDIA_TYPE,
                     "an environment map is Radiance HDR or OpenEXR, and begins with '#?RADIANCE', "
                     "'#?RGBE' or 76 2F 31 01; this file does not");
}

/* Of what has the id, read in one of several ways. */
static void digest_reading(struct upload *upload, char id[DIGEST_TEXT_BYTES])
{
    const struct upload_reading *reading = &upload->reading;
    char line[DIGEST_TEXT_BYTES + 96], unit[32] = "-", deflection[32] = "";
    if (reading->unit_m > 0)
        snprintf(unit, sizeof unit, "%.9g", reading->unit_m);
    if (reading->deflection > 0)
        snprintf(deflection, sizeof deflection, " %.9g", reading->deflection);
    int length = snprintf(line, sizeof line, "vitrail-scene-as-1\n%s %s %s %c%s\n", id,
                          scene_format_describe(reading->format)->name, unit,
                          reading->up ? reading->up : '-', deflection);
    digest_write(upload->digest, line, (size_t)length);
    digest_end(upload->digest, id);
}

bool upload_end(struct upload *upload, char id[DIGEST_TEXT_BYTES], struct error *err)
{
    if (upload->multipart) {
        if (!multipart_end(upload->multipart, err))
            return false;
    } else {
        end_file(upload);
        if (!check_magic(upload, err))
            return false;
    }
    if (upload->kind == RESOURCE_SCENE && !settle_format(upload, err))
        return false;
    if (upload->count == 0)
        return error_set(err, ERROR_INVALID_REQUEST, "multipart: the body holds no file");
    if (upload_size_bytes(upload) == 0)
        return error_set(err, resource_info(upload->kind)->broken, "the upload is empty");
    if (upload->count == 1)
        memcpy(id, upload->files[0].sha256, DIGEST_TEXT_BYTES);
    else if (!digest_manifest(upload, id, err))
        return false;
    if (upload->scene)
        digest_scene(upload, id);
    if (upload->reading.format != SCENE_FORMAT_GLTF)
        digest_reading(upload, id);
    return true;
}

enum resource_kind upload_kind(const struct upload *upload)
{
    return upload->kind;
}

int upload_fd(const struct upload *upload)
{
    return upload->fd;
}

const struct upload_file *upload_files(const struct upload *upload, size_t *count)
{
    *count = upload->count;
    return upload->files;
}

uint64_t upload_size_bytes(const struct upload *upload)
{
    uint64_t total = 0;
    for (size_t i = 0; i < upload->count; i++)
        total += upload->files[i].size_bytes;
    return total;
}

bool upload_set_name(struct upload *upload, const char *name, struct error *err)
{
    free(upload->name);
    upload->name = strdup(name);
    return upload->name || error_set(err, ERROR_NO_MEMORY, "name of a scene");
}

bool upload_choose_scene(struct upload *upload, const char *scene, struct error *err)
{
    free(upload->scene);
    upload->scene = strdup(scene);
    return upload->scene || error_set(err, ERROR_NO_MEMORY, "name of a scene");
}

void upload_read_as(struct upload *upload, const struct upload_reading *reading)
{
    enum scene_format by_type = upload->reading.format;
    upload->reading = *reading;
    if (!reading->has_format)
        upload->reading.format = by_type;
}

const struct upload_reading *upload_reading(const struct upload *upload)
{
    return &upload->reading;
}

const char *upload_scene(const struct upload *upload)
{
    return upload->scene;
}

const char *upload_name(const struct upload *upload)
{
    if (upload->name)
        return upload->name;
    enum scene_format format;
    const struct upload_file *file = upload->multipart ? find_scene(upload, &format) : NULL;
    return file ? file->name : "";
}
