/* SPDX-License-Identifier: MIT */
/* Creation of the render targets. */
#include "renderer/window/targets.h"

#include <epoxy/gl.h>

static bool create_textures(struct targets *t, uint32_t lobes, struct error *err)
{
    int samples = t->samples > 1 ? t->samples : 0;
    struct gl_texture_desc desc = {.width = t->width, .height = t->height, .samples = samples};
    desc.label = "gbuffer.surface_0";
    desc.format = GL_RGBA32UI;
    if (!gl_texture_init(&t->surface_0, &desc, err))
        return false;
    desc.label = "gbuffer.surface_1";
    if (!gl_texture_init(&t->surface_1, &desc, err))
        return false;
    for (uint32_t i = 0; i < lobes; i++) {
        desc.label = i ? "gbuffer.more_lobes" : "gbuffer.lobes";
        if (!gl_texture_init(&t->lobes[i], &desc, err))
            return false;
    }
    desc.label = "gbuffer.signature";
    desc.format = GL_R32UI;
    if (samples && !gl_texture_init(&t->signature, &desc, err))
        return false;
    desc.label = "gbuffer.depth";
    desc.format = GL_DEPTH_COMPONENT32F;
    if (!gl_texture_init(&t->depth, &desc, err))
        return false;
    desc.label = "frame.image";
    desc.format = GL_RGBA32F;
    desc.samples = 0;
    return gl_texture_init(&t->image, &desc, err);
}

static bool are_as_asked(const struct targets *t, const struct targets_desc *desc)
{
    return t->gbuffer.name && t->width == desc->width && t->height == desc->height &&
           t->samples == desc->samples && (t->lobes[0].name != 0) == (desc->lobes > 0) &&
           (t->lobes[1].name != 0) == (desc->lobes > 1);
}

bool targets_prepare(struct targets *t, const struct targets_desc *desc, struct error *err)
{
    if (are_as_asked(t, desc))
        return true;
    targets_finish(t);
    t->width = desc->width;
    t->height = desc->height;
    t->samples = desc->samples;
    struct gl_framebuffer_desc gbuffer = {
        .label = "gbuffer", .colors = {&t->surface_0, &t->surface_1}, .depth = &t->depth};
    uint32_t used = 2;
    if (desc->samples > 1)
        gbuffer.colors[used++] = &t->signature;
    for (uint32_t i = 0; i < desc->lobes; i++)
        gbuffer.colors[used++] = &t->lobes[i];
    bool ok =
        create_textures(t, desc->lobes, err) && gl_framebuffer_init(&t->gbuffer, &gbuffer, err) &&
        gl_framebuffer_init(
            &t->depth_only,
            &(struct gl_framebuffer_desc){.label = "gbuffer.depth_only", .depth = &t->depth}, err);
    if (!ok)
        targets_finish(t);
    return ok;
}

bool targets_prepare_parts(struct targets *t, struct error *err)
{
    return t->parts.name || gl_texture_init(&t->parts,
                                            &(struct gl_texture_desc){.label = "frame.parts",
                                                                      .format = GL_RGBA32F,
                                                                      .width = t->width,
                                                                      .height = t->height,
                                                                      .layers = t->samples},
                                            err);
}

uint64_t targets_apart_list_bytes(const struct targets *t)
{
    uint64_t bytes = (uint64_t)t->width * (uint64_t)t->height * 4, unit = GL_BUFFER_ALIGNMENT;
    return TARGETS_APART_HEAD_BYTES + (bytes + unit - 1) / unit * unit;
}

/* What two lists take for pixels, without heads. */
static uint64_t apart_bytes(const struct targets *t)
{
    return t->apart.name ? 8 * (uint64_t)t->width * (uint64_t)t->height : 0;
}

bool targets_prepare_apart(struct targets *t, struct error *err)
{
    return (t->light.name || gl_texture_init(&t->light,
                                             &(struct gl_texture_desc){.label = "frame.light",
                                                                       .format = GL_R32UI,
                                                                       .width = t->width,
                                                                       .height = t->height,
                                                                       .layers = t->samples},
                                             err)) &&
           (t->apart.name ||
            gl_buffer_init(&t->apart,
                           &(struct gl_buffer_desc){.label = "frame.apart",
                                                    .size_bytes = 2 * targets_apart_list_bytes(t)},
                           err));
}

static bool prepare_plain(struct targets *t, bool is_asked, struct gl_texture *texture,
                          const char *label, struct error *err)
{
    if (!is_asked)
        gl_texture_finish(texture);
    return !is_asked || texture->name ||
           gl_texture_init(
               texture,
               &(struct gl_texture_desc){
                   .label = label, .format = GL_RGBA32F, .width = t->width, .height = t->height},
               err);
}

bool targets_prepare_sum(struct targets *t, bool has_sum, bool has_behind, struct error *err)
{
    return prepare_plain(t, has_sum, &t->sum, "frame.sum", err) &&
           prepare_plain(t, has_behind, &t->behind, "frame.behind", err) &&
           prepare_plain(t, has_behind, &t->behind_sum, "frame.behind_sum", err);
}

bool targets_prepare_opaque(struct targets *t, bool is_asked, struct error *err)
{
    return prepare_plain(t, is_asked, &t->opaque, "frame.opaque", err);
}

static bool reserve_haze(struct gl_buffer *buffer, const char *label, uint64_t bytes,
                         struct error *err)
{
    return gl_buffer_reserve(
        buffer, &(struct gl_buffer_desc){.label = label, .size_bytes = bytes, .is_dynamic = true},
        false, err);
}

bool targets_prepare_atmosphere(struct targets *t, uint64_t slices_bytes, uint64_t columns_bytes,
                                uint64_t sums_bytes, struct error *err)
{
    return reserve_haze(&t->atmosphere, "frame.atmosphere", slices_bytes, err) &&
           reserve_haze(&t->atmosphere_reach, "frame.atmosphere_reach", columns_bytes, err) &&
           reserve_haze(&t->atmosphere_sums, "frame.atmosphere_sums", sums_bytes, err) &&
           gl_texture_follow_buffer(&t->atmosphere_view, "frame.atmosphere_sums", GL_RGBA32F,
                                    &t->atmosphere_sums, err);
}

bool targets_prepare_glow(struct targets *t, uint64_t slices_bytes, uint64_t sums_bytes,
                          uint64_t ways_bytes, struct error *err)
{
    return reserve_haze(&t->glow_slices, "frame.glow_slices", slices_bytes, err) &&
           reserve_haze(&t->glow_sums, "frame.glow_sums", sums_bytes, err) &&
           gl_texture_follow_buffer(&t->glow_view, "frame.glow_sums", GL_RGBA32F, &t->glow_sums,
                                    err) &&
           reserve_haze(&t->glow_ways, "frame.glow_ways", ways_bytes, err);
}

bool targets_prepare_smoke(struct targets *t, uint64_t bytes, struct error *err)
{
    return reserve_haze(&t->smoke, "frame.smoke", bytes, err) &&
           gl_texture_follow_buffer(&t->smoke_view, "frame.smoke", GL_RGBA32F, &t->smoke, err);
}

static int count_levels(int width, int height)
{
    int levels = 1;
    while (width >> levels || height >> levels)
        levels++;
    return levels;
}

bool targets_prepare_refraction(struct targets *t, struct error *err)
{
    struct gl_texture_desc desc = {.label = "refraction.levels",
                                   .format = GL_RGBA32F,
                                   .width = t->width,
                                   .height = t->height,
                                   .levels = count_levels(t->width, t->height)};
    if (!t->levels.name) {
        if (!gl_texture_init(&t->levels, &desc, err))
            return false;
        glTextureParameteri(t->levels.name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glTextureParameteri(t->levels.name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        glTextureParameteri(t->levels.name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(t->levels.name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    desc.levels = 1;
    desc.layers = 2;
    desc.label = "refraction.parts";
    if (!t->bent_parts.name && !gl_texture_init(&t->bent_parts, &desc, err))
        return false;
    desc.layers = 0;
    desc.format = GL_R32UI;
    desc.label = "refraction.surfaces";
    return t->bent.name || gl_texture_init(&t->bent, &desc, err);
}

uint64_t targets_pixel_bytes(int samples, uint32_t lobes)
{
    uint64_t depth = 4, surfaces = 32 + 16 * lobes, signature = samples > 1 ? 4 : 0, image = 16;
    uint64_t apart = samples > 1 ? 16 + 8 : 0; /* light, and places in two lists */
    return (surfaces + signature + depth) * (uint64_t)samples + image + apart;
}

uint64_t targets_parts_pixel_bytes(int samples)
{
    return 16 * (uint64_t)samples;
}

uint64_t targets_sum_pixel_bytes(bool has_behind)
{
    return has_behind ? 3 * 16 : 16;
}

void targets_finish(struct targets *t)
{
    gl_framebuffer_finish(&t->gbuffer);
    gl_framebuffer_finish(&t->depth_only);
    gl_texture_finish(&t->surface_0);
    gl_texture_finish(&t->surface_1);
    for (int i = 0; i < 2; i++)
        gl_texture_finish(&t->lobes[i]);
    gl_texture_finish(&t->signature);
    gl_texture_finish(&t->depth);
    gl_texture_finish(&t->image);
    gl_texture_finish(&t->parts);
    gl_texture_finish(&t->light);
    gl_texture_finish(&t->sum);
    gl_texture_finish(&t->behind);
    gl_texture_finish(&t->behind_sum);
    gl_texture_finish(&t->opaque);
    gl_texture_finish(&t->levels);
    gl_texture_finish(&t->bent_parts);
    gl_texture_finish(&t->bent);
    gl_buffer_finish(&t->apart);
    gl_buffer_finish(&t->atmosphere);
    gl_buffer_finish(&t->atmosphere_reach);
    gl_texture_finish(&t->atmosphere_view);
    gl_buffer_finish(&t->atmosphere_sums);
    gl_buffer_finish(&t->glow_slices);
    gl_texture_finish(&t->glow_view);
    gl_buffer_finish(&t->glow_sums);
    gl_buffer_finish(&t->glow_ways);
    gl_texture_finish(&t->smoke_view);
    gl_buffer_finish(&t->smoke);
    *t = (struct targets){0};
}

uint64_t targets_size_bytes(const struct targets *t)
{
    return t->surface_0.size_bytes + t->surface_1.size_bytes + t->lobes[0].size_bytes +
           t->lobes[1].size_bytes + t->signature.size_bytes + t->depth.size_bytes +
           t->image.size_bytes + t->parts.size_bytes + t->light.size_bytes + apart_bytes(t) +
           t->sum.size_bytes + t->behind.size_bytes + t->behind_sum.size_bytes +
           t->opaque.size_bytes + t->levels.size_bytes + t->bent_parts.size_bytes +
           t->bent.size_bytes + t->atmosphere.size_bytes + t->atmosphere_reach.size_bytes +
           t->atmosphere_sums.size_bytes + t->glow_slices.size_bytes + t->glow_sums.size_bytes +
           t->glow_ways.size_bytes + t->smoke.size_bytes;
}
