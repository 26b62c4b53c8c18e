/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * arena.h - all memory of a run in two blocks: one that a checkpoint copies, one for scratch.
 * Layout code runs twice: first with bytes == NULL to count, then to hand out addresses.
 */
#ifndef ARENA_H
#define ARENA_H

#include <stddef.h>
#include <stdint.h>

struct arena {
    unsigned char *bytes; /* NULL while counting */
    size_t used;
};

enum { ARENA_ALIGNMENT = 64 };

/* What `size` bytes take. */
static inline size_t arena_rounded(size_t size)
{
    return (size + ARENA_ALIGNMENT - 1) / ARENA_ALIGNMENT * ARENA_ALIGNMENT;
}

/* `size` bytes, aligned; NULL while counting. */
static inline void *arena_take(struct arena *arena, size_t size)
{
    void *at = arena->bytes ? arena->bytes + arena->used : NULL;
    arena->used += arena_rounded(size);
    return at;
}

/* A number for each of n rods leaves room for so many: work that takes them one by one goes on to
 * whole vectors instead of stopping within one. What stands past the last rod means nothing. */
static inline int64_t arena_whole(int64_t n)
{
    return (n + 3) / 4 * 4;
}

#endif
