/* SPDX-License-Identifier: MIT */
/* Requests to views. The enums of both sides are in the same order, which is asserted here. */
#include "server/mapping/view_mapping.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#define SAME(wire, own) static_assert((int)(wire) == (int)(own), #wire " is not " #own)
SAME(REQUEST_CAMERA_DEFAULT, VIEW_CAMERA_DEFAULT);
SAME(REQUEST_CAMERA_NODE, VIEW_CAMERA_NODE);
SAME(REQUEST_CAMERA_LOOK_AT, VIEW_CAMERA_LOOK_AT);
SAME(REQUEST_CAMERA_MATRIX, VIEW_CAMERA_MATRIX);
SAME(REQUEST_CAMERA_FIT, VIEW_CAMERA_FIT);
SAME(REQUEST_FIT_FRONT, VIEW_FIT_FRONT);
SAME(REQUEST_FIT_TOP, VIEW_FIT_TOP);
SAME(REQUEST_FIT_RIGHT, VIEW_FIT_RIGHT);
SAME(REQUEST_FIT_ISO, VIEW_FIT_ISO);
SAME(REQUEST_FIT_BACK, VIEW_FIT_BACK);
SAME(REQUEST_FIT_LEFT, VIEW_FIT_LEFT);
SAME(REQUEST_FIT_BOTTOM, VIEW_FIT_BOTTOM);
SAME(REQUEST_FIT_THREE_QUARTER, VIEW_FIT_THREE_QUARTER);
SAME(REQUEST_LIGHT_DIRECTIONAL, SCENE_LIGHT_DIRECTIONAL);
SAME(REQUEST_LIGHT_POINT, SCENE_LIGHT_POINT);
SAME(REQUEST_LIGHT_SPOT, SCENE_LIGHT_SPOT);
SAME(REQUEST_LIGHT_RECT, SCENE_LIGHT_RECT);
SAME(REQUEST_LIGHT_DISK, SCENE_LIGHT_DISK);
SAME(REQUEST_ALPHA_OPAQUE, SCENE_OPAQUE);
SAME(REQUEST_ALPHA_MASK, SCENE_MASK);
SAME(REQUEST_ALPHA_BLEND, SCENE_BLEND);
SAME(REQUEST_PASS_CONSTANT, SCENE_PASS_CONSTANT);
SAME(REQUEST_PASS_SLAB, SCENE_PASS_SLAB);
SAME(REQUEST_PASS_EDGE, SCENE_PASS_EDGE);
SAME(REQUEST_STUDIO_AUTO, VIEW_STUDIO_AUTO);
SAME(REQUEST_STUDIO_ON, VIEW_STUDIO_ON);
SAME(REQUEST_STUDIO_OFF, VIEW_STUDIO_OFF);
SAME(REQUEST_LIGHT_LISTS_AUTO, VIEW_LIGHT_LISTS_AUTO);
SAME(REQUEST_LIGHT_LISTS_CLUSTERED, VIEW_LIGHT_LISTS_CLUSTERED);
SAME(REQUEST_LIGHT_LISTS_LINKED, VIEW_LIGHT_LISTS_LINKED);
SAME(REQUEST_BLEND_TINT, VIEW_BLEND_TINT);
SAME(REQUEST_BLEND_COVERAGE, VIEW_BLEND_COVERAGE);
SAME(REQUEST_BLEND_KIM, VIEW_BLEND_KIM);
SAME(REQUEST_BLEND_MODISETT, VIEW_BLEND_MODISETT);
SAME(REQUEST_OUTPUT_COLOR, VIEW_OUTPUT_COLOR);
SAME(REQUEST_OUTPUT_DEPTH, VIEW_OUTPUT_DEPTH);
SAME(REQUEST_OUTPUT_NORMAL, VIEW_OUTPUT_NORMAL);
SAME(REQUEST_OUTPUT_ALBEDO, VIEW_OUTPUT_ALBEDO);
SAME(REQUEST_OUTPUT_NODE, VIEW_OUTPUT_NODE);
SAME(REQUEST_OUTPUT_MATERIAL, VIEW_OUTPUT_MATERIAL);
SAME(REQUEST_OUTPUT_POSITION, VIEW_OUTPUT_POSITION);
SAME(REQUEST_OUTPUT_TRANSMITTANCE, VIEW_OUTPUT_TRANSMITTANCE);
SAME(REQUEST_OUTPUT_LIGHTS, VIEW_OUTPUT_LIGHTS);
SAME(REQUEST_OUTPUT_LAYERS, VIEW_OUTPUT_LAYERS);
SAME(REQUEST_OUTPUT_OPTICAL_DEPTH, VIEW_OUTPUT_OPTICAL_DEPTH);
SAME(REQUEST_OUTPUT_COUNT, VIEW_OUTPUT_COUNT);
SAME(REQUEST_TONE_NEUTRAL, TONE_MAPPING_NEUTRAL);
SAME(REQUEST_TONE_NONE, TONE_MAPPING_NONE);
SAME(REQUEST_TONE_AGX, TONE_MAPPING_AGX);
SAME(REQUEST_TONE_ACES, TONE_MAPPING_ACES);

void view_storage_finish(struct view_storage *storage)
{
    free(storage->lights);
    free(storage->nodes);
    free(storage->materials);
    free(storage->grids);
    free(storage->clip_planes);
    free(storage->cuts);
    free(storage->parts);
    *storage = (struct view_storage){0};
}

static void to_floats(const double *numbers, float *out, int count)
{
    for (int i = 0; i < count; i++)
        out[i] = (float)numbers[i];
}

static void map_camera(const struct request_camera *from, struct view_camera *to)
{
    *to = (struct view_camera){
        .kind = (enum view_camera_kind)from->kind,
        .node = from->node,
        .fit = (enum view_fit)from->fit,
        .is_orthographic = from->is_orthographic,
        .fov_y_deg = from->fov_y_deg,
        .ortho_height = from->ortho_height,
    };
    memcpy(to->eye, from->eye, sizeof to->eye);
    memcpy(to->target, from->target, sizeof to->target);
    memcpy(to->up, from->up, sizeof to->up);
    memcpy(to->matrix, from->matrix, sizeof to->matrix);
}

static void map_light(const struct request_light *from, struct view_light *to)
{
    *to = (struct view_light){
        .type = (enum scene_light_type)from->type,
        .intensity = (float)from->intensity,
        .range = (float)from->range,
        .inner_cone_deg = (float)from->inner_cone_deg,
        .outer_cone_deg = (float)from->outer_cone_deg,
        .casts_no_shadow = from->casts_no_shadow,
        .width_m = from->width,
        .height_m = from->height,
        .radius_m = from->radius,
    };
    memcpy(to->up, from->up, sizeof to->up);
    memcpy(to->position, from->position, sizeof to->position);
    memcpy(to->direction, from->direction, sizeof to->direction);
    to_floats(from->color, to->color, 3);
}

static void map_node(const struct request_node_override *from, struct view_node_override *to)
{
    *to = (struct view_node_override){
        .node = from->node,
        .has_visible = from->has_visible,
        .visible = from->visible,
        .has_matrix = from->has_matrix,
    };
    memcpy(to->matrix, from->matrix, sizeof to->matrix);
}

static void map_part(const struct request_part *from, struct view_part *to)
{
    *to = (struct view_part){
        .name = from->name,
        .scene_key = from->scene,
        .parent = from->parent,
        .is_hidden = from->is_hidden,
    };
    memcpy(to->matrix, from->matrix, sizeof to->matrix);
}

static void map_material(const struct request_material_override *from,
                         struct view_material_override *to)
{
    *to = (struct view_material_override){
        .material = from->material,
        .has_base_color = from->has_base_color,
        .has_metallic = from->has_metallic,
        .metallic = (float)from->metallic,
        .has_roughness = from->has_roughness,
        .roughness = (float)from->roughness,
        .has_emissive = from->has_emissive,
        .has_transmission = from->has_transmission,
        .transmission = (float)from->transmission,
        .has_ior = from->has_ior,
        .ior = (float)from->ior,
        .has_thickness = from->has_thickness,
        .thickness = (float)from->thickness,
        .has_attenuation = from->has_attenuation,
        .attenuation_distance = (float)from->attenuation_distance,
        .has_alpha_mode = from->has_alpha_mode,
        .alpha_mode = (enum scene_alpha_mode)from->alpha_mode,
        .has_pass_through = from->has_pass_through,
        .pass_through = (enum scene_pass_through)from->pass_through,
        .edge_exponent = (float)from->edge_exponent,
        .has_self_shadow = from->has_self_shadow,
        .self_shadow = from->self_shadow,
        .has_cast_once = from->has_cast_once,
        .cast_once = from->cast_once,
        .lobes = from->lobes,
    };
    to_floats(from->base_color, to->base_color, 4);
    to_floats(from->emissive, to->emissive, 3);
    to_floats(from->attenuation_color, to->attenuation_color, 3);
    to_floats(from->edge_color, to->edge_color, 3);
}

static void map_grid(const struct request_grid_override *from, struct view_grid_override *to)
{
    *to = (struct view_grid_override){
        .grid = from->grid,
        .has_density = from->has_density,
        .density = (float)from->density,
        .has_extinction = from->has_extinction,
        .has_color = from->has_color,
        .has_anisotropy = from->has_anisotropy,
        .anisotropy = (float)from->anisotropy,
    };
    to_floats(from->extinction, to->extinction, 3);
    to_floats(from->color, to->color, 3);
}

static void map_cut(const struct request_cut *from, struct view_cut *to)
{
    *to = (struct view_cut){.spares_shadows = from->spares_shadows,
                            .has_cap = from->has_cap,
                            .has_cap_color = from->has_cap_color};
    to_floats(from->cap_color, to->cap_color, 3);
}

static bool storage_init(struct view_storage *storage, const struct render_request *request)
{
    /* One more than needed: an empty array is no failure. */
    storage->lights = calloc(request->light_count + 1, sizeof *storage->lights);
    storage->nodes = calloc(request->node_count + 1, sizeof *storage->nodes);
    storage->materials = calloc(request->material_count + 1, sizeof *storage->materials);
    storage->grids = calloc(request->grid_count + 1, sizeof *storage->grids);
    storage->clip_planes = calloc(request->clip_plane_count + 1, sizeof *storage->clip_planes);
    storage->cuts = calloc(request->clip_plane_count + 1, sizeof *storage->cuts);
    storage->parts = calloc(request->part_count + 1, sizeof *storage->parts);
    return storage->lights && storage->nodes && storage->materials && storage->grids &&
           storage->clip_planes && storage->cuts && storage->parts;
}

void view_quality_from_request(const struct request_quality *from, struct view_quality *to)
{
    *to = (struct view_quality){
        .shadows = from->shadows,
        .transparency = from->transparency,
        .light_lists = (enum view_light_lists)from->light_lists,
        .blend_filter = (enum view_blend_filter)from->blend_filter,
        .volume_map = (enum view_volume_map)from->volume_map,
        .silhouette_form = (enum view_silhouette_form)from->silhouette_form,
        .refraction = (enum view_refraction)from->refraction,
        .refraction_samples = from->refraction_samples,
        .shadow_resolution = from->shadow_resolution,
        .shadow_taps = from->shadow_taps,
        .shadow_compression = from->shadow_compression,
        .shadow_prefilter = from->shadow_prefilter,
        .shadow_error_allowed = from->shadow_fallback,
        .samples = from->samples,
        .faithful = from->faithful,
        .reference = from->reference,
        .area_samples = from->area_samples,
        .environment_samples = from->environment_samples,
        .atmosphere_samples = from->atmosphere_samples,
        .environment_visibility = (enum view_visibility)from->environment_visibility,
    };
}

static void map_overlays(const struct render_request *request, struct view *view)
{
    const struct request_highlight *highlight = &request->highlight;
    const struct request_edges *edges = &request->edges;
    view->highlight = (struct view_highlight){.nodes = (const char *const *)highlight->nodes,
                                              .node_count = highlight->node_count,
                                              .width_px = (float)highlight->width_px,
                                              .hidden = (float)highlight->hidden};
    view->edges = (struct view_edges){.is_drawn = edges->is_given,
                                      .crease_deg = (float)edges->crease_deg,
                                      .omits_borders = edges->omits_borders,
                                      .omits_silhouettes = edges->omits_silhouettes,
                                      .width_px = (float)edges->width_px,
                                      .hidden = (float)edges->hidden};
    to_floats(highlight->color, view->highlight.color, 3);
    to_floats(edges->color, view->edges.color, 3);
}

/* A map alone comes without a hemisphere. */
static bool has_hemisphere(const struct render_request *request)
{
    bool is_lit = false;
    for (int i = 0; i < 3; i++)
        is_lit |= request->sky[i] > 0 || request->ground[i] > 0;
    return request->has_environment && (is_lit || !request->environment.image[0]);
}

static bool has_map_behind(const struct render_request *request)
{
    return request->environment.image[0] && request->environment.is_background;
}

/* Without density there is no haze, whatever else is said of it. */
static void map_atmosphere(const struct request_atmosphere *from, struct view_atmosphere *to)
{
    if (!from->is_given || from->density <= 0)
        return;
    *to = (struct view_atmosphere){.density_per_m = from->density,
                                   .anisotropy = from->anisotropy,
                                   .falloff_m = from->falloff,
                                   .base_m = from->base};
    to_floats(from->color, to->color, 3);
}

bool view_from_request(const struct render_request *request, struct view_storage *storage,
                       struct view *view, struct error *err)
{
    *storage = (struct view_storage){0};
    *view = (struct view){0};
    if (!storage_init(storage, request)) {
        view_storage_finish(storage);
        return error_set(err, ERROR_NO_MEMORY, "a view of %zu lights and %zu overrides",
                         request->light_count,
                         request->node_count + request->material_count + request->grid_count);
    }
    for (size_t i = 0; i < request->light_count; i++)
        map_light(&request->lights[i], &storage->lights[i]);
    for (size_t i = 0; i < request->node_count; i++)
        map_node(&request->nodes[i], &storage->nodes[i]);
    for (size_t i = 0; i < request->material_count; i++)
        map_material(&request->materials[i], &storage->materials[i]);
    for (size_t i = 0; i < request->grid_count; i++)
        map_grid(&request->grids[i], &storage->grids[i]);
    for (size_t i = 0; i < request->part_count; i++)
        map_part(&request->parts[i], &storage->parts[i]);
    for (size_t i = 0; i < request->clip_plane_count; i++) {
        memcpy(storage->clip_planes[i], request->clip_planes[i], sizeof *storage->clip_planes);
        map_cut(&request->cuts[i], &storage->cuts[i]);
    }

    *view = (struct view){
        .width_px = request->width,
        .height_px = request->height,
        .tile = {request->tile.x, request->tile.y, request->tile.width, request->tile.height},
        .outputs = request->outputs,
        .lights = storage->lights,
        .light_count = request->light_count,
        .ignore_scene_lights = request->ignore_scene_lights,
        .studio = (enum view_studio)request->studio,
        .has_environment = has_hemisphere(request),
        .environment_key = request->environment.image,
        .environment_rotation_deg = request->environment.rotation_deg,
        .environment_intensity = request->environment.intensity,
        .environment_is_background = has_map_behind(request),
        .nodes = storage->nodes,
        .node_override_count = request->node_count,
        .materials = storage->materials,
        .material_override_count = request->material_count,
        .grids = storage->grids,
        .grid_override_count = request->grid_count,
        .parts = storage->parts,
        .part_count = request->part_count,
        .clip_planes = (const double(*)[4])storage->clip_planes,
        .clip_plane_count = request->clip_plane_count,
        .cuts = storage->cuts,
        .ground_plane = {.is_shown = request->ground_plane.is_given,
                         .has_height = request->ground_plane.has_height,
                         .height_m = request->ground_plane.height},
        .is_animated = request->animation.is_given,
        .animation = request->animation.name,
        .animation_time_s = request->animation.time_s,
        .variant = request->variant,
        .wants_deep = request->format == REQUEST_FORMAT_EXR_DEEP,
    };
    map_camera(&request->camera, &view->camera);
    view_quality_from_request(&request->quality, &view->quality);
    map_atmosphere(&request->atmosphere, &view->atmosphere);
    map_overlays(request, view);
    to_floats(request->sky, view->sky, 3);
    to_floats(request->ground, view->ground, 3);
    to_floats(request->background, view->background, 4);
    return true;
}

void tone_map_from_request(const struct render_request *request, struct tone_map_desc *desc)
{
    *desc = (struct tone_map_desc){
        .operator_ = (enum tone_mapping)request->tone_mapping,
        .exposure_ev = (float)request->exposure_ev,
    };
}

struct view_screen view_screen_from_request(const struct render_request *request,
                                            enum image_format format)
{
    struct view_screen screen = {.channels = format == IMAGE_FORMAT_EXR    ? 0
                                             : format == IMAGE_FORMAT_JPEG ? 3
                                                                           : 4,
                                 .has_backdrop = format != IMAGE_FORMAT_EXR &&
                                                 request->background[3] > 0 &&
                                                 !has_map_behind(request)};
    tone_map_from_request(request, &screen.mapping);
    return screen;
}
