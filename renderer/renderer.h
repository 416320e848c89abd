/* SPDX-License-Identifier: MIT */
/* The renderer: owns one headless GPU context, the GPU side of the scene cache, and every
 * technique. Thread: all functions on the one thread that called renderer_create (the GL
 * thread); a thread has at most one at a time. */
#ifndef VITRAIL_RENDERER_RENDERER_H
#define VITRAIL_RENDERER_RENDERER_H

#include "protocol/error.h"
#include "renderer/base/device_choice.h"
#include "renderer/base/frame_progress.h"
#include "renderer/base/yield_point.h"
#include "renderer/environment/environment.h"
#include "renderer/frame_report.h"
#include "renderer/gl/program_list.h"
#include "renderer/gl/wide_floats.h"
#include "renderer/image/deep_image.h"
#include "renderer/image/image.h"
#include "renderer/plan/plan.h"
#include "renderer/raytrace/pick.h"
#include "renderer/scene/scene.h"
#include "renderer/view.h"

struct renderer;

/* When the device draws the scene of the self-test (renderer/frame/scene_selftest.h). */
enum renderer_selftest {
    RENDERER_SELFTEST_START, /* at the start, with deep shadow maps alone */
    /* Likewise, but not in software; and by every other structure before the first picture that
     * uses it; not again for a week where the file says that it was right. */
    RENDERER_SELFTEST_KEPT,
    RENDERER_SELFTEST_ALWAYS, /* by all structures, at the start */
};

/* What tests and benchmarks make of a device and of the renderer; all zero elsewhere. */
struct renderer_hooks {
    /* Pixels or layers of the first time slice of a shading pass that urgent frames may
     * preempt; 0 means TIME_SLICE_FIRST (renderer/window/time_slices.h). */
    uint32_t first_slice;
    bool defers_frames;     /* what renderer_submit may leave under way is never there before it is
                               waited for, as on the slowest device */
    bool poses_as_hardware; /* a software rasteriser goes the ways of other devices */
    bool hides_coverage;    /* as on a device without GL_ARB_post_depth_coverage */
    bool hides_multisampling;     /* as on a device whose targets have one sample per pixel */
    enum wide_floats wide_floats; /* how layers are added up; 0 means as is quicker here */
    bool redraws_surfaces; /* no G-buffer, per-pixel list or light list of an earlier frame is used
                              again */
    uint32_t loop_steps;   /* that one shader invocation may take; 0 means what the device allows
                              (loop_steps_most of renderer/shading/loop_steps.h) */
};

struct renderer_desc {
    /* Optional, borrowed during create: "" and "0" choose, else what gl_device_parse
     * (renderer/base/device_choice.h) takes. */
    const char *device;
    /* Optional, borrowed during create: those with a reason are not tried; on failure all that EGL
     * lists, and why none is taken. */
    struct gl_device_list *devices;
    const struct gl_device_watch *watch; /* optional, borrowed during create */
    /* Of all that grows with scenes and requests; 0 means what gl_memory_budget
     * (renderer/gl/memory_budget.h) says. */
    uint64_t gpu_budget_bytes;
    int gpu_sharers; /* processes that share the device, and what gl_memory_budget says; 0 means 1
                      */
    uint64_t texture_budget_bytes; /* of that, for resident levels of textures; 0 means half */
    /* Of levels written for a frame that may be coarse; 0 means 16 MiB. */
    uint64_t texture_upload_bytes;
    double texture_upload_ms; /* likewise, spent on them; 0 means 4 */
    /* Optional, borrowed during create: composed shaders are saved there. */
    const char *shader_dump_dir;
    const char *program_folder;    /* optional, borrowed during create: where compiled programs are
                                      kept from one start to the next, if the driver gives them */
    uint64_t program_budget_bytes; /* of that folder; 0 means 256 MiB */
    enum renderer_selftest self_test;
    const char *proof_file; /* optional, borrowed during create: where it is kept what the device
                               was seen to draw right; needs `build` */
    const char *build;      /* identifies this program; borrowed during create */
    bool learns_nothing;    /* from frames: what is known comes by renderer_set_learned alone */
    bool is_strict;         /* a GL error or undefined-behaviour message aborts */
    struct renderer_hooks hooks;
};

enum { RENDERER_DEVICES_TOLD = 8, RENDERER_TEXT_BYTES = 240 };

/* What the device is, as /v1/capabilities tells it. */
struct renderer_info {
    char vendor[128], renderer[128], version[128];
    char driver[64]; /* EGL platform in use: "surfaceless", "device" */
    int device_count;
    char devices[RENDERER_DEVICES_TOLD][RENDERER_TEXT_BYTES]; /* one line on each; "" ends them */
    uint32_t passed_over; /* set of bits: those of them that were tried and are not taken */
    char warning[RENDERER_TEXT_BYTES]; /* of software beside hardware; "": none */
    int max_texture_size;
    int max_samples; /* of targets of floats and of integers alike */
    uint64_t max_storage_block_bytes;
    bool has_true_timers; /* GPU timer queries agree with the wall clock (measured at start) */
    bool has_post_depth_coverage;
    bool is_robust;           /* context reports resets */
    bool compresses_textures; /* asked to, at whatever level, and able to */
    bool is_software;         /* the rasteriser runs on our own processors */
    struct wide_floats_choice wide_floats;
    /* Steps after which the device ends loops (renderer/gl/loop_probe.h); 0: never. */
    uint32_t loop_end;
    uint64_t programs_built, programs_reused;    /* since the start: compiled, and found compiled */
    uint64_t programs_loaded;                    /* taken from the program folder */
    uint64_t programs_kept, programs_kept_bytes; /* in that folder */
    int program_formats;               /* in which the driver gives programs; 0: it does not */
    uint64_t upload_bytes_per_ms;      /* levels of textures, as measured lately */
    const char *budget_source;         /* where the budget is from, a phrase; never freed */
    uint64_t budget_bytes, used_bytes; /* used is current at the time of the call */
};

/* Creates the context and runs the self-test (fragment side effects, compute, timers, a small scene
 * under many lights). Where no device was asked for, one that fails is passed over for the next.
 * ERROR_NO_DEVICE says which step failed and what was found; ERROR_INTERNAL, and nothing happens,
 * where the thread has a GL context: it would no longer be current, and its owner not know. */
struct renderer *renderer_create(const struct renderer_desc *desc, struct error *err);
void renderer_destroy(struct renderer *renderer);

/* What `shadows: auto` goes by from now on; until then it is rasterised. */
void renderer_set_auto(struct renderer *renderer, const struct auto_settings *settings);

/* What is known of what frames take, beside the device's speed: copied; NULL: nothing. */
void renderer_set_learned(struct renderer *renderer, const struct learning *learned);
/* Valid until the next frame. print: other after each change; 0 while nothing was learned. */
const struct learning *renderer_get_learned(const struct renderer *renderer, uint64_t *print);

/* Colours of textures are compressed where their budget would withhold so many levels else: 1 or
 * more; 0: never. Without effect where the device samples no blocks. */
void renderer_set_texture_compression(struct renderer *renderer, uint32_t from_levels);
bool renderer_samples_blocks(const struct renderer *renderer);

void renderer_get_info(const struct renderer *renderer, struct renderer_info *info);

/* A scene on the GPU. Textures beyond the budget of textures are brought as frames need them. `key`
 * (64 hex digits) identifies the content: attaching a key that is already
 * resident is free and ignores `scene`. The scene's memory must stay valid until it is detached or
 * evicted; `release(context)` is called once when the renderer needs it no longer. Evicts least
 * recently used scenes above the budget. */
struct renderer_scene_desc {
    const char *key;           /* required */
    const struct scene *scene; /* required; copied by value, its blob is borrowed */
    void (*release)(void *context);
    void *context;
    const char *const *keep; /* keys that this call does not evict, its own among them; */
    size_t keep_count;       /* 0: its own alone */
};
MUST_CHECK bool renderer_attach_scene(struct renderer *renderer,
                                      const struct renderer_scene_desc *desc, struct error *err);
bool renderer_has_scene(const struct renderer *renderer, const char *key);
void renderer_detach_scene(struct renderer *renderer, const char *key); /* no-op when absent */

/* A map of light for views that name its key (struct view); VIEW_STUDIO_KEY is there without. `key`
 * (at most 64 bytes) identifies the content: attaching one that is there is free. The map must stay
 * valid until it is detached, or released for being the least recently used of more than
 * RENDERER_ENVIRONMENTS_MAX; `release(context)` is called once then. What it takes on the device is
 * of the budget, and leaves it for others where no frame shows it. Between frames. */
enum { RENDERER_ENVIRONMENTS_MAX = 8 };
struct renderer_environment_desc {
    const char *key;                       /* required */
    const struct environment *environment; /* required; borrowed until its release */
    void (*release)(void *context);        /* optional */
    void *context;
};
/* ERROR_INVALID_REQUEST: the key is empty or too long; nothing is released then. */
MUST_CHECK bool renderer_attach_environment(struct renderer *renderer,
                                            const struct renderer_environment_desc *desc,
                                            struct error *err);
bool renderer_has_environment(const struct renderer *renderer, const char *key);
void renderer_detach_environment(struct renderer *renderer, const char *key); /* absent: no-op */

/* Drops what was kept between frames of the scene, so that the next one builds all of its shadow
 * structures and surfaces anew: for measuring. No-op when absent. */
void renderer_drop_structures(struct renderer *renderer, const char *key);

/* Frees the shadow structures that the last rasterised frame did not use; for an idle server.
 * Between frames. */
void renderer_trim(struct renderer *renderer);

/* While nobody asks: draws the view by the technique that may be faster than the one `auto` takes
 * and of which little is known, some frames that nobody sees, to learn what they take. Each
 * technique of a view once. No picture changes but by what is published (renderer_get_learned).
 * Without effect where `auto` measures nothing. Between frames. */
struct runner_up_desc {
    bool (*shall_stop)(void *context); /* required; any thread, often: ends it between two passes,
                                          or time slices of one */
    void *context;
};
enum runner_up_outcome { RUNNER_UP_NONE, RUNNER_UP_TIMED, RUNNER_UP_STOPPED };
enum runner_up_outcome renderer_time_runner_up(struct renderer *renderer, const char *scene_key,
                                               const struct view *view,
                                               const struct runner_up_desc *desc);

/* One finished frame: an image per requested output. Zeroed = empty. */
struct frame {
    struct image outputs[VIEW_OUTPUT_COUNT]; /* empty where not requested */
    struct deep_image deep;                  /* likewise */
    struct frame_report report;
};
void frame_finish(struct frame *frame);

/* The scene as such a view has it, parts included: for the names of what a pick found. Valid until
 * the next call that attaches, detaches or composes. NULL with err. */
const struct scene *renderer_get_scene(struct renderer *renderer, const char *scene_key,
                                       const struct view *view, struct error *err);

/* What `shadows: auto` of the view becomes, by forecasts and by what earlier frames took
 * (renderer/cost/auto_technique.h). Draws nothing. Frames choose nothing themselves: the caller
 * puts the choice into view->choice. Not open where the view leaves nothing to choose. */
MUST_CHECK bool renderer_choose(struct renderer *renderer, const char *scene_key,
                                const struct view *view, struct auto_choice *choice,
                                struct error *err);

/* Renders synchronously. The scenes of view->parts must be attached, too, and its environment, else
 * ERROR_NOT_FOUND. On failure the frame is
 * empty and the renderer stays usable unless the code is ERROR_NO_DEVICE (context lost: destroy and
 * create anew). ERROR_UNSUPPORTED also where the device failed the self-test of what the frame is
 * made of. */
MUST_CHECK bool renderer_render(struct renderer *renderer, const char *scene_key,
                                const struct view *view, struct frame *frame, struct error *err);

/* The exposure of the view (renderer/image/exposure.h), which has to do with what is seen alone:
 * not with the picture's size, samples, background, overlays and operator. Draws a small picture of
 * the same shape by the view's technique, unless the same one was metered lately. Waits for the
 * device. Fails as renderer_render does. */
struct exposure_reading {
    float ev;  /* 0 where nothing has light */
    double ms; /* that it took, without pauses */
    double paused_ms;
    bool is_kept; /* nothing was drawn */
};
MUST_CHECK bool renderer_meter(struct renderer *renderer, const char *scene_key,
                               const struct view *view, struct exposure_reading *reading,
                               struct error *err);

/* renderer_render in two halves: the first ends when the device has got all its work, so that the
 * next frame can be begun meanwhile, with the same bits. *is_done: the frame is finished, and
 * nothing is left to collect, as where the device works while it is asked, with auxiliary outputs,
 * overlays and rays, and for an urgent frame within another. Else `frame`, the view and what the
 * view borrows are the renderer's until renderer_collect; its scenes are not. One frame is in
 * flight at a time: the next one collects it through the arrival (below), or is finished at once
 * itself. Failures as those of renderer_render. */
MUST_CHECK bool renderer_submit(struct renderer *renderer, const char *scene_key,
                                const struct view *view, struct frame *frame, bool *is_done,
                                struct error *err);
/* Waits at most so long for the frame in flight. True: it is complete, or there is none. */
bool renderer_wait(struct renderer *renderer, int timeout_ms);
/* Ends the frame in flight, of which there must be one, and waits for it if it is not complete. */
MUST_CHECK bool renderer_collect(struct renderer *renderer, struct error *err);

/* Called while a later frame is submitted: between two of its steps once the one in flight is
 * there, and before the device is waited for on other grounds. It must call renderer_collect and
 * nothing else of this header. Borrowed; NULL: none. */
struct frame_completion {
    void *context;
    void (*collect)(void *context); /* required */
};
void renderer_set_completion(struct renderer *renderer, const struct frame_completion *completion);

/* From now on frames make way for urgent ones, and go on with the same bits (but those of
 * deep-linked with `faithful`, which has no bits of its own): at most where a tile of rays is done,
 * a time slice of a shading pass, a pass of a window, some shadow structures, a window. Meanwhile
 * `run_urgent` may render, explain and pick, on scenes that are attached already, and nothing else;
 * such frames are made in one piece. A frame that is not wanted any more fails with
 * ERROR_OVERLOADED, or with ERROR_TIMEOUT where its rays were ended. Borrowed; NULL: none. */
void renderer_set_yield_point(struct renderer *renderer, const struct yield_point *yield);

/* From now on frames tell how far they are, but for urgent ones within another. Borrowed; NULL:
 * none. */
void renderer_set_progress(struct renderer *renderer, const struct frame_progress *progress);

/* What is at a point of the view's image, or in a rectangle of it (renderer/raytrace/pick.h).
 * Renders nothing; keeps the ray tracer's structure for the next call. */
MUST_CHECK bool renderer_pick(struct renderer *renderer, const char *scene_key,
                              const struct view *view, const struct pick_desc *desc,
                              struct pick_result *result, struct error *err);

/* What such a frame requires and the passes that follow, without drawing anything. The plan is that
 * of a frame that finds nothing kept from before. */
MUST_CHECK bool renderer_explain(struct renderer *renderer, const char *scene_key,
                                 const struct view *view, struct plan *plan, struct error *err);

/* Builds what frames of such a view keep for those after them, its shadow structures or the ray
 * tracer's scene, and draws no picture: the surfaces that are kept stay. frame: empty but for the
 * report, which says what was built. A yield point may end it as it ends a frame. Not while a
 * frame is paused. */
MUST_CHECK bool renderer_build(struct renderer *renderer, const char *scene_key,
                               const struct view *view, struct frame *frame, struct error *err);

/* Compiles the programs that frames of such a view may need, wherever their camera is and whatever
 * their size. Where `shadows` is auto, whatever view->choice is: those of maps, where the device
 * was measured also those of traced shadows, first what it takes for this view; none where every
 * picture is ray traced. Not while a frame is paused. Clip planes, outputs, samples and the form of
 * the camera are those of the view. *is_complete: false where it stopped before the last; a call
 * compiles at least one, so repeated ones come to an end.
 */
struct renderer_warm_up_desc {
    bool (*shall_stop)(void *context); /* required; asked between programs */
    void *context;
};
MUST_CHECK bool renderer_warm_up(struct renderer *renderer, const char *scene_key,
                                 const struct view *view, const struct renderer_warm_up_desc *desc,
                                 bool *is_complete, struct error *err);

/* The shader programs that such a frame needs or may need (renderer/frame/frame_programs.h), and
 * which of them stand already; nothing is compiled or drawn. list: empty, finished by the caller.
 */
MUST_CHECK bool renderer_list_programs(struct renderer *renderer, const char *scene_key,
                                       const struct view *view, struct program_list *list,
                                       struct error *err);

#endif
