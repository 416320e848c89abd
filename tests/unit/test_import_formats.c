/* SPDX-License-Identifier: MIT */
/* scene_import of formats other than glTF, on files written out here: places in metres, colours,
 * what becomes glass, what is warned of, and which files are refused in which words. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image.h"
#include "tests/support/import_support.h"

/* A closed body that faces outward: a tetrahedron 1 wide, 2 high, 3 deep. */
#define TETRAHEDRON                        \
    "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n" \
    "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

static struct scene_origin told;

static bool take_origin(void *context, const struct scene_origin *origin, struct error *err)
{
    (void)context, (void)err;
    told = *origin;
    return true;
}

static bool import_as(struct imported_scene *s, const struct scene_import_desc *desc,
                      struct error *err)
{
    struct scene_import_desc whole = *desc;
    *s = (struct imported_scene){0};
    whole.tell_origin = take_origin;
    return scene_import(&whole, &s->blob, &s->blob_bytes, err) &&
           scene_open(&s->scene, s->blob, s->blob_bytes, err);
}

static struct imported_scene make(const struct scene_import_desc *desc)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import_as(&s, desc, &err))
        fail_msg("%s", err.message);
    return s;
}

static struct imported_scene make_text(enum scene_format format, const char *text)
{
    const struct scene_file file = {"", text, strlen(text)};
    return make(&(struct scene_import_desc){.files = &file, .file_count = 1, .format = format});
}

/* An OBJ whose triangle has the material of the MTL, "m". */
static struct imported_scene make_material(const char *mtl)
{
    const char *obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    char text[400];
    snprintf(text, sizeof text, "newmtl m\n%s", mtl);
    const struct scene_file files[] = {{"a.obj", obj, strlen(obj)}, {"m.mtl", text, strlen(text)}};
    return make(
        &(struct scene_import_desc){.files = files, .file_count = 2, .format = SCENE_FORMAT_OBJ});
}

static void expect_near(const float *values, int count, const double *wanted)
{
    for (int i = 0; i < count; i++)
        if (!(fabs((double)values[i] - wanted[i]) <= 1e-6))
            fail_msg("number %d is %.9g, not %.9g", i, (double)values[i], wanted[i]);
}
#define EXPECT_NEAR(values, ...)                                                 \
    expect_near(values, (int)(sizeof((double[]){__VA_ARGS__}) / sizeof(double)), \
                (double[]){__VA_ARGS__})

static void expect_bounds(const struct imported_scene *s, const double *low, const double *high)
{
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(s->scene.header->bounds_min[i] - low[i]) <= 1e-7);
        assert_true(fabs(s->scene.header->bounds_max[i] - high[i]) <= 1e-7);
    }
}

/* Little-endian, as the machines this runs on. facets: of 3 corners each. */
static size_t write_stl(unsigned char *out, const float (*corners)[3], uint32_t facets)
{
    memset(out, 0, 84 + 50 * (size_t)facets);
    memcpy(out + 80, &facets, sizeof facets);
    for (uint32_t i = 0; i < facets; i++)
        memcpy(out + 84 + 50 * i + 12, corners + 3 * i, 36);
    return 84 + 50 * (size_t)facets;
}

static void coordinates_become_metres_with_y_up(void **state)
{
    (void)state;
    const struct scene_file file = {"t.obj", TETRAHEDRON, strlen(TETRAHEDRON)};
    struct scene_import_desc desc = {.files = &file, .file_count = 1, .format = SCENE_FORMAT_OBJ};
    struct imported_scene s = make(&desc);
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){1, 2, 3});
    assert_true(scene_has_warning(&s.scene, "does not tell the unit"));
    assert_int_equal(told.unit_by, SCENE_WORD_DEFAULT);
    assert_true(told.unit_m == 1 && told.up == 'y');
    imported_scene_finish(&s);
    desc.unit_m = 0.0254;
    desc.up = 'z'; /* what was +Y lies along -Z, what was +Z is up */
    s = make(&desc);
    expect_bounds(&s, (double[]){0, 0, -2 * 0.0254}, (double[]){0.0254, 3 * 0.0254, 0});
    assert_false(scene_has_warning(&s.scene, "does not tell the unit"));
    assert_int_equal(told.format, SCENE_FORMAT_OBJ);
    assert_int_equal(told.unit_by, SCENE_WORD_REQUEST);
    assert_int_equal(told.up_by, SCENE_WORD_REQUEST);
    assert_true(told.unit_m == 0.0254 && told.up == 'z');
    imported_scene_finish(&s);
}

static void stl_facets_are_read_in_both_forms(void **state)
{
    (void)state;
    const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
    unsigned char binary[200];
    const struct scene_file file = {"", binary, write_stl(binary, corners, 1)};
    struct imported_scene s = make(&(struct scene_import_desc){
        .files = &file, .file_count = 1, .format = SCENE_FORMAT_STL, .unit_m = 0.001});
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){0.001, 0.002, 0});
    assert_int_equal(s.scene.header->triangle_count, 1);
    EXPECT_NEAR(s.scene.materials[0].base_color, 0.8, 0.8, 0.8, 1);
    assert_true(s.scene.materials[0].roughness == 0.5f);
    imported_scene_finish(&s);
    s = make_text(SCENE_FORMAT_STL, "solid a\nfacet normal 9 9 9\nouter loop\nvertex 0 0 0\n"
                                    "vertex 1 0 0\nvertex 0 2 0\nendloop\nendfacet\nendsolid a\n");
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){1, 2, 0});
    for (int i = 0; i < 3; i++) /* that of the file is none */
        EXPECT_NEAR(s.scene.normals + 3 * i, 0, 0, 1);
    imported_scene_finish(&s);
}

/* Two triangles that share the edge from (0,0,0) to (0,1,0), the right one raised by so much. */
static struct imported_scene make_roof(float height)
{
    const float corners[6][3] = {{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    float moved[6][3];
    unsigned char binary[200];
    memcpy(moved, corners, sizeof moved);
    moved[4][2] = height;
    const struct scene_file file = {"", binary, write_stl(binary, (const float(*)[3])moved, 2)};
    return make(&(struct scene_import_desc){
        .files = &file, .file_count = 1, .format = SCENE_FORMAT_STL, .unit_m = 1});
}

static void edges_are_smooth_below_thirty_degrees(void **state)
{
    (void)state;
    struct imported_scene s = make_roof(tanf(25 * 3.14159265f / 180));
    assert_int_equal(s.scene.primitives[0].vertex_count, 4); /* the edge has one normal */
    imported_scene_finish(&s);
    s = make_roof(tanf(35 * 3.14159265f / 180));
    assert_int_equal(s.scene.primitives[0].vertex_count, 6);
    imported_scene_finish(&s);
}

#define PLY                                                                          \
    "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\n"  \
    "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n" \
    "property uchar blue\nproperty uchar alpha\nelement face 1\n"                    \
    "property list uchar int vertex_indices\nend_header\n"

static void ply_colours_become_linear(void **state)
{
    (void)state;
    struct imported_scene s =
        make_text(SCENE_FORMAT_PLY, PLY "0 0 0 255 128 0 255\n1 0 0 255 128 0 255\n"
                                        "1 2 0 255 128 0 255\n0 2 0 255 128 0 255\n4 0 1 2 3\n");
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){1, 2, 0});
    assert_int_equal(s.scene.header->triangle_count, 2);
    /* IEC 61966-2-1: ((128/255 + 0.055) / 1.055)^2.4 */
    EXPECT_NEAR(s.scene.colors, 1, 0.2158605, 0, 1);
    EXPECT_NEAR(s.scene.materials[0].base_color, 1, 1, 1, 1);
    assert_int_equal(s.scene.materials[0].alpha_mode, SCENE_OPAQUE);
    imported_scene_finish(&s);
    s = make_text(SCENE_FORMAT_PLY, PLY "0 0 0 255 128 0 51\n1 0 0 255 128 0 255\n"
                                        "1 2 0 255 128 0 255\n0 2 0 255 128 0 255\n4 0 1 2 3\n");
    assert_int_equal(s.scene.materials[0].alpha_mode, SCENE_BLEND);
    EXPECT_NEAR(s.scene.colors, 1, 0.2158605, 0, 0.2);
    imported_scene_finish(&s);
}

static void glass_takes_its_colour_from_the_filter(void **state)
{
    (void)state;
    struct imported_scene s =
        make_material("Kd 0.9 0.1 0.1\nKs 1 1 1\nTf 0.2 0.5 0.3\nillum 6\nNi 1.3\nNs 98\n");
    const struct scene_material *m = &s.scene.materials[0];
    EXPECT_NEAR(m->base_color, 0.2, 0.5, 0.3, 1);
    assert_true(m->transmission == 1 && m->metallic == 0);
    assert_true(fabsf(m->ior - 1.3f) < 1e-6f);
    assert_true(fabs((double)m->roughness - pow(0.02, 0.25)) < 1e-6);
    assert_int_equal(m->alpha_mode, SCENE_OPAQUE);
    imported_scene_finish(&s);
    s = make_material("Kd 0.9 0.1 0.1\nillum 4\nd 0.25\n");
    m = &s.scene.materials[0];
    EXPECT_NEAR(m->base_color, 0.9, 0.1, 0.1, 1);
    assert_true(m->transmission == 0.75f && m->roughness == 0 && m->ior == 1.5f);
    imported_scene_finish(&s);
    s = make_material("Kd 0 0 0\nillum 7\n");
    EXPECT_NEAR(s.scene.materials[0].base_color, 1, 1, 1, 1);
    imported_scene_finish(&s);
    s = make_material("Kd 0.9 0.1 0.1\nillum 2\nTr 0.25\nTf 0.5 0.6 0.7\n");
    EXPECT_NEAR(s.scene.materials[0].base_color, 0.5, 0.6, 0.7, 1);
    assert_true(s.scene.materials[0].transmission == 0.25f);
    imported_scene_finish(&s);
}

static void what_dissolves_without_a_filter_is_blended(void **state)
{
    (void)state;
    struct imported_scene s = make_material("Kd 0.9 0.1 0.1\nd 0.25\nillum 2\n");
    EXPECT_NEAR(s.scene.materials[0].base_color, 0.9, 0.1, 0.1, 0.25);
    assert_int_equal(s.scene.materials[0].alpha_mode, SCENE_BLEND);
    assert_true(s.scene.materials[0].transmission == 0);
    imported_scene_finish(&s);
    s = make_material("Kd 0.9 0.1 0.1\nTf 1 1 1\nillum 2\nKe 2 4 0\n");
    const struct scene_material *m = &s.scene.materials[0];
    assert_int_equal(m->alpha_mode, SCENE_OPAQUE);
    assert_true(m->transmission == 0 && m->roughness == 1);
    EXPECT_NEAR(m->emissive, 2, 4, 0);
    imported_scene_finish(&s);
}

static void factors_out_of_range_are_clamped_with_a_warning(void **state)
{
    (void)state;
    struct imported_scene s = make_material("Kd 1.5 0.1 -1\nPr 0.3\nPm 0.7\n");
    const struct scene_material *m = &s.scene.materials[0];
    EXPECT_NEAR(m->base_color, 1, 0.1, 0, 1);
    EXPECT_NEAR(&m->metallic, 0.7, 0.3);
    assert_true(scene_has_warning(&s.scene, "material 'm': Kd is clamped from 1.5 to 1"));
    assert_true(scene_has_warning(&s.scene, "material 'm': Kd is clamped from -1 to 0"));
    imported_scene_finish(&s);
}

static void closed_glass_is_seen_from_outside_alone(void **state)
{
    (void)state;
    const char *mtl = "newmtl m\nillum 6\nTf 0.5 0.5 0.5\n";
    const char *closed = "mtllib m.mtl\nusemtl m\n" TETRAHEDRON;
    struct scene_file files[] = {{"a.obj", closed, strlen(closed)}, {"m.mtl", mtl, strlen(mtl)}};
    const struct scene_import_desc desc = {
        .files = files, .file_count = 2, .format = SCENE_FORMAT_OBJ};
    struct imported_scene s = make(&desc);
    assert_false(s.scene.materials[0].flags & SCENE_MATERIAL_DOUBLE_SIDED);
    imported_scene_finish(&s);
    files[0].size_bytes -= strlen("f 2 3 4\n"); /* open */
    s = make(&desc);
    assert_true(s.scene.materials[0].flags & SCENE_MATERIAL_DOUBLE_SIDED);
    imported_scene_finish(&s);
    const char *inside = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n"
                         "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
    files[0] = (struct scene_file){"a.obj", inside, strlen(inside)};
    s = make(&desc);
    assert_true(s.scene.materials[0].flags & SCENE_MATERIAL_DOUBLE_SIDED);
    imported_scene_finish(&s);
}

static void what_is_not_in_the_upload_is_reported(void **state)
{
    (void)state;
    struct imported_scene s = make_text(
        SCENE_FORMAT_OBJ, "mtllib lost.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_true(scene_has_warning(&s.scene, "'lost.mtl' is not among the uploaded files"));
    imported_scene_finish(&s);
    s = make_material("map_Kd lost.png\nmap_d holes.png\n");
    assert_true(
        scene_has_warning(&s.scene, "'lost.png' is left out: it is not among the uploaded"));
    assert_true(scene_has_warning(&s.scene, "material 'm': its opacity texture is left out"));
    assert_int_equal(s.scene.image_count, 0);
    imported_scene_finish(&s);
}

static void textures_of_the_upload_are_found(void **state)
{
    (void)state;
    struct image image = {0};
    void *png = NULL;
    size_t png_bytes = 0;
    assert_true(image_init(&image, 3, 2, 4, IMAGE_U8, NULL));
    assert_true(image_encode(&image, &(struct image_encode_desc){.format = IMAGE_FORMAT_PNG}, &png,
                             &png_bytes, NULL));
    image_finish(&image);
    const char *obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                      "vt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n";
    const char *mtl = "newmtl m\nmap_Kd maps\\a b.png\nmap_Ke note.txt\nKe 1 1 1\n";
    const struct scene_file files[] = {{"house/a.obj", obj, strlen(obj)},
                                       {"house/m.mtl", mtl, strlen(mtl)},
                                       {"house/maps/a b.png", png, png_bytes},
                                       {"house/note.txt", "text", 4}};
    struct imported_scene s = make(
        &(struct scene_import_desc){.files = files, .file_count = 4, .format = SCENE_FORMAT_OBJ});
    assert_int_equal(s.scene.image_count, 1);
    assert_int_equal(s.scene.images[0].width_px, 3);
    assert_int_equal(s.scene.materials[0].textures[SCENE_TEXTURE_BASE_COLOR].texture, 0);
    assert_int_equal(s.scene.materials[0].textures[SCENE_TEXTURE_EMISSIVE].texture, -1);
    assert_true(
        scene_has_warning(&s.scene, "'note.txt' is left out: it is none of PNG, JPEG, WebP,"));
    EXPECT_NEAR(s.scene.texcoords_0 + 4, 0, 0.25); /* v begins on top in glTF */
    imported_scene_finish(&s);
    free(png);
}

/* Two pixels each, red and green from the left; the first of an image is the lowest row's. */
static void textures_of_older_formats_are_read(void **state)
{
    (void)state;
    static const uint8_t tga[] = {0, 0, 2, 0, 0,  0, 0, 0, 0,   0, 0,   0,
                                  2, 0, 1, 0, 24, 0, 0, 0, 255, 0, 255, 0};
    static const uint8_t bmp[] = {'B', 'M', 62, 0, 0, 0, 0, 0, 0,   0, 54,  0, 0,  0, 40, 0,
                                  0,   0,   2,  0, 0, 0, 1, 0, 0,   0, 1,   0, 24, 0, 0,  0,
                                  0,   0,   8,  0, 0, 0, 0, 0, 0,   0, 0,   0, 0,  0, 0,  0,
                                  0,   0,   0,  0, 0, 0, 0, 0, 255, 0, 255, 0, 0,  0};
    const uint8_t row[] = {255, 0, 0, 255, 0, 255, 0, 255};
    struct image image = {0};
    void *webp = NULL;
    size_t webp_bytes = 0;
    assert_true(image_init(&image, 2, 1, 4, IMAGE_U8, NULL));
    memcpy(image.pixels, row, sizeof row);
    assert_true(image_encode(
        &image, &(struct image_encode_desc){.format = IMAGE_FORMAT_WEBP, .quality = 100}, &webp,
        &webp_bytes, NULL));
    image_finish(&image);
    const char *obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                      "vt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n";
    const char *mtl = "newmtl m\nmap_Kd a.TGA\nmap_Ke b.bmp\nnorm c.webp\nKe 1 1 1\n";
    struct scene_file files[] = {{"a.obj", obj, strlen(obj)},
                                 {"m.mtl", mtl, strlen(mtl)},
                                 {"a.TGA", tga, sizeof tga},
                                 {"b.bmp", bmp, sizeof bmp},
                                 {"c.webp", webp, webp_bytes}};
    const struct scene_import_desc desc = {
        .files = files, .file_count = 5, .format = SCENE_FORMAT_OBJ};
    struct imported_scene s = make(&desc);
    assert_int_equal(s.scene.image_count, 3);
    assert_int_equal(s.scene.warning_count, 1); /* of the unit alone */
    for (int i = 0; i < 3; i++)
        assert_memory_equal(scene_image_pixels(&s.scene, &s.scene.images[i]), row, sizeof row);
    imported_scene_finish(&s);
    files[2].size_bytes--;
    struct error err = {0};
    assert_false(import_as(&s, &desc, &err));
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    assert_non_null(strstr(err.message, "image 0 'a.TGA'"));
    free(webp);
}

static void broken_files_are_refused_by_name(void **state)
{
    (void)state;
#define OBJ_VERTICES "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define PLY_VERTICES "0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n1 2 0 1 1 1 1\n0 2 0 1 1 1 1\n"
    static const struct {
        enum scene_format format;
        const char *text, *message;
    } cases[] = {
        {SCENE_FORMAT_OBJ, "", "the file is empty"},
        {SCENE_FORMAT_OBJ, "this is no scene, whatever else it is\n", "Wavefront OBJ: "},
        {SCENE_FORMAT_OBJ, OBJ_VERTICES, "Wavefront OBJ: "},
        {SCENE_FORMAT_OBJ, OBJ_VERTICES "f 1 2 7\n", "index out of range"},
        {SCENE_FORMAT_OBJ, OBJ_VERTICES "v nan 0 0\nf 1 2 4\n", "is (nan, 0, 0)"},
        {SCENE_FORMAT_OBJ, OBJ_VERTICES "v 0 1e39 0\nf 1 2 4\n", "is (0, inf, 0)"},
        {SCENE_FORMAT_OBJ, OBJ_VERTICES "v 0 1e38 0\nf 1 2 4\n", "Wavefront OBJ: "},
        {SCENE_FORMAT_PLY, "pl", "does not begin with 'ply'"},
        {SCENE_FORMAT_PLY, "ply\nformat ascii 1.0\n", "ends within its header"},
        {SCENE_FORMAT_PLY, "ply\nformat ascii 1.0\nelement vertex -4\n", "'-4' elements"},
        {SCENE_FORMAT_PLY, "ply\nformat ascii 1.0\nelement vertex 4\nproperty half x\n",
         "the unknown type 'half'"},
        {SCENE_FORMAT_PLY, PLY PLY_VERTICES, "ends at face 0; its header tells 1"},
        {SCENE_FORMAT_PLY, PLY PLY_VERTICES "4 0 1 2", "face 0 has fewer values"},
        {SCENE_FORMAT_PLY, PLY PLY_VERTICES "4 0 1 2 3\n3 0 1 2\n", "8 bytes follow"},
        {SCENE_FORMAT_PLY, PLY PLY_VERTICES "4 0 1 2 9\n", "out of range"},
        {SCENE_FORMAT_STL, "solid a\nendsolid a\n", "STL: "},
        {SCENE_FORMAT_STL,
         "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
         "vertex 0 1 0\nendloop\nendfacet\n",
         "'endsolid' keyword was expected"},
        {SCENE_FORMAT_STL, "lamp", "4 bytes are neither a text"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct scene_file file = {"", cases[i].text, strlen(cases[i].text)};
        const struct scene_import_desc desc = {
            .files = &file, .file_count = 1, .format = cases[i].format};
        struct imported_scene s;
        struct error err = {0};
        assert_false(import_as(&s, &desc, &err));
        if (err.code != ERROR_INVALID_SCENE || !strstr(err.message, cases[i].message))
            fail_msg("case %zu: %d '%s'", i, err.code, err.message);
    }
}

static void counts_that_lie_are_refused(void **state)
{
    (void)state;
    const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
    unsigned char binary[200];
    struct scene_file file = {"", binary, write_stl(binary, corners, 1)};
    const struct scene_import_desc desc = {
        .files = &file, .file_count = 1, .format = SCENE_FORMAT_STL};
    const uint32_t lies[] = {0, 2, 400000000, UINT32_MAX};
    for (size_t i = 0; i < sizeof lies / sizeof *lies; i++) {
        struct imported_scene s;
        struct error err = {0};
        memcpy(binary + 80, &lies[i], sizeof lies[i]);
        assert_false(import_as(&s, &desc, &err));
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        assert_non_null(strstr(err.message, "the file has 134"));
    }
    const uint32_t one = 1, nan_bits = 0x7FC00000;
    memcpy(binary + 80, &one, sizeof one);
    memcpy(binary + 84 + 12 + 16, &nan_bits, sizeof nan_bits);
    struct imported_scene s;
    struct error err = {0};
    assert_false(import_as(&s, &desc, &err));
    assert_non_null(strstr(err.message, "vertex 1 is (1, nan, 0)"));
}

static void an_upload_has_one_scene(void **state)
{
    (void)state;
    const struct scene_file files[] = {{"a.obj", TETRAHEDRON, strlen(TETRAHEDRON)},
                                       {"b.obj", TETRAHEDRON, strlen(TETRAHEDRON)}};
    struct imported_scene s;
    struct error err = {0};
    assert_false(import_as(
        &s,
        &(struct scene_import_desc){.files = files, .file_count = 2, .format = SCENE_FORMAT_OBJ},
        &err));
    assert_non_null(strstr(err.message, "both 'a.obj' and 'b.obj' are scenes"));
    err = (struct error){0};
    assert_false(import_as(
        &s,
        &(struct scene_import_desc){.files = files, .file_count = 2, .format = SCENE_FORMAT_STL},
        &err));
    assert_non_null(strstr(err.message, "no file ends in .stl among the 2 uploaded"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coordinates_become_metres_with_y_up),
        cmocka_unit_test(stl_facets_are_read_in_both_forms),
        cmocka_unit_test(edges_are_smooth_below_thirty_degrees),
        cmocka_unit_test(ply_colours_become_linear),
        cmocka_unit_test(glass_takes_its_colour_from_the_filter),
        cmocka_unit_test(what_dissolves_without_a_filter_is_blended),
        cmocka_unit_test(factors_out_of_range_are_clamped_with_a_warning),
        cmocka_unit_test(closed_glass_is_seen_from_outside_alone),
        cmocka_unit_test(what_is_not_in_the_upload_is_reported),
        cmocka_unit_test(textures_of_the_upload_are_found),
        cmocka_unit_test(textures_of_older_formats_are_read),
        cmocka_unit_test(broken_files_are_refused_by_name),
        cmocka_unit_test(counts_that_lie_are_refused),
        cmocka_unit_test(an_upload_has_one_scene),
    };
    if (!VITRAIL_WITH_ASSIMP)
        return 77; /* skipped: nothing reads them */
    return cmocka_run_group_tests(tests, NULL, NULL);
}
