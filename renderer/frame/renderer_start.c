/* SPDX-License-Identifier: MIT */
/* The renderer's start: a device that draws what it must, what is chosen for it, and what frames
 * hold. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_observations.h"
#include "renderer/frame/proof_file.h"
#include "renderer/frame/proofs.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/frame/scene_selftest.h"
#include "renderer/gl/loop_probe.h"
#include "renderer/gl/memory_budget.h"
#include "renderer/gl/selftest.h"
#include "renderer/window/time_slices.h"

static const uint64_t selftest_budget_bytes = 4ull << 30;
static const uint64_t default_program_bytes = 256ull << 20;

/* ---- parts ---- */

static struct texture_pool *create_textures(const struct renderer_desc *desc,
                                            uint64_t gpu_budget_bytes, bool is_software,
                                            struct error *err)
{
    return texture_pool_create(
        &(struct texture_pool_desc){.budget_bytes = desc->texture_budget_bytes
                                                        ? desc->texture_budget_bytes
                                                        : gpu_budget_bytes / 2,
                                    .upload_bytes = desc->texture_upload_bytes,
                                    .upload_ms = desc->texture_upload_ms,
                                    .waits = is_software},
        err);
}

/* After the self-test: a device that is refused leaves nothing there, and none of its files is
 * tried. Without a folder that can be used, programs are compiled at every start. */
static void keep_programs(struct renderer *renderer, const struct renderer_desc *desc)
{
    const struct gl_limits *limits = gl_context_limits(renderer->gl);
    struct error problem = {0};
    char driver[512];
    if (!desc->program_folder || limits->program_formats <= 0)
        return;
    snprintf(driver, sizeof driver, "%s|%s|%s|%s|%d", limits->vendor, limits->renderer,
             limits->version, limits->platform, limits->is_robust);
    renderer->program_store = program_store_open(
        &(struct program_store_desc){.folder = desc->program_folder,
                                     .driver = driver,
                                     .budget_bytes = desc->program_budget_bytes
                                                         ? desc->program_budget_bytes
                                                         : default_program_bytes},
        &problem);
    if (renderer->program_store)
        program_cache_set_store(renderer->programs, renderer->program_store, NULL);
    else
        fprintf(stderr, "<4>%s\n", problem.message);
}

/* All but context and programs: of a renderer that may hold so much. */
static bool create_parts(struct renderer *renderer, const struct renderer_desc *desc,
                         uint64_t budget_bytes, struct error *err)
{
    renderer->current = &renderer->frames;
    renderer->budget_bytes = budget_bytes;
    renderer->shadow_most_bytes = budget_bytes / 2;
    renderer->frames.shade.first_slice =
        desc->hooks.first_slice ? desc->hooks.first_slice : TIME_SLICE_FIRST;
    renderer->frames.shade.loop_steps =
        desc->hooks.loop_steps ? desc->hooks.loop_steps : loop_steps_most(renderer->loop_end);
    renderer->scenes.textures =
        create_textures(desc, budget_bytes, gl_context_limits(renderer->gl)->is_software, err);
    renderer->timeline = gpu_timeline_create(renderer->gl, err);
    renderer->readback = readback_create(desc->hooks.defers_frames, err);
    if (!renderer->scenes.textures || !renderer->timeline || !renderer->readback ||
        !frame_context_init(&renderer->frames, renderer, false, err))
        return false;
    frame_in_flight_init(renderer);
    renderer->shadows = shadow_system_create(
        &(struct shadow_system_desc){
            .programs = renderer->programs,
            .timeline = renderer->timeline,
            .limits = gl_context_limits(renderer->gl),
            .budget_bytes = renderer->shadow_most_bytes,
            .reserve = frame_budget_reserve,
            .context = renderer,
        },
        err);
    renderer->traced = raytrace_cache_create(err);
    renderer->observations = frame_observations_create(desc->learns_nothing);
    return renderer->shadows && renderer->traced &&
           (renderer->observations || error_set(err, ERROR_NO_MEMORY, "forecasts"));
}

/* ---- the device ---- */

static uint64_t choose_budget(struct renderer *renderer, const struct renderer_desc *desc)
{
    struct gl_memory memory;
    renderer->budget_source = "as asked for";
    if (desc->gpu_budget_bytes)
        return desc->gpu_budget_bytes;
    /* llvmpipe 25.0 answers questions about its card, of which it has none, by chance */
    gl_memory_read(gl_context_limits(renderer->gl)->is_software || desc->hooks.poses_as_hardware,
                   &memory);
    return gl_memory_budget(&memory, &renderer->budget_source) /
           (uint64_t)(desc->gpu_sharers > 1 ? desc->gpu_sharers : 1);
}

/* How layers are added up, and how a pixel's samples walk them. The form that a start measured is
 * kept with the proof: where both take about as long, the next start would decide by chance. */
static bool choose_arithmetic(struct renderer *renderer, const struct renderer_desc *desc,
                              const struct wide_floats_choice *kept, struct error *err)
{
    char defines[DEVICE_DEFINES_BYTES];
    const bool is_kept = desc->hooks.wide_floats == WIDE_FLOATS_MEASURED && kept->form;
    const struct gl_limits *limits = gl_context_limits(renderer->gl);
    bool in_turn = samples_take_turns(limits);
    const struct wide_floats_desc wide = {.programs = renderer->programs,
                                          .asked = is_kept ? kept->form : desc->hooks.wide_floats,
                                          .is_software =
                                              limits->is_software || desc->hooks.poses_as_hardware};
    if (!wide_floats_choose(&wide, &renderer->wide_floats, err))
        return false;
    if (is_kept)
        renderer->wide_floats.pairs_over_f64 = kept->pairs_over_f64;
    const char *form = wide_floats_defines(renderer->wide_floats.form);
    snprintf(defines, sizeof defines, "%s%s%s", form, *form && in_turn ? " " : "",
             in_turn ? "SAMPLES_IN_TURN" : "");
    program_cache_set_device_defines(renderer->programs, defines);
    return true;
}

/* ---- the self-test ---- */

/* Tests structures with a renderer of its own, so that nothing is left in those that serve. */
static bool test_structures(void *context, uint32_t structures, bool *is_wrong, struct error *err)
{
    const struct renderer *renderer = context;
    const struct renderer_desc defaults = {.hooks.loop_steps = renderer->frames.shade.loop_steps};
    struct renderer *tested = calloc(1, sizeof *tested);
    struct error loss = {0};
    *is_wrong = false;
    if (!tested)
        return error_set(err, ERROR_NO_MEMORY, "renderer");
    *tested = (struct renderer){
        .gl = renderer->gl,
        .programs = renderer->programs,
        .is_strict = renderer->is_strict,
        .loop_end = renderer->loop_end,
        .wide_floats = renderer->wide_floats,
    };
    bool ok = create_parts(tested, &defaults, selftest_budget_bytes, err) &&
              scene_selftest(tested, structures, err);
    renderer_finish_parts(tested);
    free(tested);
    if (ok)
        return true;
    *is_wrong =
        gl_context_check(renderer->gl, "testing the device", &loss) && err->code == ERROR_NO_DEVICE;
    if (loss.code == ERROR_NO_DEVICE)
        *err = loss;
    return false;
}

/* Variables of the environment that control drivers; options of Mesa's drirc have
 * names in lower case. */
static bool controls_driver(const char *entry)
{
    static const char *const prefixes[] = {"MESA",   "LIBGL", "GALLIUM",  "LP_",     "ST_",
                                           "NIR_",   "TGSI_", "SOFTPIPE", "INTEL_",  "AMD_",
                                           "RADEON", "R600_", "RADV_",    "NOUVEAU", "ZINK_",
                                           "VK_",    "EGL_",  "__GL",     "__EGL"};
    if (*entry >= 'a' && *entry <= 'z')
        return true;
    for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++)
        if (!strncmp(entry, prefixes[i], strlen(prefixes[i])))
            return true;
    return false;
}

/* All that pictures of the self-test may depend on, but for the form of sums, which the proof has.
 * The kernel has a part of the driver. */
static struct content_key proof_key(const struct renderer *renderer,
                                    const struct renderer_desc *desc)
{
    struct content_key key = content_key_begin();
    const struct gl_device_list *list = gl_context_devices(renderer->gl);
    struct utsname system;
    content_key_add_text(&key, desc->build);
    struct gl_limits limits = *gl_context_limits(renderer->gl);
    limits.has_true_timers = false; /* found anew at each start, busy or not, and of no picture */
    content_key_add(&key, &limits, sizeof limits);
    for (int i = 0; i < list->count; i++)
        if (list->items[i].is_taken) {
            content_key_add_word(&key, (uint64_t)list->items[i].number);
            content_key_add_text(&key, list->items[i].node);
            content_key_add_text(&key, list->items[i].pci);
        }
    content_key_add_word(&key, desc->hooks.wide_floats);
    content_key_add_word(&key, renderer->loop_end);
    if (uname(&system) == 0) {
        content_key_add_text(&key, system.release);
        content_key_add_text(&key, system.version);
    }
    for (char **entry = environ; *entry; entry++)
        if (controls_driver(*entry))
            content_key_add_text(&key, *entry);
    return key;
}

/* The trials that a start waits for. Software is the last device to be tried, so it gains nothing
 * by a test at the start: the first picture can wait for it. */
static uint32_t proven_at_start(const struct renderer *renderer, const struct renderer_desc *desc)
{
    if (desc->self_test == RENDERER_SELFTEST_ALWAYS)
        return scene_selftest_all();
    bool is_last = gl_context_limits(renderer->gl)->is_software;
    return desc->self_test == RENDERER_SELFTEST_KEPT && is_last ? 0 : SELFTEST_START;
}

static const char *proof_path(const struct renderer_desc *desc)
{
    return desc->build ? desc->proof_file : NULL;
}

/* Zeroed: there is none, or none is wanted. */
static struct proof load_proof(const struct renderer_desc *desc, struct content_key key)
{
    struct proof proof = {0};
    if (proof_path(desc) && desc->self_test != RENDERER_SELFTEST_ALWAYS)
        (void)!proof_file_load(proof_path(desc), key, (int64_t)time(NULL), &proof);
    return proof;
}

static bool prove(struct renderer *renderer, const struct renderer_desc *desc,
                  struct content_key key, const struct proof *proof, struct error *err)
{
    renderer->proofs =
        proofs_create(&(struct proofs_desc){.policy = desc->self_test,
                                            .at_start = proven_at_start(renderer, desc),
                                            .path = proof_path(desc),
                                            .key = key,
                                            .proof = *proof,
                                            .test = test_structures,
                                            .context = renderer},
                      err);
    return renderer->proofs;
}

/* ---- the start ---- */

static bool test_device(struct renderer *renderer, const struct renderer_desc *desc,
                        struct error *err)
{
    if (!gl_selftest(renderer->gl, renderer->programs, err))
        return false;
    keep_programs(renderer, desc);
    if (!loop_probe_run(renderer->programs, LOOP_STEPS_WATCHDOG, &renderer->loop_end, err))
        return false;
    const struct content_key key = proof_key(renderer, desc);
    struct proof proof = load_proof(desc, key);
    if (!choose_arithmetic(renderer, desc, &proof.wide_floats, err))
        return false;
    proof.wide_floats = renderer->wide_floats;
    return prove(renderer, desc, key, &proof, err);
}

/* Starts on the first device that has no reason on the list. *is_its_fault: a device was opened,
 * but failed a test, and has a reason now. */
static struct renderer *start(const struct renderer_desc *desc, struct gl_device_list *devices,
                              bool *is_its_fault, struct error *err)
{
    struct renderer *renderer = calloc(1, sizeof *renderer);
    *is_its_fault = false;
    if (!renderer) {
        error_set(err, ERROR_NO_MEMORY, "renderer");
        return NULL;
    }
    renderer->is_strict = desc->is_strict;
    renderer->redraws_surfaces = desc->hooks.redraws_surfaces;
    renderer->gl = gl_context_create(
        &(struct gl_context_desc){.device = desc->device,
                                  .is_strict = desc->is_strict,
                                  .hides_coverage = desc->hooks.hides_coverage,
                                  .hides_multisampling = desc->hooks.hides_multisampling,
                                  .poses_as_hardware = desc->hooks.poses_as_hardware,
                                  .devices = devices,
                                  .watch = desc->watch},
        err);
    if (!renderer->gl)
        goto fail;
    renderer->programs = program_cache_create(desc->shader_dump_dir, err);
    if (!renderer->programs)
        goto fail;
    gl_context_tell(renderer->gl, desc->watch, GL_DEVICE_TESTING);
    if (!test_device(renderer, desc, err)) {
        gl_context_blame(renderer->gl, "starting", err);
        *is_its_fault = gl_context_pass_over(renderer->gl, err->message, devices);
        goto fail;
    }
    if (create_parts(renderer, desc, choose_budget(renderer, desc), err))
        return renderer;
    gl_context_blame(renderer->gl, "starting", err);

fail:
    renderer_destroy(renderer);
    return NULL;
}

/* A device that fails the self-test is passed over as one that cannot be opened; one that was asked
 * for has no other. */
struct renderer *renderer_create(const struct renderer_desc *desc, struct error *err)
{
    struct gl_device_list devices = {0};
    if (desc->devices)
        devices = *desc->devices;
    for (;;) {
        struct error problem = {0};
        bool is_its_fault;
        struct renderer *renderer = start(desc, &devices, &is_its_fault, &problem);
        if (renderer)
            return renderer;
        if (!is_its_fault) {
            if (desc->devices)
                *desc->devices = devices;
            error_pass(err, &problem);
            return NULL;
        }
        fprintf(stderr, "<4>a device is passed over: %s\n", problem.message);
    }
}
