/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_settle.c - see store_settle.h. */
#include "store_settle.h"

#include "store_internal.h"
#include "store_segment.h"

#include <time.h>

bool store_busy(struct store *store)
{
    return atomic_load(&store->large) > 0;
}

void store_large_begin(struct store *store)
{
    atomic_fetch_add(&store->large, 1);
}

void store_large_end(struct store *store)
{
    atomic_store(&store->unsettled, true);
    atomic_fetch_sub(&store->large, 1);
}

void store_slices_begin(struct store *store)
{
    atomic_fetch_add(&store->slices, 1);
}

void store_slices_end(struct store *store)
{
    atomic_store(&store->unsettled, true);
    atomic_fetch_sub(&store->slices, 1);
}

/* What a large one has left in the log is for store_settle, unless that never comes. */
static int pages_kept(struct store *store)
{
    enum { USUAL_PAGES = 1000, UNSETTLED_PAGES = 100000 }; /* SQLite's own; 400 MB */

    if (store_busy(store) || atomic_load(&store->slices) > 0)
        return 0;
    return atomic_load(&store->unsettled) ? UNSETTLED_PAGES : USUAL_PAGES;
}

enum store_status store_commit(struct store *store)
{
    sqlite3_wal_autocheckpoint(store->writer, pages_kept(store));
    return store_exec(store->writer, "COMMIT");
}

/* One segment a transaction: some ms. */
static bool seal_next(struct store *store)
{
    bool sealed = false;
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(store, &db);

    if (status)
        return false;
    status = store_segment_seal_next(db, &sealed);
    return store_end(store, status) == STORE_OK && sealed;
}

/* Through a connection of its own, so that others write meanwhile: it takes as long as the disk
 * does. If it cannot be, a later commit does it. */
static void checkpoint(struct store *store)
{
    sqlite3 *db = NULL;

    if (sqlite3_open_v2(store->path, &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, NULL) ==
        SQLITE_OK)
        sqlite3_wal_checkpoint_v2(db, NULL, SQLITE_CHECKPOINT_PASSIVE, NULL, NULL);
    sqlite3_close(db);
}

/* A mutex knows no turns: who lets go of it and takes it again at once leaves it to nobody. */
void store_let_others(void)
{
    nanosleep(&(const struct timespec){.tv_nsec = 1000000}, NULL);
}

/* Until its end no commit begins a checkpoint. */
bool store_settle(struct store *store)
{
    if (!atomic_exchange(&store->unsettled, false))
        return false;
    store_slices_begin(store);
    do
        store_let_others();
    while (seal_next(store));
    checkpoint(store);
    atomic_fetch_sub(&store->slices, 1);
    return true;
}
