/* SPDX-License-Identifier: MIT */
/* The short texts of the command line for sizes, colours, cameras, lights, cuts, parts and smoke,
 * as JSON of a request. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SPECS_H
#define VITRAIL_CLIENTS_VITRAIL_SPECS_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"

/* Each returns a new reference, or NULL and a usage failure that says what is wrong and what is
 * meant. */

/* "node:NAME" | "fit:front|top|right|iso" | "eye=x,y,z target=x,y,z [up=x,y,z]" | "matrix=16
 * numbers"; before a node or fit, and anywhere in the others, also "fov=degrees" and
 * "ortho=metres". Words are apart by blanks or ';'. */
json_t *camera_spec_parse(const char *text, struct failure *failure);

/* "point:KEY=VALUE;...", "spot:...", "directional:..." with pos, dir, color, intensity, range,
 * inner, outer (degrees), shadow (true or false). */
json_t *light_spec_parse(const char *text, struct failure *failure);

/* "SKY:GROUND", each one number or r,g,b, in nits. */
json_t *environment_spec_parse(const char *text, struct failure *failure);

/* "A,B,C,D[;cap=true|false|r,g,b][;shadows=true|false]": a clip plane. */
json_t *clip_spec_parse(const char *text, struct failure *failure);

/* "default" or "KEY=VALUE;..." with crease (degrees), borders, silhouettes (true or false), color,
 * width (pixels), hidden: feature edges. */
json_t *edges_spec_parse(const char *text, struct failure *failure);

/* "NAME=FILE|SCENE-ID[;parent=NODE][;pos=x,y,z|;matrix=16 numbers]" into parts[NAME], whose "scene"
 * is the file or id as given. With ";scene=NAME", "unit", "up" and "deflection" the part has the
 * members below, which say how the file is read and are no members of a request. */
#define PART_FILE_SCENE "file.scene"
#define PART_FILE_UNIT "file.unit"
#define PART_FILE_UP "file.up"
#define PART_FILE_DEFLECTION "file.deflection"
bool part_spec_parse(const char *text, json_t *parts, struct failure *failure);

/* "NAME:KEY=VALUE;..." with density (1/m), color, extinction, anisotropy, into grids[NAME]: another
 * look of a density grid. */
bool grid_spec_parse(const char *text, json_t *grids, struct failure *failure);

/* "smoke|fog|cloud[:KEY=VALUE;...]" with min, max (metres), size (voxels), density (1/m), color,
 * extinction, anisotropy, seed, detail: a density grid as the extension VITRAIL_density_grids has
 * it. What is not said is that of the procedure, voxels are cubes. */
json_t *procedure_spec_parse(const char *text, struct failure *failure);

/* Exactly `count` numbers with commas between; `what` names the option for the message. */
json_t *numbers_parse(const char *text, int count, const char *what, struct failure *failure);

/* "X,Y,WxH" in pixels: a tile of a picture. */
json_t *tile_spec_parse(const char *text, struct failure *failure);

/* "WxH" in pixels. */
bool size_parse(const char *text, int *width_px, int *height_px, struct failure *failure);

#endif
