/* SPDX-License-Identifier: MIT */
/* A small table of crashes by scene. */
#include "server/front/quarantine.h"

#include <stdio.h>
#include <string.h>

#include "protocol/utf8.h"

static struct quarantine_entry *find(struct quarantine *quarantine, const char *scene)
{
    for (int i = 0; i < QUARANTINE_SCENES; i++)
        if (strcmp(quarantine->entries[i].scene, scene) == 0)
            return &quarantine->entries[i];
    return NULL;
}

void quarantine_add_crash(struct quarantine *quarantine, const char *scene, const char *reason)
{
    struct quarantine_entry *entry = find(quarantine, scene);
    if (!entry) {
        entry = &quarantine->entries[0];
        for (int i = 1; i < QUARANTINE_SCENES; i++)
            if (quarantine->entries[i].when < entry->when)
                entry = &quarantine->entries[i];
        *entry = (struct quarantine_entry){0};
        snprintf(entry->scene, sizeof entry->scene, "%s", scene);
    }
    entry->crashes++;
    entry->when = ++quarantine->clock;
    utf8_copy(entry->reason, sizeof entry->reason, reason);
}

void quarantine_clear(struct quarantine *quarantine, const char *scene)
{
    struct quarantine_entry *entry = find(quarantine, scene);
    if (entry)
        *entry = (struct quarantine_entry){0};
}

bool quarantine_check(const struct quarantine *quarantine, const char *scene, struct error *err)
{
    for (int i = 0; i < QUARANTINE_SCENES; i++) {
        const struct quarantine_entry *entry = &quarantine->entries[i];
        if (strcmp(entry->scene, scene) == 0 && entry->crashes >= QUARANTINE_CRASHES)
            return error_set(err, ERROR_RENDER_FAILED,
                             "scene %.12s is quarantined: it ended %d workers in a row, the last "
                             "with %s; post it "
                             "again to try once more",
                             scene, entry->crashes, entry->reason);
    }
    return true;
}

int quarantine_count(const struct quarantine *quarantine)
{
    int count = 0;
    for (int i = 0; i < QUARANTINE_SCENES; i++)
        count += quarantine->entries[i].crashes >= QUARANTINE_CRASHES;
    return count;
}
