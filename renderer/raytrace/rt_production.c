/* SPDX-License-Identifier: MIT */
/* Production: tiles of the picture in batches of surfaces. Camera rays in packets find what each
 * pixel shows; light clusters say which lights to ask; shadow rays wait in a queue until they can
 * go in packets to one light. */
#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/base/sample_pattern.h"
#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/rt_batch.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_path.h"

enum { TILE_PX = 16 };

struct shared { /* by all threads, read only */
    struct rt_light_set light_set;
    struct rt_haze_grid haze;    /* zeroed where the view has none */
    double eye_sigma[3];         /* rt_media_at a perspective camera's eye */
    int first_column, first_row; /* of blocks of the picture that meet the image */
    int columns, rows;
    int samples, parts_per_side;
    double positions[256][2]; /* of the samples in a pixel, y down */
    int parts[256];           /* of the pixel that the samples lie in */
};

struct tracer { /* one thread's */
    struct rt_job *job;
    const struct shared *shared;
    struct rt_camera_places places;
    struct rt_packet packet;
    struct rt_batch batch;
    uint64_t camera_rays;
};

/* Four and eight, whose pixels have one part, lie where the rasteriser has them (y counts down in
 * our pictures). Other numbers are a regular grid. */
static void place_samples(struct shared *shared, int samples)
{
    shared->samples = samples ? samples : 1;
    bool has_pattern = samples == 4 || samples == 8;
    int side = has_pattern ? 1 : (int)lround(sqrt(shared->samples));
    int parts = (side + 1) / 2; /* a side; four samples share a surface's shading, and its texels */
    shared->parts_per_side = parts;
    for (int s = 0; s < shared->samples; s++) {
        int column = s % side, row = s / side;
        double place[2] = {(column + 0.5) / side, 1 - (row + 0.5) / side};
        if (has_pattern)
            sample_pattern_place(samples, s, place);
        shared->parts[s] = has_pattern ? 0 : row * parts / side * parts + column * parts / side;
        shared->positions[s][0] = place[0];
        shared->positions[s][1] = 1 - place[1];
    }
}

/* One pixel's samples, RT_LANES at a time. */
static bool trace_pixels(struct tracer *tracer, const int (*pixels)[2], int count)
{
    const struct shared *shared = tracer->shared;
    struct rt_camera_places *places = &tracer->places;
    struct rt_packet *packet = &tracer->packet;
    int rays = count * shared->samples;
    for (int first = 0; first < rays; first += RT_LANES) {
        struct rt_sample samples[RT_LANES];
        int pixel = first / shared->samples, s = first % shared->samples;
        packet->count = rays - first < RT_LANES ? rays - first : RT_LANES;
        for (int lane = 0; lane < packet->count; lane++) {
            samples[lane] = (struct rt_sample){.x = pixels[pixel][0],
                                               .y = pixels[pixel][1],
                                               .index = s,
                                               .part = shared->parts[s],
                                               .place = shared->positions[s],
                                               .ray = &packet->rays[lane],
                                               .hits = &packet->hits[lane]};
            places->x[lane] = samples[lane].x + shared->positions[s][0];
            places->y[lane] = samples[lane].y + shared->positions[s][1];
            if (++s == shared->samples)
                s = 0, pixel++;
        }
        rt_job_camera_rays(tracer->job, places, packet->count, packet->rays);
        rt_packet_collect(packet);
        for (int lane = 0; lane < packet->count; lane++)
            if (!rt_batch_add(&tracer->batch, &samples[lane]))
                return false;
    }
    tracer->camera_rays += (uint64_t)rays;
    return true;
}

static bool trace_tile(struct tracer *tracer, int tile)
{
    const struct shared *shared = tracer->shared;
    const struct view *view = tracer->job->desc->view;
    int x0 = (shared->first_column + tile % shared->columns) * TILE_PX;
    int y0 = (shared->first_row + tile / shared->columns) * TILE_PX;
    int pixels[RT_LANES][2], count = 0;
    for (int i = 0; i < TILE_PX * TILE_PX; i++) {
        /* blocks of 4 x 4 pixels are what one packet sees at 1 sample */
        int block = i / 16, x = x0 + block % 4 * 4 + i % 4, y = y0 + block / 4 * 4 + i % 16 / 4;
        if (x < view->width_px && y < view->height_px) {
            pixels[count][0] = x;
            pixels[count++][1] = y;
        }
        bool is_last = i == TILE_PX * TILE_PX - 1;
        if ((count == RT_LANES || is_last) && count) {
            if (!trace_pixels(tracer, (const int(*)[2])pixels, count))
                return false;
            count = 0;
        }
        if (!count && (is_last || rt_batch_is_full(&tracer->batch)))
            rt_batch_shade(&tracer->batch);
    }
    return true;
}

static void trace_tiles(void *worker)
{
    struct tracer *tracer = worker;
    struct rt_job *job = tracer->job;
    for (int tile = rt_job_next(job, false); tile >= 0; tile = rt_job_next(job, true)) {
        if (trace_tile(tracer, tile))
            continue;
        atomic_store(&job->has_no_memory, true);
        break;
    }
    atomic_fetch_add(&job->camera_rays, tracer->camera_rays);
    atomic_fetch_add(&job->shadow_rays,
                     tracer->batch.shadow_rays + tracer->batch.walker.lighting.shadow_rays);
    atomic_fetch_add(&job->surfaces, tracer->batch.surfaces);
    atomic_fetch_add(&job->lights_listed, tracer->batch.lights_listed);
    atomic_fetch_add(&job->lights_reaching, tracer->batch.lights_reaching);
    if (tracer->batch.has_overflowed)
        atomic_store(&job->has_overflowed, true);
}

/* The blocks are those of the whole picture, whatever the image shows of it: what a pixel is
 * compared with, and so its bits, are the same. */
static void place_blocks(struct shared *shared, const struct view_tile *tile)
{
    shared->first_column = tile->x_px / TILE_PX;
    shared->first_row = tile->y_px / TILE_PX;
    shared->columns = (tile->x_px + tile->width_px + TILE_PX - 1) / TILE_PX - shared->first_column;
    shared->rows = (tile->y_px + tile->height_px + TILE_PX - 1) / TILE_PX - shared->first_row;
}

/* From the ray through one part of a pixel to those to the right and below. */
static void find_way(const struct rt_job *job, int parts_per_side, double way[2][3])
{
    const struct camera *camera = job->desc->camera;
    const struct view *view = job->desc->view;
    double right = 2 * camera->half_width / view->width_px / parts_per_side;
    double down = 2 * camera->half_height / view->height_px / parts_per_side;
    for (int k = 0; k < 3; k++) {
        way[0][k] = camera->right[k] * right;
        way[1][k] = -camera->up[k] * down;
    }
}

static bool tracer_init(void *worker, struct rt_job *job, struct error *err)
{
    struct tracer *tracer = worker;
    const struct shared *shared = job->shared;
    struct rt_batch_desc desc = {.job = job,
                                 .scene = job->scene,
                                 .view = job->desc->view,
                                 .camera = job->desc->camera,
                                 .environment = job->desc->environment,
                                 .light_set = &shared->light_set,
                                 .haze = shared->haze.job ? &shared->haze : NULL,
                                 .samples = shared->samples};
    find_way(job, shared->parts_per_side, desc.way);
    memcpy(desc.eye_sigma, shared->eye_sigma, sizeof desc.eye_sigma);
    tracer->job = job;
    tracer->shared = shared;
    return rt_packet_init(&tracer->packet, job->scene, err) &&
           rt_batch_init(&tracer->batch, &desc, err);
}

static void tracer_finish(void *worker)
{
    struct tracer *tracer = worker;
    rt_packet_finish(&tracer->packet);
    rt_batch_finish(&tracer->batch);
}

static bool find_eye_media(struct shared *shared, struct rt_job *job, struct error *err)
{
    struct rt_hits scratch;
    struct rt_ray ray;
    if (!rt_hits_init(&scratch, err))
        return false;
    rt_job_camera_ray(job, 0, 0, &ray);
    rt_media_at(job->scene, ray.origin, &scratch, shared->eye_sigma);
    rt_hits_finish(&scratch);
    return true;
}

static bool find_haze(struct shared *shared, struct rt_job *job, struct error *err)
{
    double begin_ms = wall_ms(), paused_ms = job->paused_ms;
    if (!view_has_atmosphere(job->desc->view))
        return true;
    bool ok = rt_haze_grid_init(&shared->haze, job, &shared->light_set, err);
    job->haze_ms = wall_ms() - begin_ms - (job->paused_ms - paused_ms);
    return ok;
}

bool rt_production_render(struct rt_job *job, struct error *err)
{
    static const struct rt_form form = {.worker_bytes = sizeof(struct tracer),
                                        .init = tracer_init,
                                        .run = trace_tiles,
                                        .finish = tracer_finish};
    const struct raytrace_desc *desc = job->desc;
    struct shared *shared = calloc(1, sizeof *shared);
    if (!shared)
        return error_set(err, ERROR_NO_MEMORY, "ray tracing");
    place_blocks(shared, &job->tile);
    place_samples(shared, desc->samples);
    job->unit_count = shared->columns * shared->rows;
    job->shared = shared;
    bool ok = rt_light_set_init(&shared->light_set, job->scene, desc, err) &&
              find_eye_media(shared, job, err) && find_haze(shared, job, err) &&
              rt_job_run(job, &form, err);
    rt_haze_grid_finish(&shared->haze);
    rt_light_set_finish(&shared->light_set);
    job->shared = NULL;
    free(shared);
    return ok;
}
