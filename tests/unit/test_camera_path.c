/* SPDX-License-Identifier: MIT */
/* Paths of cameras: through their keys at their moments, without jumps, and no farther. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/camera_path.h"

#define KEY(moment, eye, target) "{" moment ",\"eye\":[" eye "],\"target\":[" target "]"

/* A turn with a narrow corner, keys that are far and near, and one that repeats the one before. */
static const char CORNERS[] =
    "{\"frame\":-3,\"eye\":[0,0,5],\"target\":[0,0,0]},"
    "{\"frame\":0,\"eye\":[4,1,5],\"target\":[0,0,0],\"fov_y_deg\":30},"
    "{\"frame\":1,\"eye\":[4,1.01,5],\"target\":[0,0.5,0],\"fov_y_deg\":60},"
    "{\"frame\":10.5,\"eye\":[-4,1,5],\"target\":[0,0.5,0],\"up\":[2,2,0]},"
    "{\"frame\":20,\"eye\":[-4,1,5],\"target\":[0,0.5,0]},"
    "{\"frame\":24,\"eye\":[0,3,-5],\"target\":[1,0,0],\"up\":[0,1,0.5],\"fov_y_deg\":20}";

static struct camera_path path_of(const char *json)
{
    static int numbers[] = {-50, 0, 3, 60};
    const struct frame_list frames = {numbers, 4};
    struct camera_path path;
    struct error err = {0};
    json_t *value = json_loads(json, 0, NULL);
    assert_non_null(value);
    if (!camera_path_load(value, &frames, 24, &path, &err))
        fail_msg("%s: %s", json, err.message);
    json_decref(value);
    return path;
}

/* With other members behind the keys: "" or ",\"closed\":...". */
static struct camera_path corners(const char *more)
{
    char text[2048];
    snprintf(text, sizeof text, "{\"keys\":[%s]%s}", CORNERS, more);
    return path_of(text);
}

static double distance(const double *a, const double *b)
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

static double angle(const double *a, const double *b)
{
    const double origin[3] = {0};
    double cosine =
        (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / distance(a, origin) / distance(b, origin);
    return acos(fmin(cosine, 1));
}

static void assert_is_key(const struct request_camera *camera, const struct camera_key *key)
{
    assert_int_equal(camera->kind, REQUEST_CAMERA_LOOK_AT);
    assert_memory_equal(camera->eye, key->eye, sizeof key->eye);
    assert_memory_equal(camera->target, key->target, sizeof key->target);
    assert_memory_equal(camera->up, key->up, sizeof key->up);
    assert_true(camera->fov_y_deg == key->fov_y_deg && camera->ortho_height == key->ortho_height);
}

static void the_path_meets_each_key_exactly_and_stays_at_its_ends(void **state)
{
    static const char *const paths[] = {"", ",\"interpolation\":\"linear\"",
                                        ",\"closed\":{\"frame\":30}"};
    (void)state;
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        struct camera_path path = corners(paths[i]);
        for (int k = 0; k < path.count; k++) {
            const struct request_camera camera = camera_path_at(&path, path.keys[k].at);
            assert_is_key(&camera, &path.keys[k]);
        }
        double period = path.closes_at - path.keys[0].at;
        const struct request_camera before =
            camera_path_at(&path, path.is_closed ? -3 - 5 * period : -1e9);
        const struct request_camera after =
            camera_path_at(&path, path.is_closed ? 24 + 7 * period : 1e9);
        assert_is_key(&before, &path.keys[0]);
        assert_is_key(&after, &path.keys[path.count - 1]);
        camera_path_finish(&path);
    }
}

/* No step is longer than a hundredth of what the fastest may be, so that nothing jumps; smooth
 * paths have no jump of their speed either. */
static void a_smooth_path_jumps_in_neither_place_nor_speed(void **state)
{
    static const char *const paths[] = {"", ",\"closed\":{\"frame\":30}"};
    const double step = 1e-4;
    (void)state;
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        struct camera_path path = corners(paths[i]);
        double end = path.is_closed ? 60 : 23.99, velocity[3] = {0};
        struct request_camera last = camera_path_at(&path, -2.99);
        for (int n = 1; - 2.99 + n * step < end; n++) {
            const struct request_camera camera = camera_path_at(&path, -2.99 + n * step);
            double now[3], rest[3] = {0};
            for (int axis = 0; axis < 3; axis++)
                now[axis] = (camera.eye[axis] - last.eye[axis]) / step;
            assert_true(distance(now, rest) < 20);
            assert_true(distance(camera.target, last.target) < 20 * step);
            assert_true(angle(camera.up, last.up) < 20 * step);
            if (n > 1 && distance(now, velocity) > 0.05)
                fail_msg("path %zu at %g: the speed jumps by %g", i, -2.99 + n * step,
                         distance(now, velocity));
            memcpy(velocity, now, sizeof now);
            last = camera;
        }
        camera_path_finish(&path);
    }
}

static void lenses_and_ups_stay_between_those_of_the_keys(void **state)
{
    struct camera_path path = corners("");
    (void)state;
    for (double at = -3; at <= 24; at += 0.01) {
        const struct request_camera camera = camera_path_at(&path, at);
        assert_true(camera.fov_y_deg >= 20 && camera.fov_y_deg <= 60);
    }
    for (double at = 10.5; at <= 20; at += 0.25) { /* two keys at one place: the camera rests */
        const struct request_camera camera = camera_path_at(&path, at);
        assert_memory_equal(camera.eye, path.keys[3].eye, sizeof camera.eye);
    }
    camera_path_finish(&path);
}

static void a_linear_path_is_straight_and_even(void **state)
{
    struct camera_path path = path_of("{\"keys\":[" KEY("\"time_s\":1", "0,0,4", "0,0,0") "}," KEY(
        "\"time_s\":3", "8,0,4", "0,2,0") "}],\"interpolation\":\"linear\"}");
    const double eye[3] = {2, 0, 4}, target[3] = {0, 0.5, 0};
    (void)state;
    assert_true(camera_path_moment(&path, 36, 24) == 1.5);
    const struct request_camera camera = camera_path_at(&path, 1.5);
    assert_memory_equal(camera.eye, eye, sizeof eye);
    assert_memory_equal(camera.target, target, sizeof target);
    camera_path_finish(&path);
}

/* Two keys have a straight curve between them; four on a circle, closed, stay near the circle. */
static void smooth_paths_of_few_keys_are_what_one_expects(void **state)
{
    struct camera_path two = path_of("{\"keys\":[" KEY("\"frame\":0", "0,0,4", "0,0,0") "}," KEY(
        "\"frame\":4", "8,0,4", "0,0,0") "}]}");
    const struct request_camera middle = camera_path_at(&two, 1);
    (void)state;
    assert_true(fabs(middle.eye[0] - 2) < 1e-12 && middle.eye[2] == 4);
    struct camera_path round = path_of("{\"keys\":[" KEY("\"frame\":0", "1,0,0", "0,0,0") "}," KEY(
        "\"frame\":1", "0,0,1",
        "0,0,0") "}," KEY("\"frame\":2", "-1,0,0",
                          "0,0,0") "}," KEY("\"frame\":3", "0,0,-1",
                                            "0,0,0") "}],\"closed\":{\"frame\":4}}");
    const double origin[3] = {0};
    for (double at = 0; at < 8; at += 0.125) {
        const struct request_camera camera = camera_path_at(&round, at);
        assert_true(fabs(distance(camera.eye, origin) - 1) < 0.12);
    }
    camera_path_finish(&two);
    camera_path_finish(&round);
}

static void what_is_written_is_read_as_the_same(void **state)
{
    struct camera_path path = corners(",\"closed\":{\"frame\":30}");
    json_t *json = camera_path_to_json(&path);
    char *text = json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17));
    struct camera_path again = path_of(text);
    (void)state;
    assert_int_equal(again.count, path.count);
    assert_memory_equal(again.keys, path.keys, (size_t)path.count * sizeof *path.keys);
    assert_true(again.closes_at == path.closes_at && again.is_closed && !again.is_timed);
    json_decref(json);
    free(text);
    camera_path_finish(&path);
    camera_path_finish(&again);
}

#define TWO(first, second) "{\"keys\":[" first "}," second "}]}"
#define FIRST KEY("\"frame\":0", "0,0,4", "0,0,0")
#define SECOND KEY("\"frame\":9", "8,0,4", "0,0,0")

static void bad_paths_are_refused_by_place(void **state)
{
    static const struct {
        const char *json, *pointer, *words;
    } bad[] = {
        {"3", "", ""},
        {"{}", "/keys", ""},
        {"{\"keys\":[]}", "/keys", "at least 2"},
        {"{\"keys\":[" FIRST "}]}", "/keys", "at least 2"},
        {TWO(SECOND, FIRST), "/keys/1/frame", "after that of key 0, 9"},
        {TWO(FIRST, FIRST), "/keys/1/frame", "after"},
        {TWO(FIRST, KEY("\"time_s\":9", "8,0,4", "0,0,0")), "/keys/1/time_s", "frame"},
        {TWO(FIRST, KEY("\"time_s\":9,\"frame\":9", "8,0,4", "0,0,0")), "/keys/1/time_s", "frame"},
        {TWO(FIRST, KEY("\"up\":[0,1,0]", "8,0,4", "0,0,0")), "/keys/1/frame", "time_s"},
        {TWO(FIRST, KEY("\"frame\":9", "8,0,4", "8,0,4")), "/keys/1/target", "too near"},
        {TWO(FIRST, KEY("\"frame\":9", "8,0,\"NaN\"", "0,0,0")), "/keys/1/eye/2", ""},
        {TWO(FIRST, KEY("\"frame\":2e9", "8,0,4", "0,0,0")), "/keys/1/frame", ""},
        {TWO(FIRST, SECOND ",\"fov_y_deg\":180"), "/keys/1/fov_y_deg", ""},
        {TWO(FIRST, SECOND ",\"ortho_height\":2"), "/keys/1/ortho_height", "one kind"},
        {TWO(FIRST, SECOND ",\"up\":[-8,0,-4]"), "/keys/1/up", "parallel"},
        {TWO(FIRST, SECOND ",\"node\":\"x\""), "/keys/1/node", ""},
        {"{\"keys\":[" FIRST "}," SECOND "}],\"interpolation\":\"cubic\"}", "/interpolation", ""},
        {"{\"keys\":[" FIRST "}," SECOND "}],\"closed\":true}", "/closed", ""},
        {"{\"keys\":[" FIRST "}," SECOND "}],\"closed\":{\"frame\":9}}", "/closed/frame", "after"},
        {"{\"keys\":[" FIRST "}," SECOND "}],\"closed\":{\"time_s\":9}}", "/closed/time_s", ""},
        {TWO(KEY("\"frame\":0", "0,0,3", "0,0,0"), KEY("\"frame\":6", "0,0,-3", "0,0,0")), "",
         "at frame 3 the camera's eye meets its target"},
        {TWO(KEY("\"frame\":0", "0,0,3", "0,0,0"),
             KEY("\"frame\":6", "0,0,3", "0,0,0") ",\"up\":[0,-1,0]"),
         "", "at frame 3 the camera's up"},
    };
    static int numbers[] = {0, 3, 6};
    const struct frame_list frames = {numbers, 3};
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct camera_path path;
        struct error err = {0};
        json_t *value = json_loads(bad[i].json, JSON_DECODE_ANY, NULL);
        assert_non_null(value);
        if (camera_path_load(value, &frames, 24, &path, &err))
            fail_msg("%s is taken", bad[i].json);
        assert_null(path.keys);
        if (strcmp(err.pointer, bad[i].pointer) != 0 || !strstr(err.message, bad[i].words))
            fail_msg("%s: '%s': %s", bad[i].json, err.pointer, err.message);
        json_decref(value);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_path_meets_each_key_exactly_and_stays_at_its_ends),
        cmocka_unit_test(a_smooth_path_jumps_in_neither_place_nor_speed),
        cmocka_unit_test(lenses_and_ups_stay_between_those_of_the_keys),
        cmocka_unit_test(a_linear_path_is_straight_and_even),
        cmocka_unit_test(smooth_paths_of_few_keys_are_what_one_expects),
        cmocka_unit_test(what_is_written_is_read_as_the_same),
        cmocka_unit_test(bad_paths_are_refused_by_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
