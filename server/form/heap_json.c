/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "heap_json.h"

#include <jansson.h>

#include <stdatomic.h>
#include <stdlib.h>

/* The library knows one allocator in a process, without a context. */
static atomic_ulong failures;

static void *allocate(size_t size)
{
    void *block = malloc(size);
    if (!block)
        atomic_fetch_add(&failures, 1);
    return block;
}

void heap_json_init(void)
{
    json_set_alloc_funcs(allocate, free);
    json_object_seed(0);
}

unsigned long heap_json_failures(void)
{
    return atomic_load(&failures);
}
