/* SPDX-License-Identifier: MIT */
/* Pixels that one opaque surface of a plain mesh fills, as most are that show any, or nothing, with
 * or without transparent triangles of plain meshes before it: surfaces are lit in groups of sixteen
 * as soon as there are so many, and need no fragments, steps and waiting shadow rays. What comes of
 * them has the bits of rt_batch's fragments. Internal to rt_batch. Thread: one per batch.
 */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_H

#include "renderer/raytrace/rt_batch.h"
#include "renderer/raytrace/rt_reflect.h"

enum {
    RT_WHOLE_SIDE_PX = 16, /* of a tile: rt_production.c */
    RT_WHOLE_SAMPLES_MAX = 8,
    RT_WHOLE_GROUPS = 8,    /* meshes that gather surfaces at a time */
    RT_WHOLE_LAYERS = 2048, /* of a tile; what has more goes the longer way */
};

struct rt_whole_layer { /* a transparent triangle that all samples of a pixel see */
    double radiance[3]; /* as rt_shading's; likewise the next */
    double alpha, filter[3];
};

struct rt_whole_pixel {
    int x, y; /* of the picture, y down */
    uint32_t first_layer, layer_count;
    bool is_open; /* it shows the background behind its layers, and what follows is unused */
    uint32_t mesh;
    uint32_t triangles[RT_WHOLE_SAMPLES_MAX]; /* of each sample */
    double radiance[3];                       /* out, nt; once the group is lit */
    uint32_t split; /* 1 + the first of the fragments that its samples have each, 0: none */
    bool is_front;
};

struct rt_whole_alike { /* what all surfaces of a mesh have alike, whichever it was evaluated at */
    uint32_t mesh;      /* UINT32_MAX: none yet */
    struct rt_surface surface;
    struct rt_reflector reflector;
    struct rt_shading shading; /* its radiance is what they emit */
};

struct rt_whole_group { /* surfaces of one mesh, waiting */
    struct rt_wide wide;
    struct rt_whole_alike *alike;
    int count;
    int x[RT_WIDE], y[RT_WIDE];
    uint32_t triangles[RT_WIDE];
    double *radiance[RT_WIDE]; /* out: of three each */
    /* of lanes whose triangles are known alone: rt_wide_find finds the rest */
    uint32_t sought[RT_WIDE];
    const double (*ways)[3][RT_WIDE]; /* of each sample; rt_wholes.ways but for `packed` */
};

struct rt_wholes {
    struct rt_whole_group groups[RT_WHOLE_GROUPS];
    struct rt_whole_alike alikes[RT_WHOLE_GROUPS];                  /* of each group */
    double ways[RT_WHOLE_GROUPS][RT_WHOLE_SAMPLES_MAX][3][RT_WIDE]; /* likewise */
    struct rt_whole_group packed; /* surfaces of one packet, lit at once (rt_whole_packet.h) */
    struct rt_wide_light light;   /* scratch, as the next */
    struct rt_wide_rays rays;
    double radiance[3][RT_WIDE], passes[3][RT_WIDE];
    uint64_t asked_at; /* shadow rays of the batch when the job was asked whether it goes on */
    size_t count, layer_count;
    struct rt_whole_pixel pixels[RT_WHOLE_SIDE_PX * RT_WHOLE_SIDE_PX];
    struct rt_whole_layer layers[RT_WHOLE_LAYERS];
};

/* NULL in *wholes, and no error, where scene, view or the number of samples have no such pixels. */
MUST_CHECK bool rt_wholes_create(struct rt_wholes **wholes, const struct rt_batch *batch,
                                 struct error *err);
void rt_wholes_destroy(struct rt_wholes *wholes); /* accepts NULL */

/* Whether a mesh may fill a pixel. */
static inline bool rt_whole_may_end(const struct rt_mesh *mesh)
{
    return mesh->class_ == STATE_OPAQUE && mesh->is_plain && !mesh->is_ground;
}

/* Brings to `hits` where those rays of a packet that was sought (rt_packet_seek) meet such meshes.
 * lanes: 1 << lane. Returns likewise those that end there. */
uint32_t rt_wholes_meet(const struct rt_batch *batch, const struct rt_packet *packet,
                        const struct rt_wide_rays *rays, uint32_t lanes, struct rt_wide_hits *hits);

/* One pixel, whose samples are the packet's lanes from `lane` on, all of which end on what
 * rt_wholes_meet found. */
struct rt_whole_sample {
    int x, y, lane;
    struct rt_packet *packet;
    const struct rt_wide_rays *rays;
    const struct rt_wide_hits *hits;
};
/* False, and nothing happens, where it is not filled by one surface. */
bool rt_wholes_take(struct rt_batch *batch, const struct rt_whole_sample *sample);

/* The same where only packet and rays are known: all samples see the same sheets and, behind them,
 * the same triangle or nothing. False, too, where f32 does not tell. */
bool rt_wholes_take_sheets(struct rt_batch *batch, const struct rt_whole_sample *sample);

/* Has a triangle that all rays of the pixel meet lit with others: where they do is found then.
 * layer: NULL: it is what they end on. */
void rt_wholes_add(struct rt_batch *batch, const struct rt_whole_sample *at,
                   const struct rt_candidate *met, struct rt_whole_layer *layer, double *radiance);

/* The same after rt_packet_collect_one of all its lanes, whatever they met. */
bool rt_wholes_take_layers(struct rt_batch *batch, const struct rt_whole_sample *sample);

/* Lights what still waits. */
void rt_wholes_flush(struct rt_batch *batch);

/* Gives each sample of the pixel a fragment of its own. False without memory. */
MUST_CHECK bool rt_wholes_split(struct rt_batch *batch, struct rt_whole_pixel *pixel);

/* Writes all pixels and forgets them. */
void rt_wholes_write(struct rt_batch *batch);

#endif
