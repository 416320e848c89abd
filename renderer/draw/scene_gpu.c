/* SPDX-License-Identifier: MIT */
/* A scene on the GPU: its geometry, textures and samplers. */
#include "renderer/draw/scene_gpu_internal.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/textures/texture_need.h"

float scene_gpu_least_alpha(const struct scene_gpu *gpu, int32_t texture)
{
    int32_t image = texture >= 0 ? gpu->scene->textures[texture].image : -1;
    return image >= 0 ? (float)gpu->scene->images[image].least_alpha / 255 : 1;
}

static bool create_samplers(struct scene_gpu *gpu, struct error *err)
{
    const struct scene *s = gpu->scene;
    gpu->samplers = calloc((size_t)s->texture_count + 1, sizeof *gpu->samplers);
    if (!gpu->samplers)
        return error_set(err, ERROR_NO_MEMORY, "%u samplers", s->texture_count);
    for (uint32_t i = 0; i < s->texture_count; i++) {
        const struct scene_texture *t = &s->textures[i];
        gl_sampler_init(&gpu->samplers[i], &(struct gl_sampler_desc){
                                               .label = "scene.sampler",
                                               .mag_filter = t->mag_filter,
                                               .min_filter = t->min_filter,
                                               .wrap_s = t->wrap_s,
                                               .wrap_t = t->wrap_t,
                                           });
    }
    return true;
}

/* Creates the texture that stands for missing images: white, the neutral element of factors. */
static bool create_white(struct scene_gpu *gpu, struct error *err)
{
    static const unsigned char white[4] = {255, 255, 255, 255};
    if (!gl_texture_init(&gpu->white,
                         &(struct gl_texture_desc){
                             .label = "scene.white", .format = GL_RGBA8, .width = 1, .height = 1},
                         err))
        return false;
    glTextureSubImage2D(gpu->white.name, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, white);
    return true;
}

struct textured { /* a material by its textures */
    const struct scene_material *material;
    uint32_t index;
};

static int compare_textures(const struct scene_material *a, const struct scene_material *b)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (a->textures[slot].texture != b->textures[slot].texture)
            return a->textures[slot].texture < b->textures[slot].texture ? -1 : 1;
    return 0;
}

static int compare_textured(const void *a, const void *b)
{
    const struct textured *x = a, *y = b;
    int order = compare_textures(x->material, y->material);
    return order ? order : (x->index > y->index) - (x->index < y->index);
}

/* No edit of a view changes a material's textures, so this holds for every frame. */
static bool classify_textures(struct scene_gpu *gpu, struct error *err)
{
    uint32_t count = gpu->scene->material_count;
    struct textured *sorted = calloc((size_t)count + 1, sizeof *sorted);
    gpu->texture_classes = calloc((size_t)count + 1, sizeof *gpu->texture_classes);
    if (!sorted || !gpu->texture_classes) {
        free(sorted);
        return error_set(err, ERROR_NO_MEMORY, "%u materials", count);
    }
    for (uint32_t i = 0; i < count; i++)
        sorted[i] = (struct textured){&gpu->scene->materials[i], i};
    qsort(sorted, count, sizeof *sorted, compare_textured);
    for (uint32_t i = 0; i < count; i++) {
        bool is_new = !i || compare_textures(sorted[i - 1].material, sorted[i].material) != 0;
        gpu->texture_classes[sorted[i].index] =
            is_new ? sorted[i].index : gpu->texture_classes[sorted[i - 1].index];
    }
    free(sorted);
    return true;
}

struct scene_gpu *scene_gpu_create(const struct scene *scene, struct texture_pool *textures,
                                   struct error *err)
{
    struct scene_gpu *gpu = calloc(1, sizeof *gpu);
    if (!gpu) {
        error_set(err, ERROR_NO_MEMORY, "scene on the GPU");
        return NULL;
    }
    gpu->scene = scene;
    if (!scene_geometry_init(&gpu->geometry, scene, err) || !create_white(gpu, err) ||
        !(gpu->textures = texture_store_create(textures, scene, err)) ||
        !(gpu->density = texture_density_create(scene, err)) || !create_samplers(gpu, err) ||
        !classify_textures(gpu, err)) {
        scene_gpu_destroy(gpu);
        return NULL;
    }
    return gpu;
}

struct scene_gpu *scene_gpu_compose(const struct scene *scene,
                                    const struct scene_gpu *const *sources, struct error *err)
{
    struct scene_gpu *gpu = calloc(1, sizeof *gpu);
    if (!gpu) {
        error_set(err, ERROR_NO_MEMORY, "scene with parts on the GPU");
        return NULL;
    }
    gpu->scene = scene;
    gpu->part_count = scene->part_count;
    gpu->parts = calloc(scene->part_count + 1, sizeof *gpu->parts);
    gpu->samplers = calloc((size_t)scene->texture_count + 1, sizeof *gpu->samplers);
    gpu->density = texture_density_compose(scene, err);
    if (!gpu->parts || !gpu->samplers || !gpu->density || !classify_textures(gpu, err)) {
        error_set(err, ERROR_NO_MEMORY, "scene with parts on the GPU");
        scene_gpu_destroy(gpu);
        return NULL;
    }
    gpu->white = sources[0]->white;
    for (uint32_t i = 0; i < scene->part_count; i++) {
        const struct scene_part *part = &scene->parts[i];
        gpu->parts[i] = sources[i];
        texture_density_set_part(gpu->density, i, sources[i]->density);
        for (uint32_t k = 0; k < part->scene->texture_count; k++)
            gpu->samplers[part->first_texture + k] = sources[i]->samplers[k];
    }
    return gpu;
}

static void composed_destroy(struct scene_gpu *gpu)
{
    free(gpu->parts);
    free(gpu->samplers);
    free(gpu->texture_classes);
    texture_density_destroy(gpu->density);
    free(gpu);
}

void scene_gpu_destroy(struct scene_gpu *gpu)
{
    if (!gpu)
        return;
    if (gpu->part_count) { /* what it borrows stays */
        composed_destroy(gpu);
        return;
    }
    scene_geometry_finish(&gpu->geometry);
    texture_store_destroy(gpu->textures);
    texture_density_destroy(gpu->density);
    for (uint32_t i = 0; gpu->samplers && i < gpu->scene->texture_count; i++)
        gl_sampler_finish(&gpu->samplers[i]);
    gl_texture_finish(&gpu->white);
    free(gpu->samplers);
    free(gpu->texture_classes);
    free(gpu);
}

uint32_t scene_gpu_part_count(const struct scene_gpu *gpu)
{
    return gpu->part_count ? gpu->part_count : 1;
}

uint32_t scene_gpu_first_like(const struct scene_gpu *gpu, uint32_t part)
{
    uint32_t first = 0;
    while (first < part && gpu->parts[first] != gpu->parts[part])
        first++;
    return first;
}

uint64_t scene_gpu_size_bytes(const struct scene_gpu *gpu)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < scene_gpu_part_count(gpu); i++) {
        const struct scene_gpu *part = scene_gpu_of_part(gpu, i);
        if (scene_gpu_first_like(gpu, i) == i)
            bytes += part->geometry.size_bytes +
                     (part->textures ? texture_store_resident_bytes(part->textures) : 0);
    }
    return bytes;
}

struct texture_store *scene_gpu_textures(const struct scene_gpu *gpu, uint32_t part)
{
    return scene_gpu_of_part(gpu, part)->textures;
}

struct texture_density *scene_gpu_texture_density(const struct scene_gpu *gpu)
{
    return gpu->density;
}

void scene_gpu_set_texture_passes(struct scene_gpu *gpu, const struct texture_passes *passes)
{
    gpu->passes = passes;
}

static uint8_t finest_level(const struct scene_gpu *gpu, size_t pass, uint32_t key)
{
    const struct texture_passes *passes = gpu->passes;
    return passes && pass < passes->count && passes->levels[pass] ? passes->levels[pass][key]
                                                                  : TEXTURE_UNNEEDED;
}

bool scene_gpu_samples_alike(const struct scene_gpu *gpu, const struct scene_material *material,
                             size_t pass, size_t other)
{
    for (int slot = 0; pass != other && slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        int32_t texture = material->textures[slot].texture;
        int32_t image = texture >= 0 ? gpu->scene->textures[texture].image : -1;
        uint32_t key = image >= 0 ? texture_key((uint32_t)image, scene_slot_is_srgb(slot)) : 0;
        if (image >= 0 && finest_level(gpu, pass, key) != finest_level(gpu, other, key))
            return false;
    }
    return true;
}

void scene_gpu_bind_texture(const struct scene_gpu *gpu, const struct texture_binding *binding)
{
    int32_t texture = binding->texture;
    int32_t image = texture >= 0 ? gpu->scene->textures[texture].image : -1;
    const struct gl_texture *found = NULL;
    if (image >= 0) {
        const struct scene *scene = gpu->scene;
        uint32_t part = scene->images[image].part;
        uint32_t first = scene->part_count ? scene->parts[part].first_image : 0;
        bool is_srgb = scene_slot_is_srgb(binding->slot);
        uint8_t finest = finest_level(gpu, binding->pass, texture_key((uint32_t)image, is_srgb));
        found = texture_store_use(scene_gpu_textures(gpu, part),
                                  texture_key((uint32_t)image - first, is_srgb), finest);
    }
    glBindTextureUnit(binding->unit, found ? found->name : gpu->white.name);
    glBindSampler(binding->unit, texture >= 0 ? gpu->samplers[texture].name : 0);
}
