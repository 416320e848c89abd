/* SPDX-License-Identifier: MIT */
/* An outline, cut at the eye and by rows of tiles, over a coarse picture of depths. */
#include "renderer/cost/volume_cover.h"

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"

/* As shaders/shadows/volume_faces.glsl has them. */
enum { SMALL_SIDE_PX = 15, SMALL_PIXELS = 64 };

static const double TILE = VOLUME_TILE_PX;

/* In the middle of a cell; 0: nothing, or the light does not get there. */
static double find_end(const struct workload_desc *desc, const struct scene_sampling *sampling,
                       const struct state_light *light, int row, int column)
{
    const struct camera *camera = desc->camera;
    double depth = (double)sampling->ends[row * SCENE_COLUMNS + column], point[3];
    if (!isfinite(depth))
        return 0;
    double reach = camera->is_orthographic ? 1 : depth;
    double x = (2 * (column + 0.5) / SCENE_COLUMNS - 1) * camera->half_width * reach;
    double y = (2 * (row + 0.5) / SCENE_ROWS - 1) * camera->half_height * reach;
    for (int k = 0; k < 3; k++)
        point[k] =
            camera->eye[k] + x * camera->right[k] + y * camera->up[k] - depth * camera->back[k];
    return workload_shines_into(light, point) ? depth : 0;
}

/* What of a tile lies farthest: half of the way from the middle of a cell to that of the next. */
static double find_far(const struct volume_cover *cover, int row, int column)
{
    static const int beside[4][2] = {{0, 1}, {0, -1}, {1, 0}, {-1, 0}};
    double own = cover->ends[row][column], far = own;
    for (int i = 0; i < 4; i++) {
        int r = row + beside[i][0], c = column + beside[i][1];
        if (r >= 0 && r < SCENE_ROWS && c >= 0 && c < SCENE_COLUMNS)
            far = fmax(far, cover->ends[r][c]);
    }
    return far;
}

void volume_cover_init(struct volume_cover *cover, const struct workload_desc *desc,
                       const struct scene_sampling *sampling, const struct state_light *light)
{
    double far[SCENE_ROWS][SCENE_COLUMNS];
    *cover = (struct volume_cover){.camera = desc->camera,
                                   .width_px = desc->view->width_px,
                                   .height_px = desc->view->height_px};
    for (int row = 0; row < SCENE_ROWS; row++)
        for (int column = 0; column < SCENE_COLUMNS; column++)
            cover->ends[row][column] = find_end(desc, sampling, light, row, column);
    for (int row = 0; row < SCENE_ROWS; row++)
        for (int column = 0; column < SCENE_COLUMNS; column++)
            far[row][column] = find_far(cover, row, column);
    memcpy(cover->ends, far, sizeof far);
}

static void place(const struct camera *camera, const double world[3], double corner[4])
{
    camera_to_view(camera, world, corner);
    corner[3] = 1;
}

struct volume_outline volume_outline_of_triangle(const struct camera *camera, const double a[3],
                                                 const double b[3], const double c[3])
{
    struct volume_outline outline;
    const double *corners[4] = {a, b, c, c};
    for (int i = 0; i < 4; i++)
        place(camera, corners[i], outline.corners[i]);
    return outline;
}

/* From one end to the other, and on both ways from the light back from infinity. */
struct volume_outline volume_outline_of_side(const struct camera *camera,
                                             const struct state_light *light,
                                             const double ends[2][3])
{
    struct volume_outline outline;
    bool is_sun = light->type == SCENE_LIGHT_DIRECTIONAL;
    for (int i = 0; i < 2; i++) {
        double *away = outline.corners[3 - i], world[3];
        place(camera, ends[i], outline.corners[i]);
        for (int k = 0; k < 3; k++)
            world[k] = is_sun ? light->direction[k] : ends[i][k] - light->position[k];
        away[0] = vec3_dot(world, camera->right);
        away[1] = vec3_dot(world, camera->up);
        away[2] = -vec3_dot(world, camera->back);
        away[3] = 0;
    }
    return outline;
}

/* ---- in the picture ---- */

struct segment {
    double begin[4], end[4];
};

struct cut_outline {
    struct segment segments[5];
    int count;
};

static double height_of(const struct volume_cover *cover, const double at[4])
{
    return cover->camera->is_orthographic ? at[3] : at[2];
}

static double depth_of(const double at[4])
{
    return at[3] > 0 ? at[2] / at[3] : INFINITY;
}

static void mix(const double a[4], const double b[4], double share, double out[4])
{
    for (int k = 0; k < 4; k++)
        out[k] = a[k] + share * (b[k] - a[k]);
}

static double size_of(const struct volume_outline *outline)
{
    double size = 0;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3 && outline->corners[i][3] > 0; k++)
            size = fmax(size, fabs(outline->corners[i][k]));
    return size;
}

/* What lies before the eye. */
static void cut_at_eye(const struct volume_cover *cover, const struct volume_outline *outline,
                       struct cut_outline *cut)
{
    double least = cover->camera->is_orthographic ? 1e-6 : 1e-5 * size_of(outline);
    double cuts[2][4];
    int cut_count = 0;
    cut->count = 0;
    for (int i = 0; i < 4; i++) {
        const double *p = outline->corners[i], *q = outline->corners[(i + 1) % 4];
        double x = height_of(cover, p) - least, y = height_of(cover, q) - least, between[4];
        if (x < 0 && y < 0)
            continue;
        struct segment *segment = &cut->segments[cut->count++];
        memcpy(segment->begin, p, sizeof segment->begin);
        memcpy(segment->end, q, sizeof segment->end);
        if ((x >= 0) == (y >= 0))
            continue;
        mix(p, q, x / (x - y), between);
        memcpy(x < 0 ? segment->begin : segment->end, between, sizeof between);
        memcpy(cuts[cut_count++ & 1], between, sizeof between);
    }
    if (cut_count > 1) {
        struct segment *segment = &cut->segments[cut->count++];
        memcpy(segment->begin, cuts[0], sizeof cuts[0]);
        memcpy(segment->end, cuts[1], sizeof cuts[1]);
    }
}

static double pixel_of(const struct volume_cover *cover, const double at[4], int axis)
{
    double half = axis == 0 ? cover->camera->half_width : cover->camera->half_height;
    int size_px = axis == 0 ? cover->width_px : cover->height_px;
    return (at[axis] / (half * height_of(cover, at)) + 1) * 0.5 * size_px;
}

struct range {
    double low, high;
};

static struct range widen(struct range range, double x)
{
    return (struct range){fmin(range.low, x), fmax(range.high, x)};
}

static const struct range NONE = {INFINITY, -INFINITY};

/* Whole pixels whose middles lie within. */
static struct range extent_px(const struct volume_cover *cover, const struct cut_outline *cut,
                              int axis)
{
    struct range found = NONE;
    for (int i = 0; i < cut->count; i++) {
        found = widen(found, pixel_of(cover, cut->segments[i].begin, axis));
        found = widen(found, pixel_of(cover, cut->segments[i].end, axis));
    }
    double most = axis == 0 ? cover->width_px : cover->height_px;
    return (struct range){fmax(ceil(found.low - 0.5), 0), fmin(floor(found.high + 0.5), most)};
}

/* How far a point is above a row of pixels, times its height. */
static double above_row(const struct volume_cover *cover, double row, const double at[4])
{
    double edge = (2 * row / cover->height_px - 1) * cover->camera->half_height;
    return at[1] - edge * height_of(cover, at);
}

/* Of a way from x to y what is not negative. */
static void cut_way(struct range *t, double x, double y)
{
    if (x < 0)
        t->low = y < 0 ? 2 : fmax(t->low, x / (x - y));
    else if (y < 0)
        t->high = fmin(t->high, x / (x - y));
}

/* Pixels of a row of tiles, and how near the outline comes there. */
static struct range columns_within(const struct volume_cover *cover, const struct cut_outline *cut,
                                   double row_px, double *nearest)
{
    struct range found = NONE;
    *nearest = INFINITY;
    for (int i = 0; i < cut->count; i++) {
        const struct segment *s = &cut->segments[i];
        struct range t = {0, 1};
        cut_way(&t, above_row(cover, row_px, s->begin), above_row(cover, row_px, s->end));
        cut_way(&t, -above_row(cover, row_px + TILE, s->begin),
                -above_row(cover, row_px + TILE, s->end));
        if (t.low > t.high)
            continue;
        for (int end = 0; end < 2; end++) {
            double at[4];
            mix(s->begin, s->end, end ? t.high : t.low, at);
            *nearest = fmin(*nearest, depth_of(at));
            found = widen(found, pixel_of(cover, at, 0));
        }
    }
    return found;
}

static int cell_of(double px, int size_px, int cells)
{
    return (int)fmin(fmax(px / size_px * cells, 0), cells - 1);
}

/* Tiles from one column of them to another that have something behind. */
static double count_tiles(const struct volume_cover *cover, double row_px, struct range tiles,
                          double nearest)
{
    int row = cell_of(row_px + TILE / 2, cover->height_px, SCENE_ROWS);
    double per_tile = TILE / cover->width_px * SCENE_COLUMNS, found = 0;
    double begin = tiles.low * per_tile, end = fmin(tiles.high * per_tile, SCENE_COLUMNS);
    for (int column = (int)begin; column < end; column++)
        if (cover->ends[row][column] > nearest)
            found += (fmin(end, column + 1) - fmax(begin, column)) / per_tile;
    return found;
}

static bool find_box(const struct volume_cover *cover, const struct cut_outline *cut,
                     struct range box[2])
{
    for (int axis = 0; axis < 2; axis++) {
        box[axis] = extent_px(cover, cut, axis);
        if (!(box[axis].low < box[axis].high))
            return false;
    }
    return true;
}

static double measure_small(const struct volume_cover *cover, const struct cut_outline *cut,
                            const struct range box[2])
{
    double nearest = INFINITY;
    for (int i = 0; i < cut->count; i++)
        nearest =
            fmin(nearest, fmin(depth_of(cut->segments[i].begin), depth_of(cut->segments[i].end)));
    int row = cell_of((box[1].low + box[1].high) / 2, cover->height_px, SCENE_ROWS);
    int column = cell_of((box[0].low + box[0].high) / 2, cover->width_px, SCENE_COLUMNS);
    double pixels = (box[0].high - box[0].low) * (box[1].high - box[1].low);
    return cover->ends[row][column] > nearest ? pixels : 0;
}

double volume_cover_measure(const struct volume_cover *cover, const struct volume_outline *outline)
{
    struct cut_outline cut;
    struct range box[2];
    cut_at_eye(cover, outline, &cut);
    if (!find_box(cover, &cut, box))
        return 0;
    double wide = box[0].high - box[0].low, high = box[1].high - box[1].low, tiles = 0;
    if (fmax(wide, high) <= SMALL_SIDE_PX && wide * high <= SMALL_PIXELS)
        return measure_small(cover, &cut, box);
    const struct range all = {floor(box[0].low / TILE), ceil(box[0].high / TILE)};
    for (double row = floor(box[1].low / TILE); row * TILE < box[1].high; row++) {
        double nearest;
        struct range columns = columns_within(cover, &cut, row * TILE, &nearest);
        columns.low = fmin(fmax(floor(columns.low / TILE), all.low), all.high);
        columns.high = fmin(fmax(ceil(columns.high / TILE), all.low), all.high);
        tiles += count_tiles(cover, row * TILE, columns, nearest);
    }
    return tiles * TILE * TILE;
}

double volume_cover_most(const struct volume_cover *cover, const struct volume_outline *outline)
{
    struct cut_outline cut;
    struct range box[2];
    cut_at_eye(cover, outline, &cut);
    if (!find_box(cover, &cut, box))
        return 0;
    double pixels = 1;
    for (int axis = 0; axis < 2; axis++)
        pixels *= TILE * (ceil(box[axis].high / TILE) - floor(box[axis].low / TILE));
    return pixels;
}
