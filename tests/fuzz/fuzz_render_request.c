/* SPDX-License-Identifier: MIT */
/* Any bytes: the parser refuses with a complete error, or gives a request whose canonical JSON
 * reads back as itself and which becomes a view of finite numbers. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/render_request.h"
#include "server/mapping/view_mapping.h"
#include "tests/fuzz/expect.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void expect_refusal(const struct error *err)
{
    expect(err->code == ERROR_INVALID_REQUEST || err->code == ERROR_UNSUPPORTED ||
           err->code == ERROR_NOT_FOUND || err->code == ERROR_TOO_LARGE);
    expect_complete(err);
}

static void expect_finite_view(const struct render_request *request)
{
    struct view_storage storage;
    struct view view;
    struct error err = {0};
    expect(view_from_request(request, &storage, &view, &err));
    for (size_t i = 0; i < view.light_count; i++) {
        const struct view_light *light = &view.lights[i];
        for (int axis = 0; axis < 3; axis++)
            expect(isfinite(light->position[axis]) && isfinite(light->direction[axis]));
        expect(isfinite(light->intensity) && light->intensity >= 0 && isfinite(light->range));
        expect(light->inner_cone_deg <= light->outer_cone_deg);
    }
    for (int i = 0; i < 16; i++)
        expect(isfinite(view.camera.matrix[i]));
    expect(view.width_px >= 1 && view.height_px >= 1 && view.outputs != 0);
    view_storage_finish(&storage);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct render_request request, again;
    struct error err = {0};
    if (!render_request_parse((const char *)data, size, &request, &err)) {
        expect_refusal(&err);
        return 0;
    }
    expect(err.code == ERROR_NONE);
    char *text = render_request_to_json(&request);
    expect(text && render_request_parse(text, strlen(text), &again, &err));
    char *second = render_request_to_json(&again);
    expect(second && strcmp(text, second) == 0);
    expect_finite_view(&request);
    free(text);
    free(second);
    render_request_finish(&request);
    render_request_finish(&again);
    return 0;
}
