/* SPDX-License-Identifier: MIT */
/* vitrail-bench: measures speed and memory of the renderer, in process. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "server/base/processor.h"
#include "tests/bench/bench.h"

static const struct suite suites[] = {
    {"lights", "light lists: 50 to 250 cone lights, shadows off", suite_lights},
    {"deep", "deep shadow maps: one spot light, 256^2 to 2048^2", suite_deep},
    {"both", "5 to 25 shadowed spot lights at 512^2, moving and static", suite_both},
    {"layers", "build and lookup at 1 to 64 layers, against the targets", suite_layers},
    {"demo", "the demo scene at 1280x720: first frame, warm frames, moving camera", suite_demo},
    {"draws", "100 to 15,600 objects: drawing, culling, one part moved", suite_draws},
    {"raytrace", "ray tracing: against bare Embree, without clusters, and against deep maps",
     suite_raytrace},
    {"foliage", "deep maps of thousands of thin casters: exact, averaged, compressed",
     suite_foliage},
    {"forecast", "the models behind auto against what frames take, on shared scenes",
     suite_forecast},
    {"auto", "what auto chooses against the fastest technique, on generated scenes", suite_auto},
    {"linear", "frame time against the number of lights", suite_linear},
    {"standing", "25 and 250 shadows that stand under a moving camera, and their lookups alone",
     suite_standing},
    {"ahead", "the next frame begun while one is on the device, beside frames in turn",
     suite_ahead},
    {"environment", "light from all around: rasterised, ray traced by the sample, its error",
     suite_environment},
    {"smoke", "haze in the lights of a scene, its error, and smoke from nearby", suite_smoke},
    {"grids", "what smoke adds to frames against its forecast", suite_grids},
    {"peels", "what peeled layers and layered shadow maps take against forecasts", suite_peels},
    {"finders", "what shadow volumes and grids of triangles take against forecasts", suite_finders},
    {"traced", "ray traced pictures against a bare ray tracer on Embree", suite_traced},
    {"techniques", "each shadow technique against the number of translucent quads",
     suite_techniques},
    {"silhouettes", "shadow volumes, maps and rays against the triangles of a grid of spheres",
     suite_silhouettes},
    {"area", "soft shadows by grids of triangles against rays to the same points of a light",
     suite_area},
    {"skin", "skinned vertices per second, and one figure that moves in a scene that stands",
     suite_skin},
    {"import", "one mesh plain, by meshopt and by Draco: speed, memory, the decoders alone",
     suite_import},
    {"targets", "what lights and shadows may cost, each with its bound", suite_targets},
    {"scaling", "growth with layers, quads, map side, lights and objects; not one of `all`",
     suite_scaling},
};
enum { SUITES = sizeof suites / sizeof *suites };

static const char usage[] =
    "usage: vitrail-bench SUITE|all|list [options]\n"
    "       vitrail-bench promises [--seeds N] [--busy] [--wish budget_ms|max_error] [--media] "
    "[--quick] [--json]\n"
    "       vitrail-bench generate SEED FILE.glb [--smoke]\n"
    "       vitrail-bench farm [SCENE.glb] [--size WxH] [--frames N] [--rounds N] [--quick] "
    "[--json]\n"
    "       vitrail-bench live [SCENE.glb] [--size WxH] [--seconds S] [--budget-ms MS] "
    "[--quick] [--json]\n"
    "\n"
    "  --json          one JSON document instead of tables; progress goes to standard error\n"
    "  --frames N      rounds per case (30)\n"
    "  --seconds S     end a case after this time, at least five rounds (12)\n"
    "  --warm-up N     rounds before measuring (3)\n"
    "  --quick         the smallest cases, to see that everything runs\n"
    "  --size WxH      size of the image, or number of lookups (the suite's own)\n"
    "  --scene NAME    only this scene: demo, sponza, panes, quads,\n"
    "                  assembly, foliage, boxes, spheres, colonnade\n"
    "  --triangles N   of `silhouettes`: one grid of spheres with about so many together,\n"
    "  --objects N     each an object, of which there are so many (100)\n"
    "  --texels N      of `silhouettes`: per side of its shadow maps (2048)\n"
    "  --pictures      save a picture of each variant below images/ of the build folder\n";

static bool read_number(const char *text, double low, double high, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && !*end && *value >= low && *value <= high;
}

static bool read_valued(struct bench_options *o, const char *name, const char *text)
{
    double number = 0;
    char rest;
    if (!strcmp(name, "--scene"))
        o->scene = text;
    else if (!strcmp(name, "--size"))
        return sscanf(text, "%dx%d%c", &o->width, &o->height, &rest) == 2 && o->width > 0 &&
               o->height > 0 && o->width <= 16384 && o->height <= 16384;
    else if (!strcmp(name, "--frames") && read_number(text, 1, 1e6, &number))
        o->frames = (int)number;
    else if (!strcmp(name, "--warm-up") && read_number(text, 1, 1e6, &number))
        o->warm_up = (int)number;
    else if (!strcmp(name, "--seconds") && read_number(text, 0.1, 1e6, &number))
        o->seconds = number;
    else if (!strcmp(name, "--triangles") && read_number(text, 1, 1e8, &number))
        o->triangles = (int)number;
    else if (!strcmp(name, "--objects") && read_number(text, 1, 1e5, &number))
        o->objects = (int)number;
    else if (!strcmp(name, "--texels") && read_number(text, 1, LIMIT_SHADOW_RESOLUTION, &number))
        o->texels = (int)number;
    else
        return false;
    return true;
}

static bool read_options(struct bench_options *o, int count, char **arguments)
{
    for (int i = 0; i < count; i++) {
        const char *name = arguments[i];
        if (!strcmp(name, "--json"))
            o->is_json = true;
        else if (!strcmp(name, "--quick"))
            o->is_quick = true;
        else if (!strcmp(name, "--pictures"))
            o->saves_pictures = true;
        else if (i + 1 >= count || !read_valued(o, name, arguments[++i])) {
            fprintf(stderr, "vitrail-bench: cannot use '%s'\n%s", name, usage);
            return false;
        }
    }
    return true;
}

static json_t *protocol(const struct bench *bench)
{
    struct rounds rounds = rounds_begin(bench);
    return json_sprintf("%sinterleaved rounds, %d to %d of each case or %g s, after %d to warm up",
                        bench->options.is_quick ? "quick: " : "", rounds.least, rounds.most,
                        rounds.seconds, -rounds.done - 1);
}

/* What the device and the machine are, and how busy it was; when and by which protocol. */
static json_t *describe(const struct bench *bench, const double load[2])
{
    char date[32];
    time_t now = time(NULL);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", gmtime(&now));
    char processor[PROCESSOR_NAME_BYTES];
    const char *threads = getenv("LP_NUM_THREADS"), *no_cache = getenv("MESA_SHADER_CACHE_DISABLE");
    processor_get_name(processor);
    return json_pack("{s:s, s:o, s:s, s:s, s:b, s:s, s:i, s:s, s:s, s:f, s:f}", "date", date,
                     "protocol", protocol(bench), "device", bench->info.renderer, "version",
                     bench->info.version, "has_true_timers", bench->info.has_true_timers,
                     "processor", processor, "cores", (int)sysconf(_SC_NPROCESSORS_ONLN),
                     "LP_NUM_THREADS", threads ? threads : "unset", "MESA_SHADER_CACHE_DISABLE",
                     no_cache ? no_cache : "unset", "load_begin", load[0], "load_end", load[1]);
}

static void print_machine(const json_t *machine)
{
    const char *key;
    json_t *value;
    printf("\n");
    json_object_foreach((json_t *)(uintptr_t)machine, key, value)
    {
        char *text = json_dumps(value, JSON_ENCODE_ANY | JSON_REAL_PRECISION(3));
        printf("%s: %s\n", key, text);
        free(text);
    }
}

static double load_average(void)
{
    double load = NAN;
    return getloadavg(&load, 1) == 1 ? load : -1;
}

static bool run_suite(struct bench *bench, const struct suite *suite)
{
    struct error err = {0};
    bench->suite = suite->name;
    bench->table = NULL;
    if (!bench->options.is_json)
        printf("\n%s: %s\n", suite->name, suite->purpose);
    bool ok = suite->run(bench, &err);
    renderer_destroy(bench->renderer);
    bench->renderer = NULL;
    if (!ok)
        fprintf(stderr, "vitrail-bench: %s: %s\n", suite->name, err.message);
    return ok;
}

/* A daemon and its clients, each a process, which a script measures. Returns on failure only. */
static int run_script(char *script, int count, char **arguments)
{
    char folder[4096], **words = calloc((size_t)count + 4, sizeof *words);
    static char python[] = "python3";
    ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (words && length > 0) {
        folder[length] = '\0';
        *strrchr(folder, '/') = '\0';
        words[0] = python;
        words[1] = script;
        words[2] = folder;
        memcpy(words + 3, arguments, (size_t)count * sizeof *words);
        execvp(python, words);
    }
    perror("vitrail-bench: python3");
    free(words);
    return 1;
}

static int list_suites(void)
{
    for (int i = 0; i < SUITES; i++)
        printf("%-8s %s\n", suites[i].name, suites[i].purpose);
    printf("%-8s %s\n", "promises", "budgets and errors of frames over loopback; not one of `all`");
    printf("%-8s %s\n", "farm", "films as one job and as a process per frame; not one of `all`");
    printf("%-8s %s\n", "live", "views over loopback: latency, frames, memory; not one of `all`");
    return 0;
}

static int run_named(struct bench *bench, const char *name)
{
    double load[2] = {load_average(), 0};
    bool ok = true, is_known = false;
    for (int i = 0; ok && i < SUITES; i++) {
        bool is_of_all = suites[i].run != suite_scaling; /* that repeats the others' cases */
        if (strcmp(name, suites[i].name) != 0 && (strcmp(name, "all") != 0 || !is_of_all))
            continue;
        is_known = true;
        ok = run_suite(bench, &suites[i]);
    }
    if (!is_known) {
        fprintf(stderr, "vitrail-bench: no suite '%s'\n%s", name, usage);
        return 2;
    }
    load[1] = load_average();
    json_t *machine = describe(bench, load);
    if (bench->options.is_json) {
        json_t *document =
            json_pack("{s:o, s:O, s:O, s:O}", "machine", machine, "results", bench->results,
                      "checks", bench->checks, "series", bench->series);
        json_dumpf(document, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(6));
        printf("\n");
        json_decref(document);
    } else {
        print_machine(machine);
        json_decref(machine);
    }
    return ok ? 0 : 1;
}

int main(int argc, char **argv)
{
    struct bench bench = {0};
    if (argc < 2 || !strcmp(argv[1], "--help")) {
        fputs(usage, argc < 2 ? stderr : stdout);
        return argc < 2 ? 2 : 0;
    }
    if (!strcmp(argv[1], "list"))
        return list_suites();
    static char live[] = VITRAIL_SOURCE_DIR "/tests/bench/live.py";
    static char promises[] = VITRAIL_SOURCE_DIR "/tests/bench/promises.py";
    static char farm[] = VITRAIL_SOURCE_DIR "/tests/bench/farm.py";
    static const struct {
        const char *name;
        char *path;
    } scripts[] = {{"live", live}, {"promises", promises}, {"farm", farm}};
    for (size_t i = 0; i < sizeof scripts / sizeof scripts[0]; i++)
        if (!strcmp(argv[1], scripts[i].name))
            return run_script(scripts[i].path, argc - 2, argv + 2);
    if (!strcmp(argv[1], "generate"))
        return bench_generate(argc - 2, argv + 2);
    if (!read_options(&bench.options, argc - 2, argv + 2))
        return 2;
    bench.results = json_array();
    bench.checks = json_array();
    bench.series = json_array();
    int status = run_named(&bench, argv[1]);
    json_decref(bench.results);
    json_decref(bench.checks);
    json_decref(bench.series);
    return status;
}
