// SPDX-License-Identifier: MIT
// Cursor over a light linked list. Needs: the uniforms of light_list.glsl.
// Lindbeck 2015, "Deep shadow maps and light linked lists", 2.1.2: elements {front, back, light,
// next} sorted by front; a light counts where front <= z <= back; the walk ends at the first
// element that begins behind the point.
#define LIGHT_LIST_END 0xffffffffu
#define LIGHT_LIST_HEADER 4 // words before the heads: the element counter
// Elements that do not reach the point's depth are named, too, as LIGHT_NONE: all lanes of a group
// then walk a list side by side, and a list takes one step per element whatever their depths are.
#define LIGHT_LIST_HAS_GAPS
#define LIGHT_NONE 0xffffffffu

struct light_cursor {
    uint prefix_at;
    uint node;
    float z;
};

light_cursor light_list_first(uvec2 pixel, float view_z)
{
    uvec2 tile = pixel >> u_light_shift;
    int head = LIGHT_LIST_HEADER + int(tile.y * u_light_columns + tile.x);
    return light_cursor(0u, texelFetch(u_light_heads, head).x, view_z);
}

bool light_list_next(inout light_cursor c, out uint light)
{
    light = 0u;
    if (c.prefix_at < u_light_prefix) {
        light = texelFetch(u_light_items, int(c.prefix_at)).z;
        c.prefix_at++;
        return true;
    }
    if (c.node == LIGHT_LIST_END)
        return false;
    uvec4 element = texelFetch(u_light_items, int(c.node));
    if (c.z < uintBitsToFloat(element.x))
        return false;
    c.node = element.w;
    light = c.z <= uintBitsToFloat(element.y) ? element.z : LIGHT_NONE;
    return true;
}

// Lights of the point.
uint light_list_count(light_cursor c)
{
    uint count = u_light_prefix - c.prefix_at, light;
    c.prefix_at = u_light_prefix;
    while (light_list_next(c, light))
        count += light == LIGHT_NONE ? 0u : 1u;
    return count;
}
