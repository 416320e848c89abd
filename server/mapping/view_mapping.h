/* SPDX-License-Identifier: MIT */
/* Between the wire's structs and the renderer's: requests to views, reports to stats. Thread: any;
 * nothing here touches GL or the network. */
#ifndef VITRAIL_SERVER_MAPPING_VIEW_MAPPING_H
#define VITRAIL_SERVER_MAPPING_VIEW_MAPPING_H

#include "protocol/capabilities.h"
#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "protocol/render_request.h"
#include "renderer/frame/texture_speed.h"
#include "renderer/frame_report.h"
#include "renderer/image/image.h"
#include "renderer/image/tone_map.h"
#include "renderer/renderer.h"
#include "renderer/view.h"

/* The arrays that a view points into. Zeroed = empty. */
struct view_storage {
    struct view_light *lights;
    struct view_node_override *nodes;
    struct view_material_override *materials;
    struct view_grid_override *grids;
    struct view_part *parts;
    double (*clip_planes)[4];
    struct view_cut *cuts; /* per clip plane */
};
void view_storage_finish(struct view_storage *storage); /* accepts zeroed; zeroes */

/* Fills view and storage (whose former contents are overwritten). The view borrows arrays from
 * storage and names from request: both must outlive it. Fails only for want of memory. */
MUST_CHECK bool view_from_request(const struct render_request *request,
                                  struct view_storage *storage, struct view *view,
                                  struct error *err);

/* Of a request whose max_error and budget_ms are chosen for. */
void view_quality_from_request(const struct request_quality *from, struct view_quality *to);

/* The rest of a request, for those who tone map and encode. */
void tone_map_from_request(const struct render_request *request, struct tone_map_desc *desc);
/* What an answer in the format needs of the picture, at most. */
struct view_screen view_screen_from_request(const struct render_request *request,
                                            enum image_format format);

/* Copies the report of a frame and what the request says about it. Queue, encode, total, id, view
 * and revision are left to those who know them: total is the renderer's until then. device names
 * the device (renderer_info.renderer). */
void frame_stats_from_report(const struct render_request *request,
                             const struct frame_report *report, const char *device,
                             struct frame_stats *stats);

void device_capabilities_from_info(const struct renderer_info *info,
                                   struct device_capabilities *device);

void device_blocks_from_speed(const struct texture_speed *speed, struct device_blocks *blocks);

#endif
