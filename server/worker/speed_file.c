/* SPDX-License-Identifier: MIT */
/* One object: the key, and the numbers by name. */
#include "server/worker/speed_file.h"

#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "renderer/base/processors.h"
#include "server/base/build_id.h"
#include "server/base/processor.h"

void speed_file_make_key(struct renderer *renderer, char key[SPEED_KEY_BYTES])
{
    struct renderer_info info;
    char processor[PROCESSOR_NAME_BYTES], build[BUILD_ID_BYTES];
    const char *threads = getenv("LP_NUM_THREADS");
    renderer_get_info(renderer, &info);
    processor_get_name(processor);
    build_id_get(build);
    snprintf(key, SPEED_KEY_BYTES, "%s|%s|%s|%s|%d|%s|%s", info.vendor, info.renderer, info.version,
             processor, processors_usable(), threads ? threads : "", build);
}

bool speed_file_load(void *numbers, const struct speed_members *members, const char *path,
                     const char *key)
{
    json_t *json = json_load_file(path, 0, NULL);
    const char *stored = json_string_value(json_object_get(json, "key"));
    bool is_good = stored && strcmp(stored, key) == 0;
    for (int i = 0; i < members->count && is_good; i++) {
        double value = json_number_value(json_object_get(json, members->members[i].name));
        is_good = value > 0 && value < 1e9;
        memcpy((char *)numbers + members->members[i].offset, &value, sizeof value);
    }
    json_decref(json);
    return is_good;
}

static void make_folder(const char *path)
{
    char folder[4096];
    const char *end = strrchr(path, '/');
    if (end && end > path && (size_t)(end - path) < sizeof folder) {
        memcpy(folder, path, (size_t)(end - path));
        folder[end - path] = '\0';
        mkdir(folder, 0700); /* what is wrong with it, opening the file will tell */
    }
}

bool speed_file_save(const void *numbers, const struct speed_members *members, const char *path,
                     const char *key, struct error *err)
{
    char draft[4096 + 16];
    json_t *json = json_pack("{s:s}", "key", key);
    bool is_good = json != NULL;
    for (int i = 0; i < members->count && is_good; i++) {
        double value;
        memcpy(&value, (const char *)numbers + members->members[i].offset, sizeof value);
        is_good = json_object_set_new(json, members->members[i].name, json_real(value)) == 0;
    }
    if (is_good) {
        make_folder(path);
        snprintf(draft, sizeof draft, "%s.draft", path);
        is_good = json_dump_file(json, draft, JSON_INDENT(1)) == 0 && rename(draft, path) == 0;
    }
    json_decref(json);
    return is_good ||
           error_set(err, ERROR_INTERNAL, "'%s' cannot be written: %s", path, strerror(errno));
}
