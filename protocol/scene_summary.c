/* SPDX-License-Identifier: MIT */
/* Scene summaries as JSON, both ways. */
#include "protocol/scene_summary.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/summary_fields.h"
#include "protocol/utf8.h"

/* Thirteen full lists of names at LIMIT_NAME_BYTES, each byte escaped as \u001f, and numbers. */
enum { SUMMARY_JSON_BYTES_MAX = 384 << 20 };

static const char *light_type_name(int type)
{
    static const char *const names[] = {"directional", "point", "spot"};
    return type >= 0 && type < 3 ? names[type] : NULL;
}

static const char *camera_type_name(int type)
{
    static const char *const names[] = {"perspective", "orthographic"};
    return type >= 0 && type < 2 ? names[type] : NULL;
}

/* ---- lists ---- */

/* Room for one more of size_bytes each; capacities are powers of two, known from the count. */
static bool list_grow(void **items, size_t count, size_t size_bytes, struct error *err)
{
    if (count & (count - 1) && count > 0)
        return true;
    size_t capacity = count ? 2 * count : 1;
    void *grown = reallocarray(*items, capacity, size_bytes);
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "a list of %zu names", capacity);
    *items = grown;
    return true;
}

bool name_list_add(struct name_list *list, const char *name, struct error *err)
{
    void *names = list->names;
    char *copy = strdup(name);
    if (!copy || !list_grow(&names, list->count, sizeof *list->names, err)) {
        free(copy);
        return error_set(err, ERROR_NO_MEMORY, "name '%.40s'", name);
    }
    list->names = names;
    list->names[list->count++] = copy;
    return true;
}

void name_list_finish(struct name_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->names[i]);
    free(list->names);
    *list = (struct name_list){0};
}

static bool item_add(struct summary_item **items, size_t *count, const char *name,
                     const char *(*type_name)(int), const char *type, struct error *err)
{
    int index = 0;
    while (type_name(index) && strcmp(type_name(index), type) != 0)
        index++;
    if (!type_name(index))
        return error_set(err, ERROR_INVALID_REQUEST, "'%.40s' has the unknown type '%.40s'", name,
                         type);
    void *grown = *items;
    char *copy = strdup(name);
    if (!copy || !list_grow(&grown, *count, sizeof **items, err)) {
        free(copy);
        return error_set(err, ERROR_NO_MEMORY, "name '%.40s'", name);
    }
    *items = grown;
    (*items)[(*count)++] = (struct summary_item){.name = copy, .type = type_name(index)};
    return true;
}

bool scene_summary_add_light(struct scene_summary *summary, const char *name, const char *type,
                             struct error *err)
{
    return item_add(&summary->lights, &summary->light_list_count, name, light_type_name, type, err);
}

bool scene_summary_add_camera(struct scene_summary *summary, const char *name, const char *type,
                              struct error *err)
{
    return item_add(&summary->cameras, &summary->camera_list_count, name, camera_type_name, type,
                    err);
}

bool scene_summary_add_file_scene(struct scene_summary *summary, const char *name, bool is_shown,
                                  struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    if (is_shown)
        summary->file_scene = summary->file_scene_count;
    utf8_copy(cut, sizeof cut, name);
    return summary->file_scene_count++ >= SCENE_SUMMARY_NAMES_MAX ||
           name_list_add(&summary->file_scenes, cut, err);
}

bool scene_summary_add_animation(struct scene_summary *summary, const char *name, double duration_s,
                                 struct error *err)
{
    void *grown = summary->animations;
    char *copy = strdup(name);
    if (!copy ||
        !list_grow(&grown, summary->animation_list_count, sizeof *summary->animations, err)) {
        free(copy);
        return error_set(err, ERROR_NO_MEMORY, "name '%.40s'", name);
    }
    summary->animations = grown;
    summary->animations[summary->animation_list_count++] =
        (struct summary_animation){.name = copy, .duration_s = duration_s};
    return true;
}

bool scene_name_check(const char *name, struct error *err)
{
    size_t length = strlen(name);
    const char *at = name;
    while (*at && (unsigned char)*at >= 0x20 && *at != 0x7f && utf8_sequence_bytes(at) > 0)
        at += utf8_sequence_bytes(at);
    if (length > 0 && length <= LIMIT_FILE_NAME_BYTES && !*at)
        return true;
    return error_set(err, ERROR_INVALID_REQUEST,
                     "a scene's name has 1 to %d bytes of UTF-8 and no control characters",
                     LIMIT_FILE_NAME_BYTES);
}

void scene_summary_finish(struct scene_summary *summary)
{
    free(summary->name);
    name_list_finish(&summary->materials);
    name_list_finish(&summary->node_names);
    name_list_finish(&summary->file_scenes);
    name_list_finish(&summary->variants);
    name_list_finish(&summary->grids);
    name_list_finish(&summary->extensions_used);
    name_list_finish(&summary->extensions_ignored);
    name_list_finish(&summary->warnings);
    for (size_t i = 0; i < summary->light_list_count; i++)
        free(summary->lights[i].name);
    for (size_t i = 0; i < summary->camera_list_count; i++)
        free(summary->cameras[i].name);
    for (size_t i = 0; i < summary->animation_list_count; i++)
        free(summary->animations[i].name);
    free(summary->animations);
    free(summary->lights);
    free(summary->cameras);
    scene_outline_finish(&summary->outline);
    *summary = (struct scene_summary){0};
}

/* ---- plain counts, one list for both directions ---- */

struct count_member {
    const char *key;
    size_t offset;
};
static const struct count_member count_members[] = {
    {"triangles", offsetof(struct scene_summary, triangles)},
    {"vertices", offsetof(struct scene_summary, vertices)},
    {"nodes", offsetof(struct scene_summary, nodes)},
    {"meshes", offsetof(struct scene_summary, meshes)},
    {"primitives", offsetof(struct scene_summary, primitives)},
    {"textures", offsetof(struct scene_summary, textures)},
    {"images", offsetof(struct scene_summary, images)},
    {"material_count", offsetof(struct scene_summary, material_count)},
    {"light_count", offsetof(struct scene_summary, light_count)},
    {"camera_count", offsetof(struct scene_summary, camera_count)},
    {"animation_count", offsetof(struct scene_summary, animation_count)},
    {"variant_count", offsetof(struct scene_summary, variant_count)},
    {"density_grid_count", offsetof(struct scene_summary, grid_count)},
    {"file_scene_count", offsetof(struct scene_summary, file_scene_count)},
};
enum { COUNT_MEMBERS = sizeof count_members / sizeof *count_members };

/* ---- writing ---- */

static json_t *write_items(const struct summary_item *items, size_t count)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (size_t i = 0; i < count; i++) {
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", items[i].name);
        json_put_text(&writer, "type", items[i].type);
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

static json_t *write_animations(const struct scene_summary *summary)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (size_t i = 0; i < summary->animation_list_count; i++) {
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", summary->animations[i].name);
        json_put_number(&writer, "duration_s", summary->animations[i].duration_s);
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

static json_t *write_bounds(const struct scene_summary *summary)
{
    if (!summary->has_bounds)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_numbers(&writer, "min", summary->bounds_min, 3);
    json_put_numbers(&writer, "max", summary->bounds_max, 3);
    return json_writer_take(&writer);
}

static json_t *write_source(const struct scene_origin *source)
{
    struct json_writer writer = json_writer_begin();
    const struct scene_format_info *format = scene_format_describe(source->format);
    const char up[2] = {source->up, '\0'};
    json_put_text(&writer, "format", format->name);
    json_put_text_or_null(&writer, "converter", format->converter);
    json_put_text(&writer, "unit", scene_unit_name(source->unit_m));
    json_put_number(&writer, "unit_m", source->unit_m);
    json_put_text(&writer, "unit_by", scene_word_name(source->unit_by));
    json_put_text(&writer, "up", up);
    json_put_text(&writer, "up_by", scene_word_name(source->up_by));
    if (source->deflection > 0)
        json_put_number(&writer, "deflection", source->deflection);
    return json_writer_take(&writer);
}

static json_t *write_extensions(const struct scene_summary *summary)
{
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "used", summary_write_names(&summary->extensions_used));
    json_put(&writer, "ignored", summary_write_names(&summary->extensions_ignored));
    return json_writer_take(&writer);
}

json_t *scene_summary_to_json(const struct scene_summary *summary)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "id", summary->id);
    json_put_text_or_null(&writer, "name", summary->name);
    for (int i = 0; i < COUNT_MEMBERS; i++) {
        uint64_t count;
        memcpy(&count, (const char *)summary + count_members[i].offset, sizeof count);
        json_put_integer(&writer, count_members[i].key, count);
    }
    json_put(&writer, "materials", summary_write_names(&summary->materials));
    json_put(&writer, "lights", write_items(summary->lights, summary->light_list_count));
    json_put(&writer, "cameras", write_items(summary->cameras, summary->camera_list_count));
    json_put(&writer, "animations", write_animations(summary));
    json_put(&writer, "node_names", summary_write_names(&summary->node_names));
    json_put(&writer, "variants", summary_write_names(&summary->variants));
    json_put(&writer, "density_grids", summary_write_names(&summary->grids));
    json_put(&writer, "file_scenes", summary_write_names(&summary->file_scenes));
    if (summary->file_scene_count > 0)
        json_put_integer(&writer, "file_scene", summary->file_scene);
    json_put(&writer, "bounds", write_bounds(summary));
    json_put(&writer, "bytes", summary_write_bytes(summary->upload_bytes, summary->decoded_bytes));
    if (summary->source.unit_m > 0)
        json_put(&writer, "source", write_source(&summary->source));
    json_put(&writer, "extensions", write_extensions(summary));
    json_put(&writer, "warnings", summary_write_names(&summary->warnings));
    json_put(&writer, "created", json_time(summary->created_unix_s));
    json_put(&writer, "outline", scene_outline_to_json(&summary->outline));
    return json_writer_take(&writer);
}

char *scene_summary_to_json_text(const struct scene_summary *summary)
{
    return json_take_dump(scene_summary_to_json(summary), JSON_COMPACT | JSON_REAL_PRECISION(17));
}

/* ---- reading ---- */

/* Each object of the list: its name, and what else read takes from it. */
static bool read_list(const struct json_node *node,
                      bool (*read)(const struct json_node *element, const char *name,
                                   struct scene_summary *summary),
                      struct scene_summary *summary)
{
    size_t count;
    if (!json_expect_array(node, SCENE_SUMMARY_NAMES_MAX, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        if (!json_expect_object(&element, NULL))
            return false;
        struct json_node name = json_member(&element, "name");
        const char *text = "";
        if (!summary_read_string(&name, &text) || !read(&element, text, summary))
            return false;
    }
    return true;
}

static bool read_light(const struct json_node *element, const char *name,
                       struct scene_summary *summary)
{
    struct json_node type = json_member(element, "type");
    const char *text = "";
    return summary_read_string(&type, &text) &&
           scene_summary_add_light(summary, name, text, element->err);
}

static bool read_camera(const struct json_node *element, const char *name,
                        struct scene_summary *summary)
{
    struct json_node type = json_member(element, "type");
    const char *text = "";
    return summary_read_string(&type, &text) &&
           scene_summary_add_camera(summary, name, text, element->err);
}

static bool read_animation(const struct json_node *element, const char *name,
                           struct scene_summary *summary)
{
    struct json_node duration = json_member(element, "duration_s");
    double duration_s = 0;
    return json_read_number(&duration, 0, DBL_MAX, &duration_s) &&
           scene_summary_add_animation(summary, name, duration_s, element->err);
}

static bool read_counts(const struct json_node *root, struct scene_summary *summary)
{
    for (int i = 0; i < COUNT_MEMBERS; i++) {
        struct json_node member = json_member(root, count_members[i].key);
        uint64_t count = 0;
        if (!json_read_uint64(&member, &count))
            return false;
        memcpy((char *)summary + count_members[i].offset, &count, sizeof count);
    }
    return true;
}

static bool read_parts(const struct json_node *root, struct scene_summary *summary)
{
    struct json_node bounds = json_member(root, "bounds"), bytes = json_member(root, "bytes");
    struct json_node extensions = json_member(root, "extensions");
    struct json_node min = json_member(&bounds, "min"), max = json_member(&bounds, "max");
    struct json_node upload = json_member(&bytes, "upload");
    struct json_node decoded = json_member(&bytes, "decoded");
    struct json_node used = json_member(&extensions, "used");
    struct json_node ignored = json_member(&extensions, "ignored");
    summary->has_bounds = bounds.value;
    if (bounds.value && (!json_expect_object(&bounds, NULL) || !json_expect_present(&min) ||
                         !json_expect_present(&max)))
        return false;
    return json_read_numbers(&min, 3, -DBL_MAX, DBL_MAX, summary->bounds_min) &&
           json_read_numbers(&max, 3, -DBL_MAX, DBL_MAX, summary->bounds_max) &&
           json_read_uint64(&upload, &summary->upload_bytes) &&
           json_read_uint64(&decoded, &summary->decoded_bytes) &&
           summary_read_names(&used, &summary->extensions_used) &&
           summary_read_names(&ignored, &summary->extensions_ignored);
}

static bool read_word(const struct json_node *node, enum scene_word *word)
{
    const char *text = "";
    if (!summary_read_string(node, &text))
        return false;
    for (int i = 0; i < SCENE_WORD_COUNT; i++)
        if (strcmp(text, scene_word_name((enum scene_word)i)) == 0) {
            *word = (enum scene_word)i;
            return true;
        }
    return json_refuse(node, ERROR_INVALID_REQUEST, "must be default, file or request");
}

static bool read_source(const struct json_node *node, struct scene_origin *source)
{
    if (!node->value)
        return true;
    struct json_node format = json_member(node, "format"), up = json_member(node, "up");
    struct json_node unit_m = json_member(node, "unit_m");
    struct json_node unit_by = json_member(node, "unit_by"), up_by = json_member(node, "up_by");
    struct json_node deflection = json_member(node, "deflection");
    const char *format_name = "", *axis = "";
    if (!json_expect_object(node, NULL) || !summary_read_string(&format, &format_name) ||
        !summary_read_string(&up, &axis) ||
        !json_read_number(&unit_m, DBL_MIN, DBL_MAX, &source->unit_m) ||
        !read_word(&unit_by, &source->unit_by) || !read_word(&up_by, &source->up_by) ||
        (deflection.value && !json_read_number(&deflection, SCENE_DEFLECTION_LEAST,
                                               SCENE_DEFLECTION_MOST, &source->deflection)))
        return false;
    if (!scene_format_from_name(format_name, &source->format))
        return json_refuse(&format, ERROR_INVALID_REQUEST, "must be a format of scenes");
    source->up = axis[0];
    return strlen(axis) == 1 || json_refuse(&up, ERROR_INVALID_REQUEST, "must be an axis");
}

static bool read_summary(const struct json_node *root, struct scene_summary *summary)
{
    if (!json_expect_object(root, NULL))
        return false;
    struct json_node id = json_member(root, "id"), name = json_member(root, "name");
    struct json_node materials = json_member(root, "materials");
    struct json_node node_names = json_member(root, "node_names");
    struct json_node file_scenes = json_member(root, "file_scenes");
    struct json_node variants = json_member(root, "variants");
    struct json_node grids = json_member(root, "density_grids");
    struct json_node file_scene = json_member(root, "file_scene");
    struct json_node lights = json_member(root, "lights"), cameras = json_member(root, "cameras");
    struct json_node animations = json_member(root, "animations");
    struct json_node warnings = json_member(root, "warnings");
    struct json_node created = json_member(root, "created");
    struct json_node outline = json_member(root, "outline"), source = json_member(root, "source");
    const char *name_text = NULL;
    if (name.value && !summary_read_string(&name, &name_text))
        return false;
    if (name_text && !(summary->name = strdup(name_text)))
        return error_set(root->err, ERROR_NO_MEMORY, "name of a scene");
    return json_read_text(&id, summary->id, sizeof summary->id) && read_counts(root, summary) &&
           summary_read_names(&materials, &summary->materials) &&
           summary_read_names(&node_names, &summary->node_names) &&
           summary_read_names(&file_scenes, &summary->file_scenes) &&
           summary_read_names(&variants, &summary->variants) &&
           summary_read_names(&grids, &summary->grids) &&
           json_read_uint64(&file_scene, &summary->file_scene) &&
           read_list(&lights, read_light, summary) && read_list(&cameras, read_camera, summary) &&
           read_list(&animations, read_animation, summary) && read_parts(root, summary) &&
           summary_read_names(&warnings, &summary->warnings) &&
           summary_read_created(&created, &summary->created_unix_s) &&
           read_source(&source, &summary->source) &&
           scene_outline_read(&outline, &summary->outline);
}

static bool from_json(json_t *json, struct scene_summary *summary, struct error *err)
{
    struct json_node root = json_root(json, err);
    if (read_summary(&root, summary))
        return true;
    scene_summary_finish(summary);
    return false;
}

bool scene_summary_from_json_text(const char *json, size_t length, struct scene_summary *summary,
                                  struct error *err)
{
    *summary = (struct scene_summary){0};
    json_t *value = json_load_checked(json, length, SUMMARY_JSON_BYTES_MAX, err);
    bool is_read = value && from_json(value, summary, err);
    json_decref(value);
    return is_read;
}
