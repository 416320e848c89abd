/* SPDX-License-Identifier: MIT */
/* Fuzz target: any bytes as a scene of another format than glTF; the first byte chooses which. A
 * scene comes out that opens, or an error that is not ours.
 *
 * Some readers of assimp crash, run for ever or take all memory on broken files. Uploads are read
 * in a process of their own, so that such a file is a refusal; here, too, they convert in a child
 * with limits of time and memory, and how it ends decides nothing: what it hands over must import,
 * and this process goes on. The other readers, and all that imports, run in this process. */
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "renderer/import/converter.h"
#include "renderer/import/import.h"
#include "renderer/scene/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
    SHARED_BYTES = 16 << 20, /* larger conversions are left out */
    CHILD_SECONDS = 3,       /* of processor time */
};

static const struct target {
    uint8_t letter;
    enum scene_format format;
    const char *name; /* of the file */
    bool is_apart;    /* is read in a child */
} targets[] = {
    {'o', SCENE_FORMAT_OBJ, "scene.obj", false},   {'p', SCENE_FORMAT_PLY, "scene.ply", false},
    {'s', SCENE_FORMAT_STL, "scene.stl", false},   {'i', SCENE_FORMAT_INVENTOR, "scene.iv", false},
    {'f', SCENE_FORMAT_FBX, "scene.fbx", true},    {'c', SCENE_FORMAT_COLLADA, "scene.dae", true},
    {'m', SCENE_FORMAT_3MF, "scene.3mf", true},    {'3', SCENE_FORMAT_3DS, "scene.3ds", true},
    {'v', SCENE_FORMAT_OPENVDB, "scene.vdb", true}};

struct shared {       /* with the child */
    size_t glb_bytes; /* 0: there is none */
    uint8_t glb[SHARED_BYTES];
};

static void import(const struct scene_import_desc *desc)
{
    struct error err = {0};
    struct scene scene;
    void *blob;
    size_t blob_bytes;
    bool is_imported = scene_import(desc, &blob, &blob_bytes, &err);
    if (is_imported ? !scene_open(&scene, blob, blob_bytes, &err)
                    : err.code == ERROR_NONE || err.code == ERROR_INTERNAL)
        abort();
    free(blob);
}

/* ---- in a child ---- */

static void convert(const struct scene_import_desc *desc, struct shared *shared)
{
    struct conversion conversion;
    struct error err = {0};
    if (conversion_init(&conversion, desc, &err) &&
        conversion.files[0].size_bytes <= SHARED_BYTES) {
        memcpy(shared->glb, conversion.files[0].bytes, conversion.files[0].size_bytes);
        shared->glb_bytes = conversion.files[0].size_bytes;
    }
    _exit(0);
}

static void limit(void)
{
    const struct rlimit time_s = {CHILD_SECONDS, CHILD_SECONDS}, no_core = {0, 0};
    const struct rlimit memory = {UINT64_C(2) << 30, UINT64_C(2) << 30};
    setrlimit(RLIMIT_CPU, &time_s);
    setrlimit(RLIMIT_CORE, &no_core);
#ifndef __SANITIZE_ADDRESS__ /* which needs address space without limit */
    setrlimit(RLIMIT_AS, &memory);
#else
    (void)memory;
#endif
    signal(SIGABRT, SIG_DFL);
}

static void convert_apart(const struct scene_import_desc *desc)
{
    struct shared *shared =
        mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    int status;
    if (shared == MAP_FAILED)
        abort();
    pid_t child = fork();
    if (child == 0) {
        limit();
        convert(desc, shared);
    }
    if (child < 0 || waitpid(child, &status, 0) != child)
        abort();
    if (shared->glb_bytes > 0) {
        const struct scene_file files[] = {{"scene.glb", shared->glb, shared->glb_bytes},
                                           desc->files[1]};
        struct scene_import_desc gltf = *desc;
        gltf.files = files;
        gltf.format = SCENE_FORMAT_GLTF;
        import(&gltf);
    }
    munmap(shared, sizeof *shared);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct target *target = NULL;
    for (size_t i = 0; size > 0 && i < sizeof targets / sizeof *targets; i++)
        if (data[0] == targets[i].letter)
            target = &targets[i];
    if (!target || !scene_format_describe(target->format)->is_built ||
        !scene_import_prepare(target->format, NULL))
        return 0;
    /* "m.mtl" is there to be named */
    const struct scene_file files[] = {{target->name, data + 1, size - 1},
                                       {"m.mtl", data + 1, size - 1}};
    const struct scene_import_desc desc = {.files = files,
                                           .file_count = 2,
                                           .format = target->format,
                                           .max_blob_bytes = 16 << 20,
                                           .max_image_pixels = 1 << 16};
    if (target->is_apart)
        convert_apart(&desc);
    else
        import(&desc);
    return 0;
}
