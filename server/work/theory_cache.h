/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * theory_cache.h - exact equilibria that were computed before, for jobs of the same system that
 * differ in seed, realizations or time. Results are the same bits as without.
 *
 * THREADS  Any thread may call anything but create and free.
 */
#ifndef THEORY_CACHE_H
#define THEORY_CACHE_H

#include "bcd.h"

struct theory_cache;

/* NULL = no memory. */
struct theory_cache *theory_cache_create(void);
void theory_cache_free(struct theory_cache *cache);

/* As bcd_theory_create, under `watch` (not NULL). Where another thread is at the same equilibrium,
 * waits for it, as long as the watch's should_stop says nothing. */
enum bcd_status theory_cache_make(struct theory_cache *cache, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope, struct bcd_watch *watch,
                                  struct bcd_theory **theory);

/* How many were taken over, and how many computed. */
struct theory_counts {
    uint64_t shared, computed;
};
void theory_cache_count(struct theory_cache *cache, struct theory_counts *counts);

#endif
