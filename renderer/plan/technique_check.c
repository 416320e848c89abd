/* SPDX-License-Identifier: MIT */
/* Compares what a frame asks with what its technique can do, bit by bit. */
#include "renderer/plan/technique_check.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/sample_pattern.h"

/* The members of SHADOW_CAN_* that the frame asks for. */
static unsigned needs_of(const struct technique_demand *demand)
{
    const struct view_quality *quality = demand->quality;
    bool has_linked_lists = quality->light_lists == VIEW_LIGHT_LISTS_LINKED;
    bool has_areas = demand->is_rasterised && demand->area_lights > 0;
    return (quality->reference ? SHADOW_CAN_REFERENCE : 0u) |
           (quality->samples > SAMPLES_RASTER_MAX && !quality->reference ? SHADOW_CAN_MANY_SAMPLES
                                                                         : 0u) |
           (has_linked_lists && demand->window_lights > 0 ? SHADOW_CAN_LINKED_LISTS : 0u) |
           (demand->is_hazy ? SHADOW_CAN_ATMOSPHERE : 0u) |
           (demand->has_grids ? SHADOW_CAN_GRIDS : 0u) | (has_areas ? SHADOW_CAN_AREA_LIGHTS : 0u) |
           (demand->unfiltered_lights > 0 ? SHADOW_CAN_FILTER : 0u) |
           (demand->gray_lights > 0 ? SHADOW_CAN_COLOR : 0u) |
           (demand->layered_lights > 0 ? SHADOW_CAN_LAYERS : 0u) |
           (demand->bodied_lights > 0 ? SHADOW_CAN_INSIDE : 0u) |
           (demand->excluding_lights > 0 ? SHADOW_CAN_SELF_SHADOW : 0u);
}

static bool refuse_samples(int samples, struct error *err)
{
    return error_set(err, ERROR_INVALID_REQUEST, "%d samples per pixel, choose 1, 4, 8 or 16",
                     samples);
}

bool technique_check_samples(const struct view_quality *quality, struct error *err)
{
    int samples = quality->samples;
    bool is_known = samples == 0 || sample_pattern_has(samples) || samples == 64 || samples == 256;
    if (quality->reference && samples == 8)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "8 samples per pixel, but the reference takes a regular grid: choose 1, "
                         "4, 16, 64 or 256");
    return is_known || refuse_samples(samples, err);
}

static bool refuse(const struct technique_demand *demand, unsigned missing, struct error *err)
{
    const struct view_quality *quality = demand->quality;
    char others[SHADOW_TECHNIQUES_TEXT_BYTES];
    if (missing & SHADOW_CAN_REFERENCE) {
        shadow_techniques_text(SHADOW_CAN_REFERENCE, 0, others);
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the reference is ray traced: shadows must be %s", others);
    }
    if (missing & SHADOW_CAN_MANY_SAMPLES)
        return refuse_samples(quality->samples, err);
    if (missing & SHADOW_CAN_LINKED_LISTS) /* which are on the device */
        return error_set(err, ERROR_INVALID_REQUEST,
                         "%s follow the clustered light lists: light_lists must be auto or "
                         "clustered",
                         shadow_technique_name((int)quality->shadows));
    if (missing & SHADOW_CAN_ATMOSPHERE) {
        shadow_techniques_text(SHADOW_CAN_ATMOSPHERE, 0, others);
        return error_set(err, ERROR_INVALID_REQUEST, "%s draws no atmosphere: shadows must be %s",
                         shadow_technique_name((int)quality->shadows), others);
    }
    if (missing & SHADOW_CAN_GRIDS) {
        shadow_techniques_text(SHADOW_CAN_GRIDS, 0, others);
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the scene has density grids, which %s does not draw: shadows must be %s",
                         shadow_technique_name((int)quality->shadows), others);
    }
    if (demand->has_grids && demand->is_rasterised &&
        quality->light_lists == VIEW_LIGHT_LISTS_LINKED)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "density grids are lit through the clustered light lists: light_lists "
                         "must be auto or clustered");
    if (demand->is_hazy && quality->light_lists == VIEW_LIGHT_LISTS_LINKED)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "an atmosphere is lit through the clustered light lists: light_lists must "
                         "be auto or clustered");
    return true;
}

__attribute__((format(printf, 2, 3))) static void add(struct technique_lacks *lacks,
                                                      const char *format, ...)
{
    va_list arguments;
    assert(lacks->count < TECHNIQUE_LACKS_MAX);
    va_start(arguments, format);
    vsnprintf(lacks->texts[lacks->count++], REPORT_TEXT_BYTES, format, arguments);
    va_end(arguments);
}

/* What transparent casters do to light, though not as they would. */
static void add_of_lights(const struct technique_demand *demand, unsigned missing,
                          struct technique_lacks *lacks)
{
    const char *name = shadow_technique_name((int)demand->quality->shadows);
    if (missing & SHADOW_CAN_COLOR)
        add(lacks,
            "shadows %s: transparent casters dim light without colouring it, of %zu of %zu lights; "
            "deep colours it",
            name, demand->gray_lights, demand->lights);
    if (missing & SHADOW_CAN_LAYERS)
        add(lacks,
            "shadows %s: transparent surfaces and haze behind the first transparent one get the "
            "light behind the last, of %zu of %zu lights; deep tells them apart",
            name, demand->layered_lights, demand->lights);
    if (missing & SHADOW_CAN_INSIDE)
        add(lacks,
            "shadows %s: a transparent mesh casts no shadow on itself, and haze behind the first "
            "gets the light behind the last, of %zu of %zu lights; deep tells depths apart",
            name, demand->bodied_lights, demand->lights);
    if (missing & SHADOW_CAN_SELF_SHADOW)
        add(lacks,
            "shadows %s: materials without self shadow, or that cast once, cast as others do, of "
            "%zu of %zu lights; deep leaves them out",
            name, demand->excluding_lights, demand->lights);
}

bool technique_check(const struct technique_demand *demand, struct technique_lacks *lacks,
                     struct error *err)
{
    enum shadow_technique shadows = demand->quality->shadows;
    unsigned missing = needs_of(demand) & ~shadow_technique_rows[shadows].can;
    lacks->count = 0;
    if (!refuse(demand, missing, err))
        return false;
    if (missing & SHADOW_CAN_AREA_LIGHTS)
        add(lacks,
            "%zu area light%s a hard shadow, from the centre; shadows raytraced, "
            "raytraced-shadows or auto makes it soft",
            demand->area_lights, demand->area_lights == 1 ? " has" : "s have");
    if (missing & SHADOW_CAN_FILTER)
        add(lacks,
            "shadows %s: light passes transparent casters unchanged, of %zu of %zu lights; "
            "deep filters it",
            shadow_technique_name((int)shadows), demand->unfiltered_lights, demand->lights);
    add_of_lights(demand, missing, lacks);
    if (demand->unfit_casters > 0)
        add(lacks,
            "%s cannot follow light through %zu caster%s of the scene (textures, masks, media, "
            "slabs, or that cast once): the shadows are those of %s",
            shadow_technique_name((int)demand->asked), demand->unfit_casters,
            demand->unfit_casters == 1 ? "" : "s", shadow_technique_name((int)shadows));
    if (demand->fall_back)
        add(lacks, "%s", demand->fall_back);
    if (demand->thick_media != SHADOWS_AUTO)
        add(lacks,
            "%s has no room for media: closed volumes keep the thickness of "
            "their material; 'deep' follows the light inside",
            shadow_technique_name((int)demand->thick_media));
    return true;
}
