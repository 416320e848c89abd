/* SPDX-License-Identifier: MIT */
/* scene_open: a blob that was tampered with is refused or harmless, never followed out of its
 * memory. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/import_support.h"

static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};

#define DOCUMENT                                                                                   \
    "{'asset':{'version':'2.0'},'extensionsUsed':['ACME_glow'],'buffers':[{'byteLength':48}],"     \
    "'bufferViews':[{'buffer':0,'byteLength':48}],'accessors':[{'bufferView':0,'componentType':"   \
    "5126,'count':4,'type':'VEC3'}],'scenes':[{'nodes':[0,1,2]}],'nodes':[{'name':'A','mesh':0},"  \
    "{'camera':0},{'extensions':{'KHR_lights_punctual':{'light':0}}}],'cameras':[{'type':"         \
    "'perspective','perspective':{'yfov':1,'znear':1}}],'extensions':{'KHR_lights_punctual':{"     \
    "'lights':[{'type':'spot','spot':{}}]}},'meshes':[{'primitives':[{'attributes':{'POSITION':0," \
    "'TANGENT':0},'mode':5,'material':0},{'attributes':{'POSITION':0},'mode':1}]}],'materials':[{" \
    "'name':'P','emissiveTexture':{'index':0}}],'textures':[{}]}"

static struct imported_scene make(void)
{
    struct imported_scene s;
    struct error err = {0};
    if (!imported_scene_make(&s, DOCUMENT, positions, sizeof positions, &err))
        fail_msg("%s", err.message);
    return s;
}

/* Reads all that a renderer would follow; returns something that depends on it. */
static double walk(const struct scene *s)
{
    double sum = s->header->bounds_min[0];
    for (uint32_t i = 0; i < s->node_count; i++) {
        const struct scene_node *n = &s->nodes[i];
        sum += n->world_matrix[0] + (double)strlen(s->strings + n->name);
        sum += n->parent >= 0 ? s->nodes[n->parent].world_matrix[0] : 0;
        sum += n->camera >= 0 ? s->cameras[n->camera].z_near : 0;
        sum += n->light >= 0 ? s->lights[n->light].intensity : 0;
        for (uint32_t k = 0; n->mesh >= 0 && k < s->meshes[n->mesh].primitive_count; k++) {
            const struct scene_primitive *p =
                &s->primitives[s->meshes[n->mesh].first_primitive + k];
            sum += s->materials[p->material].ior;
            for (uint32_t c = 0; c < p->index_count; c++) {
                uint64_t v = (uint64_t)p->first_vertex + s->indices[p->first_index + c];
                sum += s->positions[3 * v + 2] + s->normals[3 * v + 2];
                if (p->flags & SCENE_PRIMITIVE_HAS_COLORS)
                    sum += s->colors[4 * v + 3];
            }
        }
    }
    for (uint32_t i = 0; i < s->material_count; i++)
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
            int32_t texture = s->materials[i].textures[slot].texture;
            int32_t image = texture >= 0 ? s->textures[texture].image : -1;
            sum += image >= 0 ? s->pixels[s->images[image].offset_bytes] : 0;
        }
    for (uint32_t i = 0; i < s->warning_count; i++)
        sum += (double)strlen(s->strings + s->warnings[i]);
    return sum;
}

static void an_intact_blob_opens(void **state)
{
    (void)state;
    struct imported_scene s = make();
    assert_true(isfinite(walk(&s.scene)));
    assert_int_equal(s.scene.header->size_bytes, s.blob_bytes);
    imported_scene_finish(&s);
}

static void every_truncation_is_refused(void **state)
{
    (void)state;
    struct imported_scene s = make();
    for (size_t cut = 0; cut < s.blob_bytes; cut++) {
        char *part = malloc(cut + 1);
        memcpy(part, s.blob, cut);
        struct scene scene;
        struct error err = {0};
        assert_false(scene_open(&scene, part, cut, &err));
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        assert_null(scene.header);
        free(part);
    }
    imported_scene_finish(&s);
}

/* Puts each of a set of awkward values into every aligned word of the blob, in a copy whose end a
 * sanitizer guards. */
static void any_word_may_be_overwritten_without_harm(void **state)
{
    (void)state;
    static const uint32_t values[] = {0,          1,          2,          0x7F,       0xFFFF,
                                      0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000,
                                      0xFF800000, 0x3F800001, 0xBF800000, 0xFFFFFFF0};
    struct imported_scene s = make();
    size_t accepted = 0, refused = 0;
    for (size_t at = 0; at + 4 <= s.blob_bytes; at += 4)
        for (size_t v = 0; v < sizeof values / sizeof *values; v++) {
            char *copy = malloc(s.blob_bytes);
            memcpy(copy, s.blob, s.blob_bytes);
            memcpy(copy + at, &values[v], sizeof *values);
            struct scene scene;
            struct error err = {0};
            if (scene_open(&scene, copy, s.blob_bytes, &err)) {
                assert_false(isnan(walk(&scene)));
                accepted++;
            } else {
                assert_int_equal(err.code, ERROR_INVALID_SCENE);
                refused++;
            }
            free(copy);
        }
    assert_true(accepted > 1000 && refused > 1000);
    imported_scene_finish(&s);
}

static void flipped_bits_never_crash(void **state)
{
    (void)state;
    struct imported_scene s = make();
    char *copy = malloc(s.blob_bytes);
    memcpy(copy, s.blob, s.blob_bytes);
    for (size_t bit = 0; bit < s.blob_bytes * 8; bit++) {
        copy[bit / 8] ^= (char)(1 << bit % 8);
        struct scene scene;
        struct error err = {0};
        if (scene_open(&scene, copy, s.blob_bytes, &err))
            assert_false(isnan(walk(&scene)));
        copy[bit / 8] ^= (char)(1 << bit % 8);
    }
    free(copy);
    imported_scene_finish(&s);
}

/* What a renderer relies on, one lie at a time. */
static void lies_about_the_scene_are_refused(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct scene *scene = &s.scene, reopened;
    struct error err;
#define REFUSED(type, field, lie)                                         \
    do {                                                                  \
        type *target_ = (type *)(uintptr_t) & (field), saved_ = *target_; \
        *target_ = (type)(lie);                                           \
        memset(&err, 0, sizeof err);                                      \
        assert_false(scene_open(&reopened, s.blob, s.blob_bytes, &err));  \
        assert_int_equal(err.code, ERROR_INVALID_SCENE);                  \
        *target_ = saved_;                                                \
    } while (0)
    REFUSED(uint32_t, scene->header->version, SCENE_BLOB_VERSION + 1);
    REFUSED(uint64_t, scene->header->sections[SCENE_NODES].count, UINT64_MAX);
    REFUSED(uint64_t, scene->header->sections[SCENE_PIXELS].offset, UINT64_MAX - 15);
    REFUSED(uint64_t, scene->header->sections[SCENE_NORMALS].count, 1);
    REFUSED(uint64_t, scene->header->sections[SCENE_MATERIALS].count, 0);
    REFUSED(int32_t, scene->header->default_camera_node, 0);
    REFUSED(int32_t, scene->nodes[0].parent, 0); /* its own parent */
    REFUSED(int32_t, scene->nodes[1].parent, 2); /* a later one */
    REFUSED(int32_t, scene->nodes[0].mesh, 1);
    REFUSED(double, scene->nodes[0].world_matrix[5], NAN);
    REFUSED(uint32_t, scene->primitives[0].material, scene->material_count);
    REFUSED(uint32_t, scene->primitives[0].topology, 3);
    REFUSED(uint32_t, scene->primitives[0].index_count, 5);
    REFUSED(uint32_t, scene->primitives[0].flags, SCENE_PRIMITIVE_HAS_COLORS);
    REFUSED(uint32_t, scene->primitives[0].flags, SCENE_PRIMITIVE_HAS_NORMALS | 128);
    REFUSED(uint32_t, scene->primitives[1].flags, SCENE_PRIMITIVE_IS_SMOOTH); /* lines */
    REFUSED(uint32_t, scene->primitives[1].vertex_count, 3);
    REFUSED(uint32_t, scene->primitives[1].first_vertex, UINT32_MAX);
    REFUSED(uint32_t, scene->indices[0], scene->primitives[0].vertex_count);
    REFUSED(float, scene->positions[4], NAN);
    REFUSED(float, scene->normals[0], INFINITY);
    REFUSED(float, scene->materials[0].base_color[3], 1.5f);
    REFUSED(float, scene->materials[0].transmission, NAN);
    REFUSED(uint32_t, scene->materials[0].alpha_mode, 3);
    REFUSED(int32_t, scene->materials[0].textures[SCENE_TEXTURE_EMISSIVE].texture, 1);
    REFUSED(int32_t, scene->textures[0].image, 0);
    REFUSED(uint32_t, scene->textures[0].wrap_s, 0);
    REFUSED(uint32_t, scene->lights[0].type, 3);
    REFUSED(float, scene->lights[0].outer_cone_rad, 3);
    REFUSED(float, scene->cameras[0].y_fov_rad, 4);
    REFUSED(uint32_t, scene->warnings[0], UINT32_MAX);
    uint64_t last = scene->header->sections[SCENE_STRINGS].count - 1;
    REFUSED(char, scene->strings[last], 'x');
    assert_true(scene_open(&reopened, s.blob, s.blob_bytes, &err));
    imported_scene_finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_intact_blob_opens),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(any_word_may_be_overwritten_without_harm),
        cmocka_unit_test(flipped_bits_never_crash),
        cmocka_unit_test(lies_about_the_scene_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
