/* SPDX-License-Identifier: MIT */
/* What every pass over one window of one frame needs to know. Borrowed pointers, lives on the stack
 * of the frame. */
#ifndef VITRAIL_RENDERER_WINDOW_WINDOW_H
#define VITRAIL_RENDERER_WINDOW_WINDOW_H

#include "renderer/draw/scene_gpu.h"
#include "renderer/draw/shader_needs.h"
#include "renderer/frame_report.h"
#include "renderer/gl/context.h"
#include "renderer/gl/program.h"
#include "renderer/gl/program_list.h"
#include "renderer/gl/scope.h"
#include "renderer/scene/camera.h"
#include "renderer/window/targets.h"

struct environment_light;
struct environment_maps;
struct smoke;

/* Pixels of a window, y up; width 0: all. */
struct window_bounds {
    int x, y, width, height;
};

struct window_frame {
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    const struct gl_limits *limits;
    const struct view *view;
    const struct scene_state *state;
    const struct scene_gpu *gpu;
    struct draw_arena *arena;
    const struct camera *camera;
    struct camera_window window;
    const struct shader_needs *needs; /* of the state */
    struct targets *targets;
    struct frame_report *report;
    float sample_positions[4][2]; /* in the pixel, y up */
    bool has_glow;     /* lamps may be seen in haze (renderer/shading/atmosphere_glow.h) */
    int rounds, round; /* of samples, of the colour; of the one at hand the window has the shift */
    const struct environment_light *environment; /* where the view has a map; likewise */
    const struct environment_maps *environment_maps;
    struct smoke *smoke; /* where the state has density grids */
    struct {
        uint64_t most_bytes; /* that depths of grids may take (renderer/shading/smoke_depths.h) */
        bool is_anywhere;    /* the camera may be anywhere: for lists of programs */
    } depths;
    uint32_t list_room;                /* entries that lists_scatter.glsl may write */
    uint32_t object_rank;              /* of the object at hand, for sorted_scatter.frag.glsl */
    struct window_bounds layer_bounds; /* transparent surfaces are drawn nowhere else */
};

/* What of a window is in the image of the frame's tile: where it begins in the window and in the
 * image, first rows on top, and how large it is; nothing with width or height <= 0. */
struct window_share {
    int window_x, window_y, image_x, image_y, width, height;
};
struct window_share window_share_of(const struct camera_window *window, const struct view *view);

/* Window and depth uniforms of shaders/window/view_ray.glsl. */
void window_set_view_ray(const struct window_frame *frame, const struct gl_program *program);

/* The view's clip planes as u_clip_planes, for positions in view space in units of unit_m. */
void window_set_clip_planes(const struct window_frame *frame, double unit_m,
                            const struct gl_program *program);

/* The world's axes in view space, as u_world_x, u_world_y, u_world_z. */
void window_set_world_axes(const struct window_frame *frame, const struct gl_program *program);

/* Where the samples are in a pixel, as u_sample_positions. */
void window_set_samples(const struct window_frame *frame, const struct gl_program *program);

/* Surfaces and depth of the window's targets on their units, and u_size_px. */
void window_bind_targets(const struct window_frame *frame, const struct gl_program *program);

/* Zeroes the first bytes of a buffer of this frame: by GL in software, by a dispatch elsewhere
 * (renderer/gl/buffer_fill.h), whose program window_list_clear lists. */
MUST_CHECK bool window_clear(const struct window_frame *frame, struct gl_buffer *buffer,
                             uint64_t bytes, struct error *err);
void window_list_clear(const struct window_frame *frame, const char *pass,
                       struct program_list *list);

/* Runs one compute thread per item in groups of 64, over two dimensions where one is too short. */
void window_dispatch_items(uint64_t count);
/* Runs a compute thread per pixel of the window, or of so many rows, in groups of 8 x 8. */
void window_dispatch_pixels(const struct window_frame *frame);
void window_dispatch_rows(const struct window_frame *frame, int rows);

#endif
