/* SPDX-License-Identifier: MIT */
/* Reading and writing of job requests. The view is read by the parser of render requests. */
#include "protocol/job_request.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/numbered_name.h"
#include "protocol/request_parts.h"
#include "protocol/request_tree.h"
#include "protocol/scene_summary.h"
#include "protocol/turntable.h"

enum { PRIORITY = 50, ATTEMPTS = 3, PATTERN_DIGITS_MAX = 8 };
static const double FRAME_RATE = 24;

/* ---- outputs ---- */

static bool is_name(const char *text)
{
    return strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.") ==
               strlen(text) &&
           text[0] != '.';
}

static bool is_printable(const char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7f)
            return false;
    return true;
}

/* Frames have at most as many digits. */
static bool is_pattern(const char *text)
{
    return numbered_name_is_pattern(text) && numbered_name_width(text) <= PATTERN_DIGITS_MAX;
}

static enum request_format format_of_extension(const char *file)
{
    static const struct {
        const char *extension;
        enum request_format format;
    } known[] = {{".png", REQUEST_FORMAT_PNG},
                 {".jpg", REQUEST_FORMAT_JPEG},
                 {".jpeg", REQUEST_FORMAT_JPEG},
                 {".webp", REQUEST_FORMAT_WEBP},
                 {".exr", REQUEST_FORMAT_EXR}};
    const char *dot = strrchr(file, '.');
    for (size_t i = 0; dot && i < sizeof known / sizeof known[0]; i++)
        if (strcmp(dot, known[i].extension) == 0)
            return known[i].format;
    return REQUEST_FORMAT_ANY;
}

/* "beauty.%04d.exr": a name without a folder, whose end tells the format. */
static bool read_file(const struct json_node *node, struct job_output *output)
{
    const char *file = NULL;
    if (!json_read_name(node, &file))
        return false;
    if (!file)
        return true;
    if (strlen(file) >= JOB_FILE_BYTES - 16 || strchr(file, '/') || file[0] == '.' ||
        !is_printable(file))
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must be a file name of at most %d bytes without a folder, which does "
                           "not begin with a dot",
                           JOB_FILE_BYTES - 17);
    if (!is_pattern(file))
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must hold the frame's number once, as %%d or with up to %d digits, "
                           "such as beauty.%%04d.exr",
                           PATTERN_DIGITS_MAX);
    enum request_format format = format_of_extension(file);
    if (format == REQUEST_FORMAT_ANY)
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must end with .png, .jpg, .jpeg, .webp or .exr");
    memcpy(output->file, file, strlen(file) + 1);
    output->format = format;
    return true;
}

static bool read_layers(const struct json_node *node, uint32_t *outputs)
{
    const struct json_choice choice = {.name = request_output_name};
    size_t count;
    if (!json_expect_array(node, LIMIT_OUTPUTS, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        int index = 0;
        if (!json_read_choice(&element, &choice, &index))
            return false;
        if (*outputs & 1u << index)
            return json_refuse(&element, ERROR_INVALID_REQUEST, "for the second time");
        *outputs |= 1u << index;
    }
    return true;
}

static bool set_output_name(const struct json_node *node, const char *name,
                            struct job_output *output)
{
    if (strlen(name) >= JOB_OUTPUT_NAME_BYTES || !is_name(name))
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must be 1 to %d letters, digits, '_', '-' and '.', not beginning with "
                           "a dot",
                           JOB_OUTPUT_NAME_BYTES - 1);
    memcpy(output->name, name, strlen(name) + 1);
    return true;
}

/* Of what a file holds: its first output. */
static const char *first_output(uint32_t outputs)
{
    int index = 0;
    while (!(outputs & 1u << index))
        index++;
    return request_output_name(index);
}

static bool read_output_object(const struct json_node *node, struct job_output *output)
{
    static const char *const known[] = {"name",   "outputs",         "file",
                                        "format", "quality_percent", NULL};
    const struct json_choice formats = {.name = request_format_name, .first = REQUEST_FORMAT_PNG};
    if (!json_expect_object(node, known))
        return false;
    struct json_node name = json_member(node, "name"), layers = json_member(node, "outputs");
    struct json_node file = json_member(node, "file"), format = json_member(node, "format");
    struct json_node quality = json_member(node, "quality_percent");
    const char *text = NULL;
    int index = REQUEST_FORMAT_ANY;
    if (!read_layers(&layers, &output->outputs) || !read_file(&file, output) ||
        !json_read_choice(&format, &formats, &index) ||
        !json_read_int(&quality, 1, 100, &output->quality_percent) || !json_read_name(&name, &text))
        return false;
    if (output->outputs == 0)
        output->outputs = 1u << REQUEST_OUTPUT_COLOR;
    bool is_deep_exr = index == REQUEST_FORMAT_EXR_DEEP && output->format == REQUEST_FORMAT_EXR;
    if (file.value && format.value && index != (int)output->format && !is_deep_exr)
        return json_refuse(&format, ERROR_INVALID_REQUEST, "but the file's name ends as %s",
                           request_format_name((int)output->format));
    if (format.value)
        output->format = (enum request_format)index;
    if (quality.value && output->format != REQUEST_FORMAT_JPEG &&
        output->format != REQUEST_FORMAT_WEBP)
        return json_refuse(&quality, ERROR_INVALID_REQUEST,
                           "but only JPEG and WebP have a quality");
    return set_output_name(&name, text ? text : first_output(output->outputs), output);
}

/* A name of an output alone, or an object. */
static bool read_output(const struct json_node *node, struct job_output *output)
{
    const struct json_choice choice = {.name = request_output_name};
    int index = 0;
    *output = (struct job_output){.format = REQUEST_FORMAT_ANY};
    if (json_is_object(node->value))
        return read_output_object(node, output);
    if (!json_read_choice(node, &choice, &index))
        return false;
    output->outputs = 1u << index;
    return set_output_name(node, request_output_name(index), output);
}

static bool read_outputs(const struct json_node *node, struct job_request *request)
{
    size_t count = 0;
    if (!json_expect_array(node, LIMIT_OUTPUTS, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        struct job_output *output = &request->outputs[i];
        if (!read_output(&element, output))
            return false;
        for (size_t k = 0; k < i; k++) {
            const struct job_output *other = &request->outputs[k];
            if (strcmp(output->name, other->name) == 0)
                return json_refuse(&element, ERROR_INVALID_REQUEST,
                                   "but an output before it has the name '%s', too", output->name);
        }
    }
    request->output_count = (int)count;
    if (count == 0) {
        request->outputs[0] = (struct job_output){
            .name = "color", .outputs = 1u << REQUEST_OUTPUT_COLOR, .format = REQUEST_FORMAT_ANY};
        request->output_count = 1;
    }
    return !node->value || count > 0 ||
           json_refuse(node, ERROR_INVALID_REQUEST, "at least one output is needed");
}

/* ---- the other members ---- */

/* The view with the job's scene in it, read as a render. */
static bool read_view(const struct json_node *root, struct job_request *request)
{
    struct json_node scene = json_member(root, "scene");
    char id[65];
    if (!request_read_scene(&scene, id))
        return false;
    struct json_node view = json_member(root, "view");
    if (!view.value && json_object_set_new(root->value, "view", json_object()) != 0)
        return error_set(root->err, ERROR_NO_MEMORY, "job");
    view = json_member(root, "view");
    struct json_node other = json_member(&view, "scene");
    if (!json_expect_object(&view, request_view_members()))
        return false;
    if (other.value && !json_equal(other.value, scene.value))
        return json_refuse(&other, ERROR_INVALID_REQUEST, "but the job's scene is another one");
    if (json_object_set(view.value, "scene", scene.value) != 0)
        return error_set(root->err, ERROR_NO_MEMORY, "job");
    struct json_node tiles = json_member(root, "tiles");
    return tiles.value ? request_read_picture(&view, &request->render)
                       : request_read_root(&view, &request->render);
}

/* 2048, or {"width": 2048, "height": 1024}. */
static bool read_tiles(const struct json_node *root, struct job_request *request)
{
    static const char *const known[] = {"width", "height", NULL};
    const struct json_node node = json_member(root, "tiles");
    int *side[2] = {&request->tile_width, &request->tile_height};
    if (!node.value)
        return true;
    if (!json_is_object(node.value) && !json_is_integer(node.value))
        return json_refuse(&node, ERROR_INVALID_REQUEST,
                           "must be the side of a tile in pixels, or {\"width\", \"height\"}");
    if (json_is_object(node.value) && !json_expect_object(&node, known))
        return false;
    for (int i = 0; i < 2; i++) {
        struct json_node member = json_is_object(node.value) ? json_member(&node, known[i]) : node;
        if (!json_expect_present(&member) ||
            !json_read_int(&member, LIMIT_TILE_SIDE_LEAST_PX, LIMIT_IMAGE_SIDE_PX, side[i]))
            return false;
    }
    const struct picture_tiles tiles = job_request_tiles(request);
    return picture_tiles_count(&tiles) <= LIMIT_PICTURE_TILES ||
           json_refuse(&node, ERROR_TOO_LARGE, "which makes %d tiles of a picture, limit is %d",
                       picture_tiles_count(&tiles), LIMIT_PICTURE_TILES);
}

static bool read_frames(const struct json_node *node, struct job_request *request)
{
    char number[16];
    const char *text = json_string_value(node->value);
    int frame = 1;
    if (!text) {
        if (node->value && !json_is_integer(node->value))
            return json_refuse(node, ERROR_INVALID_REQUEST,
                               "must be a text such as \"1-100,120-140x2\", or a number");
        if (!json_read_int(node, 0, FRAME_NUMBER_MAX, &frame))
            return false;
        snprintf(number, sizeof number, "%d", frame);
        text = number;
    }
    struct error problem = {0};
    if (!frame_list_parse(text, LIMIT_JOB_FRAMES, &request->frames, &problem))
        return error_set_at(node->err, problem.code, "/frames", "%s", problem.message);
    memcpy(request->frames_text, text, strlen(text) + 1);
    return true;
}

static bool read_turntable(const struct json_node *node, struct job_turntable *turntable)
{
    static const char *const known[] = {"elevation_deg", "turns", NULL};
    *turntable = (struct job_turntable){
        .is_given = node->value, .elevation_deg = TURNTABLE_ELEVATION_DEG, .turns = 1};
    if (!node->value)
        return true;
    struct json_node elevation = json_member(node, "elevation_deg");
    struct json_node turns = json_member(node, "turns");
    return json_expect_object(node, known) &&
           json_read_number(&elevation, -89, 89, &turntable->elevation_deg) &&
           json_read_number(&turns, -100, 100, &turntable->turns);
}

/* A path that every frame of the list can be on. */
static bool read_camera_path(const struct json_node *root, struct job_request *request)
{
    struct json_node path = json_member(root, "camera_path");
    if (path.value && request->turntable.is_given)
        return json_refuse(&path, ERROR_INVALID_REQUEST,
                           "but turntable says already where the camera goes");
    return camera_path_read(&path, &request->camera_path) &&
           camera_path_check(&path, &request->camera_path, &request->frames, request->frame_rate);
}

/* "shots/a": segments that stay below where they begin. */
static bool read_directory(const struct json_node *node, struct job_request *request)
{
    const char *text = NULL;
    if (!json_read_name(node, &text))
        return false;
    if (!text)
        return true;
    bool is_good = strlen(text) < JOB_DIRECTORY_BYTES && is_printable(text);
    for (const char *at = text; is_good;) {
        size_t length = strcspn(at, "/");
        is_good = length > 0 && at[0] != '.';
        if (!at[length])
            break;
        at += length + 1;
    }
    if (!is_good)
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must name a folder below the allowed one, such as shots/a: no part of "
                           "it is empty or begins with a dot");
    memcpy(request->directory, text, strlen(text) + 1);
    return true;
}

static bool read_job_name(const struct json_node *node, struct job_request *request)
{
    struct error problem = {0};
    const char *text = NULL;
    if (!json_read_name(node, &text))
        return false;
    if (!text)
        return true;
    if (strlen(text) >= JOB_NAME_BYTES || !scene_name_check(text, &problem))
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must be at most %d bytes of UTF-8 without control characters",
                           JOB_NAME_BYTES - 1);
    memcpy(request->name, text, strlen(text) + 1);
    return true;
}

/* ---- what it waits for ---- */

static const char *after_failure_name(int index)
{
    static const char *const names[] = {[JOB_AFTER_FAILURE_CANCEL] = "cancel",
                                        [JOB_AFTER_FAILURE_RUN] = "run",
                                        [JOB_AFTER_FAILURE_WAIT] = "wait"};
    return index < JOB_AFTER_FAILURE_COUNT ? names[index] : NULL;
}

static bool read_id(const struct json_node *node, struct job_request *request)
{
    const char *text = NULL;
    if (!json_read_name(node, &text))
        return false;
    if (!text || strlen(text) != JOB_ID_BYTES - 1 ||
        strspn(text, "0123456789abcdef") != JOB_ID_BYTES - 1)
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must be the id of a job, %d hexadecimal digits", JOB_ID_BYTES - 1);
    for (int i = 0; i < request->after_count; i++)
        if (strcmp(request->after[i], text) == 0)
            return json_refuse(node, ERROR_INVALID_REQUEST, "for the second time");
    memcpy(request->after[request->after_count++], text, JOB_ID_BYTES);
    return true;
}

static bool read_after(const struct json_node *root, struct job_request *request)
{
    const struct json_choice choice = {.name = after_failure_name};
    struct json_node after = json_member(root, "after");
    struct json_node failure = json_member(root, "after_failure");
    size_t count = 0;
    int index = JOB_AFTER_FAILURE_CANCEL;
    if (!json_expect_array(&after, LIMIT_JOB_AFTER, &count) ||
        !json_read_choice(&failure, &choice, &index))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(&after, i);
        if (!read_id(&element, request))
            return false;
    }
    request->after_failure = (enum job_after_failure)index;
    return !failure.value || count > 0 ||
           json_refuse(&failure, ERROR_INVALID_REQUEST, "but 'after' names no job");
}

/* ---- the whole ---- */

static bool read_root(const struct json_node *root, struct job_request *request)
{
    static const char *const known[] = {"name",       "scene",     "view",      "frames",
                                        "frame_rate", "animate",   "turntable", "camera_path",
                                        "outputs",    "priority",  "attempts",  "frame_timeout_s",
                                        "paused",     "directory", "after",     "after_failure",
                                        "provenance", "tiles",     NULL};
    if (!json_expect_object(root, known))
        return false;
    struct json_node name = json_member(root, "name"), frames = json_member(root, "frames");
    struct json_node rate = json_member(root, "frame_rate");
    struct json_node animate = json_member(root, "animate");
    struct json_node turntable = json_member(root, "turntable");
    struct json_node outputs = json_member(root, "outputs");
    struct json_node priority = json_member(root, "priority");
    struct json_node attempts = json_member(root, "attempts");
    struct json_node timeout = json_member(root, "frame_timeout_s");
    struct json_node paused = json_member(root, "paused");
    struct json_node directory = json_member(root, "directory");
    struct json_node provenance = json_member(root, "provenance");
    bool has_provenance = true;
    bool animates = frames.value; /* one picture shows the time that the view says */
    if (!read_view(root, request) || !read_tiles(root, request) || !read_job_name(&name, request) ||
        !read_frames(&frames, request) ||
        !json_read_number(&rate, 0.001, 1000, &request->frame_rate) ||
        !json_read_bool(&animate, &animates) || !read_turntable(&turntable, &request->turntable) ||
        !read_camera_path(root, request) || !read_outputs(&outputs, request) ||
        !json_read_int(&priority, 0, JOB_PRIORITY_MAX, &request->priority) ||
        !json_read_int(&attempts, 1, JOB_ATTEMPTS_MAX, &request->attempts) ||
        !json_read_int(&timeout, 1, 86400, &request->frame_timeout_s) ||
        !json_read_bool(&paused, &request->is_paused) || !read_directory(&directory, request) ||
        !read_after(root, request) || !json_read_bool(&provenance, &has_provenance))
        return false;
    request->is_still = !animates;
    request->render.omits_provenance = !has_provenance;
    return true;
}

bool job_request_parse(const char *json, size_t length, struct job_request *request,
                       struct error *err)
{
    *request =
        (struct job_request){.frame_rate = FRAME_RATE, .priority = PRIORITY, .attempts = ATTEMPTS};
    json_t *value = json_load_checked(json, length, LIMIT_REQUEST_JSON_BYTES, err);
    struct json_node root = json_root(value, err);
    bool is_good = value && read_root(&root, request);
    json_decref(value);
    if (!is_good)
        job_request_finish(request);
    return is_good;
}

void job_request_finish(struct job_request *request)
{
    render_request_finish(&request->render);
    frame_list_finish(&request->frames);
    camera_path_finish(&request->camera_path);
    *request = (struct job_request){0};
}

/* ---- writing ---- */

static json_t *output_to_json(const struct job_output *output)
{
    struct json_writer writer = json_writer_begin();
    json_t *layers = json_array();
    bool has_failed = !layers;
    json_put_text(&writer, "name", output->name);
    for (int i = 0; layers && i < REQUEST_OUTPUT_COUNT; i++)
        if (output->outputs & 1u << i)
            json_append(layers, json_text(request_output_name(i)), &has_failed);
    json_put(&writer, "outputs", json_take_unless(layers, has_failed));
    if (output->file[0])
        json_put_text(&writer, "file", output->file);
    if (output->format != REQUEST_FORMAT_ANY)
        json_put_text(&writer, "format", request_format_name((int)output->format));
    if (output->quality_percent)
        json_put_integer(&writer, "quality_percent", (uint64_t)output->quality_percent);
    return json_writer_take(&writer);
}

static json_t *after_to_json(const struct job_request *request)
{
    json_t *after = json_array();
    bool has_failed = !after;
    for (int i = 0; after && i < request->after_count; i++)
        json_append(after, json_text(request->after[i]), &has_failed);
    return json_take_unless(after, has_failed);
}

json_t *job_request_to_json(const struct job_request *request)
{
    static const char *const not_of_a_view[] = {"outputs", "format", "quality_percent",
                                                "provenance", "scene"};
    struct json_writer writer = json_writer_begin();
    json_t *view = request_to_tree(&request->render), *outputs = json_array();
    bool has_failed = !outputs;
    for (size_t i = 0; view && i < sizeof not_of_a_view / sizeof not_of_a_view[0]; i++)
        json_object_del(view, not_of_a_view[i]);
    for (int i = 0; outputs && i < request->output_count; i++)
        json_append(outputs, output_to_json(&request->outputs[i]), &has_failed);
    if (request->name[0])
        json_put_text(&writer, "name", request->name);
    json_put_text(&writer, "scene", request->render.scene);
    json_put(&writer, "view", view);
    json_put_text(&writer, "frames", request->frames_text);
    json_put_number(&writer, "frame_rate", request->frame_rate);
    json_put_bool(&writer, "animate", !request->is_still);
    if (request->turntable.is_given)
        json_put(&writer, "turntable",
                 json_pack("{s:f,s:f}", "elevation_deg", request->turntable.elevation_deg, "turns",
                           request->turntable.turns));
    if (request->tile_width)
        json_put(
            &writer, "tiles",
            json_pack("{s:i,s:i}", "width", request->tile_width, "height", request->tile_height));
    if (request->camera_path.count > 0)
        json_put(&writer, "camera_path", camera_path_to_json(&request->camera_path));
    json_put(&writer, "outputs", json_take_unless(outputs, has_failed));
    json_put_integer(&writer, "priority", (uint64_t)request->priority);
    json_put_integer(&writer, "attempts", (uint64_t)request->attempts);
    if (request->frame_timeout_s)
        json_put_integer(&writer, "frame_timeout_s", (uint64_t)request->frame_timeout_s);
    json_put_bool(&writer, "paused", request->is_paused);
    if (request->directory[0])
        json_put_text(&writer, "directory", request->directory);
    if (request->after_count > 0) {
        json_put(&writer, "after", after_to_json(request));
        json_put_text(&writer, "after_failure", after_failure_name(request->after_failure));
    }
    json_put_bool(&writer, "provenance", !request->render.omits_provenance);
    return json_writer_take(&writer);
}

struct picture_tiles job_request_tiles(const struct job_request *request)
{
    const struct render_request *render = &request->render;
    struct picture_tiles none = {.width = 0};
    return request->tile_width ? picture_tiles_make(render->width, render->height,
                                                    request->tile_width, request->tile_height)
                               : none;
}

void job_file_name(const struct job_output *output, int frame, char name[JOB_FILE_BYTES])
{
    numbered_name_print(name, JOB_FILE_BYTES, output->file, frame);
}

/* Whether some frame would give both the same name. */
static bool may_collide(const char *a, const char *b)
{
    const char *in_a = strchr(a, '%'), *in_b = strchr(b, '%');
    return in_a - a == in_b - b && strncmp(a, b, (size_t)(in_a - a)) == 0 &&
           strcmp(strchr(in_a, 'd'), strchr(in_b, 'd')) == 0;
}

bool job_request_name_files(struct job_request *request, struct error *err)
{
    for (int i = 0; i < request->output_count; i++) {
        struct job_output *output = &request->outputs[i];
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/outputs/%d", i);
        if (!output->file[0])
            snprintf(output->file, sizeof output->file, "%s.%%04d.%s", output->name,
                     request_format_name(output->format == REQUEST_FORMAT_EXR_DEEP
                                             ? REQUEST_FORMAT_EXR
                                             : (int)output->format));
        for (int k = 0; k < i; k++)
            if (may_collide(output->file, request->outputs[k].file))
                return error_set_at(err, ERROR_INVALID_REQUEST, pointer,
                                    "%s: its file '%s' would be that of output %d, '%s'", pointer,
                                    output->file, k, request->outputs[k].file);
    }
    return true;
}
