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
#include "renderer/raytrace/rt_pixel.h"
#include "renderer/raytrace/rt_silhouette.h"
#include "renderer/raytrace/rt_whole.h"
#include "renderer/raytrace/rt_whole_packet.h"

enum { TILE_PX = 16 };

struct shared { /* by all threads, read only */
    struct rt_light_set light_set;
    struct rt_haze_grid haze;    /* zeroed where the view has none */
    double eye_sigma[3];         /* rt_media_at a perspective camera's eye */
    int first_column, first_row; /* of blocks of the picture that meet the image */
    int columns, rows;
    struct rt_silhouette silhouette;
    bool is_even;  /* the background is the same everywhere, and nothing lies before it: */
    float even[4]; /* a pixel of it */
    int samples, parts_per_side;
    double positions[256][2]; /* of the samples in a pixel, y down */
    int parts[256];           /* of the pixel that the samples lie in */
};

struct wide { /* camera rays of a packet side by side; of lanes beyond its count, what they had */
    struct rt_wide_rays rays;
    struct rt_wide_hits hits;
};

struct tracer { /* one thread's */
    struct rt_job *job;
    const struct shared *shared;
    struct rt_camera_places places;
    struct wide *wide; /* owned */
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

static void make_camera_ray(const void *from, int lane, struct rt_ray *ray)
{
    const struct tracer *tracer = from;
    rt_job_camera_ray(tracer->job, tracer->places.x[lane], tracer->places.y[lane], ray);
}

static bool add_sample(struct tracer *tracer, const int pixel[2], int s, int lane)
{
    const struct shared *shared = tracer->shared;
    const struct rt_sample sample = {.x = pixel[0],
                                     .y = pixel[1],
                                     .index = s,
                                     .part = shared->parts[s],
                                     .place = shared->positions[s],
                                     .ray = &tracer->packet.rays[lane],
                                     .hits = &tracer->packet.hits[lane]};
    return rt_batch_add(&tracer->batch, &sample);
}

/* The samples of a pixel that shows nothing else: what a batch makes of them. */
static void find_background(const struct tracer *tracer, const int at[2], float out[4])
{
    static const double none[3] = {0}, all[3] = {1, 1, 1};
    const struct shared *shared = tracer->shared;
    const struct raytrace_desc *desc = tracer->job->desc;
    struct rt_pixel pixel = {.covered = 0};
    for (int s = 0; s < shared->samples; s++) {
        struct rt_ray ray;
        double behind[4];
        rt_job_camera_ray(tracer->job, at[0] + shared->positions[s][0],
                          at[1] + shared->positions[s][1], &ray);
        rt_pixel_background(desc->view, desc->environment, ray.direction, behind);
        rt_pixel_end_sample(&pixel, none, all, behind);
    }
    rt_pixel_write(&pixel, desc->view, shared->samples, out);
}

static void write_background(const struct tracer *tracer, const int (*pixels)[2], int count)
{
    const struct shared *shared = tracer->shared;
    for (int i = 0; i < count; i++) {
        if (!rt_job_has_pixel(tracer->job, pixels[i][0], pixels[i][1]))
            continue;
        float *out = rt_job_pixel(tracer->job, pixels[i][0], pixels[i][1]);
        if (shared->is_even)
            memcpy(out, shared->even, sizeof shared->even);
        else
            find_background(tracer, pixels[i], out);
    }
}

/* All samples of whole pixels, those from which the packet's rays were made: the pixels that one
 * surface fills go their own way. */
static bool trace_wide(struct tracer *tracer, const int (*pixels)[2])
{
    struct rt_packet *packet = &tracer->packet;
    struct wide *wide = tracer->wide;
    const int samples = tracer->shared->samples;
    packet->make = make_camera_ray;
    packet->from = tracer;
    rt_job_camera_ways(tracer->job, &tracer->places, wide->rays.direction);
    rt_packet_seek(packet, &wide->rays);
    const uint32_t empty = rt_packet_empty(packet);
    const uint32_t taken = rt_wholes_take_packet(&tracer->batch, packet, &wide->rays, pixels);
    uint32_t met = 0;
    rt_packet_spread(packet, ~taken);
    /* samples may see neighbouring triangles; f32 does not tell the sides of instances */
    if (samples > 1 || tracer->job->scene->shapes.count)
        met = rt_wholes_meet(&tracer->batch, packet, &wide->rays, ~taken, &wide->hits);
    struct rt_whole_sample whole = {
        .packet = packet, .rays = &wide->rays, .hits = &wide->hits, .lane = 0};
    for (; whole.lane < packet->count; whole.lane += samples, pixels++) {
        const uint32_t all = ((1u << samples) - 1) << whole.lane;
        if (taken & all)
            continue;
        whole.x = pixels[0][0];
        whole.y = pixels[0][1];
        if ((empty & all) == all) {
            write_background(tracer, pixels, 1);
            continue;
        }
        if (((met & all) == all && rt_wholes_take(&tracer->batch, &whole)) ||
            rt_wholes_take_sheets(&tracer->batch, &whole))
            continue;
        for (int s = 0; s < samples; s++)
            rt_packet_collect_one(packet, whole.lane + s);
        if (rt_wholes_take_layers(&tracer->batch, &whole))
            continue;
        for (int s = 0; s < samples; s++)
            if (!add_sample(tracer, pixels[0], s, whole.lane + s))
                return false;
    }
    return true;
}

static bool are_clear(const struct rt_silhouette *silhouette, const int (*pixels)[2], int count)
{
    for (int i = 0; i < count; i++)
        if (!rt_silhouette_is_clear(silhouette, pixels[i][0], pixels[i][1]))
            return false;
    return true;
}

/* Of the pixels in [x0, x1) of a row, all of one background. */
static void write_even(const struct tracer *tracer, int y, int x0, int x1)
{
    const float *even = tracer->shared->even;
    float *out = rt_job_pixel(tracer->job, x0, y);
    for (int x = x0; x < x1; x++)
        for (int k = 0; k < 4; k++)
            *out++ = even[k];
}

/* The blocks of the silhouette in the tile of trace_tile. */
static bool is_tile_clear(const struct tracer *tracer, int x0, int y0)
{
    if (tracer->batch.has_air)
        return false;
    for (int y = y0; y < y0 + TILE_PX; y += RT_SILHOUETTE_PX)
        for (int x = x0; x < x0 + TILE_PX; x += RT_SILHOUETTE_PX)
            if (!rt_silhouette_is_clear(&tracer->shared->silhouette, x, y))
                return false;
    return true;
}

static void write_clear_tile(const struct tracer *tracer, int x0, int y0)
{
    const struct view_tile *shown = &tracer->job->tile;
    int first_x = x0 < shown->x_px ? shown->x_px : x0;
    int first_y = y0 < shown->y_px ? shown->y_px : y0;
    int end_x = shown->x_px + shown->width_px, end_y = shown->y_px + shown->height_px;
    end_x = end_x < x0 + TILE_PX ? end_x : x0 + TILE_PX;
    end_y = end_y < y0 + TILE_PX ? end_y : y0 + TILE_PX;
    for (int y = first_y; y < end_y; y++) {
        if (tracer->shared->is_even)
            write_even(tracer, y, first_x, end_x);
        for (int x = first_x; x < end_x && !tracer->shared->is_even; x++)
            find_background(tracer, (const int[2]){x, y}, rt_job_pixel(tracer->job, x, y));
    }
}

static void forget_hits(struct rt_packet *packet)
{
    for (int i = 0; i < packet->count; i++) {
        packet->hits[i].count = 0;
        packet->hits[i].has_overflowed = false;
    }
}

/* rays: of the pixels before; is_clear: they meet nothing. */
static bool trace_one_by_one(struct tracer *tracer, const int (*pixels)[2], int rays, bool is_clear)
{
    struct rt_packet *packet = &tracer->packet;
    const int samples = tracer->shared->samples;
    rt_job_camera_rays(tracer->job, &tracer->places, packet->count, packet->rays);
    if (is_clear)
        forget_hits(packet);
    else
        rt_packet_collect(packet);
    for (int lane = 0; lane < packet->count; lane++, rays++)
        if (!add_sample(tracer, pixels[rays / samples], rays % samples, lane))
            return false;
    return true;
}

/* One pixel's samples, RT_LANES at a time. */
static bool trace_pixels(struct tracer *tracer, const int (*pixels)[2], int count, bool is_clear)
{
    const struct shared *shared = tracer->shared;
    struct rt_camera_places *places = &tracer->places;
    struct rt_packet *packet = &tracer->packet;
    int rays = count * shared->samples;
    for (int first = 0; first < rays; first += RT_LANES) {
        int pixel = first / shared->samples, s = first % shared->samples;
        packet->count = rays - first < RT_LANES ? rays - first : RT_LANES;
        for (int lane = 0, p = pixel; lane < packet->count; lane++) {
            places->x[lane] = pixels[p][0] + shared->positions[s][0];
            places->y[lane] = pixels[p][1] + shared->positions[s][1];
            if (++s == shared->samples)
                s = 0, p++;
        }
        bool is_wide = !is_clear && tracer->batch.wholes && !rt_packet_is_wary(packet);
        if (!(is_wide ? trace_wide(tracer, pixels + pixel)
                      : trace_one_by_one(tracer, pixels, first, is_clear)))
            return false;
    }
    tracer->camera_rays += is_clear ? 0 : (uint64_t)rays;
    return true;
}

static bool show_pixels(struct tracer *tracer, const int (*pixels)[2], int count)
{
    bool is_clear = are_clear(&tracer->shared->silhouette, pixels, count);
    if (!is_clear || tracer->batch.has_air)
        return trace_pixels(tracer, pixels, count, is_clear);
    write_background(tracer, pixels, count);
    return true;
}

static bool trace_tile(struct tracer *tracer, int tile)
{
    const struct shared *shared = tracer->shared;
    const struct view *view = tracer->job->desc->view;
    int x0 = (shared->first_column + tile % shared->columns) * TILE_PX;
    int y0 = (shared->first_row + tile / shared->columns) * TILE_PX;
    int pixels[RT_LANES][2], count = 0;
    if (is_tile_clear(tracer, x0, y0)) {
        write_clear_tile(tracer, x0, y0);
        return true;
    }
    for (int i = 0; i < TILE_PX * TILE_PX; i++) {
        /* blocks of 4 x 4 pixels are what one packet sees at 1 sample */
        int block = i / 16, x = x0 + block % 4 * 4 + i % 4, y = y0 + block / 4 * 4 + i % 16 / 4;
        if (x < view->width_px && y < view->height_px) {
            pixels[count][0] = x;
            pixels[count++][1] = y;
        }
        bool is_last = i == TILE_PX * TILE_PX - 1;
        if ((count == RT_LANES || is_last) && count) {
            if (!show_pixels(tracer, (const int(*)[2])pixels, count))
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

static bool find_silhouette(struct shared *shared, struct rt_job *job, struct error *err)
{
    const struct view_tile blocks = {.x_px = shared->first_column * TILE_PX,
                                     .y_px = shared->first_row * TILE_PX,
                                     .width_px = shared->columns * TILE_PX,
                                     .height_px = shared->rows * TILE_PX};
    const struct environment_light *environment = job->desc->environment;
    const struct tracer any = {.job = job, .shared = shared};
    shared->is_even = !(environment && environment->is_background);
    find_background(&any, (const int[2]){0, 0}, shared->even);
    return rt_silhouette_init(&shared->silhouette, job, &blocks, err);
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

/* Origin and range, which all camera rays have alike. */
static bool init_wide(struct tracer *tracer, struct error *err)
{
    struct rt_ray ray;
    tracer->wide = aligned_alloc(64, (sizeof *tracer->wide + 63) / 64 * 64);
    if (!tracer->wide)
        return error_set(err, ERROR_NO_MEMORY, "camera rays");
    memset(tracer->wide, 0, sizeof *tracer->wide);
    rt_job_camera_ray(tracer->job, 0, 0, &ray);
    for (int i = 0; i < RT_LANES; i++) {
        for (int k = 0; k < 3; k++)
            tracer->wide->rays.origin[k][i] = ray.origin[k];
        tracer->wide->rays.t_min[i] = ray.t_min;
        tracer->wide->rays.t_max[i] = ray.t_max;
    }
    return true;
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
                                 .samples = shared->samples,
                                 .places = shared->positions};
    find_way(job, shared->parts_per_side, desc.way);
    memcpy(desc.eye_sigma, shared->eye_sigma, sizeof desc.eye_sigma);
    tracer->job = job;
    tracer->shared = shared;
    return rt_packet_init(&tracer->packet, job->scene, err) &&
           rt_batch_init(&tracer->batch, &desc, err) && init_wide(tracer, err);
}

static void tracer_finish(void *worker)
{
    struct tracer *tracer = worker;
    rt_packet_finish(&tracer->packet);
    rt_batch_finish(&tracer->batch);
    free(tracer->wide);
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
              find_eye_media(shared, job, err) && find_silhouette(shared, job, err) &&
              find_haze(shared, job, err) && rt_job_run(job, &form, err);
    rt_haze_grid_finish(&shared->haze);
    rt_silhouette_finish(&shared->silhouette);
    rt_light_set_finish(&shared->light_set);
    job->shared = NULL;
    free(shared);
    return ok;
}
