/* SPDX-License-Identifier: GPL-3.0-or-later
 * contact_queue.c - see contact_queue.h. */
#include "contact_queue.h"

#include <math.h>
#include <stdbool.h>

void contact_queue_clear(struct contact_queue *queue, int64_t pairs)
{
    queue->count = 0;
    for (int64_t i = 0; i < pairs; i++)
        queue->place[i] = -1;
}

static bool sooner(const struct contact_queue *queue, int64_t a, int64_t b)
{
    return queue->time[a] < queue->time[b] || (queue->time[a] == queue->time[b] && a < b);
}

static void put(struct contact_queue *queue, int64_t at, int64_t pair)
{
    queue->heap[at] = pair;
    queue->place[pair] = at;
}

/* A place is free at `at`: finds the one from there towards the root where the pair belongs. */
static int64_t rise(struct contact_queue *queue, int64_t at, int64_t pair)
{
    while (at > 0) {
        int64_t above = (at - 1) / 2;
        if (!sooner(queue, pair, queue->heap[above]))
            break;
        put(queue, at, queue->heap[above]);
        at = above;
    }
    return at;
}

/* The same towards the leaves. */
static int64_t sink(struct contact_queue *queue, int64_t at, int64_t pair)
{
    for (;;) {
        int64_t below = 2 * at + 1;
        if (below >= queue->count)
            return at;
        if (below + 1 < queue->count && sooner(queue, queue->heap[below + 1], queue->heap[below]))
            below++;
        if (!sooner(queue, queue->heap[below], pair))
            return at;
        put(queue, at, queue->heap[below]);
        at = below;
    }
}

static void settle(struct contact_queue *queue, int64_t at, int64_t pair)
{
    put(queue, sink(queue, rise(queue, at, pair), pair), pair);
}

void contact_queue_set(struct contact_queue *queue, int64_t pair, double time)
{
    int64_t at = queue->place[pair];
    if (time == INFINITY) {
        if (at < 0)
            return;
        queue->place[pair] = -1;
        int64_t last = queue->heap[--queue->count];
        if (last != pair)
            settle(queue, at, last);
        return;
    }
    queue->time[pair] = time;
    settle(queue, at < 0 ? queue->count++ : at, pair);
}
