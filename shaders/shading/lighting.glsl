// SPDX-License-Identifier: MIT
// Light that a surface sends to the viewer: every listed light through its shadow, the hemisphere,
// an environment map, emission.
// The same code serves every set of surfaces (renderer/window/surface_set.h). A set hands its
// surfaces out as lit_surface: shade_surfaces.comp.glsl asks the set's own source for them, and
// shade_pixels.comp.glsl is such a set with a program of its own. Needs: light list and shadow
// defines, LIGHT_KINDS, HAS_LIGHT_RANGES, HAS_AREA_SAMPLES and HAS_AREA_FORM where HAS_LIGHTS,
// MATERIAL_KINDS of material.glsl, HAS_GROUND where these have MATERIAL_GROUND,
// GRID_COUNT where HAS_GRIDS.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "material/material.glsl"
#include "draw/surface.glsl"
#ifdef HAS_LOBES
#include "draw/lobes.glsl"
#endif
#include "material/brdf_input.glsl"
#ifdef HAS_LOBES
#include "shading/lobe_room.glsl"
#endif
#include "material/brdf.glsl"
#if defined HAS_TRACED_SHADOWS || defined HAS_ENVIRONMENT_VISIBILITY
#include "shadows/traced_filter.glsl"
#endif
#ifdef HAS_ATMOSPHERE
#include "shading/atmosphere.glsl"
#endif
#ifdef HAS_GRIDS
#include "lights/density_grids.glsl"
#endif
#ifdef HAS_LIGHTS
layout(std430, binding = BIND_LIGHTS) readonly buffer light_buffer { light_record lights[]; };
#include "lights/light_list.glsl"
#include "lights/light_area.glsl"
#include "lights/area_form.glsl"
#include "shading/area_light.glsl"
#include "shadows/shadow_traced.glsl"
#ifdef HAS_SHADOWS
#include "shadows/shadow_query.glsl"
#endif
#endif

#if defined HAS_SHADOWS || defined HAS_TRACED_SHADOWS
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
#define STATISTICS_LOOKUPS 64u // first of 64 counters of shadow queries: atomics kept apart
#endif

#if defined HAS_ENVIRONMENT || defined HAS_ENVIRONMENT_MAP
uniform vec3 u_world_y; // in view space
#endif
#ifdef HAS_ENVIRONMENT
uniform vec3 u_sky, u_ground; // nt
#endif
#ifdef HAS_ENVIRONMENT_MAP
#include "shading/environment.glsl"
#ifdef HAS_ENVIRONMENT_VISIBILITY
#include "shading/visibility.glsl"
#endif
#endif
#if defined HAS_SHADOWS || defined HAS_TRACED_SHADOWS
uniform float u_taps; // per shadow query, for the statistics
#endif
#ifdef HAS_LIGHT_PARTS
// More lights than one dispatch takes, because of its loops or because of the memory of their
// shadows: each dispatch goes on with the sums of the one before it, so that the bits are those of
// a single one. The first adds all that is not a light's.
uniform uvec2 u_light_part; // not 0: it is the first; it is the last
#define IS_FIRST_PART (u_light_part.x != 0u)
#define IS_LAST_PART (u_light_part.y != 0u)
#else
#define IS_FIRST_PART true
#endif
#ifndef IS_LAST_PART
#define IS_LAST_PART true
#endif
#ifdef HAS_GROUND
// What the surface at hand would send on if nothing cast a shadow: the ground plane's filter is the
// share of it that is left.
vec3 light_unshadowed = vec3(0.0);
#define ADD_UNSHADOWED(light) light_unshadowed += light;
#else
#define ADD_UNSHADOWED(light)
#endif
#ifdef HAS_LIGHT_CHUNK
uniform uvec2 u_light_chunk; // of the lists, the part that is walked: first entry, count
#endif

#ifdef HAS_LIGHTS
#include "lights/light_arriving.glsl"
#ifdef HAS_GRIDS
#include "lights/light_through_grids.glsl"
#endif

#if defined HAS_SHADOWS || defined HAS_TRACED_SHADOWS
uint light_lookups = 0u;
#endif
#ifdef HAS_SHADOWS
vec2 light_tolerance = vec2(1.0, 0.0); // of the point at hand, as is the object
#ifdef HAS_NORMAL_OFFSET
float light_normal_offset = 0.0; // [m] from the triangle to where its shadow is looked up
#endif
uint light_object = NO_OBJECT;

// What is transparent asks for the layer of its own mesh; of lists, materials without self shadow
// for the events of other objects only (Lindbeck 2015, "no self shadow").
uint object_of(uint flags, uint node)
{
#ifdef SHADOW_HAS_PARTITIONS
    bool has_own = MATERIAL_IS(flags, MATERIAL_BLEND | MATERIAL_TRANSMISSION) &&
                   !MATERIAL_IS(flags, MATERIAL_GROUND);
#else
    bool has_own = MATERIAL_IS(flags, MATERIAL_NO_SELF_SHADOW);
#endif
    return has_own ? node : NO_OBJECT;
}
#endif
#ifdef HAS_AREA_FORM
area_surface light_areas_at = AREA_NO_SURFACE; // likewise
#endif

#if LIGHT_LIST == LIGHT_LIST_CLUSTERED && !defined HAS_TRACED_SHADOWS && \
    !defined HAS_AREA_SAMPLES
// Lights are chosen by the dozen before any is looked at closely, see lighting_evaluate.
#define HAS_LIGHT_CHOICE

// Whether the light can send anything on: false where it does not arrive, or behind the surface.
bool light_may_be_sent(light_record r, uint index, brdf_input b, vec3 position)
{
    vec3 l;
#ifdef HAS_LOBES
    lobes_take_normal(b);
#endif
    vec3 arriving = light_arriving(r, position, l);
    bool is_seen = brdf_passes(b) || dot(b.normal, l) > 0.0;
#ifdef HAS_AREA_FORM
    if (light_is(r, LIGHT_AREA) && !is_seen) { // the centre is not all of it
        float per_area;
        area_source s = area_source_of(index, r.position_range.xyz - position, per_area);
        is_seen = dot(b.normal, s.centre) + abs(dot(b.normal, s.u)) + abs(dot(b.normal, s.v)) > 0.0;
    }
#endif
    return is_seen && max(arriving.r, max(arriving.g, arriving.b)) > 0.0;
}
#endif

// What the surface sends on of a light that arrives there, by the light that arrives; of an area,
// by its radiance, which takes the place of arriving.
vec3 light_reflected(light_record r, uint index, brdf_input b, vec3 position, vec3 l,
                     inout vec3 arriving)
{
#ifdef HAS_AREA_FORM
    if (light_is(r, LIGHT_AREA)) {
        float per_area;
        area_source s = area_source_of(index, r.position_range.xyz - position, per_area);
        arriving = r.color.rgb * per_area;
#ifdef HAS_ATMOSPHERE
        arriving *= atmosphere_transmittance(position, r.position_range.xyz);
#endif
        return area_reflected(light_areas_at, b, s);
    }
#endif
    return brdf_evaluate(b, l);
}

// What the surface sends on of a light through its shadow.
vec3 light_sent(light_record r, uint index, brdf_input b, vec3 position, vec3 geo_normal)
{
    vec3 l, sent = vec3(0.0);
    vec3 arriving = light_arriving(r, position, l);
    if (max(arriving.r, max(arriving.g, arriving.b)) > 0.0) {
        vec3 reflected = light_reflected(r, index, b, position, l, arriving);
        ADD_UNSHADOWED(reflected * arriving)
#ifdef HAS_SHADOWS
        if (r.shadow != NO_SHADOW && any(greaterThan(reflected, vec3(0.0)))) {
#ifdef HAS_LOBES
            lobes_take_geo_normal(geo_normal);
#endif
#ifdef HAS_NORMAL_OFFSET
            vec3 start = position + light_normal_offset * geo_normal;
#ifdef HAS_MORE_LOBES
            if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT) && b.translucent.w > 0.0)
                start = position; // above the surface light from behind would be in its shadow
#endif
#else
            vec3 start = position;
#endif
            arriving *=
                shadow_transmittance(r.shadow, start, geo_normal, light_tolerance, light_object);
            light_lookups++;
        }
#endif
#ifdef HAS_TRACED_SHADOWS
        if (r.shadow != NO_SHADOW && any(greaterThan(reflected, vec3(0.0)))) {
            arriving *= traced_transmittance();
            light_lookups++;
        }
#endif
#ifdef HAS_GRIDS
        if (any(greaterThan(reflected * arriving, vec3(0.0))))
            arriving *= light_through_grids(r, position);
#endif
        sent = reflected * arriving;
    }
#ifdef HAS_TRACED_SHADOWS
    traced_step(r.shadow, 1u);
#endif
    return sent;
}

#ifdef HAS_AREA_SAMPLES
// The same of all points of an area. No branch among them: each round is one step of the loop
// budget (renderer/shading/loop_steps.h).
vec3 light_sent_by_area(light_record r, uint index, brdf_input b, vec3 position, uvec2 pixel)
{
    light_area area = light_area_of(index, pixel);
    vec3 centre = r.position_range.xyz, sum = vec3(0.0), unshadowed = vec3(0.0);
    bool is_before = dot(position - centre, r.direction_cone.xyz) > 0.0; // of all its points
    uint count = is_before ? u_area_samples : 0u;
    r.color.rgb /= float(u_area_samples);
    for (uint i = 0u; i < count; i++) {
        vec3 l;
        r.position_range.xyz = centre + light_area_offset(area, i);
        vec3 arriving = light_arriving(r, position, l);
        vec3 sent = brdf_evaluate(b, l) * arriving;
        unshadowed += sent;
#ifdef HAS_TRACED_SHADOWS
        bool is_looked_up = r.shadow != NO_SHADOW && any(greaterThan(sent, vec3(0.0)));
        light_lookups += is_looked_up ? 1u : 0u;
        if (is_looked_up)
            sent *= traced_transmittance();
        traced_step(r.shadow, 1u);
#endif
        sum += sent;
    }
#ifdef HAS_TRACED_SHADOWS
    traced_step(r.shadow, u_area_samples - count);
#endif
    ADD_UNSHADOWED(unshadowed)
    return sum;
}
#endif
#endif

#ifdef HAS_ENVIRONMENT
// What a lobe of that roughness mirrors.
vec3 hemisphere_mirrored(brdf_input b, vec3 normal, float roughness)
{
    vec3 r = reflect(-b.view, normal);
    float spread = mix(0.05, 1.0, roughness);
    return mix(u_ground, u_sky, clamp(0.5 + 0.5 * dot(u_world_y, r) / spread, 0.0, 1.0));
}
#endif

#if defined HAS_ENVIRONMENT || defined HAS_ENVIRONMENT_MAP
#ifdef HAS_ENVIRONMENT_VISIBILITY
// rays have found what is in the way of the map's light: the texture dims the hemisphere alone
#define MAP_VISIBILITY(lobe) visibility_of(lobe)
#define HEMISPHERE_DIMMED(light, occlusion) (light) * (occlusion)
#define SUM_DIMMED(light, occlusion) light
#else
#define MAP_VISIBILITY(lobe) 1.0
#define HEMISPHERE_DIMMED(light, occlusion) light
#define SUM_DIMMED(light, occlusion) (light) * (occlusion)
#endif

// Light from all around, as a mean over Lambert's lobe: irradiance over pi; lobe: VISIBILITY_*.
vec3 ambient_irradiance(vec3 normal, float occlusion, uint lobe)
{
    vec3 irradiance = vec3(0.0);
#ifdef HAS_ENVIRONMENT
    irradiance = mix(u_ground, u_sky, 0.5 + 0.5 * dot(u_world_y, normal));
    irradiance = HEMISPHERE_DIMMED(irradiance, occlusion);
#endif
#ifdef HAS_ENVIRONMENT_MAP
    irradiance += MAP_VISIBILITY(lobe) * environment_irradiance(normal);
#endif
    return irradiance;
}

// And over the lobe of a mirror of that roughness.
vec3 ambient_mirrored(brdf_input b, vec3 normal, float roughness, float occlusion)
{
    vec3 mirrored = vec3(0.0);
#ifdef HAS_ENVIRONMENT
    mirrored = HEMISPHERE_DIMMED(hemisphere_mirrored(b, normal, roughness), occlusion);
#endif
#ifdef HAS_ENVIRONMENT_MAP
    mirrored += MAP_VISIBILITY(VISIBILITY_MIRRORED) *
                environment_mirrored(normal, b.view, roughness);
#endif
    return mirrored;
}

// As round as it is rough in the mean.
float ambient_roughness(brdf_input b, float roughness)
{
#ifdef HAS_MORE_LOBES
    lobes_take_base(b);
    if (MATERIAL_MAY_BE(MATERIAL_GRAIN) && b.grain.w > 0.0)
        return sqrt(sqrt(b.grain.w * b.alpha));
#endif
    return roughness;
}

#ifdef HAS_MORE_LOBES
// The f0 that under Schlick's law reflects at this angle what the film does.
vec3 film_f0(brdf_input b, vec3 f0, float weight, float cosine)
{
    vec3 in_air = weight > 0.0 ? f0 / weight : vec3(0.0);
    float w = schlick_weight(cosine);
    vec3 film = film_fresnel(in_air, b.film.y, b.film.z, cosine);
    film = max(film - w, 0.0) / max(1.0 - w, 1e-4);
    return mix(f0, weight * min(film, vec3(1.0)), b.film.x);
}
#endif

#ifdef HAS_LOBES
#ifdef HAS_MORE_LOBES
// f0 of the dielectric and of the metal, with the film over them.
void ambient_add_film(brdf_input b, float cosine, inout vec3 f0, inout vec3 metal)
{
#ifdef SAMPLES_IN_TURN // see brdf_add_film
    for (int i = b.metallic > 0.0 ? 0 : 1; i < 2; i++) {
        vec3 film = film_f0(b, i == 0 ? metal : f0, i == 0 ? 1.0 : b.specular.w, cosine);
        if (i == 0)
            metal = film;
        else
            f0 = film;
    }
#else
    f0 = film_f0(b, f0, b.specular.w, cosine);
    metal = film_f0(b, metal, 1.0, cosine);
#endif
}
#endif

// With fibres, a coat, a film, or another reflection of the dielectric.
vec3 ambient_lobes(brdf_input b, float roughness, float occlusion)
{
    lobes_take_base(b);
    float n_dot_v = clamp(dot(b.normal, b.view), 0.0, 1.0);
    vec4 specular = MATERIAL_MAY_BE(MATERIAL_SPECULAR) ? b.specular : vec4(1.0);
    b.specular = specular;
    vec3 f0 = b.specular.w * min(b.f0 * b.specular.rgb, vec3(1.0)), metal = b.base;
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_FILM) && b.film.x > 0.0)
        ambient_add_film(b, n_dot_v, f0, metal);
#endif
    float dielectric = (1.0 - b.metallic) * (1.0 - b.transmission) * (1.0 - largest_of(f0));
    f0 = mix(f0, metal, b.metallic);
    float edge = mix(b.specular.w * dielectric_grazing(b.f0), 1.0, b.metallic);
    vec2 split = environment_brdf(roughness, n_dot_v);
    vec3 mirror = f0 * split.x + edge * split.y;
    vec3 irradiance = ambient_irradiance(b.normal, occlusion, VISIBILITY_DIFFUSE);
    vec3 diffused = b.base * irradiance;
#ifdef HAS_MORE_LOBES
    if (MATERIAL_MAY_BE(MATERIAL_TRANSLUCENT)) {
        vec3 behind = ambient_irradiance(-b.normal, occlusion, VISIBILITY_BEHIND);
        diffused = mix(diffused, b.translucent.rgb * behind, b.translucent.w);
    }
#endif
    vec3 sent = diffused * dielectric +
                ambient_mirrored(b, b.normal, roughness, occlusion) * mirror;
    lobes_take_cover(b);
    if (MATERIAL_MAY_BE(MATERIAL_SHEEN | MATERIAL_CLEARCOAT)) {
        sent *= b.below_sheen;
        if (MATERIAL_MAY_BE(MATERIAL_SHEEN))
            sent += b.sheen * sheen_albedo(n_dot_v, b.sheen_roughness) * irradiance;
        sent *= b.below_coat;
        if (MATERIAL_MAY_BE(MATERIAL_CLEARCOAT))
            sent += (1.0 - b.below_coat) *
                    ambient_mirrored(b, b.coat_normal, sqrt(b.coat_alpha), occlusion);
    }
    return sent;
}
#endif

vec3 ambient_sent(brdf_input b, float roughness, float occlusion)
{
#ifdef HAS_LOBES
    vec3 sent = ambient_lobes(b, ambient_roughness(b, roughness), occlusion);
#else
    vec2 split = environment_brdf(roughness, clamp(dot(b.normal, b.view), 0.0, 1.0));
    vec3 f0 = mix(vec3(b.f0), b.base, b.metallic);
    vec3 diffuse = b.base * ((1.0 - b.metallic) * (1.0 - b.transmission) * (1.0 - b.f0));
    vec3 mirrored = f0 * split.x + mix(dielectric_grazing(b.f0), 1.0, b.metallic) * split.y;
    vec3 sent = diffuse * ambient_irradiance(b.normal, occlusion, VISIBILITY_DIFFUSE) +
                ambient_mirrored(b, b.normal, roughness, occlusion) * mirrored;
#endif
    return SUM_DIMMED(sent, occlusion);
}
#endif

#if defined HAS_GROUND && (defined HAS_ENVIRONMENT || defined HAS_ENVIRONMENT_MAP)
// Of a dull surface without an interface, whatever is in the way of a map: the sum of ambient_sent.
vec3 ambient_unshadowed(brdf_input b)
{
    vec3 irradiance = vec3(0.0);
#ifdef HAS_ENVIRONMENT
    irradiance = mix(u_ground, u_sky, 0.5 + 0.5 * dot(u_world_y, b.normal));
#endif
#ifdef HAS_ENVIRONMENT_MAP
    irradiance += environment_irradiance(b.normal);
#endif
    return b.base * irradiance;
}
#endif

// A surface in its place.
struct lit_surface {
    surface s;
    float transmission; // 0 of opaque ones
    vec3 position;      // view space [m]
    vec3 view;          // unit, towards the viewer
    uvec2 pixel;        // in the window, y up
    float view_z;       // distance along the view direction [m]
    vec3 before;        // its light of the parts before this one
#ifdef HAS_GROUND
    vec3 unshadowed;    // likewise, without shadows
#endif
#ifdef HAS_LOBES
    uvec4 lobes; // lobes_pack's; undefined where the material has none
#endif
#ifdef HAS_MORE_LOBES
    uvec4 more_lobes; // likewise
#endif
};

#ifdef HAS_LOBES
// b.normal and b.view are known.
void lighting_add_lobes(inout brdf_input b, lit_surface at, uint flags)
{
    surface_lobes lobes = lobes_unpack(at.lobes);
#ifdef HAS_MORE_LOBES
    more_lobes_unpack(at.more_lobes, lobes);
    b.film = vec3(0.0);
    if (MATERIAL_IS(flags, MATERIAL_FILM))
        b.film = vec3(lobes.film.x, materials[materials[at.s.material].lobes].LOBES_FILM.y,
                      lobes.film.y);
    b.translucent = MATERIAL_IS(flags, MATERIAL_TRANSLUCENT) ? lobes.translucent : vec4(0.0);
    vec3 along = lobes.grain.xyz - b.normal * dot(b.normal, lobes.grain.xyz);
    b.grain = vec4(0.0);
    if (MATERIAL_IS(flags, MATERIAL_GRAIN) && lobes.grain.w > 0.0 && dot(along, along) > 1e-12)
        b.grain = vec4(normalize(along), grain_alpha(b.alpha, lobes.grain.w));
#endif
    float n_dot_v = clamp(dot(b.normal, b.view), 1e-4, 1.0);
    bool has_sheen = MATERIAL_IS(flags, MATERIAL_SHEEN);
    bool has_coat = MATERIAL_IS(flags, MATERIAL_CLEARCOAT);
    b.specular = MATERIAL_IS(flags, MATERIAL_SPECULAR) ? lobes.specular : vec4(1.0);
    b.sheen = has_sheen ? lobes.sheen : vec3(0.0);
    b.sheen_roughness = lobes.sheen_roughness;
    b.coat_normal = has_coat ? lobes.coat_normal : b.normal;
    b.coat_alpha = has_coat ? max(lobes.coat_roughness * lobes.coat_roughness, MIN_ALPHA) : 1.0;
    b.below_sheen = b.below_coat = 1.0;
    if (has_sheen) {
        b.below_sheen = sheen_base_share(b.sheen, n_dot_v, b.sheen_roughness);
        b.sheen /= max(sheen_albedo(n_dot_v, b.sheen_roughness), 1.0);
    }
    if (has_coat)
        b.below_coat = 1.0 - coat_share(lobes.coat, clamp(dot(b.coat_normal, b.view), 1e-4, 1.0));
}
#endif

vec3 lighting_evaluate(lit_surface at)
{
    surface s = at.s;
    uint flags = materials[s.material].flags;
    if (MATERIAL_IS(flags, MATERIAL_UNLIT))
        return IS_FIRST_PART ? s.base + s.emissive : at.before;
    brdf_input b;
    b.normal = s.normal;
    b.view = at.view;
    b.base = s.base;
    b.metallic = MATERIAL_MAY_BE(MATERIAL_KIND_METAL) ? s.metallic : 0.0;
    b.alpha = max(s.roughness * s.roughness, MIN_ALPHA);
    b.f0 = materials[s.material].transmission_f0_thickness.y;
    b.transmission = MATERIAL_MAY_BE(MATERIAL_TRANSMISSION) ? at.transmission : 0.0;
#ifdef HAS_LOBES
    lighting_add_lobes(b, at, flags);
    s.emissive *= b.below_coat;
    lobes_leave(b);
#endif
    vec3 radiance = IS_FIRST_PART ? s.emissive : at.before;
#ifdef HAS_GROUND
    light_unshadowed = IS_FIRST_PART ? vec3(0.0) : at.unshadowed;
#endif
#ifdef HAS_SHADOWS
    // fully curved where shading and triangle normal differ by 7 degrees
    light_tolerance = vec2(1.0, clamp(8.0 * length(cross(s.normal, s.geo_normal)), 0.0, 1.0));
    light_object = object_of(flags, s.node);
#endif
#if defined HAS_ENVIRONMENT || defined HAS_ENVIRONMENT_MAP
    if (IS_FIRST_PART) {
        vec3 ambient = ambient_sent(b, s.roughness, s.occlusion);
        radiance += ambient;
        ADD_UNSHADOWED(ambient_unshadowed(b))
    }
#endif
#ifdef HAS_LIGHTS
#ifdef HAS_AREA_FORM
    light_areas_at = area_surface_of(b);
#endif
#ifdef HAS_TRACED_SHADOWS
    light_cursor cursor = light_list_at(traced_cluster());
#else
    light_cursor cursor = light_list_first(at.pixel, at.view_z);
#endif
#ifdef HAS_LIGHT_CHUNK
    light_list_chunk(cursor, u_light_chunk.x, u_light_chunk.y);
#endif
#ifdef HAS_LIGHT_CHOICE
    // Of up to 32 lights those that matter are found first; then each lane takes its own, one after
    // the other. A group of lanes thus takes as long as the lane with most of them, not as long as
    // all lights that matter to any.
    do {
        light_cursor choice = cursor;
        uint chosen = 0u, bit = 1u;
        do {
            uint index;
            if (light_list_next(cursor, index))
                chosen |= light_may_be_sent(lights[index], index, b, at.position) ? bit : 0u;
            bit <<= 1;
        } while (bit != 0u && light_list_count(cursor) > 0u);
        do {
            if (chosen != 0u) {
                uint index = light_list_item(choice, uint(findLSB(chosen)));
                radiance += light_sent(lights[index], index, b, at.position, s.geo_normal);
                chosen &= chosen - 1u;
            }
        } while (chosen != 0u);
    } while (light_list_count(cursor) > 0u);
#else
    uint index;
    while (light_list_next(cursor, index)) {
#ifdef LIGHT_LIST_HAS_GAPS
        if (index == LIGHT_NONE)
            continue;
#endif
        light_record r = lights[index];
#ifdef HAS_AREA_SAMPLES
        if (light_is(r, LIGHT_AREA))
            radiance += light_sent_by_area(r, index, b, at.position, at.pixel);
        else
            radiance += light_sent(r, index, b, at.position, s.geo_normal);
#else
        radiance += light_sent(r, index, b, at.position, s.geo_normal);
#endif
    }
#endif
#if defined HAS_SHADOWS || defined HAS_TRACED_SHADOWS
    uint counter = STATISTICS_LOOKUPS + (at.pixel.x & 63u);
    if (light_lookups > 0u)
        atomicAdd(statistics[counter], light_lookups * uint(u_taps));
    light_lookups = 0u;
#endif
#endif
    return radiance;
}
