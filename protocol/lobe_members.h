/* SPDX-License-Identifier: MIT */
/* The members of overrides.materials that belong to the lobes of glTF's extensions of materials:
 * KHR_materials_specular, _clearcoat, _sheen, _iridescence, _anisotropy, _diffuse_transmission and
 * _dispersion. */
#ifndef VITRAIL_PROTOCOL_LOBE_MEMBERS_H
#define VITRAIL_PROTOCOL_LOBE_MEMBERS_H

#include <stdint.h>

enum lobe_member {
    LOBE_SPECULAR,
    LOBE_SPECULAR_COLOR,
    LOBE_CLEARCOAT,
    LOBE_CLEARCOAT_ROUGHNESS,
    LOBE_SHEEN_COLOR,
    LOBE_SHEEN_ROUGHNESS,
    LOBE_IRIDESCENCE,
    LOBE_IRIDESCENCE_IOR,
    LOBE_IRIDESCENCE_THICKNESS, /* where its texture is 1, and where there is none */
    LOBE_ANISOTROPY,
    LOBE_ANISOTROPY_ROTATION,
    LOBE_DIFFUSE_TRANSMISSION,
    LOBE_DIFFUSE_TRANSMISSION_COLOR,
    LOBE_DISPERSION,
    LOBE_MEMBER_COUNT
};

enum { LOBE_NUMBERS_MAX = 3 };

struct lobe_member_kind {
    const char *name;   /* in JSON */
    int count;          /* numbers: 1, or 3 of a colour */
    double least, most; /* of each */
};

/* member: one of enum lobe_member. */
const struct lobe_member_kind *lobe_member_kind(int member);

/* A material's lobes, as far as they are said. Zeroed = none. */
struct lobe_members {
    uint32_t said; /* bit set of 1u << enum lobe_member */
    double values[LOBE_MEMBER_COUNT][LOBE_NUMBERS_MAX];
};

#endif
