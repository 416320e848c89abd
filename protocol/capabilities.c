/* SPDX-License-Identifier: MIT */
/* Capabilities as JSON: what the parser's tables and the device allow. */
#include "protocol/capabilities.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/render_request.h"
#include "protocol/scene_format.h"
#include "protocol/shadow_technique.h"
#include "protocol/transparency.h"

/* ---- device ---- */

struct auto_member {
    const char *group, *name;
    size_t offset;
};
#define AUTO(group, field)                                 \
    {                                                      \
        group, #field, offsetof(struct device_auto, field) \
    }
static const struct auto_member auto_members[] = {
    AUTO("speed", frame_ms),      AUTO("speed", shade),         AUTO("speed", maps),
    AUTO("speed", trace),         AUTO("speed", build),         AUTO("rates", pixel_ns),
    AUTO("rates", lookup_ns),     AUTO("rates", texel_ns),      AUTO("rates", event_ns),
    AUTO("rates", camera_ray_ns), AUTO("rates", shadow_ray_ns), AUTO("rates", triangle_ns),
};
enum { AUTO_MEMBERS = sizeof auto_members / sizeof auto_members[0] };

static json_t *write_auto_group(const struct device_auto *automatic, const char *group)
{
    if (!automatic->is_measured)
        return json_null();
    struct json_writer writer = json_writer_begin();
    for (int i = 0; i < AUTO_MEMBERS; i++) {
        double value;
        memcpy(&value, (const char *)automatic + auto_members[i].offset, sizeof value);
        if (strcmp(auto_members[i].group, group) == 0)
            json_put_number(&writer, auto_members[i].name, value);
    }
    return json_writer_take(&writer);
}

static json_t *write_auto(const struct device_auto *automatic)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "policy", automatic->policy[0] ? automatic->policy : "raster");
    json_put_text_or_null(&writer, "note", automatic->note);
    if (automatic->is_pending)
        json_put_bool(&writer, "pending", true);
    json_put(&writer, "speed", write_auto_group(automatic, "speed"));
    json_put(&writer, "rates", write_auto_group(automatic, "rates"));
    return json_writer_take(&writer);
}

static bool read_auto(const struct json_node *root, struct device_auto *automatic)
{
    struct json_node node = json_member(root, "auto");
    if (!node.value)
        return true;
    if (!json_expect_object(&node, NULL))
        return false;
    struct json_node policy = json_member(&node, "policy"), note = json_member(&node, "note");
    bool is_good = json_read_text(&policy, automatic->policy, sizeof automatic->policy) &&
                   json_read_text(&note, automatic->note, sizeof automatic->note);
    struct json_node speed = json_member(&node, "speed");
    automatic->is_pending = json_is_true(json_object_get(node.value, "pending"));
    automatic->is_measured = speed.value != NULL;
    for (int i = 0; i < AUTO_MEMBERS && is_good && automatic->is_measured; i++) {
        struct json_node group = json_member(&node, auto_members[i].group);
        struct json_node member = {0};
        double value = 0;
        is_good = json_expect_object(&group, NULL);
        if (!is_good)
            break;
        member = json_member(&group, auto_members[i].name);
        is_good = json_read_number(&member, 0, INFINITY, &value);
        memcpy((char *)automatic + auto_members[i].offset, &value, sizeof value);
    }
    return is_good;
}

static json_t *write_blocks_speed(const struct device_blocks *blocks)
{
    if (!blocks->is_measured)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "whole_ns", blocks->whole_ns);
    json_put_number(&writer, "bc1_ns", blocks->bc1_ns);
    json_put_number(&writer, "bc3_ns", blocks->bc3_ns);
    json_put_number(&writer, "encode_bytes_per_ms", blocks->encode_bytes_per_ms);
    return json_writer_take(&writer);
}

static json_t *write_blocks(const struct device_blocks *blocks)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "policy", blocks->policy[0] ? blocks->policy : "off");
    json_put(&writer, "from_levels",
             blocks->from_levels ? json_integer(blocks->from_levels) : json_null());
    json_put_text_or_null(&writer, "note", blocks->note);
    json_put(&writer, "speed", write_blocks_speed(blocks));
    return json_writer_take(&writer);
}

static bool read_blocks(const struct json_node *root, struct device_blocks *blocks)
{
    struct json_node node = json_member(root, "texture_blocks");
    if (!node.value)
        return true;
    if (!json_expect_object(&node, NULL))
        return false;
    struct json_node policy = json_member(&node, "policy"), note = json_member(&node, "note");
    struct json_node from = json_member(&node, "from_levels"), speed = json_member(&node, "speed");
    if (!json_read_text(&policy, blocks->policy, sizeof blocks->policy) ||
        !json_read_text(&note, blocks->note, sizeof blocks->note) ||
        !json_read_int(&from, 0, 32, &blocks->from_levels))
        return false;
    blocks->is_measured = speed.value != NULL;
    if (!blocks->is_measured)
        return true;
    if (!json_expect_object(&speed, NULL))
        return false;
    struct json_node whole = json_member(&speed, "whole_ns"), bc1 = json_member(&speed, "bc1_ns");
    struct json_node bc3 = json_member(&speed, "bc3_ns");
    struct json_node encode = json_member(&speed, "encode_bytes_per_ms");
    return json_read_number(&whole, 0, INFINITY, &blocks->whole_ns) &&
           json_read_number(&bc1, 0, INFINITY, &blocks->bc1_ns) &&
           json_read_number(&bc3, 0, INFINITY, &blocks->bc3_ns) &&
           json_read_number(&encode, 0, INFINITY, &blocks->encode_bytes_per_ms);
}

static json_t *write_lines(const struct device_capabilities *device, uint32_t wanted)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; i < CAPABILITIES_DEVICES && *device->devices[i]; i++)
        if (wanted >> i & 1)
            json_append(array, json_string(device->devices[i]), &has_failed);
    return json_take_unless(array, has_failed);
}

json_t *device_passed_over_to_json(const struct device_capabilities *device)
{
    return write_lines(device, device->passed_over);
}

/* They are among those of "devices". */
static bool read_passed_over(const struct json_node *root, struct device_capabilities *device)
{
    struct json_node lines = json_member(root, "passed_over");
    size_t count = lines.value ? json_array_size(lines.value) : 0;
    for (size_t i = 0; i < count && i < CAPABILITIES_DEVICES; i++) {
        struct json_node line = json_element(&lines, i);
        char text[CAPABILITIES_LINE_BYTES];
        if (!json_read_text(&line, text, sizeof text))
            return false;
        for (int j = 0; j < CAPABILITIES_DEVICES; j++)
            if (strcmp(text, device->devices[j]) == 0)
                device->passed_over |= 1u << j;
    }
    return true;
}

static bool read_lines(const struct json_node *root, struct device_capabilities *device)
{
    struct json_node lines = json_member(root, "devices");
    struct json_node warning = json_member(root, "warning");
    size_t count = lines.value ? json_array_size(lines.value) : 0;
    for (size_t i = 0; i < count && i < CAPABILITIES_DEVICES; i++) {
        struct json_node line = json_element(&lines, i);
        if (!json_read_text(&line, device->devices[i], sizeof device->devices[i]))
            return false;
    }
    return read_passed_over(root, device) &&
           (!warning.value || json_read_text(&warning, device->warning, sizeof device->warning));
}

json_t *device_capabilities_to_json(const struct device_capabilities *device)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "vendor", device->vendor);
    json_put_text(&writer, "renderer", device->renderer);
    json_put_text(&writer, "version", device->version);
    json_put_text(&writer, "driver", device->driver);
    json_put(&writer, "device_count", json_integer(device->device_count));
    json_put(&writer, "devices", write_lines(device, UINT32_MAX));
    if (device->passed_over)
        json_put(&writer, "passed_over", device_passed_over_to_json(device));
    json_put_bool(&writer, "software", device->is_software);
    if (*device->warning)
        json_put_text(&writer, "warning", device->warning);
    json_put(&writer, "max_texture_size", json_integer(device->max_texture_size));
    json_put(&writer, "max_samples", json_integer(device->max_samples));
    json_put(&writer, "vector_bits", json_integer(device->vector_bits));
    json_put_integer(&writer, "max_storage_block_bytes", device->max_storage_block_bytes);
    json_put_integer(&writer, "gpu_budget_bytes", device->gpu_budget_bytes);
    json_put_text(&writer, "gpu_budget_source", device->gpu_budget_source);
    json_put_integer(&writer, "gpu_used_bytes", device->gpu_used_bytes);
    json_put_integer(&writer, "upload_bytes_per_ms", device->upload_bytes_per_ms);
    json_put_bool(&writer, "texture_compression", device->compresses_textures);
    json_put_bool(&writer, "true_timers", device->has_true_timers);
    json_put_bool(&writer, "post_depth_coverage", device->has_post_depth_coverage);
    json_put_bool(&writer, "program_binaries", device->has_program_binaries);
    json_put_bool(&writer, "robust", device->is_robust);
    json_put_text(&writer, "wide_floats", device->wide_floats);
    json_put(&writer, "pairs_over_f64", json_real(device->pairs_over_f64));
    json_put(&writer, "auto", write_auto(&device->automatic));
    json_put(&writer, "texture_blocks", write_blocks(&device->blocks));
    return json_writer_take(&writer);
}

static bool read_texts(const struct json_node *root, struct device_capabilities *device)
{
    struct json_node vendor = json_member(root, "vendor"), name = json_member(root, "renderer");
    struct json_node version = json_member(root, "version"), driver = json_member(root, "driver");
    struct json_node source = json_member(root, "gpu_budget_source");
    if (source.value &&
        !json_read_text(&source, device->gpu_budget_source, sizeof device->gpu_budget_source))
        return false;
    return json_read_text(&vendor, device->vendor, sizeof device->vendor) &&
           json_read_text(&name, device->renderer, sizeof device->renderer) &&
           json_read_text(&version, device->version, sizeof device->version) &&
           json_read_text(&driver, device->driver, sizeof device->driver);
}

static bool read_numbers(const struct json_node *root, struct device_capabilities *device)
{
    struct json_node count = json_member(root, "device_count");
    struct json_node texture = json_member(root, "max_texture_size");
    struct json_node samples = json_member(root, "max_samples");
    struct json_node bits = json_member(root, "vector_bits");
    struct json_node block = json_member(root, "max_storage_block_bytes");
    struct json_node budget = json_member(root, "gpu_budget_bytes");
    struct json_node used = json_member(root, "gpu_used_bytes");
    struct json_node upload = json_member(root, "upload_bytes_per_ms");
    return json_read_int(&count, 0, 1 << 20, &device->device_count) &&
           json_read_int(&texture, 0, 1 << 30, &device->max_texture_size) &&
           json_read_int(&samples, 0, 1 << 20, &device->max_samples) &&
           json_read_int(&bits, 0, 1 << 20, &device->vector_bits) &&
           json_read_uint64(&block, &device->max_storage_block_bytes) &&
           json_read_uint64(&budget, &device->gpu_budget_bytes) &&
           json_read_uint64(&used, &device->gpu_used_bytes) &&
           json_read_uint64(&upload, &device->upload_bytes_per_ms);
}

bool device_capabilities_from_json(json_t *json, struct device_capabilities *device,
                                   struct error *err)
{
    *device = (struct device_capabilities){0};
    struct json_node root = json_root(json, err);
    if (!json_expect_object(&root, NULL))
        return false;
    struct json_node timers = json_member(&root, "true_timers");
    struct json_node coverage = json_member(&root, "post_depth_coverage");
    struct json_node binaries = json_member(&root, "program_binaries");
    struct json_node robust = json_member(&root, "robust");
    struct json_node compression = json_member(&root, "texture_compression");
    struct json_node software = json_member(&root, "software");
    struct json_node wide = json_member(&root, "wide_floats");
    struct json_node ratio = json_member(&root, "pairs_over_f64");
    return read_texts(&root, device) && read_numbers(&root, device) && read_lines(&root, device) &&
           json_read_bool(&software, &device->is_software) &&
           json_read_bool(&timers, &device->has_true_timers) &&
           json_read_bool(&coverage, &device->has_post_depth_coverage) &&
           json_read_bool(&binaries, &device->has_program_binaries) &&
           json_read_bool(&compression, &device->compresses_textures) &&
           json_read_text(&wide, device->wide_floats, sizeof device->wide_floats) &&
           json_read_number(&ratio, 0, INFINITY, &device->pairs_over_f64) &&
           json_read_bool(&robust, &device->is_robust) && read_auto(&root, &device->automatic) &&
           read_blocks(&root, &device->blocks);
}

/* ---- techniques ---- */

/* Every name of an enum, with one sentence on each. */
struct technique_kind {
    const char *key; /* the member of `quality` that chooses it */
    const char *(*name)(int index);
    const char *const *sentences;
};

static const char *const light_list_sentences[] = {
    "the fastest that loses no light: clustered",
    "tiles by depth slices, filled on the CPU with tight tests",
    "two-pass linked lists of rasterised light geometry (Lindbeck 2015), for comparison",
};
static const char *const filter_sentences[] = {
    "(1 - alpha) * (1 - alpha * (1 - base_color)): coloured glass and fabric",
    "1 - alpha: coverage, grey shadows",
    "(1 - alpha) * base_color",
    "(1 - alpha) * base_color / 2 (Modisett), for comparison",
};
static const char *const volume_map_sentences[] = {
    "volume, faithful: half floats hold logarithms, which are added up (Kim, Kim and Turk)",
    "half floats hold light, which is multiplied; it does not return to what it was",
};
static const char *const silhouette_form_sentences[] = {
    "silhouette: faces of volumes are drawn by compute programs, each once with what it counts",
    "a geometry program draws the face behind an edge as often as it counts",
    "likewise the tessellator (Lexolights, Peciva), for comparison",
    "the tessellator draws the sides behind each triangle, a geometry program the triangle",
    "the tessellator draws both at once",
    "a geometry program draws both at once",
    "a geometry program draws into a stencil of 8 bits, for one filter and point at a time",
};
static const char *const refraction_sentences[] = {
    "glass bends and scatters what is behind it as its material says",
    "all is seen straight through, whatever the index and the roughness",
};
static const char *const visibility_sentences[] = {
    "light of an environment map passes everything in rasterised pictures",
    "rays find what is in its way: environment_samples of them at each surface of a pixel",
};
#define ASSERT_SENTENCES(sentences, last)                                 \
    _Static_assert(sizeof(sentences) / sizeof *(sentences) == (last) + 1, \
                   "each name has a sentence")
ASSERT_SENTENCES(light_list_sentences, REQUEST_LIGHT_LISTS_LINKED);
ASSERT_SENTENCES(filter_sentences, REQUEST_BLEND_MODISETT);
ASSERT_SENTENCES(volume_map_sentences, REQUEST_VOLUME_FACTORS);
ASSERT_SENTENCES(silhouette_form_sentences, REQUEST_SILHOUETTE_STENCIL);
ASSERT_SENTENCES(refraction_sentences, REQUEST_REFRACTION_OFF);
ASSERT_SENTENCES(visibility_sentences, REQUEST_VISIBILITY_RAYS);

static const struct technique_kind technique_kinds[] = {
    {.key = "light_lists", .name = request_light_lists_name, .sentences = light_list_sentences},
    {.key = "blend_filter", .name = request_blend_filter_name, .sentences = filter_sentences},
    {.key = "volume_map", .name = request_volume_map_name, .sentences = volume_map_sentences},
    {.key = "silhouette_form",
     .name = request_silhouette_form_name,
     .sentences = silhouette_form_sentences},
    {.key = "refraction", .name = request_refraction_name, .sentences = refraction_sentences},
    {.key = "environment_visibility",
     .name = request_visibility_name,
     .sentences = visibility_sentences},
};

static json_t *write_kind(const struct technique_kind *kind)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; kind->name(i); i++) {
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", kind->name(i));
        json_put_text(&writer, "does", kind->sentences[i]);
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

static const unsigned ALL_NAMES = ~0u;

/* Those of the set; every enum here has less than 32. */
static json_t *write_names(const char *(*name)(int index), unsigned set)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; name(i); i++)
        if (set & 1u << i)
            json_append(array, json_string(name(i)), &has_failed);
    return json_take_unless(array, has_failed);
}

static json_t *write_shadows(void)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_technique_row *row = &shadow_technique_rows[i];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", row->name);
        json_put_text(&writer, "does", row->sentence);
        json_put(&writer, "can", write_names(shadow_can_name, row->can));
        json_put(&writer, "parameters", write_names(shadow_parameter_name, row->parameters));
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

static json_t *write_transparency(void)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        const struct transparency_row *row = &transparency_rows[i];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", row->name);
        json_put_text(&writer, "does", row->sentence);
        json_put(&writer, "can", write_names(transparency_can_name, row->can));
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

/* A whole-number parameter of quality. */
static json_t *write_parameter(int min, int max, int value, const int *allowed)
{
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "min", json_integer(min));
    json_put(&writer, "max", json_integer(max));
    json_put(&writer, "default", value ? json_integer(value) : json_null());
    if (allowed) {
        json_t *array = json_array();
        bool has_failed = !array;
        for (; *allowed; allowed++)
            json_append(array, json_integer(*allowed), &has_failed);
        json_put(&writer, "allowed", array);
        writer.has_failed = writer.has_failed || has_failed;
    }
    return json_writer_take(&writer);
}

/* An error of transmittances that deep lists may have; off by default. */
static json_t *write_error_parameter(void)
{
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "min", LIMIT_COMPRESSION_LEAST);
    json_put_number(&writer, "max", LIMIT_COMPRESSION_MOST);
    json_put(&writer, "default", json_null());
    return json_writer_take(&writer);
}

static json_t *write_techniques(void)
{
    static const int taps[] = {1, 4, 9, 16, 64, 0}, samples[] = {1, 4, 8, 16, 64, 256, 0};
    struct json_writer writer = json_writer_begin(), parameters = json_writer_begin();
    json_put(&writer, "shadows", write_shadows());
    json_put(&writer, "transparency", write_transparency());
    for (size_t i = 0; i < sizeof technique_kinds / sizeof *technique_kinds; i++)
        json_put(&writer, technique_kinds[i].key, write_kind(&technique_kinds[i]));
    struct render_request defaults;
    render_request_init_defaults(&defaults);
    const struct request_quality *quality = &defaults.quality;
    json_put(&parameters, "shadow_resolution",
             write_parameter(1, LIMIT_SHADOW_RESOLUTION, quality->shadow_resolution, NULL));
    json_put(&parameters, "shadow_taps",
             write_parameter(1, LIMIT_SHADOW_TAPS, quality->shadow_taps, taps));
    json_put(&parameters, "shadow_prefilter",
             write_parameter(1, LIMIT_PREFILTER, quality->shadow_prefilter, NULL));
    json_put(&parameters, "shadow_compression", write_error_parameter());
    json_put(&parameters, "shadow_fallback", write_error_parameter());
    json_put(&parameters, "samples", write_parameter(1, 256, quality->samples, samples));
    json_put(&parameters, "area_samples",
             write_parameter(1, LIMIT_AREA_SAMPLES, quality->area_samples, NULL));
    json_put(&parameters, "environment_samples",
             write_parameter(1, LIMIT_ENVIRONMENT_SAMPLES, quality->environment_samples, NULL));
    json_put(&parameters, "atmosphere_samples",
             write_parameter(1, LIMIT_ATMOSPHERE_SAMPLES, quality->atmosphere_samples, NULL));
    json_put(&parameters, "refraction_samples",
             write_parameter(1, LIMIT_REFRACTION_SAMPLES, quality->refraction_samples, NULL));
    json_put(&writer, "parameters", json_writer_take(&parameters));
    return json_writer_take(&writer);
}

/* ---- the whole ---- */

static json_t *write_limits(uint64_t max_upload_bytes)
{
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "image_side_px", LIMIT_IMAGE_SIDE_PX);
    json_put_integer(&writer, "request_bytes", LIMIT_REQUEST_JSON_BYTES);
    json_put_integer(&writer, "lights", LIMIT_REQUEST_LIGHTS);
    json_put_integer(&writer, "overrides", LIMIT_REQUEST_OVERRIDES);
    json_put_integer(&writer, "clip_planes", LIMIT_CLIP_PLANES);
    json_put_integer(&writer, "parts", LIMIT_PARTS);
    json_put_integer(&writer, "part_scenes", LIMIT_PART_SCENES);
    json_put_integer(&writer, "outputs", LIMIT_OUTPUTS);
    json_put_integer(&writer, "socket_message_bytes", LIMIT_SOCKET_MESSAGE_BYTES);
    json_put_integer(&writer, "name_bytes", LIMIT_NAME_BYTES);
    json_put_integer(&writer, "upload_bytes", max_upload_bytes);
    json_put_integer(&writer, "upload_files", LIMIT_UPLOAD_FILES);
    json_put_integer(&writer, "queue_depth", LIMIT_QUEUE_DEPTH);
    json_put_integer(&writer, "frames_kept", LIMIT_FRAMES_KEPT);
    json_put_number(&writer, "coordinate_m", LIMIT_COORDINATE);
    json_put_number(&writer, "intensity", LIMIT_INTENSITY);
    json_put_number(&writer, "line_px_min", LIMIT_LINE_PX_MIN);
    json_put_number(&writer, "line_px_max", LIMIT_LINE_PX_MAX);
    return json_writer_take(&writer);
}

/* A list that ends with NULL; NULL: an empty one. */
static json_t *write_texts(const char *const *texts)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (; texts && *texts; texts++)
        json_append(array, json_text(*texts), &has_failed);
    return json_take_unless(array, has_failed);
}

/* Words with a blank between two; NULL: none. */
static json_t *write_words(const char *words)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (const char *at = words ? words : ""; *at;) {
        size_t length = strcspn(at, " ");
        json_append(array, json_stringn(at, length), &has_failed);
        at += length + strspn(at + length, " ");
    }
    return json_take_unless(array, has_failed);
}

static json_t *write_scene_formats(void)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (int i = 0; i < SCENE_FORMAT_COUNT; i++) {
        const struct scene_format_info *format = scene_format_describe((enum scene_format)i);
        if (!format->is_built)
            continue;
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", format->name);
        json_put_text(&writer, "title", format->title);
        json_put(&writer, "suffixes", write_words(format->suffixes));
        json_put(&writer, "media_types", write_words(format->media_types));
        json_append(array, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(array, has_failed);
}

static const char *const overlays[] = {"highlight", "edges", NULL}; /* members of a request */
static const char *const indexed[] = {"lights", NULL}; /* lists that patches change one by one */

json_t *capabilities_to_json(const struct capabilities *capabilities)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "version", capabilities->version);
    json_put(&writer, "device",
             capabilities->device ? device_capabilities_to_json(capabilities->device)
                                  : json_null());
    json_put(&writer, "limits", write_limits(capabilities->max_upload_bytes));
    json_put(&writer, "techniques", write_techniques());
    json_put(&writer, "light_types", write_names(request_light_type_name, ALL_NAMES));
    json_put(&writer, "tone_mappings", write_names(request_tone_mapping_name, ALL_NAMES));
    json_put(&writer, "outputs", write_names(request_output_name, ALL_NAMES));
    json_put(&writer, "overlays", write_texts(overlays));
    json_put(&writer, "indexed_patches", write_texts(indexed));
    json_put(&writer, "formats", write_names(request_format_name, ALL_NAMES << REQUEST_FORMAT_PNG));
    json_put(&writer, "scene_formats", write_scene_formats());
    json_put(&writer, "extensions", write_texts(capabilities->extensions));
    return json_writer_take(&writer);
}
