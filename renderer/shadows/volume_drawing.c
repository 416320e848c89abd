/* SPDX-License-Identifier: MIT */
/* Faces of shadow volumes, drawn by the device: blended in their order, or counted. */
#include "renderer/shadows/volume_drawing.h"

#include <epoxy/gl.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"

enum {
    FACE_CORNERS = 6,
    /* llvmpipe loses faces of a draw whose patches become more vertices than 16 bits number; an
     * edge's has 128 */
    PATCHES_AT_ONCE = 512,
};

bool volume_form_is_drawn(enum volume_form form)
{
    return form == VOLUME_LOGS || form == VOLUME_PRODUCTS;
}

static bool init_map(struct gl_texture *map, const char *label, int width, int height,
                     struct error *err)
{
    return gl_texture_init(
        map,
        &(struct gl_texture_desc){
            .label = label, .format = GL_RGBA16F, .width = width, .height = height},
        err);
}

static void init_corners(struct volume_drawing *drawing)
{
    gl_vertex_array_init(&drawing->corners, "shadow.volume.corners");
}

bool volume_drawing_reserve(struct volume_drawing *drawing, int width, int height,
                            struct error *err)
{
    struct gl_texture *maps = drawing->maps;
    if (drawing->target.name && maps[0].width == width && maps[0].height == height)
        return true;
    volume_drawing_finish(drawing);
    init_corners(drawing);
    return init_map(&maps[0], "shadow.volume.surfaces", width, height, err) &&
           init_map(&maps[1], "shadow.volume.layers", width, height, err) &&
           gl_framebuffer_init(&drawing->target,
                               &(struct gl_framebuffer_desc){.label = "shadow.volume.maps",
                                                             .colors = {&maps[0], &maps[1]}},
                               err);
}

static void set_state(int width, int height)
{
    gl_disable_fragment_stages();
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_FALSE);
    glViewport(0, 0, width, height);
}

static void set_blending(enum volume_form form)
{
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    if (form == VOLUME_PRODUCTS)
        glBlendFunc(GL_ZERO, GL_SRC_COLOR);
    else
        glBlendFunc(GL_ONE, GL_ONE);
}

void volume_drawing_clear(const struct volume_drawing *drawing, enum volume_form form)
{
    const GLfloat none = form == VOLUME_PRODUCTS, clear[4] = {none, none, none, none};
    set_state(drawing->maps[0].width, drawing->maps[0].height);
    for (int i = 0; i < 2; i++)
        glClearNamedFramebufferfv(drawing->target.name, GL_COLOR, i, clear);
}

void volume_drawing_draw(const struct volume_drawing *drawing, enum volume_form form,
                         uint64_t faces)
{
    set_state(drawing->maps[0].width, drawing->maps[0].height);
    set_blending(form);
    glBindFramebuffer(GL_FRAMEBUFFER, drawing->target.name);
    glBindVertexArray(drawing->corners.name);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    if (faces)
        glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(FACE_CORNERS * faces));
    else
        gl_framebuffer_apply_clears();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
}

static bool init_window(struct volume_drawing *drawing, bool has_stencil, struct error *err)
{
    const int *size = drawing->window_px;
    const struct gl_texture_desc stencil = {.label = "shadow.volume.stencil",
                                            .format = GL_STENCIL_INDEX8,
                                            .width = size[0],
                                            .height = size[1]};
    if (has_stencil && !gl_texture_init(&drawing->stencil, &stencil, err))
        return false;
    return gl_framebuffer_init(
        &drawing->window,
        &(struct gl_framebuffer_desc){.label = "shadow.volume.window",
                                      .stencil = has_stencil ? &drawing->stencil : NULL,
                                      .width = size[0],
                                      .height = size[1]},
        err);
}

bool volume_drawing_begin_counts(struct volume_drawing *drawing, int width, int height,
                                 bool has_stencil, struct error *err)
{
    bool is_there = drawing->window.name && drawing->window_px[0] == width &&
                    drawing->window_px[1] == height && has_stencil == (drawing->stencil.name != 0);
    if (!is_there) {
        volume_drawing_finish(drawing);
        init_corners(drawing);
        drawing->window_px[0] = width;
        drawing->window_px[1] = height;
        if (!init_window(drawing, has_stencil, err))
            return false;
    }
    set_state(width, height);
    glDisable(GL_BLEND);
    glBindFramebuffer(GL_FRAMEBUFFER, drawing->window.name);
    glBindVertexArray(drawing->corners.name);
    return true;
}

void volume_drawing_begin_stencil(const struct volume_drawing *drawing, uint32_t of_front,
                                  uint32_t of_back)
{
    const GLint none = 0;
    glStencilMask(VOLUME_STENCIL_MOST);
    glClearNamedFramebufferiv(drawing->window.name, GL_STENCIL, 0, &none);
    glEnable(GL_STENCIL_TEST);
    glFrontFace(GL_CCW);
    glStencilFunc(GL_ALWAYS, 0, VOLUME_STENCIL_MOST);
    glStencilOpSeparate(GL_FRONT, GL_KEEP, GL_KEEP, of_front);
    glStencilOpSeparate(GL_BACK, GL_KEEP, GL_KEEP, of_back);
}

void volume_drawing_add_counts(bool is_tessellated, uint64_t patches)
{
    uint64_t most = is_tessellated ? PATCHES_AT_ONCE : patches;
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glPatchParameteri(GL_PATCH_VERTICES, 1);
    for (uint64_t first = 0; first < patches; first += most)
        glDrawArrays(is_tessellated ? GL_PATCHES : GL_POINTS, (GLint)first,
                     (GLsizei)(patches - first < most ? patches - first : most));
}

void volume_drawing_end_counts(void)
{
    glDisable(GL_STENCIL_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDepthMask(GL_TRUE);
}

void volume_drawing_bind(const struct volume_drawing *drawing)
{
    gl_texture_bind(&drawing->maps[0], UNIT_VOLUME_SURFACES);
    gl_texture_bind(&drawing->maps[1], UNIT_VOLUME_LAYERS);
}

uint64_t volume_drawing_size_bytes(const struct volume_drawing *drawing)
{
    return drawing->maps[0].size_bytes + drawing->maps[1].size_bytes + drawing->stencil.size_bytes;
}

void volume_drawing_finish(struct volume_drawing *drawing)
{
    gl_framebuffer_finish(&drawing->target);
    gl_framebuffer_finish(&drawing->window);
    gl_texture_finish(&drawing->maps[0]);
    gl_texture_finish(&drawing->maps[1]);
    gl_texture_finish(&drawing->stencil);
    gl_vertex_array_finish(&drawing->corners);
    *drawing = (struct volume_drawing){0};
}
