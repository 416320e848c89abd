/* SPDX-License-Identifier: MIT */
/* Parses the short texts of the command line. Ranges are the server's to judge; form is judged
 * here. */
#include "clients/vitrail/specs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/options.h"
#include "clients/vitrail/scene_reference.h"
#include "protocol/limits.h"
#include "protocol/nearest.h"

static bool fail_spec(struct failure *failure, const char *what, const char *text,
                      const char *expected)
{
    return fail(failure, EXIT_CODE_USAGE, "%s: '%.200s' is not %s", what, text, expected);
}

/* A whole number is sent as an integer, so that the request reads as it was typed. */
static json_t *number_json(double value)
{
    if (fabs(value) <= 0x1p53 && value == (double)(json_int_t)value)
        return json_integer((json_int_t)value);
    return json_real(value);
}

json_t *numbers_parse(const char *text, int count, const char *what, struct failure *failure)
{
    json_t *array = json_array();
    char expected[64], *copy = strdup(text), *rest = copy, *word;
    bool is_ok = array && copy;

    while (is_ok && (word = strsep(&rest, ","))) {
        double value;
        is_ok = number_parse(word, &value) && json_array_append_new(array, number_json(value)) == 0;
    }
    free(copy);
    if (is_ok && json_array_size(array) == (size_t)count)
        return array;
    json_decref(array);
    if (count == 1)
        snprintf(expected, sizeof expected, "a number");
    else
        snprintf(expected, sizeof expected, "%d numbers with commas between", count);
    fail_spec(failure, what, text, expected);
    return NULL;
}

/* One number as JSON. */
static json_t *number_spec(const char *text, const char *what, struct failure *failure)
{
    double value;

    if (number_parse(text, &value))
        return number_json(value);
    fail_spec(failure, what, text, "a number");
    return NULL;
}

static json_t *boolean_spec(const char *text, const char *what, struct failure *failure)
{
    if (!strcmp(text, "true") || !strcmp(text, "false"))
        return json_boolean(text[0] == 't');
    fail_spec(failure, what, text, "true or false");
    return NULL;
}

bool size_parse(const char *text, int *width_px, int *height_px, struct failure *failure)
{
    const char *x = strpbrk(text, "xX");
    char *end;
    long width, height;

    if (!x || strspn(text, "0123456789") != (size_t)(x - text) || x == text || !x[1] ||
        strspn(x + 1, "0123456789") != strlen(x + 1))
        return fail_spec(failure, "--size", text, "WIDTHxHEIGHT in pixels, such as 1280x720");
    width = strtol(text, &end, 10);
    height = strtol(x + 1, &end, 10);
    if (width < 1 || height < 1 || width > LIMIT_PICTURE_SIDE_PX || height > LIMIT_PICTURE_SIDE_PX)
        return fail(failure, EXIT_CODE_USAGE, "--size: '%.60s': each side is from 1 to %d pixels",
                    text, LIMIT_PICTURE_SIDE_PX);
    *width_px = (int)width;
    *height_px = (int)height;
    return true;
}

json_t *tile_spec_parse(const char *text, struct failure *failure)
{
    int x, y, width, height, end = 0;
    bool is_plain = strspn(text, "0123456789,x") == strlen(text);
    if (!is_plain || sscanf(text, "%9d,%9d,%9dx%9d%n", &x, &y, &width, &height, &end) != 4 ||
        text[end]) {
        fail_spec(failure, "--tile", text, "X,Y,WIDTHxHEIGHT in pixels, such as 0,2048,2048x1024");
        return NULL;
    }
    return json_pack("{s:i,s:i,s:i,s:i}", "x", x, "y", y, "width", width, "height", height);
}

/* One KEY of a text, the member of the request it sets, and for which kinds it is. */
struct spec_key {
    const char *key, *member;
    int count;      /* of numbers: 1, 3, 16; or SPEC_* */
    unsigned kinds; /* bit set of the kinds that have it */
};

enum { SPEC_BOOLEAN = 0, SPEC_TEXT = -1, SPEC_BOOLEAN_OR_COLOR = -2 };

static json_t *value_spec(const char *text, int count, const char *what, struct failure *failure)
{
    json_t *value;

    if (count == SPEC_BOOLEAN_OR_COLOR)
        count = strchr(text, ',') ? 3 : SPEC_BOOLEAN;
    if (count == SPEC_BOOLEAN)
        return boolean_spec(text, what, failure);
    if (count == 1)
        return number_spec(text, what, failure);
    if (count != SPEC_TEXT)
        return numbers_parse(text, count, what, failure);
    if (!(value = json_string(text)))
        fail_spec(failure, what, text, "UTF-8");
    return value;
}

/* With the keys that may be set, and the one that was probably meant. */
static bool fail_key(const struct spec_key *keys, unsigned kind, const char *pair, const char *what,
                     struct failure *failure)
{
    char name[64], hint[96] = "", known[256] = "";
    struct nearest nearest = {.text = name};

    snprintf(name, sizeof name, "%.*s", (int)strcspn(pair, "="), pair);
    for (const struct spec_key *k = keys; k->key; k++) {
        size_t used = strlen(known);
        if (!(k->kinds & kind))
            continue;
        nearest_offer(&nearest, k->key);
        snprintf(known + used, sizeof known - used, "%s%s=", used ? ", " : "", k->key);
    }
    if (nearest.name)
        snprintf(hint, sizeof hint, "; did you mean %s=?", nearest.name);
    return fail(failure, EXIT_CODE_USAGE,
                "%s: '%.200s' is nothing that can be set here%s Known: %s", what, pair,
                *hint ? hint : ".", known);
}

/* Sets object[member] from "key=value" by the table. */
static bool apply_pair(json_t *object, const struct spec_key *keys, unsigned kind, const char *pair,
                       const char *what, struct failure *failure)
{
    size_t n = strcspn(pair, "=");
    char name[96];
    json_t *value;

    for (const struct spec_key *k = keys; k->key && pair[n]; k++) {
        if (strlen(k->key) != n || strncmp(k->key, pair, n) != 0 || !(k->kinds & kind))
            continue;
        snprintf(name, sizeof name, "%s: %s", what, k->key);
        if (json_object_get(object, k->member))
            return fail(failure, EXIT_CODE_USAGE, "%s is given twice", name);
        value = value_spec(pair + n + 1, k->count, name, failure);
        return value &&
               (json_object_set_new(object, k->member, value) == 0 || fail_no_memory(failure));
    }
    return fail_key(keys, kind, pair, what, failure);
}

/* All pairs of `text`, with one of `separators` between; changes `text`. */
static bool apply_pairs(json_t *object, const struct spec_key *keys, unsigned kind, char *text,
                        const char *separators, const char *what, struct failure *failure)
{
    char *pair;

    while ((pair = strsep(&text, separators)))
        if (*pair && !apply_pair(object, keys, kind, pair, what, failure))
            return false;
    return true;
}

/* The object that was parsed, or NULL in its place. */
static json_t *keep_if(bool is_ok, json_t *object)
{
    if (is_ok)
        return object;
    json_decref(object);
    return NULL;
}

enum { CAMERA_ANY = 1 };

static const struct spec_key CAMERA_KEYS[] = {
    {"eye", "eye", 3, CAMERA_ANY},
    {"target", "target", 3, CAMERA_ANY},
    {"up", "up", 3, CAMERA_ANY},
    {"matrix", "matrix", 16, CAMERA_ANY},
    {"fov", "fov_y_deg", 1, CAMERA_ANY},
    {"ortho", "ortho_height", 1, CAMERA_ANY},
    {0},
};

static bool camera_is_complete(const json_t *camera, struct failure *failure)
{
    bool has_eye = json_object_get(camera, "eye"), has_target = json_object_get(camera, "target");

    if (json_object_get(camera, "node") || json_object_get(camera, "fit") ||
        json_object_get(camera, "matrix") || (has_eye && has_target))
        return true;
    return fail(failure, EXIT_CODE_USAGE,
                "--camera: needs node:NAME, fit:front|back|left|right|top|bottom|iso|"
                "three-quarter, or eye=x,y,z target=x,y,z");
}

/* Of fit:SIDE. */
static bool is_side(const char *word)
{
    static const char *const sides[] = {"front", "back",   "left", "right",
                                        "top",   "bottom", "iso",  "three-quarter"};

    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++)
        if (!strcmp(word, sides[i]))
            return true;
    return false;
}

json_t *camera_spec_parse(const char *text, struct failure *failure)
{
    json_t *camera = json_object();
    bool is_ok = camera || fail_no_memory(failure);

    for (const char *word = text; is_ok;) {
        char pair[1024];
        size_t n;
        word += strspn(word, " ;");
        if (!*word)
            break;
        if (!strncmp(word, "node:", 5)) { /* to the end: names have blanks in them */
            json_t *name = json_string(word + 5);
            is_ok = name || fail_spec(failure, "--camera", word, "a name in UTF-8");
            json_object_set_new(camera, "node", name);
            break;
        }
        n = strcspn(word, " ;");
        if (n >= sizeof pair) {
            is_ok = fail_spec(failure, "--camera", word, "a camera");
            break;
        }
        snprintf(pair, sizeof pair, "%.*s", (int)n, word);
        word += n;
        if (!strncmp(pair, "fit:", 4))
            json_object_set_new(camera, "fit", json_string(pair + 4));
        else if (!strcmp(pair, "ortho"))
            json_object_set_new(camera, "projection", json_string("orthographic"));
        else if (is_side(pair))
            is_ok = fail(failure, EXIT_CODE_USAGE,
                         "--camera: '%s' is nothing that can be set here; did you mean fit:%s?",
                         pair, pair);
        else
            is_ok = apply_pair(camera, CAMERA_KEYS, CAMERA_ANY, pair, "--camera", failure);
    }
    return keep_if(is_ok && camera_is_complete(camera, failure), camera);
}

enum {
    LIGHT_POINT = 1,
    LIGHT_SPOT = 2,
    LIGHT_DIRECTIONAL = 4,
    LIGHT_RECT = 8,
    LIGHT_DISK = 16,
    LIGHT_AREA = LIGHT_RECT | LIGHT_DISK,
    LIGHT_ANY = LIGHT_POINT | LIGHT_SPOT | LIGHT_DIRECTIONAL | LIGHT_AREA,
};

static const struct spec_key LIGHT_KEYS[] = {
    {"pos", "position", 3, LIGHT_POINT | LIGHT_SPOT | LIGHT_AREA},
    {"dir", "direction", 3, LIGHT_SPOT | LIGHT_DIRECTIONAL | LIGHT_AREA},
    {"color", "color", 3, LIGHT_ANY},
    {"intensity", "intensity", 1, LIGHT_ANY},
    {"width", "width", 1, LIGHT_RECT},
    {"height", "height", 1, LIGHT_RECT},
    {"up", "up", 3, LIGHT_RECT},
    {"radius", "radius", 1, LIGHT_DISK},
    {"range", "range", 1, LIGHT_POINT | LIGHT_SPOT},
    {"inner", "inner_cone_deg", 1, LIGHT_SPOT},
    {"outer", "outer_cone_deg", 1, LIGHT_SPOT},
    {"shadow", "shadow", 0, LIGHT_ANY},
    {0},
};

json_t *light_spec_parse(const char *text, struct failure *failure)
{
    static const char *const KINDS[] = {"point", "spot", "directional", "rect", "disk"};
    size_t n = strcspn(text, ":");
    unsigned kind = 0;
    json_t *light = NULL;
    char *copy;
    bool is_ok;

    for (unsigned i = 0; i < sizeof KINDS / sizeof *KINDS; i++)
        if (strlen(KINDS[i]) == n && !strncmp(text, KINDS[i], n)) {
            kind = 1u << i;
            light = json_pack("{s:s}", "type", KINDS[i]);
        }
    if (!kind) {
        fail_spec(failure, "--light", text,
                  "point:..., spot:..., directional:..., rect:... or disk:...");
        return NULL;
    }
    copy = strdup(text[n] ? text + n + 1 : "");
    is_ok = (light && copy) || fail_no_memory(failure);
    is_ok = is_ok && apply_pairs(light, LIGHT_KEYS, kind, copy, "; ", "--light", failure);
    free(copy);
    return keep_if(is_ok, light);
}

/* One number for grey, or three. */
static json_t *radiance_parse(const char *text, struct failure *failure)
{
    double value;

    if (number_parse(text, &value))
        return json_pack("[o,o,o]", number_json(value), number_json(value), number_json(value));
    return numbers_parse(text, 3, "--environment", failure);
}

/* Not the numbers of a sky and a ground, nor what begins so: "1:x" is a mistake, "1k.hdr" a file.
 */
static bool names_map(const char *text)
{
    size_t numbers = strspn(text, "0123456789+-.,eE ");
    return environment_reference_is_plain(text) || (text[numbers] && text[numbers] != ':');
}

json_t *environment_spec_parse(const char *text, struct failure *failure)
{
    const char *colon = strchr(text, ':');
    char *sky_text;
    json_t *sky, *ground;

    if (names_map(text)) {
        json_t *map = json_pack("{s:s}", "image", text);
        if (!map)
            fail_spec(failure, "--environment", text, "UTF-8");
        return map;
    }
    if (!colon) {
        fail_spec(failure, "--environment", text,
                  "studio, a map, or SKY:GROUND, each a number or r,g,b");
        return NULL;
    }
    sky_text = strndup(text, (size_t)(colon - text));
    sky = sky_text ? radiance_parse(sky_text, failure) : NULL;
    ground = sky ? radiance_parse(colon + 1, failure) : NULL;
    free(sky_text);
    if (ground)
        return json_pack("{s:o, s:o}", "sky", sky, "ground", ground);
    json_decref(sky);
    return NULL;
}

enum { SPEC_ANY = 1 };

static const struct spec_key CLIP_KEYS[] = {
    {"cap", "cap", SPEC_BOOLEAN_OR_COLOR, SPEC_ANY},
    {"shadows", "shadows", SPEC_BOOLEAN, SPEC_ANY},
    {0},
};

json_t *clip_spec_parse(const char *text, struct failure *failure)
{
    json_t *clip = json_object(), *plane = NULL;
    char *copy = strdup(text), *rest = copy;
    bool is_ok = (clip && copy) || fail_no_memory(failure);

    if (is_ok) {
        plane = numbers_parse(strsep(&rest, ";"), 4, "--clip", failure);
        is_ok =
            plane && (json_object_set_new(clip, "plane", plane) == 0 || fail_no_memory(failure));
    }
    is_ok = is_ok && apply_pairs(clip, CLIP_KEYS, SPEC_ANY, rest, ";", "--clip", failure);
    free(copy);
    return keep_if(is_ok, clip);
}

static const struct spec_key EDGES_KEYS[] = {
    {"crease", "crease_deg", 1, SPEC_ANY},
    {"borders", "borders", SPEC_BOOLEAN, SPEC_ANY},
    {"silhouettes", "silhouettes", SPEC_BOOLEAN, SPEC_ANY},
    {"color", "color", 3, SPEC_ANY},
    {"width", "width_px", 1, SPEC_ANY},
    {"hidden", "hidden", 1, SPEC_ANY},
    {0},
};

json_t *edges_spec_parse(const char *text, struct failure *failure)
{
    json_t *edges = json_object();
    char *copy = strdup(strcmp(text, "default") != 0 ? text : "");
    bool is_ok = (edges && copy) || fail_no_memory(failure);

    if (is_ok && !*text)
        is_ok = fail_spec(failure, "--edges", text, "default, or such as crease=20;width=2");
    is_ok = is_ok && apply_pairs(edges, EDGES_KEYS, SPEC_ANY, copy, ";", "--edges", failure);
    free(copy);
    return keep_if(is_ok, edges);
}

static const struct spec_key GRID_KEYS[] = {
    {"density", "density", 1, SPEC_ANY},
    {"color", "color", 3, SPEC_ANY},
    {"extinction", "extinction", 3, SPEC_ANY},
    {"anisotropy", "anisotropy", 1, SPEC_ANY},
    {0},
};

/* No value has a colon, but a name may. */
bool grid_spec_parse(const char *text, json_t *grids, struct failure *failure)
{
    const char *colon = strrchr(text, ':');
    json_t *grid = json_object();
    json_t *name = colon ? json_stringn(text, (size_t)(colon - text)) : NULL;
    char *copy = strdup(colon ? colon + 1 : "");
    bool is_ok = (grid && copy) || fail_no_memory(failure);

    if (is_ok && (!name || colon == text || !colon[1]))
        is_ok = fail_spec(failure, "--grid", text, "NAME:density=5;color=r,g,b");
    if (is_ok && json_object_get(grids, json_string_value(name)))
        is_ok = fail(failure, EXIT_CODE_USAGE, "--grid: '%.200s' is given twice",
                     json_string_value(name));
    is_ok = is_ok && apply_pairs(grid, GRID_KEYS, SPEC_ANY, copy, ";", "--grid", failure) &&
            (json_object_set(grids, json_string_value(name), grid) == 0 || fail_no_memory(failure));
    free(copy);
    json_decref(name);
    json_decref(grid);
    return is_ok;
}

static const struct spec_key PROCEDURE_KEYS[] = {
    {"min", "min", 3, SPEC_ANY},
    {"max", "max", 3, SPEC_ANY},
    {"size", "size", 3, SPEC_ANY},
    {"density", "density", 1, SPEC_ANY},
    {"color", "color", 3, SPEC_ANY},
    {"extinction", "extinction", 3, SPEC_ANY},
    {"anisotropy", "anisotropy", 1, SPEC_ANY},
    {"seed", "seed", 1, SPEC_ANY},
    {"detail", "detail", 1, SPEC_ANY},
    {0},
};

static const struct procedure_default {
    const char *name;
    double density; /* [1/m] */
    double min[3], max[3];
} PROCEDURES[] = {
    {"smoke", 20, {-1, 0, -1}, {1, 4, 1}},
    {"fog", 1, {-4, 0, -4}, {4, 1, 4}},
    {"cloud", 5, {-2, 0, -2}, {2, 2, 2}},
};

static bool put_default(json_t *grid, const char *key, const double values[3])
{
    return json_object_get(grid, key) ||
           json_object_set_new(grid, key,
                               json_pack("[o,o,o]", number_json(values[0]), number_json(values[1]),
                                         number_json(values[2]))) == 0;
}

/* Cubes, of which a box with three sides holds about 2^19; a flat box is left to the server. */
static bool put_size(json_t *grid)
{
    enum { VOXELS = 1 << 19, SIDE_MOST = 8192 };
    double sides[3], size[3], volume = 1;
    for (size_t k = 0; k < 3; k++) {
        sides[k] = json_number_value(json_array_get(json_object_get(grid, "max"), k)) -
                   json_number_value(json_array_get(json_object_get(grid, "min"), k));
        volume *= sides[k];
    }
    double voxel = cbrt(volume / VOXELS);
    for (int k = 0; k < 3; k++)
        size[k] = voxel > 0 ? fmin(fmax(round(sides[k] / voxel), 1), SIDE_MOST) : 1;
    return put_default(grid, "size", size);
}

/* "seed" and "detail" are members of the procedure itself. */
static bool put_procedure(json_t *grid, const char *name)
{
    static const char *const moved[] = {"seed", "detail"};
    json_t *procedure = json_pack("{s:s}", "type", name);
    bool is_ok = procedure != NULL;
    for (int i = 0; is_ok && i < 2; i++) {
        json_t *value = json_object_get(grid, moved[i]);
        is_ok = !value || (json_object_set(procedure, moved[i], value) == 0 &&
                           json_object_del(grid, moved[i]) == 0);
    }
    is_ok = is_ok && json_object_set(grid, "procedure", procedure) == 0;
    json_decref(procedure);
    return is_ok;
}

json_t *procedure_spec_parse(const char *text, struct failure *failure)
{
    const struct procedure_default *found = NULL;
    size_t n = strcspn(text, ":");
    for (size_t i = 0; i < sizeof PROCEDURES / sizeof *PROCEDURES; i++)
        if (strlen(PROCEDURES[i].name) == n && !strncmp(text, PROCEDURES[i].name, n))
            found = &PROCEDURES[i];
    if (!found) {
        fail_spec(failure, "--procedure", text,
                  "smoke, fog or cloud, and such as :density=5;seed=3");
        return NULL;
    }
    json_t *grid = json_pack("{s:s}", "name", found->name);
    char *copy = strdup(text[n] ? text + n + 1 : "");
    bool is_ok = ((grid && copy) || fail_no_memory(failure)) &&
                 apply_pairs(grid, PROCEDURE_KEYS, SPEC_ANY, copy, ";", "--procedure", failure);
    if (is_ok && !json_object_get(grid, "density"))
        is_ok = json_object_set_new(grid, "density", number_json(found->density)) == 0 ||
                fail_no_memory(failure);
    is_ok =
        is_ok && ((put_default(grid, "min", found->min) && put_default(grid, "max", found->max) &&
                   put_size(grid) && put_procedure(grid, found->name)) ||
                  fail_no_memory(failure));
    free(copy);
    return keep_if(is_ok, grid);
}

static const struct spec_key PART_KEYS[] = {
    {"parent", "parent", SPEC_TEXT, SPEC_ANY},
    {"pos", "pos", 3, SPEC_ANY},
    {"matrix", "matrix", 16, SPEC_ANY},
    {"scene", PART_FILE_SCENE, SPEC_TEXT, SPEC_ANY},
    {"unit", PART_FILE_UNIT, SPEC_TEXT, SPEC_ANY},
    {"up", PART_FILE_UP, SPEC_TEXT, SPEC_ANY},
    {"deflection", PART_FILE_DEFLECTION, SPEC_TEXT, SPEC_ANY},
    {0},
};

/* "pos" becomes the matrix that moves there. */
static bool place_part(json_t *part, struct failure *failure)
{
    json_t *position = json_object_get(part, "pos"), *matrix;

    if (!position)
        return true;
    if (json_object_get(part, "matrix"))
        return fail(failure, EXIT_CODE_USAGE, "--part: pos and matrix say the same");
    matrix = json_pack("[i,i,i,i, i,i,i,i, i,i,i,i, O,O,O,i]", 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,
                       json_array_get(position, 0), json_array_get(position, 1),
                       json_array_get(position, 2), 1);
    return (json_object_set_new(part, "matrix", matrix) == 0 &&
            json_object_del(part, "pos") == 0) ||
           fail_no_memory(failure);
}

bool part_spec_parse(const char *text, json_t *parts, struct failure *failure)
{
    size_t n = strcspn(text, "=");
    json_t *part = json_object(), *name = json_stringn(text, n);
    char *copy = strdup(text[n] ? text + n + 1 : ""), *rest = copy;
    const char *scene = copy ? strsep(&rest, ";") : NULL;
    bool is_ok = (part && copy) || fail_no_memory(failure);

    if (is_ok && (!n || !text[n] || !scene || !*scene))
        is_ok = fail_spec(failure, "--part", text, "NAME=FILE|SCENE");
    if (is_ok && (!name || json_object_set_new(part, "scene", json_string(scene)) != 0))
        is_ok = fail_spec(failure, "--part", text, "UTF-8");
    if (is_ok && json_object_get(parts, json_string_value(name)))
        is_ok = fail(failure, EXIT_CODE_USAGE, "--part: '%.200s' is given twice",
                     json_string_value(name));
    is_ok = is_ok && apply_pairs(part, PART_KEYS, SPEC_ANY, rest, ";", "--part", failure) &&
            place_part(part, failure) &&
            (json_object_set(parts, json_string_value(name), part) == 0 || fail_no_memory(failure));
    free(copy);
    json_decref(name);
    json_decref(part);
    return is_ok;
}
