/* SPDX-License-Identifier: MIT */
/* Suite `import`: one mesh as plain glTF, compressed by meshopt and by Draco, from a file in memory
 * to a scene blob, against the decoders alone. */
#include <malloc.h>
#include <math.h>
#include <meshoptimizer.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/bench.h"
#include "tests/bench/samples.h"
#include "tests/support/draco_encoder_shim.h"
#include "tests/support/import_support.h"

enum { SIDE = 512, SIDE_QUICK = 64, POSITION_BITS = 14 };
enum form { PLAIN, MESHOPT, DRACO, FORMS };

static const char *const form_names[FORMS] = {"plain", "meshopt", "draco"};

struct vertex {
    float position[3], normal[3];
};

/* A bent sheet, and its files. */
struct mesh {
    uint32_t side, vertex_count, index_count;
    struct vertex *vertices;                          /* owned */
    uint32_t *indices;                                /* owned */
    void *glb[FORMS], *streams[FORMS], *index_stream; /* owned; streams[PLAIN] is both arrays */
    size_t glb_bytes[FORMS], stream_bytes[FORMS], index_stream_bytes;
};

static void mesh_finish(struct mesh *mesh)
{
    for (int i = 0; i < FORMS; i++) {
        free(mesh->glb[i]);
        free(mesh->streams[i]);
    }
    free(mesh->index_stream);
    free(mesh->vertices);
    free(mesh->indices);
}

static bool fill(struct mesh *mesh, uint32_t side)
{
    *mesh = (struct mesh){
        .side = side, .vertex_count = side * side, .index_count = 6 * (side - 1) * (side - 1)};
    mesh->vertices = calloc(mesh->vertex_count, sizeof *mesh->vertices);
    mesh->indices = calloc(mesh->index_count, sizeof *mesh->indices);
    if (!mesh->vertices || !mesh->indices)
        return false;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        uint32_t row = v / side;
        float x = (float)(v % side) / (float)side, y = (float)row / (float)side;
        float slope = 1.2f * cosf(12 * x), length = sqrtf(1 + slope * slope);
        mesh->vertices[v] =
            (struct vertex){{x, y, 0.1f * sinf(12 * x)}, {-slope / length, 0, 1 / length}};
    }
    uint32_t *to = mesh->indices;
    for (uint32_t y = 0; y + 1 < side; y++)
        for (uint32_t x = 0; x + 1 < side; x++) {
            uint32_t a = y * side + x;
            const uint32_t corners[6] = {a, a + 1, a + side, a + side, a + 1, a + side + 1};
            memcpy(to, corners, sizeof corners);
            to += 6;
        }
    return true;
}

/* Packs two blocks after each other; *at is where the second begins. */
static void *join(const void *first, size_t first_bytes, const void *second, size_t second_bytes,
                  size_t *at, size_t *size_bytes)
{
    *at = (first_bytes + 3) / 4 * 4;
    *size_bytes = (*at + second_bytes + 3) / 4 * 4;
    char *bytes = calloc(*size_bytes, 1);
    if (bytes && first)
        memcpy(bytes, first, first_bytes);
    if (bytes && second)
        memcpy(bytes + *at, second, second_bytes);
    return bytes;
}

#define MESH_JSON                                                                         \
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1},'indices':2%s}]}]," \
    "'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}],'accessors':["                         \
    "{%s'componentType':5126,'count':%u,'type':'VEC3'},"                                  \
    "{%s'componentType':5126,'count':%u,'type':'VEC3'},"                                  \
    "{%s'componentType':5125,'count':%u,'type':'SCALAR'}]}"

static bool put_glb(struct mesh *mesh, enum form form, const char *head, const char *primitive,
                    const char *const views[3], const void *bin, size_t bin_bytes)
{
    char json[4096];
    int length = snprintf(json, sizeof json, "{'asset':{'version':'2.0'},%s," MESH_JSON, head,
                          primitive, views[0], mesh->vertex_count, views[1], mesh->vertex_count,
                          views[2], mesh->index_count);
    if (length < 0 || (size_t)length >= sizeof json)
        return false;
    mesh->glb[form] = glb_make(json, bin, bin_bytes, &mesh->glb_bytes[form]);
    return mesh->glb[form];
}

static const char *const interleaved[3] = {"'bufferView':0,", "'bufferView':0,'byteOffset':12,",
                                           "'bufferView':1,"};

static bool make_plain(struct mesh *mesh)
{
    char head[512];
    size_t at, size, vertex_bytes = mesh->vertex_count * sizeof *mesh->vertices;
    size_t index_bytes = mesh->index_count * sizeof *mesh->indices;
    void *bin = join(mesh->vertices, vertex_bytes, mesh->indices, index_bytes, &at, &size);
    snprintf(head, sizeof head,
             "'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,'byteLength':%zu,"
             "'byteStride':24},{'buffer':0,'byteOffset':%zu,'byteLength':%zu}]",
             size, vertex_bytes, at, index_bytes);
    bool is_done = bin && put_glb(mesh, PLAIN, head, "", interleaved, bin, size);
    free(bin);
    return is_done;
}

static bool encode_meshopt(struct mesh *mesh)
{
    size_t vertex_room =
        meshopt_encodeVertexBufferBound(mesh->vertex_count, sizeof *mesh->vertices);
    size_t index_room = meshopt_encodeIndexBufferBound(mesh->index_count, mesh->vertex_count);
    mesh->streams[MESHOPT] = malloc(vertex_room);
    mesh->index_stream = malloc(index_room);
    if (!mesh->streams[MESHOPT] || !mesh->index_stream)
        return false;
    meshopt_encodeIndexVersion(1);
    mesh->stream_bytes[MESHOPT] =
        meshopt_encodeVertexBuffer(mesh->streams[MESHOPT], vertex_room, mesh->vertices,
                                   mesh->vertex_count, sizeof *mesh->vertices);
    mesh->index_stream_bytes =
        meshopt_encodeIndexBuffer(mesh->index_stream, index_room, mesh->indices, mesh->index_count);
    return mesh->stream_bytes[MESHOPT] > 0 && mesh->index_stream_bytes > 0;
}

static bool make_meshopt(struct mesh *mesh)
{
    char head[1024];
    size_t at, size;
    if (!encode_meshopt(mesh))
        return false;
    void *bin = join(mesh->streams[MESHOPT], mesh->stream_bytes[MESHOPT], mesh->index_stream,
                     mesh->index_stream_bytes, &at, &size);
    size_t vertex_bytes = mesh->vertex_count * sizeof *mesh->vertices;
    size_t index_bytes = mesh->index_count * sizeof *mesh->indices;
    snprintf(head, sizeof head,
             "'extensionsUsed':['EXT_meshopt_compression'],'buffers':[{'byteLength':%zu},"
             "{'byteLength':%zu}],'bufferViews':[{'buffer':1,'byteLength':%zu,'byteStride':24,"
             "'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':%zu,"
             "'byteStride':24,'count':%u,'mode':'ATTRIBUTES'}}},{'buffer':1,'byteOffset':%zu,"
             "'byteLength':%zu,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
             "'byteOffset':%zu,'byteLength':%zu,'byteStride':4,'count':%u,"
             "'mode':'TRIANGLES'}}}]",
             size, vertex_bytes + index_bytes, vertex_bytes, mesh->stream_bytes[MESHOPT],
             mesh->vertex_count, vertex_bytes, index_bytes, at, mesh->index_stream_bytes,
             mesh->index_count);
    bool is_done = bin && put_glb(mesh, MESHOPT, head, "", interleaved, bin, size);
    free(bin);
    return is_done;
}

static bool make_draco(struct mesh *mesh)
{
    static const char *const views[3] = {"", "", ""};
    char head[512];
    size_t at, size;
    float(*positions)[3] = calloc(mesh->vertex_count, sizeof *positions);
    float(*normals)[3] = calloc(mesh->vertex_count, sizeof *normals);
    for (uint32_t v = 0; positions && normals && v < mesh->vertex_count; v++) {
        memcpy(positions[v], mesh->vertices[v].position, sizeof *positions);
        memcpy(normals[v], mesh->vertices[v].normal, sizeof *normals);
    }
    if (positions && normals)
        mesh->streams[DRACO] =
            draco_encode(&(struct draco_encoder_desc){.points = mesh->vertex_count,
                                                      .triangles = mesh->index_count / 3,
                                                      .indices = mesh->indices,
                                                      .positions = positions[0],
                                                      .normals = normals[0],
                                                      .position_bits = POSITION_BITS},
                         &mesh->stream_bytes[DRACO]);
    free(positions);
    free(normals);
    if (!mesh->streams[DRACO])
        return false;
    void *bin = join(mesh->streams[DRACO], mesh->stream_bytes[DRACO], NULL, 0, &at, &size);
    snprintf(head, sizeof head,
             "'extensionsUsed':['KHR_draco_mesh_compression'],'buffers':[{'byteLength':%zu}],"
             "'bufferViews':[{'buffer':0,'byteLength':%zu}]",
             size, mesh->stream_bytes[DRACO]);
    bool is_done = bin && put_glb(mesh, DRACO, head,
                                  ",'extensions':{'KHR_draco_mesh_compression':{'bufferView':0,"
                                  "'attributes':{'POSITION':0,'NORMAL':1}}}",
                                  views, bin, size);
    free(bin);
    return is_done;
}

static bool mesh_make(struct mesh *mesh, uint32_t side, struct error *err)
{
    return (fill(mesh, side) && make_plain(mesh) && make_meshopt(mesh) && make_draco(mesh)) ||
           error_set(err, ERROR_INTERNAL, "a mesh of %u x %u vertices cannot be encoded", side,
                     side);
}

static bool import(const struct mesh *mesh, enum form form, struct error *err)
{
    struct scene_file file = {"", mesh->glb[form], mesh->glb_bytes[form]};
    void *blob;
    size_t size;
    bool is_done = scene_import(&(struct scene_import_desc){.files = &file, .file_count = 1}, &blob,
                                &size, err);
    free(blob);
    return is_done;
}

/* The library alone, into memory that is there. */
static bool decode(const struct mesh *mesh, enum form form, void *vertices, void *indices)
{
    if (form == DRACO)
        return draco_decode(mesh->streams[DRACO], mesh->stream_bytes[DRACO]) == mesh->vertex_count;
    return meshopt_decodeVertexBuffer(vertices, mesh->vertex_count, sizeof *mesh->vertices,
                                      mesh->streams[MESHOPT], mesh->stream_bytes[MESHOPT]) == 0 &&
           meshopt_decodeIndexBuffer(indices, mesh->index_count, sizeof *mesh->indices,
                                     mesh->index_stream, mesh->index_stream_bytes) == 0;
}

struct times {
    struct samples import[FORMS], decode[FORMS]; /* ms */
};

static bool run_rounds(struct bench *bench, const struct mesh *mesh, struct times *times,
                       struct error *err)
{
    void *vertices = malloc(mesh->vertex_count * sizeof *mesh->vertices);
    void *indices = malloc(mesh->index_count * sizeof *mesh->indices);
    bool ok = vertices && indices;
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);)
        for (enum form form = PLAIN; ok && form < FORMS; form++) {
            double begin_ms = wall_now_ms();
            ok = import(mesh, form, err);
            double import_ms = wall_now_ms() - begin_ms;
            begin_ms = wall_now_ms();
            if (form != PLAIN && !decode(mesh, form, vertices, indices))
                ok = error_set(err, ERROR_INTERNAL, "%s does not decode", form_names[form]);
            if (rounds.is_warming)
                continue;
            samples_add(&times->import[form], import_ms);
            samples_add(&times->decode[form], wall_now_ms() - begin_ms);
        }
    free(vertices);
    free(indices);
    return ok;
}

/* The most memory that a process has at once which imports, or does nothing (FORMS). */
static double peak_bytes(const struct mesh *mesh, enum form form)
{
    struct error ignored = {0};
    struct rusage usage = {0};
    malloc_trim(0);
    pid_t child = fork();
    if (child == 0)
        _exit(form == FORMS || import(mesh, form, &ignored) ? 0 : 1);
    int status = 1;
    if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0)
        return NAN;
    return 1024.0 * (double)usage.ru_maxrss;
}

static void tell(struct bench *bench, enum form form, const char *name, double value)
{
    bench_check(
        bench,
        &(struct check){
            .scene = "sheet", .subject = form_names[form], .name = name, .value = value, .p = NAN});
}

static void tell_all(struct bench *bench, const struct mesh *mesh, const struct times *times)
{
    double nothing = peak_bytes(mesh, FORMS);
    double plain_ms = samples_summary(&times->import[PLAIN]).median;
    for (enum form form = PLAIN; form < FORMS; form++) {
        double ms = samples_summary(&times->import[form]).median;
        double megabytes = (double)mesh->glb_bytes[form] / 1e6;
        tell(bench, form, "file, MB", megabytes);
        tell(bench, form, "import, ms", ms);
        tell(bench, form, "MB of file per s", megabytes / ms * 1e3);
        tell(bench, form, "million triangles per s", mesh->index_count / 3.0 / ms / 1e3);
        tell(bench, form, "peak memory / file",
             (peak_bytes(mesh, form) - nothing) / (double)mesh->glb_bytes[form]);
        if (form == PLAIN)
            continue;
        double decode_ms = samples_summary(&times->decode[form]).median;
        tell(bench, form, "decoder alone, ms", decode_ms);
        bench_check(bench, &(struct check){.scene = "sheet",
                                           .subject = form_names[form],
                                           .name = "import beyond plain / decoder alone",
                                           .value = (ms - plain_ms) / decode_ms,
                                           .relation = "<=",
                                           .bound = 1.3,
                                           .p = NAN});
    }
}

bool suite_import(struct bench *bench, struct error *err)
{
    struct mesh mesh;
    struct times times = {0};
    bool ok = mesh_make(&mesh, bench->options.is_quick ? SIDE_QUICK : SIDE, err) &&
              run_rounds(bench, &mesh, &times, err);
    if (ok)
        tell_all(bench, &mesh, &times);
    for (int i = 0; i < FORMS; i++) {
        samples_finish(&times.import[i]);
        samples_finish(&times.decode[i]);
    }
    mesh_finish(&mesh);
    return ok;
}
