/* SPDX-License-Identifier: MIT */
/* Speeds of a device as times of a pixel, a lookup, a texel, a ray. */
#include "server/mapping/auto_mapping.h"

#include "protocol/utf8.h"

void device_auto_from_settings(const struct auto_settings *settings, struct device_auto *automatic)
{
    static const char *const policies[] = {
        [AUTO_RASTER] = "raster", [AUTO_MEASURED] = "measured", [AUTO_RAYTRACED] = "raytraced"};
    const struct device_costs *costs = &forecast_costs;
    const struct device_speed *speed = &settings->speed;
    const double levels = 17; /* of a tree over a hundred thousand triangles */
    *automatic = (struct device_auto){.is_measured = settings->policy == AUTO_MEASURED &&
                                                     device_speed_is_known(speed)};
    utf8_copy(automatic->policy, sizeof automatic->policy, policies[settings->policy]);
    if (!automatic->is_measured)
        return;
    automatic->frame_ms = speed->frame_ms;
    automatic->shade = speed->shade;
    automatic->maps = speed->maps;
    automatic->trace = speed->trace;
    automatic->build = speed->build;
    automatic->pixel_ns = speed->shade * costs->pixel;
    automatic->lookup_ns = speed->shade * (costs->light + costs->look + 4 * costs->tap);
    automatic->texel_ns = speed->maps * costs->texel;
    automatic->event_ns = speed->maps * costs->event;
    automatic->camera_ray_ns = speed->trace * (costs->ray + levels * costs->hit_level);
    automatic->shadow_ray_ns = speed->trace * costs->shadow_ray;
    automatic->triangle_ns = speed->build * costs->built_triangle;
}
