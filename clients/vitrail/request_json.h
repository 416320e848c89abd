/* SPDX-License-Identifier: MIT */
/* The body of POST /v1/renders, put together from a base file, options and single settings. */
#ifndef VITRAIL_CLIENTS_VITRAIL_REQUEST_JSON_H
#define VITRAIL_CLIENTS_VITRAIL_REQUEST_JSON_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/options.h"
#include "protocol/quality_defaults.h"
#include "protocol/shadow_technique.h"
#include "protocol/transparency.h"

/* The options of `vitrail render` that say what to render; NULL or zero: not given, so left to base
 * and server. */
struct request_options {
    const char *base_path; /* --request */
    const char *size, *tile, *camera, *background, *environment, *studio, *format;
    const char *animation, *variant; /* names */
    const char *edges, *ground_plane, *haze_color;
    const char *shadows, *transparency, *light_lists, *blend_filter, *refraction, *tone_mapping;
    const char *environment_visibility;
    const char *exposure; /* a number, or "auto" */
    struct option_number shadow_resolution, shadow_compression, shadow_prefilter, shadow_fallback,
        samples, area_samples, environment_samples, refraction_samples, environment_rotation,
        environment_intensity, haze, haze_samples, haze_anisotropy, haze_falloff, haze_base,
        max_error, budget_ms, time_s;
    struct text_list lights, clips, highlights, parts, grids, outputs, settings;
    bool no_scene_lights, reference, environment_background;
};

/* What their specifications look like. */
#define REQUEST_HELP                                                                           \
    "Cameras:  node:NAME   fit:three-quarter|iso|front|back|left|right|top|bottom\n"           \
    "          eye=0,1,4 target=0,1,0 up=0,1,0 fov=45\n"                                       \
    "          ortho=METRES makes any of them orthographic: \"ortho=3 fit:top\", or as high\n" \
    "          as the scene needs: \"ortho fit:top\"\n"                                        \
    "Lights:   point:pos=0,3,0;color=1,0.8,0.6;intensity=100;range=0\n"                        \
    "          spot:pos=0,4,0;dir=0,-1,0;inner=20;outer=35;intensity=800\n"                    \
    "          rect:pos=0,4,0;dir=0,-1,0;width=1;height=0.5;intensity=500\n"                   \
    "          directional:dir=0,-1,-0.3;intensity=5;shadow=false\n"                           \
    "Cuts:     A,B,C,D;cap=true;shadows=false    cap=0.8,0.2,0.1 is a colour\n"                \
    "Parts:    bolt=bolt.glb;parent=Flange;pos=0.2,0,0    or matrix=16 numbers\n"              \
    "          plume=sim.vdb;scene=flame;unit=cm    how FILE is read: scene, unit,\n"          \
    "          up and deflection, as the options\n"                                            \
    "Grids:    smoke:density=5;color=0.9,0.9,0.9;extinction=1,1,1;anisotropy=0.3\n"            \
    "Edges:    default    "                                                                    \
    "crease=20;borders=true;silhouettes=true;color=0,0,0;width=1;hidden=0.1\n"

/* Rows of an option table; `owner` has a member `request`. */
#define REQUEST_OPTION(owner, kind, name, argument, help, member)               \
    {                                                                           \
        OPTION_##kind, name, 0, argument, help, offsetof(owner, request.member) \
    }
/* Light from all around. */
#define REQUEST_ENVIRONMENT_OPTIONS(owner)                                                   \
    REQUEST_OPTION(owner, TEXT, "studio", "WHEN",                                            \
                   "studio lighting: auto (where nothing else shines), on or\noff", studio), \
        REQUEST_OPTION(owner, TEXT, "environment", "LIGHT",                                  \
                       "from all around: studio, a map (.hdr, .exr, or of the server),\n"    \
                       "or SKY:GROUND in nits, numbers or r,g,b",                            \
                       environment),                                                         \
        REQUEST_OPTION(owner, NUMBER, "environment-rotation", "DEGREES",                     \
                       "turns the map, counter-clockwise from above", environment_rotation), \
        REQUEST_OPTION(owner, NUMBER, "environment-intensity", "X", "a factor on the map",   \
                       environment_intensity),                                               \
        REQUEST_OPTION(owner, FLAG, "environment-background", NULL,                          \
                       "show the map where nothing is", environment_background),             \
        REQUEST_OPTION(owner, TEXT, "environment-visibility", "NAME",                        \
                       "none, rays: what is in the map's way when rasterised",               \
                       environment_visibility),                                              \
        REQUEST_OPTION(owner, NUMBER, "environment-samples", "N",                            \
                       "rays: towards the map, 1 to 4096; default " QUALITY_DEFAULT_TEXT(    \
                           ENVIRONMENT_SAMPLES_DEFAULT),                                     \
                       environment_samples)
/* Haze in all of space. */
#define REQUEST_HAZE_OPTIONS(owner)                                                                \
    REQUEST_OPTION(owner, NUMBER, "haze", "DENSITY",                                               \
                   "fill space with haze: its extinction per metre, such as 0.05", haze),          \
        REQUEST_OPTION(owner, TEXT, "haze-color", "R,G,B",                                         \
                       "the share of it that scatters, linear; default 1,1,1", haze_color),        \
        REQUEST_OPTION(owner, NUMBER, "haze-anisotropy", "G",                                      \
                       "-0.95 to 0.95: above 0 it scatters onwards, below back", haze_anisotropy), \
        REQUEST_OPTION(owner, NUMBER, "haze-samples", "N",                                         \
                       "slices on the way of a pixel, 1 to 4096; default " QUALITY_DEFAULT_TEXT(   \
                           ATMOSPHERE_SLICES_DEFAULT),                                             \
                       haze_samples),                                                              \
        REQUEST_OPTION(owner, NUMBER, "haze-falloff", "METRES",                                    \
                       "over which it thins to 1/e upwards; default even", haze_falloff),          \
        REQUEST_OPTION(owner, NUMBER, "haze-base", "METRES",                                       \
                       "the height above which it thins; default 0", haze_base)
/* What frames and views have in common, but for the camera. */
#define REQUEST_LOOK_OPTIONS(owner)                                                                \
    REQUEST_OPTION(owner, TEXT, "size", "WxH", "in pixels; default 1280x720", size),               \
        REQUEST_OPTION(owner, LIST, "light", "SPEC", "one more light, see below", lights),         \
        REQUEST_OPTION(owner, FLAG, "no-scene-lights", NULL, "leave the lights of the scene out",  \
                       no_scene_lights),                                                           \
        REQUEST_OPTION(owner, LIST, "clip", "SPEC", "one more clip plane, see below", clips),      \
        REQUEST_OPTION(owner, LIST, "part", "SPEC",                                                \
                       "one more part: another scene in this one, see below", parts),              \
        REQUEST_OPTION(owner, LIST, "grid", "SPEC",                                                \
                       "another density or colour of a density grid, see below", grids),           \
        REQUEST_OPTION(owner, LIST, "highlight", "NODE", "outline this node, and all below it",    \
                       highlights),                                                                \
        REQUEST_OPTION(owner, TEXT, "edges", "SPEC", "draw feature edges, see below", edges),      \
        REQUEST_OPTION(owner, TEXT, "ground-plane", "HEIGHT",                                      \
                       "catch shadows on the ground: auto (below the scene), or metres",           \
                       ground_plane),                                                              \
        REQUEST_ENVIRONMENT_OPTIONS(owner), REQUEST_HAZE_OPTIONS(owner),                           \
        REQUEST_OPTION(owner, TEXT, "background", "R,G,B,A", "linear; default transparent",        \
                       background),                                                                \
        REQUEST_OPTION(owner, NUMBER, "time", "S",                                                 \
                       "animate: the scene at this time of its animations, in seconds", time_s),   \
        REQUEST_OPTION(owner, TEXT, "animation", "NAME", "animate: this one only; default all",    \
                       animation),                                                                 \
        REQUEST_OPTION(owner, TEXT, "variant", "NAME", "of materials, of those that the file has", \
                       variant),                                                                   \
        REQUEST_OPTION(owner, TEXT, "exposure", "EV", "in stops, or auto", exposure),              \
        REQUEST_OPTION(owner, TEXT, "tone-mapping", "NAME", "neutral, none, agx or aces",          \
                       tone_mapping),                                                              \
        REQUEST_OPTION(owner, TEXT, "shadows", "NAME", SHADOW_TECHNIQUE_NAMES, shadows),           \
        REQUEST_OPTION(                                                                            \
            owner, NUMBER, "shadow-resolution", "N",                                               \
            "texels per side; default " QUALITY_DEFAULT_TEXT(SHADOW_RESOLUTION_DEFAULT),           \
            shadow_resolution),                                                                    \
        REQUEST_OPTION(owner, NUMBER, "shadow-compression", "E",                                   \
                       "deep: error of compressed lists, 0.001 to 0.5", shadow_compression),       \
        REQUEST_OPTION(owner, NUMBER, "shadow-prefilter", "K",                                     \
                       "deep: K x K rays averaged per texel, 1 to 4", shadow_prefilter),           \
        REQUEST_OPTION(owner, NUMBER, "shadow-fallback", "E",                                      \
                       "deep: error of lists that the budget has no room for", shadow_fallback),   \
        REQUEST_OPTION(owner, NUMBER, "samples", "N",                                              \
                       "per pixel: 1, 4, 8 or 16; raytraced: also 64, 256", samples),              \
        REQUEST_OPTION(owner, FLAG, "reference", NULL,                                             \
                       "the ray-traced ground truth, in double precision", reference),             \
        REQUEST_OPTION(owner, NUMBER, "area-samples", "N",                                         \
                       "per area light and point: 1 to 4096; default " QUALITY_DEFAULT_TEXT(       \
                           AREA_SAMPLES_DEFAULT),                                                  \
                       area_samples),                                                              \
        REQUEST_OPTION(owner, TEXT, "light-lists", "NAME", "auto, clustered, linked",              \
                       light_lists),                                                               \
        REQUEST_OPTION(owner, TEXT, "transparency", "NAME", TRANSPARENCY_NAMES, transparency),     \
        REQUEST_OPTION(owner, TEXT, "blend-filter", "NAME", "tint, coverage, kim, modisett",       \
                       blend_filter),                                                              \
        REQUEST_OPTION(owner, TEXT, "refraction", "NAME",                                          \
                       "auto, off: all is seen straight through glass", refraction),               \
        REQUEST_OPTION(owner, NUMBER, "refraction-samples", "N",                                   \
                       "ray traced: directions behind rough glass, 1 to 4096",                     \
                       refraction_samples),                                                        \
        REQUEST_OPTION(owner, NUMBER, "max-error", "E", "the largest error that is acceptable",    \
                       max_error),                                                                 \
        REQUEST_OPTION(owner, NUMBER, "budget-ms", "B", "the longest time a frame may take",       \
                       budget_ms),                                                                 \
        REQUEST_OPTION(owner, TEXT, "request", "FILE",                                             \
                       "a whole request as JSON; the options go over it", base_path),              \
        REQUEST_OPTION(owner, LIST, "set", "POINTER=JSON",                                         \
                       "any member, such as /quality/shadow_taps=9", settings)
/* All of a view. */
#define REQUEST_VIEW_OPTIONS(owner)                                                       \
    REQUEST_OPTION(owner, TEXT, "camera", "SPEC",                                         \
                   "see below; default: the scene's own, or\nfit:three-quarter", camera), \
        REQUEST_LOOK_OPTIONS(owner)
/* All of a frame. */
#define REQUEST_OPTIONS(owner)                                                              \
    REQUEST_OPTION(owner, LIST, "output", "NAME",                                           \
                   "color, depth, normal, albedo, node, material, position,\n"              \
                   "transmittance, lights, layers, optical_depth\n"                         \
                   "(several: .exr)",                                                       \
                   outputs),                                                                \
        REQUEST_OPTION(owner, TEXT, "tile", "X,Y,WxH",                                      \
                       "only this rectangle of the picture, whose size --size says", tile), \
        REQUEST_VIEW_OPTIONS(owner)

/* The object in a JSON file that an option (without its dashes) names. New reference. */
json_t *json_object_load(const char *path, const char *option, struct failure *failure);

/* New reference, without "scene". Base first, then the options over it (lights, clip planes and
 * parts are added to those of the base), then
 * --set in the order given. Only what was given is in it: defaults are the server's. */
json_t *request_json_build(const struct request_options *options, struct failure *failure);

/* Sets what the RFC 6901 pointer of "POINTER=JSON" names; objects on the way are made, "-" appends
 * to an array. */
bool request_json_set(json_t *root, const char *setting, struct failure *failure);

#endif
