/* SPDX-License-Identifier: MIT */
/* Skins, influences and morph targets of a scene blob. */
#include "renderer/scene/deformation_check.h"

#include "renderer/scene/blob_check.h"

static bool check_skins(const struct scene *scene, struct error *err)
{
    uint64_t joints = 0;
    for (uint32_t i = 0; i < scene->joint_count; i++)
        if (scene->joints[i].node >= scene->node_count ||
            !blob_are_finite(scene->joints[i].inverse_bind, 12))
            return blob_refuse(err, "joint", i);
    for (uint32_t i = 0; i < scene->skin_count; i++) {
        const struct scene_skin *skin = &scene->skins[i];
        if (skin->first_joint != joints || skin->joint_count == 0 ||
            skin->joint_count > scene->joint_count - joints)
            return blob_refuse(err, "skin", i);
        joints += skin->joint_count;
    }
    return true;
}

static bool are_influences(const struct scene *scene, const struct scene_deformation *d,
                           uint64_t count)
{
    for (uint64_t i = 0; i < count; i++) {
        const struct scene_influence *influence = &scene->influences[d->first_influence + i];
        for (int k = 0; k < 4; k++)
            if (influence->joints[k] >= d->joint_count ||
                !(influence->weights[k] >= 0 && influence->weights[k] <= 1))
                return false;
    }
    return true;
}

static bool is_target(const struct scene *scene, const struct scene_target *target,
                      uint32_t vertex_count)
{
    for (uint32_t i = 0; i < target->delta_count; i++) {
        const struct scene_delta *delta = &scene->deltas[target->first_delta + i];
        if (delta->vertex >= vertex_count || (i > 0 && delta->vertex <= delta[-1].vertex) ||
            !blob_are_finite(delta->position, 3) || !blob_are_finite(delta->normal, 3) ||
            !blob_are_finite(delta->tangent, 3))
            return false;
    }
    return true;
}

/* Each range begins where the one before it ends, so that nothing is read twice. */
static bool check_deformations(const struct scene *scene, struct error *err)
{
    uint64_t influences = 0, targets = 0, deltas = 0;
    for (uint32_t i = 0; i < scene->deformation_count; i++) {
        const struct scene_deformation *d = &scene->deformations[i];
        if (d->primitive >= scene->primitive_count || (i > 0 && d->primitive <= d[-1].primitive))
            return blob_refuse(err, "deformation", i);
        const struct scene_primitive *p = &scene->primitives[d->primitive];
        uint64_t own = (uint64_t)d->influence_sets * p->vertex_count;
        bool is_flat = d->flags & SCENE_DEFORMATION_IS_FLAT;
        if (d->influence_sets > SCENE_INFLUENCE_SETS_MAX || d->first_influence != influences ||
            own > scene->influence_count - influences || d->flags > SCENE_DEFORMATION_IS_FLAT ||
            (is_flat && (p->topology != SCENE_TRIANGLES || p->vertex_count % 3)) ||
            d->first_target != targets || d->target_count > SCENE_TARGETS_MAX ||
            d->target_count > scene->target_count - targets || !are_influences(scene, d, own))
            return blob_refuse(err, "deformation", i);
        for (uint32_t t = 0; t < d->target_count; t++) {
            const struct scene_target *target = &scene->targets[targets + t];
            if (target->first_delta != deltas ||
                target->delta_count > scene->delta_count - deltas ||
                !is_target(scene, target, p->vertex_count))
                return blob_refuse(err, "morph target", targets + t);
            deltas += target->delta_count;
        }
        influences += own;
        targets += d->target_count;
    }
    return true;
}

bool scene_check_deformations(const struct scene *scene, struct error *err)
{
    uint64_t weights = 0;
    if (!check_skins(scene, err) || !check_deformations(scene, err))
        return false;
    if (!blob_are_finite(scene->target_weights, scene->target_weight_count))
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: a weight is not finite");
    for (uint32_t i = 0; i < scene->deformed_node_count; i++) {
        const struct scene_deformed_node *n = &scene->deformed_nodes[i];
        if (n->node >= scene->node_count || (i > 0 && n->node <= n[-1].node) ||
            scene->nodes[n->node].mesh < 0 || n->skin < -1 ||
            n->skin >= (int64_t)scene->skin_count || n->first_weight != weights ||
            n->weight_count > SCENE_TARGETS_MAX ||
            n->weight_count > scene->target_weight_count - weights)
            return blob_refuse(err, "deformed node", i);
        weights += n->weight_count;
    }
    return true;
}
