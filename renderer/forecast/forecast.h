/* SPDX-License-Identifier: MIT */
/* How long the parts of a frame will take, from counts of their work and the speed of a device, and
 * how far their pictures are off. Shadow structures say which parts they have
 * (renderer/shadows/technique.h). Pure functions. Thread: any.
 *
 * The cost of each unit of work was fitted once, over shared scenes on a software rasteriser
 * (docs/explanation/cost-model.md; tests/bench/fit_models.py repeats it). A device is
 * known by how much longer than there it takes for four kinds of work, which
 * renderer/frame/calibrate.h measures. */
#ifndef VITRAIL_RENDERER_FORECAST_FORECAST_H
#define VITRAIL_RENDERER_FORECAST_FORECAST_H

#include <stdbool.h>
#include <stddef.h>

/* How much there is to do for a frame, as renderer/cost/workload.h counts it. */
struct workload {
    double pixels;
    double covered; /* share of the pixels that show something opaque, [0, 1] */
    double layers;  /* mean transparent surfaces per pixel before what is opaque */
    /* Where layers are peeled: from how many sides, and how many times; of all times together the
     * pixels in the bounds of those that still have a layer, by the picture's; and transparent
     * triangles in view, which are drawn each time. Else 0. */
    double peeled_sides, peels, peeled_pixels, peeled_triangles;
    /* Mean lights that shine on a visible surface; area lights count once per sample. */
    double lit;
    double lit_areas, area_rays; /* of these the area lights, each once, and their samples */
    double listed;    /* mean lights in the list of a visible surface, which it walks: those without
                         a range always, others where its cluster meets their reach */
    double textures;  /* mean textures of the material of a visible surface */
    double triangles; /* of all drawables, and of those in view */
    double triangles_in_view;
    size_t lights, shadowed_lights; /* that reach the view; that have casters as well */
    size_t deep_lights;             /* of the shadowed: with transparent casters */
    double map_faces;               /* of all shadowed lights; deep ones among them */
    double deep_faces;
    double map_triangles;  /* opaque casters, drawn into a face each */
    double deep_triangles; /* transparent ones */
    double deep_share;     /* events over texels of the deep faces */
    /* Layers of the deep faces' maps, mean; 0 where the view asks for none that have several. */
    double deep_layers;
    /* Of the picture's, that faces of shadow volumes (sides, and casters themselves) cover before
     * what light gets to, most of them in tiles. Of all lights together; those of each face count
     * for themselves. */
    double face_pixels;
    /* Towards an environment map, which whole pictures by rays take at each visible surface. */
    double directions;
    /* Of the grid in which the light of haze is found (renderer/scene/atmosphere_grid.h): slices of
     * columns before what they show, 0 without haze; and mean lights that shine on their points. */
    double haze_slices, haze_lit;
    /* Of density grids, means over the camera's rays: cells that they cross; lights in reach of
     * each grid that they meet; cells on the ways from there to those that shine there. */
    double grid_cells, grid_lights, grid_lit_cells;
    double grid_shadow_cells; /* on the ways from a visible surface to all that shine on it */
    /* Of the nodes over the picture at which a rasterised one finds the light in grids: how many
     * are in some, the lights in reach of these, and the cells on the ways to those that shine
     * there. */
    double grid_nodes, grid_node_lights, grid_node_cells;
    /* Where nodes look kept depths up: cells on the ways to all points that these are found at. */
    double grid_point_cells;
    int grid_samples; /* quality.atmosphere_samples; 0: the default */
};

/* Times over those of the machine of the fit. Zeroed = not measured. */
struct device_speed {
    double frame_ms; /* of a rasterised frame with nothing to do; not a ratio */
    double shade;    /* rasterising and shading the picture */
    double maps;     /* shadow maps: casters, texels, events */
    double trace;    /* rays and the shading of what they meet, on all cores */
    double build;    /* the ray tracer's structure */
};
bool device_speed_is_known(const struct device_speed *speed);

/* Costs on the machine of the fit, in ns of processor time unless the name says ms. msaa_*: what 4
 * samples per pixel add to those of 1. More of them come in rounds of 4, each with all of it. */
struct device_costs {
    double pixel, msaa_pixel; /* of the image; per covered one msaa_covered more */
    double msaa_covered;
    double area_light;        /* an area light at a surface; of others: */
    double light, look, tap;  /* a surface that a light shines on, looking into its map, and
                                 each tap of that */
    double walk;              /* a light in the list of a surface, whether it shines or not */
    double layer, msaa_layer; /* a transparent surface */
    /* Peeling: each time, pixels in bounds, and transparent triangles; a pixel of the picture for
     * each side. */
    double peel_ms, peeled_pixel, peeled_triangle, peeled_side, msaa_peeled_side;
    double texture, msaa_texture;          /* of a surface */
    double triangle, msaa_triangle;        /* in view */
    double drawn_frame_ms;                 /* whatever a scene is drawn of */
    double face_ms, texel, caster;         /* of all shadow maps */
    double deep_texel, deep_caster, event; /* of deep ones besides */
    double layer_texel; /* of a layer of maps that have several, in the place of the lists */
    /* From the camera; where it meets something opaque, per doubling of the triangles. */
    double ray, hit_level;
    double more_ray, more_hit_level; /* likewise, of each sample after a pixel's first */
    double traced_triangle, msaa_traced_triangle; /* in view */
    double shadow_ray, traced_walk;               /* traced_walk: as walk, of rays */
    /* A shadow ray to a sample of an area, per doubling of the triangles; at a transparent surface
     * on a camera ray, each. */
    double area_ray_level, layer_area_light;
    double layer_ray, layer_light; /* through a transparent surface; a light there besides */
    double traced_texture;
    double traced_frame_ms;
    double point_pixel, msaa_point_pixel; /* traced shadows: of the image; a surface that asks; */
    double point, point_level;            /* its rays, per doubling of the triangles; those of a */
    double layer_point_ray;               /* transparent surface besides */
    double point_walk;                    /* as walk, besides it */
    double point_area_level, layer_area_ray; /* as point_level and layer_point_ray, of areas */
    /* Grids of triangles: a triangle for a light, a surface for a light, whether it shines there or
     * not; at a surface, for a light that does and for each of its samples, a root of the
     * triangles, as its cell has some. */
    double area_triangle, area_point, area_asked, area_ray;
    double built_triangle;
    /* Shadow volumes: a light at a surface; a triangle for a light; a pixel that a face covers. */
    double volume_point, volume_triangle, msaa_volume_triangle, volume_pixel, msaa_volume_pixel;
    double haze_slice, haze_ray;  /* a slice of the haze's grid; a ray from it, per doubling of the
                                     triangles. What maps take of its lights is as of surfaces */
    double grid_point, grid_cell; /* a point of a density grid for a light in reach, with its ray; a
                                     cell that is crossed */
    /* Of rasterised pictures: a node in a grid, a light in its reach, a cell that is crossed. */
    double smoke_node, smoke_light, smoke_cell;
};
extern const struct device_costs forecast_costs;

struct forecast_setting {
    int samples;           /* per pixel */
    int shadow_resolution; /* texels per side */
    int shadow_taps;
    bool has_shadows;
    bool is_warm; /* shadow maps, or the ray tracer's structure, are there from a frame before */
};

/* The work of a frame by its kinds: what renderer/cost/learning corrects each by itself. */
enum forecast_term {
    FORECAST_TERM_FRAME, /* whatever is drawn */
    FORECAST_TERM_PIXELS,
    FORECAST_TERM_LIGHTS, /* that shine on a surface */
    FORECAST_TERM_WALKS,  /* that are in the list of a surface */
    FORECAST_TERM_LOOKS,  /* into maps */
    FORECAST_TERM_LAYERS, /* as of lists, */
    FORECAST_TERM_PEELS,  /* and what peeling them takes besides */
    FORECAST_TERM_TEXTURES,
    FORECAST_TERM_TRIANGLES,
    FORECAST_TERM_MAPS,      /* shadow maps that are built, */
    FORECAST_TERM_DEEP,      /* and what deep ones take besides */
    FORECAST_TERM_RAYS,      /* from the camera, one for each pixel, */
    FORECAST_TERM_MORE_RAYS, /* and the others */
    FORECAST_TERM_TRACED_TRIANGLES,
    FORECAST_TERM_SHADOW_RAYS,
    FORECAST_TERM_TRACED_WALKS,
    FORECAST_TERM_LAYER_RAYS,
    FORECAST_TERM_TRACED_TEXTURES,
    FORECAST_TERM_POINTS, /* of traced shadows: surfaces that ask, */
    FORECAST_TERM_POINT_RAYS,
    FORECAST_TERM_POINT_WALKS,
    FORECAST_TERM_BUILD,     /* of the ray tracer's structure */
    FORECAST_TERM_HAZE,      /* its light, found by the device, */
    FORECAST_TERM_HAZE_RAYS, /* or by rays */
    FORECAST_TERM_GRIDS,     /* light from density grids, and their shadows */
    FORECAST_TERM_COUNT
};

/* ---- parts of a frame, on the device ---- */

struct forecast_frame { /* all required */
    const struct workload *workload;
    const struct forecast_setting *setting;
    const struct device_speed *speed;
};

/* Each adds its ms by kinds of work. Of a rasterised picture, without shadows: */
void forecast_add_surfaces(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* What it takes besides where its layers are peeled. */
void forecast_add_peels(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* Shadow maps, and looking into them. */
void forecast_add_maps(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* Likewise of maps with several layers, and without lists. */
void forecast_add_layered_maps(const struct forecast_frame *frame,
                               double terms[FORECAST_TERM_COUNT]);
/* Grids of triangles before each light, and the triangles of a cell for each sample of a light at
 * each surface. */
void forecast_add_area(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* A ray to each light of each surface, and the ray tracer's structure. */
void forecast_add_points(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* Likewise of shadow volumes. */
void forecast_add_volumes(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
/* A whole picture by rays, and the ray tracer's structure. */
void forecast_add_rays(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);

/* Of all kinds. */
double forecast_sum_ms(const double terms[FORECAST_TERM_COUNT]);

/* ---- the error of shadows ---- */

/* RMSE of linear colour by shadows alone, of an image whose side (the root of its pixels) is 480
 * (docs/explanation/cost-model.md). Of maps: by the width of a texel. */
double forecast_maps_error(const struct forecast_setting *setting);
/* Likewise, with what four moments of several casters do not tell. */
double forecast_moments_error(const struct forecast_setting *setting);

/* ---- kinds of work apart, on the machine of the fit ---- */

/* Without frame_ms: what calibration divides by. Shading comes with what looks into maps. */
double forecast_shade_ms(const struct workload *workload, const struct forecast_setting *setting);
double forecast_maps_ms(const struct workload *workload, const struct forecast_setting *setting);
double forecast_trace_ms(const struct workload *workload, const struct forecast_setting *setting);
double forecast_build_ms(const struct workload *workload);

/* Memory of all shadow maps together: where it is more than there is, they are made in batches,
 * anew for every frame. */
double forecast_maps_bytes(const struct workload *workload, const struct forecast_setting *setting);

#endif
