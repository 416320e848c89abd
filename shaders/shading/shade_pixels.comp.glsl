// SPDX-License-Identifier: MIT
// Shades the opaque surface of each pixel and composites its transparent layers over it. With
// 4 samples in two passes: of all pixels, and of those that light_contrast.comp.glsl found, whose
// samples are then shaded apart.
// A set of surfaces like any other, but for two things that shade_surfaces.comp.glsl would pay for:
// an invocation lights all surfaces of its pixel, which only a look at its samples tells; and their
// light is composited where it is, because a pass of its own would write and read the colour of
// every sample.
// Needs: SAMPLES (1 or 4), SAMPLES_APART (the second pass), SAMPLES_IN_TURN (below),
// HAS_BACKDROP (the picture is mapped to the screen; TONE_HAS_CHOICE of image/tone_operators.glsl,
// MAPPED_LATER of shading/backdrop.glsl),
// KEEPS_OPAQUE (what is behind the layers is kept, of one sample; not with HAS_REFRACTION),
// HAS_ENVIRONMENT_BACKGROUND (of shading/environment.glsl: it is seen where nothing is),
// IS_ORTHOGRAPHIC, HAS_TRACED_SHADOWS, those of lighting.glsl; LAYERS where there are layers: the
// source of the transparency method (renderer/transparency/method.h), which provides
//   struct pixel_layers: what it knows of a pixel before it follows samples through the layers,
//   pixel_layers layers_begin(ivec2 pixel),
//   void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
//                         out vec3 radiance[WALKS], out vec3 through[WALKS]): of each sample from
//   the first on, the light of its layers, and what they let through of what is behind them, and
//   where HAS_REFRACTION (renderer/shading/refraction.h) bent_layers beside it,
// and may use what stands before its inclusion.
#include "base/wide.glsl"
#if SAMPLES > 1 && defined SAMPLES_IN_TURN
#include "window/sample_room.glsl"
#endif
#include "shading/lighting.glsl"
#include "window/view_ray.glsl"
#ifdef HAS_BACKDROP
#include "shading/backdrop.glsl"
#endif
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
layout(rgba32f, binding = 0) uniform image2D u_image;
#ifdef HAS_LIGHT_PARTS
layout(rgba32f, binding = 1) uniform image2DArray u_parts; // light so far, a layer per sample
#endif
#include "shared/contrast.h"
#ifdef SAMPLES_APART
#include "window/apart.glsl"
#elif SAMPLES > 1 && defined HAS_LIGHTS
#define TELLS_LIGHT
#include "window/light_word.glsl"
layout(r32ui, binding = 2) writeonly uniform uimage2DArray u_light; // a layer per sample
#endif
// What each sample shows behind the layers, and its light.
#if SAMPLES == 1
vec4 opaque_color;
#define SURFACE_WORDS(i) texelFetch(u_surface_0, pixel, i)
#define OPAQUE_COLOR(i) opaque_color
#define KEEP_COLOR(i, color) opaque_color = color;
#elif !defined SAMPLES_IN_TURN
vec4 opaque_colors[SAMPLES];
#define SURFACE_WORDS(i) texelFetch(u_surface_0, pixel, i)
#define GROUP_NORMAL(i) normal_at(pixel, i, at.s.normal, offset)
#define OPAQUE_COLOR(i) opaque_colors[i]
#define KEEP_COLOR(i, color) opaque_colors[i] = color;
uvec4 light_words = uvec4(0u);
#define LIGHT_WORD(i) light_words[i]
#endif
#ifdef HAS_REFRACTION
layout(rgba32f, binding = 3) writeonly uniform image2DArray u_bent_parts;
layout(r32ui, binding = 4) writeonly uniform uimage2D u_bent;
layout(rgba32f, binding = 5) writeonly uniform image2D u_unbent; // the picture without what bends
#endif
#ifdef KEEPS_OPAQUE
layout(rgba32f, binding = 3) writeonly uniform image2D u_opaque;
#endif
uniform uvec2 u_size_px;
#ifndef SAMPLES_APART
uniform uint u_first; // row of the dispatch
#endif
#ifdef HAS_ENVIRONMENT_BACKGROUND
vec4 background_at(ivec2 pixel)
{
    return vec4(environment_radiance(-view_direction(view_position(vec2(pixel) + 0.5, 1.0))), 1.0);
}
#define BACKGROUND background_at(pixel)
#else
uniform vec4 u_background; // associated alpha; 0 where there is a backdrop
#define BACKGROUND u_background
#endif
uniform vec2 u_sample_positions[SAMPLES]; // in the pixel, y up
#ifdef HAS_TRACED_SHADOWS
layout(binding = UNIT_TRACED_HEADS) uniform usamplerBuffer u_traced_heads;
uniform uint u_traced_first; // points of layers come before
#elif defined HAS_ENVIRONMENT_VISIBILITY
layout(std430, binding = BIND_TRACED_HEADS) readonly buffer head_buffer { uint heads[]; };
uniform uint u_seen_first; // likewise
#endif
#if defined HAS_TRACED_SHADOWS || defined HAS_ENVIRONMENT_VISIBILITY
uint traced_point = 0u; // of the next surface that is shaded
#endif
#include "window/sample_groups.glsl"
#if defined HAS_ENVIRONMENT_VISIBILITY && !defined HAS_TRACED_SHADOWS && defined SAMPLES_APART
// Samples apart have no points of their own: that of the group that they were of.
uint point_of_sample(ivec2 pixel, int i)
{
    uint before = 0u;
    for (uint remaining = (1u << SAMPLES) - 1u; remaining != 0u;) {
        sample_group g = group_next(pixel, remaining, 0u);
        remaining &= ~g.members;
        if ((g.members & 1u << i) != 0u)
            break;
        before += g.depth > 0.0 ? 1u : 0u;
    }
    return traced_point + before;
}
#else
#define point_of_sample(pixel, i) (traced_point++)
#endif
// A walk follows a sample through the pixel's layers. In turn they take a quarter of the registers,
// and read the layers once each; together they take a quarter of the steps of loops, of which
// llvmpipe has few (renderer/shading/loop_steps.h).
#ifdef SAMPLES_IN_TURN
#define WALKS 1
#else
#define WALKS SAMPLES
#endif

vec3 light_before(ivec2 pixel, int i)
{
#ifdef HAS_LIGHT_PARTS
    return imageLoad(u_parts, ivec3(pixel, i)).rgb;
#else
    return vec3(0.0);
#endif
}

#ifdef TELLS_LIGHT
// The light of samples, for their contrast with those of other pixels.
void note_light(uint members, vec3 radiance, vec3 base)
{
    uint word = light_word(radiance / (base + CONTRAST_BASE_LEAST));
#ifdef SAMPLES_IN_TURN
    for (; members != 0u; members &= members - 1u)
        LIGHT_WORD(findLSB(members)) = word;
#else
    bvec4 is_member = notEqual(uvec4(members) & uvec4(1u, 2u, 4u, 8u), uvec4(0u));
    light_words = mix(light_words, uvec4(word), is_member);
#endif
}

#ifdef SAMPLES_IN_TURN
void note_dark(uint members)
{
    for (; members != 0u; members &= members - 1u)
        LIGHT_WORD(findLSB(members)) = 0u;
}
#endif

void write_light(ivec2 pixel)
{
    uint first = LIGHT_WORD(0);
    bool is_mixed = false;
    for (int i = 1; i < SAMPLES; i++)
        is_mixed = is_mixed || LIGHT_WORD(i) != first;
    imageStore(u_light, ivec3(pixel, 0), uvec4(first | (is_mixed ? LIGHT_MIXED : 0u)));
    for (int i = 1; i < SAMPLES && is_mixed; i++)
        imageStore(u_light, ivec3(pixel, i), uvec4(LIGHT_WORD(i)));
}
#endif

#ifdef SAMPLES_APART
// What the normal of sample i's surface changes by to the pixel on that side; 0 where another
// surface is there.
vec3 normal_step(ivec2 pixel, int i, ivec2 side, vec3 normal)
{
    ivec2 other = clamp(pixel + side, ivec2(0), ivec2(u_size_px) - 1);
    bool is_same = signatures_are_near(texelFetch(u_signature, other, i).x,
                                       texelFetch(u_signature, pixel, i).x);
    return is_same ? unpack_unit(texelFetch(u_surface_0, other, i).x) - normal : vec3(0.0);
}

// Normals are those of the pixel's middle: at the place of a sample, by those of the neighbours.
vec3 normal_at(ivec2 pixel, int i, vec3 normal, vec2 offset)
{
    vec2 from_middle = offset - 0.5;
    ivec2 side = ivec2(sign(from_middle));
    vec3 n = normal + abs(from_middle.x) * normal_step(pixel, i, ivec2(side.x, 0), normal) +
             abs(from_middle.y) * normal_step(pixel, i, ivec2(0, side.y), normal);
    return normalize(n);
}
#endif

// The surface of sample i.
lit_surface load_sample(ivec2 pixel, int i, float depth, vec2 offset)
{
    lit_surface at;
#ifdef ROOM
    room_sample = i;
#endif
    uvec4 s1 = texelFetch(u_surface_1, pixel, i);
    at.s = surface_unpack(SURFACE_WORDS(i), s1);
#ifdef SAMPLES_APART
    at.s.normal = GROUP_NORMAL(i);
#endif
#ifdef HAS_LOBES
    at.lobes = texelFetch(u_lobes, pixel, i);
#endif
#ifdef HAS_MORE_LOBES
    at.more_lobes = texelFetch(u_more_lobes, pixel, i);
#endif
    at.transmission = 0.0;
    at.pixel = uvec2(pixel);
    at.view_z = view_depth(depth);
    at.position = view_position(vec2(pixel) + offset, at.view_z);
    at.view = view_direction(at.position);
#ifdef HAS_NORMAL_OFFSET
    light_normal_offset = surface_normal_offset(s1) * length(at.position);
#endif
#if defined HAS_TRACED_SHADOWS || defined HAS_ENVIRONMENT_VISIBILITY
    uint point = point_of_sample(pixel, i);
#endif
#ifdef HAS_TRACED_SHADOWS
    traced_begin(point);
#endif
#ifdef HAS_ENVIRONMENT_VISIBILITY
    visibility_begin(point);
#endif
    at.before = light_before(pixel, i);
    return at;
}

// The same, lit, for all members (bit set).
vec4 shade_sample(ivec2 pixel, int i, uint members, float depth, vec2 offset)
{
    vec3 radiance = lighting_evaluate(load_sample(pixel, i, depth, offset));
#ifdef TELLS_LIGHT
    // not kept in registers while the surface is lit
    note_light(members, radiance, surface_unpack(SURFACE_WORDS(i), uvec4(0u)).base);
#endif
    return vec4(radiance, 1.0);
}

#if SAMPLES == 1
void shade_opaque(ivec2 pixel, uint apart)
{
    float depth = texelFetch(u_depth_map, pixel, 0).x;
    vec4 shaded;
    if (depth > 0.0)
        shaded = shade_sample(pixel, 0, 1u, depth, u_sample_positions[0]);
    else
        shaded = BACKGROUND;
    KEEP_COLOR(0, shaded)
}
// Each distinct surface among the samples is shaded once, in the middle of them; those apart at
// their own places.
#elif defined SAMPLES_IN_TURN
// First the groups are found. Returns the members of each, SAMPLES bits from those of its first
// sample on.
uint find_groups(ivec2 pixel, uint apart)
{
    uint groups = 0u;
    for (uint remaining = (1u << SAMPLES) - 1u; remaining != 0u;) {
        sample_group g = group_next(pixel, remaining, apart);
        uvec4 words = texelFetch(u_surface_0, pixel, g.first);
        SURFACE_WORDS(g.first) = words;
#ifdef SAMPLES_APART
        vec3 normal = normal_at(pixel, g.first, unpack_unit(words.x), g.middle.xy);
        KEEP_GROUP(g.first, g.middle.z, normal)
#else
        KEEP_GROUP(g.first, g.middle.z)
#endif
        groups |= g.members << SAMPLES * g.first;
        remaining &= ~g.members;
    }
    return groups;
}

void shade_opaque(ivec2 pixel, uint apart)
{
    const uint mask = (1u << SAMPLES) - 1u;
    uint bare = 0u; // samples that show the background, which is looked at once, behind the loop
    for (uint groups = find_groups(pixel, apart); groups != 0u;) {
        int first = findLSB(groups) / SAMPLES;
        uint members = groups >> SAMPLES * first & mask;
        float depth = GROUP_DEPTH(first); // 0 where that of all members is
        groups &= ~(mask << SAMPLES * first);
        if (depth > 0.0) {
            vec4 shaded = shade_sample(pixel, first, members, depth, group_place(members));
            for (; members != 0u; members &= members - 1u)
                KEEP_COLOR(findLSB(members), shaded)
        } else {
            bare |= members;
        }
    }
    if (bare != 0u) {
        vec4 background = BACKGROUND;
        for (uint left = bare; left != 0u; left &= left - 1u)
            KEEP_COLOR(findLSB(left), background)
#ifdef TELLS_LIGHT
        note_dark(bare);
#endif
    }
}
#else
void shade_opaque(ivec2 pixel, uint apart)
{
    for (int j = 0; j < SAMPLES; j++)
        KEEP_COLOR(j, vec4(0.0))
    uint remaining = (1u << SAMPLES) - 1u;
    while (remaining != 0u) {
        sample_group g = group_next(pixel, remaining, apart);
        vec4 shaded;
        if (g.depth > 0.0)
            shaded = shade_sample(pixel, g.first, g.members, g.middle.z, g.middle.xy);
        else
            shaded = BACKGROUND;
        for (int j = 0; j < SAMPLES; j++)
            if ((g.members & 1u << j) != 0u)
                KEEP_COLOR(j, shaded)
        remaining &= ~g.members;
    }
}
#endif

#ifdef SAMPLES_APART
bool are_in_other_light(vec3 a, vec3 b)
{
    vec3 brightest = max(a, b);
    float least = max(brightest.r, max(brightest.g, brightest.b)) * CONTRAST_CHANNEL_LEAST;
    return any(greaterThan(abs(a - b), CONTRAST_LEAST * (a + b + least)));
}

// Pairs of samples apart that show one surface: bit a * SAMPLES + b for a below b.
uint pairs_apart(ivec2 pixel, uint apart)
{
    uint pairs = 0u;
    for (int i = 0; i < SAMPLES * SAMPLES; i++) {
        int a = i / SAMPLES, b = i % SAMPLES;
        bool are_apart = a < b && (apart & 1u << a) != 0u && (apart & 1u << b) != 0u;
        bool is_one = signatures_are_near(texelFetch(u_signature, pixel, a).x,
                                          texelFetch(u_signature, pixel, b).x);
        pairs |= are_apart && is_one ? 1u << i : 0u;
    }
    return pairs;
}

// Whether samples of a pair are.
bool samples_differ(uint pairs)
{
    bool differ = false;
    for (int i = 0; i < SAMPLES * SAMPLES; i++) {
        int a = i / SAMPLES, b = i % SAMPLES;
        bool is_other = are_in_other_light(OPAQUE_COLOR(a).rgb, OPAQUE_COLOR(b).rgb);
        differ = differ || (a < b && (pairs & 1u << i) != 0u && is_other);
    }
    return differ;
}
#endif

#ifdef HAS_ATMOSPHERE
#include "shading/atmosphere_seen.glsl"
#endif
#each LAYERS #include "$1"

#ifdef HAS_REFRACTION
// What refraction.comp.glsl needs of the samples of a pixel.
struct bent_sum {
    vec4 plain; // the picture without what bends
    vec4 share; // what is let through by samples that are bent, and their number
    uint entry; // 1 + that of the nearest of the first
};

// Returns whether the sample is bent: what is behind it is not its own.
bool bent_add(inout bent_sum sum, layers_bent layers, vec3 through, vec4 behind)
{
    vec3 t = layers.through;
    float alpha = 1.0 - (1.0 - behind.a) * (t.r + t.g + t.b) / 3.0;
    sum.plain += vec4(layers.radiance + t * behind.rgb, alpha);
    if (layers.entry == NOT_BENT)
        return false;
    sum.share += vec4(through, 1.0);
    sum.entry = sum.entry == 0u ? layers.entry + 1u : sum.entry;
    return true;
}

void bent_store(ivec2 pixel, bent_sum sum, vec4 seen)
{
    imageStore(u_unbent, pixel, sum.plain / float(SAMPLES));
    imageStore(u_bent, pixel, uvec4(sum.entry));
    if (sum.entry != 0u) {
        imageStore(u_bent_parts, ivec3(pixel, 0), sum.share / float(SAMPLES));
        imageStore(u_bent_parts, ivec3(pixel, 1), seen / float(SAMPLES));
    }
}
#endif

vec4 composite(ivec2 pixel)
{
    vec4 sum = vec4(0.0);
#ifdef HAS_BACKDROP
    vec4 seen = vec4(0.0); // as map_over_backdrop has it, of all samples
#endif
#ifdef LAYERS
#ifdef HAS_REFRACTION
    bent_sum bent = bent_sum(vec4(0.0), vec4(0.0), 0u);
#endif
    pixel_layers layers = layers_begin(pixel);
    for (int sample_ = 0; sample_ < SAMPLES; sample_ += WALKS) {
        vec3 radiance[WALKS], through[WALKS];
        layers_composite(pixel, sample_, layers, radiance, through);
        for (int i = 0; i < WALKS; i++) {
            vec3 t = through[i];
            vec4 behind = OPAQUE_COLOR(sample_ + i);
#ifdef HAS_REFRACTION
            if (bent_add(bent, bent_layers[i], t, behind)) {
                sum.rgb += radiance[i];
                continue;
            }
#endif
            float alpha = 1.0 - (1.0 - behind.a) * (t.r + t.g + t.b) / 3.0;
            sum += vec4(radiance[i] + t * behind.rgb, alpha);
#ifdef HAS_BACKDROP
            bool is_bare = behind.a == 0.0 && t == vec3(1.0) && radiance[i] == vec3(0.0);
            seen += is_bare ? vec4(0.0) : vec4(t * (1.0 - behind.a), 1.0);
#endif
        }
    }
#elif defined HAS_ATMOSPHERE
    atmosphere_begin(vec2(pixel) + 0.5, texelFetch(u_depth_map, pixel, 0).x);
    for (int first = 0; first < SAMPLES; first += WALKS) {
        float depth[WALKS];
        atmosphere_seen air[WALKS];
        for (int i = 0; i < WALKS; i++)
            depth[i] = texelFetch(u_depth_map, pixel, first + i).x;
        atmosphere_look_at(vec2(pixel) + 0.5, depth, air);
        for (int i = 0; i < WALKS; i++) {
            vec4 behind = OPAQUE_COLOR(first + i);
            air_share t = air[i].through;
            sum += vec4(air[i].light + t * behind.rgb, 1.0 - (1.0 - behind.a) * air_mean(t));
#ifdef HAS_BACKDROP
            seen += vec4(vec3(t * (1.0 - behind.a)), 1.0);
#endif
        }
    }
#else
    for (int i = 0; i < SAMPLES; i++)
        sum += OPAQUE_COLOR(i);
#ifdef HAS_BACKDROP
    seen.a = sum.a;
#endif
#endif
#ifdef HAS_REFRACTION
#ifdef HAS_BACKDROP
    bent_store(pixel, bent, seen);
#else
    bent_store(pixel, bent, vec4(0.0));
#endif
    if (bent.entry != 0u) // refraction.comp.glsl completes it
        return sum / float(SAMPLES);
#endif
#ifdef HAS_BACKDROP
    return map_over_backdrop(pixel, sum.rgb / float(SAMPLES), seen / float(SAMPLES));
#else
    return sum / float(SAMPLES);
#endif
}

void main()
{
#ifdef SAMPLES_APART
    uvec2 at;
    uint apart = apart_take(at);
    if (apart == 0u)
        return;
#else
    uvec2 at = gl_GlobalInvocationID.xy + uvec2(0u, u_first);
    const uint apart = 0u;
#endif
    ivec2 pixel = ivec2(at);
    if (any(greaterThanEqual(at, u_size_px)))
        return;
#ifdef HAS_TRACED_SHADOWS
    uint head = texelFetch(u_traced_heads, int(pixel.y * int(u_size_px.x) + pixel.x)).x;
    traced_point = u_traced_first + (head >> 3);
#elif defined HAS_ENVIRONMENT_VISIBILITY
    traced_point = u_seen_first + (heads[at.y * u_size_px.x + at.x] >> 3);
#endif
#ifdef SAMPLES_APART
    bool is_unknown = (apart & APART_UNKNOWN) != 0u;
    uint pairs = is_unknown ? pairs_apart(pixel, apart) : 0u;
#endif
    shade_opaque(pixel, apart);
#ifdef HAS_LIGHT_PARTS
    if (!IS_LAST_PART) { // layers and background are composited once
        for (int i = 0; i < SAMPLES; i++)
            imageStore(u_parts, ivec3(pixel, i), OPAQUE_COLOR(i));
        return;
    }
#endif
#ifdef TELLS_LIGHT
    write_light(pixel);
#endif
#ifdef SAMPLES_APART
    if (is_unknown && !samples_differ(pairs))
        return; // the pixel is as the first pass left it
#endif
#ifdef KEEPS_OPAQUE
    imageStore(u_opaque, pixel, OPAQUE_COLOR(0));
#endif
    vec4 result = composite(pixel);
    // A value that is not a number has no place in an image; none is known to arise.
    result = mix(result, vec4(0.0), isnan(result));
    imageStore(u_image, pixel, clamp(result, vec4(-3e38), vec4(3e38)));
}
