/* SPDX-License-Identifier: MIT */
/* What the worker has. */
#include "server/front/flights.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_urgent(const struct render_task *task)
{
    return task->priority == RENDER_INTERACTIVE;
}

bool flights_have_room(const struct flights *flights, enum render_priority priority)
{
    int others = 0;
    for (int i = 0; i < flights->count; i++)
        others += is_urgent(flights->list[i].task) == (priority == RENDER_INTERACTIVE);
    return others < flights->depth;
}

void flights_add(struct flights *flights, struct render_task *task, int64_t now_ms)
{
    assert(flights->count < 2 * FLIGHTS_DEPTH_MAX);
    flights->list[flights->count++] =
        (struct flight){.task = task, .state = FLIGHT_SENT, .since_ms = now_ms};
}

void flights_remove(struct flights *flights, int index)
{
    flights->count--;
    memmove(&flights->list[index], &flights->list[index + 1],
            (size_t)(flights->count - index) * sizeof flights->list[0]);
}

static int find_state(const struct flights *flights, enum flight_state state)
{
    for (int i = 0; i < flights->count; i++)
        if (flights->list[i].state == state)
            return i;
    return -1;
}

bool flights_is_any(const struct flights *flights, enum flight_state state)
{
    return find_state(flights, state) >= 0;
}

int flights_find(const struct flights *flights, uint64_t ticket)
{
    for (int i = 0; i < flights->count; i++)
        if (flights->list[i].task->ticket == ticket)
            return i;
    return -1;
}

int flights_find_request(const struct flights *flights, const char *request_id)
{
    int newest = -1;
    for (int i = 0; i < flights->count; i++) {
        const struct render_task *task = flights->list[i].task;
        if (task->request_id && strcmp(task->request_id, request_id) == 0 &&
            (newest < 0 || task->ticket > flights->list[newest].task->ticket))
            newest = i;
    }
    return newest;
}

void flight_progress_note(struct flight_progress *progress, const char *stage, double share,
                          int64_t now_ms)
{
    enum { PACE_MS = 500 }; /* of a stage, before its end is foretold */
    if (strcmp(progress->stage, stage) != 0 || share < progress->share) {
        *progress = (struct flight_progress){.first_share = share, .since_ms = now_ms};
        snprintf(progress->stage, sizeof progress->stage, "%s", stage);
    }
    double took_ms = (double)(now_ms - progress->since_ms), made = share - progress->first_share;
    progress->share = share;
    progress->left_s = took_ms >= PACE_MS && made > 0 ? 1e-3 * took_ms * (1 - share) / made : -1;
}

json_t *flight_progress_to_json(const struct flight_progress *progress)
{
    json_t *left =
        progress->left_s >= 0 ? json_real(round(10 * progress->left_s) / 10) : json_null();
    return json_pack("{s:s,s:f,s:o}", "stage", progress->stage, "share",
                     round(1000 * progress->share) / 1000, "left_s", left);
}

bool flights_note(struct flight *flight, const char *op, int64_t now_ms)
{
    int64_t since_ms = now_ms;
    if (strcmp(op, "begin") == 0) {
        flight->state = FLIGHT_BEGUN;
    } else if (strcmp(op, "paused") == 0) {
        flight->state = FLIGHT_PAUSED;
        flight->ran_ms = now_ms - flight->since_ms;
    } else if (strcmp(op, "resumed") == 0) {
        flight->state = FLIGHT_BEGUN;
        since_ms = now_ms - flight->ran_ms;
    } else if (strcmp(op, "submitted") == 0) {
        flight->state = FLIGHT_ON_DEVICE;
        since_ms = flight->since_ms;
    } else if (strcmp(op, "rendered") == 0) {
        flight->state = FLIGHT_ENCODING;
    } else {
        return false;
    }
    flight->since_ms = since_ms;
    return true;
}

static bool is_begun(const struct flight *flight)
{
    return flight->state == FLIGHT_BEGUN || flight->state == FLIGHT_ON_DEVICE;
}

void flights_note_free_device(struct flights *flights, int64_t now_ms)
{
    for (int i = 0; i < flights->count; i++)
        if (is_begun(&flights->list[i]))
            flights->list[i].since_ms = now_ms;
}

void flights_note_lost(struct flights *flights, int index)
{
    for (int i = 0; i < flights->count; i++)
        if (is_begun(&flights->list[i]))
            flights->list[i].state = i == index ? FLIGHT_BEGUN : FLIGHT_SENT;
}

int flights_guilty(const struct flights *flights, bool is_late)
{
    int begun = find_state(flights, FLIGHT_BEGUN), paused = find_state(flights, FLIGHT_PAUSED);
    int on_device = find_state(flights, FLIGHT_ON_DEVICE);
    if (on_device >= 0 && (begun < 0 || (is_late && on_device < begun)))
        return on_device;
    return begun >= 0 ? begun : paused >= 0 ? paused : flights->count > 0 ? 0 : -1;
}

int64_t flight_limit_ms(const struct flight *flight, int64_t limit_ms)
{
    bool is_own = flight->task->limit_ms > 0 && is_begun(flight);
    return is_own ? flight->task->limit_ms : limit_ms;
}

int64_t flights_deadline(const struct flights *flights, int64_t limit_ms, int64_t last_event_ms)
{
    int64_t earliest = INT64_MAX;
    bool has_begun =
        flights_is_any(flights, FLIGHT_BEGUN) || flights_is_any(flights, FLIGHT_ON_DEVICE);
    bool has_paused = flights_is_any(flights, FLIGHT_PAUSED);
    for (int i = 0; i < flights->count; i++) {
        const struct flight *flight = &flights->list[i];
        int64_t since = flight->since_ms;
        bool waits = flight->state == FLIGHT_SENT || flight->state == FLIGHT_PAUSED;
        if (waits && (has_begun || (has_paused && flight->state == FLIGHT_SENT)))
            continue; /* for the one that is worked on */
        if (waits && since < last_event_ms)
            since = last_event_ms;
        int64_t end = since + flight_limit_ms(flight, limit_ms);
        if (end < earliest)
            earliest = end;
    }
    return earliest;
}
