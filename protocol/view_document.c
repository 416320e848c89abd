/* SPDX-License-Identifier: MIT */
/* A view's canonical JSON. A patch is checked by the parser of render requests on a fragment: the
 * members that it touches as they would become, so that its cost does not grow with the view. */
#include "protocol/view_document.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/quality_defaults.h"
#include "protocol/request_parts.h"
#include "protocol/request_tree.h"
#include "protocol/view_parts.h"

enum { CANONICAL = JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17) };

struct view_document {
    json_t *members;                /* owned; canonical, without stream */
    struct request_quality quality; /* what its member says */
    struct view_stream stream;
    char scene[65];
    size_t bytes, counted_bytes; /* an upper bound, and the count that it started from */
    uint64_t shape;
};

static const char *const override_lists[] = {"nodes", "materials", "grids"};
static const enum view_name_kind override_kinds[] = {VIEW_NAME_NODE, VIEW_NAME_MATERIAL,
                                                     VIEW_NAME_GRID};
enum { OVERRIDE_LISTS = sizeof override_lists / sizeof override_lists[0] };

/* ---- canonical form ---- */

/* The canonical members of a request in JSON, a new reference, and its quality. Neither is a text
 * on the way: a patch is parsed once, and written when a picture is asked for. */
static json_t *canonicalise(json_t *request, struct request_quality *quality, struct error *err)
{
    struct render_request read;
    struct json_node root = json_root(request, err);
    if (!request_read_root(&root, &read))
        return NULL;
    json_t *canonical = request_to_tree(&read);
    *quality = read.quality;
    render_request_finish(&read);
    if (!canonical)
        error_set(err, ERROR_NO_MEMORY, "view");
    json_object_del(canonical, "outputs");
    json_object_del(canonical, "format");
    json_object_del(canonical, "quality_percent");
    json_object_del(canonical, "provenance");
    return canonical;
}

/* Of the text; nothing is written. */
static size_t text_bytes(const json_t *json)
{
    return json_dumpb(json, NULL, 0, CANONICAL);
}

static void count_bytes(struct view_document *document)
{
    document->bytes = document->counted_bytes = text_bytes(document->members);
}

/* ---- merging (RFC 7396) ---- */

json_t *view_merge(const json_t *target, json_t *patch)
{
    if (!json_is_object(patch))
        return json_deep_copy(patch);
    json_t *merged = json_is_object(target) ? json_deep_copy(target) : json_object();
    const char *key;
    json_t *value;
    bool has_failed = !merged;
    json_object_foreach(patch, key, value)
    {
        if (has_failed)
            break;
        has_failed =
            json_object_set_new(merged, key, view_merge(json_object_get(merged, key), value)) != 0;
    }
    return json_take_unless(merged, has_failed);
}

/* The members of each form of a camera. */
static const char *const camera_forms[][4] = {
    {"node"}, {"eye", "target", "up"}, {"matrix"}, {"fit"}};
enum { CAMERA_FORMS = sizeof camera_forms / sizeof camera_forms[0], CAMERA_FORM_FIT = 3 };

static bool names_form(const json_t *patch, int form)
{
    for (int i = 0; i < 4 && camera_forms[form][i]; i++) {
        const json_t *value = json_object_get(patch, camera_forms[form][i]);
        if (value && !json_is_null(value))
            return true;
    }
    return false;
}

static bool is_default_up(const json_t *up)
{
    return json_number_value(json_array_get(up, 0)) == 0 &&
           json_number_value(json_array_get(up, 1)) == 1 &&
           json_number_value(json_array_get(up, 2)) == 0;
}

/* A patch that names one form drops the members of the others, instead of failing on them. */
static json_t *merge_camera(const json_t *target, json_t *patch)
{
    json_t *base = json_deep_copy(target);
    bool names_any = false;
    for (int form = 0; form < CAMERA_FORMS; form++)
        names_any |= names_form(patch, form);
    if (is_default_up(json_object_get(base, "up")))
        json_object_del(base, "up"); /* the patched camera may look along it */
    for (int form = 0; names_any && form < CAMERA_FORMS; form++)
        for (int i = 0; i < 4 && camera_forms[form][i] && !names_form(patch, form); i++)
            json_object_del(base, camera_forms[form][i]);
    if (names_any && !names_form(patch, CAMERA_FORM_FIT))
        json_object_del(base, "projection"); /* of fit alone */
    json_t *merged = base ? view_merge(base, patch) : NULL;
    json_decref(base);
    return merged;
}

/* ---- the fragment that a patch touches ---- */

static bool put(json_t *object, const char *key, json_t *value, struct error *err)
{
    return json_object_set_new(object, key, value) == 0 ||
           error_set(err, ERROR_NO_MEMORY, "patch of a view");
}

/* overrides.nodes and the other lists: the touched entries only. */
static bool put_overrides_list(json_t *fragment, const char *list, const json_t *old, json_t *patch,
                               struct error *err)
{
    if (!json_is_object(patch))
        return json_is_null(patch) || put(fragment, list, json_deep_copy(patch), err);
    json_t *entries = json_object();
    if (!put(fragment, list, entries, err))
        return false;
    const char *key;
    json_t *value;
    json_object_foreach(patch, key, value)
    {
        if (!json_is_null(value) &&
            !put(entries, key, view_merge(json_object_get(old, key), value), err))
            return false;
    }
    return true;
}

static bool put_overrides(json_t *fragment, const json_t *old, json_t *patch, struct error *err)
{
    if (!json_is_object(patch))
        return json_is_null(patch) || put(fragment, "overrides", json_deep_copy(patch), err);
    json_t *overrides = json_object();
    if (!put(fragment, "overrides", overrides, err))
        return false;
    const char *key;
    json_t *value;
    json_object_foreach(patch, key, value)
    {
        bool is_list = false;
        for (int i = 0; i < OVERRIDE_LISTS; i++)
            is_list |= strcmp(key, override_lists[i]) == 0;
        if (is_list ? !put_overrides_list(overrides, key, json_object_get(old, key), value, err)
                    : !put(overrides, key, json_deep_copy(value), err))
            return false;
    }
    return true;
}

/* Without those that go: the limit is on those that stay. */
static bool put_parts(json_t *fragment, const json_t *old, json_t *patch, struct error *err)
{
    json_t *merged = view_merge(old, patch), *part;
    const char *key;
    void *next;
    json_object_foreach_safe(merged, next, key, part)
    {
        if (json_is_null(part))
            json_object_del(merged, key);
    }
    return put(fragment, "parts", merged, err);
}

static bool refuse_member(json_t *patch, const char *key, const char *why, struct error *err)
{
    struct json_node root = json_root(patch, err), member = json_member(&root, key);
    return json_refuse(&member, ERROR_INVALID_REQUEST, "%s", why);
}

static bool is_of_image(const char *key)
{
    return strcmp(key, "output") == 0 || strcmp(key, "outputs") == 0 ||
           strcmp(key, "format") == 0 || strcmp(key, "quality_percent") == 0 ||
           strcmp(key, "provenance") == 0;
}

/* Whether a member of a patch names lights one by one, instead of being all of them. */
static bool names_lights(const char *key, const json_t *value)
{
    return strcmp(key, "lights") == 0 && json_is_object(value);
}

static bool put_member(const struct view_document *document, const struct view_patch *patch,
                       const char *key, json_t *value, json_t *fragment, struct error *err)
{
    const json_t *old = json_object_get(document->members, key);
    if (is_of_image(key))
        return refuse_member(patch->json, key,
                             "but a view has no such member: it is said when an image is asked for",
                             err);
    if (strcmp(key, "scene") == 0)
        return (json_is_string(value) && strcmp(json_string_value(value), document->scene) == 0) ||
               refuse_member(patch->json, key,
                             "but the scene of a view cannot change; make another view", err);
    if (!json_is_known(key, request_view_members())) {
        struct json_node root = json_root(patch->json, err);
        return json_refuse_unknown(&root, key, request_view_members());
    }
    if (strcmp(key, "overrides") == 0)
        return put_overrides(fragment, old, value, err);
    if (strcmp(key, "parts") == 0)
        return put_parts(fragment, old, value, err);
    if (names_lights(key, value)) {
        struct json_node root = json_root(patch->json, err), member = json_member(&root, key);
        json_t *touched = view_lights_touched(old, &member);
        return touched && put(fragment, key, touched, err);
    }
    if (strcmp(key, "camera") != 0 || !json_is_object(value))
        return put(fragment, key, view_merge(old, value), err);
    return put(fragment, key,
               patch->replaces_camera ? json_deep_copy(value) : merge_camera(old, value), err);
}

/* A new reference. */
static json_t *make_fragment(const struct view_document *document, const struct view_patch *patch,
                             struct error *err)
{
    json_t *fragment = json_pack("{s:s}", "scene", document->scene);
    bool is_good = fragment || error_set(err, ERROR_NO_MEMORY, "patch of a view");
    const char *key;
    json_t *value;
    json_object_foreach(patch->json, key, value)
    {
        if (is_good && strcmp(key, "stream") != 0)
            is_good = put_member(document, patch, key, value, fragment, err);
    }
    return json_take_unless(fragment, !is_good);
}

/* ---- what the fragment may not be ---- */

static bool check_count(const json_t *old, const json_t *added, const char *list, struct error *err)
{
    size_t count = json_object_size(old);
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)added, key, value)
    {
        count += !json_object_get(old, key);
    }
    return count <= LIMIT_REQUEST_OVERRIDES ||
           error_set_at(err, ERROR_TOO_LARGE, "/overrides", "%zu overrides of %s, the limit is %d",
                        count, list, LIMIT_REQUEST_OVERRIDES);
}

static const char *kind_name(enum view_name_kind kind)
{
    static const char *const names[] = {[VIEW_NAME_NODE] = "node",
                                        [VIEW_NAME_MATERIAL] = "material",
                                        [VIEW_NAME_GRID] = "density grid",
                                        [VIEW_NAME_ANIMATION] = "animation",
                                        [VIEW_NAME_VARIANT] = "variant"};
    return names[kind];
}

static bool is_of_part(const char *name, const char *part)
{
    size_t length = strlen(part);
    return strncmp(name, part, length) == 0 && (!name[length] || name[length] == '/');
}

/* Whether it is a part, or PART/NAME of one: such names are known when the view is rendered. */
static bool names_part(const json_t *members, const char *name)
{
    json_t *parts = json_object_get(members, "parts"), *part;
    const char *key;
    json_object_foreach(parts, key, part)
    {
        if (is_of_part(name, key))
            return true;
    }
    return false;
}

static bool may_have(const struct view_document *document, const json_t *fragment,
                     const struct view_names *names, enum view_name_kind kind, const char *name)
{
    return view_names_may_have(names, kind, name) || names_part(fragment, name) ||
           (!json_object_get(fragment, "parts") && names_part(document->members, name));
}

static bool check_override(const struct view_document *document, json_t *members,
                           const struct view_names *names, int list, const char *key,
                           struct error *err)
{
    enum view_name_kind kind = override_kinds[list];
    if (may_have(document, members, names, kind, key))
        return true;
    struct json_node root = json_root(members, err), overrides = json_member(&root, "overrides");
    struct json_node of_list = json_member(&overrides, override_lists[list]);
    struct json_node member = json_member(&of_list, key);
    return json_refuse(&member, ERROR_NOT_FOUND, "but the scene has no %s '%.120s'",
                       kind_name(kind), key);
}

/* Parts have names of their own, and hang on nodes of the scene or of other parts. Which nodes
 * parts have, and circles, are known when the view is rendered. */
static bool check_parts(json_t *members, const struct view_names *names, struct error *err)
{
    json_t *parts = json_object_get(members, "parts"), *part;
    const char *name;
    json_object_foreach(parts, name, part)
    {
        struct json_node root = json_root(members, err), of_parts = json_member(&root, "parts");
        struct json_node member = json_member(&of_parts, name);
        struct json_node parent = json_member(&member, "parent");
        const char *above = json_string_value(parent.value);
        if (view_names_has(names, VIEW_NAME_NODE, name))
            return json_refuse(&member, ERROR_INVALID_REQUEST,
                               "but a node of the scene has that name");
        if (above && !view_names_may_have(names, VIEW_NAME_NODE, above) &&
            !names_part(members, above))
            return json_refuse(&parent, ERROR_NOT_FOUND, "but there is no such node or part");
    }
    return true;
}

/* Of parts, too, whose variants are known when the view is rendered. */
static bool check_variant(const struct view_document *document, const json_t *members,
                          const struct view_names *names, struct error *err)
{
    const char *variant = json_string_value(json_object_get(members, "variant"));
    json_t *parts = json_object_get(members, "parts");
    char list[160];
    if (!variant || view_names_may_have(names, VIEW_NAME_VARIANT, variant) ||
        json_object_size(parts) > 0 ||
        json_object_size(json_object_get(document->members, "parts")) > 0)
        return true;
    view_names_list(names, VIEW_NAME_VARIANT, list, sizeof list);
    return error_set_at(err, ERROR_NOT_FOUND, "/variant", "the scene has no variant '%.60s'%s%s",
                        variant, list[0] ? ", but " : ": it has none", list);
}

static bool check_names(const struct view_document *document, json_t *members,
                        const struct view_names *names, struct error *err)
{
    const json_t *overrides = json_object_get(members, "overrides");
    const char *node =
        json_string_value(json_object_get(json_object_get(members, "camera"), "node"));
    const char *animation =
        json_string_value(json_object_get(json_object_get(members, "animation"), "name"));
    if (!names)
        return true;
    if (!check_parts(members, names, err) || !check_variant(document, members, names, err))
        return false;
    if (node && !may_have(document, members, names, VIEW_NAME_NODE, node))
        return error_set_at(err, ERROR_NOT_FOUND, "/camera/node", "the scene has no node '%.200s'",
                            node);
    if (animation && !may_have(document, members, names, VIEW_NAME_ANIMATION, animation))
        return error_set_at(err, ERROR_NOT_FOUND, "/animation/name",
                            "the scene has no animation '%.200s'", animation);
    const json_t *lit = json_object_get(json_object_get(members, "highlight"), "nodes");
    for (size_t i = 0; i < json_array_size(lit); i++) {
        const char *name = json_string_value(json_array_get(lit, i));
        if (name && !may_have(document, members, names, VIEW_NAME_NODE, name))
            return error_set_at(err, ERROR_NOT_FOUND, "/highlight/nodes",
                                "the scene has no node '%.200s'", name);
    }
    for (int i = 0; i < OVERRIDE_LISTS; i++) {
        const char *key;
        json_t *value;
        json_object_foreach(json_object_get(overrides, override_lists[i]), key, value)
        {
            if (!check_override(document, members, names, i, key, err))
                return false;
        }
    }
    return true;
}

static const char *environment_image(const json_t *members)
{
    const char *image =
        json_string_value(json_object_get(json_object_get(members, "environment"), "image"));
    return image ? image : "";
}

static bool check_environment(json_t *members, const struct view_scenes *scenes, struct error *err)
{
    const char *image = environment_image(members);
    return !scenes->has_environment || !request_environment_is_uploaded(image) ||
           scenes->has_environment(scenes->context, image) ||
           error_set_at(err, ERROR_NOT_FOUND, "/environment/image",
                        "there is no environment map '%.64s'", image);
}

static bool check_scenes(json_t *members, const struct view_scenes *scenes, struct error *err)
{
    json_t *parts = json_object_get(members, "parts"), *part;
    const char *name;
    json_object_foreach(parts, name, part)
    {
        const char *id = json_string_value(json_object_get(part, "scene"));
        if (!scenes->has || !id || scenes->has(scenes->context, id))
            continue;
        struct json_node root = json_root(members, err), of_parts = json_member(&root, "parts");
        struct json_node member = json_member(&of_parts, name);
        struct json_node scene = json_member(&member, "scene");
        return json_refuse(&scene, ERROR_NOT_FOUND, "but there is no such scene");
    }
    return check_environment(members, scenes, err);
}

/* ---- installing ---- */

static void install_list(json_t *old, const json_t *canonical, json_t *patch, const char *list)
{
    json_t *entries = json_object_get(old, list);
    if (!entries) { /* of a view that an older version stored */
        json_object_set_new(old, list, json_object());
        entries = json_object_get(old, list);
    }
    if (json_is_null(patch))
        json_object_clear(entries);
    const char *key;
    json_t *value;
    json_object_foreach(patch, key, value)
    {
        json_t *entry = json_object_get(json_object_get(canonical, list), key);
        if (json_object_size(entry) > 0)
            json_object_set(entries, key, entry);
        else
            json_object_del(entries, key);
    }
}

/* The selection goes when nothing of it is left. */
static void drop_highlight(json_t *members, const char *part)
{
    json_t *nodes = json_object_get(json_object_get(members, "highlight"), "nodes");
    size_t count = json_array_size(nodes);
    for (size_t i = count; i-- > 0;)
        if (is_of_part(json_string_value(json_array_get(nodes, i)), part))
            json_array_remove(nodes, i);
    if (count > 0 && json_array_size(nodes) == 0)
        json_object_set_new(members, "highlight", json_null());
}

/* With a part go the overrides of what was in it. */
static void drop_part(json_t *overrides, const char *part)
{
    for (int i = 0; i < OVERRIDE_LISTS; i++) {
        json_t *entries = json_object_get(overrides, override_lists[i]), *entry;
        const char *key;
        void *next;
        json_object_foreach_safe(entries, next, key, entry)
        {
            if (is_of_part(key, part))
                json_object_del(entries, key);
        }
    }
}

static void drop_parts(struct view_document *document, const json_t *canonical)
{
    json_t *parts = json_object_get(document->members, "parts"), *part;
    const char *key;
    json_object_foreach(parts, key, part)
    {
        if (json_object_get(json_object_get(canonical, "parts"), key))
            continue;
        drop_part(json_object_get(document->members, "overrides"), key);
        drop_highlight(document->members, key);
    }
}

static void install(struct view_document *document, json_t *canonical, json_t *patch)
{
    json_t *overrides = json_object_get(document->members, "overrides");
    const char *key;
    json_t *value;
    if (json_object_get(patch, "parts"))
        drop_parts(document, canonical);
    json_object_foreach(patch, key, value)
    {
        json_t *found = json_object_get(canonical, key);
        if (names_lights(key, value)) {
            view_lights_install(json_object_get(document->members, key), found, value);
            continue;
        }
        if (strcmp(key, "overrides") != 0) {
            if (found && strcmp(key, "scene") != 0)
                json_object_set(document->members, key, found);
            continue;
        }
        for (int i = 0; i < OVERRIDE_LISTS; i++) {
            json_t *of_list = json_object_get(value, override_lists[i]);
            install_list(overrides, found, json_is_null(value) ? value : of_list,
                         override_lists[i]);
        }
    }
    if (json_object_get(patch, "overrides") || json_object_get(patch, "clip_planes") ||
        json_object_get(patch, "animation") || json_object_get(patch, "parts") ||
        json_object_get(patch, "variant"))
        document->shape++;
}

bool view_document_patch(struct view_document *document, const struct view_patch *patch,
                         struct error *err)
{
    struct json_node root = json_root(patch->json, err);
    struct view_stream stream = document->stream;
    struct json_node of_stream = json_member(&root, "stream");
    struct request_quality quality;
    json_t *value = json_object_get(patch->json, "stream");
    if (!json_is_object(patch->json))
        return json_refuse(&root, ERROR_INVALID_REQUEST, "a patch is an object");
    if (value && json_is_null(value))
        stream = view_stream_default();
    if (!view_stream_read(&of_stream, &stream))
        return false;
    json_t *fragment = make_fragment(document, patch, err);
    json_t *canonical = fragment ? canonicalise(fragment, &quality, err) : NULL;
    if (fragment && !canonical && json_is_object(json_object_get(patch->json, "lights")))
        view_lights_point(json_object_get(patch->json, "lights"), err);
    const json_t *old = json_object_get(document->members, "overrides");
    const json_t *added = json_object_get(canonical, "overrides");
    bool is_good = canonical && check_names(document, fragment, patch->names, err) &&
                   check_scenes(canonical, &patch->scenes, err);
    for (int i = 0; is_good && i < OVERRIDE_LISTS; i++)
        is_good = check_count(json_object_get(old, override_lists[i]),
                              json_object_get(added, override_lists[i]), override_lists[i], err);
    if (is_good) {
        install(document, canonical, patch->json);
        document->stream = stream;
        if (json_object_get(patch->json, "quality"))
            document->quality = quality;
        document->bytes += text_bytes(canonical);
        if (document->bytes > 2 * document->counted_bytes + (64 << 10))
            count_bytes(document);
    }
    json_decref(fragment);
    json_decref(canonical);
    return is_good;
}

/* ---- life ---- */

json_t *view_patch_load(const char *json, size_t length, struct error *err)
{
    return json_load_checked(json, length, LIMIT_REQUEST_JSON_BYTES, err);
}

static bool begin(struct view_document *document, json_t *body, struct error *err)
{
    struct json_node root = json_root(body, err), scene = json_member(&root, "scene");
    struct json_node lights = json_member(&root, "lights");
    json_t *smallest = NULL;
    size_t count;
    if (!json_is_object(body))
        return json_refuse(&root, ERROR_INVALID_REQUEST, "must be an object");
    if (!json_expect_present(&scene) ||
        !json_expect_array(&lights, LIMIT_REQUEST_LIGHTS, &count)) /* patches may name some */
        return false;
    smallest = json_pack("{s:O}", "scene", scene.value);
    document->members = smallest ? canonicalise(smallest, &document->quality, err) : NULL;
    json_decref(smallest);
    if (!document->members)
        return error_set(err, ERROR_NO_MEMORY, "view");
    memcpy(document->scene, json_string_value(scene.value), sizeof document->scene);
    document->stream = view_stream_default();
    return view_document_patch(document, &(struct view_patch){.json = body}, err);
}

struct view_document *view_document_create(const char *json, size_t length, struct error *err)
{
    json_t *body = view_patch_load(json, length, err);
    if (!body)
        return NULL;
    struct view_document *document = calloc(1, sizeof *document);
    bool is_good = document ? begin(document, body, err) : error_set(err, ERROR_NO_MEMORY, "view");
    json_decref(body);
    if (is_good) {
        count_bytes(document);
        return document;
    }
    view_document_destroy(document);
    return NULL;
}

void view_document_destroy(struct view_document *document)
{
    if (document)
        json_decref(document->members);
    free(document);
}

bool view_document_check_names(const struct view_document *document, const struct view_names *names,
                               struct error *err)
{
    return check_names(document, document->members, names, err);
}

bool view_document_check_scenes(const struct view_document *document,
                                const struct view_scenes *scenes, struct error *err)
{
    return check_scenes(document->members, scenes, err);
}

void view_document_resources(const struct view_document *document,
                             struct request_resources *resources)
{
    json_t *parts = json_object_get(document->members, "parts"), *part;
    const char *name;
    *resources = (struct request_resources){.scene_count = 0};
    const char *image = environment_image(document->members);
    memcpy(resources->environment, image, strnlen(image, 64) + 1);
    json_object_foreach(parts, name, part)
    {
        const char *id = json_string_value(json_object_get(part, "scene"));
        if (id && !request_resources_add_scene(resources, id)) /* the parser keeps the limit */
            return;
    }
}

const char *view_document_scene(const struct view_document *document)
{
    return document->scene;
}

void view_document_get_size(const struct view_document *document, int *width_px, int *height_px)
{
    *width_px = (int)json_integer_value(json_object_get(document->members, "width"));
    *height_px = (int)json_integer_value(json_object_get(document->members, "height"));
}

const struct view_stream *view_document_stream(const struct view_document *document)
{
    return &document->stream;
}

size_t view_document_bytes(const struct view_document *document)
{
    return document->bytes;
}

uint64_t view_document_shape(const struct view_document *document)
{
    return document->shape;
}

json_t *view_document_to_json(const struct view_document *document)
{
    json_t *json = json_deep_copy(document->members);
    if (json && json_object_set_new(json, "stream", view_stream_to_json(&document->stream)) != 0)
        return json_take_unless(json, true);
    return json;
}

/* ---- pictures ---- */

static int scaled(int side_px, double scale)
{
    double exact = round(side_px * (scale > 0 ? scale : 1));
    return exact < 1 ? 1 : (int)exact;
}

/* Columns of haze, and of the light in smoke, are as many at any scale: those of a moving frame are
 * found with a quarter of the slices, which are a quarter as many columns. */
enum { MOVING_SLICES = 16 };

/* Samples and taps change no structure, so that shadow maps are the same moving and at rest; nor do
 * traced shadows need one for motion that others would have to build. The reference is ray-traced.
 */
static struct request_quality moving_quality(const struct request_quality *quality)
{
    struct request_quality moving = *quality;
    moving.samples = moving.shadow_taps = 1;
    moving.says_shadow_taps = request_quality_asks(quality);
    if (shadow_technique_is_renderer(moving.shadows))
        moving.shadows = SHADOWS_AUTO;
    moving.reference = false;
    if (quality_or(moving.atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT) > MOVING_SLICES)
        moving.atmosphere_samples = MOVING_SLICES;
    return moving;
}

bool view_document_refines(const struct view_document *document)
{
    const struct request_quality *quality = &document->quality;
    return document->stream.rest_samples > quality_or(quality->samples, SAMPLES_DEFAULT) &&
           !quality->reference && !request_quality_asks(quality);
}

static struct request_quality refined_quality(const struct view_document *document)
{
    struct request_quality refined = document->quality;
    refined.samples = document->stream.rest_samples;
    return refined;
}

/* A view's members have every default written out, so resolution and taps at their defaults count
 * as not said. */
static struct request_quality open_quality(const struct request_quality *quality)
{
    struct request_quality open = *quality;
    open.says_shadow_resolution &= open.shadow_resolution != SHADOW_RESOLUTION_DEFAULT;
    open.says_shadow_taps &= open.shadow_taps != SHADOW_TAPS_DEFAULT;
    return open;
}

char *view_document_reference_text(const struct view_document *document)
{
    return request_reference_text(document->members, &document->quality);
}

const struct request_quality *view_document_quality(const struct view_document *document)
{
    return &document->quality;
}

char *view_document_frame(const struct view_document *document, const struct view_frame_desc *frame,
                          int *width_px, int *height_px)
{
    int width, height;
    view_document_get_size(document, &width, &height);
    width = scaled(width, frame->scale);
    height = scaled(height, frame->scale);
    if (width_px)
        *width_px = width;
    if (height_px)
        *height_px = height;
    json_t *request = json_copy(document->members);
    struct json_writer writer = {.object = request, .has_failed = !request};
    json_put(&writer, "width", json_integer(width));
    json_put(&writer, "height", json_integer(height));
    json_put(&writer, "outputs", json_pack("[s]", request_output_name((int)frame->output)));
    json_put(&writer, "format", json_string(request_format_name((int)frame->format)));
    json_put(&writer, "quality_percent",
             frame->quality_percent ? json_integer(frame->quality_percent) : json_null());
    json_put_bool(&writer, "provenance", false);
    if (frame->is_moving || frame->is_refined || request_quality_asks(&document->quality)) {
        const struct request_quality quality = frame->is_moving ? moving_quality(&document->quality)
                                               : frame->is_refined
                                                   ? refined_quality(document)
                                                   : open_quality(&document->quality);
        json_put(&writer, "quality", request_quality_to_tree(&quality));
    }
    return json_take_dump(json_writer_take(&writer), CANONICAL);
}
