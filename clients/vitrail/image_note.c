/* SPDX-License-Identifier: MIT */
/* A request is kept as canonical text, so that equal requests have equal notes. */
#include "clients/vitrail/image_note.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/vitrail/json_text.h"
#include "clients/vitrail/resource.h"
#include "protocol/provenance_file.h"

static char *note_path(const char *path)
{
    char *note = NULL;
    return asprintf(&note, "%s.json", path) < 0 ? NULL : note;
}

static char *canonical(const json_t *request)
{
    return json_dumps(request, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
}

/* The different techniques of the frame's passes, in their order. */
static json_t *techniques_of(const json_t *frame)
{
    json_t *found = json_array();
    const json_t *pass, *known;
    size_t i, k;
    json_array_foreach(json_object_get(frame, "plan"), i, pass)
    {
        json_t *technique = json_object_get(pass, "technique");
        bool is_new = json_is_string(technique);
        json_array_foreach(found, k, known) is_new = is_new && !json_equal(known, technique);
        if (is_new)
            json_array_append(found, technique);
    }
    return found;
}

json_t *image_note_make(const char *sha256, const json_t *request, const json_t *frame,
                        const char *version, struct failure *failure)
{
    char *text = canonical(request);
    json_t *note =
        text ? json_pack("{s:s,s:s,s:O*,s:s,s:O*,s:o,s:O*,s:O*,s:O*}", "sha256", sha256, "request",
                         text, "scene", json_object_get(request, "scene"), "version", version,
                         "device", json_object_get(frame, "device"), "techniques",
                         techniques_of(frame), "chosen", json_object_get(frame, "chosen"), "error",
                         json_object_get(frame, "error"), "frame", json_object_get(frame, "id"))
             : NULL;
    free(text);
    if (!note)
        fail_no_memory(failure);
    return note;
}

bool image_note_write(struct session *session, const char *path, const json_t *request,
                      const json_t *frame, const char *version, struct failure *failure)
{
    struct output_file file = {0};
    char sha256[SCENE_ID_BYTES];
    char *name = note_path(path);
    json_t *note = NULL;
    bool is_ok = (name || fail_no_memory(failure)) &&
                 resource_hash(session, path, sha256, failure) &&
                 (note = image_note_make(sha256, request, frame, version, failure)) &&
                 output_file_open(&file, name, failure) && json_write(note, &file, failure) &&
                 output_file_commit(&file, failure);
    output_file_finish(&file);
    json_decref(note);
    free(name);
    return is_ok;
}

json_t *image_note_read(const char *path, struct failure *failure)
{
    json_error_t where;
    char *name = note_path(path);
    json_t *note = name ? json_load_file(name, 0, &where) : NULL;
    if (name && !note)
        fail(failure, EXIT_CODE_NO_INPUT,
             "'%s' has no note '%s' that can be read: render with --note to have one", path, name);
    if (!name)
        fail_no_memory(failure);
    free(name);
    return note;
}

/* The provenance inside an image file; NULL: it has none. */
static json_t *read_provenance(const char *path)
{
    struct stat info;
    const char *text;
    size_t length;
    json_t *found = NULL;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    bool is_file = fd >= 0 && fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_size > 0;
    void *bytes =
        is_file ? mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    if (bytes != MAP_FAILED) {
        if (provenance_find(bytes, (size_t)info.st_size, &text, &length))
            found = json_loadb(text, length, 0, NULL);
        munmap(bytes, (size_t)info.st_size);
    }
    if (fd >= 0)
        close(fd);
    return found;
}

/* Takes the provenance. */
static json_t *note_of_provenance(json_t *found, struct failure *failure)
{
    static const char vitrail[] = "Vitrail ";
    const char *software = json_string_value(json_object_get(found, "software"));
    char *request = canonical(json_object_get(found, "request"));
    bool is_ours = request && software && !strncmp(software, vitrail, sizeof vitrail - 1);
    json_t *note =
        is_ours
            ? json_pack("{s:s,s:O*,s:s,s:O*,s:O*,s:O*}", "request", request, "scene",
                        json_object_get(found, "scene"), "version", software + sizeof vitrail - 1,
                        "device", json_object_get(found, "device"), "error",
                        json_object_get(found, "error"), "tiles", json_object_get(found, "tiles"))
            : NULL;
    if (is_ours && !note)
        fail_no_memory(failure);
    else if (!is_ours)
        fail(failure, EXIT_CODE_NO_INPUT,
             "the provenance in the image has no request: where one is too long for the file, "
             "'vitrail render --note' keeps it beside the image");
    free(request);
    json_decref(found);
    return note;
}

json_t *image_note_find(const char *path, struct failure *failure)
{
    struct failure no_note = {0};
    json_t *note = image_note_read(path, &no_note);
    json_t *inside = note ? NULL : read_provenance(path);
    if (inside)
        return note_of_provenance(inside, failure);
    if (!note)
        fail(failure, EXIT_CODE_NO_INPUT,
             "'%s' holds no provenance of a vitrail server, and no note '%s.json' that can be "
             "read is beside it",
             path, path);
    return note;
}

bool image_note_matches(struct session *session, const char *path, const json_t *request)
{
    struct failure ignored = {0};
    char sha256[SCENE_ID_BYTES];
    json_t *note = image_note_read(path, &ignored);
    char *text = note ? canonical(request) : NULL;
    const char *of_image = json_string_value(json_object_get(note, "sha256"));
    const char *of_request = json_string_value(json_object_get(note, "request"));
    struct failure other = {0};
    bool is_there = text && of_image && of_request && !strcmp(of_request, text) &&
                    resource_hash(session, path, sha256, &other) && !strcmp(sha256, of_image);
    json_decref(note);
    free(text);
    return is_there;
}

void image_note_version(struct session *session, char *version, size_t capacity)
{
    struct failure ignored = {0};
    json_t *capabilities =
        session_get_json(session, "/v1/capabilities", "the capabilities", &ignored);
    const char *text = json_string_value(json_object_get(capabilities, "version"));
    snprintf(version, capacity, "%s", text ? text : "");
    json_decref(capabilities);
}
