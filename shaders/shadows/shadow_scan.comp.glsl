// SPDX-License-Identifier: MIT
// From the counts of all lights to the ends of their lists, and the lists of their texels by length
// class, in three levels: reduce, scan, add (Sengupta, Harris, Zhang and Owens 2007, "Scan
// primitives for GPU computing"; Merrill and Grimshaw 2009, "Parallel scan for stream
// architectures"). All are sums of integers, so the result depends on the counts alone. A light
// that the room does not suffice for, which can be where it was guessed, gets empty lists.
//   PASS=0  a group per tile of TILE counts: its sums
//   PASS=1  a group per light and word: exclusive scan of the sums of its tiles; totals to the
//           statistics
//   PASS=2  a group per tile: inclusive scan of its counts to the heads behind the first, and its
//           texels of `shortest` or more events, by class and in their order
// A thread loops over 8 counts, or over the tiles of a light divided by 256.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

#define WORDS 20u // of a tile and of a light: struct deep_statistics
#define SUM 0u
#define HIGH 1u   // bits 32.. of the total
#define LONGEST 2u
#define OCCUPIED 3u
#define CLASS_0 4u // texels of 2^c + 1 to 2^(c + 1) events; class 0: of `shortest` to 2
#define CLASSES 16u

#define ITEMS 8u // counts per thread; in fields of four bits, their classes are two words
#define TILE (256u * ITEMS)

// Words of a group's scan. Two classes share one: 16 bits hold the counts of a tile.
#define SCAN_CLASSES 8u
#if PASS == 0
#define SCAN_SUM 8u
#define SCAN_OCCUPIED 9u
#define SCAN_LONGEST 10u
#define SCAN_WORDS 11u
#define SCAN_JOIN(word, a, b) ((word) == SCAN_LONGEST ? max(a, b) : (a) + (b))
#elif PASS == 1
// Sums of the lower and upper halves of words: together their total, in 48 bits.
#define SCAN_WORDS 2u
#define SCAN_JOIN(word, a, b) (gl_WorkGroupID.z == LONGEST ? max(a, b) : (a) + (b))
#else
#define SCAN_SUM 8u
#define SCAN_WORDS 9u
#endif

layout(local_size_x = 256) in;
#include "base/group_scan.glsl"

layout(std430, binding = BIND_SHADOW_COUNTS) buffer count_buffer { uint counts[]; };
layout(std430, binding = BIND_SCAN) buffer scan_buffer { uint sums[]; }; // word, tile
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
layout(std430, binding = BIND_LIST_NODES) writeonly buffer list_buffer { uint class_texels[]; };
layout(std430, binding = BIND_DEEP_LIGHTS) readonly buffer light_buffer { deep_light lights[]; };
layout(std430, binding = BIND_DEEP_LISTS) readonly buffer table_buffer { uint list_first[]; };

#if PASS == 2
layout(std430, binding = BIND_SHADOW_HEADS) writeonly buffer head_buffer { uint heads[]; };
#endif

uniform uint u_tiles;       // of all lights
uniform uint u_lights;      // PASS=1: all; else those whose counts are bound, from ...
uniform uint u_first_light; // ... on
uniform uint u_first_tile;  // the tiles that are scanned: the first of them, ...
uniform uint u_groups;      // ... and their number
uniform uint u_window;      // the first count that is bound, ...
uniform uint u_head_window; // ... and the first head
uniform uint u_record;      // statistics of the first light, in records that begin anew ...
uniform uint u_record_mask; // ... behind so many
uniform uint u_table;       // of these lights in list_first

// A word of a light's statistics.
uint statistic(uint light, uint word)
{
    return (u_record + light & u_record_mask) * WORDS + word;
}

uint group_index()
{
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

#if PASS != 1
// The light that the tile is of: the last one that begins at it or before.
uint find_light(uint tile)
{
    uint low = u_first_light, high = u_first_light + u_lights;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (lights[middle].first_tile <= tile)
            low = middle;
        else
            high = middle;
    }
    return low;
}

uint length_class(uint n)
{
    return min(uint(findMSB(max(n, 2u) - 1u)), CLASSES - 1u);
}

// One in a class's field of four bits: classes 0 to 7 in x, the others in y.
uvec2 class_field(uint class_)
{
    uint field = 1u << (class_ % 8u * 4u);
    return class_ < 8u ? uvec2(field, 0u) : uvec2(0u, field);
}

// Classes 8 h + i and 8 h + i + 4, i below 4, go into word 4 h + i of a group's scan.
void put_classes(uvec2 classes)
{
    for (uint i = 0u; i < 4u; i++) {
        scan_put(i, classes.x >> (i * 4u) & 0x000f000fu);
        scan_put(4u + i, classes.y >> (i * 4u) & 0x000f000fu);
    }
}

uint class_of_scan(uint word, uint class_)
{
    return word >> (class_ % 8u / 4u * 16u) & 0xffffu;
}

uint class_word(uint class_)
{
    return class_ / 8u * 4u + class_ % 4u;
}
#endif

#if PASS == 0
void main()
{
    if (group_index() >= u_groups)
        return;
    uint tile = u_first_tile + group_index();
    uint light = find_light(tile);
    uint at = (tile - lights[light].first_tile) * TILE, left = lights[light].texels - at;
    uint first = lights[light].first_count - u_window + at, shortest = lights[light].shortest;
    uint sum = 0u, longest = 0u, occupied = 0u;
    uvec2 classes = uvec2(0u);
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = k * SCAN_THREADS + gl_LocalInvocationIndex;
        uint n = i < left ? counts[first + i] : 0u;
        sum += n;
        longest = max(longest, n);
        occupied += min(n, 1u);
        classes += n >= shortest ? class_field(length_class(n)) : uvec2(0u);
    }
    put_classes(classes);
    scan_put(SCAN_SUM, sum);
    scan_put(SCAN_OCCUPIED, occupied);
    scan_put(SCAN_LONGEST, longest);
    scan_group();
    uint word = gl_LocalInvocationIndex;
    if (word >= WORDS || word == HIGH)
        return;
    uint value;
    if (word >= CLASS_0)
        value = class_of_scan(scan_total(class_word(word - CLASS_0)), word - CLASS_0);
    else
        value = scan_total(word == SUM ? SCAN_SUM : word == LONGEST ? SCAN_LONGEST : SCAN_OCCUPIED);
    sums[word * u_tiles + tile] = value;
}
#elif PASS == 1
void main()
{
    uint light = group_index(), word = gl_WorkGroupID.z;
    if (light >= u_lights || word == HIGH)
        return;
    uint tiles = (lights[light].texels + TILE - 1u) / TILE;
    uint share = (tiles + SCAN_THREADS - 1u) / SCAN_THREADS;
    uint first = min(gl_LocalInvocationIndex * share, tiles), end = min(first + share, tiles);
    uint column = word * u_tiles + lights[light].first_tile;
    uint low = 0u, high = 0u; // of LONGEST: all in `low`
    for (uint i = column + first; i < column + end; i++) {
        uint n = sums[i];
        low = word == LONGEST ? max(low, n) : low + (n & 0xffffu);
        high = word == LONGEST ? 0u : high + (n >> 16);
    }
    if (word != LONGEST) {
        high += low >> 16;
        low &= 0xffffu;
    }
    scan_put(0u, low);
    scan_put(1u, high);
    scan_group();
    uint running = scan_before(0u) + (scan_before(1u) << 16);
    for (uint i = column + first; i < column + end && word != LONGEST; i++) {
        uint n = sums[i];
        sums[i] = running;
        running += n;
    }
    if (gl_LocalInvocationIndex != 0u)
        return;
    uint carry, total = uaddCarry(scan_total(0u), scan_total(1u) << 16, carry);
    statistics[statistic(light, word)] = total;
    if (word == SUM)
        statistics[statistic(light, HIGH)] = (scan_total(1u) >> 16) + carry;
}
#else
shared uint tile_counts[TILE + TILE / 32u]; // padded: threads eight apart read other banks
shared uint class_first[CLASSES];           // where the tile's texels of a class go
shared uint lacks_room;                     // of the light

uint tile_place(uint i)
{
    return i + i / 32u;
}

// Whether a word of the light's statistics is larger than what its lists have been given.
bool exceeds_room(uint light, uint word)
{
    uint found = statistics[statistic(light, word)];
    if (word == SUM || word == LONGEST)
        return found > (word == SUM ? lights[light].event_room : lights[light].longest_room);
    if (word < CLASS_0)
        return word == HIGH && found > 0u;
    if (lights[light].shortest == 0xffffffffu)
        return false; // it has no lists, and these words do not stand
    uint row = u_table + (word - CLASS_0) * u_lights + light - u_first_light;
    return found > list_first[row + 1u] - list_first[row];
}

void main()
{
    if (group_index() >= u_groups)
        return;
    uint tile = u_first_tile + group_index();
    uint light = find_light(tile), thread = gl_LocalInvocationIndex;
    if (thread == 0u)
        lacks_room = 0u;
    scan_wait();
    if (thread < WORDS && exceeds_room(light, thread))
        lacks_room = 1u;
    uint at = (tile - lights[light].first_tile) * TILE, left = lights[light].texels - at;
    uint first = lights[light].first_count - u_window + at, shortest = lights[light].shortest;
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = k * SCAN_THREADS + thread;
        tile_counts[tile_place(i)] = i < left ? counts[first + i] : 0u;
    }
    if (thread < CLASSES)
        class_first[thread] = list_first[u_table + thread * u_lights + light - u_first_light] +
                              sums[(CLASS_0 + thread) * u_tiles + tile];
    scan_wait();
    uint head = lights[light].first_head - u_head_window + at;
    if (thread == 0u && at == 0u)
        heads[head] = 0u;
    if (lacks_room != 0u) {
        for (uint i = thread; i < min(left, TILE); i += SCAN_THREADS) {
            heads[head + 1u + i] = 0u;
            counts[first + i] = 0u; // so that nothing is written
        }
        return;
    }
    uint sum = 0u;
    uvec2 classes = uvec2(0u);
    for (uint k = 0u; k < ITEMS; k++) {
        uint n = tile_counts[tile_place(thread * ITEMS + k)];
        sum += n;
        classes += n >= shortest ? class_field(length_class(n)) : uvec2(0u);
    }
    put_classes(classes);
    scan_put(SCAN_SUM, sum);
    scan_group();
    uint running = sums[SUM * u_tiles + tile] + scan_before(SCAN_SUM);
    uvec2 seen = uvec2(0u); // by this thread
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = thread * ITEMS + k, n = tile_counts[tile_place(i)];
        running += n;
        tile_counts[tile_place(i)] = running;
        if (n >= shortest && i < left) {
            uint class_ = length_class(n);
            uint before = class_of_scan(scan_before(class_word(class_)), class_);
            before += (class_ < 8u ? seen.x : seen.y) >> (class_ % 8u * 4u) & 15u;
            class_texels[class_first[class_] + before] = at + i;
            seen += class_field(class_);
        }
    }
    scan_wait();
    for (uint k = 0u; k < ITEMS; k++) {
        uint i = k * SCAN_THREADS + thread;
        if (i < left)
            heads[head + 1u + i] = tile_counts[tile_place(i)];
    }
}
#endif
