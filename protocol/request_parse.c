/* SPDX-License-Identifier: MIT */
/* Reading a render request: its own members, quality, and outputs. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/picture_tiles.h"
#include "protocol/request_parts.h"

bool request_read_scene(const struct json_node *node, char scene[65])
{
    const char *name = NULL;
    if (!json_expect_present(node) || !json_read_name(node, &name))
        return false;
    if (strlen(name) != 64 || strspn(name, "0123456789abcdef") != 64)
        return json_refuse(node, ERROR_NOT_FOUND,
                           "but scene ids are 64 lowercase hexadecimal digits");
    memcpy(scene, name, 65);
    return true;
}

/* ---- quality ---- */

static bool read_techniques(const struct json_node *node, struct request_quality *quality)
{
    const struct json_choice shadows = {.name = shadow_technique_name};
    const struct json_choice transparency = {.name = transparency_name};
    const struct json_choice light_lists = {.name = request_light_lists_name};
    const struct json_choice filters = {.name = request_blend_filter_name};
    const struct json_choice volume_maps = {.name = request_volume_map_name};
    const struct json_choice silhouette_forms = {.name = request_silhouette_form_name};
    const struct json_choice refractions = {.name = request_refraction_name};
    const struct json_choice visibilities = {.name = request_visibility_name};
    struct json_node shadows_node = json_member(node, "shadows");
    struct json_node transparency_node = json_member(node, "transparency");
    struct json_node light_lists_node = json_member(node, "light_lists");
    struct json_node filter_node = json_member(node, "blend_filter");
    struct json_node volume_map_node = json_member(node, "volume_map");
    struct json_node silhouette_form_node = json_member(node, "silhouette_form");
    struct json_node refraction_node = json_member(node, "refraction");
    struct json_node visibility_node = json_member(node, "environment_visibility");
    int shadow = 0, transparent = 0, light_list = 0, filter = 0, refraction = 0, visibility = 0;
    int volume_map = 0, silhouette_form = 0;
    if (!json_read_choice(&shadows_node, &shadows, &shadow) ||
        !json_read_choice(&transparency_node, &transparency, &transparent) ||
        !json_read_choice(&light_lists_node, &light_lists, &light_list) ||
        !json_read_choice(&filter_node, &filters, &filter) ||
        !json_read_choice(&volume_map_node, &volume_maps, &volume_map) ||
        !json_read_choice(&silhouette_form_node, &silhouette_forms, &silhouette_form) ||
        !json_read_choice(&refraction_node, &refractions, &refraction) ||
        !json_read_choice(&visibility_node, &visibilities, &visibility))
        return false;
    quality->shadows = (enum shadow_technique)shadow;
    quality->transparency = (enum transparency)transparent;
    quality->light_lists = (enum request_light_lists)light_list;
    quality->blend_filter = (enum request_blend_filter)filter;
    quality->volume_map = (enum request_volume_map)volume_map;
    quality->silhouette_form = (enum request_silhouette_form)silhouette_form;
    quality->refraction = (enum request_refraction)refraction;
    quality->environment_visibility = (enum request_visibility)visibility;
    return true;
}

/* What changes deep lists, and the techniques that have them. */
static bool read_deep_lists(const struct json_node *node, struct request_quality *quality)
{
    struct json_node compression = json_member(node, "shadow_compression");
    struct json_node prefilter = json_member(node, "shadow_prefilter");
    struct json_node fallback = json_member(node, "shadow_fallback");
    if (!json_read_number(&compression, LIMIT_COMPRESSION_LEAST, LIMIT_COMPRESSION_MOST,
                          &quality->shadow_compression) ||
        !json_read_int(&prefilter, 1, LIMIT_PREFILTER, &quality->shadow_prefilter) ||
        !json_read_number(&fallback, LIMIT_COMPRESSION_LEAST, LIMIT_COMPRESSION_MOST,
                          &quality->shadow_fallback))
        return false;
    char others[SHADOW_TECHNIQUES_TEXT_BYTES];
    bool has_lists =
        !quality->reference && shadow_technique_has(quality->shadows, SHADOW_HAS_LISTS);
    const struct json_node *said = quality->shadow_compression > 0 ? &compression
                                   : quality->shadow_prefilter > 1 ? &prefilter
                                   : quality->shadow_fallback > 0  ? &fallback
                                                                   : NULL;
    if (!said || has_lists)
        return true;
    shadow_techniques_text(0, SHADOW_HAS_LISTS, others);
    return json_refuse(said, ERROR_INVALID_REQUEST,
                       "but only deep lists can be compressed or averaged, and %s has none: "
                       "shadows must be %s",
                       quality->reference ? "the reference"
                                          : shadow_technique_name((int)quality->shadows),
                       others);
}

static bool read_quality(const struct json_node *node, struct request_quality *quality)
{
    static const char *const known[] = {"shadows",
                                        "transparency",
                                        "light_lists",
                                        "blend_filter",
                                        "volume_map",
                                        "silhouette_form",
                                        "refraction",
                                        "shadow_resolution",
                                        "shadow_taps",
                                        "samples",
                                        "faithful",
                                        "reference",
                                        "area_samples",
                                        "environment_samples",
                                        "atmosphere_samples",
                                        "refraction_samples",
                                        "environment_visibility",
                                        "max_error",
                                        "budget_ms",
                                        "shadow_compression",
                                        "shadow_prefilter",
                                        "shadow_fallback",
                                        NULL};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known) || !read_techniques(node, quality))
        return false;
    struct json_node resolution = json_member(node, "shadow_resolution");
    struct json_node taps = json_member(node, "shadow_taps");
    struct json_node samples = json_member(node, "samples");
    struct json_node faithful = json_member(node, "faithful");
    struct json_node reference = json_member(node, "reference");
    struct json_node area_samples = json_member(node, "area_samples");
    struct json_node environment_samples = json_member(node, "environment_samples");
    struct json_node atmosphere_samples = json_member(node, "atmosphere_samples");
    struct json_node refraction_samples = json_member(node, "refraction_samples");
    struct json_node max_error = json_member(node, "max_error");
    struct json_node budget_ms = json_member(node, "budget_ms");
    if (!json_read_int(&resolution, 1, LIMIT_SHADOW_RESOLUTION, &quality->shadow_resolution) ||
        !json_read_int(&taps, 1, LIMIT_SHADOW_TAPS, &quality->shadow_taps) ||
        !json_read_int(&samples, 1, 256, &quality->samples) ||
        !json_read_bool(&faithful, &quality->faithful) ||
        !json_read_bool(&reference, &quality->reference) ||
        !json_read_int(&area_samples, 1, LIMIT_AREA_SAMPLES, &quality->area_samples) ||
        !json_read_int(&environment_samples, 1, LIMIT_ENVIRONMENT_SAMPLES,
                       &quality->environment_samples) ||
        !json_read_int(&atmosphere_samples, 1, LIMIT_ATMOSPHERE_SAMPLES,
                       &quality->atmosphere_samples) ||
        !json_read_int(&refraction_samples, 1, LIMIT_REFRACTION_SAMPLES,
                       &quality->refraction_samples) ||
        !json_read_number(&max_error, 1e-9, 1e6, &quality->max_error) ||
        !json_read_number(&budget_ms, 0.001, 86400000, &quality->budget_ms) ||
        !read_deep_lists(node, quality))
        return false;
    bool asks = request_quality_asks(quality);
    quality->says_shadow_resolution = asks && resolution.value;
    quality->says_shadow_taps = asks && taps.value;
    if (!taps.value)
        quality->shadow_taps = shadow_technique_taps(quality->shadows, 0);
    int n = quality->shadow_taps;
    if (n != 1 && n != 4 && n != 9 && n != 16 && n != 64)
        return json_refuse(&taps, ERROR_INVALID_REQUEST, "must be 1, 4, 9, 16 or 64");
    char others[SHADOW_TECHNIQUES_TEXT_BYTES];
    if (quality->reference && !shadow_technique_can(quality->shadows, SHADOW_CAN_REFERENCE)) {
        shadow_techniques_text(SHADOW_CAN_REFERENCE, 0, others);
        return json_refuse(&reference, ERROR_INVALID_REQUEST,
                           "but the reference is ray traced: shadows must be %s", others);
    }
    if (quality->light_lists == REQUEST_LIGHT_LISTS_LINKED &&
        !shadow_technique_can(quality->shadows, SHADOW_CAN_LINKED_LISTS)) {
        struct json_node light_lists = json_member(node, "light_lists");
        return json_refuse(&light_lists, ERROR_INVALID_REQUEST,
                           "must be auto or clustered: %s follow the lists that are "
                           "filled on the CPU",
                           shadow_technique_name((int)quality->shadows));
    }
    bool is_traced =
        quality->reference || shadow_technique_can(quality->shadows, SHADOW_CAN_MANY_SAMPLES);
    n = quality->samples;
    if (quality->reference && n == 8)
        return json_refuse(&samples, ERROR_INVALID_REQUEST,
                           "must be 1, 4, 16, 64 or 256: the reference takes a regular grid");
    if (n != 0 && n != 1 && n != 4 && n != 8 && n != 16 && !(is_traced && (n == 64 || n == 256)))
        return json_refuse(&samples, ERROR_INVALID_REQUEST,
                           "must be 1, 4, 8 or 16, or with raytraced shadows also 64 or 256");
    return true;
}

/* ---- the picture ---- */

/* Whether, or in which colour. */
static bool read_cap(const struct json_node *node, struct request_cut *cut)
{
    cut->has_cap_color = json_is_array(node->value);
    cut->has_cap = cut->has_cap_color;
    if (!(cut->has_cap_color ? json_read_numbers(node, 3, 0, 1, cut->cap_color)
                             : json_read_bool(node, &cut->has_cap)))
        return false;
    return !cut->has_cap || !cut->spares_shadows ||
           json_refuse(node, ERROR_INVALID_REQUEST,
                       "but a plane whose shadows is false has no cap");
}

/* Its four numbers, or an object that has them as `plane`. */
static bool read_clip_plane(const struct json_node *node, double plane[4], struct request_cut *cut)
{
    static const char *const known[] = {"plane", "shadows", "cap", NULL};
    struct json_node numbers = *node;
    bool cuts_shadows = true;
    *cut = (struct request_cut){0};
    if (json_is_object(node->value)) {
        struct json_node shadows = json_member(node, "shadows");
        numbers = json_member(node, "plane");
        if (!json_expect_object(node, known) || !json_expect_present(&numbers) ||
            !json_read_bool(&shadows, &cuts_shadows))
            return false;
        cut->spares_shadows = !cuts_shadows;
        struct json_node cap = json_member(node, "cap");
        if (!read_cap(&cap, cut))
            return false;
    }
    if (!json_read_numbers(&numbers, 4, -LIMIT_COORDINATE, LIMIT_COORDINATE, plane))
        return false;
    return fmax(fmax(fabs(plane[0]), fabs(plane[1])), fabs(plane[2])) >= 1e-15 ||
           json_refuse(&numbers, ERROR_INVALID_REQUEST,
                       "but its first three numbers, the normal, must not be zero");
}

static bool read_clip_planes(const struct json_node *node, struct render_request *request)
{
    size_t count;
    if (!json_expect_array(node, LIMIT_CLIP_PLANES, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node plane = json_element(node, i);
        if (!read_clip_plane(&plane, request->clip_planes[i], &request->cuts[i]))
            return false;
    }
    request->clip_plane_count = count;
    return true;
}

/* Which map: one that is built in, or the id of one. */
static bool read_map(const struct json_node *node, char image[65])
{
    const char *name = "";
    if (!json_read_name(node, &name))
        return false;
    bool is_id = strlen(name) == 64 && strspn(name, "0123456789abcdef") == 64;
    if (*name && !is_id && strcmp(name, REQUEST_ENVIRONMENT_STUDIO) != 0)
        return json_refuse(node, ERROR_NOT_FOUND,
                           "but an environment map is '" REQUEST_ENVIRONMENT_STUDIO
                           "' or an id, 64 lowercase hexadecimal digits");
    memcpy(image, name, strlen(name) + 1);
    return true;
}

static bool read_environment(const struct json_node *node, struct render_request *request)
{
    static const char *const known[] = {"sky",       "ground",     "image", "rotation_deg",
                                        "intensity", "background", NULL};
    struct request_environment *map = &request->environment;
    request->has_environment = node->value;
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node sky = json_member(node, "sky"), ground = json_member(node, "ground");
    struct json_node image = json_member(node, "image");
    struct json_node rotation = json_member(node, "rotation_deg");
    struct json_node intensity = json_member(node, "intensity");
    struct json_node background = json_member(node, "background");
    return json_read_numbers(&sky, 3, 0, LIMIT_INTENSITY, request->sky) &&
           json_read_numbers(&ground, 3, 0, LIMIT_INTENSITY, request->ground) &&
           read_map(&image, map->image) &&
           json_read_number(&rotation, -360, 360, &map->rotation_deg) &&
           json_read_number(&intensity, 0, LIMIT_ENVIRONMENT_INTENSITY, &map->intensity) &&
           json_read_bool(&background, &map->is_background);
}

static bool read_animation(const struct json_node *node, struct request_animation *animation)
{
    static const char *const known[] = {"name", "time_s", NULL};
    animation->is_given = node->value;
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node name = json_member(node, "name"), time = json_member(node, "time_s");
    const char *text = NULL;
    if (!json_read_name(&name, &text) || !json_read_number(&time, 0, 1e9, &animation->time_s))
        return false;
    if (text && !(animation->name = strdup(text)))
        return error_set(node->err, ERROR_NO_MEMORY, "name of an animation");
    return true;
}

static bool read_variant(const struct json_node *node, struct render_request *request)
{
    const char *text = NULL;
    if (!json_read_name(node, &text))
        return false;
    if (text && !(request->variant = strdup(text)))
        return error_set(node->err, ERROR_NO_MEMORY, "name of a variant");
    return true;
}

static bool read_background(const struct json_node *node, double *background)
{
    bool is_opaque = json_is_array(node->value) && json_array_size(node->value) == 3;
    if (!json_read_numbers(node, is_opaque ? 3 : 4, 0, LIMIT_INTENSITY, background))
        return false;
    if (is_opaque)
        background[3] = 1;
    if (background[3] > 1) {
        struct json_node alpha = json_element(node, 3);
        return json_refuse(&alpha, ERROR_INVALID_REQUEST, "alpha must be from 0 to 1");
    }
    return true;
}

/* ---- outputs and format ---- */

static bool read_output(const struct json_node *node, uint32_t *outputs)
{
    const struct json_choice choice = {.name = request_output_name};
    int index = 0;
    if (!json_read_choice(node, &choice, &index))
        return false;
    if (*outputs & 1u << index)
        return json_refuse(node, ERROR_INVALID_REQUEST, "for the second time");
    *outputs |= 1u << index;
    return true;
}

static bool read_outputs(const struct json_node *root, struct render_request *request)
{
    struct json_node output = json_member(root, "output"), outputs = json_member(root, "outputs");
    size_t count;
    uint32_t found = 0;
    if (output.value && outputs.value)
        return json_refuse(&outputs, ERROR_INVALID_REQUEST, "but 'output' is given already");
    if (output.value && !read_output(&output, &found))
        return false;
    if (!json_expect_array(&outputs, LIMIT_OUTPUTS, &count))
        return false;
    if (outputs.value && count == 0)
        return json_refuse(&outputs, ERROR_INVALID_REQUEST, "at least one output is needed");
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(&outputs, i);
        if (!read_output(&element, &found))
            return false;
    }
    if (found)
        request->outputs = found;
    return true;
}

static bool read_format(const struct json_node *root, struct render_request *request)
{
    const struct json_choice choice = {.name = request_format_name, .first = REQUEST_FORMAT_PNG};
    struct json_node format = json_member(root, "format");
    struct json_node quality = json_member(root, "quality_percent");
    struct json_node provenance = json_member(root, "provenance");
    int index = REQUEST_FORMAT_ANY;
    bool has_provenance = true;
    if (!json_read_choice(&format, &choice, &index) ||
        !json_read_int(&quality, 1, 100, &request->quality_percent) ||
        !json_read_bool(&provenance, &has_provenance))
        return false;
    request->omits_provenance = !has_provenance;
    request->format = (enum request_format)index;
    bool is_lossless = index == REQUEST_FORMAT_PNG || index >= REQUEST_FORMAT_EXR;
    if (quality.value && is_lossless)
        return json_refuse(&quality, ERROR_INVALID_REQUEST, "but %s is lossless",
                           request_format_name(index));
    char why[DEEP_FAULT_BYTES];
    if (index == REQUEST_FORMAT_EXR_DEEP &&
        render_request_deep_fault(request, request->outputs, why))
        return json_refuse(&format, ERROR_UNSUPPORTED, "%s", why);
    bool has_several = request->outputs & (request->outputs - 1);
    if (has_several && index != REQUEST_FORMAT_ANY && index != REQUEST_FORMAT_EXR)
        return json_refuse(&format, ERROR_INVALID_REQUEST,
                           "which holds one output; several need \"exr\"");
    return true;
}

/* ---- the whole ---- */

static bool read_exposure(const struct json_node *node, struct render_request *request)
{
    const char *text = json_is_string(node->value) ? json_string_value(node->value) : NULL;
    request->meters_exposure = text && strcmp(text, "auto") == 0;
    if (text && !request->meters_exposure)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a number or \"auto\"");
    return text || json_read_number(node, -64, 64, &request->exposure_ev);
}

static bool read_members(const struct json_node *root, struct render_request *request)
{
    const struct json_choice mappings = {.name = request_tone_mapping_name};
    const struct json_choice studios = {.name = request_studio_name};
    struct json_node scene = json_member(root, "scene");
    struct json_node width = json_member(root, "width"), height = json_member(root, "height");
    struct json_node scene_lights = json_member(root, "scene_lights");
    struct json_node studio = json_member(root, "studio");
    struct json_node animation = json_member(root, "animation");
    struct json_node variant = json_member(root, "variant");
    struct json_node background = json_member(root, "background");
    struct json_node exposure = json_member(root, "exposure_ev");
    struct json_node mapping = json_member(root, "tone_mapping");
    bool has_scene_lights = true;
    int mapping_index = 0, studio_index = 0;
    if (!request_read_scene(&scene, request->scene) ||
        !json_read_int(&width, 1, LIMIT_PICTURE_SIDE_PX, &request->width) ||
        !json_read_int(&height, 1, LIMIT_PICTURE_SIDE_PX, &request->height) ||
        !json_read_bool(&scene_lights, &has_scene_lights) ||
        !json_read_choice(&studio, &studios, &studio_index) ||
        !read_background(&background, request->background) || !read_exposure(&exposure, request) ||
        !json_read_choice(&mapping, &mappings, &mapping_index) ||
        !read_animation(&animation, &request->animation) || !read_variant(&variant, request))
        return false;
    request->ignore_scene_lights = !has_scene_lights;
    request->studio = (enum request_studio)studio_index;
    request->tone_mapping = (enum request_tone_mapping)mapping_index;
    return true;
}

static bool read_tile(const struct json_node *node, struct render_request *request)
{
    static const char *const known[] = {"x", "y", "width", "height", NULL};
    struct request_tile *tile = &request->tile;
    if (!node->value)
        return true;
    struct json_node x = json_member(node, "x"), y = json_member(node, "y");
    struct json_node width = json_member(node, "width"), height = json_member(node, "height");
    tile->is_given = true;
    if (!json_expect_object(node, known) || !json_expect_present(&width) ||
        !json_expect_present(&height) || !json_read_int(&x, 0, request->width - 1, &tile->x) ||
        !json_read_int(&y, 0, request->height - 1, &tile->y) ||
        !json_read_int(&width, 1, LIMIT_IMAGE_SIDE_PX, &tile->width) ||
        !json_read_int(&height, 1, LIMIT_IMAGE_SIDE_PX, &tile->height))
        return false;
    if (tile->width > request->width - tile->x)
        return json_refuse(&width, ERROR_INVALID_REQUEST,
                           "but the picture has %d columns from x %d on", request->width - tile->x,
                           tile->x);
    if (tile->height > request->height - tile->y)
        return json_refuse(&height, ERROR_INVALID_REQUEST,
                           "but the picture has %d rows from y %d on", request->height - tile->y,
                           tile->y);
    return true;
}

/* Larger ones are rendered in tiles. */
static bool check_size(const struct json_node *root, const struct render_request *request)
{
    struct json_node width = json_member(root, "width"), height = json_member(root, "height");
    if (request->tile.is_given || !picture_needs_tiles(request->width, request->height))
        return true;
    return json_refuse(request->width > LIMIT_IMAGE_SIDE_PX ? &width : &height,
                       ERROR_INVALID_REQUEST,
                       "must be from 1 to %d; tiles of a picture of up to %d a side are rendered "
                       "one by one, by tile",
                       LIMIT_IMAGE_SIDE_PX, LIMIT_PICTURE_SIDE_PX);
}

static bool read_ground_plane(const struct json_node *node, struct request_ground_plane *plane)
{
    static const char *const known[] = {"height", NULL};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node height = json_member(node, "height");
    *plane = (struct request_ground_plane){.is_given = true, .has_height = height.value};
    return json_read_number(&height, -LIMIT_COORDINATE, LIMIT_COORDINATE, &plane->height);
}

static bool read_atmosphere(const struct json_node *node, struct request_atmosphere *atmosphere)
{
    static const char *const known[] = {"density",   "color",  "anisotropy",
                                        "falloff_m", "base_m", NULL};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node density = json_member(node, "density"), color = json_member(node, "color");
    struct json_node anisotropy = json_member(node, "anisotropy");
    struct json_node falloff = json_member(node, "falloff_m");
    struct json_node base = json_member(node, "base_m");
    *atmosphere = (struct request_atmosphere){.is_given = true, .color = {1, 1, 1}};
    return json_expect_present(&density) &&
           json_read_number(&density, 0, LIMIT_HAZE_DENSITY, &atmosphere->density) &&
           json_read_numbers(&color, 3, 0, 1, atmosphere->color) &&
           json_read_number(&anisotropy, -LIMIT_HAZE_ANISOTROPY, LIMIT_HAZE_ANISOTROPY,
                            &atmosphere->anisotropy) &&
           json_read_number(&falloff, 0, LIMIT_HAZE_FALLOFF, &atmosphere->falloff) &&
           json_read_number(&base, -LIMIT_COORDINATE, LIMIT_COORDINATE, &atmosphere->base);
}

/* Those of images first, then those that a view has, too. */
static const char *const request_members[] = {
    "output",       "outputs",      "format",      "quality_percent", "provenance",
    "tile",         "scene",        "width",       "height",          "camera",
    "lights",       "scene_lights", "overrides",   "parts",           "clip_planes",
    "animation",    "background",   "exposure_ev", "tone_mapping",    "environment",
    "quality",      "highlight",    "edges",       "variant",         "studio",
    "ground_plane", "atmosphere",   NULL};
enum { MEMBERS_OF_IMAGES = 6 };

const char *const *request_view_members(void)
{
    return request_members + MEMBERS_OF_IMAGES;
}

static bool read_request(const struct json_node *root, struct render_request *request)
{
    if (!json_expect_object(root, request_members) || !read_members(root, request))
        return false;
    struct json_node camera = json_member(root, "camera"), lights = json_member(root, "lights");
    struct json_node overrides = json_member(root, "overrides");
    struct json_node clip_planes = json_member(root, "clip_planes");
    struct json_node environment = json_member(root, "environment");
    struct json_node highlight = json_member(root, "highlight"), edges = json_member(root, "edges");
    struct json_node quality = json_member(root, "quality");
    struct json_node ground_plane = json_member(root, "ground_plane");
    struct json_node atmosphere = json_member(root, "atmosphere");
    struct json_node parts = json_member(root, "parts"), tile = json_member(root, "tile");
    return request_read_camera(&camera, &request->camera) &&
           request_read_lights(&lights, request) && request_read_overrides(&overrides, request) &&
           request_read_parts(&parts, request) && read_clip_planes(&clip_planes, request) &&
           read_environment(&environment, request) &&
           read_ground_plane(&ground_plane, &request->ground_plane) &&
           read_atmosphere(&atmosphere, &request->atmosphere) &&
           request_read_highlight(&highlight, &request->highlight) &&
           request_read_edges(&edges, &request->edges) &&
           read_quality(&quality, &request->quality) && read_outputs(root, request) &&
           read_format(root, request) && read_tile(&tile, request);
}

bool request_read_picture(const struct json_node *root, struct render_request *request)
{
    render_request_init_defaults(request);
    if (read_request(root, request))
        return true;
    render_request_finish(request);
    return false;
}

bool request_read_root(const struct json_node *root, struct render_request *request)
{
    if (!request_read_picture(root, request))
        return false;
    if (check_size(root, request))
        return true;
    render_request_finish(request);
    return false;
}

bool render_request_parse(const char *json, size_t length, struct render_request *request,
                          struct error *err)
{
    *request = (struct render_request){0};
    json_t *value = json_load_checked(json, length, LIMIT_CANONICAL_JSON_BYTES, err);
    if (!value)
        return false;
    struct json_node root = json_root(value, err);
    bool is_read = request_read_root(&root, request);
    json_decref(value);
    return is_read;
}
