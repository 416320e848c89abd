/* SPDX-License-Identifier: MIT */
/* One point of every slice for each light whose range and cone the column crosses there. */
#include "renderer/raytrace/rt_haze_lights.h"

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_haze_glow.h"
#include "renderer/raytrace/rt_lamp_span.h"
#include "renderer/raytrace/rt_shadow_rays.h"
#include "renderer/scene/atmosphere.h"

enum { BLOCK_COLUMNS = RT_HAZE_BLOCK * RT_HAZE_BLOCK };

static const double GOLDEN = 0.6180339887, PLASTIC = 0.7548776662; /* of sequences of quarters */
static const double NEAREST = 1e-9;                                /* [m] from a lamp to a column */
static const double LEAP_MOST = 1e6; /* [m] into a slice without an end */

struct column {
    int column, row;
    double origin[3], way[3]; /* at depth 0, relative to rt_scene.origin; unit */
    double per_m;             /* metres of the way per metre of depth */
    double height_m;          /* of the origin, in the world */
    double reach;             /* depth */
    double quarter;           /* where points lie in a slice: four columns have four quarters */
};

struct waiting { /* a ray's slice, and what passes of a light where nothing is between */
    size_t slice;
    double weight;
};

struct worker { /* one thread's */
    struct rt_job *job;
    struct rt_haze_grid *grid;
    const struct rt_light_set *light_set;
    struct rt_shadow_rays rays;
    struct column columns[BLOCK_COLUMNS];
    int column_count;
    struct rt_shadow_job jobs[RT_LANES];
    struct waiting waiting[RT_LANES];
    size_t waiting_count;
};

static int blocks_along(int columns)
{
    return (columns + RT_HAZE_BLOCK - 1) / RT_HAZE_BLOCK;
}

int rt_haze_blocks(const struct rt_haze_grid *grid)
{
    return blocks_along(grid->size.columns) * blocks_along(grid->size.rows);
}

/* ---- columns ---- */

/* The farthest depth in the pixels that look the column up: those of its neighbours, too. */
static double find_reach(const struct rt_haze_grid *grid, int column, int row)
{
    const struct atmosphere_grid *size = &grid->size;
    float farthest = 0;
    for (int y = row - 1; y <= row + 1; y++)
        for (int x = column - 1; x <= column + 1; x++)
            if (x >= 0 && y >= 0 && x < size->columns && y < size->rows)
                farthest = fmaxf(farthest, grid->reaches[y * size->columns + x]);
    return (double)farthest;
}

static void begin_column(struct worker *worker, int x, int y)
{
    const struct rt_haze_grid *grid = worker->grid;
    struct column *column = &worker->columns[worker->column_count++];
    unsigned odd_x = (unsigned)(grid->size.first_x + x) & 1;
    unsigned odd_y = (unsigned)(grid->size.first_y + y) & 1;
    column->column = x;
    column->row = y;
    column->per_m = rt_haze_column(grid, x, y, column->origin, column->way);
    column->height_m = column->origin[1] + worker->job->scene->origin[1];
    column->reach = find_reach(grid, x, y);
    column->quarter = 0.5 * odd_x + 0.25 * (odd_x ^ odd_y);
}

static double depth_between(const struct worker *worker, const struct column *c, double from,
                            double to)
{
    return atmosphere_depth(&worker->job->desc->view->atmosphere, c->height_m + c->way[1] * from,
                            c->way[1], to - from);
}

/* ---- points ---- */

struct place { /* a point of the way, and how many metres of haze that scatters it stands for */
    double at, share;
};

/* A light without a place counts by what the stretch scatters of all that passes it. */
static struct place place_directional(const struct worker *worker, const struct column *c,
                                      struct rt_span s, double offset)
{
    double depth = depth_between(worker, c, s.from, s.to), loss = -expm1(-depth);
    double share = exp(-depth_between(worker, c, 0, s.from)) * loss;
    double part = depth < 0.02 ? offset : -log1p(-offset * loss) / depth;
    return (struct place){s.from + part * fmin(s.to - s.from, LEAP_MOST), share};
}

/* How far apart columns are at a lamp [m]. */
static double column_width(const struct worker *worker, const struct rt_light_record *record)
{
    const struct rt_haze_grid *grid = worker->grid;
    const struct camera *camera = worker->job->desc->camera;
    double off[3],
        width = 2 * camera->half_height / worker->job->desc->view->height_px * grid->size.side_px;
    for (int k = 0; k < 3; k++)
        off[k] = (double)record->position[k] + worker->job->scene->origin[k] - camera->eye[k];
    return camera->is_orthographic ? width : width * fabs(vec3_dot(off, camera->back));
}

/* Drawn by the angle at which a lamp sees the way: Kulla and Fajardo 2012, "Importance Sampling
 * Techniques for Path Tracing in Participating Media", section 4.1, by sums of angles, so that
 * those of far points keep their digits. */
static struct place place_lamp(const struct worker *worker, const struct column *c,
                               const struct rt_light_record *record, struct rt_span s,
                               double offset)
{
    double off[3], aside[3];
    for (int k = 0; k < 3; k++)
        off[k] = (double)record->position[k] - c->origin[k];
    double nearest = vec3_dot(off, c->way);
    for (int k = 0; k < 3; k++)
        aside[k] = off[k] - nearest * c->way[k];
    /* around a lamp itself 1 / distance has the mean over the column: 4 / width */
    double least = fmax(0.25 * column_width(worker, record), NEAREST);
    double apart = fmax(vec3_length(aside), least);
    double first = s.from - nearest, last = s.to - nearest;
    double angle = atan2(apart * (last - first), apart * apart + first * last);
    double cosine = cos(offset * angle), sine = sin(offset * angle);
    double behind = apart * (first * cosine + apart * sine) / (apart * cosine - first * sine);
    double t = fmin(fmax(nearest + behind, s.from), s.to), square = 0;
    for (int k = 0; k < 3; k++) {
        double d = t * c->way[k] - off[k];
        square += d * d;
    }
    if (record->is_area) /* whose points are elsewhere */
        square = fmax(square, apart * apart);
    double extinction =
        atmosphere_extinction(&worker->job->desc->view->atmosphere, c->height_m + t * c->way[1]);
    double left = exp(-depth_between(worker, c, 0, t));
    return (struct place){t, extinction * left * square * angle / apart};
}

/* ---- rays ---- */

static void add(struct worker *worker, const struct waiting *to, uint32_t light,
                const double passed[3])
{
    const float *color = worker->light_set->records[light].color;
    float added[3];
    for (size_t k = 0; k < 3; k++) {
        added[k] = (float)(to->weight * passed[k] * (double)color[k]);
        worker->grid->lights[3 * to->slice + k] += added[k];
    }
    rt_haze_glows_take(worker->grid, light, to->slice, added);
}

static void trace_waiting(struct worker *worker)
{
    double passed[RT_LANES][3];
    rt_shadow_rays_trace(&worker->rays, worker->jobs, worker->waiting_count, passed);
    for (size_t i = 0; i < worker->waiting_count; i++)
        add(worker, &worker->waiting[i], worker->jobs[i].light, passed[i]);
    worker->waiting_count = 0;
}

/* What arrives at a point, over the light's colour: of an area light at one of its points, which
 * take turns along a column. */
static double arrive(const struct worker *worker, const struct column *c, int slice,
                     struct rt_shadow_job *job)
{
    const struct rt_light_record *record = &worker->light_set->records[job->light];
    struct rt_arrival arrival = {.gain = 0};
    if (record->is_area) {
        int x = worker->grid->size.first_x + c->column, y = worker->grid->size.first_y + c->row;
        struct rt_light_sample sample = {.index = (uint32_t)slice % record->samples,
                                         .count = record->samples,
                                         .seed = rt_job_seed(x, y, 0) + job->light};
        rt_light_arrive(&worker->job->scene->state->lights[job->light], &sample,
                        worker->job->scene->origin, job->point, &arrival);
        arrival.gain *= record->samples;
        job->distance_m = (float)arrival.distance_m;
        for (int k = 0; k < 3; k++)
            job->direction[k] = (float)arrival.direction[k];
    } else {
        const float at[3] = {(float)job->point[0], (float)job->point[1], (float)job->point[2]};
        arrival.gain = (double)rt_light_set_arrive(worker->light_set, job->light, at,
                                                   job->direction, &job->distance_m);
        arrival.distance_m = (double)job->distance_m;
        for (int k = 0; k < 3; k++)
            arrival.direction[k] = (double)job->direction[k];
    }
    if (!(arrival.gain > 0))
        return 0;
    const struct view *view = worker->job->desc->view;
    return arrival.gain * rt_haze_arrives(worker->job->scene, view, &arrival, job->point) *
           atmosphere_phase(&view->atmosphere, vec3_dot(arrival.direction, c->way));
}

static void ask(struct worker *worker, const struct column *c, uint32_t light, int slice,
                struct rt_span part)
{
    const struct rt_light_record *record = &worker->light_set->records[light];
    const struct atmosphere_grid *size = &worker->grid->size;
    double whole, turn = floor(4 * modf(slice * GOLDEN + light * PLASTIC, &whole));
    double offset = modf(c->quarter + 0.25 * (turn + worker->grid->offset), &whole);
    struct place place = record->type == SCENE_LIGHT_DIRECTIONAL
                             ? place_directional(worker, c, part, offset)
                             : place_lamp(worker, c, record, part, offset);
    struct rt_shadow_job *job = &worker->jobs[worker->waiting_count];
    struct waiting *waiting = &worker->waiting[worker->waiting_count];
    *job = (struct rt_shadow_job){
        .light = light, .skip_mesh = UINT32_MAX, .skip_triangle = UINT32_MAX};
    for (int k = 0; k < 3; k++)
        job->point[k] = c->origin[k] + place.at * c->way[k];
    waiting->slice = ((size_t)slice * (size_t)size->rows + (size_t)c->row) * (size_t)size->columns +
                     (size_t)c->column;
    waiting->weight = place.share * arrive(worker, c, slice, job);
    if (!(waiting->weight > 0) || !isfinite(waiting->weight))
        return;
    if (!record->casts_shadow || worker->job->desc->view->quality.shadows == SHADOWS_NONE)
        add(worker, waiting, light, (const double[3]){1, 1, 1});
    else if (++worker->waiting_count == RT_LANES)
        trace_waiting(worker);
}

/* Slice by slice, so that the rays of a packet begin side by side. */
static void light_columns(struct worker *worker, uint32_t light)
{
    const struct rt_haze_grid *grid = worker->grid;
    struct rt_span spans[BLOCK_COLUMNS];
    for (int i = 0; i < worker->column_count; i++)
        spans[i] = rt_lamp_span(worker->job->scene, &worker->job->scene->state->lights[light],
                                worker->columns[i].origin, worker->columns[i].way);
    for (int slice = 0; slice < grid->size.slices; slice++)
        for (int i = 0; i < worker->column_count; i++) {
            const struct column *c = &worker->columns[i];
            struct rt_span part = {fmax(spans[i].from, grid->borders[slice] * c->per_m),
                                   fmin(spans[i].to, grid->borders[slice + 1] * c->per_m)};
            if (grid->borders[slice] < c->reach && part.from < part.to)
                ask(worker, c, light, slice, part);
        }
    trace_waiting(worker);
}

static void light_blocks(void *argument)
{
    struct worker *worker = argument;
    struct rt_job *job = worker->job;
    const struct atmosphere_grid *size = &worker->grid->size;
    int across = blocks_along(size->columns);
    for (int block = rt_job_next(job, false); block >= 0; block = rt_job_next(job, true)) {
        int x0 = block % across * RT_HAZE_BLOCK, y0 = block / across * RT_HAZE_BLOCK;
        worker->column_count = 0;
        for (int y = y0; y < y0 + RT_HAZE_BLOCK && y < size->rows; y++)
            for (int x = x0; x < x0 + RT_HAZE_BLOCK && x < size->columns; x++)
                begin_column(worker, x, y);
        for (size_t light = 0; light < job->scene->state->light_count; light++)
            light_columns(worker, (uint32_t)light);
    }
    atomic_fetch_add(&job->shadow_rays, worker->rays.ray_count);
    if (worker->rays.has_overflowed)
        atomic_store(&job->has_overflowed, true);
}

static bool worker_init(void *argument, struct rt_job *job, struct error *err)
{
    struct worker *worker = argument;
    const struct rt_haze_making *making = job->shared;
    worker->job = job;
    worker->grid = making->grid;
    worker->light_set = making->light_set;
    return rt_shadow_rays_init(&worker->rays, job->scene, making->light_set,
                               job->desc->view->quality.blend_filter, err);
}

static void worker_finish(void *argument)
{
    rt_shadow_rays_finish(&((struct worker *)argument)->rays);
}

const struct rt_form rt_haze_lights_form = {.worker_bytes = sizeof(struct worker),
                                            .init = worker_init,
                                            .run = light_blocks,
                                            .finish = worker_finish};
