/* SPDX-License-Identifier: MIT */
/* From the seven primitive modes of glTF to points, lines and triangles. */
#include "renderer/import/topology.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/import/gltf_shim.h"
#include "renderer/scene/scene_blob.h"

void index_list_finish(struct index_list *list)
{
    free(list->values);
    memset(list, 0, sizeof *list);
}

bool index_list_reserve(struct index_list *list, uint64_t count, struct error *err)
{
    if (count <= list->capacity)
        return true;
    if (count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "a primitive has more than 4294967295 corners");
    uint32_t *values = realloc(list->values, count * sizeof *values);
    if (!values)
        return error_set(err, ERROR_NO_MEMORY, "%llu indices", (unsigned long long)count);
    list->values = values;
    list->capacity = (uint32_t)count;
    return true;
}

bool index_list_append_sequence(struct index_list *list, uint32_t count, struct error *err)
{
    if (!index_list_reserve(list, (uint64_t)list->count + count, err))
        return false;
    for (uint32_t i = 0; i < count; i++)
        list->values[list->count++] = i;
    return true;
}

/* Both grow in place, from the back: element i goes to size * i and up, and those still to come
 * read i + size - 2 at most, so that nothing is overwritten before it was read; a loop's ends and a
 * fan's hub are kept aside. */
static void unroll_lines(uint32_t *v, uint32_t count, bool is_loop)
{
    uint32_t first = v[0];
    if (is_loop) {
        uint32_t last = v[count - 1];
        v[2 * count - 2] = last;
        v[2 * count - 1] = first;
    }
    for (uint32_t i = count - 1; i-- > 0;) {
        uint32_t a = v[i], b = v[i + 1];
        v[2ull * i] = a;
        v[2ull * i + 1] = b;
    }
}

static void unroll_triangles(uint32_t *v, uint32_t count, bool is_fan)
{
    uint32_t hub = v[0];
    for (uint32_t i = count - 2; i-- > 0;) {
        uint32_t a = v[i], b = v[i + 1], c = v[i + 2];
        uint32_t *out = v + 3ull * i;
        /* p_i = {v_i, v_(i + 1 + i % 2), v_(i + 2 - i % 2)}, {v_(i+1), v_(i+2), v_0}. */
        out[0] = is_fan ? b : a;
        out[1] = is_fan ? c : i % 2 ? c : b;
        out[2] = is_fan ? hub : i % 2 ? b : c;
    }
}

bool topology_unroll(struct index_list *corners, int mode, uint32_t *topology, struct error *err)
{
    if (mode < GLTF_POINTS || mode > GLTF_TRIANGLE_FAN)
        return error_set(err, ERROR_INVALID_SCENE, "mode is %d, not in [0, 6]", mode);
    *topology = mode == GLTF_POINTS       ? SCENE_POINTS
                : mode <= GLTF_LINE_STRIP ? SCENE_LINES
                                          : SCENE_TRIANGLES;
    uint64_t count = corners->count, size = *topology + 1u, rolled = count;
    if (mode == GLTF_LINES || mode == GLTF_TRIANGLES)
        rolled = count / size * size;
    else if (mode != GLTF_POINTS)
        rolled = count < size ? 0 : (count - size + 1 + (mode == GLTF_LINE_LOOP)) * size;
    if (!index_list_reserve(corners, rolled, err))
        return false;
    if (rolled > 0 && (mode == GLTF_LINE_LOOP || mode == GLTF_LINE_STRIP))
        unroll_lines(corners->values, (uint32_t)count, mode == GLTF_LINE_LOOP);
    else if (rolled > 0 && (mode == GLTF_TRIANGLE_STRIP || mode == GLTF_TRIANGLE_FAN))
        unroll_triangles(corners->values, (uint32_t)count, mode == GLTF_TRIANGLE_FAN);
    corners->count = (uint32_t)rolled;
    return true;
}
