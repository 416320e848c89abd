/* SPDX-License-Identifier: MIT */
/* A ring of pairs. */
#include "server/views/target_digests.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { PAIRS = 256 }; /* 33 KB */

struct pair {
    char target[DIGEST_TEXT_BYTES], drawn[DIGEST_TEXT_BYTES];
};

struct target_digests {
    pthread_mutex_t mutex;
    struct pair pairs[PAIRS];
    size_t next;
};

struct target_digests *target_digests_create(struct error *err)
{
    struct target_digests *digests = calloc(1, sizeof *digests);
    if (digests)
        pthread_mutex_init(&digests->mutex, NULL);
    else
        error_set(err, ERROR_NO_MEMORY, "digests of targets");
    return digests;
}

void target_digests_destroy(struct target_digests *digests)
{
    if (digests)
        pthread_mutex_destroy(&digests->mutex);
    free(digests);
}

/* Under the mutex. */
static struct pair *find(struct target_digests *digests, const char *target)
{
    for (size_t i = 0; i < PAIRS && *target; i++)
        if (strcmp(digests->pairs[i].target, target) == 0)
            return &digests->pairs[i];
    return NULL;
}

void target_digests_note(struct target_digests *digests, const char *target, const char *drawn)
{
    if (!*target || !*drawn)
        return;
    pthread_mutex_lock(&digests->mutex);
    struct pair *pair = find(digests, target);
    if (!pair) {
        pair = &digests->pairs[digests->next];
        digests->next = (digests->next + 1) % PAIRS;
    }
    memcpy(pair->target, target, strnlen(target, sizeof pair->target - 1) + 1);
    memcpy(pair->drawn, drawn, strnlen(drawn, sizeof pair->drawn - 1) + 1);
    pthread_mutex_unlock(&digests->mutex);
}

bool target_digests_find(struct target_digests *digests, const char *target,
                         char drawn[DIGEST_TEXT_BYTES])
{
    pthread_mutex_lock(&digests->mutex);
    const struct pair *pair = find(digests, target);
    if (pair)
        memcpy(drawn, pair->drawn, DIGEST_TEXT_BYTES);
    pthread_mutex_unlock(&digests->mutex);
    return pair;
}
