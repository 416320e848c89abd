/* SPDX-License-Identifier: MIT */
/* Bad render requests: each is refused with its code, the pointer to the member, and words that
 * help. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/limits.h"
#include "protocol/render_request.h"

#define ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
#define BODY(members) "{\"scene\":\"" ID "\"," members "}"

struct refusal {
    const char *json;
    enum error_code code;
    const char *pointer;
    const char *words; /* part of the message */
};

/* Parses and checks that nothing is left behind. */
static struct error refuse(const char *json, size_t length)
{
    struct render_request request;
    struct error err = {0};
    memset(&request, 0xA5, sizeof request);
    bool is_read = render_request_parse(json, length, &request, &err);
    if (is_read) {
        render_request_finish(&request);
        fail_msg("accepted: %.200s", json);
    }
    assert_int_equal(request.width, 0);
    assert_null(request.lights);
    assert_null(request.nodes);
    assert_null(request.materials);
    return err;
}

static void check(const struct refusal *refusals, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const struct refusal *r = &refusals[i];
        struct error err = refuse(r->json, strlen(r->json));
        if (err.code != r->code || strcmp(err.pointer, r->pointer) != 0 ||
            !strstr(err.message, r->words))
            fail_msg("%s\n  gave %s at '%s': %s\n  expected %s at '%s': ...%s...", r->json,
                     error_code_name(err.code), err.pointer, err.message, error_code_name(r->code),
                     r->pointer, r->words);
    }
}
#define CHECK(refusals) check(refusals, sizeof(refusals) / sizeof *(refusals))

#define INVALID ERROR_INVALID_REQUEST

static void texts_that_are_no_request(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {"", INVALID, "", "empty"},
        {" ", INVALID, "", "not valid JSON"},
        {"null", INVALID, "", "not valid JSON"},
        {"{", INVALID, "", "line 1"},
        {"[]", INVALID, "", "must be an object"},
        {"{}", INVALID, "/scene", "required"},
        {BODY("\"width\":64") "x", INVALID, "", "end of file"},
        {BODY("\"width\":64,\"width\":65"), INVALID, "", "duplicate"},
        {BODY("\"width\":NaN"), INVALID, "", "not valid JSON"},
        {BODY("\"width\":Infinity"), INVALID, "", "not valid JSON"},
        {BODY("\"exposure_ev\":1e999"), INVALID, "", "a number is too large"},
        {BODY("\"width\":99999999999999999999"), INVALID, "", "a number is too large"},
        {BODY("\"width\":0x40"), INVALID, "", "not valid JSON"},
        {BODY("\"width\":064"), INVALID, "", "not valid JSON"},
        {BODY("'width':64"), INVALID, "", "not valid JSON"},
        {BODY("\"width\":64,"), INVALID, "", "not valid JSON"},
        {BODY("\"camera\":{\"node\":\"\xC3\"}"), INVALID, "", "not valid JSON"},
        {BODY("\"camera\":{\"node\":\"\xFF\"}"), INVALID, "", "not valid JSON"},
        {BODY("\"camera\":{\"node\":\"a\\u0000b\"}"), INVALID, "", "not valid JSON"},
        {BODY("\"camera\":{\"node\":\"\\ud800\"}"), INVALID, "", "not valid JSON"},
        {"\xEF\xBB\xBF{}", INVALID, "", "not valid JSON"},
        {BODY("\"colour\":1"), INVALID, "/colour", "no such member"},
        {BODY("\"widht\":1"), INVALID, "/widht", "did you mean width? known: "},
        {BODY("\"widht\":1"), INVALID, "/widht", "highlight, edges"},
        {BODY("\"quality\":{\"shadows\":\"depe\"}"), INVALID, "/quality/shadows",
         "did you mean deep? must be one of: "},
        {BODY("\"a/b~c\":1"), INVALID, "/a~1b~0c", "no such member"},
        {BODY("\"\":1"), INVALID, "/", "no such member"},
        {BODY("\"unknown\":null"), INVALID, "/unknown", "no such member"},
    };
    CHECK(refusals);
}

static void scenes_that_cannot_exist(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {"{\"scene\":null}", INVALID, "/scene", "required"},
        {"{\"scene\":7}", INVALID, "/scene", "7"},
        {"{\"scene\":\"\"}", INVALID, "/scene", "1 to"},
        {"{\"scene\":\"nope\"}", ERROR_NOT_FOUND, "/scene", "nope"},
        {"{\"scene\":\"../../etc/passwd\"}", ERROR_NOT_FOUND, "/scene", "64 lowercase"},
        {"{\"scene\":\"0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef\"}",
         ERROR_NOT_FOUND, "/scene", "64 lowercase"},
    };
    CHECK(refusals);
}

static void sizes_out_of_range(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"width\":0"), INVALID, "/width", "from 1 to 65536"},
        {BODY("\"height\":0"), INVALID, "/height", "from 1 to 65536"},
        {BODY("\"width\":-1"), INVALID, "/width", "-1"},
        {BODY("\"width\":16385"), INVALID, "/width", "16385"},
        {BODY("\"width\":1e18"), INVALID, "/width", "from 1 to 65536"},
        {BODY("\"width\":9223372036854775807"), INVALID, "/width", "from 1 to 65536"},
        {BODY("\"height\":16385"), INVALID, "/height", "from 1 to 16384; tiles"},
        {BODY("\"width\":65537,\"tile\":{\"width\":1,\"height\":1}"), INVALID, "/width", "65536"},
        {BODY("\"tile\":{\"width\":1}"), INVALID, "/tile/height", ""},
        {BODY("\"tile\":[0,0,1,1]"), INVALID, "/tile", ""},
        {BODY("\"width\":64,\"tile\":{\"x\":64,\"width\":1,\"height\":1}"), INVALID, "/tile/x",
         "from 0 to 63"},
        {BODY("\"width\":64,\"tile\":{\"x\":60,\"width\":5,\"height\":1}"), INVALID, "/tile/width",
         "4 columns from x 60 on"},
        {BODY("\"height\":9,\"tile\":{\"y\":8,\"width\":5,\"height\":2}"), INVALID, "/tile/height",
         "1 rows from y 8 on"},
        {BODY("\"width\":65536,\"height\":65536,\"tile\":{\"width\":16385,\"height\":1}"), INVALID,
         "/tile/width", "16384"},
        {BODY("\"width\":64.5"), INVALID, "/width", "whole number"},
        {BODY("\"width\":\"64\""), INVALID, "/width", "\"64\""},
        {BODY("\"width\":true"), INVALID, "/width", "true"},
        {BODY("\"height\":[64]"), INVALID, "/height", "an array of 1"},
    };
    CHECK(refusals);
}

static void degenerate_cameras(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"camera\":7"), INVALID, "/camera", "must be an object"},
        {BODY("\"camera\":{\"nod\":\"A\"}"), INVALID, "/camera/nod", "no such member"},
        {BODY("\"camera\":{\"node\":\"\"}"), INVALID, "/camera/node", "1 to 1024"},
        {BODY("\"camera\":{\"node\":3}"), INVALID, "/camera/node", "3"},
        {BODY("\"camera\":{\"node\":\"A\",\"fit\":\"iso\"}"), INVALID, "/camera/fit", "'node'"},
        {BODY("\"camera\":{\"eye\":[0,0,1],\"target\":[0,0,0],\"matrix\":[]}"), INVALID,
         "/camera/matrix", "'eye'"},
        {BODY("\"camera\":{\"eye\":[0,0,1]}"), INVALID, "/camera/target", "required"},
        {BODY("\"camera\":{\"target\":[0,0,1]}"), INVALID, "/camera/eye", "required"},
        {BODY("\"camera\":{\"up\":[0,0,1]}"), INVALID, "/camera/eye", "required"},
        {BODY("\"camera\":{\"eye\":[1,2,3],\"target\":[1,2,3]}"), INVALID, "/camera/target",
         "too near"},
        {BODY("\"camera\":{\"eye\":[1e9,0,0],\"target\":[1000000000.0000002,0,0]}"), INVALID,
         "/camera/target", "too near"},
        {BODY("\"camera\":{\"fit\":\"top\",\"projection\":\"parallel\"}"), INVALID,
         "/camera/projection", "perspective, orthographic"},
        {BODY("\"camera\":{\"fit\":\"top\",\"projection\":\"perspective\",\"ortho_height\":2}"),
         INVALID, "/camera/projection", "ortho_height"},
        {BODY("\"camera\":{\"projection\":\"orthographic\"}"), INVALID, "/camera/projection",
         "give ortho_height"},
        {BODY("\"camera\":{\"eye\":[0,5,0],\"target\":[0,0,0],\"up\":[0,1,0]}"), INVALID,
         "/camera/up", "parallel"},
        {BODY("\"camera\":{\"eye\":[0,5,0],\"target\":[0,0,0],\"up\":[0,-2,0]}"), INVALID,
         "/camera/up", "parallel"},
        {BODY("\"camera\":{\"eye\":[0,5,0],\"target\":[0,0,0],\"up\":[0,0,0]}"), INVALID,
         "/camera/up", "length"},
        {BODY("\"camera\":{\"eye\":[0,5],\"target\":[0,0,0]}"), INVALID, "/camera/eye",
         "array of 3"},
        {BODY("\"camera\":{\"eye\":[0,5,\"1\"],\"target\":[0,0,0]}"), INVALID, "/camera/eye/2",
         "must be a number"},
        {BODY("\"camera\":{\"eye\":[0,null,1],\"target\":[0,0,0]}"), INVALID, "/camera/eye/1",
         "null"},
        {BODY("\"camera\":{\"eye\":[0,5,2e12],\"target\":[0,0,0]}"), INVALID, "/camera/eye/2",
         "from -1e+12 to 1e+12"},
        {BODY("\"camera\":{\"fit\":\"beside\"}"), INVALID, "/camera/fit", "front, top, right, iso"},
        {BODY("\"camera\":{\"fov_y_deg\":0}"), INVALID, "/camera/fov_y_deg", "from 0.001"},
        {BODY("\"camera\":{\"fov_y_deg\":179}"), INVALID, "/camera/fov_y_deg", "less than 179"},
        {BODY("\"camera\":{\"fov_y_deg\":-45}"), INVALID, "/camera/fov_y_deg", "-45"},
        {BODY("\"camera\":{\"fov_y_deg\":1e-300}"), INVALID, "/camera/fov_y_deg", "0.001"},
        {BODY("\"camera\":{\"ortho_height\":0}"), INVALID, "/camera/ortho_height", "from 1e-09"},
        {BODY("\"camera\":{\"ortho_height\":-3}"), INVALID, "/camera/ortho_height", "-3"},
    };
    CHECK(refusals);
}

static void singular_and_projective_matrices(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"camera\":{\"matrix\":[1,0,0]}"), INVALID, "/camera/matrix", "16 numbers"},
        {BODY("\"camera\":{\"matrix\":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1]}"), INVALID,
         "/camera/matrix", "column 0"},
        {BODY("\"camera\":{\"matrix\":[1,0,0,0,1,0,0,0,0,0,1,0,0,0,0,1]}"), INVALID,
         "/camera/matrix", "singular"},
        {BODY("\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,1,1,0,0,0,0,0,1]}"), INVALID,
         "/camera/matrix", "singular"},
        {BODY("\"camera\":{\"matrix\":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}"), INVALID,
         "/camera/matrix", "affine"},
        {BODY("\"camera\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2]}"), INVALID,
         "/camera/matrix", "affine"},
        {BODY("\"camera\":{\"matrix\":[1e-13,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}"), INVALID,
         "/camera/matrix", "column 0"},
        {BODY("\"overrides\":{\"nodes\":{\"A\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,0,0,0,0,0,1]}}}"),
         INVALID, "/overrides/nodes/A/matrix", "column 2"},
    };
    CHECK(refusals);
}

#define LIGHT(members) BODY("\"lights\":[{" members "}]")
#define SPOT "\"type\":\"spot\",\"position\":[0,4,0],\"direction\":[0,-1,0]"

#define RECT "\"type\":\"rect\",\"position\":[0,4,0],\"direction\":[0,-1,0]"
#define DISK "\"type\":\"disk\",\"position\":[0,4,0],\"direction\":[0,-1,0]"

static void bad_lights(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"lights\":{}"), INVALID, "/lights", "must be an array"},
        {BODY("\"lights\":[null]"), INVALID, "/lights/0", "must be an object"},
        {LIGHT(""), INVALID, "/lights/0/type", "required"},
        {LIGHT("\"type\":\"sun\""), INVALID, "/lights/0/type", "directional, point, spot"},
        {LIGHT("\"type\":\"rect\""), INVALID, "/lights/0/position", "required"},
        {LIGHT(RECT ",\"width\":1"), INVALID, "/lights/0/height", "required"},
        {LIGHT(RECT ",\"width\":0,\"height\":1"), INVALID, "/lights/0/width", "from 1e-09"},
        {LIGHT(RECT ",\"width\":1,\"height\":1,\"up\":[0,-2,0]"), INVALID, "/lights/0/up",
         "parallel"},
        {LIGHT(RECT ",\"width\":1,\"height\":1,\"radius\":1"), INVALID, "/lights/0/radius",
         "a rect light has none"},
        {LIGHT(RECT ",\"width\":1,\"height\":1,\"range\":1"), INVALID, "/lights/0/range",
         "a rect light has none"},
        {LIGHT(DISK), INVALID, "/lights/0/radius", "required"},
        {LIGHT(DISK ",\"radius\":1e10"), INVALID, "/lights/0/radius", "to 1e+09"},
        {LIGHT(DISK ",\"radius\":0"), INVALID, "/lights/0/radius", "from 1e-09"},
        {LIGHT(DISK ",\"radius\":1,\"up\":[1,0,0]"), INVALID, "/lights/0/up",
         "a disk light has none"},
        {LIGHT(SPOT ",\"width\":1"), INVALID, "/lights/0/width", "a spot light has none"},
        {LIGHT("\"type\":\"point\""), INVALID, "/lights/0/position", "required"},
        {LIGHT("\"type\":\"directional\""), INVALID, "/lights/0/direction", "required"},
        {LIGHT("\"type\":\"spot\",\"position\":[0,4,0]"), INVALID, "/lights/0/direction",
         "required"},
        {LIGHT("\"type\":\"point\",\"position\":[0,4,0],\"direction\":[0,1,0]"), INVALID,
         "/lights/0/direction", "a point light has none"},
        {LIGHT("\"type\":\"directional\",\"direction\":[0,1,0],\"range\":3"), INVALID,
         "/lights/0/range", "a directional light has none"},
        {LIGHT(SPOT ",\"power\":3"), INVALID, "/lights/0/power", "no such member"},
        {LIGHT(SPOT ",\"color\":[1,1,2]"), INVALID, "/lights/0/color/2", "from 0 to 1"},
        {LIGHT(SPOT ",\"color\":\"red\""), INVALID, "/lights/0/color", "\"red\""},
        {LIGHT(SPOT ",\"intensity\":-1"), INVALID, "/lights/0/intensity", "-1"},
        {LIGHT(SPOT ",\"intensity\":1e13"), INVALID, "/lights/0/intensity", "1e+12"},
        {LIGHT(SPOT ",\"range\":-1"), INVALID, "/lights/0/range", "-1"},
        {LIGHT(SPOT ",\"shadow\":1"), INVALID, "/lights/0/shadow", "true or false"},
        {LIGHT(SPOT ",\"inner_cone_deg\":30,\"outer_cone_deg\":20"), INVALID,
         "/lights/0/inner_cone_deg", "outer_cone_deg, which is 20"},
        {LIGHT(SPOT ",\"inner_cone_deg\":46"), INVALID, "/lights/0/inner_cone_deg", "which is 45"},
        {LIGHT(SPOT ",\"outer_cone_deg\":91"), INVALID, "/lights/0/outer_cone_deg", "to 90"},
        {LIGHT(SPOT ",\"outer_cone_deg\":0"), INVALID, "/lights/0/outer_cone_deg", "from 0.001"},
        {LIGHT("\"type\":\"spot\",\"position\":[0,4,0],\"direction\":[0,0,0]"), INVALID,
         "/lights/0/direction", "length"},
        {BODY("\"lights\":[{" SPOT "},{" SPOT "},{\"type\":1}]"), INVALID, "/lights/2/type",
         "must be one of"},
        {BODY("\"scene_lights\":\"yes\""), INVALID, "/scene_lights", "true or false"},
        {BODY("\"studio\":\"bright\""), INVALID, "/studio", "auto, on, off"},
        {BODY("\"studio\":true"), INVALID, "/studio", "must be"},
        {BODY("\"ground_plane\":true"), INVALID, "/ground_plane", "object"},
        {BODY("\"ground_plane\":{\"height\":\"low\"}"), INVALID, "/ground_plane/height", "number"},
        {BODY("\"ground_plane\":{\"height\":1e13}"), INVALID, "/ground_plane/height", "to 1e+12"},
        {BODY("\"ground_plane\":{\"color\":1}"), INVALID, "/ground_plane/color", ""},
    };
    CHECK(refusals);
}

static void bad_haze(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"atmosphere\":0.1"), INVALID, "/atmosphere", "object"},
        {BODY("\"atmosphere\":{\"color\":[1,1,1]}"), INVALID, "/atmosphere/density", ""},
        {BODY("\"atmosphere\":{\"density\":-0.1}"), INVALID, "/atmosphere/density", "from 0"},
        {BODY("\"atmosphere\":{\"density\":1e7}"), INVALID, "/atmosphere/density", "to 1000000"},
        {BODY("\"atmosphere\":{\"density\":1,\"color\":[1,1]}"), INVALID, "/atmosphere/color", "3"},
        {BODY("\"atmosphere\":{\"density\":1,\"color\":[1,1.5,1]}"), INVALID, "/atmosphere/color/1",
         "to 1"},
        {BODY("\"atmosphere\":{\"density\":1,\"anisotropy\":1}"), INVALID, "/atmosphere/anisotropy",
         "from -0.95 to 0.95"},
        {BODY("\"atmosphere\":{\"density\":1,\"falloff_m\":-1}"), INVALID, "/atmosphere/falloff_m",
         "from 0 to 1e+09"},
        {BODY("\"atmosphere\":{\"density\":1,\"base_m\":1e13}"), INVALID, "/atmosphere/base_m",
         "to 1e+12"},
        {BODY("\"atmosphere\":{\"density\":1,\"falloff\":1}"), INVALID, "/atmosphere/falloff",
         "falloff_m"},
    };
    CHECK(refusals);
}

#define MATERIAL(members) BODY("\"overrides\":{\"materials\":{\"G\":{" members "}}}")
#define AT "/overrides/materials/G"
#define GRID(members) BODY("\"overrides\":{\"grids\":{\"S\":{" members "}}}")
#define IN_GRID "/overrides/grids/S"

static void bad_overrides(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"overrides\":[]"), INVALID, "/overrides", "must be an object"},
        {BODY("\"overrides\":{\"lights\":{}}"), INVALID, "/overrides/lights",
         "nodes, materials, grids"},
        {BODY("\"overrides\":{\"nodes\":[]}"), INVALID, "/overrides/nodes", "must be an object"},
        {BODY("\"overrides\":{\"nodes\":{\"\":{}}}"), INVALID, "/overrides/nodes/", "1 to 1024"},
        {BODY("\"overrides\":{\"nodes\":{\"a/b\":1}}"), INVALID, "/overrides/nodes/a~1b",
         "must be an object"},
        {BODY("\"overrides\":{\"nodes\":{\"A\":{\"visible\":0}}}"), INVALID,
         "/overrides/nodes/A/visible", "true or false"},
        {BODY("\"overrides\":{\"nodes\":{\"A\":{\"scale\":2}}}"), INVALID,
         "/overrides/nodes/A/scale", "visible, matrix"},
        {BODY("\"overrides\":{\"grids\":[]}"), INVALID, "/overrides/grids", "must be an object"},
        {GRID("\"thickness\":1"), INVALID, IN_GRID "/thickness", "density, extinction, color"},
        {GRID("\"density\":-1"), INVALID, IN_GRID "/density", "from 0 to 1e+12"},
        {GRID("\"extinction\":[1,2]"), INVALID, IN_GRID "/extinction", "3 numbers"},
        {GRID("\"color\":[0,1.5,0]"), INVALID, IN_GRID "/color/1", "from 0 to 1"},
        {GRID("\"anisotropy\":-1"), INVALID, IN_GRID "/anisotropy", "from -0.999 to 0.999"},
        {MATERIAL("\"base_color\":[1,0,0]"), INVALID, AT "/base_color", "4 numbers"},
        {MATERIAL("\"base_color\":[1,0,0,1.5]"), INVALID, AT "/base_color/3", "from 0 to 1"},
        {MATERIAL("\"metallic\":2"), INVALID, AT "/metallic", "from 0 to 1"},
        {MATERIAL("\"roughness\":-0.1"), INVALID, AT "/roughness", "-0.1"},
        {MATERIAL("\"emissive\":[0,-1,0]"), INVALID, AT "/emissive/1", "-1"},
        {MATERIAL("\"transmission\":1.01"), INVALID, AT "/transmission", "1.01"},
        {MATERIAL("\"ior\":0.5"), INVALID, AT "/ior", "total reflection"},
        {MATERIAL("\"ior\":101"), INVALID, AT "/ior", "101"},
        {MATERIAL("\"thickness\":-1"), INVALID, AT "/thickness", "-1"},
        {MATERIAL("\"attenuation_color\":[1,1,1]"), INVALID, AT "/attenuation_distance",
         "go together"},
        {MATERIAL("\"attenuation_distance\":1"), INVALID, AT "/attenuation_color", "go together"},
        {MATERIAL("\"attenuation_color\":[1,1,1],\"attenuation_distance\":0"), INVALID,
         AT "/attenuation_distance", "from 1e-09"},
        {MATERIAL("\"alpha_mode\":\"BLEND\""), INVALID, AT "/alpha_mode", "opaque, mask, blend"},
        {MATERIAL("\"pass_through\":\"slab\""), INVALID, AT "/pass_through", "must be an object"},
        {MATERIAL("\"pass_through\":{}"), INVALID, AT "/pass_through/model", "required"},
        {MATERIAL("\"pass_through\":{\"model\":\"rim\"}"), INVALID, AT "/pass_through/model",
         "constant, slab, edge"},
        {MATERIAL("\"pass_through\":{\"model\":\"slab\",\"edge_exponent\":2}"), INVALID,
         AT "/pass_through/edge_exponent", "'edge'"},
        {MATERIAL("\"pass_through\":{\"model\":\"edge\",\"edge_exponent\":0}"), INVALID,
         AT "/pass_through/edge_exponent", "from 0.01"},
        {MATERIAL("\"pass_through\":{\"model\":\"edge\",\"edge_color\":[2,0,0]}"), INVALID,
         AT "/pass_through/edge_color/0", "from 0 to 1"},
        {MATERIAL("\"self_shadow\":\"no\""), INVALID, AT "/self_shadow", "true or false"},
        {MATERIAL("\"cast_once\":1"), INVALID, AT "/cast_once", "true or false"},
        {MATERIAL("\"sheen\":1"), INVALID, AT "/sheen", "base_color"},
    };
    CHECK(refusals);
}

static void bad_quality(void **state)
{
    (void)state;
#define Q(members) BODY("\"quality\":{" members "}")
    static const struct refusal refusals[] = {
        {BODY("\"quality\":\"high\""), INVALID, "/quality", "must be an object"},
        {Q("\"shadow\":\"deep\""), INVALID, "/quality/shadow", "shadows"},
        {Q("\"shadows\":\"best\""), INVALID, "/quality/shadows", "auto, none, map, deep"},
        {Q("\"shadows\":3"), INVALID, "/quality/shadows", "must be one of"},
        {Q("\"transparency\":\"weighted\""), INVALID, "/quality/transparency", "auto, lists"},
        {Q("\"light_lists\":\"tiled\""), INVALID, "/quality/light_lists", "clustered"},
        {Q("\"blend_filter\":\"grey\""), INVALID, "/quality/blend_filter",
         "tint, coverage, kim, modisett"},
        {Q("\"volume_map\":\"sums\""), INVALID, "/quality/volume_map", "logarithms, factors"},
        {Q("\"silhouette_form\":\"quads\""), INVALID, "/quality/silhouette_form",
         "compute, geometry"},
        {Q("\"shadow_resolution\":0"), INVALID, "/quality/shadow_resolution", "from 1 to 16384"},
        {Q("\"shadow_resolution\":16385"), INVALID, "/quality/shadow_resolution", "16385"},
        {Q("\"shadow_taps\":2"), INVALID, "/quality/shadow_taps", "1, 4, 9, 16 or 64"},
        {Q("\"samples\":2"), INVALID, "/quality/samples", "1, 4, 8 or 16"},
        {Q("\"samples\":0"), INVALID, "/quality/samples", "from 1 to 256"},
        {Q("\"shadows\":\"raytraced-shadows\",\"light_lists\":\"linked\""), INVALID,
         "/quality/light_lists", "clustered"},
        {Q("\"shadows\":\"raytraced-shadows\",\"samples\":64"), INVALID, "/quality/samples",
         "1, 4, 8 or 16"},
        {Q("\"reference\":true,\"samples\":8"), INVALID, "/quality/samples", "regular grid"},
        {Q("\"samples\":256"), INVALID, "/quality/samples", "raytraced"},
        {Q("\"reference\":1"), INVALID, "/quality/reference", "true or false"},
        {Q("\"reference\":true,\"shadows\":\"deep\""), INVALID, "/quality/reference",
         "auto or raytraced"},
        {Q("\"area_samples\":0"), INVALID, "/quality/area_samples", "from 1 to 4096"},
        {Q("\"refraction\":\"on\""), INVALID, "/quality/refraction", "auto, off"},
        {Q("\"refraction_samples\":4097"), INVALID, "/quality/refraction_samples",
         "from 1 to 4096"},
        {Q("\"environment_visibility\":\"all\""), INVALID, "/quality/environment_visibility",
         "none, rays"},
        {Q("\"atmosphere_samples\":4097"), INVALID, "/quality/atmosphere_samples",
         "from 1 to 4096"},
        {Q("\"environment_samples\":0"), INVALID, "/quality/environment_samples", "from 1 to 4096"},
        {Q("\"area_samples\":4097"), INVALID, "/quality/area_samples", "from 1 to 4096"},
        {Q("\"shadow_compression\":0"), INVALID, "/quality/shadow_compression", "from 0.001"},
        {Q("\"shadow_compression\":0.6"), INVALID, "/quality/shadow_compression", "to 0.5"},
        {Q("\"shadow_compression\":\"0.02\""), INVALID, "/quality/shadow_compression", "number"},
        {Q("\"shadow_prefilter\":0"), INVALID, "/quality/shadow_prefilter", "from 1 to 4"},
        {Q("\"shadow_prefilter\":5"), INVALID, "/quality/shadow_prefilter", "from 1 to 4"},
        {Q("\"shadow_prefilter\":1.5"), INVALID, "/quality/shadow_prefilter", "whole"},
        {Q("\"shadow_fallback\":1"), INVALID, "/quality/shadow_fallback", "to 0.5"},
        {Q("\"shadow_compression\":0.02,\"shadows\":\"map\""), INVALID,
         "/quality/shadow_compression", "map has none: shadows must be auto or deep"},
        {Q("\"shadow_prefilter\":2,\"shadows\":\"deep-linked\""), INVALID,
         "/quality/shadow_prefilter", "deep-linked has none"},
        {Q("\"shadow_fallback\":0.02,\"shadows\":\"raytraced\""), INVALID,
         "/quality/shadow_fallback", "raytraced has none"},
        {Q("\"shadow_compression\":0.02,\"reference\":true"), INVALID,
         "/quality/shadow_compression", "the reference has none"},
        {Q("\"faithful\":1"), INVALID, "/quality/faithful", "true or false"},
        {Q("\"max_error\":0"), INVALID, "/quality/max_error", "1e-09"},
        {Q("\"max_error\":-1"), INVALID, "/quality/max_error", "-1"},
        {Q("\"budget_ms\":0"), INVALID, "/quality/budget_ms", "from 0.001"},
        {Q("\"budget_ms\":1e9"), INVALID, "/quality/budget_ms", "to 86400000"},
    };
    CHECK(refusals);
}

static void bad_pictures(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {BODY("\"clip_planes\":[[0,1,0]]"), INVALID, "/clip_planes/0", "4 numbers"},
        {BODY("\"clip_planes\":[[0,0,0,1]]"), INVALID, "/clip_planes/0", "normal"},
        {BODY("\"clip_planes\":[[0,1,0,1e13]]"), INVALID, "/clip_planes/0/3", "1e+12"},
        {BODY("\"clip_planes\":[{\"plane\":[0,1,0,1],\"cap\":[2,0,0]}]"), INVALID,
         "/clip_planes/0/cap/0", "1"},
        {BODY("\"clip_planes\":[{\"plane\":[0,1,0,1],\"cap\":1}]"), INVALID, "/clip_planes/0/cap",
         "true or false"},
        {BODY("\"clip_planes\":[{\"plane\":[0,1,0,1],\"cap\":true,\"shadows\":false}]"), INVALID,
         "/clip_planes/0/cap", "no cap"},
        {BODY("\"highlight\":{}"), INVALID, "/highlight/nodes", "required"},
        {BODY("\"highlight\":{\"nodes\":[\"a\",3]}"), INVALID, "/highlight/nodes/1", "string"},
        {BODY("\"highlight\":{\"nodes\":[null]}"), INVALID, "/highlight/nodes/0", "string"},
        {BODY("\"highlight\":{\"nodes\":[],\"width_px\":33}"), INVALID, "/highlight/width_px",
         "32"},
        {BODY("\"highlight\":{\"nodes\":[],\"hidden\":-1}"), INVALID, "/highlight/hidden",
         "from 0"},
        {BODY("\"edges\":true"), INVALID, "/edges", "object"},
        {BODY("\"edges\":{\"crease\":1}"), INVALID, "/edges/crease", "no such member"},
        {BODY("\"edges\":{\"crease_deg\":181}"), INVALID, "/edges/crease_deg", "180"},
        {BODY("\"edges\":{\"color\":[0,0]}"), INVALID, "/edges/color", "3 numbers"},
        {BODY("\"clip_planes\":[{\"shadows\":true}]"), INVALID, "/clip_planes/0/plane", "required"},
        {BODY("\"clip_planes\":[{\"plane\":[0,0,0,1]}]"), INVALID, "/clip_planes/0/plane",
         "normal"},
        {BODY("\"clip_planes\":[{\"plane\":[0,1,0,1],\"shadow\":true}]"), INVALID,
         "/clip_planes/0/shadow", "no such member"},
        {BODY("\"clip_planes\":[{\"plane\":[0,1,0,1],\"shadows\":1}]"), INVALID,
         "/clip_planes/0/shadows", "true or false"},
        {BODY("\"clip_planes\":[0,1,0,1]"), INVALID, "/clip_planes/0", "4 numbers"},
        {BODY("\"clip_planes\":[[],[],[],[],[],[],[],[],[]]"), ERROR_TOO_LARGE, "/clip_planes",
         "limit is 8"},
        {BODY("\"animation\":{\"time_s\":-0.5}"), INVALID, "/animation/time_s", "-0.5"},
        {BODY("\"animation\":{\"time_s\":2e9}"), INVALID, "/animation/time_s", "1e+09"},
        {BODY("\"animation\":{\"name\":\"\"}"), INVALID, "/animation/name", "1 to 1024"},
        {BODY("\"animation\":{\"time\":1}"), INVALID, "/animation/time", "time"},
        {BODY("\"animation\":1.5"), INVALID, "/animation", "object"},
        {BODY("\"background\":[0,0]"), INVALID, "/background", "4 numbers"},
        {BODY("\"background\":[0,0,0,2]"), INVALID, "/background/3", "from 0 to 1"},
        {BODY("\"background\":[-1,0,0,1]"), INVALID, "/background/0", "-1"},
        {BODY("\"background\":\"black\""), INVALID, "/background", "4 numbers"},
        {BODY("\"exposure_ev\":65"), INVALID, "/exposure_ev", "from -64 to 64"},
        {BODY("\"exposure_ev\":\"automatic\""), INVALID, "/exposure_ev", "a number or \"auto\""},
        {BODY("\"exposure_ev\":\"\""), INVALID, "/exposure_ev", "a number or \"auto\""},
        {BODY("\"exposure_ev\":[\"auto\"]"), INVALID, "/exposure_ev", "must be a number"},
        {BODY("\"exposure_ev\":true"), INVALID, "/exposure_ev", "must be a number"},
        {BODY("\"tone_mapping\":\"filmic\""), INVALID, "/tone_mapping", "neutral, none, agx, aces"},
        {BODY("\"environment\":\"sunny\""), INVALID, "/environment", "must be an object"},
        {BODY("\"environment\":{\"sky\":[1,1,-1]}"), INVALID, "/environment/sky/2", "-1"},
        {BODY("\"environment\":{\"hdr\":1}"), INVALID, "/environment/hdr", "sky, ground"},
        {BODY("\"environment\":{\"image\":\"sky.hdr\"}"), ERROR_NOT_FOUND, "/environment/image",
         "'studio' or an id"},
        {BODY("\"environment\":{\"image\":7}"), INVALID, "/environment/image", "a string"},
        {BODY("\"environment\":{\"rotation_deg\":361}"), INVALID, "/environment/rotation_deg",
         "from -360 to 360"},
        {BODY("\"environment\":{\"intensity\":-1}"), INVALID, "/environment/intensity",
         "from 0 to 1"},
        {BODY("\"environment\":{\"background\":1}"), INVALID, "/environment/background",
         "true or false"},
        {BODY("\"output\":\"colour\""), INVALID, "/output", "color, depth, normal"},
        {BODY("\"output\":\"color\",\"outputs\":[\"depth\"]"), INVALID, "/outputs", "'output'"},
        {BODY("\"outputs\":\"color\""), INVALID, "/outputs", "must be an array"},
        {BODY("\"outputs\":[]"), INVALID, "/outputs", "at least one"},
        {BODY("\"outputs\":[null]"), INVALID, "/outputs/0", "must be one of"},
        {BODY("\"outputs\":[\"color\",\"depth\",\"color\"]"), INVALID, "/outputs/2", "second"},
        {BODY("\"outputs\":[\"color\",\"depth\"],\"format\":\"png\""), INVALID, "/format",
         "several need \"exr\""},
        {BODY("\"format\":\"gif\""), INVALID, "/format", "png, jpeg, webp, exr"},
        {BODY("\"format\":\"any\""), INVALID, "/format", "png, jpeg, webp, exr"},
        {BODY("\"quality_percent\":0"), INVALID, "/quality_percent", "from 1 to 100"},
        {BODY("\"quality_percent\":101"), INVALID, "/quality_percent", "101"},
        {BODY("\"quality_percent\":90,\"format\":\"png\""), INVALID, "/quality_percent",
         "png is lossless"},
        {BODY("\"quality_percent\":90,\"format\":\"exr-deep\""), INVALID, "/quality_percent",
         "exr-deep is lossless"},
    };
    CHECK(refusals);
}

#define DEEP(quality, more) BODY("\"format\":\"exr-deep\",\"quality\":{" quality "}" more)

static void requests_that_cannot_be_deep(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {DEEP("", ""), ERROR_UNSUPPORTED, "/format", "none, map, deep, deep-linked, raytraced-s"},
        {DEEP("\"shadows\":\"raytraced\"", ""), ERROR_UNSUPPORTED, "/format", "must be none"},
        {DEEP("\"reference\":true", ""), ERROR_UNSUPPORTED, "/format", "must be none"},
        {DEEP("\"shadows\":\"map\",\"samples\":4", ""), ERROR_UNSUPPORTED, "/format", "must be 1"},
        {DEEP("\"shadows\":\"map\",\"budget_ms\":9", ""), ERROR_UNSUPPORTED, "/format",
         "budget_ms"},
        {DEEP("\"shadows\":\"map\"", ",\"outputs\":[\"color\",\"depth\"]"), ERROR_UNSUPPORTED,
         "/format", "alone"},
        {DEEP("\"shadows\":\"map\"", ",\"edges\":{}"), ERROR_UNSUPPORTED, "/format", "edges"},
        {DEEP("\"shadows\":\"map\"", ",\"atmosphere\":{\"density\":1}"), ERROR_UNSUPPORTED,
         "/format", "haze"},
    };
    CHECK(refusals);
}

/* ---- too much of anything ---- */

/* {"scene":ID,"member":OPEN item,item,... CLOSE} with `count` items; caller frees. */
static char *repeat(const char *open, const char *item, size_t count, const char *close)
{
    size_t size = strlen(open) + count * (strlen(item) + 16) + strlen(close) + 1;
    char *json = malloc(size), *at = json;
    assert_non_null(json);
    at = stpcpy(at, open);
    for (size_t i = 0; i < count; i++) {
        if (i > 0)
            *at++ = ',';
        /* A '#' in the item is its number, so that keys differ. */
        for (const char *c = item; *c; c++) {
            if (*c == '#')
                at += sprintf(at, "%zu", i);
            else
                *at++ = *c;
        }
    }
    strcpy(at, close);
    return json;
}

static void check_repeat(const char *open, const char *item, size_t count, const char *close,
                         const char *pointer)
{
    char *json = repeat(open, item, count, close);
    struct error err = refuse(json, strlen(json));
    free(json);
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_string_equal(err.pointer, pointer);
}

#define HEAD "{\"scene\":\"" ID "\","

static void too_many_of_anything(void **state)
{
    (void)state;
    check_repeat(HEAD "\"lights\":[", "{}", LIMIT_REQUEST_LIGHTS + 1, "]}", "/lights");
    check_repeat(HEAD "\"overrides\":{\"nodes\":{", "\"n#\":{}", LIMIT_REQUEST_OVERRIDES + 1, "}}}",
                 "/overrides/nodes");
    check_repeat(HEAD "\"overrides\":{\"materials\":{", "\"n#\":{}", LIMIT_REQUEST_OVERRIDES + 1,
                 "}}}", "/overrides/materials");
    check_repeat(HEAD "\"overrides\":{\"grids\":{", "\"n#\":{}", LIMIT_REQUEST_OVERRIDES + 1, "}}}",
                 "/overrides/grids");
    check_repeat(HEAD "\"outputs\":[", "\"color\"", LIMIT_OUTPUTS + 1, "]}", "/outputs");
    check_repeat(HEAD "\"lights\":[", "[]", LIMIT_JSON_CONTAINERS, "]}", "");
    check_repeat(HEAD "\"lights\":[", "0", LIMIT_JSON_VALUES, "]}", "");
}

static void nesting_is_bounded_before_parsing(void **state)
{
    (void)state;
    enum { DEEP = 1000000 };
    char *json = malloc(DEEP + 1);
    assert_non_null(json);
    memset(json, '[', DEEP);
    struct error err = refuse(json, DEEP);
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_non_null(strstr(err.message, "nested deeper than 32"));
    free(json);

    /* Brackets in strings do not nest. */
    struct render_request request;
    struct error none = {0};
    static const char harmless[] =
        BODY("\"camera\":{\"node\":\"\\\"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\"}");
    assert_true(render_request_parse(harmless, sizeof harmless - 1, &request, &none));
    render_request_finish(&request);
}

static void texts_over_the_limit_are_not_read(void **state)
{
    (void)state;
    struct error err = refuse("{}", (size_t)LIMIT_CANONICAL_JSON_BYTES + 1);
    assert_int_equal(err.code, ERROR_TOO_LARGE);
}

static void long_names_are_refused_without_being_repeated(void **state)
{
    (void)state;
    char *json = repeat(HEAD "\"camera\":{\"node\":\"", "x", 100000, "\"}}");
    struct error err = refuse(json, strlen(json));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_string_equal(err.pointer, "/camera/node");
    assert_true(strlen(err.message) < 200);
    assert_non_null(strstr(err.message, "..."));
    free(json);

    json = repeat(HEAD "\"", "x", 100000, "\":1}");
    err = refuse(json, strlen(json));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_non_null(strstr(err.message, "no such member"));
    assert_string_equal(err.pointer, "");
    free(json);
}

static void every_truncation_of_a_request_is_refused(void **state)
{
    (void)state;
    static const char json[] =
        BODY("\"width\":64,\"camera\":{\"eye\":[0,0,1],\"target\":[0,0,0]},\"lights\":[{" SPOT
             "}],\"overrides\":{\"nodes\":{\"A\":{\"visible\":true}}}");
    for (size_t length = 0; length < sizeof json - 1; length++) {
        /* A copy of exactly this length lets the sanitizer see any read beyond it. */
        char *copy = malloc(length ? length : 1);
        assert_non_null(copy);
        memcpy(copy, json, length);
        (void)refuse(copy, length);
        free(copy);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texts_that_are_no_request),
        cmocka_unit_test(scenes_that_cannot_exist),
        cmocka_unit_test(sizes_out_of_range),
        cmocka_unit_test(degenerate_cameras),
        cmocka_unit_test(singular_and_projective_matrices),
        cmocka_unit_test(bad_lights),
        cmocka_unit_test(bad_haze),
        cmocka_unit_test(requests_that_cannot_be_deep),
        cmocka_unit_test(bad_overrides),
        cmocka_unit_test(bad_quality),
        cmocka_unit_test(bad_pictures),
        cmocka_unit_test(too_many_of_anything),
        cmocka_unit_test(nesting_is_bounded_before_parsing),
        cmocka_unit_test(texts_over_the_limit_are_not_read),
        cmocka_unit_test(long_names_are_refused_without_being_repeated),
        cmocka_unit_test(every_truncation_of_a_request_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
