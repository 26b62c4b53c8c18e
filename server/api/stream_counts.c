/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "stream_counts.h"

#include <stdio.h>
#include <string.h>

static size_t find(const struct stream_counts *counts, const char *owner)
{
    size_t i = 0;
    while (i < counts->used && strcmp(counts->of[i].owner, owner) != 0)
        i++;
    return i;
}

bool stream_counts_take(struct stream_counts *counts, const char *owner)
{
    pthread_mutex_lock(&counts->mutex);
    size_t i = find(counts, owner);
    bool taken = i < LIMIT_STREAMS_MAX;
    if (taken && i == counts->used) {
        snprintf(counts->of[i].owner, sizeof(counts->of[i].owner), "%s", owner);
        counts->of[i].open = 0;
        counts->used++;
    }
    taken = taken && counts->of[i].open < LIMIT_OWNER_STREAMS_MAX;
    counts->of[i < LIMIT_STREAMS_MAX ? i : 0].open += taken;
    pthread_mutex_unlock(&counts->mutex);
    return taken;
}

void stream_counts_give(struct stream_counts *counts, const char *owner)
{
    pthread_mutex_lock(&counts->mutex);
    size_t i = find(counts, owner);
    if (i < counts->used && --counts->of[i].open == 0)
        counts->of[i] = counts->of[--counts->used];
    pthread_mutex_unlock(&counts->mutex);
}
