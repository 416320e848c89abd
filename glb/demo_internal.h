/* SPDX-License-Identifier: MIT */
/* What the files of the demo scene share: the plan of the chapel, its materials, and the parts. */
#ifndef VITRAIL_GLB_DEMO_INTERNAL_H
#define VITRAIL_GLB_DEMO_INTERNAL_H

#include "glb/glb_builder.h"
#include "glb/shapes.h"

/* The plan, in metres. */
#define NAVE_HALF_LENGTH 10.0
#define NAVE_HALF_WIDTH 5.0
#define WALL_THICKNESS 0.5
#define AISLE_HEIGHT 5.2
#define ARCADE_X 3.1 /* of the two rows of columns */
#define ARCADE_THICKNESS 0.5
#define BAY 4.0         /* columns at z = -6, -2, 2, 6; bays are centred between them */
#define ARCH_SPRING 3.6 /* top of the columns */
#define VAULT_SPRING 5.6
#define ROSE_RADIUS 2.2
#define ROSE_Y 5.6
#define LANCET_WIDTH 1.3
#define LANCET_BOTTOM 1.4
#define LANCET_SPRING 3.5
#define LANCET_POINTEDNESS 0.9
enum { BAY_COUNT = 5 };

struct demo {
    struct glb_builder *builder;
    int texture_size_px;
    double light_factor;
    int coarseness;
    int stone, floor, trim, dark_wood, wax, flame, iron, gold; /* materials */
};

struct demo_place {
    const char *name;
    int parent, mesh;
    double at[3];
    double yaw_deg; /* about +Y */
};
int demo_add(struct demo *demo, const struct demo_place *place);
int demo_add_group(struct demo *demo, const char *name);
double demo_bay_z(int bay); /* centre of a bay */
/* What the scene's coarseness leaves of so many sides. */
int demo_sides(const struct demo *demo, int sides);

/* demo_texture.c: pictures of stone; return a texture. */
int demo_add_floor_texture(struct demo *demo);
int demo_add_stone_texture(struct demo *demo);
int demo_add_picture(struct demo *demo, const char *name, const uint8_t *rgba, int width_px,
                     int height_px, enum glb_wrap wrap);

/* demo_glass.c: draws window patterns. glass: the texture of the base colour; clear: 1 where light
 * passes and 0 on the lead. */
enum demo_window {
    DEMO_ROSE,
    DEMO_LANCET_MEDALLIONS,
    DEMO_LANCET_SCALES,
    DEMO_LANCET_LILY,
    DEMO_WINDOW_COUNT
};
void demo_draw_window(struct demo *demo, enum demo_window window, int *glass, int *clear);

/* The parts, each with its own nodes. */
void demo_add_walls(struct demo *demo);
void demo_add_windows(struct demo *demo);
void demo_add_props(struct demo *demo);
void demo_add_vessel(struct demo *demo);
void demo_add_curtains(struct demo *demo);
void demo_add_candles(struct demo *demo);
void demo_add_lights(struct demo *demo);
void demo_add_cameras(struct demo *demo);

/* A light of the scene at eye, aimed at target (spots). */
struct demo_light {
    const char *name;
    enum glb_light_type type;
    double eye[3], target[3], color[3];
    double intensity, range, inner_deg, outer_deg;
};
void demo_add_light(struct demo *demo, int parent, const struct demo_light *light);

#endif
