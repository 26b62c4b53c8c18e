/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "short_memory.h"

#include "heap_json.h"

#include <malloc.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The process's own, for allocations come from everywhere. */
static atomic_long left;    /* until the one that fails; 0 = none does */
static atomic_bool goes_on; /* and all after it */
static atomic_bool failed;
static atomic_long blocks;

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *block, size_t size);
void __real_free(void *block);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *block, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void __wrap_free(void *block);
char *__wrap_strdup(const char *text);
char *__wrap_strndup(const char *text, size_t size);
int __wrap_asprintf(char **to, const char *format, ...);

static bool fails(void)
{
    long before = atomic_load(&left);
    while (before > 0 && !atomic_compare_exchange_weak(&left, &before, before - 1))
        continue;
    bool now = before == 1 || (before == 0 && atomic_load(&goes_on) && atomic_load(&failed));
    if (now)
        atomic_store(&failed, true);
    return now;
}

static void *counted(void *block)
{
    if (block)
        atomic_fetch_add(&blocks, 1);
    return block;
}

void *__wrap_malloc(size_t size)
{
    return fails() ? NULL : counted(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return fails() ? NULL : counted(__real_calloc(count, size));
}

void *__wrap_realloc(void *block, size_t size)
{
    if (fails())
        return NULL;
    return block ? __real_realloc(block, size) : counted(__real_malloc(size));
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
    return fails() ? NULL : counted(__real_aligned_alloc(alignment, size));
}

void __wrap_free(void *block)
{
    if (block)
        atomic_fetch_sub(&blocks, 1);
    __real_free(block);
}

char *__wrap_strndup(const char *text, size_t size)
{
    size_t length = strnlen(text, size);
    char *copy = __wrap_malloc(length + 1);
    if (copy) {
        memcpy(copy, text, length);
        copy[length] = '\0';
    }
    return copy;
}

char *__wrap_strdup(const char *text)
{
    return __wrap_strndup(text, strlen(text));
}

int __wrap_asprintf(char **to, const char *format, ...)
{
    if (fails())
        return -1;
    va_list args;
    va_start(args, format);
    int length = vasprintf(to, format, args);
    va_end(args);
    counted(length >= 0 ? *to : NULL);
    return length;
}

/* ------------------------------------------------------------------- for SQLite */
/* What it keeps in its caches is its own matter: its blocks are not counted. */

static void *sql_malloc(int size)
{
    return fails() ? NULL : __real_malloc((size_t)size);
}

static void *sql_realloc(void *block, int size)
{
    return fails() ? NULL : __real_realloc(block, (size_t)size);
}

static int sql_size(void *block)
{
    return (int)malloc_usable_size(block);
}

static int sql_round(int size)
{
    return (size + 7) & ~7;
}

static int sql_init(void *context)
{
    (void)context;
    return SQLITE_OK;
}

static void sql_end(void *context)
{
    (void)context;
}

void short_memory_init(void)
{
    static const sqlite3_mem_methods methods = {.xMalloc = sql_malloc,
                                                .xFree = __real_free,
                                                .xRealloc = sql_realloc,
                                                .xSize = sql_size,
                                                .xRoundup = sql_round,
                                                .xInit = sql_init,
                                                .xShutdown = sql_end};
    heap_json_init();
    if (sqlite3_config(SQLITE_CONFIG_MALLOC, &methods) != SQLITE_OK ||
        sqlite3_config(SQLITE_CONFIG_LOOKASIDE, 0, 0) != SQLITE_OK)
        abort();
}

void short_memory_begin(long n, bool on)
{
    atomic_store(&failed, false);
    atomic_store(&goes_on, on);
    atomic_store(&left, n);
}

bool short_memory_end(void)
{
    atomic_store(&left, 0);
    atomic_store(&goes_on, false);
    return atomic_exchange(&failed, false);
}

long short_memory_blocks(void)
{
    return atomic_load(&blocks);
}
