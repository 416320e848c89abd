/* SPDX-License-Identifier: MIT */
/* The programs that casters are drawn with. */
#include "renderer/shadows/caster_variants.h"

#include <math.h>
#include <stdio.h>

#include "renderer/scene/blend_law.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* The key of a variant: bits 0..6 sampled texture slots, then these. */
enum {
    VARIANT_TEXTURES = (1 << 7) - 1,
    VARIANT_COLORS = 1 << 7,
    VARIANT_ANGLED = 1 << 8,
    VARIANT_CERTAIN = 1 << 9, /* every fragment makes an event */
    VARIANT_OPAQUE = 1 << 10,
    VARIANT_MASKED = 1 << 11,
    VARIANT_IDS = 1 << 12,
    VARIANT_CONSTANT = 1 << 13,  /* the filter is evaluated per vertex */
    VARIANT_MEDIA = 1 << 14,     /* keep the medium of each event */
    VARIANT_MEDIUM = 1 << 15,    /* the caster is one */
    VARIANT_PASS = 1 << 16,      /* times enum caster_pass, which has four bits */
    VARIANT_SUBTEXELS = 1 << 20, /* times sub-texel samples per side, at most 4 */
    VARIANT_PLANES = 1 << 23,    /* times clip planes, at most 8 */
    VARIANT_CAP = 1 << 27,       /* the caster closes a cut */
    VARIANT_AROUND = 1 << 28,    /* a medium that begins at the cut: no caster is drawn */
    VARIANT_LAYERED = 1 << 29,   /* all faces in one pass */
    VARIANT_UNLOCKED = 1 << 30,  /* lists as published, without their locks */
};

static uint32_t variant_pass(uint32_t key)
{
    return key / VARIANT_PASS & 15;
}

bool caster_pass_has_colors(enum caster_pass pass)
{
    return pass >= CASTER_PRODUCT && pass <= CASTER_MOMENTS;
}

bool caster_pass_is_ordered(enum caster_pass pass)
{
    return pass == CASTER_BLEND;
}

uint32_t caster_pass_rounds(enum caster_pass pass)
{
    return pass == CASTER_WAVELENGTH ? 3 : 1;
}

/* Deep lists alone have media, objects and samples within a texel. */
static bool is_deep(enum caster_pass pass)
{
    return pass == CASTER_COUNT || pass == CASTER_SCATTER;
}

/* Whether the filter darkens some channel wherever the surface is and at every angle: textures and
 * vertex colours only darken transmission, and coverage is no less than the least alpha. */
static bool filters_everywhere(const struct scene_material *m, float least_alpha,
                               uint32_t blend_filter)
{
    const float darkens = 0.999f;
    float a = m->base_color[3] * least_alpha;
    float least = 1;
    for (int k = 0; k < 3; k++) {
        float base = m->base_color[k]; /* at most */
        float t = m->transmission > 0 ? m->transmission * base : 0;
        if (m->alpha_mode == SCENE_BLEND) {
            t = m->transmission > 0 ? 1 - a * (1 - t)
                                    : (float)blend_law_filter((enum view_blend_filter)blend_filter,
                                                              (double)a, (double)base);
        }
        least = fminf(least, t);
    }
    return least < darkens;
}

static uint32_t sampled_slots(const struct scene *scene, const struct scene_material *m)
{
    static const int slots[] = {SCENE_TEXTURE_BASE_COLOR, SCENE_TEXTURE_TRANSMISSION,
                                SCENE_TEXTURE_THICKNESS};
    uint32_t mask = 0;
    for (int i = 0; i < 3; i++) {
        int32_t texture = m->textures[slots[i]].texture;
        bool is_used = i == 0 || (m->transmission > 0 && (i == 1 || m->thickness > 0));
        if (is_used && texture >= 0 && scene->textures[texture].image >= 0)
            mask |= 1u << slots[i];
    }
    return mask;
}

static float least_alpha(const struct caster_view *view, const struct scene_material *m)
{
    return scene_gpu_least_alpha(view->scene->gpu, m->textures[SCENE_TEXTURE_BASE_COLOR].texture);
}

uint32_t caster_key(const struct caster_view *view, const struct state_item *item)
{
    const struct scene *scene = view->scene->state->scene;
    const struct scene_material *m = &view->scene->state->materials[item->material].base;
    bool has_colors =
        state_geometry_of(view->scene->state, item).primitive->flags & SCENE_PRIMITIVE_HAS_COLORS;
    uint32_t key =
        (uint32_t)view->pass * VARIANT_PASS + view->map->plane_count * (uint32_t)VARIANT_PLANES +
        (item->cap && view->map->plane_count ? VARIANT_CAP : 0u) +
        (view->is_layered ? VARIANT_LAYERED : 0u) + (view->is_unlocked ? VARIANT_UNLOCKED : 0u);
    uint32_t slots = sampled_slots(scene, m) | (has_colors ? VARIANT_COLORS : 0u);
    if (item->class_ == STATE_OPAQUE)
        return key | VARIANT_OPAQUE;
    if (item->class_ == STATE_MASKED)
        return key | VARIANT_MASKED | (slots & (VARIANT_COLORS | 1u));
    bool has_lists = is_deep(view->pass);
    bool has_media = has_lists && (view->map->flags & SHADOW_FLAG_MEDIA);
    bool is_certain =
        has_lists &&
        ((has_media && item->is_medium) ||
         (m->alpha_mode != SCENE_MASK &&
          filters_everywhere(m, has_colors ? 0 : least_alpha(view, m), view->scene->blend_filter)));
    if (is_certain && view->pass == CASTER_COUNT) /* a medium counts where it is cut away, too */
        return key | VARIANT_CERTAIN |
               (has_media && item->is_medium && view->map->plane_count
                    ? VARIANT_MEDIA | VARIANT_MEDIUM
                    : 0u);
    /* One program for both passes: they must decide alike. */
    if (!is_certain && view->pass == CASTER_SCATTER)
        key -= (uint32_t)(CASTER_SCATTER - CASTER_COUNT) * VARIANT_PASS;
    if (has_lists && view->map->prefilter > 1)
        key |= (uint32_t)view->map->prefilter * VARIANT_SUBTEXELS;
    key |= slots | (is_certain ? VARIANT_CERTAIN : 0u);
    if (m->pass_through != SCENE_PASS_CONSTANT)
        key |= VARIANT_ANGLED;
    else if (!slots && m->alpha_mode != SCENE_MASK)
        key |= VARIANT_CONSTANT;
    if (has_lists && (view->map->flags & SHADOW_FLAG_RAW))
        key |= VARIANT_IDS;
    if (has_media)
        key |= VARIANT_MEDIA | (item->is_medium ? VARIANT_MEDIUM : 0u);
    return key;
}

/* As shadow_texel.frag.glsl has them. */
static const char *write_pass(enum caster_pass pass)
{
    return pass == CASTER_CHANCE         ? " CHANCE"
           : pass == CASTER_COLOR_CHANCE ? " CHANCE COLOR_CHANCE"
           : pass == CASTER_ONE_CHANCE   ? " CHANCE ONE_CHANCE"
           : pass == CASTER_WAVELENGTH   ? " CHANCE WAVELENGTH"
           : pass == CASTER_BLEND        ? " BLENDED"
           : pass == CASTER_MOMENTS      ? " MOMENTS"
                                         : "";
}

static void write_defines(uint32_t key, char *out, size_t size)
{
    uint32_t pass = variant_pass(key);
    bool is_flat = pass == CASTER_DEPTH && (key & VARIANT_OPAQUE);
    char subtexels[24] = "", planes[32] = "";
    if (key / VARIANT_SUBTEXELS & 7)
        snprintf(subtexels, sizeof subtexels, " SUBTEXELS=%u", key / VARIANT_SUBTEXELS & 7);
    if (key / VARIANT_PLANES & 15)
        snprintf(planes, sizeof planes, " CUT_PLANES=%u%s", key / VARIANT_PLANES & 15,
                 key & VARIANT_CAP ? " IS_CAP" : "");
    snprintf(
        out, size, "TEXTURES=%u%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s", key & 127u,
        key & VARIANT_COLORS ? " COLORS" : "", key & VARIANT_CONSTANT ? " CONSTANT" : "",
        key & VARIANT_ANGLED ? " ANGLED" : "", key & VARIANT_IDS ? " IDS" : "",
        key & VARIANT_MEDIA ? " MEDIA" : "", key & VARIANT_MEDIUM ? " MEDIUM" : "",
        key & VARIANT_CERTAIN ? (pass == CASTER_SCATTER ? " CERTAIN PASS=1" : " CERTAIN PASS=0")
                              : "",
        pass == CASTER_LINK_FAITHFUL && (key & (VARIANT_OPAQUE | VARIANT_MASKED)) ? " OPAQUE" : "",
        pass == CASTER_LINK_FAITHFUL ? " SHADOW_FAITHFUL" : "", is_flat ? " DEPTH_ONLY" : "",
        subtexels, planes, key & VARIANT_AROUND ? " AROUND" : "",
        key & VARIANT_LAYERED ? " LAYERED" : "", key & VARIANT_UNLOCKED ? " UNLOCKED" : "",
        write_pass((enum caster_pass)pass));
}

struct program_desc caster_program(uint32_t key, char defines[CASTER_DEFINES_BYTES])
{
    uint32_t pass = variant_pass(key);
    const char *fragment =
        pass == CASTER_DEPTH              ? (key & VARIANT_MASKED ? "shadow_depth.frag.glsl" : NULL)
        : is_deep((enum caster_pass)pass) ? "shadow_deep.frag.glsl"
        : caster_pass_has_colors((enum caster_pass)pass) ? "shadow_texel.frag.glsl"
                                                         : "shadow_linked.frag.glsl";
    write_defines(key, defines, CASTER_DEFINES_BYTES);
    return (struct program_desc){.label = "shadow.caster",
                                 .vertex = key & VARIANT_AROUND ? "shadow_around.vert.glsl"
                                                                : "shadow_caster.vert.glsl",
                                 .fragment = fragment,
                                 .defines = defines};
}

/* One program counts and scatters: both decide alike which rays enter what is kept. */
uint32_t caster_around_key(const struct caster_view *view)
{
    const struct shadow_map *map = view->map;
    uint32_t key = (uint32_t)CASTER_COUNT * VARIANT_PASS + VARIANT_AROUND + VARIANT_MEDIA +
                   VARIANT_MEDIUM + map->plane_count * (uint32_t)VARIANT_PLANES +
                   (view->is_layered ? VARIANT_LAYERED : 0u);
    if (map->prefilter > 1)
        key |= (uint32_t)map->prefilter * VARIANT_SUBTEXELS;
    return key | (map->flags & SHADOW_FLAG_RAW ? VARIANT_IDS : 0u);
}

bool caster_key_samples_textures(uint32_t key)
{
    return (key & VARIANT_TEXTURES) != 0 && !(key & VARIANT_OPAQUE);
}

bool caster_is_drawn(const struct caster_view *view, uint32_t item)
{
    bool is_transparent = view->scene->state->items[item].class_ == STATE_TRANSPARENT;
    return view->pass == CASTER_LINK_FAITHFUL || is_transparent == (view->pass != CASTER_DEPTH);
}

static void add_program(uint32_t key, const char *pass, bool is_conditional,
                        struct program_list *list)
{
    char defines[CASTER_DEFINES_BYTES];
    const struct program_desc program = caster_program(key, defines);
    program_list_add(list, pass, &program, is_conditional);
}

void caster_list_programs(const struct caster_view *view, const struct shadow_casters *casters,
                          const char *pass, bool is_conditional, struct program_list *list)
{
    uint32_t listed[64]; /* of many casters few have a key of their own */
    size_t listed_count = 0;
    for (size_t i = 0; i < casters->count; i++) {
        if (!caster_is_drawn(view, casters->items[i]))
            continue;
        uint32_t key = caster_key(view, &view->scene->state->items[casters->items[i]]);
        size_t at = 0;
        while (at < listed_count && listed[at] != key)
            at++;
        if (at < listed_count)
            continue;
        if (listed_count < sizeof listed / sizeof *listed)
            listed[listed_count++] = key;
        add_program(key, pass, is_conditional, list);
    }
    if (view->map->around_count && is_deep(view->pass))
        add_program(caster_around_key(view), pass, is_conditional, list);
}
