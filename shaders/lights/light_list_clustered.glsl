// SPDX-License-Identifier: MIT
// Cursor over the contiguous list of a cluster. Needs: the uniforms of light_list.glsl.
// Olsson, Billeter and Assarsson 2012, "Clustered deferred and forward shading".
uniform uint u_light_slices;
uniform vec4 u_light_slice_map; // x scale, y offset, z: 1 when linear in depth (orthographic)

struct light_cursor {
    uint at, end; // prefix and list read as one row of entries
    uint skip;    // from the end of the prefix to the list
};

light_cursor light_list_at(uint cluster)
{
    uvec2 head = texelFetch(u_light_heads, int(cluster)).xy;
    return light_cursor(0u, u_light_prefix + head.y, head.x - u_light_prefix);
}

uint light_slice(float view_z)
{
    float f = u_light_slice_map.z > 0.0 ? view_z : log2(max(view_z, 1e-37));
    float slice = floor(f * u_light_slice_map.x + u_light_slice_map.y);
    return uint(clamp(slice, 0.0, float(u_light_slices - 1u)));
}

// The view depth at which slice k > 0 begins.
float light_slice_border(uint k)
{
    float f = (float(k) - u_light_slice_map.y) / u_light_slice_map.x;
    return u_light_slice_map.z > 0.0 ? f : exp2(f);
}

uint light_cluster(uvec2 pixel, uint slice)
{
    uvec2 tile = pixel >> u_light_shift;
    return (tile.y * u_light_columns + tile.x) * u_light_slices + slice;
}

light_cursor light_list_in(uvec2 pixel, uint slice)
{
    return light_list_at(light_cluster(pixel, slice));
}

light_cursor light_list_first(uvec2 pixel, float view_z)
{
    return light_list_in(pixel, light_slice(view_z));
}

// Narrows the cursor to `count` entries from the first-th on.
void light_list_chunk(inout light_cursor c, uint first, uint count)
{
    c.at = min(first, c.end);
    c.end = c.end - c.at > count ? c.at + count : c.end;
}

// The light of the n-th entry from here on, which is there.
uint light_list_item(light_cursor c, uint n)
{
    uint at = c.at + n;
    return texelFetch(u_light_items, int(at < u_light_prefix ? at : at + c.skip)).x;
}

bool light_list_next(inout light_cursor c, out uint light)
{
    light = 0u;
    if (c.at >= c.end)
        return false;
    light = light_list_item(c, 0u);
    c.at++;
    return true;
}

// Lights of the point.
uint light_list_count(light_cursor c)
{
    return c.end - c.at;
}
