/* SPDX-License-Identifier: MIT */
/* Reading scene folders from disk, as the multipart upload of the HTTP API would bring them. */
#include "tests/support/import_support.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { FILES_MAX = 512, PATH_BYTES = 1024, FOLDER_DEPTH_MAX = 4 };

struct folder {
    struct scene_file files[FILES_MAX]; /* names and bytes are owned here */
    size_t count;
};

void *file_read(const char *path, size_t *size_bytes, struct error *err)
{
    FILE *file = fopen(path, "rb");
    struct stat status;
    if (!file || fstat(fileno(file), &status) != 0) {
        error_set(err, ERROR_NOT_FOUND, "cannot open '%s'", path);
        if (file)
            fclose(file);
        return NULL;
    }
    size_t size = (size_t)status.st_size;
    void *bytes = malloc(size + 1);
    bool is_read = bytes && fread(bytes, 1, size, file) == size;
    fclose(file);
    if (!is_read) {
        free(bytes);
        error_set(err, ERROR_IO, "cannot read '%s'", path);
        return NULL;
    }
    *size_bytes = size;
    return bytes;
}

static void folder_finish(struct folder *folder)
{
    for (size_t i = 0; i < folder->count; i++) {
        free((void *)(uintptr_t)folder->files[i].name);
        free((void *)(uintptr_t)folder->files[i].bytes);
    }
    free(folder);
}

static bool folder_add(struct folder *folder, const char *path, const char *name, struct error *err)
{
    if (folder->count == FILES_MAX)
        return error_set(err, ERROR_TOO_LARGE, "more than %d files", FILES_MAX);
    size_t size;
    void *bytes = file_read(path, &size, err);
    if (!bytes)
        return false;
    folder->files[folder->count++] =
        (struct scene_file){.name = strdup(name), .bytes = bytes, .size_bytes = size};
    return true;
}

static bool is_scene(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot && (strcasecmp(dot, ".gltf") == 0 || strcasecmp(dot, ".glb") == 0);
}

/* Every file below `path` but other scenes; names are relative to where it began. */
static bool folder_scan(struct folder *folder, const char *path, const char *prefix, int depth,
                        struct error *err)
{
    DIR *directory = opendir(path);
    if (!directory)
        return error_set(err, ERROR_NOT_FOUND, "cannot open '%s'", path);
    bool is_good = true;
    for (struct dirent *entry; is_good && (entry = readdir(directory));) {
        char child[PATH_BYTES], name[PATH_BYTES];
        struct stat status;
        if (entry->d_name[0] == '.' || is_scene(entry->d_name))
            continue;
        if (snprintf(child, sizeof child, "%s/%s", path, entry->d_name) >= PATH_BYTES ||
            snprintf(name, sizeof name, "%s%s", prefix, entry->d_name) >= PATH_BYTES - 1 ||
            stat(child, &status) != 0)
            is_good = error_set(err, ERROR_IO, "cannot name '%s'", entry->d_name);
        else if (S_ISREG(status.st_mode))
            is_good = folder_add(folder, child, name, err);
        else if (S_ISDIR(status.st_mode) && depth < FOLDER_DEPTH_MAX)
            is_good = folder_scan(folder, child, strcat(name, "/"), depth + 1, err);
    }
    closedir(directory);
    return is_good;
}

bool imported_scene_init(struct imported_scene *imported, const struct scene_file *files,
                         size_t file_count, struct error *err)
{
    memset(imported, 0, sizeof *imported);
    struct scene_import_desc desc = {.files = files, .file_count = file_count};
    if (!scene_import(&desc, &imported->blob, &imported->blob_bytes, err))
        return false;
    if (scene_open(&imported->scene, imported->blob, imported->blob_bytes, err))
        return true;
    imported_scene_finish(imported);
    return false;
}

void *glb_make(const char *json, const void *bin, size_t bin_bytes, size_t *size_bytes)
{
    size_t json_bytes = strlen(json), json_padded = (json_bytes + 3) / 4 * 4;
    size_t bin_padded = (bin_bytes + 3) / 4 * 4,
           size = 20 + json_padded + (bin ? 8 + bin_padded : 0);
    uint8_t *glb = calloc(1, size);
    if (!glb)
        abort();
    uint32_t head[5] = {0x46546C67, 2, (uint32_t)size, (uint32_t)json_padded, 0x4E4F534A};
    memcpy(glb, head, sizeof head);
    memset(glb + 20, ' ', json_padded);
    for (size_t i = 0; i < json_bytes; i++)
        glb[20 + i] = json[i] == '\'' ? '"' : (uint8_t)json[i];
    if (bin) {
        uint32_t chunk[2] = {(uint32_t)bin_padded, 0x004E4942};
        memcpy(glb + 20 + json_padded, chunk, sizeof chunk);
        memcpy(glb + 28 + json_padded, bin, bin_bytes);
    }
    *size_bytes = size;
    return glb;
}

bool imported_scene_make(struct imported_scene *imported, const char *json, const void *bin,
                         size_t bin_bytes, struct error *err)
{
    size_t size;
    void *glb = glb_make(json, bin, bin_bytes, &size);
    struct scene_file file = {.name = "", .bytes = glb, .size_bytes = size};
    bool is_done = imported_scene_init(imported, &file, 1, err);
    free(glb);
    return is_done;
}

void imported_scene_finish(struct imported_scene *imported)
{
    free(imported->blob);
    memset(imported, 0, sizeof *imported);
}

bool imported_scene_load(struct imported_scene *imported, const char *path, struct error *err)
{
    memset(imported, 0, sizeof *imported);
    struct folder *folder = calloc(1, sizeof *folder);
    if (!folder)
        return error_set(err, ERROR_NO_MEMORY, "folder");
    char parent[PATH_BYTES];
    snprintf(parent, sizeof parent, "%s", path);
    char *slash = strrchr(parent, '/');
    const char *name = slash ? slash + 1 : path;
    bool is_good = folder_add(folder, path, name, err);
    if (is_good && strcasecmp(strrchr(name, '.') ? strrchr(name, '.') : "", ".gltf") == 0) {
        if (slash)
            *slash = '\0';
        is_good = folder_scan(folder, slash ? parent : ".", "", 0, err);
    }
    is_good = is_good && imported_scene_init(imported, folder->files, folder->count, err);
    folder_finish(folder);
    return is_good;
}

bool imported_asset_load(struct imported_scene *imported, const char *path, struct error *err)
{
    char whole[PATH_BYTES];
    snprintf(whole, sizeof whole, "%s/%s", VITRAIL_ASSET_DIR, path);
    return imported_scene_load(imported, whole, err);
}

bool assets_are_present(void)
{
    struct stat status;
    if (stat(VITRAIL_ASSET_DIR, &status) == 0 && S_ISDIR(status.st_mode))
        return true;
    fprintf(stderr, "skipped: the asset folder %s is absent\n", VITRAIL_ASSET_DIR);
    return false;
}

bool scene_has_warning(const struct scene *scene, const char *text)
{
    for (uint32_t i = 0; i < scene->warning_count; i++)
        if (strstr(scene->strings + scene->warnings[i], text))
            return true;
    return false;
}
