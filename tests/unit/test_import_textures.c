/* SPDX-License-Identifier: MIT */
/* Textures whose image is in an extension: EXT_texture_webp and KHR_texture_basisu. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image.h"
#include "tests/support/import_support.h"

/* One pixel of a colour. */
static void *encode(enum image_format format, const uint8_t rgba[4], size_t *size_bytes)
{
    struct image image;
    struct error err = {0};
    void *bytes;
    assert_true(image_init(&image, 1, 1, 4, IMAGE_U8, &err));
    memcpy(image.pixels, rgba, 4);
    if (!image_encode(&image, &(struct image_encode_desc){.format = format, .quality = 100}, &bytes,
                      size_bytes, &err))
        fail_msg("%s", err.message);
    image_finish(&image);
    return bytes;
}

static const uint8_t red[4] = {255, 0, 0, 255}, blue[4] = {0, 0, 255, 255};

/* A scene with the textures, among the images 0 (a red PNG) and 1 (a blue WebP). */
static bool import(const char *textures, const char *required, struct imported_scene *s,
                   struct error *err)
{
    char json[1024];
    int length = snprintf(
        json, sizeof json,
        "{'asset':{'version':'2.0'},'extensionsUsed':['EXT_texture_webp','KHR_texture_basisu'],"
        "'extensionsRequired':[%s],'images':[{'uri':'red.png'},{'uri':'blue.webp'},"
        "{'uri':'gone.ktx2','mimeType':'image/ktx2'}],'textures':[%s],'materials':["
        "{'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}]}",
        required, textures);
    for (char *at = json; *at; at++)
        if (*at == '\'')
            *at = '"';
    size_t png_bytes, webp_bytes;
    void *png = encode(IMAGE_FORMAT_PNG, red, &png_bytes);
    void *webp = encode(IMAGE_FORMAT_WEBP, blue, &webp_bytes);
    const struct scene_file files[] = {{"scene.gltf", json, (size_t)length},
                                       {"red.png", png, png_bytes},
                                       {"blue.webp", webp, webp_bytes}};
    bool is_done = imported_scene_init(s, files, 3, err);
    free(png);
    free(webp);
    return is_done;
}

static void assert_shows(const char *textures, const char *required, const uint8_t *color)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import(textures, required, &s, &err))
        fail_msg("%s: %s", textures, err.message);
    assert_int_equal(s.scene.textures[0].image, color ? 0 : -1);
    if (color)
        assert_memory_equal(s.scene.pixels, color, 4);
    assert_true(scene_has_warning(&s.scene, "KHR_texture_basisu is not evaluated"));
    assert_false(scene_has_warning(&s.scene, "EXT_texture_webp"));
    imported_scene_finish(&s);
}

#define WEBP "'extensions':{'EXT_texture_webp':{'source':1}}"
#define KTX2 "'extensions':{'KHR_texture_basisu':{'source':2}}"

static void webp_goes_before_the_plain_image(void **state)
{
    (void)state;
    assert_shows("{" WEBP "}", "'EXT_texture_webp'", blue);
    assert_shows("{'source':0," WEBP "}", "", blue);
    assert_shows("{'source':0,'extensions':{'EXT_texture_webp':{}}}", "", red);
    assert_shows("{'source':0}", "'EXT_texture_webp'", red);
}

static void the_fallback_of_ktx2_is_used(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    assert_shows("{'source':0," KTX2 "}", "", red);
    assert_shows("{'source':0," KTX2 "}", "'KHR_texture_basisu'", red);
    assert_shows("{'source':0},{" KTX2 "}", "'KHR_texture_basisu'", red); /* not in use */
    assert_true(import("{" KTX2 "}", "", &s, &err));
    assert_true(scene_has_warning(&s.scene, "texture 0 is there only as KTX2"));
    imported_scene_finish(&s);
}

static void textures_that_cannot_be_had_are_refused_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *textures, *required;
        enum error_code code;
        const char *says;
    } refusals[] = {
        {"{" KTX2 "}", "'KHR_texture_basisu'", ERROR_UNSUPPORTED,
         "texture 0 is there only as KTX2 with Basis Universal (KHR_texture_basisu)"},
        {"{'extensions':{'EXT_texture_webp':{'source':9}}}", "", ERROR_INVALID_SCENE,
         "there is no image 9"},
    };
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        struct imported_scene s;
        struct error err = {0};
        assert_false(import(refusals[i].textures, refusals[i].required, &s, &err));
        if (err.code != refusals[i].code || !strstr(err.message, refusals[i].says))
            fail_msg("%zu: code %d, '%s'", i, (int)err.code, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(webp_goes_before_the_plain_image),
        cmocka_unit_test(the_fallback_of_ktx2_is_used),
        cmocka_unit_test(textures_that_cannot_be_had_are_refused_by_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
