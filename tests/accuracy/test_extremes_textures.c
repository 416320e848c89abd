/* SPDX-License-Identifier: MIT */
/* A country of tiles, each with a JPEG of its own, far beyond the budget of textures: imported with
 * one image in memory at a time, flown over within the budget, and exact where the budget is not
 * exceeded. Full: 1.3 GiB of JPEG against 256 MiB; else 13 MiB (108 decoded) against 12 MiB. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "tests/support/extreme_checks.h"
#include "tests/support/image_checks.h"

enum { MIB = 1 << 20, JSON_BYTES = 1 << 20 };

struct country {
    int side;        /* tiles in rows and columns, 100 m each */
    int texture_px;  /* of a tile */
    uint64_t budget; /* of textures */
    uint8_t *glb;    /* a mapped file of the build folder */
    size_t glb_bytes;
    uint64_t jpeg_bytes;
    uint8_t *blob; /* likewise */
    struct scene scene;
};

/* ---- the file ---- */

static void paint(uint8_t *pixels, int side, uint32_t seed)
{
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            uint8_t *p = pixels + 4 * ((size_t)y * (size_t)side + (size_t)x);
            seed = seed * 1664525 + 1013904223;
            uint32_t field =
                ((uint32_t)(x / 32) * 73856093u ^ (uint32_t)(y / 32) * 19349663u) + seed % 7;
            p[0] = (uint8_t)(60 + (seed >> 25) + field % 60);
            p[1] = (uint8_t)(60 + (seed >> 18 & 127) + 60 * x / side);
            p[2] = (uint8_t)(40 + (seed >> 11 & 127) + 60 * y / side);
            p[3] = 255;
        }
}

struct jpegs {
    int fd;
    uint64_t at;
    uint64_t *offsets; /* of each tile, and of the end */
};

static void put(int fd, uint64_t at, const void *bytes, size_t size)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = pwrite(fd, (const char *)bytes + done, size - done, (off_t)(at + done));
        assert_true(n > 0);
        done += (size_t)n;
    }
}

static void add_jpeg(const struct country *country, struct jpegs *jpegs, int tile)
{
    struct error err = {0};
    struct image image = {0};
    void *bytes;
    size_t size;
    assert_true(image_init(&image, country->texture_px, country->texture_px, 4, IMAGE_U8, &err));
    paint(image.pixels, country->texture_px, (uint32_t)tile * 7919 + 1);
    const struct image_encode_desc desc = {.format = IMAGE_FORMAT_JPEG, .quality = 90};
    if (!image_encode(&image, &desc, &bytes, &size, &err))
        fail_msg("%s", err.message);
    put(jpegs->fd, jpegs->at, bytes, size);
    jpegs->offsets[tile] = jpegs->at;
    jpegs->at += (size + 3) / 4 * 4;
    jpegs->offsets[tile + 1] = jpegs->at;
    free(bytes);
    image_finish(&image);
}

static const float corners[4][5] = {/* place, texture coordinates */
                                    {0, 0, 0, 0, 1},
                                    {100, 0, 0, 1, 1},
                                    {100, 0, -100, 1, 0},
                                    {0, 0, -100, 0, 0}};

static char *write_json(const struct country *country, const struct jpegs *jpegs, uint64_t first)
{
    static const char head[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"buffers\":[{\"byteLength\":%llu}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\","
        "\"min\":[0,0,-100],\"max\":[100,0,0]},{\"bufferView\":1,\"componentType\":5126,"
        "\"count\":4,\"type\":\"VEC2\"},{\"bufferView\":2,\"componentType\":5125,\"count\":6,"
        "\"type\":\"SCALAR\"}],";
    static const char *const lists[] = {"bufferViews", "images", "textures",
                                        "materials",   "meshes", "nodes"};
    int tiles = country->side * country->side;
    char *json = malloc(JSON_BYTES), *at = json;
    assert_non_null(json);
    at += sprintf(at, head, (unsigned long long)(jpegs->at - first));
    for (int list = 0; list < 6; list++) {
        at += sprintf(at, "\"%s\":[%s", lists[list],
                      list ? ""
                           : "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48},{\"buffer\":0,"
                             "\"byteOffset\":48,\"byteLength\":32},{\"buffer\":0,\"byteOffset\":80,"
                             "\"byteLength\":24},");
        for (int i = 0; i < tiles; i++) {
            const char *comma = i ? "," : "";
            unsigned long long offset = jpegs->offsets[i] - first;
            unsigned long long size = jpegs->offsets[i + 1] - jpegs->offsets[i];
            if (list == 0)
                at += sprintf(at, "%s{\"buffer\":0,\"byteOffset\":%llu,\"byteLength\":%llu}", comma,
                              offset, size);
            else if (list == 1)
                at +=
                    sprintf(at, "%s{\"bufferView\":%d,\"mimeType\":\"image/jpeg\"}", comma, i + 3);
            else if (list == 2)
                at += sprintf(at, "%s{\"source\":%d}", comma, i);
            else if (list == 3)
                at += sprintf(at,
                              "%s{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":%d},"
                              "\"metallicFactor\":0}}",
                              comma, i);
            else if (list == 4)
                at += sprintf(at,
                              "%s{\"primitives\":[{\"attributes\":{\"POSITION\":0,"
                              "\"TEXCOORD_0\":1},\"indices\":2,\"material\":%d}]}",
                              comma, i);
            else
                at += sprintf(at, "%s{\"mesh\":%d,\"translation\":[%d,0,%d]}", comma, i,
                              i % country->side * 100, -(i / country->side) * 100);
        }
        at += sprintf(at, "],");
    }
    at += sprintf(at, "\"scenes\":[{\"nodes\":[");
    for (int i = 0; i < tiles; i++)
        at += sprintf(at, "%s%d", i ? "," : "", i);
    at += sprintf(at, "]}]}");
    assert_true(at < json + JSON_BYTES);
    return json;
}

/* The document stands in a chunk of fixed size before the images. */
static void write_glb(struct country *country, const char *path)
{
    enum { BIN = 20 + JSON_BYTES + 8 };
    int tiles = country->side * country->side;
    struct jpegs jpegs = {.fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600),
                          .offsets = calloc((size_t)tiles + 1, sizeof(uint64_t))};
    assert_true(jpegs.fd >= 0 && jpegs.offsets);
    float places[4][3], texcoords[4][2];
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    for (int i = 0; i < 4; i++) {
        memcpy(places[i], corners[i], sizeof places[i]);
        memcpy(texcoords[i], corners[i] + 3, sizeof texcoords[i]);
    }
    put(jpegs.fd, BIN, places, sizeof places);
    put(jpegs.fd, BIN + 48, texcoords, sizeof texcoords);
    put(jpegs.fd, BIN + 80, indices, sizeof indices);
    jpegs.at = BIN + 104;
    for (int i = 0; i < tiles; i++)
        add_jpeg(country, &jpegs, i);
    country->jpeg_bytes = jpegs.at - BIN - 104;
    char *json = write_json(country, &jpegs, BIN);
    const uint32_t head[5] = {0x46546C67, 2, (uint32_t)jpegs.at, JSON_BYTES, 0x4E4F534A};
    const uint32_t chunk[2] = {(uint32_t)(jpegs.at - BIN), 0x004E4942};
    memset(json + strlen(json), ' ', JSON_BYTES - strlen(json));
    put(jpegs.fd, 0, head, sizeof head);
    put(jpegs.fd, 20, json, JSON_BYTES);
    put(jpegs.fd, BIN - 8, chunk, sizeof chunk);
    assert_int_equal(ftruncate(jpegs.fd, (off_t)jpegs.at), 0); /* padding of the last one */
    country->glb_bytes = jpegs.at;
    country->glb = mmap(NULL, jpegs.at, PROT_READ, MAP_PRIVATE, jpegs.fd, 0);
    assert_ptr_not_equal(country->glb, MAP_FAILED);
    close(jpegs.fd);
    free(json);
    free(jpegs.offsets);
}

/* ---- the blob ---- */

static bool write_blob(void *context, uint64_t offset, const void *bytes, size_t size,
                       struct error *err)
{
    (void)err;
    put(*(const int *)context, offset, bytes, size);
    return true;
}

static double processor_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static long peak_mib(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
}

static void import(struct country *country, const char *path)
{
    struct error err = {0};
    int fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    struct scene_file file = {"", country->glb, country->glb_bytes};
    void *head;
    size_t head_bytes;
    assert_true(fd >= 0);
    double begin_s = processor_s();
    if (!scene_import(&(struct scene_import_desc){.files = &file,
                                                  .file_count = 1,
                                                  .max_blob_bytes = 32ull << 30,
                                                  .write = write_blob,
                                                  .context = &fd},
                      &head, &head_bytes, &err))
        fail_msg("%s", err.message);
    size_t size = ((const struct scene_header *)head)->size_bytes;
    put(fd, 0, head, head_bytes);
    assert_int_equal(ftruncate(fd, (off_t)size), 0);
    country->blob = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
    close(fd);
    free(head);
    assert_ptr_not_equal(country->blob, MAP_FAILED);
    if (!scene_open(&country->scene, country->blob, size, &err))
        fail_msg("%s", err.message);
    print_message("%llu MiB of JPEG, %zu MiB decoded with levels, %.1f s of processor; peak of "
                  "resident memory %ld MiB\n",
                  (unsigned long long)(country->jpeg_bytes >> 20), size >> 20,
                  processor_s() - begin_s, peak_mib());
}

static int open_country(void **state)
{
    struct country *country = *state = calloc(1, sizeof *country);
    bool is_full = extreme_is_full();
    assert_non_null(country);
    country->side = is_full ? 23 : 9;
    country->texture_px = is_full ? 2048 : 512;
    country->budget = is_full ? 256 * MIB : 12 * MIB;
    write_glb(country, VITRAIL_BINARY_DIR "/extreme_textures.glb");
    import(country, VITRAIL_BINARY_DIR "/extreme_textures.blob");
    return 0;
}

static int close_country(void **state)
{
    struct country *country = *state;
    munmap(country->glb, country->glb_bytes);
    munmap(country->blob, country->scene.header->size_bytes);
    if (!getenv("VITRAIL_KEEP_FILES"))
        unlink(VITRAIL_BINARY_DIR "/extreme_textures.glb");
    unlink(VITRAIL_BINARY_DIR "/extreme_textures.blob");
    free(country);
    return 0;
}

/* ---- flights ---- */

static struct renderer *attach(const struct country *country, uint64_t budget)
{
    struct error err = {0};
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .texture_budget_bytes = budget});
    if (!renderer_attach_scene(
            renderer, &(struct renderer_scene_desc){.key = "country", .scene = &country->scene},
            &err))
        fail_msg("%s", err.message);
    return renderer;
}

static void fly(struct renderer *renderer, const struct view *view, struct frame *frame)
{
    struct error err = {0};
    if (!renderer_render(renderer, "country", view, frame, &err))
        fail_msg("%s", err.message);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0.3, -1, 0.2},
                                      .color = {1, 1, 1},
                                      .intensity = 3,
                                      .casts_no_shadow = true};

/* Over the country at this height, `way` of 1 across it, looking down by 45 degrees. */
static struct view place(const struct country *country, double way, double height_m)
{
    double middle = country->side * 50.0, z = -way * country->side * 100.0;
    return (struct view){.width_px = 320,
                         .height_px = 240,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {middle, height_m, z},
                                    .target = {middle, 0, z - height_m}},
                         .lights = &sun,
                         .light_count = 1,
                         .quality = {.shadows = SHADOWS_MAP, .samples = 1}};
}

static void print_frame(const char *what, const struct frame *frame, double ms)
{
    const struct report_textures *t = &frame->report.textures;
    print_message("%s: %.0f ms, wants %.1f MiB, resident %.1f, written %.1f in %.1f ms, to come "
                  "%.1f, bias %llu, coarse %llu\n",
                  what, ms, (double)t->wanted_bytes / MIB, (double)t->resident_bytes / MIB,
                  (double)t->written_bytes / MIB, t->upload_ms, (double)t->pending_bytes / MIB,
                  (unsigned long long)t->level_bias, (unsigned long long)t->coarse_count);
}

/* Every frame is within the budget; none is short of levels unless it says so. */
static void a_flight_over_the_country_keeps_the_budget(void **state)
{
    const struct country *country = *state;
    struct renderer *renderer = attach(country, country->budget);
    uint64_t whole = country->scene.pixel_bytes;
    assert_true(whole > 8 * country->budget);
    int exact = 0;
    for (int i = 0; i < 12; i++) {
        struct view view = place(country, i / 12.0, i % 3 ? 200 : 20);
        struct frame frame;
        double begin_s = processor_s();
        fly(renderer, &view, &frame);
        print_frame("frame", &frame, 1e3 * (processor_s() - begin_s));
        const struct report_textures *t = &frame.report.textures;
        assert_true(t->resident_bytes <= country->budget);
        assert_int_equal(t->pending_bytes, 0);
        assert_int_equal(t->coarse_count > 0, t->level_bias > 0);
        assert_int_equal(t->level_bias > 0, t->wanted_bytes > country->budget);
        exact += t->level_bias == 0;
        frame_finish(&frame);
    }
    assert_true(exact > 0);
    renderer_destroy(renderer);
}

static void within_the_budget_the_picture_is_that_of_all_levels(void **state)
{
    const struct country *country = *state;
    if (country->scene.pixel_bytes > 1ull << 30) /* there is no renderer that holds all of it */
        skip();
    struct frame references[3], frame;
    struct renderer *whole = attach(country, 0); /* one at a time: each has a context of its own */
    for (int i = 0; i < 3; i++) {
        struct view view = place(country, 0.1 + 0.3 * i, 300);
        fly(whole, &view, &references[i]);
    }
    renderer_destroy(whole);
    struct renderer *renderer = attach(country, country->budget);
    for (int i = 0; i < 3; i++) {
        struct view view = place(country, 0.1 + 0.3 * i, 300);
        fly(renderer, &view, &frame);
        assert_int_equal(frame.report.textures.level_bias, 0);
        extreme_expect(&(struct extreme_row){"tiles beyond the budget of textures", "on demand",
                                             "relative RMSE to all levels", 1e-4},
                       extreme_rmse(&frame.outputs[VIEW_OUTPUT_COLOR],
                                    &references[i].outputs[VIEW_OUTPUT_COLOR]));
        frame_finish(&frame);
        frame_finish(&references[i]);
    }
    renderer_destroy(renderer);
}

static int compare_ms(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A flight of frames in motion, then rest. */
static void frames_in_motion_write_a_bounded_amount(void **state)
{
    const struct country *country = *state;
    struct renderer *renderer = attach(country, country->budget);
    uint64_t first = 1400ull * (uint64_t)country->side * (uint64_t)country->side;
    struct frame frame;
    enum { FRAMES = 120 };
    double ms[FRAMES];
    for (int i = 0; i < FRAMES; i++) {
        struct view view = place(country, (double)i / FRAMES, 120);
        view.quality.may_be_coarse = true;
        double begin_s = processor_s();
        fly(renderer, &view, &frame);
        print_frame("moving", &frame, 1e3 * (processor_s() - begin_s));
        ms[i] = frame.report.textures.upload_ms;
        assert_true(frame.report.textures.written_bytes <= 17 * MIB + first);
        assert_true(frame.report.textures.resident_bytes <= country->budget * 5 / 4);
        frame_finish(&frame);
    }
    qsort(ms, FRAMES, sizeof *ms, compare_ms);
    print_message("uploads of a frame in motion: p50 %.2f ms, p95 %.2f, most %.2f\n",
                  ms[FRAMES / 2], ms[FRAMES * 95 / 100], ms[FRAMES - 1]);
    assert_true(ms[FRAMES / 2] < 40); /* ten times the limit: others have the processors, too */
    struct view view = place(country, (FRAMES - 1.0) / FRAMES, 120);
    fly(renderer, &view, &frame);
    print_frame("at rest", &frame, 0);
    assert_int_equal(frame.report.textures.pending_bytes, 0);
    frame_finish(&frame);
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flight_over_the_country_keeps_the_budget),
        cmocka_unit_test(within_the_budget_the_picture_is_that_of_all_levels),
        cmocka_unit_test(frames_in_motion_write_a_bounded_amount),
    };
    return cmocka_run_group_tests(tests, open_country, close_country);
}
