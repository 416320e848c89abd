/* SPDX-License-Identifier: MIT */
/* Reading what is drawn over the picture: highlights and edges. */
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/request_parts.h"

static bool read_line(const struct json_node *node, double color[3], double *width_px,
                      double *hidden)
{
    struct json_node of_color = json_member(node, "color"), width = json_member(node, "width_px");
    struct json_node of_hidden = json_member(node, "hidden");
    return json_read_numbers(&of_color, 3, 0, LIMIT_INTENSITY, color) &&
           json_read_number(&width, LIMIT_LINE_PX_MIN, LIMIT_LINE_PX_MAX, width_px) &&
           json_read_number(&of_hidden, 0, 1, hidden);
}

static bool read_nodes(const struct json_node *node, struct request_highlight *highlight)
{
    size_t count;
    if (!json_expect_present(node) || !json_expect_array(node, LIMIT_REQUEST_OVERRIDES, &count))
        return false;
    highlight->nodes = calloc(count + 1, sizeof *highlight->nodes);
    if (!highlight->nodes)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu highlighted nodes", count);
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        const char *name = NULL;
        if (!json_read_name(&element, &name))
            return false;
        highlight->nodes[i] = strdup(name);
        if (!highlight->nodes[i])
            return error_set(node->err, ERROR_NO_MEMORY, "%zu highlighted nodes", count);
        highlight->node_count = i + 1;
    }
    return true;
}

bool request_read_highlight(const struct json_node *node, struct request_highlight *highlight)
{
    static const char *const known[] = {"nodes", "color", "width_px", "hidden", NULL};
    if (!node->value)
        return true;
    *highlight = (struct request_highlight){.color = {1, 0.35, 0.02}, .width_px = 2, .hidden = 0.3};
    struct json_node nodes = json_member(node, "nodes");
    return json_expect_object(node, known) && read_nodes(&nodes, highlight) &&
           read_line(node, highlight->color, &highlight->width_px, &highlight->hidden);
}

bool request_read_edges(const struct json_node *node, struct request_edges *edges)
{
    static const char *const known[] = {"crease_deg", "borders", "silhouettes", "color",
                                        "width_px",   "hidden",  NULL};
    bool has_borders = true, has_silhouettes = true;
    if (!node->value)
        return true;
    *edges = (struct request_edges){.is_given = true, .crease_deg = 30, .width_px = 1};
    if (!json_expect_object(node, known))
        return false;
    struct json_node crease = json_member(node, "crease_deg");
    struct json_node borders = json_member(node, "borders");
    struct json_node silhouettes = json_member(node, "silhouettes");
    if (!json_read_number(&crease, 0, 180, &edges->crease_deg) ||
        !json_read_bool(&borders, &has_borders) || !json_read_bool(&silhouettes, &has_silhouettes))
        return false;
    edges->omits_borders = !has_borders;
    edges->omits_silhouettes = !has_silhouettes;
    return read_line(node, edges->color, &edges->width_px, &edges->hidden);
}
