// SPDX-License-Identifier: MIT
// Exclusive prefix sums over the 256 threads of a group, of SCAN_WORDS words each, in shared memory
// and in an order that depends on nothing: each of 16 rakes per word sums 16 threads one after the
// other, one thread per word sums the rakes. As many threads as sums are at work then, and a scan
// takes three barriers: Merrill and Grimshaw 2009, "Parallel scan for stream architectures";
// Blelloch 1990, "Prefix sums and their applications", on fewer processors than values. No
// subgroups are assumed.
// Needs: SCAN_WORDS, at most 16; optionally SCAN_JOIN(word, a, b), associative, with 0 as its
// identity, in place of a + b.
#define SCAN_THREADS 256u
#define SCAN_RAKES 16u
#define SCAN_ROW (SCAN_THREADS + SCAN_RAKES) // one word of padding per rake: no two share a bank
#ifndef SCAN_JOIN
#define SCAN_JOIN(word, a, b) ((a) + (b))
#endif

shared uint scan_values[SCAN_WORDS * SCAN_ROW];
shared uint scan_rakes[SCAN_WORDS * (SCAN_RAKES + 1u)]; // the last of each word: its total

uint scan_place(uint word, uint thread)
{
    return word * SCAN_ROW + thread + thread / SCAN_RAKES;
}

void scan_put(uint word, uint value)
{
    scan_values[scan_place(word, gl_LocalInvocationIndex)] = value;
}

void scan_wait()
{
    memoryBarrierShared();
    barrier();
}

// Of what all threads have put. In uniform control flow.
void scan_group()
{
    scan_wait();
    uint word = gl_LocalInvocationIndex / SCAN_RAKES, rake = gl_LocalInvocationIndex % SCAN_RAKES;
    if (word < SCAN_WORDS) {
        uint running = 0u;
        for (uint i = 0u; i < SCAN_THREADS / SCAN_RAKES; i++) {
            uint place = scan_place(word, rake * (SCAN_THREADS / SCAN_RAKES) + i);
            uint value = scan_values[place];
            scan_values[place] = running;
            running = SCAN_JOIN(word, running, value);
        }
        scan_rakes[word * (SCAN_RAKES + 1u) + rake] = running;
    }
    scan_wait();
    if (gl_LocalInvocationIndex < SCAN_WORDS) {
        uint first = gl_LocalInvocationIndex * (SCAN_RAKES + 1u), running = 0u;
        for (uint i = 0u; i < SCAN_RAKES; i++) {
            uint value = scan_rakes[first + i];
            scan_rakes[first + i] = running;
            running = SCAN_JOIN(gl_LocalInvocationIndex, running, value);
        }
        scan_rakes[first + SCAN_RAKES] = running;
    }
    scan_wait();
}

// Of the threads before this one.
uint scan_before(uint word)
{
    uint thread = gl_LocalInvocationIndex;
    uint rake = scan_rakes[word * (SCAN_RAKES + 1u) + thread / SCAN_RAKES];
    return SCAN_JOIN(word, rake, scan_values[scan_place(word, thread)]);
}

uint scan_total(uint word)
{
    return scan_rakes[word * (SCAN_RAKES + 1u) + SCAN_RAKES];
}
