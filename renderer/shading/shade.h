/* SPDX-License-Identifier: MIT */
/* Lighting of sets of surfaces, opaque samples and what a transparency method hands out, and
 * compositing. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_SHADE_H
#define VITRAIL_RENDERER_SHADING_SHADE_H

#include "renderer/base/yield_point.h"
#include "renderer/image/image.h"
#include "renderer/lights/light_lists.h"
#include "renderer/shading/light_areas.h"
#include "renderer/shading/light_chunks.h"
#include "renderer/shading/readback.h"
#include "renderer/shadows/shadow_traced.h"
#include "renderer/shadows/shadows.h"
#include "renderer/transparency/method.h"
#include "renderer/window/time_slice_pace.h"
#include "renderer/window/window.h"

struct shade {
    struct gl_buffer lights;     /* light_record[] */
    struct gl_buffer statistics; /* 128 u32, see shaders/shading/lighting.glsl */
    struct light_areas areas;    /* where points are taken on them */
    bool has_apart;              /* the window's pixels shaded apart were listed */
    uint64_t loop_steps;         /* of one invocation, at most */
    /* Pixels or layers of a pass's first time slice; 0: what its pace says. */
    uint64_t first_slice;
};

struct shade_desc {
    const struct window_frame *frame;    /* required */
    const struct light_lists *lists;     /* required, prepared for the window */
    const struct shadow_system *shadows; /* required, prepared for the frame */
    struct layers *layers;               /* required, found for the window ... */
    const struct geometry_items *items;  /* ... among these; required */
    struct traced_shadows *traced; /* optional: collected for the window, takes the place of all
                                      structures; the lists must be clustered */
    struct traced_shadows *seen;   /* with needs->visibility_lobes: seen for the window */
    /* Optional: passes come in time slices, with the same bits. Urgent frames leave GL and the
     * shadows as they were, but for bindings and uniforms. */
    const struct yield_point *yield;
    struct time_slice_pace pace; /* with it: of frames like this one */
    /* Optional: called when a part of the work begins, with its shares of the whole. */
    void (*advance)(const void *context, double first, double size);
    const void *advance_context;
    bool is_continued; /* other lights have been shaded before these: adds to what is there */
    bool continues;    /* others follow: the image is made with the last of them */
    /* All lights were there before: once more, of the samples in other light than their neighbours
     * (renderer/window/apart.h). */
    bool is_apart;
};

/* What decides the shading programs, beside the frame. */
#define SHADE_TRACED_SHADOWS "HAS_TRACED_SHADOWS"
struct shade_facts {
    const char *shadows; /* #define items of shadow queries, or SHADE_TRACED_SHADOWS */
    const char *lists;   /* those of light lists */
    bool is_traced;
    const struct transparency_method *method; /* where there are layers */
    bool has_layers, has_media, may_surround; /* of struct layers */
};
struct shade_facts shade_facts_of(const struct shade_desc *desc);
/* The programs that shade such a window; of frame what geometry_list_transparent needs. Thread:
 * any. */
void shade_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                         enum light_parts parts, bool is_conditional, struct program_list *list);

struct shade_lights_desc {
    const struct scene_state *state;     /* required */
    const struct shader_needs *needs;    /* required; of the frame's plan */
    const struct shadow_system *shadows; /* required */
    const struct traced_shadows *traced; /* NULL where shadows are in structures */
    const struct camera *camera;         /* required */
    bool has_shadows;                    /* quality.shadows is not none */
    const bool *is_left_out;             /* per light: it is black; NULL: none is */
};
/* Uploads the lights of the frame, in view space. Once per frame, or once for each part of
 * its lights. */
MUST_CHECK bool shade_upload_lights(struct shade *shade, const struct shade_lights_desc *desc,
                                    struct error *err);
/* Shades layers, then pixels, into frame->targets->image, and then samples apart where all
 * lights came at once: who brings them in parts asks apart_count and brings them again. The bits
 * are the same whether the lights come at once or in parts, as long as the parts follow the order
 * of the light lists. */
MUST_CHECK bool shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err);
/* Sends the window's image on its way to desc->color, and the lookups, which the desc need not
 * have, to the report. */
MUST_CHECK bool shade_send_color(struct shade *shade, struct readback *readback,
                                 const struct readback_desc *desc, struct error *err);
void shade_finish(struct shade *shade);

#endif
