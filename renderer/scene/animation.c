/* SPDX-License-Identifier: MIT */
/* Interpolation between keys. */
#include "renderer/scene/animation.h"

#include "renderer/base/matrix.h"
#include "renderer/scene/animated_members.h"

/* A channel between two of its keys. */
struct between {
    uint32_t left;
    double t;    /* [0, 1) from left to the next key; 0 on a key */
    double td_s; /* from left to the next key */
};

static struct between find_keys(const float *times, uint32_t count, double time_s)
{
    if (!(time_s > (double)times[0]))
        return (struct between){.left = 0};
    if (time_s >= (double)times[count - 1])
        return (struct between){.left = count - 1};
    uint32_t low = 0, high = count - 1; /* times[low] <= time_s < times[high] */
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if ((double)times[middle] <= time_s)
            low = middle;
        else
            high = middle;
    }
    double td_s = (double)times[high] - (double)times[low];
    return (struct between){.left = low, .t = (time_s - (double)times[low]) / td_s, .td_s = td_s};
}

static void normalize4(double q[4])
{
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; i++)
        q[i] = length > 0 ? q[i] / length : i == 3;
}

/* Appendix C.4: along the shorter arc; nearly equal rotations by a straight line, whose error is
 * below the rounding there. */
static void slerp(const float *from, const float *to, double t, double out[4])
{
    double a[4], b[4], cosine = 0;
    for (int i = 0; i < 4; i++) {
        a[i] = (double)from[i];
        b[i] = (double)to[i];
    }
    normalize4(a);
    normalize4(b);
    for (int i = 0; i < 4; i++)
        cosine += a[i] * b[i];
    double sign = cosine < 0 ? -1 : 1;
    double angle = acos(fmin(cosine * sign, 1));
    double left = 1 - t, right = t;
    if (angle > 1e-6) {
        left = sin(angle * (1 - t)) / sin(angle);
        right = sin(angle * t) / sin(angle);
    }
    for (int i = 0; i < 4; i++)
        out[i] = left * a[i] + sign * right * b[i];
}

/* Appendix C.5; a key is its in-tangent, its value and its out-tangent. */
static void cubic(const float *values, int components, const struct between *at, double *out)
{
    double t = at->t, t2 = t * t, t3 = t2 * t;
    const float *left = values + 3 * (size_t)components * at->left;
    for (int i = 0; i < components; i++) {
        double value = (double)left[components + i];
        if (t > 0) {
            const float *right = left + 3 * (size_t)components;
            value = (2 * t3 - 3 * t2 + 1) * value +
                    at->td_s * (t3 - 2 * t2 + t) * (double)left[2 * components + i] +
                    (3 * t2 - 2 * t3) * (double)right[components + i] +
                    at->td_s * (t3 - t2) * (double)right[i];
        }
        out[i] = value;
    }
}

uint32_t scene_channel_components(const struct scene *scene, const struct scene_channel *channel)
{
    switch (channel->path) {
    case SCENE_ROTATION:
        return 4;
    case SCENE_WEIGHTS:
        return scene->deformed_nodes[channel->target].weight_count;
    case SCENE_VISIBILITY:
        return 1;
    case SCENE_MEMBER:
        return animated_member(channel->member)->count;
    default:
        return 3;
    }
}

void animation_evaluate_channel(const struct scene *scene, const struct scene_channel *channel,
                                double time_s, double *out)
{
    int components = (int)scene_channel_components(scene, channel);
    const float *times = scene->keys + channel->first_key;
    const float *values = times + channel->key_count;
    struct between at = find_keys(times, channel->key_count, time_s);
    const float *left = values + (size_t)components * at.left;
    if (channel->interpolation == SCENE_CUBIC) {
        cubic(values, components, &at, out);
    } else if (channel->interpolation == SCENE_STEP || at.t <= 0) {
        for (int i = 0; i < components; i++)
            out[i] = (double)left[i];
    } else if (channel->path == SCENE_ROTATION) {
        slerp(left, left + components, at.t, out);
    } else {
        for (int i = 0; i < components; i++)
            out[i] = (1 - at.t) * (double)left[i] + at.t * (double)left[components + i];
    }
    if (channel->path == SCENE_ROTATION)
        normalize4(out);
}

static void evaluate_weights(const struct scene *scene, const struct scene_channel *channel,
                             double time_s, float *weights)
{
    const struct scene_deformed_node *node = &scene->deformed_nodes[channel->target];
    double values[SCENE_TARGETS_MAX];
    animation_evaluate_channel(scene, channel, time_s, values);
    for (uint32_t i = 0; i < node->weight_count; i++)
        weights[node->first_weight + i] = (float)values[i];
}

void animation_evaluate(const struct scene *scene, uint32_t animation, double time_s,
                        struct scene_pose *poses, float *weights)
{
    const struct scene_animation *a = &scene->animations[animation];
    for (uint32_t i = 0; i < a->channel_count; i++) {
        const struct scene_channel *channel = &scene->channels[a->first_channel + i];
        if (channel->path == SCENE_WEIGHTS) {
            evaluate_weights(scene, channel, time_s, weights);
            continue;
        }
        if (channel->path > SCENE_WEIGHTS)
            continue;
        struct scene_pose *pose = &poses[channel->target];
        double *members[] = {[SCENE_TRANSLATION] = pose->translation,
                             [SCENE_ROTATION] = pose->rotation,
                             [SCENE_SCALE] = pose->scale};
        animation_evaluate_channel(scene, channel, time_s, members[channel->path]);
    }
}
