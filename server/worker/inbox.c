/* SPDX-License-Identifier: MIT */
/* A list of messages, and the thread that adds to it. Its length is bounded by the front, which
 * sends no more than the worker's depth. */
#include "server/worker/inbox.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

enum { CANCELLED_MAX = 32 }; /* more than may be on their way */

struct inbox_entry {
    struct inbox_entry *next;
    struct ipc_message message;
    bool is_urgent;
};

struct inbox {
    int socket;
    pthread_t thread;
    bool has_thread;
    pthread_mutex_t mutex; /* guards what is not atomic below */
    pthread_cond_t arrived;
    struct inbox_entry *first;
    bool is_closed;
    uint64_t current, cancelled[CANCELLED_MAX];
    unsigned cancelled_count; /* ever: a ring */
    atomic_bool is_cancelled;
    atomic_int urgent_count;
    atomic_uint urgent_arrivals;
};

static bool says(const json_t *message, const char *op)
{
    const char *said = json_string_value(json_object_get(message, "op"));
    return said && strcmp(said, op) == 0;
}

static void entry_destroy(struct inbox_entry *entry)
{
    ipc_message_finish(&entry->message);
    free(entry);
}

/* Under the mutex, as those below. */
static void cancel(struct inbox *inbox, uint64_t id)
{
    inbox->cancelled[inbox->cancelled_count++ % CANCELLED_MAX] = id;
    if (id == inbox->current)
        atomic_store(&inbox->is_cancelled, true);
}

static void add(struct inbox *inbox, struct inbox_entry *entry)
{
    struct inbox_entry **at = &inbox->first;
    while (*at)
        at = &(*at)->next;
    *at = entry;
    if (entry->is_urgent) {
        atomic_fetch_add(&inbox->urgent_count, 1);
        atomic_fetch_add(&inbox->urgent_arrivals, 1);
    }
}

/* Moves the message out of its entry. */
static void take(struct inbox *inbox, struct inbox_entry **at, struct ipc_message *message)
{
    struct inbox_entry *entry = *at;
    *at = entry->next;
    *message = entry->message;
    atomic_fetch_sub(&inbox->urgent_count, entry->is_urgent);
    free(entry);
}

/* False at the end, or without memory. */
static bool receive(struct inbox *inbox)
{
    struct inbox_entry *entry = calloc(1, sizeof *entry);
    if (!entry)
        return false;
    if (ipc_receive(inbox->socket, &entry->message, NULL) != IPC_MESSAGE) {
        free(entry);
        return false;
    }
    const json_t *json = entry->message.json;
    entry->is_urgent = json_is_true(json_object_get(json, "urgent"));
    pthread_mutex_lock(&inbox->mutex);
    if (says(json, "cancel")) {
        cancel(inbox, (uint64_t)json_integer_value(json_object_get(json, "id")));
        entry_destroy(entry);
    } else {
        add(inbox, entry);
        pthread_cond_signal(&inbox->arrived);
    }
    pthread_mutex_unlock(&inbox->mutex);
    return true;
}

static void *inbox_run(void *argument)
{
    struct inbox *inbox = argument;
    while (receive(inbox))
        continue;
    pthread_mutex_lock(&inbox->mutex);
    inbox->is_closed = true;
    pthread_cond_signal(&inbox->arrived);
    pthread_mutex_unlock(&inbox->mutex);
    return NULL;
}

struct inbox *inbox_create(int socket, struct error *err)
{
    struct inbox *inbox = calloc(1, sizeof *inbox);
    if (!inbox) {
        error_set(err, ERROR_NO_MEMORY, "inbox");
        return NULL;
    }
    pthread_condattr_t clock;
    inbox->socket = socket;
    pthread_mutex_init(&inbox->mutex, NULL);
    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_cond_init(&inbox->arrived, &clock);
    pthread_condattr_destroy(&clock);
    inbox->has_thread = pthread_create(&inbox->thread, NULL, inbox_run, inbox) == 0;
    if (inbox->has_thread)
        return inbox;
    error_set(err, ERROR_INTERNAL, "inbox: no thread can be started");
    inbox_destroy(inbox);
    return NULL;
}

void inbox_destroy(struct inbox *inbox)
{
    if (!inbox)
        return;
    if (inbox->has_thread) {
        shutdown(inbox->socket, SHUT_RDWR);
        pthread_join(inbox->thread, NULL);
    }
    for (struct inbox_entry *entry; (entry = inbox->first);) {
        inbox->first = entry->next;
        entry_destroy(entry);
    }
    pthread_cond_destroy(&inbox->arrived);
    pthread_mutex_destroy(&inbox->mutex);
    free(inbox);
}

bool inbox_take(struct inbox *inbox, struct ipc_message *message)
{
    pthread_mutex_lock(&inbox->mutex);
    while (!inbox->first && !inbox->is_closed)
        pthread_cond_wait(&inbox->arrived, &inbox->mutex);
    /* at the end of the stream nobody waits for what is left */
    bool has_one = inbox->first && !inbox->is_closed;
    if (has_one)
        take(inbox, &inbox->first, message);
    pthread_mutex_unlock(&inbox->mutex);
    return has_one;
}

bool inbox_wait(struct inbox *inbox, int timeout_ms)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += timeout_ms / 1000;
    until.tv_nsec += timeout_ms % 1000 * 1000000;
    if (until.tv_nsec >= 1000000000) {
        until.tv_sec++;
        until.tv_nsec -= 1000000000;
    }
    pthread_mutex_lock(&inbox->mutex);
    while (!inbox->first && !inbox->is_closed &&
           pthread_cond_timedwait(&inbox->arrived, &inbox->mutex, &until) != ETIMEDOUT)
        continue;
    bool has_any = inbox->first || inbox->is_closed;
    pthread_mutex_unlock(&inbox->mutex);
    return has_any;
}

bool inbox_take_urgent(struct inbox *inbox, bool (*may_take)(void *context, const json_t *message),
                       void *context, struct ipc_message *message)
{
    pthread_mutex_lock(&inbox->mutex);
    struct inbox_entry **at = &inbox->first;
    while (*at && !((*at)->is_urgent && may_take(context, (*at)->message.json)))
        at = &(*at)->next;
    bool has_one = *at;
    if (has_one)
        take(inbox, at, message);
    pthread_mutex_unlock(&inbox->mutex);
    return has_one;
}

int inbox_urgent_count(const struct inbox *inbox)
{
    return atomic_load(&inbox->urgent_count);
}

unsigned inbox_urgent_arrivals(const struct inbox *inbox)
{
    return atomic_load(&inbox->urgent_arrivals);
}

bool inbox_has_messages(struct inbox *inbox)
{
    pthread_mutex_lock(&inbox->mutex);
    bool has_any = inbox->first != NULL;
    pthread_mutex_unlock(&inbox->mutex);
    return has_any;
}

void inbox_set_current(struct inbox *inbox, uint64_t id)
{
    bool is_cancelled = false;
    pthread_mutex_lock(&inbox->mutex);
    inbox->current = id;
    for (unsigned i = 0; i < CANCELLED_MAX; i++)
        is_cancelled |= id && inbox->cancelled[i] == id;
    atomic_store(&inbox->is_cancelled, is_cancelled);
    pthread_mutex_unlock(&inbox->mutex);
}

bool inbox_is_cancelled(const struct inbox *inbox)
{
    return atomic_load(&inbox->is_cancelled);
}
