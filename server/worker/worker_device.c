/* SPDX-License-Identifier: MIT */
/* The device's speed and observations: read or measured at the start, kept after frames. */
#include "server/worker/worker_device.h"

#include <stdlib.h>

#include "protocol/utf8.h"
#include "renderer/base/wall_clock.h"
#include "server/base/config.h"
#include "server/mapping/auto_mapping.h"
#include "server/mapping/lesson_mapping.h"
#include "server/mapping/observations_file.h"
#include "server/mapping/view_mapping.h"
#include "server/worker/device_speed.h"
#include "server/worker/speed_file.h"

/* So much of a long motion's lessons is lost with a process that is killed. */
static const double LOOK_EVERY_MS = 10000;

static const char *path_of(const json_t *settings, const char *member)
{
    const char *path = json_string_value(json_object_get(settings, member));
    return path ? path : "";
}

/* Reads what an earlier start has learned of this device. */
static void read_observations(struct worker_device *device)
{
    char key[SPEED_KEY_BYTES];
    struct learning *learned = malloc(sizeof *learned);
    utf8_copy(device->observations_path, sizeof device->observations_path,
              path_of(device->settings, "observations_file"));
    speed_file_make_key(device->renderer, key);
    if (learned && *device->observations_path &&
        observations_file_load(learned, device->observations_path, key))
        renderer_set_learned(device->renderer, learned);
    free(learned);
    device->observations_print = worker_device_learned(device);
}

void worker_device_follow(struct worker_device *device)
{
    if (!device->keeps && device->automatic.policy == AUTO_MEASURED)
        read_observations(device);
}

json_t *worker_device_take_lessons(struct worker_device *device)
{
    struct frame_lesson lesson;
    json_t *lessons = NULL;
    while (!device->keeps && renderer_take_lesson(device->renderer, &lesson)) {
        lessons = lessons ? lessons : json_array();
        json_array_append_new(lessons, lesson_to_json(&lesson));
    }
    return lessons;
}

void worker_device_learn(struct worker_device *device, const json_t *lessons)
{
    struct frame_lesson lesson;
    const json_t *one;
    size_t index;
    if (!device->keeps || device->automatic.policy != AUTO_MEASURED)
        return;
    json_array_foreach(lessons, index, one) if (lesson_from_json(one, &lesson))
        renderer_learn(device->renderer, &lesson);
}

static struct device_speed_desc speed_desc(const struct worker_device *device)
{
    return (struct device_speed_desc){.renderer = device->renderer,
                                      .path = path_of(device->settings, "speed_file")};
}

static void set_auto(struct worker_device *device)
{
    device->is_pending = false;
    renderer_set_auto(device->renderer, &device->automatic);
    if (device->automatic.policy == AUTO_MEASURED)
        read_observations(device);
}

void worker_device_measure(struct worker_device *device)
{
    struct error problem = {0};
    struct device_speed_desc desc = speed_desc(device);
    if (!device->keeps)
        desc.path = "";
    device->auto_note[0] = 0;
    if (!device_speed_measure(&device->automatic.speed, &desc, device->auto_note, &problem)) {
        /* no failure: auto is rasterised there */
        device->automatic = (struct auto_settings){.policy = AUTO_RASTER};
        utf8_copy(device->auto_note, sizeof device->auto_note, problem.message);
    }
    set_auto(device);
}

static void find_speed(struct worker_device *device)
{
    struct renderer_info info;
    const struct device_speed_desc desc = speed_desc(device);
    json_int_t policy = json_integer_value(json_object_get(device->settings, "auto"));
    renderer_get_info(device->renderer, &info);
    device->automatic.policy = (enum auto_policy)policy;
    if (policy != AUTO_MEASURED ||
        device_speed_recall(&device->automatic.speed, &desc, device->auto_note)) {
        set_auto(device);
    } else if (info.is_software) {
        device->is_pending = true;
        utf8_copy(device->auto_note, sizeof device->auto_note,
                  "measured before the first picture that goes by it, or for want of something to "
                  "do");
    } else {
        worker_device_measure(device);
    }
}

/* Processors take a block apart for each sample, and compile a program for each format to find that
 * out: they are not measured. */
static void find_texture_speed(struct worker_device *device, struct texture_speed *speed)
{
    struct error problem = {0};
    struct renderer_info info;
    char *note = device->blocks.note;
    renderer_get_info(device->renderer, &info);
    const struct device_speed_desc desc = {.renderer = device->renderer,
                                           .path = path_of(device->settings, "texture_file")};
    if (info.is_software)
        utf8_copy(note, sizeof device->blocks.note, "not measured: software gains nothing by them");
    else if (!texture_speed_find(speed, &desc, note, &problem))
        utf8_copy(note, sizeof device->blocks.note, problem.message);
}

/* A device that cannot be measured withholds levels. */
static void set_compression(struct worker_device *device)
{
    json_int_t policy =
        json_integer_value(json_object_get(device->settings, "texture_compression"));
    struct texture_speed speed = {0};
    struct device_blocks *blocks = &device->blocks;
    utf8_copy(blocks->policy, sizeof blocks->policy,
              config_compression_name((enum config_compression)policy));
    if (policy == CONFIG_COMPRESSION_AUTO)
        find_texture_speed(device, &speed);
    blocks->from_levels = policy == CONFIG_COMPRESSION_ON ? 1
                          : texture_speed_gains(&speed)   ? TEXTURE_SPEED_AUTO_LEVELS
                                                          : 0;
    if (!renderer_samples_blocks(device->renderer))
        blocks->from_levels = 0;
    device_blocks_from_speed(&speed, blocks);
    renderer_set_texture_compression(device->renderer, (uint32_t)blocks->from_levels);
}

void worker_device_init(struct worker_device *device, struct renderer *renderer,
                        const json_t *settings)
{
    device->renderer = renderer;
    device->settings = json_deep_copy(settings);
    device->keeps = json_is_true(json_object_get(settings, "keeps"));
    find_speed(device);
    set_compression(device);
}

void worker_device_finish(struct worker_device *device)
{
    json_decref(device->settings);
    device->settings = NULL;
}

void worker_device_describe(const struct worker_device *device,
                            struct device_capabilities *capabilities)
{
    device_auto_from_settings(&device->automatic, &capabilities->automatic);
    capabilities->automatic.is_pending = device->is_pending;
    utf8_copy(capabilities->automatic.note, sizeof capabilities->automatic.note, device->auto_note);
    capabilities->blocks = device->blocks;
}

uint64_t worker_device_learned(const struct worker_device *device)
{
    uint64_t print;
    (void)renderer_get_learned(device->renderer, &print);
    return print;
}

void worker_device_keep_observations(struct worker_device *device, bool is_in_motion)
{
    char key[SPEED_KEY_BYTES];
    struct error unsaved = {0};
    uint64_t print;
    if (is_in_motion && wall_ms() < device->looked_ms + LOOK_EVERY_MS)
        return;
    device->looked_ms = wall_ms();
    const struct learning *learned = renderer_get_learned(device->renderer, &print);
    if (print == device->observations_print || !device->observations_path[0] || !learned ||
        !device->keeps)
        return;
    device->observations_print = print;
    speed_file_make_key(device->renderer, key);
    (void)!observations_file_save(learned, device->observations_path, key, &unsaved);
}
