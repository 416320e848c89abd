/* SPDX-License-Identifier: MIT */
/* A ring of reports as JSON texts. */
#include "server/front/frames.h"

#include <errno.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

struct kept_frame {
    char id[FRAME_ID_BYTES];
    char *json;
};

struct frames {
    pthread_mutex_t mutex;
    size_t capacity, next, count;
    struct kept_frame *ring;
};

struct frames *frames_create(size_t capacity, struct error *err)
{
    struct frames *frames = calloc(1, sizeof *frames);
    if (frames) {
        pthread_mutex_init(&frames->mutex, NULL);
        frames->capacity = capacity;
        frames->ring = calloc(capacity, sizeof *frames->ring);
    }
    if (frames && frames->ring)
        return frames;
    error_set(err, ERROR_NO_MEMORY, "%zu frame reports", capacity);
    frames_destroy(frames);
    return NULL;
}

void frames_destroy(struct frames *frames)
{
    if (!frames)
        return;
    for (size_t i = 0; frames->ring && i < frames->capacity; i++)
        free(frames->ring[i].json);
    free(frames->ring);
    pthread_mutex_destroy(&frames->mutex);
    free(frames);
}

bool frames_make_id(char id[FRAME_ID_BYTES], struct error *err)
{
    uint64_t bits;
    if (getrandom(&bits, sizeof bits, 0) != sizeof bits)
        return error_set(err, ERROR_INTERNAL, "getrandom: %s", strerror(errno));
    snprintf(id, FRAME_ID_BYTES, "%016llx", (unsigned long long)bits);
    return true;
}

void frames_add(struct frames *frames, const char *id, char *json)
{
    if (!json)
        return;
    pthread_mutex_lock(&frames->mutex);
    struct kept_frame *slot = &frames->ring[frames->next];
    char *forgotten = slot->json;
    snprintf(slot->id, sizeof slot->id, "%s", id);
    slot->json = json;
    frames->next = (frames->next + 1) % frames->capacity;
    frames->count += !forgotten;
    pthread_mutex_unlock(&frames->mutex);
    free(forgotten);
}

char *frames_get(struct frames *frames, const char *id, struct error *err)
{
    char *json = NULL;
    bool is_found = false;
    pthread_mutex_lock(&frames->mutex);
    for (size_t i = 0; i < frames->count && !is_found; i++)
        if (strcmp(frames->ring[i].id, id) == 0) {
            is_found = true;
            json = strdup(frames->ring[i].json);
        }
    pthread_mutex_unlock(&frames->mutex);
    if (!is_found)
        error_set(err, ERROR_NOT_FOUND, "there is no frame '%.64s'; the newest %zu are kept", id,
                  frames->capacity);
    else if (!json)
        error_set(err, ERROR_NO_MEMORY, "frame report");
    return json;
}

size_t frames_count(struct frames *frames)
{
    pthread_mutex_lock(&frames->mutex);
    size_t count = frames->count;
    pthread_mutex_unlock(&frames->mutex);
    return count;
}
