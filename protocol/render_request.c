/* SPDX-License-Identifier: MIT */
/* Render requests: wire names, defaults, and release. */
#include "protocol/render_request.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/quality_defaults.h"

#define NAME_OF(index, ...)                           \
    static const char *const names[] = {__VA_ARGS__}; \
    return (index) >= 0 && (size_t)(index) < sizeof names / sizeof *names ? names[index] : NULL

const char *request_fit_name(int fit)
{
    NAME_OF(fit, "front", "top", "right", "iso", "back", "left", "bottom", "three-quarter");
}

const char *request_light_type_name(int type)
{
    NAME_OF(type, "directional", "point", "spot", "rect", "disk");
}

const char *request_alpha_mode_name(int mode)
{
    NAME_OF(mode, "opaque", "mask", "blend");
}

const char *request_pass_through_name(int model)
{
    NAME_OF(model, "constant", "slab", "edge");
}

const char *request_tone_mapping_name(int mapping)
{
    NAME_OF(mapping, "neutral", "none", "agx", "aces");
}

const char *request_studio_name(int studio)
{
    NAME_OF(studio, "auto", "on", "off");
}

const char *request_light_lists_name(int light_lists)
{
    NAME_OF(light_lists, "auto", "clustered", "linked");
}

const char *request_blend_filter_name(int filter)
{
    NAME_OF(filter, "tint", "coverage", "kim", "modisett");
}

const char *request_volume_map_name(int map)
{
    NAME_OF(map, "logarithms", "factors");
}

const char *request_silhouette_form_name(int form)
{
    NAME_OF(form, "compute", "geometry", "tessellation", "triangles-two-pass", "triangles-one-pass",
            "triangles-geometry", "stencil");
}

const char *request_refraction_name(int refraction)
{
    NAME_OF(refraction, "auto", "off");
}

const char *request_visibility_name(int visibility)
{
    NAME_OF(visibility, "none", "rays");
}

const char *request_output_name(int output)
{
    NAME_OF(output, "color", "depth", "normal", "albedo", "node", "material", "position",
            "transmittance", "lights", "layers", "optical_depth");
}

const char *request_format_name(int format)
{
    NAME_OF(format, "any", "png", "jpeg", "webp", "exr", "exr-deep");
}

bool request_quality_asks(const struct request_quality *quality)
{
    return quality->max_error > 0 || quality->budget_ms > 0;
}

unsigned render_request_needs(const struct render_request *request)
{
    bool has_linked_lists = request->quality.light_lists == REQUEST_LIGHT_LISTS_LINKED;
    return (has_linked_lists ? SHADOW_CAN_LINKED_LISTS : 0u) |
           (request->atmosphere.density > 0 ? SHADOW_CAN_ATMOSPHERE : 0u);
}

/* Where exact lists exceed the budget, the error that was asked for is allowed to them, too. */
static void set_lists(struct request_quality *quality, const struct quality_setting *setting)
{
    bool has_lists = shadow_technique_has(setting->shadows, SHADOW_HAS_LISTS);
    double error = quality->max_error > 0 ? quality->max_error : quality->shadow_fallback;
    if (setting->shadow_compression > 0 || !has_lists)
        quality->shadow_compression = setting->shadow_compression;
    if (setting->shadow_prefilter > 1 || !has_lists)
        quality->shadow_prefilter = setting->shadow_prefilter > 1 ? setting->shadow_prefilter : 1;
    if (!has_lists)
        quality->shadow_fallback = 0;
    else if (quality->shadow_fallback <= 0 && error >= LIMIT_COMPRESSION_LEAST)
        quality->shadow_fallback = fmin(error, LIMIT_COMPRESSION_MOST);
}

void request_quality_set(struct request_quality *quality, const struct quality_setting *setting)
{
    set_lists(quality, setting);
    quality->shadows = setting->shadows;
    if (setting->shadow_resolution) {
        quality->shadow_resolution = setting->shadow_resolution;
        quality->shadow_taps = setting->shadow_taps;
    }
    quality->samples = setting->samples;
    if (setting->atmosphere_samples)
        quality->atmosphere_samples = setting->atmosphere_samples;
    if (setting->transparency != TRANSPARENCY_AUTO)
        quality->transparency = setting->transparency;
    quality->max_error = quality->budget_ms = 0;
    quality->says_shadow_resolution = quality->says_shadow_taps = false;
}

void render_request_init_defaults(struct render_request *request)
{
    *request = (struct render_request){
        .width = 1280,
        .height = 720,
        .quality = {.shadow_resolution = SHADOW_RESOLUTION_DEFAULT,
                    .shadow_taps = SHADOW_TAPS_DEFAULT,
                    .shadow_prefilter = 1},
        .environment = {.intensity = 1},
        .outputs = 1u << REQUEST_OUTPUT_COLOR,
    };
}

void render_request_finish(struct render_request *request)
{
    free(request->camera.node);
    free(request->animation.name);
    free(request->variant);
    for (size_t i = 0; i < request->highlight.node_count; i++)
        free(request->highlight.nodes[i]);
    free(request->highlight.nodes);
    free(request->lights);
    for (size_t i = 0; i < request->node_count; i++)
        free(request->nodes[i].node);
    free(request->nodes);
    for (size_t i = 0; i < request->grid_count; i++)
        free(request->grids[i].grid);
    free(request->grids);
    for (size_t i = 0; i < request->material_count; i++)
        free(request->materials[i].material);
    free(request->materials);
    for (size_t i = 0; i < request->part_count; i++) {
        free(request->parts[i].name);
        free(request->parts[i].parent);
    }
    free(request->parts);
    *request = (struct render_request){0};
}
