/* SPDX-License-Identifier: MIT */
/* A ring of ranges of memory. A thread reads one byte of each of their pages. */
#include "renderer/textures/texture_reader.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>

enum { RANGES = 64, PAGE_BYTES = 4096 };

struct range {
    const volatile uint8_t *bytes; /* NULL: free */
    size_t size_bytes;
    bool is_read;
};

struct texture_reader {
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t has_work, is_done;
    struct range ranges[RANGES]; /* those being read or read, oldest at `first` */
    size_t first, count;
    bool is_running, is_stopping, is_reading;
};

static uint8_t touch(const struct range *range)
{
    uint8_t sum = 0;
    for (size_t at = 0; at < range->size_bytes; at += PAGE_BYTES)
        sum = (uint8_t)(sum + range->bytes[at]);
    return sum;
}

/* The oldest range that is not read yet. The caller holds the mutex. */
static struct range *next_unread(struct texture_reader *reader)
{
    for (size_t i = 0; i < reader->count; i++) {
        struct range *range = &reader->ranges[(reader->first + i) % RANGES];
        if (!range->is_read)
            return range;
    }
    return NULL;
}

static void *reader_run(void *argument)
{
    struct texture_reader *reader = argument;
    pthread_mutex_lock(&reader->mutex);
    while (!reader->is_stopping) {
        struct range *range = next_unread(reader);
        if (!range) {
            pthread_cond_wait(&reader->has_work, &reader->mutex);
            continue;
        }
        const struct range copy = *range;
        reader->is_reading = true;
        pthread_mutex_unlock(&reader->mutex);
        touch(&copy);
        pthread_mutex_lock(&reader->mutex);
        range->is_read = true; /* only read ranges leave the ring, or all of them */
        reader->is_reading = false;
        pthread_cond_signal(&reader->is_done);
    }
    pthread_mutex_unlock(&reader->mutex);
    return NULL;
}

struct texture_reader *texture_reader_create(struct error *err)
{
    struct texture_reader *reader = calloc(1, sizeof *reader);
    if (!reader) {
        error_set(err, ERROR_NO_MEMORY, "reader of textures");
        return NULL;
    }
    pthread_mutex_init(&reader->mutex, NULL);
    pthread_cond_init(&reader->has_work, NULL);
    pthread_cond_init(&reader->is_done, NULL);
    reader->is_running = pthread_create(&reader->thread, NULL, reader_run, reader) == 0;
    if (reader->is_running)
        return reader;
    error_set(err, ERROR_INTERNAL, "the thread that reads textures cannot be started");
    texture_reader_destroy(reader);
    return NULL;
}

void texture_reader_destroy(struct texture_reader *reader)
{
    if (!reader)
        return;
    pthread_mutex_lock(&reader->mutex);
    reader->is_stopping = true;
    pthread_cond_signal(&reader->has_work);
    pthread_mutex_unlock(&reader->mutex);
    if (reader->is_running)
        pthread_join(reader->thread, NULL);
    pthread_cond_destroy(&reader->has_work);
    pthread_cond_destroy(&reader->is_done);
    pthread_mutex_destroy(&reader->mutex);
    free(reader);
}

void texture_reader_drain(struct texture_reader *reader)
{
    if (!reader)
        return;
    pthread_mutex_lock(&reader->mutex);
    reader->count = 0;
    while (reader->is_reading)
        pthread_cond_wait(&reader->is_done, &reader->mutex);
    pthread_mutex_unlock(&reader->mutex);
}

/* Adds a range. A full ring drops its oldest range if that is read. The caller holds the mutex. */
static void enqueue(struct texture_reader *reader, const void *bytes, size_t size_bytes)
{
    if (reader->count == RANGES) {
        if (!reader->ranges[reader->first].is_read)
            return;
        reader->first = (reader->first + 1) % RANGES;
        reader->count--;
    }
    reader->ranges[(reader->first + reader->count++) % RANGES] =
        (struct range){.bytes = bytes, .size_bytes = size_bytes};
    pthread_cond_signal(&reader->has_work);
}

bool texture_reader_ask(struct texture_reader *reader, const void *bytes, size_t size_bytes)
{
    bool is_listed = false, is_read = false;
    pthread_mutex_lock(&reader->mutex);
    for (size_t i = 0; i < reader->count && !is_listed; i++) {
        const struct range *range = &reader->ranges[(reader->first + i) % RANGES];
        is_listed = range->bytes == bytes && range->size_bytes == size_bytes;
        is_read = is_listed && range->is_read;
    }
    if (!is_listed)
        enqueue(reader, bytes, size_bytes);
    pthread_mutex_unlock(&reader->mutex);
    return is_read;
}
