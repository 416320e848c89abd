// SPDX-License-Identifier: MIT
// What shadow_sort.comp.glsl sorts where 16 events and more would take more registers than a device
// has: depths and indices alone. The order that comes out is kept in memory of the group, and the
// events are fetched in that order. With RUNS they are where they were. Else the sorted list takes
// their place, so that they are STAGED in memory of the group: a column for each thread.
// Needs: NET, RUNS, those of shadow_list.glsl, u_events, u_id, u_media.
// Provides: e, DEPTH, load, exchange, NOTE_ORDER, order_ties, EVENT.
#ifndef RUNS
#define STAGED
#endif

struct sorted {
    float z;
    uint index;
};
sorted e[NET];
#define DEPTH(i) e[i].z
#define COLUMN gl_LocalInvocationIndex
shared uint order_words[NET / 4][64]; // an index in each byte

event event_at(uint place)
{
    int texel = int(u_event_window + place);
    event found;
    found.z_t = texelFetch(u_events, texel);
#ifdef IDS
    found.id = texelFetch(u_id, texel).r;
#endif
#ifdef MEDIA
    found.medium = texelFetch(u_media, texel).r;
#endif
    return found;
}

#ifdef STAGED
shared vec4 staged_z_t[NET][64];
#ifdef IDS
shared uint staged_id[NET][64];
#endif
#ifdef MEDIA
shared uint staged_medium[NET][64];
#endif

float load_depth(int i, uint place)
{
    event loaded = event_at(place);
    staged_z_t[i][COLUMN] = loaded.z_t;
#ifdef IDS
    staged_id[i][COLUMN] = loaded.id;
#endif
#ifdef MEDIA
    staged_medium[i][COLUMN] = loaded.medium;
#endif
    return loaded.z_t.x;
}

event fetch(uint first, uint i)
{
    event found;
    found.z_t = staged_z_t[i][COLUMN];
#ifdef IDS
    found.id = staged_id[i][COLUMN];
#endif
#ifdef MEDIA
    found.medium = staged_medium[i][COLUMN];
#endif
    return found;
}
#else
float load_depth(int i, uint place)
{
    return texelFetch(u_events, int(u_event_window + place)).x;
}

event fetch(uint first, uint i)
{
    return event_at(first + i);
}
#endif

void load(int i, uint place, bool is_used)
{
    e[i].z = is_used ? load_depth(i, place) : FAR_AWAY;
    e[i].index = uint(i);
}

void exchange(int i, int j, bool is_wrong)
{
    sorted a = e[i], b = e[j];
    e[i].z = is_wrong ? b.z : a.z;
    e[j].z = is_wrong ? a.z : b.z;
    e[i].index = is_wrong ? b.index : a.index;
    e[j].index = is_wrong ? a.index : b.index;
}

uint order_at(uint i)
{
    return bitfieldExtract(order_words[i / 4u][COLUMN], 8 * int(i % 4u), 8);
}

void note_order(uint i, uint index)
{
    uint word = order_words[i / 4u][COLUMN];
    order_words[i / 4u][COLUMN] = bitfieldInsert(word, index, 8 * int(i % 4u), 8);
}

#define NOTE_ORDER(i) note_order(uint(i), e[i].index);
#define EVENT(i) fetch(first, order_at(i))

// Of neighbours of equal depth, which lie where the network left them.
void order_ties(uint first, uint n, bool has_any)
{
    for (bool swapped = has_any; swapped;) {
        swapped = false;
        for (uint i = 0u; i + 1u < n; i++) {
            uint a = order_at(i), b = order_at(i + 1u);
            event x = fetch(first, a), y = fetch(first, b);
            if (x.z_t.x != y.z_t.x || !event_is_after(x, y))
                continue;
            note_order(i, b);
            note_order(i + 1u, a);
            swapped = true;
        }
    }
}
