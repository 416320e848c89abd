/* SPDX-License-Identifier: MIT */
/* A few slots hold requests and results. Threads take the oldest request; a result that nobody
 * takes makes room for new requests. */
#include "renderer/textures/texture_packer.h"

#include <pthread.h>
#include <stdlib.h>

#include "renderer/base/processors.h"
#include "renderer/scene/texture_levels.h"
#include "renderer/textures/texture_blocks.h"

enum { THREADS_MAX = 4 };

enum slot_state { FREE, WAITING, BUSY, DONE };

struct slot {
    enum slot_state state;
    struct texture_packing what;
    struct texture_packed packed;
    uint64_t asked; /* when it was asked for last */
    bool is_forgotten;
};

struct texture_packer {
    pthread_t threads[THREADS_MAX];
    int thread_count;
    pthread_mutex_t mutex;
    pthread_cond_t has_work, has_result;
    struct slot slots[TEXTURE_PACKER_AHEAD];
    uint64_t clock;
    bool is_stopping;
};

static uint64_t bytes_from(const struct texture_packing *what, uint32_t level)
{
    return texture_blocks_bytes(what->width_px, what->height_px, level, what->has_alpha);
}

static struct texture_packed pack(const struct texture_packing *what)
{
    struct texture_packed packed = {0};
    uint64_t bytes = bytes_from(what, what->top) - bytes_from(what, what->end);
    double squares = 0, channels = what->has_alpha ? 4 : 3;
    packed.blocks = malloc(bytes);
    for (uint32_t level = what->top; packed.blocks && level < what->end; level++) {
        uint32_t width = texture_level_side(what->width_px, level);
        uint32_t height = texture_level_side(what->height_px, level);
        uint64_t from = texture_levels_bytes(what->width_px, what->height_px, 1) -
                        texture_levels_bytes(what->width_px, what->height_px, level);
        uint64_t to = bytes_from(what, what->top) - bytes_from(what, level);
        double ignored = 0;
        texture_blocks_encode(level ? what->levels + from : what->image, width, height,
                              what->has_alpha, packed.blocks + to,
                              level == what->top ? &squares : &ignored);
        if (level == what->top)
            packed.mean_square = squares / (channels * width * height * 255 * 255);
    }
    return packed;
}

/* The oldest slot in this state, or NULL. The caller holds the mutex. */
static struct slot *oldest(struct texture_packer *packer, enum slot_state state)
{
    struct slot *found = NULL;
    for (int i = 0; i < TEXTURE_PACKER_AHEAD; i++)
        if (packer->slots[i].state == state && (!found || packer->slots[i].asked < found->asked))
            found = &packer->slots[i];
    return found;
}

static void clear(struct slot *slot)
{
    free(slot->packed.blocks);
    *slot = (struct slot){.state = FREE};
}

static void *packer_run(void *argument)
{
    struct texture_packer *packer = argument;
    pthread_mutex_lock(&packer->mutex);
    while (!packer->is_stopping) {
        struct slot *slot = oldest(packer, WAITING);
        if (!slot) {
            pthread_cond_wait(&packer->has_work, &packer->mutex);
            continue;
        }
        const struct texture_packing what = slot->what;
        slot->state = BUSY;
        pthread_mutex_unlock(&packer->mutex);
        struct texture_packed packed = pack(&what);
        pthread_mutex_lock(&packer->mutex);
        slot->packed = packed;
        slot->state = DONE;
        if (slot->is_forgotten)
            clear(slot);
        pthread_cond_broadcast(&packer->has_result);
    }
    pthread_mutex_unlock(&packer->mutex);
    return NULL;
}

struct texture_packer *texture_packer_create(struct error *err)
{
    struct texture_packer *packer = calloc(1, sizeof *packer);
    if (!packer) {
        error_set(err, ERROR_NO_MEMORY, "packer of textures");
        return NULL;
    }
    int processors = processors_usable();
    pthread_mutex_init(&packer->mutex, NULL);
    pthread_cond_init(&packer->has_work, NULL);
    pthread_cond_init(&packer->has_result, NULL);
    while (packer->thread_count < THREADS_MAX && packer->thread_count < processors &&
           pthread_create(&packer->threads[packer->thread_count], NULL, packer_run, packer) == 0)
        packer->thread_count++;
    if (packer->thread_count)
        return packer;
    error_set(err, ERROR_INTERNAL, "no thread that compresses textures can be started");
    texture_packer_destroy(packer);
    return NULL;
}

void texture_packer_destroy(struct texture_packer *packer)
{
    if (!packer)
        return;
    pthread_mutex_lock(&packer->mutex);
    packer->is_stopping = true;
    pthread_cond_broadcast(&packer->has_work);
    pthread_mutex_unlock(&packer->mutex);
    for (int i = 0; i < packer->thread_count; i++)
        pthread_join(packer->threads[i], NULL);
    for (int i = 0; i < TEXTURE_PACKER_AHEAD; i++)
        clear(&packer->slots[i]);
    pthread_cond_destroy(&packer->has_work);
    pthread_cond_destroy(&packer->has_result);
    pthread_mutex_destroy(&packer->mutex);
    free(packer);
}

static struct slot *find(struct texture_packer *packer, const struct texture_packing *what)
{
    for (int i = 0; i < TEXTURE_PACKER_AHEAD; i++) {
        struct slot *slot = &packer->slots[i];
        if (slot->state != FREE && !slot->is_forgotten && slot->what.image == what->image &&
            slot->what.levels == what->levels && slot->what.top == what->top &&
            slot->what.end == what->end)
            return slot;
    }
    return NULL;
}

/* Finds a slot for a new request: a free one, else the oldest result, else, with `waits`, the
 * oldest request. NULL: all slots are being compressed. The caller holds the mutex. */
static struct slot *make_room(struct texture_packer *packer, bool waits)
{
    struct slot *slot = oldest(packer, FREE);
    if (!slot)
        slot = oldest(packer, DONE);
    if (!slot && waits)
        slot = oldest(packer, WAITING);
    if (slot)
        clear(slot);
    return slot;
}

/* The slot of a request, which is a new one if the request is new. NULL: there is no room. The
 * caller holds the mutex. */
static struct slot *list(struct texture_packer *packer, const struct texture_packing *what,
                         bool waits)
{
    struct slot *slot = find(packer, what);
    if (!slot && (slot = make_room(packer, waits)) != NULL) {
        *slot = (struct slot){.state = WAITING, .what = *what};
        pthread_cond_signal(&packer->has_work);
    }
    if (slot)
        slot->asked = ++packer->clock;
    return slot;
}

bool texture_packer_ask(struct texture_packer *packer, const struct texture_packing *what)
{
    pthread_mutex_lock(&packer->mutex);
    const struct slot *slot = list(packer, what, false);
    bool is_done = slot && slot->state == DONE;
    pthread_mutex_unlock(&packer->mutex);
    return is_done;
}

struct texture_packed texture_packer_take(struct texture_packer *packer,
                                          const struct texture_packing *what)
{
    struct slot *slot;
    pthread_mutex_lock(&packer->mutex);
    while (!(slot = list(packer, what, true)) || slot->state != DONE)
        pthread_cond_wait(&packer->has_result, &packer->mutex);
    struct texture_packed packed = slot->packed;
    *slot = (struct slot){.state = FREE};
    pthread_mutex_unlock(&packer->mutex);
    return packed;
}

void texture_packer_drain(struct texture_packer *packer)
{
    if (!packer)
        return;
    pthread_mutex_lock(&packer->mutex);
    for (int i = 0; i < TEXTURE_PACKER_AHEAD; i++)
        if (packer->slots[i].state == BUSY)
            packer->slots[i].is_forgotten = true;
        else
            clear(&packer->slots[i]);
    while (oldest(packer, BUSY))
        pthread_cond_wait(&packer->has_result, &packer->mutex);
    pthread_mutex_unlock(&packer->mutex);
}
