/* SPDX-License-Identifier: MIT */
/* Animations of the members of a scene, each of which is a plain scene. */
#include "renderer/scene/state_animation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/animated_members.h"
#include "renderer/scene/animation.h"

/* The plain scenes that a scene consists of, itself at least. */
static const struct scene *member_scene(const struct scene *scene, uint32_t index)
{
    return scene->part_count ? scene->parts[index].scene : scene;
}

static uint32_t member_count(const struct scene *scene)
{
    return scene->part_count ? scene->part_count : 1;
}

/* The animation of a member that the name means: -1 for none. Those of parts are PART/NAME. */
static int32_t find_animation(const struct scene *scene, uint32_t member, const char *name)
{
    const char *part = member ? scene->parts[member].name : "";
    size_t length = strlen(part);
    if (length && (strncmp(name, part, length) != 0 || name[length] != '/'))
        return -1;
    return scene_find_animation(member_scene(scene, member), name + length + (length > 0));
}

static uint32_t first_node(const struct scene *scene, uint32_t member)
{
    return scene->part_count ? scene->parts[member].first_node : 0;
}

void state_hide_nodes(struct scene_state *state)
{
    const struct scene *scene = state->scene;
    for (uint32_t i = 0; i < scene->node_count; i++)
        state->is_visible[i] = true;
    for (uint32_t m = 0; m < member_count(scene); m++) {
        const struct scene *member = member_scene(scene, m);
        for (uint32_t i = 0; i < member->hidden_node_count; i++)
            state->is_visible[first_node(scene, m) + member->hidden_nodes[i]] = false;
    }
}

/* ---- nodes ---- */

static bool is_shown(const struct scene *scene, const struct scene_channel *channel, double time_s)
{
    double value;
    animation_evaluate_channel(scene, channel, time_s, &value);
    return value != 0;
}

/* Moves the nodes of one scene, which begin at first. only: -1 for all of its animations. */
static void move_nodes(struct scene_state *state, const struct scene *scene, int32_t only,
                       double time_s, uint32_t first, struct moved_nodes *moved,
                       const double **locals)
{
    struct scene_pose *poses = moved->poses + moved->count;
    if (scene->pose_count)
        memcpy(poses, scene->poses, scene->pose_count * sizeof *poses);
    for (uint32_t i = 0; i < scene->animation_count; i++) {
        const struct scene_animation *animation = &scene->animations[i];
        if (only >= 0 && only != (int32_t)i)
            continue;
        animation_evaluate(scene, i, time_s, poses, moved->weights);
        for (uint32_t c = 0; c < animation->channel_count; c++) {
            const struct scene_channel *channel = &scene->channels[animation->first_channel + c];
            if (channel->path == SCENE_MEMBER) {
                moved->has_members = true;
                continue;
            }
            uint32_t node = channel->path == SCENE_VISIBILITY ? channel->target
                            : channel->path == SCENE_WEIGHTS
                                ? scene->deformed_nodes[channel->target].node
                                : poses[channel->target].node;
            moved->has_channel[first + node] = true;
            if (channel->path == SCENE_VISIBILITY)
                state->is_visible[first + node] = is_shown(scene, channel, time_s);
        }
    }
    for (uint32_t i = 0; i < scene->pose_count; i++) {
        double *local = moved->locals[moved->count + i];
        mat4_compose(poses[i].translation, poses[i].rotation, poses[i].scale, local);
        locals[first + poses[i].node] = local;
    }
    moved->count += scene->pose_count;
}

bool state_animate_nodes(struct scene_state *state, const struct view *view,
                         struct moved_nodes *moved, const double **locals, struct error *err)
{
    const struct scene *scene = state->scene;
    size_t poses = 0;
    bool is_known = !view->animation;
    for (uint32_t i = 0; i < member_count(scene); i++) {
        poses += member_scene(scene, i)->pose_count;
        is_known = is_known || find_animation(scene, i, view->animation) >= 0;
    }
    if (!is_known)
        return error_set_at(err, ERROR_NOT_FOUND, "/animation/name",
                            "the scene has no animation '%s'", view->animation);
    if (!isfinite(view->animation_time_s))
        return error_set(err, ERROR_INVALID_REQUEST, "the time of the animation is not finite");
    moved->poses = malloc((poses + 1) * sizeof *moved->poses);
    moved->locals = calloc(poses + 1, sizeof *moved->locals);
    moved->has_channel = calloc(scene->node_count + 1, sizeof *moved->has_channel);
    if (!moved->poses || !moved->locals || !moved->has_channel)
        return error_set(err, ERROR_NO_MEMORY, "%zu moved nodes", poses);
    for (uint32_t i = 0; i < member_count(scene); i++) {
        int32_t only = view->animation ? find_animation(scene, i, view->animation) : -1;
        if (!view->animation || only >= 0)
            move_nodes(state, member_scene(scene, i), only, view->animation_time_s,
                       first_node(scene, i), moved, locals);
        if (moved->weights)
            moved->weights += member_scene(scene, i)->target_weight_count;
    }
    return true;
}

static bool is_moved(const struct scene *scene, const struct moved_nodes *moved, uint32_t node)
{
    for (int32_t at = (int32_t)node; at >= 0; at = scene->nodes[at].parent)
        if (moved->has_channel[at])
            return true;
    return false;
}

bool state_moves_anything(const struct scene *scene, const struct moved_nodes *moved)
{
    if (moved->has_members)
        return true;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        if ((node->mesh >= 0 || node->light >= 0 || node->camera >= 0) && is_moved(scene, moved, i))
            return true;
    }
    for (uint32_t m = 0; m < member_count(scene); m++) {
        const struct scene *member = member_scene(scene, m);
        uint32_t first = first_node(scene, m);
        for (uint32_t i = 0; i < member->joint_count; i++)
            if (is_moved(scene, moved, first + member->joints[i].node))
                return true;
    }
    return false;
}

void moved_nodes_finish(struct moved_nodes *moved)
{
    free(moved->poses);
    free(moved->locals);
    free(moved->has_channel);
}

/* ---- materials, lights and cameras ---- */

/* A copy of the records, unless there is one. */
static bool copy_records(void **copy, const void *records, uint32_t count, size_t record_bytes,
                         struct error *err)
{
    if (*copy)
        return true;
    *copy = malloc(count * record_bytes + 1);
    if (!*copy)
        return error_set(err, ERROR_NO_MEMORY, "%u animated records", count);
    memcpy(*copy, records, count * record_bytes);
    return true;
}

/* Where the records of a part begin in those of the state. */
struct first_records {
    uint32_t material, light, camera;
};

static bool set_light(struct scene_state *state, uint32_t index,
                      const struct animated_member *member, const double *values, struct error *err)
{
    const struct scene *scene = state->scene;
    if (!copy_records((void **)&state->file_lights, scene->lights, scene->light_count,
                      sizeof *scene->lights, err))
        return false;
    struct scene_light *light = &state->file_lights[index];
    animated_member_set(member, values, light);
    light->inner_cone_rad = fminf(light->inner_cone_rad, light->outer_cone_rad);
    return true;
}

static bool set_camera(struct scene_state *state, uint32_t index,
                       const struct animated_member *member, const double *values,
                       struct error *err)
{
    const struct scene *scene = state->scene;
    if (!copy_records((void **)&state->cameras, scene->cameras, scene->camera_count,
                      sizeof *scene->cameras, err))
        return false;
    animated_member_set(member, values, &state->cameras[index]);
    return true;
}

static bool set_member(struct scene_state *state, const struct scene *scene,
                       const struct scene_channel *channel, double time_s,
                       const struct first_records *first, struct error *err)
{
    const struct animated_member *member = animated_member(channel->member);
    double values[4];
    animation_evaluate_channel(scene, channel, time_s, values);
    switch (member->owner) {
    case ANIMATED_MATERIAL:
        animated_member_set(member, values,
                            &state->materials[first->material + channel->target].base);
        return true;
    case ANIMATED_LIGHT:
        return set_light(state, first->light + channel->target, member, values, err);
    case ANIMATED_CAMERA:
        return set_camera(state, first->camera + channel->target, member, values, err);
    }
    return true;
}

static bool animate_members_of(struct scene_state *state, const struct view *view, uint32_t m,
                               const struct first_records *first, struct error *err)
{
    const struct scene *member = member_scene(state->scene, m);
    int32_t only = view->animation ? find_animation(state->scene, m, view->animation) : -1;
    for (uint32_t a = 0; a < member->animation_count; a++) {
        const struct scene_animation *animation = &member->animations[a];
        if (view->animation && only != (int32_t)a)
            continue;
        for (uint32_t c = 0; c < animation->channel_count; c++) {
            const struct scene_channel *channel = &member->channels[animation->first_channel + c];
            if (channel->path == SCENE_MEMBER &&
                !set_member(state, member, channel, view->animation_time_s, first, err))
                return false;
        }
    }
    return true;
}

bool state_animate_members(struct scene_state *state, const struct view *view, struct error *err)
{
    const struct scene *scene = state->scene;
    struct first_records first = {0};
    for (uint32_t m = 0; m < member_count(scene); m++) {
        const struct scene *member = member_scene(scene, m);
        first.material = scene->part_count ? scene->parts[m].first_material : 0;
        if (!animate_members_of(state, view, m, &first, err))
            return false;
        first.light += member->light_count;
        first.camera += member->camera_count;
    }
    return true;
}
