/* SPDX-License-Identifier: MIT */
/* The speed of a device, as it is measured or was before. */
#include "server/worker/device_speed.h"

#include <stdio.h>

#include "protocol/utf8.h"
#include "server/worker/speed_file.h"

static const struct speed_member device_members[] = {
    {"frame_ms", offsetof(struct device_speed, frame_ms)},
    {"shade", offsetof(struct device_speed, shade)},
    {"maps", offsetof(struct device_speed, maps)},
    {"trace", offsetof(struct device_speed, trace)},
    {"build", offsetof(struct device_speed, build)},
};
static const struct speed_members device_numbers = {device_members, sizeof device_members /
                                                                        sizeof device_members[0]};

static const struct speed_member texture_members[] = {
    {"whole_ns", offsetof(struct texture_speed, whole_ns)},
    {"bc1_ns", offsetof(struct texture_speed, bc1_ns)},
    {"bc3_ns", offsetof(struct texture_speed, bc3_ns)},
    {"encode_bytes_per_ms", offsetof(struct texture_speed, encode_bytes_per_ms)},
};
static const struct speed_members texture_numbers = {
    texture_members, sizeof texture_members / sizeof texture_members[0]};

bool device_speed_load(struct device_speed *speed, const char *path, const char *key)
{
    return speed_file_load(speed, &device_numbers, path, key);
}

bool device_speed_save(const struct device_speed *speed, const char *path, const char *key,
                       struct error *err)
{
    return speed_file_save(speed, &device_numbers, path, key, err);
}

static void note_earlier(char note[CAPABILITIES_TEXT_BYTES])
{
    snprintf(note, CAPABILITIES_TEXT_BYTES, "measured at an earlier start");
}

/* unsaved: why not, where the numbers were to be kept and are not. */
static void note_now(char note[CAPABILITIES_TEXT_BYTES], double elapsed_ms,
                     const struct error *unsaved)
{
    bool is_lost = unsaved->code != ERROR_NONE;
    snprintf(note, CAPABILITIES_TEXT_BYTES, "measured at this start in %.0f ms%s%.120s", elapsed_ms,
             is_lost ? ", and not kept: " : "", is_lost ? unsaved->message : "");
}

bool device_speed_recall(struct device_speed *speed, const struct device_speed_desc *desc,
                         char note[CAPABILITIES_TEXT_BYTES])
{
    char key[SPEED_KEY_BYTES];
    speed_file_make_key(desc->renderer, key);
    bool is_kept = device_speed_load(speed, desc->path, key);
    if (is_kept)
        note_earlier(note);
    return is_kept;
}

bool device_speed_measure(struct device_speed *speed, const struct device_speed_desc *desc,
                          char note[CAPABILITIES_TEXT_BYTES], struct error *err)
{
    char key[SPEED_KEY_BYTES];
    struct calibration calibration;
    struct error unsaved = {0};
    speed_file_make_key(desc->renderer, key);
    if (!renderer_calibrate(desc->renderer, &calibration, err))
        return false;
    *speed = calibration.speed;
    if (desc->path[0])
        (void)!device_speed_save(speed, desc->path, key, &unsaved); /* the note says so */
    note_now(note, calibration.elapsed_ms, &unsaved);
    return true;
}

bool texture_speed_find(struct texture_speed *speed, const struct device_speed_desc *desc,
                        char note[CAPABILITIES_TEXT_BYTES], struct error *err)
{
    char key[SPEED_KEY_BYTES];
    double elapsed_ms = 0;
    struct error unsaved = {0};
    speed_file_make_key(desc->renderer, key);
    if (speed_file_load(speed, &texture_numbers, desc->path, key)) {
        note_earlier(note);
        return true;
    }
    if (!texture_speed_measure(desc->renderer, speed, &elapsed_ms, err))
        return false;
    if (!texture_speed_is_known(speed)) {
        utf8_copy(note, CAPABILITIES_TEXT_BYTES, "the device samples no compressed textures");
        return true;
    }
    if (desc->path[0])
        (void)!speed_file_save(speed, &texture_numbers, desc->path, key, &unsaved);
    note_now(note, elapsed_ms, &unsaved);
    return true;
}
