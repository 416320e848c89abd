/* SPDX-License-Identifier: MIT */
/* Fuzz target: any bytes as a scene of another format than glTF; the first byte chooses which. A
 * scene comes out that opens, or an error that is not ours. With a capital V the name of
 * the grid that is wanted comes before an OpenVDB file, up to a byte 0: no other grid is shown, and
 * a name ends no child that ends well without it.
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
    SCENES_TRIED = 3,        /* of a file that a name ended the child on */
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

/* Which scene is shown: its place; -1: none, or the file is refused. */
struct shown {
    int count, place;
};

static bool tell_scene(void *context, const char *name, bool is_shown, struct error *err)
{
    struct shown *shown = context;
    (void)name;
    (void)err;
    if (is_shown)
        shown->place = shown->count;
    shown->count++;
    return true;
}

static int find_shown(const struct scene_import_desc *desc, const char *wanted)
{
    struct error err = {0};
    struct shown shown = {.place = -1};
    struct scene_import_desc told = *desc;
    void *blob;
    size_t blob_bytes;
    told.scene = wanted;
    told.tell_scene = tell_scene;
    told.context = &shown;
    bool is_imported = scene_import(&told, &blob, &blob_bytes, &err);
    free(blob);
    return is_imported ? shown.place : -1;
}

/* A scene that is found by its name is the one that the conversion read, which its file names. */
static void import_named(const struct scene_import_desc *desc)
{
    int named = find_shown(desc, desc->scene);
    if (named >= 0 && named != find_shown(desc, NULL))
        abort();
}

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

/* Returns whether the child ended by itself, or by its limits. */
static bool run_child(const struct scene_import_desc *desc, struct shared *shared)
{
    int status;
    pid_t child = fork();
    if (child == 0) {
        limit();
        convert(desc, shared);
    }
    if (child < 0 || waitpid(child, &status, 0) != child)
        abort();
    return WIFEXITED(status) || WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL;
}

/* Whether each of the first scenes can be read by its place, and the file without any name. */
static bool is_sound(const struct scene_import_desc *desc, struct shared *shared)
{
    static const char *const places[SCENES_TRIED + 1] = {NULL, "#0", "#1", "#2"};
    for (int i = 0; i <= SCENES_TRIED; i++) {
        struct scene_import_desc other = *desc;
        other.scene = places[i];
        if (!run_child(&other, shared))
            return false;
    }
    return true;
}

static void convert_apart(const struct scene_import_desc *desc)
{
    struct shared *shared =
        mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED)
        abort();
    if (!run_child(desc, shared) && desc->scene && is_sound(desc, shared))
        abort();
    if (shared->glb_bytes > 0) {
        const struct scene_file files[] = {{"scene.glb", shared->glb, shared->glb_bytes},
                                           desc->files[1]};
        struct scene_import_desc gltf = *desc;
        gltf.files = files;
        gltf.format = SCENE_FORMAT_GLTF;
        import(&gltf);
        if (gltf.scene)
            import_named(&gltf);
    }
    munmap(shared, sizeof *shared);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct target *target = NULL;
    bool is_named = size > 0 && data[0] == 'V';
    for (size_t i = 0; size > 0 && i < sizeof targets / sizeof *targets; i++)
        if ((is_named ? 'v' : data[0]) == targets[i].letter)
            target = &targets[i];
    if (!target || !scene_format_describe(target->format)->is_built ||
        !scene_import_prepare(target->format, NULL))
        return 0;
    const uint8_t *file = data + 1, *end = data + size;
    const char *wanted = NULL;
    if (is_named) {
        const uint8_t *name_end = memchr(file, 0, size - 1);
        if (!name_end || name_end == file) /* no request has an empty name */
            return 0;
        wanted = (const char *)file;
        file = name_end + 1;
    }
    /* "m.mtl" is there to be named */
    const struct scene_file files[] = {{target->name, file, (size_t)(end - file)},
                                       {"m.mtl", file, (size_t)(end - file)}};
    const struct scene_import_desc desc = {.files = files,
                                           .file_count = 2,
                                           .format = target->format,
                                           .scene = wanted,
                                           .max_blob_bytes = 16 << 20,
                                           .max_image_pixels = 1 << 16};
    if (target->is_apart)
        convert_apart(&desc);
    else
        import(&desc);
    return 0;
}
