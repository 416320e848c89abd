/* SPDX-License-Identifier: MIT */
/* A circle above a sphere round the bounds, which fills the picture but for a margin. */
#include "protocol/turntable.h"

#include <math.h>

static const double PI = 3.14159265358979323846, MARGIN = 1.05;

static bool read_corner(const json_t *bounds, const char *key, double corner[3])
{
    const json_t *array = json_object_get(bounds, key);
    for (size_t i = 0; i < 3; i++) {
        const json_t *number = json_array_get(array, i);
        if (!json_is_number(number))
            return false;
        corner[i] = json_number_value(number);
    }
    return true;
}

bool turntable_init(struct turntable *table, const json_t *summary, double width_px,
                    double height_px)
{
    double low[3], high[3], square = 0, half = 0.5 * TURNTABLE_FOV_Y_DEG * PI / 180;
    const json_t *bounds = json_object_get(summary, "bounds");
    if (!read_corner(bounds, "min", low) || !read_corner(bounds, "max", high))
        return false;
    for (int k = 0; k < 3; k++) {
        table->center[k] = 0.5 * (low[k] + high[k]);
        square += 0.25 * (high[k] - low[k]) * (high[k] - low[k]);
    }
    if (width_px > 0 && width_px < height_px)
        half = atan(tan(half) * width_px / height_px);
    table->distance_m = MARGIN * (square > 0 ? sqrt(square) : 1) / sin(half);
    return true;
}

void turntable_eye(const struct turntable *table, double elevation_deg, double turns, double eye[3])
{
    double around = 2 * PI * turns, up = elevation_deg * PI / 180;
    const double to_eye[3] = {cos(up) * sin(around), sin(up), cos(up) * cos(around)};
    for (int k = 0; k < 3; k++)
        eye[k] = table->center[k] + table->distance_m * to_eye[k];
}
