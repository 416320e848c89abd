// SPDX-License-Identifier: MIT
// Provides: how a lane waits for a spin lock. It reads the word before it exchanges it, and after
// each try it leaves the memory to the lane that holds the lock for some steps more (test and
// test-and-set with back-off: Anderson 1990, "The performance of spin lock alternatives for
// shared-memory multiprocessors"). The caller's loop holds the critical section, so that a lane
// that owns the lock never waits for lanes of its group that do not.
// The steps of a pause, of a few instructions each, that take as long as a read of the word.
#define SPIN_PAUSE_MOST 64u

struct spin {
    uint tries, pause; // both 0 at first
};

// False: it is time for a try.
bool spin_pauses(inout spin s)
{
    if (s.pause > 0u) {
        s.pause--;
        return true;
    }
    s.tries++;
    s.pause = min(s.tries, SPIN_PAUSE_MOST);
    return false;
}
