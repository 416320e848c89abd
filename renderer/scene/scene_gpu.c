/* SPDX-License-Identifier: MIT */
/* Upload of a scene: vertex streams, indices, textures and samplers. */
#include "renderer/scene/scene_gpu_internal.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static bool upload(struct gl_buffer *buffer, const char *label, const void *data, uint64_t bytes,
                   struct scene_gpu *gpu, struct error *err)
{
    if (!data || !bytes)
        return true;
    gpu->size_bytes += bytes;
    return gl_buffer_init(
        buffer, &(struct gl_buffer_desc){.label = label, .size_bytes = bytes, .data = data}, err);
}

/* Their buffer is bound by each submission. */
static void format_draw_records(GLuint vao)
{
    enum { WORDS = sizeof(struct draw_record) / 16 };
    for (GLuint i = 0; i < WORDS; i++) {
        GLuint attribute = ATTRIBUTE_DRAW + i;
        glEnableVertexArrayAttrib(vao, attribute);
        if (16 * i == offsetof(struct draw_record, material))
            glVertexArrayAttribIFormat(vao, attribute, 4, GL_UNSIGNED_INT, 16 * i);
        else
            glVertexArrayAttribFormat(vao, attribute, 4, GL_FLOAT, GL_FALSE, 16 * i);
        glVertexArrayAttribBinding(vao, attribute, ATTRIBUTE_DRAW);
    }
    glVertexArrayBindingDivisor(vao, ATTRIBUTE_DRAW, 1);
}

static bool upload_geometry(struct scene_gpu *gpu, struct error *err)
{
    const struct scene *s = gpu->scene;
    uint64_t n = s->vertex_count;
    const struct {
        const char *label;
        const float *data;
        uint32_t floats;
    } streams[] = {
        {"scene.positions", s->positions, 3},     {"scene.normals", s->normals, 3},
        {"scene.tangents", s->tangents, 4},       {"scene.texcoords_0", s->texcoords_0, 2},
        {"scene.texcoords_1", s->texcoords_1, 2}, {"scene.colors", s->colors, 4},
    };
    static const float absent[][4] = {{0}, {0, 0, 1}, {0}, {0}, {0}, {1, 1, 1, 1}};
    gl_vertex_array_init(&gpu->vertex_array, "scene");
    GLuint vao = gpu->vertex_array.name;
    for (GLuint i = 0; i < SCENE_GPU_STREAMS; i++) {
        if (!upload(&gpu->streams[i], streams[i].label, streams[i].data,
                    n * streams[i].floats * sizeof(float), gpu, err))
            return false;
        if (!gpu->streams[i].name) {
            glVertexAttrib4fv(i, absent[i]);
            continue;
        }
        glEnableVertexArrayAttrib(vao, i);
        glVertexArrayAttribFormat(vao, i, (GLint)streams[i].floats, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(vao, i, i);
        glVertexArrayVertexBuffer(vao, i, gpu->streams[i].name, 0,
                                  (GLsizei)(streams[i].floats * sizeof(float)));
    }
    if (!upload(&gpu->indices, "scene.indices", s->indices, (uint64_t)s->index_count * 4, gpu, err))
        return false;
    glVertexArrayElementBuffer(vao, gpu->indices.name);
    format_draw_records(vao);
    return true;
}

static bool filter_needs_levels(uint32_t filter)
{
    return filter != GL_NEAREST && filter != GL_LINEAR;
}

static int level_count(uint32_t width, uint32_t height)
{
    int levels = 1;
    while ((width | height) >> levels)
        levels++;
    return levels;
}

static uint8_t least_alpha(const struct scene *scene, const struct scene_image *image)
{
    const uint8_t *pixels = scene->pixels + image->offset_bytes;
    size_t count = (size_t)image->width_px * image->height_px;
    uint8_t least = 255;
    for (size_t i = 0; i < count && least > 0; i++)
        if (pixels[4 * i + 3] < least)
            least = pixels[4 * i + 3];
    return least;
}

float scene_gpu_least_alpha(const struct scene_gpu *gpu, int32_t texture)
{
    int32_t image = texture >= 0 ? gpu->scene->textures[texture].image : -1;
    return image >= 0 ? (float)gpu->least_alpha[image] / 255 : 1;
}

/* One GL texture per image and colour space in use; levels only where some sampler reads them. */
static bool upload_image(struct scene_gpu *gpu, uint32_t image, bool is_srgb, bool needs_levels,
                         struct error *err)
{
    const struct scene_image *source = &gpu->scene->images[image];
    struct gl_texture *texture = &gpu->images[2 * image + is_srgb];
    GLint max_size;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
    if (source->width_px > (uint32_t)max_size || source->height_px > (uint32_t)max_size)
        return error_set(err, ERROR_UNSUPPORTED, "image %u is %ux%u, the device takes %d", image,
                         source->width_px, source->height_px, max_size);
    bool ok = gl_texture_init(
        texture,
        &(struct gl_texture_desc){
            .label = "scene.image",
            .format = is_srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8,
            .width = (int)source->width_px,
            .height = (int)source->height_px,
            .levels = needs_levels ? level_count(source->width_px, source->height_px) : 1,
        },
        err);
    if (!ok)
        return false;
    glTextureSubImage2D(texture->name, 0, 0, 0, texture->width, texture->height, GL_RGBA,
                        GL_UNSIGNED_BYTE, gpu->scene->pixels + source->offset_bytes);
    if (needs_levels)
        glGenerateTextureMipmap(texture->name);
    gpu->size_bytes += texture->size_bytes;
    return true;
}

static bool slot_is_srgb(int slot)
{
    return slot == SCENE_TEXTURE_BASE_COLOR || slot == SCENE_TEXTURE_EMISSIVE;
}

enum { IMAGE_USED = 1, IMAGE_NEEDS_LEVELS = 2 };

static bool upload_images(struct scene_gpu *gpu, struct error *err)
{
    const struct scene *s = gpu->scene;
    gpu->images = calloc(2 * (size_t)s->image_count + 1, sizeof *gpu->images);
    gpu->least_alpha = calloc((size_t)s->image_count + 1, 1);
    unsigned char *uses = calloc(2 * (size_t)s->image_count + 1, 1);
    bool ok = gpu->images && gpu->least_alpha && uses;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%u images", s->image_count);
    for (uint32_t m = 0; ok && m < s->material_count; m++) {
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
            int32_t t = s->materials[m].textures[slot].texture;
            if (t < 0 || s->textures[t].image < 0)
                continue;
            unsigned char *use = &uses[2 * s->textures[t].image + slot_is_srgb(slot)];
            *use |= IMAGE_USED;
            if (filter_needs_levels(s->textures[t].min_filter))
                *use |= IMAGE_NEEDS_LEVELS;
        }
    }
    for (uint32_t i = 0; ok && i < 2 * s->image_count; i++)
        if (uses[i]) {
            ok = upload_image(gpu, i / 2, i & 1, uses[i] & IMAGE_NEEDS_LEVELS, err);
            if (i & 1)
                gpu->least_alpha[i / 2] = least_alpha(s, &s->images[i / 2]);
        }
    free(uses);
    return ok;
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

/* What is sampled where a texture's image is missing: white, the neutral element of every
 * factor. */
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

struct scene_gpu *scene_gpu_create(const struct scene *scene, struct error *err)
{
    struct scene_gpu *gpu = calloc(1, sizeof *gpu);
    if (!gpu) {
        error_set(err, ERROR_NO_MEMORY, "scene on the GPU");
        return NULL;
    }
    gpu->scene = scene;
    if (!upload_geometry(gpu, err) || !create_white(gpu, err) || !upload_images(gpu, err) ||
        !create_samplers(gpu, err) || !classify_textures(gpu, err)) {
        scene_gpu_destroy(gpu);
        return NULL;
    }
    return gpu;
}

void scene_gpu_destroy(struct scene_gpu *gpu)
{
    if (!gpu)
        return;
    for (int i = 0; i < SCENE_GPU_STREAMS; i++)
        gl_buffer_finish(&gpu->streams[i]);
    gl_buffer_finish(&gpu->indices);
    gl_vertex_array_finish(&gpu->vertex_array);
    for (uint32_t i = 0; gpu->images && i < 2 * gpu->scene->image_count; i++)
        gl_texture_finish(&gpu->images[i]);
    for (uint32_t i = 0; gpu->samplers && i < gpu->scene->texture_count; i++)
        gl_sampler_finish(&gpu->samplers[i]);
    gl_texture_finish(&gpu->white);
    free(gpu->images);
    free(gpu->least_alpha);
    free(gpu->samplers);
    free(gpu->texture_classes);
    free(gpu);
}

uint64_t scene_gpu_size_bytes(const struct scene_gpu *gpu)
{
    return gpu->size_bytes;
}

void scene_gpu_bind_texture(const struct scene_gpu *gpu, int slot, int32_t texture, uint32_t unit)
{
    const struct scene *s = gpu->scene;
    const struct gl_texture *image = &gpu->white;
    if (texture >= 0 && s->textures[texture].image >= 0)
        image = &gpu->images[2 * s->textures[texture].image + slot_is_srgb(slot)];
    glBindTextureUnit(unit, image->name);
    glBindSampler(unit, texture >= 0 ? gpu->samplers[texture].name : 0);
}
