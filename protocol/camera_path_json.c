/* SPDX-License-Identifier: MIT */
/* Reading and writing of paths of cameras. The cameras of keys are read as those of requests. */
#include <stdlib.h>
#include <string.h>

#include "protocol/camera_path.h"
#include "protocol/json_write.h"
#include "protocol/request_parts.h"

enum { KEYS_MIN = 2 };
static const double FOV_Y_DEG = 45;

static const char *interpolation_name(int interpolation)
{
    static const char *const names[] = {"smooth", "linear"};
    return interpolation >= 0 && interpolation < 2 ? names[interpolation] : NULL;
}

/* ---- reading ---- */

/* One of "frame" and "time_s", the same in all of a path. The first that is read tells which. */
static bool read_moment(const struct json_node *node, bool is_first, bool *is_timed, double *at)
{
    struct json_node frame = json_member(node, "frame"), time = json_member(node, "time_s");
    if (frame.value && time.value)
        return json_refuse(&time, ERROR_INVALID_REQUEST, "but frame says the moment already");
    if (!frame.value && !time.value)
        return json_refuse(&frame, ERROR_INVALID_REQUEST,
                           "must be there, or time_s: the moment of the key");
    if (is_first)
        *is_timed = time.value;
    if (*is_timed != (time.value != NULL))
        return json_refuse(time.value ? &time : &frame, ERROR_INVALID_REQUEST,
                           "but the keys before say %s", *is_timed ? "time_s" : "frame");
    return json_read_number(time.value ? &time : &frame, -LIMIT_PATH_MOMENT, LIMIT_PATH_MOMENT, at);
}

/* The moments of a path only go on. */
static bool read_next_moment(const struct json_node *node, const struct camera_path *path,
                             int before, bool *is_timed, double *at)
{
    if (!read_moment(node, before < 0, is_timed, at))
        return false;
    struct json_node member = json_member(node, *is_timed ? "time_s" : "frame");
    return before < 0 || *at > path->keys[before].at ||
           json_refuse(&member, ERROR_INVALID_REQUEST, "must be after that of key %d, %.17g",
                       before, path->keys[before].at);
}

static bool read_key(const struct json_node *node, struct camera_path *path, int index)
{
    static const char *const known[] = {"frame", "time_s",    "eye",          "target",
                                        "up",    "fov_y_deg", "ortho_height", NULL};
    struct request_camera camera = {.fov_y_deg = FOV_Y_DEG};
    struct camera_key *key = &path->keys[index];
    if (!json_expect_object(node, known) ||
        !read_next_moment(node, path, index - 1, &path->is_timed, &key->at) ||
        !request_read_look_at(node, &camera) || !request_read_lens(node, &camera))
        return false;
    memcpy(key->eye, camera.eye, sizeof key->eye);
    memcpy(key->target, camera.target, sizeof key->target);
    memcpy(key->up, camera.up, sizeof key->up);
    key->fov_y_deg = camera.fov_y_deg;
    key->ortho_height = camera.ortho_height;
    struct json_node height = json_member(node, "ortho_height");
    return index == 0 || (path->keys[0].ortho_height > 0) == (key->ortho_height > 0) ||
           json_refuse(&height, ERROR_INVALID_REQUEST,
                       "but key 0 has %s: all cameras of a path are of one kind",
                       path->keys[0].ortho_height > 0 ? "one" : "none");
}

static bool read_keys(const struct json_node *node, struct camera_path *path)
{
    size_t count = 0;
    if (!json_expect_present(node) || !json_expect_array(node, LIMIT_CAMERA_KEYS, &count))
        return false;
    if (count < KEYS_MIN)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must hold at least %d keys", KEYS_MIN);
    path->keys = calloc(count, sizeof *path->keys);
    if (!path->keys)
        return error_set(node->err, ERROR_NO_MEMORY, "keys of a camera");
    path->count = (int)count;
    for (int i = 0; i < path->count; i++) {
        struct json_node element = json_element(node, (size_t)i);
        if (!read_key(&element, path, i))
            return false;
    }
    return true;
}

bool camera_path_read(const struct json_node *node, struct camera_path *path)
{
    static const char *const known[] = {"keys", "interpolation", "closed", NULL};
    static const char *const moments[] = {"frame", "time_s", NULL};
    const struct json_choice interpolations = {.name = interpolation_name};
    int interpolation = CAMERA_INTERPOLATION_SMOOTH;
    *path = (struct camera_path){0};
    if (!node->value)
        return true;
    struct json_node keys = json_member(node, "keys"), closed = json_member(node, "closed");
    struct json_node how = json_member(node, "interpolation");
    if (!json_expect_object(node, known) || !read_keys(&keys, path) ||
        !json_read_choice(&how, &interpolations, &interpolation))
        return false;
    path->interpolation = (enum camera_interpolation)interpolation;
    path->is_closed = closed.value;
    bool is_timed = path->is_timed;
    return !closed.value ||
           (json_expect_object(&closed, moments) &&
            read_next_moment(&closed, path, path->count - 1, &is_timed, &path->closes_at));
}

void camera_path_finish(struct camera_path *path)
{
    free(path->keys);
    *path = (struct camera_path){0};
}

bool camera_path_check(const struct json_node *node, const struct camera_path *path,
                       const struct frame_list *frames, double frame_rate)
{
    for (size_t i = 0; path->count > 0 && i < frames->count; i++) {
        int frame = frames->numbers[i];
        const struct request_camera camera =
            camera_path_at(path, camera_path_moment(path, frame, frame_rate));
        const char *fault = request_look_at_fault(&camera);
        if (fault)
            return json_refuse(node, ERROR_INVALID_REQUEST, "at frame %d the camera's %s", frame,
                               fault);
    }
    return true;
}

bool camera_path_load(json_t *json, const struct frame_list *frames, double frame_rate,
                      struct camera_path *path, struct error *err)
{
    const struct json_node root = json_root(json, err);
    if (camera_path_read(&root, path) && camera_path_check(&root, path, frames, frame_rate))
        return true;
    camera_path_finish(path);
    return false;
}

/* ---- writing ---- */

static json_t *key_to_json(const struct camera_path *path, const struct camera_key *key)
{
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, path->is_timed ? "time_s" : "frame", key->at);
    json_put_numbers(&writer, "eye", key->eye, 3);
    json_put_numbers(&writer, "target", key->target, 3);
    json_put_numbers(&writer, "up", key->up, 3);
    json_put_number(&writer, "fov_y_deg", key->fov_y_deg);
    if (key->ortho_height > 0)
        json_put_number(&writer, "ortho_height", key->ortho_height);
    return json_writer_take(&writer);
}

json_t *camera_path_to_json(const struct camera_path *path)
{
    struct json_writer writer = json_writer_begin();
    json_t *keys = json_array();
    bool has_failed = !keys;
    for (int i = 0; keys && i < path->count; i++)
        json_append(keys, key_to_json(path, &path->keys[i]), &has_failed);
    json_put(&writer, "keys", json_take_unless(keys, has_failed));
    json_put_text(&writer, "interpolation", interpolation_name((int)path->interpolation));
    if (path->is_closed)
        json_put(&writer, "closed",
                 json_pack("{s:f}", path->is_timed ? "time_s" : "frame", path->closes_at));
    return json_writer_take(&writer);
}
