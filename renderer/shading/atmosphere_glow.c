/* SPDX-License-Identifier: MIT */
/* The squares around lamps, their passes and uniforms. */
#include "renderer/shading/atmosphere_glow.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>

#include "renderer/scene/haze_glow.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/lighting.h"
#include "renderer/shading/refraction.h"

#include "shaders/shared/bindings.h"

enum {
    DEFINES_BYTES = 256,
    REACH = 4, /* columns from a lamp: GLOW_FAR of shaders/shading/atmosphere_glow_add.comp.glsl */
    SIDE = 2 * REACH + 3,           /* of a square in columns, with those around its corners */
    PIXEL_BYTES = (4 + 3 * 16) * 4, /* shaders/shading/atmosphere_glow_store.glsl */
};

static const char sum_pass[] = "atmosphere.glow-sum", add_pass[] = "atmosphere.glow-add";
static const char technique[] = "ways", because[] = "lamps are seen in the atmosphere";

/* ---- the squares ---- */

struct square {
    uint32_t light;
    double place[2]; /* of the lamp in the image, in columns, y up */
    int first[2];    /* column of the image */
};

/* Those that have pixels in the window. */
struct squares {
    struct square of[HAZE_GLOWS_MOST];
    int count;
    struct atmosphere_grid grid; /* of the window */
    int side_px;                 /* of the pixels of a square */
};

static bool meets_window(const struct squares *squares, const struct square *square,
                         const struct camera_window *window)
{
    const int begin[2] = {window->x, window->image_height - window->y - window->height};
    const int size[2] = {window->width, window->height};
    for (int i = 0; i < 2; i++) {
        int first = (square->first[i] + 1) * squares->grid.side_px;
        if (first >= begin[i] + size[i] || first + squares->side_px <= begin[i])
            return false;
    }
    return true;
}

static struct squares find_squares(const struct window_frame *frame)
{
    struct squares squares = {.grid = atmosphere_grid_of(frame->view, &frame->window)};
    struct haze_glow glows[HAZE_GLOWS_MOST];
    int count = frame->has_glow ? haze_glows_find(frame->view, frame->state, frame->camera,
                                                  squares.grid.side_px, glows)
                                : 0;
    squares.side_px = (SIDE - 2) * squares.grid.side_px;
    for (int i = 0; i < count; i++) {
        struct square square = {.light = glows[i].light};
        for (int k = 0; k < 2; k++) {
            square.place[k] = glows[i].place[k] + frame->window.shift_px[k] / squares.grid.side_px;
            square.first[k] = (int)floor(glows[i].place[k]) - REACH - 1;
        }
        if (meets_window(&squares, &square, &frame->window))
            squares.of[squares.count++] = square;
    }
    return squares;
}

bool atmosphere_glow_is_there(const struct window_frame *frame)
{
    return frame->has_glow && find_squares(frame).count > 0;
}

/* ---- their storage ---- */

static uint64_t columns_of(int count)
{
    return (uint64_t)count * SIDE * SIDE;
}

static uint64_t ways_of(int count, int side_px)
{
    return (uint64_t)count * (uint64_t)side_px * (uint64_t)side_px;
}

static uint64_t slices_bytes(int count, int slices)
{
    return columns_of(count) * (uint64_t)slices * ATMOSPHERE_SLICE_BYTES;
}

static uint64_t sums_bytes(int count, int slices)
{
    return columns_of(count) * (uint64_t)slices * ATMOSPHERE_SUM_BYTES;
}

uint64_t atmosphere_glow_bytes(const struct view *view)
{
    const struct camera_window whole = camera_window_whole(view->width_px, view->height_px);
    const struct atmosphere_grid grid = atmosphere_grid_of(view, &whole);
    return slices_bytes(HAZE_GLOWS_MOST, grid.slices) + sums_bytes(HAZE_GLOWS_MOST, grid.slices) +
           ways_of(HAZE_GLOWS_MOST, (SIDE - 2) * grid.side_px) * PIXEL_BYTES;
}

bool atmosphere_glow_begin(const struct window_frame *frame, struct error *err)
{
    const struct squares squares = find_squares(frame);
    return targets_prepare_glow(frame->targets, slices_bytes(squares.count, squares.grid.slices),
                                sums_bytes(squares.count, squares.grid.slices),
                                ways_of(squares.count, squares.side_px) * PIXEL_BYTES, err);
}

/* ---- uniforms ---- */

/* The columns of all squares as one grid, over one another. */
static void set_grid(const struct squares *squares, const struct gl_program *program)
{
    const uint32_t size[3] = {SIDE, (uint32_t)(SIDE * squares->count),
                              (uint32_t)squares->grid.slices};
    gl_program_set_u3(program, "u_atmosphere_grid", size);
    gl_program_set_u2(program, "u_glow", SIDE, (uint32_t)squares->count);
    for (int i = 0; i < squares->count; i++) {
        const struct square *square = &squares->of[i];
        char name[48];
        snprintf(name, sizeof name, "u_glow_lamps[%d]", i);
        gl_program_set_f4(program, name,
                          (const float[4]){(float)square->first[0], (float)square->first[1],
                                           (float)square->light, 0});
    }
}

static void bind_ways(const struct window_frame *frame, const struct gl_program *program)
{
    const struct squares squares = find_squares(frame);
    const struct atmosphere_grid *grid = &squares.grid;
    atmosphere_bind_points(frame, program);
    window_bind_targets(frame, program);
    set_grid(&squares, program);
    gl_program_set_f4(program, "u_glow_grid",
                      (const float[4]){(float)grid->first_x, (float)grid->first_y,
                                       (float)grid->columns, (float)grid->rows});
    gl_buffer_bind_storage(&frame->targets->glow_slices, BIND_ATMOSPHERE);
    gl_buffer_bind_storage(&frame->targets->glow_ways, BIND_ATMOSPHERE_GLOW);
}

/* ---- the passes ---- */

static void describe_ways(const struct window_frame *frame, const struct surface_facts *facts,
                          char text[SURFACE_DEFINES_BYTES])
{
    (void)facts;
    snprintf(text, SURFACE_DEFINES_BYTES, " SAMPLES=%d", frame->targets->samples);
}

const struct surface_kind atmosphere_glow_ways = {
    .pass = "atmosphere.glow",
    .program = "atmosphere_glow.comp.glsl",
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_LAYERS,
    .describe = describe_ways,
    .bind = bind_ways,
};

struct surface_set atmosphere_glow_set(const struct window_frame *frame)
{
    const struct squares squares = find_squares(frame);
    return (struct surface_set){
        .kind = &atmosphere_glow_ways,
        .count = columns_of(squares.count) * (uint64_t)squares.grid.slices +
                 ways_of(squares.count, squares.side_px),
        .technique = technique,
        .because = "lamps are seen in the atmosphere",
    };
}

static void begin(const struct window_frame *frame, const char *pass)
{
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                              .because = because,
                                                              .technique = technique,
                                                              .stage = REPORT_SHADE});
}

bool atmosphere_glow_end(const struct window_frame *frame, struct error *err)
{
    const struct squares squares = find_squares(frame);
    const struct gl_program *program =
        program_cache_get(frame->programs, &atmosphere_sum_program, err);
    if (!program)
        return false;
    begin(frame, sum_pass);
    gl_program_use(program);
    set_grid(&squares, program);
    gl_buffer_bind_storage(&frame->targets->glow_slices, BIND_ATMOSPHERE);
    gl_buffer_bind_storage(&frame->targets->glow_sums, BIND_ATMOSPHERE_SUMS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items((uint64_t)(SIDE - 1) * (uint64_t)(SIDE * squares.count - 1));
    gpu_scope_end(frame->timeline);
    return true;
}

/* As the opaque samples are composited. */
static struct program_desc add_program(const struct window_frame *frame,
                                       const struct shade_facts *facts, char defines[DEFINES_BYTES])
{
    char media[MEDIA_DEFINES_BYTES] = "";
    if (facts->has_layers)
        lighting_media_defines(frame, facts, media);
    snprintf(defines, DEFINES_BYTES, "HAS_ATMOSPHERE HAS_ATMOSPHERE_LIGHT SAMPLES=%d%s%s%s%s%s",
             frame->targets->samples, frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "",
             facts->has_layers ? " LAYERS=" : "",
             facts->has_layers ? facts->method->compositing : "",
             facts->has_layers && refraction_is_possible(frame) ? " HAS_REFRACTION" : "", media);
    return (struct program_desc){.label = "atmosphere_glow_add.comp.glsl",
                                 .compute = "atmosphere_glow_add.comp.glsl",
                                 .defines = defines};
}

static void bind_picture(const struct shade_desc *desc, const struct gl_program *program)
{
    const struct window_frame *frame = desc->frame;
    const struct targets *targets = frame->targets;
    window_set_view_ray(frame, program);
    window_set_clip_planes(frame, 1, program);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    atmosphere_bind(frame, program);
    gl_program_set_f3(program, "u_atmosphere_ambient", (const float[3]){0, 0, 0});
    desc->layers->method->bind(desc->layers, program);
    draw_arena_bind_materials(frame->arena);
    if (targets->bent.name)
        glBindImageTexture(5, targets->levels.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    glBindImageTexture(0, targets->image.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    gl_texture_bind(&targets->glow_view, UNIT_ATMOSPHERE_SUMS);
    gl_buffer_bind_storage(&targets->glow_ways, BIND_ATMOSPHERE_GLOW);
}

/* Squares may meet in pixels, so that one comes after the other. */
static void add_square(const struct squares *squares, int i, const struct gl_program *program)
{
    const struct square *square = &squares->of[i];
    GLuint groups = (GLuint)(squares->side_px + 7) / 8;
    gl_program_set_u(program, "u_glow_lamp", (uint32_t)i);
    gl_program_set_f2(program, "u_glow_place",
                      (const float[2]){(float)square->place[0], (float)square->place[1]});
    gl_program_set_i2(program, "u_atmosphere_first", square->first[0], square->first[1] - i * SIDE);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                    GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
    glDispatchCompute(groups, groups, 1);
}

bool atmosphere_glow_add(const struct shade_desc *desc, struct error *err)
{
    const struct window_frame *frame = desc->frame;
    const struct squares squares = find_squares(frame);
    const struct shade_facts facts = shade_facts_of(desc);
    char defines[DEFINES_BYTES];
    const struct program_desc composed = add_program(frame, &facts, defines);
    if (!squares.count)
        return true;
    const struct gl_program *program = program_cache_get(frame->programs, &composed, err);
    if (!program)
        return false;
    begin(frame, add_pass);
    gl_program_use(program);
    bind_picture(desc, program);
    set_grid(&squares, program);
    for (int i = 0; i < squares.count; i++)
        add_square(&squares, i, program);
    gpu_scope_end(frame->timeline);
    return true;
}

void atmosphere_glow_list_programs(const struct window_frame *frame,
                                   const struct shade_facts *facts, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const struct program_desc add = add_program(frame, facts, defines);
    program_list_add(list, sum_pass, &atmosphere_sum_program, true);
    program_list_add(list, add_pass, &add, true);
}
