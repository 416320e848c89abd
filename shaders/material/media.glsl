// SPDX-License-Identifier: MIT
// Media along the ray of each sample of a pixel (docs/explanation/shading.md, section 2): the
// running sum of extinctions, and the optical depth up to the point reached.
// Needs, where HAS_MEDIA: SAMPLES, WALKS (how many samples walk the list together: all or 1),
// wide.glsl, view_ray.glsl, u_sample_positions, keys and u_keys_offset of the camera's lists;
// CUT_PLANES (count) where the view has clip planes, MEDIA_SURROUND where the eye may be inside.
// An event's depth is that of its plane at the sample, so that steep planes lose nothing to
// antialiasing.
#ifdef HAS_MEDIA
layout(std430, binding = BIND_ENTRY_SURFACE_1) readonly buffer media_s1_buffer {
    uvec4 media_surfaces_1[];
};
layout(std430, binding = BIND_ENTRY_SURFACE_2) readonly buffer media_s2_buffer {
    uvec4 media_surfaces_2[];
};
#ifdef CUT_PLANES
uniform vec4 u_clip_planes[CUT_PLANES]; // view space
#endif

// What is done for each layer and walk is written out: loops of so long a body stay loops, and
// their steps, times the layers, would exceed those of an invocation (docs/reference/limits.md).
#if WALKS == 4
#define EACH_WALK(DO) DO(0) DO(1) DO(2) DO(3)
#else
#define EACH_WALK(DO) DO(0)
#endif

int media_first = 0;       // sample of the first walk
wide3 media_sigma[WALKS];  // of all media around the point reached [1/m]; wide: they cancel
wide3 media_tau[WALKS];    // optical depth from the eye
float media_at[WALKS];     // view depth reached [m]
vec2 media_ends[WALKS];    // view depths between which the ray is seen
float media_scale[WALKS];  // metres along the ray per metre of view depth

struct medium_event {
    bool is_medium;
    float side;      // +1 entering, -1 leaving
    vec3 sigma;
    float depth;     // stored depth of its plane at the pixel's middle
    vec2 slope;      // of that depth, per pixel
};

medium_event media_event(uint entry, float depth)
{
    uvec4 s1 = media_surfaces_1[entry];
    medium_event e = medium_event(false, 1.0, vec3(0.0), depth, vec2(0.0));
    e.is_medium = (materials[s1.w].flags & MATERIAL_MEDIUM) != 0u;
    if (e.is_medium) {
        e.side = (s1.z & 0x80000000u) != 0u ? 1.0 : -1.0;
        e.sigma = materials[s1.w].attenuation.rgb;
        uvec4 s2 = media_surfaces_2[entry];
        e.depth = uintBitsToFloat(s2.w);
        e.slope = unpack_pair(s2.xy);
    }
    return e;
}

// Where the sample's ray is inside all clip planes, as view depths.
vec2 media_range(vec2 plane, vec2 range)
{
#ifdef CUT_PLANES
#ifdef IS_ORTHOGRAPHIC
    vec3 origin = vec3(plane, 0.0), way = vec3(0.0, 0.0, -1.0);
#else
    vec3 origin = vec3(0.0), way = vec3(plane, -1.0);
#endif
    for (int k = 0; k < CUT_PLANES; k++) {
        float height = dot(u_clip_planes[k].xyz, origin) + u_clip_planes[k].w;
        float climb = dot(u_clip_planes[k].xyz, way);
        float at = climb != 0.0 ? -height / climb : (height < 0.0 ? 3e38 : -3e38);
        if (climb < 0.0)
            range.y = min(range.y, at);
        else
            range.x = max(range.x, at);
    }
#endif
    return vec2(range.x, max(range.x, range.y));
}

// depth: stored opaque depth of each walk's sample, 0 where there is none.
void media_begin(ivec2 pixel, float depth[WALKS])
{
    for (int i = 0; i < WALKS; i++) {
        vec2 plane = view_plane(vec2(pixel) + u_sample_positions[media_first + i]);
#ifdef IS_ORTHOGRAPHIC
        media_scale[i] = 1.0;
        vec2 range = vec2(u_depth.y - u_depth.z, u_depth.y);
#else
        media_scale[i] = sqrt(1.0 + dot(plane, plane));
        vec2 range = vec2(0.0, 1e30);
#endif
        range = media_range(plane, range);
        if (depth[i] > 0.0)
            range.y = min(range.y, max(view_depth(depth[i]), range.x));
        media_at[i] = range.x;
        media_ends[i] = range;
        media_sigma[i] = wide_of(vec3(0.0));
        media_tau[i] = wide_of(vec3(0.0));
    }
}

// At infinity no medium is left, so what surrounds the eye is what the whole ray leaves in excess.
void media_surround(medium_event e, uint coverage)
{
#define SURROUND(i) if (e.is_medium && (coverage & 1u << (media_first + i)) != 0u) \
    media_sigma[i] = wide_add(media_sigma[i], -e.side * e.sigma);
    EACH_WALK(SURROUND)
}

// The media of a pixel's list, from its eye on: media_begin, and what surrounds the eye.
void media_begin_list(ivec2 pixel, float depth[WALKS], uint first, uint end)
{
    media_begin(pixel, depth);
#ifdef MEDIA_SURROUND
    for (uint k = first; k < end; k++) {
        uvec4 key = keys[u_keys_offset + k];
        media_surround(media_event(key.z, uintBitsToFloat(key.x)), key.w);
    }
#endif
}

// Lists are in the order of the pixel's middle. Where a sample meets surfaces the other way round
// it steps back, and the sum comes out as that of the sample: as long as nothing is clamped. With
// one sample per pixel there is no such step, and a negative sum is a body inside out.
void media_advance(int i, float view_z)
{
    float to = clamp(view_z, media_ends[i].x, media_ends[i].y);
    wide way = wide_product(to - media_at[i], media_scale[i]);
#if SAMPLES > 1
    wide3 sigma = media_sigma[i];
#else
    wide3 sigma = wide_positive(media_sigma[i]);
#endif
    media_tau[i] = depth_add(media_tau[i], sigma, way);
    media_at[i] = to;
}

void media_meet(int i, medium_event e)
{
    vec2 offset = u_sample_positions[media_first + i] - 0.5;
    media_advance(i, view_depth(max(e.depth + dot(e.slope, offset), 0.0)));
}

void media_cross(int i, medium_event e)
{
    if (e.is_medium)
        media_sigma[i] = wide_add(media_sigma[i], e.side * e.sigma);
}

// Behind the last event: to the opaque surface; else nothing is left around a perspective ray.
void media_end(int i, float depth)
{
#ifndef IS_ORTHOGRAPHIC
    if (depth > 0.0)
#endif
        media_advance(i, media_ends[i].y);
}

vec3 media_transmittance(int i)
{
    return exp(-max(wide_round(media_tau[i]), 0.0));
}
#endif
