/* SPDX-License-Identifier: MIT */
/* Writing a render request as canonical JSON. */
#include "protocol/json_write.h"
#include "protocol/lobe_members_json.h"
#include "protocol/request_parts.h"
#include "protocol/request_tree.h"

/* A number for which 0 means "not given". */
static void put_number_or_null(struct json_writer *writer, const char *key, double number)
{
    json_put(writer, key, number != 0 ? json_finite(number) : json_null());
}

/* An up that follows from the view is left out, so that it follows when the camera turns; +Y is
 * always written. */
static bool says_up(const struct request_camera *camera)
{
    double forward[3], implied[3];
    for (int i = 0; i < 3; i++)
        forward[i] = camera->target[i] - camera->eye[i];
    request_default_up(forward, implied);
    if (implied[1] == 0 && camera->up[0] == implied[0] && camera->up[1] == implied[1] &&
        camera->up[2] == implied[2])
        return false;
    return camera->up[0] != 0 || camera->up[1] != 0 || camera->up[2] != 0;
}

static json_t *write_camera(const struct request_camera *camera)
{
    struct json_writer writer = json_writer_begin();
    switch (camera->kind) {
    case REQUEST_CAMERA_DEFAULT:
        break;
    case REQUEST_CAMERA_NODE:
        json_put_text(&writer, "node", camera->node);
        break;
    case REQUEST_CAMERA_LOOK_AT:
        json_put_numbers(&writer, "eye", camera->eye, 3);
        json_put_numbers(&writer, "target", camera->target, 3);
        if (says_up(camera))
            json_put_numbers(&writer, "up", camera->up, 3);
        break;
    case REQUEST_CAMERA_MATRIX:
        json_put_numbers(&writer, "matrix", camera->matrix, 16);
        break;
    case REQUEST_CAMERA_FIT:
        json_put_text(&writer, "fit", request_fit_name((int)camera->fit));
        break;
    }
    if (camera->is_orthographic)
        json_put_text(&writer, "projection", "orthographic");
    put_number_or_null(&writer, "fov_y_deg", camera->fov_y_deg);
    put_number_or_null(&writer, "ortho_height", camera->ortho_height);
    return json_writer_take(&writer);
}

static json_t *write_light(const struct request_light *light)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "type", request_light_type_name((int)light->type));
    if (light->type != REQUEST_LIGHT_DIRECTIONAL)
        json_put_numbers(&writer, "position", light->position, 3);
    if (light->type != REQUEST_LIGHT_POINT)
        json_put_numbers(&writer, "direction", light->direction, 3);
    json_put_numbers(&writer, "color", light->color, 3);
    json_put_number(&writer, "intensity", light->intensity);
    if (light->type == REQUEST_LIGHT_SPOT) {
        json_put_number(&writer, "inner_cone_deg", light->inner_cone_deg);
        json_put_number(&writer, "outer_cone_deg", light->outer_cone_deg);
    }
    if (light->type == REQUEST_LIGHT_POINT || light->type == REQUEST_LIGHT_SPOT)
        json_put_number(&writer, "range", light->range);
    if (light->type == REQUEST_LIGHT_RECT) {
        json_put_number(&writer, "width", light->width);
        json_put_number(&writer, "height", light->height);
    }
    if (light->up[0] != 0 || light->up[1] != 0 || light->up[2] != 0)
        json_put_numbers(&writer, "up", light->up, 3);
    if (light->type == REQUEST_LIGHT_DISK)
        json_put_number(&writer, "radius", light->radius);
    json_put_bool(&writer, "shadow", !light->casts_no_shadow);
    return json_writer_take(&writer);
}

static json_t *write_lights(const struct render_request *request)
{
    json_t *lights = json_array();
    bool has_failed = !lights;
    for (size_t i = 0; i < request->light_count; i++)
        json_append(lights, write_light(&request->lights[i]), &has_failed);
    return json_take_unless(lights, has_failed);
}

static json_t *write_nodes(const struct render_request *request)
{
    struct json_writer nodes = json_writer_begin();
    for (size_t i = 0; i < request->node_count; i++) {
        const struct request_node_override *override = &request->nodes[i];
        struct json_writer writer = json_writer_begin();
        if (override->has_visible)
            json_put_bool(&writer, "visible", override->visible);
        if (override->has_matrix)
            json_put_numbers(&writer, "matrix", override->matrix, 16);
        json_put(&nodes, override->node, json_writer_take(&writer));
    }
    return json_writer_take(&nodes);
}

static json_t *write_pass_through(const struct request_material_override *override)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "model", request_pass_through_name((int) override->pass_through));
    if (override->pass_through == REQUEST_PASS_EDGE) {
        json_put_numbers(&writer, "edge_color", override->edge_color, 3);
        json_put_number(&writer, "edge_exponent", override->edge_exponent);
    }
    return json_writer_take(&writer);
}

static json_t *write_material(const struct request_material_override *o)
{
    struct json_writer writer = json_writer_begin();
    if (o->has_base_color)
        json_put_numbers(&writer, "base_color", o->base_color, 4);
    if (o->has_metallic)
        json_put_number(&writer, "metallic", o->metallic);
    if (o->has_roughness)
        json_put_number(&writer, "roughness", o->roughness);
    if (o->has_emissive)
        json_put_numbers(&writer, "emissive", o->emissive, 3);
    if (o->has_transmission)
        json_put_number(&writer, "transmission", o->transmission);
    if (o->has_ior)
        json_put_number(&writer, "ior", o->ior);
    if (o->has_thickness)
        json_put_number(&writer, "thickness", o->thickness);
    if (o->has_attenuation) {
        json_put_numbers(&writer, "attenuation_color", o->attenuation_color, 3);
        json_put_number(&writer, "attenuation_distance", o->attenuation_distance);
    }
    if (o->has_alpha_mode)
        json_put_text(&writer, "alpha_mode", request_alpha_mode_name((int)o->alpha_mode));
    if (o->has_pass_through)
        json_put(&writer, "pass_through", write_pass_through(o));
    if (o->has_self_shadow)
        json_put_bool(&writer, "self_shadow", o->self_shadow);
    if (o->has_cast_once)
        json_put_bool(&writer, "cast_once", o->cast_once);
    lobe_members_write(&o->lobes, &writer);
    return json_writer_take(&writer);
}

static json_t *write_grids(const struct render_request *request)
{
    struct json_writer grids = json_writer_begin();
    for (size_t i = 0; i < request->grid_count; i++) {
        const struct request_grid_override *o = &request->grids[i];
        struct json_writer writer = json_writer_begin();
        if (o->has_density)
            json_put_number(&writer, "density", o->density);
        if (o->has_extinction)
            json_put_numbers(&writer, "extinction", o->extinction, 3);
        if (o->has_color)
            json_put_numbers(&writer, "color", o->color, 3);
        if (o->has_anisotropy)
            json_put_number(&writer, "anisotropy", o->anisotropy);
        json_put(&grids, o->grid, json_writer_take(&writer));
    }
    return json_writer_take(&grids);
}

static json_t *write_overrides(const struct render_request *request)
{
    struct json_writer writer = json_writer_begin(), materials = json_writer_begin();
    for (size_t i = 0; i < request->material_count; i++)
        json_put(&materials, request->materials[i].material,
                 write_material(&request->materials[i]));
    json_put(&writer, "nodes", write_nodes(request));
    json_put(&writer, "materials", json_writer_take(&materials));
    json_put(&writer, "grids", write_grids(request));
    return json_writer_take(&writer);
}

static json_t *write_parts(const struct render_request *request)
{
    struct json_writer parts = json_writer_begin();
    for (size_t i = 0; i < request->part_count; i++) {
        const struct request_part *part = &request->parts[i];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "scene", part->scene);
        json_put_text_or_null(&writer, "parent", part->parent);
        json_put_numbers(&writer, "matrix", part->matrix, 16);
        json_put_bool(&writer, "visible", !part->is_hidden);
        json_put(&parts, part->name, json_writer_take(&writer));
    }
    return json_writer_take(&parts);
}

/* The numbers alone where all else is the default. */
static json_t *write_clip_plane(const double plane[4], const struct request_cut *cut)
{
    if (!cut->spares_shadows && !cut->has_cap)
        return json_numbers(plane, 4);
    struct json_writer writer = json_writer_begin();
    json_put_numbers(&writer, "plane", plane, 4);
    json_put_bool(&writer, "shadows", !cut->spares_shadows);
    if (cut->has_cap_color)
        json_put_numbers(&writer, "cap", cut->cap_color, 3);
    else
        json_put_bool(&writer, "cap", cut->has_cap);
    return json_writer_take(&writer);
}

static json_t *write_clip_planes(const struct render_request *request)
{
    json_t *planes = json_array();
    bool has_failed = !planes;
    for (size_t i = 0; i < request->clip_plane_count; i++)
        json_append(planes, write_clip_plane(request->clip_planes[i], &request->cuts[i]),
                    &has_failed);
    return json_take_unless(planes, has_failed);
}

static json_t *write_highlight(const struct request_highlight *highlight)
{
    if (!highlight->nodes)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_t *nodes = json_array();
    bool has_failed = !nodes;
    for (size_t i = 0; i < highlight->node_count; i++)
        json_append(nodes, json_text(highlight->nodes[i]), &has_failed);
    json_put(&writer, "nodes", json_take_unless(nodes, has_failed));
    json_put_numbers(&writer, "color", highlight->color, 3);
    json_put_number(&writer, "width_px", highlight->width_px);
    json_put_number(&writer, "hidden", highlight->hidden);
    return json_writer_take(&writer);
}

static json_t *write_edges(const struct request_edges *edges)
{
    if (!edges->is_given)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "crease_deg", edges->crease_deg);
    json_put_bool(&writer, "borders", !edges->omits_borders);
    json_put_bool(&writer, "silhouettes", !edges->omits_silhouettes);
    json_put_numbers(&writer, "color", edges->color, 3);
    json_put_number(&writer, "width_px", edges->width_px);
    json_put_number(&writer, "hidden", edges->hidden);
    return json_writer_take(&writer);
}

static json_t *write_ground_plane(const struct request_ground_plane *plane)
{
    if (!plane->is_given)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "height", plane->has_height ? json_finite(plane->height) : json_null());
    return json_writer_take(&writer);
}

static json_t *write_atmosphere(const struct request_atmosphere *atmosphere)
{
    if (!atmosphere->is_given)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "density", atmosphere->density);
    json_put_numbers(&writer, "color", atmosphere->color, 3);
    json_put_number(&writer, "anisotropy", atmosphere->anisotropy);
    json_put_number(&writer, "falloff_m", atmosphere->falloff);
    json_put_number(&writer, "base_m", atmosphere->base);
    return json_writer_take(&writer);
}

static json_t *write_environment(const struct render_request *request)
{
    if (!request->has_environment)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_numbers(&writer, "sky", request->sky, 3);
    json_put_numbers(&writer, "ground", request->ground, 3);
    const struct request_environment *map = &request->environment;
    if (map->image[0]) {
        json_put_text(&writer, "image", map->image);
        json_put_number(&writer, "rotation_deg", map->rotation_deg);
        json_put_number(&writer, "intensity", map->intensity);
        json_put_bool(&writer, "background", map->is_background);
    }
    return json_writer_take(&writer);
}

static json_t *write_animation(const struct request_animation *animation)
{
    if (!animation->is_given)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_text_or_null(&writer, "name", animation->name);
    json_put_number(&writer, "time_s", animation->time_s);
    return json_writer_take(&writer);
}

static json_t *integer_or_null(int number)
{
    return number ? json_integer(number) : json_null();
}

json_t *request_quality_to_tree(const struct request_quality *quality)
{
    struct json_writer writer = json_writer_begin();
    bool asks = request_quality_asks(quality);
    bool is_open_resolution = asks && !quality->says_shadow_resolution;
    bool is_open_taps = asks && !quality->says_shadow_taps;
    json_put_text(&writer, "shadows", shadow_technique_name((int)quality->shadows));
    json_put_text(&writer, "transparency", transparency_name((int)quality->transparency));
    json_put_text(&writer, "light_lists", request_light_lists_name((int)quality->light_lists));
    json_put_text(&writer, "blend_filter", request_blend_filter_name((int)quality->blend_filter));
    json_put_text(&writer, "refraction", request_refraction_name((int)quality->refraction));
    json_put(&writer, "shadow_resolution",
             integer_or_null(is_open_resolution ? 0 : quality->shadow_resolution));
    json_put(&writer, "shadow_taps", integer_or_null(is_open_taps ? 0 : quality->shadow_taps));
    json_put(&writer, "samples", integer_or_null(quality->samples));
    put_number_or_null(&writer, "shadow_compression", quality->shadow_compression);
    json_put(&writer, "shadow_prefilter", json_integer(quality->shadow_prefilter));
    put_number_or_null(&writer, "shadow_fallback", quality->shadow_fallback);
    json_put_bool(&writer, "faithful", quality->faithful);
    json_put_text(&writer, "volume_map", request_volume_map_name((int)quality->volume_map));
    json_put_text(&writer, "silhouette_form",
                  request_silhouette_form_name((int)quality->silhouette_form));
    json_put_bool(&writer, "reference", quality->reference);
    json_put(&writer, "area_samples", integer_or_null(quality->area_samples));
    json_put_text(&writer, "environment_visibility",
                  request_visibility_name((int)quality->environment_visibility));
    json_put(&writer, "environment_samples", integer_or_null(quality->environment_samples));
    json_put(&writer, "atmosphere_samples", integer_or_null(quality->atmosphere_samples));
    json_put(&writer, "refraction_samples", integer_or_null(quality->refraction_samples));
    put_number_or_null(&writer, "max_error", quality->max_error);
    put_number_or_null(&writer, "budget_ms", quality->budget_ms);
    return json_writer_take(&writer);
}

static json_t *write_outputs(const struct render_request *request)
{
    json_t *outputs = json_array();
    bool has_failed = !outputs;
    for (int i = 0; i < REQUEST_OUTPUT_COUNT; i++)
        if (request->outputs & 1u << i)
            json_append(outputs, json_string(request_output_name(i)), &has_failed);
    return json_take_unless(outputs, has_failed);
}

static json_t *write_tile(const struct request_tile *tile)
{
    return json_pack("{s:i,s:i,s:i,s:i}", "x", tile->x, "y", tile->y, "width", tile->width,
                     "height", tile->height);
}

json_t *request_to_tree(const struct render_request *request)
{
    bool has_format = request->format != REQUEST_FORMAT_ANY;
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "scene", request->scene);
    json_put(&writer, "width", json_integer(request->width));
    json_put(&writer, "height", json_integer(request->height));
    if (request->tile.is_given)
        json_put(&writer, "tile", write_tile(&request->tile));
    json_put(&writer, "camera", write_camera(&request->camera));
    json_put(&writer, "lights", write_lights(request));
    json_put_bool(&writer, "scene_lights", !request->ignore_scene_lights);
    json_put_text(&writer, "studio", request_studio_name((int)request->studio));
    json_put(&writer, "overrides", write_overrides(request));
    json_put(&writer, "parts", write_parts(request));
    json_put(&writer, "clip_planes", write_clip_planes(request));
    json_put(&writer, "animation", write_animation(&request->animation));
    json_put_text_or_null(&writer, "variant", request->variant);
    json_put(&writer, "ground_plane", write_ground_plane(&request->ground_plane));
    json_put(&writer, "atmosphere", write_atmosphere(&request->atmosphere));
    json_put(&writer, "highlight", write_highlight(&request->highlight));
    json_put(&writer, "edges", write_edges(&request->edges));
    json_put_numbers(&writer, "background", request->background, 4);
    if (request->meters_exposure)
        json_put_text(&writer, "exposure_ev", "auto");
    else
        json_put_number(&writer, "exposure_ev", request->exposure_ev);
    json_put_text(&writer, "tone_mapping", request_tone_mapping_name((int)request->tone_mapping));
    json_put(&writer, "environment", write_environment(request));
    json_put(&writer, "quality", request_quality_to_tree(&request->quality));
    json_put(&writer, "outputs", write_outputs(request));
    json_put(&writer, "format",
             has_format ? json_text(request_format_name((int)request->format)) : json_null());
    json_put(&writer, "quality_percent", integer_or_null(request->quality_percent));
    json_put_bool(&writer, "provenance", !request->omits_provenance);
    return json_writer_take(&writer);
}

char *render_request_to_json(const struct render_request *request)
{
    return json_take_dump(request_to_tree(request), JSON_COMPACT | JSON_REAL_PRECISION(17));
}

char *request_reference_text(json_t *members, const struct request_quality *quality)
{
    struct request_quality plain = *quality;
    plain.shadows = SHADOWS_AUTO;
    plain.shadow_resolution = plain.shadow_taps = 1;
    plain.samples = 0;
    plain.reference = false;
    plain.max_error = plain.budget_ms = 0;
    plain.shadow_compression = plain.shadow_fallback = 0;
    plain.shadow_prefilter = 1;
    plain.atmosphere_samples = 0;
    json_t *copy = json_copy(members);
    struct json_writer writer = {.object = copy, .has_failed = !copy};
    json_put(&writer, "quality", request_quality_to_tree(&plain));
    json_put(&writer, "outputs", json_pack("[s]", request_output_name(REQUEST_OUTPUT_COLOR)));
    json_put(&writer, "format", json_null());
    json_put(&writer, "quality_percent", json_null());
    json_put_bool(&writer, "provenance", false);
    json_put_text(&writer, "tone_mapping", request_tone_mapping_name(REQUEST_TONE_NEUTRAL));
    return json_take_dump(json_writer_take(&writer),
                          JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
}

char *request_reference_text_of(const void *request)
{
    const struct render_request *of = request;
    json_t *members = request_to_tree(of);
    char *text = members ? request_reference_text(members, &of->quality) : NULL;
    json_decref(members);
    return text;
}
