/* SPDX-License-Identifier: MIT */
/* A walk to meshes[].primitives[].indices; what is beside it was looked over before. */
#include "renderer/import/gltf_indices.h"

#include <stdlib.h>
#include <string.h>

enum { DEPTH = 5 }; /* of what is passed over in a primitive; above it less */

struct taking {
    struct gltf_indices_list *list;
    struct gltf_json *json;
};

static bool scan_primitive_member(struct scanner *s, struct span key, void *object)
{
    struct taking *taking = object;
    uint64_t index;
    if (!span_is(key, "indices"))
        return scanner_skip(s, DEPTH);
    /* no member of glTF, and as long */
    memcpy(taking->json->rest + (key.begin - taking->json->rest), "INDICES", strlen("INDICES"));
    if (!scanner_unsigned(s, &index))
        return false;
    taking->list->values[taking->list->count - 1] = index > INT32_MAX ? INT32_MAX : (int)index;
    return true;
}

static bool scan_primitive(struct scanner *s, void *object)
{
    struct taking *taking = object;
    struct gltf_indices_list *list = taking->list;
    int *values = scanner_grow(s, list->values, list->count, sizeof *values);
    if (!values)
        return false;
    list->values = values;
    list->values[list->count++] = -1;
    return scanner_object(s, scan_primitive_member, taking);
}

static bool scan_mesh_member(struct scanner *s, struct span key, void *object)
{
    return span_is(key, "primitives") ? scanner_array(s, scan_primitive, object)
                                      : scanner_skip(s, DEPTH);
}

static bool scan_mesh(struct scanner *s, void *object)
{
    return scanner_object(s, scan_mesh_member, object);
}

static bool scan_member(struct scanner *s, struct span key, void *object)
{
    return span_is(key, "meshes") ? scanner_array(s, scan_mesh, object) : scanner_skip(s, 1);
}

bool gltf_indices_take(struct gltf_indices_list *list, struct gltf_json *json, struct error *err)
{
    struct taking taking = {list, json};
    struct scanner s = {
        .text = json->rest, .at = json->rest, .end = json->rest + json->rest_length, .err = err};
    return scanner_object(&s, scan_member, &taking);
}

void gltf_indices_finish(struct gltf_indices_list *list)
{
    free(list->values);
    *list = (struct gltf_indices_list){.values = NULL};
}
