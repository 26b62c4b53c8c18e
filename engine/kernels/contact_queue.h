/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * contact_queue.h - which pair meets next: a binary heap of the meeting times of numbered pairs,
 * each at most once in it. Ties are broken by the number, so that the order never depends on the
 * history of the heap.
 */
#ifndef KERNELS_CONTACT_QUEUE_H
#define KERNELS_CONTACT_QUEUE_H

#include <stdint.h>

struct contact_queue {
    double *time;   /* [pairs], meaningful for the pairs that are in */
    int64_t *heap;  /* [pairs], numbers of pairs; the first `count` are in */
    int64_t *place; /* [pairs], index in heap; -1 = not in */
    int64_t count;
};

/* Empty, for pairs 0 .. pairs-1. */
void contact_queue_clear(struct contact_queue *queue, int64_t pairs);

/* The pair meets at `time` from now on, whatever was known before; INFINITY = it does not. */
void contact_queue_set(struct contact_queue *queue, int64_t pair, double time);

/* The pair that meets first; -1 = none does. */
static inline int64_t contact_queue_first(const struct contact_queue *queue)
{
    return queue->count ? queue->heap[0] : -1;
}

#endif
