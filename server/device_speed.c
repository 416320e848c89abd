/* SPDX-License-Identifier: MIT */
/* A small JSON file beside the compiled shaders. */
#include "server/device_speed.h"

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/build_id.h"
#include "server/processor.h"

enum { KEY_BYTES = 1024 };

struct member {
    const char *name;
    size_t offset;
};
static const struct member members[] = {
    {"frame_ms", offsetof(struct device_speed, frame_ms)},
    {"shade", offsetof(struct device_speed, shade)},
    {"maps", offsetof(struct device_speed, maps)},
    {"trace", offsetof(struct device_speed, trace)},
    {"build", offsetof(struct device_speed, build)},
};
enum { MEMBERS = sizeof members / sizeof members[0] };

/* All that may change the speed but what else runs on the machine. */
static void make_key(struct renderer *renderer, char key[KEY_BYTES])
{
    struct renderer_info info;
    char processor[PROCESSOR_NAME_BYTES], build[BUILD_ID_BYTES];
    const char *threads = getenv("LP_NUM_THREADS");
    renderer_get_info(renderer, &info);
    processor_get_name(processor);
    build_id_get(build);
    snprintf(key, KEY_BYTES, "%s|%s|%s|%s|%ld|%s|%s", info.vendor, info.renderer, info.version,
             processor, sysconf(_SC_NPROCESSORS_ONLN), threads ? threads : "", build);
}

bool device_speed_load(struct device_speed *speed, const char *path, const char *key)
{
    json_t *json = json_load_file(path, 0, NULL);
    const char *stored = json_string_value(json_object_get(json, "key"));
    bool is_good = stored && strcmp(stored, key) == 0;
    for (int i = 0; i < MEMBERS && is_good; i++) {
        double value = json_number_value(json_object_get(json, members[i].name));
        is_good = value > 0 && value < 1e6;
        memcpy((char *)speed + members[i].offset, &value, sizeof value);
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

bool device_speed_save(const struct device_speed *speed, const char *path, const char *key,
                       struct error *err)
{
    char draft[4096 + 16];
    json_t *json = json_pack("{s:s}", "key", key);
    bool is_good = json != NULL;
    for (int i = 0; i < MEMBERS && is_good; i++) {
        double value;
        memcpy(&value, (const char *)speed + members[i].offset, sizeof value);
        is_good = json_object_set_new(json, members[i].name, json_real(value)) == 0;
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

bool device_speed_find(struct device_speed *speed, const struct device_speed_desc *desc,
                       char note[CAPABILITIES_TEXT_BYTES], struct error *err)
{
    char key[KEY_BYTES];
    struct calibration calibration;
    struct error unsaved = {0};
    make_key(desc->renderer, key);
    if (device_speed_load(speed, desc->path, key)) {
        snprintf(note, CAPABILITIES_TEXT_BYTES, "measured at an earlier start");
        return true;
    }
    if (!renderer_calibrate(desc->renderer, &calibration, err))
        return false;
    *speed = calibration.speed;
    bool is_kept = desc->path[0] && device_speed_save(speed, desc->path, key, &unsaved);
    snprintf(note, CAPABILITIES_TEXT_BYTES, "measured at this start in %.0f ms%s%.120s",
             calibration.elapsed_ms,
             is_kept || !desc->path[0] ? "" : ", and not kept: ", is_kept ? "" : unsaved.message);
    return true;
}
