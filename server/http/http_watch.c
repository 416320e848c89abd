/* SPDX-License-Identifier: MIT */
/* One thread that polls waiting connections for a hang-up and shuts down those that overstay. */
#include "server/http/http_watch.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/base/clock.h"

enum {
    TICK_MS = 250,
    REST_MS = 1000, /* after a reply, until who has left is looked for: several ticks */
};

enum phase { PHASE_HEAD, PHASE_BODY, PHASE_WAIT, PHASE_REPLY, PHASE_SHUT };

struct http_watched {
    struct http_watched *previous, *next;
    int fd;
    uint64_t serial; /* never reused, so that a stale event is known as such */
    enum phase phase;
    int64_t since_ms;
    int allowance_ms;             /* of the phase */
    uint64_t bytes, bytes_before; /* of the phase; as of the last look */
    void (*on_gone)(void *context, uint64_t ticket);
    void *context;
    uint64_t ticket;
};

struct http_watch {
    struct http_watch_desc desc;
    pthread_mutex_t mutex;
    pthread_t thread;
    bool has_thread, is_stopping;
    int wake_fd;
    struct http_watched *first;
    size_t count;
    uint64_t next_serial;
};

static void wake(struct http_watch *watch)
{
    eventfd_write(watch->wake_fd, 1);
}

/* The entries for poll, and the connection of each. */
struct poll_set {
    struct pollfd *fds;
    uint64_t *serials;
    size_t count, capacity;
};

static bool poll_set_reserve(struct poll_set *set, size_t capacity)
{
    if (capacity <= set->capacity)
        return true;
    struct pollfd *fds = realloc(set->fds, capacity * 2 * sizeof *fds);
    if (fds)
        set->fds = fds;
    uint64_t *serials = realloc(set->serials, capacity * 2 * sizeof *serials);
    if (serials)
        set->serials = serials;
    if (!fds || !serials)
        return false;
    set->capacity = capacity * 2;
    return true;
}

static bool has_overstayed(const struct http_watch *watch, const struct http_watched *watched,
                           int64_t now)
{
    int64_t earned_ms = 0;
    if (watched->phase == PHASE_BODY || watched->phase == PHASE_REPLY)
        earned_ms = (int64_t)(watched->bytes * 1000 / (uint64_t)watch->desc.least_bytes_per_s);
    return now - watched->since_ms > watched->allowance_ms + earned_ms;
}

/* True when the client has left in the middle of its body, or for good after a reply. libmicrohttpd
 * 0.9.75 sleeps through that: its edge-triggered epoll reports data and hang-up once, and a short
 * read is taken for the end of what there is. A hang-up that comes by itself it sees, so one look
 * a while after a reply is enough. */
static bool has_left(struct http_watched *watched, int64_t now)
{
    int64_t age_ms = now - watched->since_ms;
    bool can_leave = watched->phase == PHASE_BODY ||
                     (watched->phase == PHASE_HEAD && age_ms >= REST_MS && age_ms < 2 * REST_MS);
    bool is_still = watched->bytes == watched->bytes_before;
    watched->bytes_before = watched->bytes;
    struct pollfd hangup = {.fd = watched->fd, .events = POLLRDHUP};
    int unread = 0;
    return can_leave && is_still && poll(&hangup, 1, 0) > 0 &&
           ioctl(watched->fd, FIONREAD, &unread) == 0 && unread == 0;
}

/* Under the mutex: shuts down who overstays, lists who waits. A shut socket makes libmicrohttpd end
 * the connection. */
static void look_around(struct http_watch *watch, struct poll_set *set)
{
    int64_t now = now_ms();
    set->count = 0;
    if (!poll_set_reserve(set, watch->count + 1))
        return;
    assert(set->fds && set->serials);
    set->fds[set->count++] = (struct pollfd){.fd = watch->wake_fd, .events = POLLIN};
    for (struct http_watched *watched = watch->first; watched; watched = watched->next) {
        if (watched->phase == PHASE_WAIT && watched->on_gone) {
            set->serials[set->count] = watched->serial;
            set->fds[set->count++] = (struct pollfd){.fd = watched->fd, .events = POLLRDHUP};
        } else if (watched->phase != PHASE_WAIT && watched->phase != PHASE_SHUT &&
                   (has_overstayed(watch, watched, now) || has_left(watched, now))) {
            watched->phase = PHASE_SHUT;
            shutdown(watched->fd, SHUT_RDWR);
        }
    }
}

static void notify_gone(struct http_watch *watch, uint64_t serial)
{
    void (*on_gone)(void *context, uint64_t ticket) = NULL;
    void *context = NULL;
    uint64_t ticket = 0;
    pthread_mutex_lock(&watch->mutex);
    for (struct http_watched *watched = watch->first; watched; watched = watched->next)
        if (watched->serial == serial && watched->phase == PHASE_WAIT) {
            on_gone = watched->on_gone;
            context = watched->context;
            ticket = watched->ticket;
            watched->on_gone = NULL; /* once */
        }
    pthread_mutex_unlock(&watch->mutex);
    if (on_gone)
        on_gone(context, ticket);
}

static void *watch_run(void *argument)
{
    struct http_watch *watch = argument;
    struct poll_set set = {0};
    for (;;) {
        pthread_mutex_lock(&watch->mutex);
        bool is_stopping = watch->is_stopping;
        look_around(watch, &set);
        pthread_mutex_unlock(&watch->mutex);
        if (is_stopping)
            break;
        if (set.count == 0) { /* no memory for the list: try again later */
            nanosleep(&(struct timespec){.tv_nsec = TICK_MS * 1000000}, NULL);
            continue;
        }
        if (poll(set.fds, set.count, TICK_MS) <= 0)
            continue;
        eventfd_t ignored;
        if (set.fds[0].revents)
            eventfd_read(watch->wake_fd, &ignored);
        for (size_t i = 1; i < set.count; i++)
            if (set.fds[i].revents & (POLLRDHUP | POLLHUP | POLLERR))
                notify_gone(watch, set.serials[i]);
    }
    free(set.fds);
    free(set.serials);
    return NULL;
}

static int or_default(int value, int otherwise)
{
    return value ? value : otherwise;
}

struct http_watch *http_watch_create(const struct http_watch_desc *desc, struct error *err)
{
    struct http_watch *watch = calloc(1, sizeof *watch);
    if (!watch) {
        error_set(err, ERROR_NO_MEMORY, "watch over connections");
        return NULL;
    }
    watch->desc = (struct http_watch_desc){
        .head_ms = or_default(desc->head_ms, 10000),
        .idle_ms = or_default(desc->idle_ms, 60000),
        .patience_ms = or_default(desc->patience_ms, 30000),
        .least_bytes_per_s = or_default(desc->least_bytes_per_s, 16384),
    };
    pthread_mutex_init(&watch->mutex, NULL);
    watch->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (watch->wake_fd >= 0)
        watch->has_thread = pthread_create(&watch->thread, NULL, watch_run, watch) == 0;
    if (!watch->has_thread) {
        error_set(err, ERROR_INTERNAL, "watch over connections: %s", strerror(errno));
        http_watch_destroy(watch);
        return NULL;
    }
    return watch;
}

void http_watch_destroy(struct http_watch *watch)
{
    if (!watch)
        return;
    if (watch->has_thread) {
        pthread_mutex_lock(&watch->mutex);
        watch->is_stopping = true;
        pthread_mutex_unlock(&watch->mutex);
        wake(watch);
        pthread_join(watch->thread, NULL);
    }
    if (watch->wake_fd >= 0)
        close(watch->wake_fd);
    pthread_mutex_destroy(&watch->mutex);
    free(watch);
}

struct http_watched *http_watch_add(struct http_watch *watch, int fd)
{
    struct http_watched *watched = calloc(1, sizeof *watched);
    if (!watched)
        return NULL;
    watched->fd = fd;
    watched->since_ms = now_ms();
    watched->allowance_ms = watch->desc.head_ms;
    pthread_mutex_lock(&watch->mutex);
    watched->serial = ++watch->next_serial;
    watched->next = watch->first;
    if (watched->next)
        watched->next->previous = watched;
    watch->first = watched;
    watch->count++;
    pthread_mutex_unlock(&watch->mutex);
    return watched;
}

void http_watch_remove(struct http_watch *watch, struct http_watched *watched)
{
    if (!watched)
        return;
    pthread_mutex_lock(&watch->mutex);
    if (watched->previous)
        watched->previous->next = watched->next;
    else
        watch->first = watched->next;
    if (watched->next)
        watched->next->previous = watched->previous;
    watch->count--;
    pthread_mutex_unlock(&watch->mutex);
    free(watched);
}

static void enter(struct http_watch *watch, struct http_watched *watched, enum phase phase,
                  int allowance_ms, uint64_t bytes)
{
    if (!watched)
        return;
    pthread_mutex_lock(&watch->mutex);
    if (watched->phase != PHASE_SHUT) {
        watched->phase = phase;
        watched->since_ms = now_ms();
        watched->allowance_ms = allowance_ms;
        watched->bytes = bytes;
        watched->bytes_before = UINT64_MAX;
        watched->on_gone = NULL;
    }
    pthread_mutex_unlock(&watch->mutex);
}

void http_watch_expect_head(struct http_watch *watch, struct http_watched *watched)
{
    enter(watch, watched, PHASE_HEAD, watch->desc.idle_ms, 0);
}

void http_watch_expect_body(struct http_watch *watch, struct http_watched *watched)
{
    enter(watch, watched, PHASE_BODY, watch->desc.patience_ms, 0);
}

void http_watch_count_body(struct http_watch *watch, struct http_watched *watched, uint64_t bytes)
{
    if (!watched)
        return;
    pthread_mutex_lock(&watch->mutex);
    watched->bytes += bytes;
    pthread_mutex_unlock(&watch->mutex);
}

void http_watch_expect_reply(struct http_watch *watch, struct http_watched *watched, uint64_t bytes)
{
    enter(watch, watched, PHASE_REPLY, watch->desc.patience_ms, bytes);
}

void http_watch_wait(struct http_watch *watch, struct http_watched *watched,
                     void (*on_gone)(void *context, uint64_t ticket), void *context,
                     uint64_t ticket)
{
    if (!watched)
        return;
    enter(watch, watched, PHASE_WAIT, 0, 0);
    pthread_mutex_lock(&watch->mutex);
    watched->on_gone = on_gone;
    watched->context = context;
    watched->ticket = ticket;
    pthread_mutex_unlock(&watch->mutex);
    wake(watch);
}
