/* SPDX-License-Identifier: MIT */
/* The rows as a table. */
#include "protocol/shadow_technique.h"

#include <stdio.h>
#include <string.h>

#include "protocol/quality_defaults.h"

const struct shadow_technique_row shadow_technique_rows[SHADOWS_COUNT] = {
#define ROW(id, wire_name, abilities, members, steps, words, says) \
    [SHADOWS_##id] = {.name = (wire_name),                         \
                      .can = (abilities),                          \
                      .parameters = (members),                     \
                      .distance = (steps),                         \
                      .candidate = (words),                        \
                      .sentence = (says)},
    SHADOW_TECHNIQUES(ROW)
#undef ROW
};

static const struct shadow_technique_row *row_of(int technique)
{
    return technique >= 0 && technique < SHADOWS_COUNT ? &shadow_technique_rows[technique] : NULL;
}

const char *shadow_technique_name(int technique)
{
    const struct shadow_technique_row *row = row_of(technique);
    return row ? row->name : NULL;
}

enum shadow_technique shadow_technique_find(const char *name)
{
    int i = 0;
    while (i < SHADOWS_COUNT && strcmp(shadow_technique_rows[i].name, name) != 0)
        i++;
    return (enum shadow_technique)i;
}

bool shadow_technique_can(enum shadow_technique technique, unsigned can)
{
    const struct shadow_technique_row *row = row_of((int)technique);
    return row && (row->can & can) == can;
}

bool shadow_technique_has(enum shadow_technique technique, unsigned parameters)
{
    const struct shadow_technique_row *row = row_of((int)technique);
    return row && (row->parameters & parameters) == parameters;
}

int shadow_technique_taps(enum shadow_technique technique, int said)
{
    bool is_smooth = shadow_technique_can(technique, SHADOW_CAN_BE_SMOOTH);
    return quality_or(said, is_smooth ? SHADOW_TAPS_DEFAULT : SHADOW_TAPS_DEFAULT_NOISY);
}

enum shadow_family shadow_technique_family(enum shadow_technique technique)
{
    return shadow_technique_can(technique, SHADOW_CAN_MANY_SAMPLES) ? SHADOW_FAMILY_RAYS
           : shadow_technique_has(technique, SHADOW_HAS_RESOLUTION) ? SHADOW_FAMILY_MAPS
           : shadow_technique_can(technique, SHADOW_CAN_FILTER)     ? SHADOW_FAMILY_POINTS
                                                                    : SHADOW_FAMILY_NONE;
}

bool shadow_technique_is_renderer(enum shadow_technique technique)
{
    return shadow_technique_family(technique) == SHADOW_FAMILY_RAYS;
}

bool shadow_technique_is_candidate(enum shadow_technique technique)
{
    const struct shadow_technique_row *row = row_of((int)technique);
    return row && row->candidate;
}

/* "auto, map or deep", of count names. */
static void join(const char *const *names, int count, char text[SHADOW_TECHNIQUES_TEXT_BYTES])
{
    size_t used = 0;
    text[0] = 0;
    for (int i = 0; i < count && used < SHADOW_TECHNIQUES_TEXT_BYTES; i++)
        used += (size_t)snprintf(text + used, SHADOW_TECHNIQUES_TEXT_BYTES - used, "%s%s",
                                 i == 0           ? ""
                                 : i == count - 1 ? " or "
                                                  : ", ",
                                 names[i]);
}

void shadow_techniques_text(unsigned can, unsigned parameters,
                            char text[SHADOW_TECHNIQUES_TEXT_BYTES])
{
    const char *names[SHADOWS_COUNT];
    int count = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (shadow_technique_can((enum shadow_technique)i, can) &&
            shadow_technique_has((enum shadow_technique)i, parameters))
            names[count++] = shadow_technique_rows[i].name;
    join(names, count, text);
}

void shadow_techniques_rasterised_text(char text[SHADOW_TECHNIQUES_TEXT_BYTES])
{
    const char *names[SHADOWS_COUNT];
    int count = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (i != SHADOWS_AUTO && !shadow_technique_is_renderer((enum shadow_technique)i))
            names[count++] = shadow_technique_rows[i].name;
    join(names, count, text);
}

const char *shadow_can_name(int bit)
{
    static const char *const names[] = {"color",      "media",         "area_lights",
                                        "reference",  "many_samples",  "linked_light_lists",
                                        "atmosphere", "density_grids", "filter",
                                        "layers",     "self_shadow",   "noise_free",
                                        "inside"};
    return bit >= 0 && bit < (int)(sizeof names / sizeof *names) ? names[bit] : NULL;
}

const char *shadow_parameter_name(int bit)
{
    static const char *const names[] = {"shadow_resolution",  "shadow_taps",
                                        "shadow_compression", "shadow_prefilter",
                                        "shadow_fallback",    "area_samples"};
    return bit >= 0 && bit < (int)(sizeof names / sizeof *names) ? names[bit] : NULL;
}
