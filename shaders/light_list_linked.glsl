// SPDX-License-Identifier: MIT
// Cursor over a light linked list. Needs: the uniforms of light_list.glsl.
// Lindbeck 2015, "Deep shadow maps and light linked lists", 2.1.2: elements {front, back, light,
// next} sorted by front; a light counts where front <= z <= back; the walk ends at the first
// element that begins behind the point.
#define LIGHT_LIST_END 0xffffffffu
#define LIGHT_LIST_HEADER 4 // words before the heads: the element counter
// All loops of one invocation share 65,535 steps on llvmpipe; a list as long would be cut without a
// word.
#define LIGHT_LIST_STEPS 60000

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
    for (int i = 0; i < LIGHT_LIST_STEPS && c.node != LIGHT_LIST_END; i++) {
        uvec4 element = texelFetch(u_light_items, int(c.node));
        if (c.z < uintBitsToFloat(element.x))
            return false;
        c.node = element.w;
        if (c.z <= uintBitsToFloat(element.y)) {
            light = element.z;
            return true;
        }
    }
    return false;
}
