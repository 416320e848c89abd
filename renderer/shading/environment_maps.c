/* SPDX-License-Identifier: MIT */
/* Textures of an environment. */
#include "renderer/shading/environment_maps.h"

#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"

/* Columns go on behind the last one, rows do not. */
static bool make(struct gl_texture *texture, const char *label, struct environment_map map,
                 int levels, struct error *err)
{
    const struct gl_texture_desc desc = {.label = label,
                                         .format = GL_RGB32F,
                                         .width = map.width,
                                         .height = map.height,
                                         .levels = levels};
    if (!gl_texture_init(texture, &desc, err))
        return false;
    glTextureParameteri(texture->name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(texture->name, GL_TEXTURE_MIN_FILTER,
                        levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
    glTextureParameteri(texture->name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(texture->name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return true;
}

static void fill(const struct gl_texture *texture, int level, struct environment_map map)
{
    glTextureSubImage2D(texture->name, level, 0, 0, map.width, map.height, GL_RGB, GL_FLOAT,
                        map.pixels);
}

static uint64_t bytes_of(struct environment_map map)
{
    return 3 * sizeof *map.pixels * (uint64_t)map.width * (uint64_t)map.height;
}

uint64_t environment_maps_missing_bytes(const struct environment_maps *maps,
                                        const struct environment_light *light)
{
    const struct environment *environment = light->environment;
    uint64_t bytes = 0;
    if (!maps->diffuse.name)
        bytes += bytes_of(environment_diffuse_map(environment)) +
                 bytes_of(environment_specular_map(environment, 0)) * 4 / 3;
    if (light->is_background && !maps->radiance.name)
        bytes += bytes_of(environment_radiance_map(environment));
    return bytes;
}

static bool prepare_lobes(struct environment_maps *maps, const struct environment *environment,
                          struct error *err)
{
    if (!make(&maps->diffuse, "environment.diffuse", environment_diffuse_map(environment), 1,
              err) ||
        !make(&maps->specular, "environment.specular", environment_specular_map(environment, 0),
              ENVIRONMENT_LEVELS, err))
        return false;
    fill(&maps->diffuse, 0, environment_diffuse_map(environment));
    for (int level = 0; level < ENVIRONMENT_LEVELS; level++)
        fill(&maps->specular, level, environment_specular_map(environment, level));
    return true;
}

bool environment_maps_prepare(struct environment_maps *maps, const struct environment_light *light,
                              struct error *err)
{
    if (!maps->specular.name && !prepare_lobes(maps, light->environment, err)) {
        environment_maps_finish(maps);
        return false;
    }
    if (!light->is_background || maps->radiance.name)
        return true;
    const struct environment_map seen = environment_radiance_map(light->environment);
    if (!make(&maps->radiance, "environment.radiance", seen, 1, err))
        return false;
    fill(&maps->radiance, 0, seen);
    return true;
}

uint64_t environment_maps_size_bytes(const struct environment_maps *maps)
{
    return maps->diffuse.size_bytes + maps->specular.size_bytes + maps->radiance.size_bytes;
}

void environment_maps_finish(struct environment_maps *maps)
{
    gl_texture_finish(&maps->diffuse);
    gl_texture_finish(&maps->specular);
    gl_texture_finish(&maps->radiance);
}

void environment_maps_bind(const struct environment_maps *maps,
                           const struct environment_light *light, const struct gl_program *program)
{
    gl_texture_bind(&maps->diffuse, UNIT_ENVIRONMENT_DIFFUSE);
    gl_texture_bind(&maps->specular, UNIT_ENVIRONMENT_SPECULAR);
    if (light->is_background)
        gl_texture_bind(&maps->radiance, UNIT_ENVIRONMENT_RADIANCE);
    gl_program_set_f3(
        program, "u_environment",
        (const float[3]){(float)light->cosine, (float)light->sine, (float)light->intensity});
}
