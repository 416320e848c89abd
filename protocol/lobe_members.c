/* SPDX-License-Identifier: MIT */
/* The table of lobes. */
#include "protocol/lobe_members.h"

#include "protocol/lobe_members_json.h"

static const struct lobe_member_kind kinds[LOBE_MEMBER_COUNT] = {
    [LOBE_SPECULAR] = {"specular", 1, 0, 1},
    [LOBE_SPECULAR_COLOR] = {"specular_color", 3, 0, 1e12},
    [LOBE_CLEARCOAT] = {"clearcoat", 1, 0, 1},
    [LOBE_CLEARCOAT_ROUGHNESS] = {"clearcoat_roughness", 1, 0, 1},
    [LOBE_SHEEN_COLOR] = {"sheen_color", 3, 0, 1},
    [LOBE_SHEEN_ROUGHNESS] = {"sheen_roughness", 1, 0, 1},
    [LOBE_IRIDESCENCE] = {"iridescence", 1, 0, 1},
    [LOBE_IRIDESCENCE_IOR] = {"iridescence_ior", 1, 1, 100},
    [LOBE_IRIDESCENCE_THICKNESS] = {"iridescence_thickness_nm", 1, 0, 1e6},
    [LOBE_ANISOTROPY] = {"anisotropy", 1, 0, 1},
    [LOBE_ANISOTROPY_ROTATION] = {"anisotropy_rotation_deg", 1, -360, 360},
    [LOBE_DIFFUSE_TRANSMISSION] = {"diffuse_transmission", 1, 0, 1},
    [LOBE_DIFFUSE_TRANSMISSION_COLOR] = {"diffuse_transmission_color", 3, 0, 1},
    [LOBE_DISPERSION] = {"dispersion", 1, 0, 100},
};

const struct lobe_member_kind *lobe_member_kind(int member)
{
    return &kinds[member];
}

bool lobe_members_read(const struct json_node *object, struct lobe_members *lobes)
{
    *lobes = (struct lobe_members){.said = 0};
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++) {
        const struct lobe_member_kind *kind = &kinds[i];
        struct json_node member = json_member(object, kind->name);
        double *values = lobes->values[i];
        if (!(kind->count == 1 ? json_read_number(&member, kind->least, kind->most, values)
                               : json_read_numbers(&member, (size_t)kind->count, kind->least,
                                                   kind->most, values)))
            return false;
        if (member.value)
            lobes->said |= 1u << i;
    }
    return true;
}

void lobe_members_write(const struct lobe_members *lobes, struct json_writer *writer)
{
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++) {
        if (!(lobes->said & 1u << i))
            continue;
        if (kinds[i].count == 1)
            json_put_number(writer, kinds[i].name, lobes->values[i][0]);
        else
            json_put_numbers(writer, kinds[i].name, lobes->values[i], (size_t)kinds[i].count);
    }
}
