/* SPDX-License-Identifier: MIT */
/* The light list interface: which technique, its time and memory in the report, its bindings for
 * shading. */
#include "renderer/lights/light_lists.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/content_key.h"
#include "renderer/base/wall_clock.h"
#include "renderer/lights/clusters.h"
#include "renderer/lights/linked_lists.h"
#include "shaders/shared/bindings.h"

struct light_lists {
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct content_key key; /* of what stands; not set: nothing */
    bool is_linked;
    struct clusters clusters;
    struct gl_buffer cluster_heads, cluster_items;
    struct gl_texture cluster_heads_view, cluster_items_view;
    struct linked_lists linked;
};

struct light_lists *light_lists_create(struct program_cache *programs,
                                       struct gpu_timeline *timeline, struct error *err)
{
    struct light_lists *lists = calloc(1, sizeof *lists);
    if (!lists) {
        error_set(err, ERROR_NO_MEMORY, "light lists");
        return NULL;
    }
    lists->programs = programs;
    lists->timeline = timeline;
    return lists;
}

void light_lists_drop(struct light_lists *lists)
{
    light_lists_forget(lists);
    clusters_finish(&lists->clusters);
    linked_lists_finish(&lists->linked);
    gl_texture_finish(&lists->cluster_heads_view);
    gl_texture_finish(&lists->cluster_items_view);
    gl_buffer_finish(&lists->cluster_heads);
    gl_buffer_finish(&lists->cluster_items);
}

void light_lists_destroy(struct light_lists *lists)
{
    if (!lists)
        return;
    light_lists_drop(lists);
    free(lists);
}

/* Buffer and its view, holding these bytes. */
static bool upload(struct gl_buffer *buffer, struct gl_texture *view, const char *label,
                   uint32_t format, const void *data, uint64_t size_bytes, struct error *err)
{
    if (!gl_buffer_reserve(
            buffer,
            &(struct gl_buffer_desc){.label = label, .size_bytes = size_bytes, .is_uploaded = true},
            false, err))
        return false;
    gl_buffer_write(buffer, 0, size_bytes, data);
    return gl_texture_follow_buffer(view, label, format, buffer, err);
}

static uint64_t clusters_count(const struct clusters *clusters)
{
    return (uint64_t)clusters->columns * (uint64_t)clusters->rows * (uint64_t)clusters->slices;
}

static bool upload_clusters(struct light_lists *lists, struct error *err)
{
    const struct clusters *clusters = &lists->clusters;
    return upload(&lists->cluster_heads, &lists->cluster_heads_view, "lights.clusters.heads",
                  GL_RG32UI, clusters->heads,
                  clusters_count(clusters) * 2 * sizeof *clusters->heads, err) &&
           upload(&lists->cluster_items, &lists->cluster_items_view, "lights.clusters.items",
                  GL_R32UI, clusters->items, clusters->item_count * sizeof *clusters->items, err);
}

/* One line of the report for the CPU and the GPU part, which carry the same names. */
struct pass_names {
    char because[REPORT_TEXT_BYTES];
    const char *technique;
};

static void report_cpu_part(struct frame_report *report, const struct pass_names *names, double ms)
{
    report_add_pass(report, "light_list", names->because, names->technique, ms, REPORT_LIGHT_LIST);
}

static void begin_gpu_part(struct light_lists *lists, const struct pass_names *names)
{
    gpu_scope_begin(lists->timeline, &(struct gpu_scope_desc){.pass = "light_list",
                                                              .because = names->because,
                                                              .technique = names->technique,
                                                              .stage = REPORT_LIGHT_LIST});
}

static bool prepare_clustered(struct light_lists *lists, const struct light_lists_desc *desc,
                              struct frame_report *report, struct error *err)
{
    struct clusters *clusters = &lists->clusters;
    double begin_ms = wall_ms();
    if (!clusters_build(clusters,
                        &(struct clusters_desc){.lights = desc->lights,
                                                .light_count = desc->light_count,
                                                .camera = desc->camera,
                                                .window = desc->window,
                                                .bounds = desc->bounds},
                        err))
        return false;
    struct pass_names names = {.technique = "clustered"};
    snprintf(names.because, sizeof names.because, "%zu lights of the scene in %dx%dx%d clusters",
             desc->light_count, clusters->columns, clusters->rows, clusters->slices);
    report_cpu_part(report, &names, wall_ms() - begin_ms);
    begin_gpu_part(lists, &names);
    bool ok = upload_clusters(lists, err);
    gpu_scope_end(lists->timeline);
    return ok;
}

static bool prepare_linked(struct light_lists *lists, const struct light_lists_desc *desc,
                           struct frame_report *report, struct error *err)
{
    struct linked_lists *linked = &lists->linked;
    const struct linked_desc linked_desc = {.lights = desc->lights,
                                            .light_count = desc->light_count,
                                            .camera = desc->camera,
                                            .window = desc->window,
                                            .bounds = desc->bounds,
                                            .limits = desc->limits,
                                            .faithful = desc->faithful};
    double begin_ms = wall_ms();
    if (!linked_lists_collect(linked, &linked_desc, err))
        return false;
    struct pass_names names = {.technique = desc->faithful ? "linked-faithful" : "linked"};
    snprintf(names.because, sizeof names.because, "%zu lights of the scene in %dx%d linked lists",
             desc->light_count, linked->grid.columns, linked->grid.rows);
    report_cpu_part(report, &names, wall_ms() - begin_ms);
    begin_gpu_part(lists, &names);
    gpu_timeline_will_wait(lists->timeline);
    bool ok = linked_lists_build(linked, &linked_desc, lists->programs, err);
    gpu_scope_end(lists->timeline);
    return ok;
}

static void add_reach(struct content_key *key, const struct state_light *light)
{
    content_key_add_word(key, (uint64_t)light->type);
    content_key_add(key, light->position, sizeof light->position);
    content_key_add(key, light->direction, sizeof light->direction);
    content_key_add(key, &light->range, sizeof light->range);
    content_key_add(key, &light->outer_cone_rad, sizeof light->outer_cone_rad);
}

static struct content_key key_of(const struct light_lists_desc *desc)
{
    const struct camera *camera = desc->camera;
    const double numbers[] = {camera->half_width, camera->half_height, camera->z_near,
                              camera->z_far};
    struct content_key key = content_key_begin();
    content_key_add_word(&key, (uint64_t)desc->technique);
    content_key_add_word(&key, (uint64_t)desc->faithful | (uint64_t)camera->is_orthographic << 1);
    content_key_add(&key, camera->eye, sizeof camera->eye);
    content_key_add(&key, camera->right, sizeof camera->right);
    content_key_add(&key, camera->up, sizeof camera->up);
    content_key_add(&key, camera->back, sizeof camera->back);
    content_key_add(&key, numbers, sizeof numbers);
    content_key_add(&key, desc->window, sizeof *desc->window);
    content_key_add_word(&key, desc->light_count);
    for (size_t i = 0; i < desc->light_count; i++)
        add_reach(&key, &desc->lights[i]);
    return key;
}

static void report_lists(const struct light_lists *lists, struct frame_report *report)
{
    const struct clusters *clusters = &lists->clusters;
    uint64_t bytes = clusters_count(clusters) * 2 * sizeof *clusters->heads +
                     clusters->item_count * sizeof *clusters->items;
    if (lists->is_linked)
        bytes = linked_lists_used_bytes(&lists->linked);
    report->counts.light_list_entries +=
        lists->is_linked ? lists->linked.element_count : clusters->item_count;
    report_raise_bytes(report, "light_lists", bytes);
}

static bool build(struct light_lists *lists, const struct light_lists_desc *desc,
                  struct frame_report *report, struct error *err)
{
    lists->is_linked = desc->technique == VIEW_LIGHT_LISTS_LINKED;
    return lists->is_linked ? prepare_linked(lists, desc, report, err)
                            : prepare_clustered(lists, desc, report, err);
}

bool light_lists_prepare(struct light_lists *lists, const struct light_lists_desc *desc,
                         struct frame_report *report, struct error *err)
{
    const struct content_key key = key_of(desc);
    if (!desc->rebuilds && content_key_equals(lists->key, key)) {
        if (desc->bounds) /* the caller's may be others by now, of the same lights */
            lists->clusters.bounds = lists->linked.bounds = desc->bounds;
        report->counts.light_lists_reused++;
        report_add_reused(report, "light_list");
        report_lists(lists, report);
        return true;
    }
    light_lists_forget(lists);
    if (!build(lists, desc, report, err))
        return false;
    lists->key = key;
    report->counts.light_lists_built++;
    report_lists(lists, report);
    return true;
}

uint64_t light_lists_size_bytes(const struct light_lists *lists)
{
    const struct linked_lists *linked = &lists->linked;
    return lists->cluster_heads.size_bytes + lists->cluster_items.size_bytes +
           linked->heads.size_bytes + linked->elements.size_bytes + linked->records.size_bytes +
           linked->mesh.size_bytes + linked->front.size_bytes;
}

void light_lists_forget(struct light_lists *lists)
{
    lists->key = (struct content_key){{0, 0}};
}

const char *light_lists_defines(const struct light_lists *lists)
{
    return light_lists_technique_defines(lists->is_linked ? VIEW_LIGHT_LISTS_LINKED
                                                          : VIEW_LIGHT_LISTS_CLUSTERED);
}

const char *light_lists_technique_defines(enum view_light_lists technique)
{
    return technique == VIEW_LIGHT_LISTS_LINKED ? "LIGHT_LIST=2" : "LIGHT_LIST=1";
}

void light_lists_list_programs(enum view_light_lists technique, bool is_faithful, bool is_software,
                               struct program_list *list)
{
    if (technique == VIEW_LIGHT_LISTS_LINKED) /* clusters are filled without one */
        linked_lists_list_programs(is_faithful, is_software, "light_list", list);
}

static uint32_t log2_of(int power_of_two)
{
    uint32_t shift = 0;
    while (1 << shift < power_of_two)
        shift++;
    return shift;
}

static void bind_clusters(const struct light_lists *lists, const struct gl_program *program)
{
    const struct clusters *clusters = &lists->clusters;
    const float slice_map[4] = {clusters->slice_scale, clusters->slice_offset,
                                clusters->is_linear ? 1.0f : 0.0f, 0};
    gl_texture_bind(&lists->cluster_heads_view, UNIT_LIGHT_HEADS);
    gl_texture_bind(&lists->cluster_items_view, UNIT_LIGHT_ITEMS);
    gl_program_set_u(program, "u_light_prefix", (uint32_t)clusters->prefix_count);
    gl_program_set_u(program, "u_light_columns", (uint32_t)clusters->columns);
    gl_program_set_u(program, "u_light_slices", (uint32_t)clusters->slices);
    gl_program_set_u(program, "u_light_shift", log2_of(clusters->tile_px));
    gl_program_set_f4(program, "u_light_slice_map", slice_map);
}

void light_lists_bind(const struct light_lists *lists, const struct gl_program *program)
{
    if (!lists->is_linked) {
        bind_clusters(lists, program);
        return;
    }
    const struct linked_lists *linked = &lists->linked;
    gl_texture_bind(&linked->heads_view, UNIT_LIGHT_HEADS);
    gl_texture_bind(&linked->elements_view, UNIT_LIGHT_ITEMS);
    gl_program_set_u(program, "u_light_prefix", (uint32_t)linked->prefix_count);
    gl_program_set_u(program, "u_light_columns", (uint32_t)linked->grid.columns);
    gl_program_set_u(program, "u_light_shift", log2_of(LINKED_TILE_PX));
}

const struct clusters *light_lists_clusters(const struct light_lists *lists)
{
    return lists->is_linked ? NULL : &lists->clusters;
}

uint32_t light_lists_longest(const struct light_lists *lists)
{
    return lists->is_linked ? (uint32_t)(lists->linked.prefix_count + lists->linked.draw_count)
                            : lists->clusters.longest;
}

void light_lists_order(const struct light_lists *lists, size_t light_count, uint32_t *order)
{
    const struct linked_lists *linked = &lists->linked;
    size_t prefix_count = lists->is_linked ? linked->prefix_count : lists->clusters.prefix_count;
    const uint32_t *prefix = lists->is_linked ? linked->bounds->global : lists->clusters.items;
    size_t at = 0, used = prefix_count;
    if (prefix_count)
        memcpy(order, prefix, prefix_count * sizeof *order);
    for (uint32_t i = 0; i < light_count; i++) {
        if (at < prefix_count && prefix[at] == i) /* ascending, too */
            at++;
        else
            order[used++] = i;
    }
    assert(used == light_count);
}
