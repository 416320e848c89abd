/* SPDX-License-Identifier: MIT */
/* Uniforms and dispatch sizes shared by the passes over a window. */
#include "renderer/window/window.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/base/matrix.h"
#include "renderer/gl/buffer_fill.h"
#include "shaders/shared/bindings.h"

static int least(int a, int b)
{
    return a < b ? a : b;
}

static int most(int a, int b)
{
    return a > b ? a : b;
}

struct window_share window_share_of(const struct camera_window *window, const struct view *view)
{
    const struct view_tile tile = view_tile_of(view);
    int x = most(window->x, tile.x_px), y = most(window->y, tile.y_px);
    return (struct window_share){
        .window_x = x - window->x,
        .window_y = y - window->y,
        .image_x = x - tile.x_px,
        .image_y = y - tile.y_px,
        .width = least(window->x + window->width, tile.x_px + tile.width_px) - x,
        .height = least(window->y + window->height, tile.y_px + tile.height_px) - y};
}

void window_set_view_ray(const struct window_frame *frame, const struct gl_program *program)
{
    const struct camera *camera = frame->camera;
    const struct camera_window *w = &frame->window;
    double step_x = 2 * camera->half_width / w->image_width;
    double step_y = 2 * camera->half_height / w->image_height;
    gl_program_set_f4(program, "u_window",
                      (const float[4]){(float)(-camera->half_width - w->shift_px[0] * step_x),
                                       (float)(-camera->half_height - w->shift_px[1] * step_y),
                                       (float)step_x, (float)step_y});
    gl_program_set_u2(program, "u_window_first", (uint32_t)w->x,
                      (uint32_t)(w->image_height - w->y - w->height));
    gl_program_set_f3(program, "u_depth",
                      (const float[3]){(float)camera->z_near, (float)camera->z_far,
                                       (float)(camera->z_far - camera->z_near)});
}

void window_set_clip_planes(const struct window_frame *frame, double unit_m,
                            const struct gl_program *program)
{
    double axes[3][3];
    camera_axes(frame->camera, axes);
    for (size_t i = 0; i < frame->view->clip_plane_count; i++) {
        const double *plane = frame->view->clip_planes[i];
        char name[48];
        snprintf(name, sizeof name, "u_clip_planes[%zu]", i);
        double offset = plane[3] + vec3_dot(plane, frame->camera->eye);
        gl_program_set_f4(
            program, name,
            (const float[4]){(float)vec3_dot(axes[0], plane), (float)vec3_dot(axes[1], plane),
                             (float)vec3_dot(axes[2], plane), (float)(offset / unit_m)});
    }
}

void window_set_world_axes(const struct window_frame *frame, const struct gl_program *program)
{
    static const char *const names[] = {"u_world_x", "u_world_y", "u_world_z"};
    double axes[3][3];
    camera_axes(frame->camera, axes);
    for (int k = 0; k < 3; k++)
        gl_program_set_f3(
            program, names[k],
            (const float[3]){(float)axes[0][k], (float)axes[1][k], (float)axes[2][k]});
}

void window_set_samples(const struct window_frame *frame, const struct gl_program *program)
{
    for (int i = 0; i < frame->targets->samples; i++) {
        char name[32];
        snprintf(name, sizeof name, "u_sample_positions[%d]", i);
        gl_program_set_f2(program, name, frame->sample_positions[i]);
    }
}

void window_bind_targets(const struct window_frame *frame, const struct gl_program *program)
{
    gl_texture_bind(&frame->targets->surface_0, UNIT_GBUFFER_0);
    gl_texture_bind(&frame->targets->surface_1, UNIT_GBUFFER_1);
    gl_texture_bind(&frame->targets->depth, UNIT_GBUFFER_DEPTH);
    if (frame->targets->lobes[0].name)
        gl_texture_bind(&frame->targets->lobes[0], UNIT_GBUFFER_LOBES);
    if (frame->targets->lobes[1].name) {
        gl_texture_bind(&frame->targets->lobes[1], UNIT_GBUFFER_MORE_LOBES);
        glBindSampler(UNIT_GBUFFER_MORE_LOBES, 0);
    }
    if (frame->targets->samples > 1)
        gl_texture_bind(&frame->targets->signature, UNIT_GBUFFER_SIGNATURE);
    for (GLuint unit = UNIT_GBUFFER_LOBES; unit <= UNIT_GBUFFER_DEPTH; unit++)
        glBindSampler(unit, 0);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
}

bool window_clear(const struct window_frame *frame, struct gl_buffer *buffer, uint64_t bytes,
                  struct error *err)
{
    return buffer_fill_u32(&(struct buffer_fill_desc){.programs = frame->programs,
                                                      .limits = frame->limits,
                                                      .buffer = buffer,
                                                      .size_bytes = bytes,
                                                      .by_gl = frame->limits->is_software},
                           err);
}

void window_list_clear(const struct window_frame *frame, const char *pass,
                       struct program_list *list)
{
    if (!frame->limits->is_software)
        buffer_fill_list_programs(pass, list);
}

void window_dispatch_items(uint64_t count)
{
    const uint64_t row = 32768; /* groups; the limit per dimension is at least 65,535 */
    uint64_t groups = (count + 63) / 64;
    if (!groups)
        return;
    uint64_t rows = (groups + row - 1) / row;
    glDispatchCompute((GLuint)(rows > 1 ? row : groups), (GLuint)rows, 1);
}

void window_dispatch_rows(const struct window_frame *frame, int rows)
{
    glDispatchCompute((GLuint)(frame->window.width + 7) / 8, (GLuint)(rows + 7) / 8, 1);
}

void window_dispatch_pixels(const struct window_frame *frame)
{
    window_dispatch_rows(frame, frame->window.height);
}
