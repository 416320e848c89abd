// SPDX-License-Identifier: MIT
// Density grids on straight ways (docs/explanation/media.md): what they let through. The value is
// trilinear between the centres of voxels, so that it is a polynomial of degree 3 of the way within
// a cell between eight centres: Gauss and Legendre's rule of two points sums it up exactly. Empty
// bricks are crossed in one step.
// Needs: GRID_COUNT; GRID_CUTS, how many clip planes the view has, where it has any.
// Provides: struct grid_way, grid_meet, grid_cell_at, grid_mean, grid_sum, grids_depth,
// grids_let_through.
layout(binding = UNIT_GRID_RECORDS) uniform usamplerBuffer u_grid_records; // struct grid_record
layout(binding = UNIT_GRID_BRICKS) uniform usamplerBuffer u_grid_bricks;   // 1 + index; 0: empty
// Two neighbours along x: those of a brick from each of its 8 x 9 x 9 voxels on.
layout(binding = UNIT_GRID_VALUES) uniform samplerBuffer u_grid_values;

const float GRID_FAR = 1e30;
const float GRID_AHEAD = 2e-3; // voxels: the cell at a border is the one behind it

vec4 grid_word(uint grid, uint word)
{
    return uintBitsToFloat(texelFetch(u_grid_records, int(grid * GRID_RECORD_TEXELS + word)));
}

#ifdef GRID_CUTS
uniform vec4 u_grid_cuts[GRID_CUTS]; // clip planes, view space
uniform uint u_grid_light_cuts;      // bits: those that cut what light meets
#define GRID_CUTS_OF_LIGHT u_grid_light_cuts
#else
#define GRID_CUTS_OF_LIGHT 0u
#endif
#define GRID_CUTS_ALL 0xffffffffu

// The part of a range of the way that these planes leave.
vec2 grid_kept(vec3 p, vec3 way, vec2 range, uint cuts)
{
#ifdef GRID_CUTS
    for (uint k = 0u; k < uint(GRID_CUTS); k++) {
        if ((cuts & 1u << k) == 0u)
            continue;
        float height = dot(u_grid_cuts[k].xyz, p) + u_grid_cuts[k].w;
        float climb = dot(u_grid_cuts[k].xyz, way);
        float at = climb != 0.0 ? -height / climb : (height < 0.0 ? GRID_FAR : -GRID_FAR);
        if (climb < 0.0)
            range.y = min(range.y, at);
        else
            range.x = max(range.x, at);
    }
#endif
    return range;
}

// A way through the box of a grid, in its voxels.
struct grid_way {
    vec3 from, step;  // where it is at `begin`; per metre
    float begin, end; // [m] along the way; not met where the end is no farther
    float ahead;      // [m]
    ivec3 size;
    int first_brick;
};

grid_way grid_meet(uint grid, vec3 p, vec3 way, vec2 range)
{
    vec4 x = grid_word(grid, 0u), y = grid_word(grid, 1u), z = grid_word(grid, 2u);
    uvec4 box = texelFetch(u_grid_records, int(grid * GRID_RECORD_TEXELS + 3u));
    grid_way w;
    w.size = ivec3(box.xyz);
    w.first_brick = int(box.w);
    vec4 point = vec4(p, 1.0);
    vec3 from = vec3(dot(x, point), dot(y, point), dot(z, point));
    w.step = vec3(dot(x.xyz, way), dot(y.xyz, way), dot(z.xyz, way));
    w.step = mix(w.step, vec3(1e-20), lessThan(abs(w.step), vec3(1e-20)));
    vec3 low = -from / w.step, high = (vec3(w.size) - from) / w.step;
    vec3 nearer = min(low, high), farther = max(low, high);
    w.begin = max(range.x, max(nearer.x, max(nearer.y, nearer.z)));
    w.end = min(range.y, min(farther.x, min(farther.y, farther.z)));
    w.from = from + w.begin * w.step;
    vec3 speed = abs(w.step);
    w.ahead = GRID_AHEAD / max(speed.x, max(speed.y, speed.z));
    return w;
}

struct grid_cell {
    ivec3 corner; // its first voxel that is stored
    int values;   // where its values are; -1: all around is empty
    float end;    // [m] from the way's begin: where the way leaves it, or the empty brick
};

grid_cell grid_cell_at(grid_way w, float t)
{
    ivec3 last = max(w.size, ivec3(2)) - 2;
    ivec3 cell = ivec3(floor(w.from + (t + w.ahead) * w.step - 0.5));
    cell = clamp(cell, ivec3(-1), w.size - 1); // the outer half voxel is even
    grid_cell c;
    c.corner = clamp(cell, ivec3(0), last);
    ivec3 brick = c.corner >> 3, count = (last >> 3) + 1;
    int at = w.first_brick + brick.x + count.x * (brick.y + count.y * brick.z);
    int values = int(texelFetch(u_grid_bricks, at).x) - 1;
    ivec3 inside = c.corner - 8 * brick;
    c.values = values < 0 ? -1
                          : values * GRID_BRICK_TEXELS + inside.x +
                                8 * (inside.y + 9 * inside.z);
    ivec3 low = values < 0 ? 8 * brick : cell, high = values < 0 ? low + 8 : cell + 1;
    vec3 border = mix(vec3(low), vec3(high), greaterThan(w.step, vec3(0.0))) + 0.5;
    vec3 leaves = (border - w.from) / w.step;
    if (values < 0) { // to the faces of the box, where the brick is the outermost one
        bvec3 is_outer = mix(lessThanEqual(low, ivec3(0)), greaterThan(high, last),
                             greaterThan(w.step, vec3(0.0)));
        leaves = mix(leaves, vec3(GRID_FAR), is_outer);
    }
    c.end = max(min(leaves.x, min(leaves.y, leaves.z)), t + w.ahead);
    return c;
}

float grid_value(vec4 low, vec4 high, vec3 share)
{
    vec4 across = mix(low, high, share.z);
    vec2 along = mix(across.xz, across.yw, share.x);
    return mix(along.x, along.y, share.y);
}

// The mean of the value between two points of the way in a cell that is not empty.
float grid_mean(grid_way w, grid_cell c, float t, float end)
{
    vec4 low = vec4(texelFetch(u_grid_values, c.values).xy,
                    texelFetch(u_grid_values, c.values + 8).xy);
    vec4 high = vec4(texelFetch(u_grid_values, c.values + 72).xy,
                     texelFetch(u_grid_values, c.values + 80).xy);
    float middle = 0.5 * (t + end), off = 0.2886751345948129 * (end - t); // half over sqrt(3)
    vec3 origin = w.from - 0.5 - vec3(c.corner);
    vec3 a = clamp(origin + (middle - off) * w.step, 0.0, 1.0);
    vec3 b = clamp(origin + (middle + off) * w.step, 0.0, 1.0);
    return 0.5 * (grid_value(low, high, a) + grid_value(low, high, b));
}

// The integral of the value along the way [m], followed no farther than until it is `most`.
float grid_sum(grid_way w, float most)
{
    float t = 0.0, length_in = w.end - w.begin, sum = 0.0;
    while (t < length_in && sum < most) {
        grid_cell c = grid_cell_at(w, t);
        float end = min(c.end, length_in);
        if (c.values >= 0)
            sum += grid_mean(w, c, t, end) * (end - t);
        t = end;
    }
    return sum;
}

// The optical depth of all grids on a way [m] of light from a point on.
vec3 grids_depth(vec3 p, vec3 way, float length_m)
{
    vec3 depth = vec3(0.0);
    vec2 range = grid_kept(p, way, vec2(0.0, length_m), GRID_CUTS_OF_LIGHT);
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        vec4 sigma = grid_word(g, 4u);
        depth += sigma.rgb * grid_sum(grid_meet(g, p, way, range), sigma.w);
    }
    return depth;
}

// What they let through of it.
vec3 grids_let_through(vec3 p, vec3 way, float length_m)
{
    return exp(-grids_depth(p, way, length_m));
}
