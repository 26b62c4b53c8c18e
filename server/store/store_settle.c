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

enum store_status store_commit(struct store *store)
{
    enum { USUAL_PAGES = 1000 }; /* SQLite's own */
    bool large = store_busy(store) || atomic_load(&store->slices) > 0;
    enum store_status status;

    if (large)
        sqlite3_wal_autocheckpoint(store->writer, 0);
    status = store_exec(store->writer, "COMMIT");
    if (large)
        sqlite3_wal_autocheckpoint(store->writer, USUAL_PAGES);
    return status;
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

static void checkpoint(struct store *store)
{
    atomic_fetch_add(&store->large, 1);
    pthread_mutex_lock(&store->write_mutex);
    if (store->group)
        store_group_commit(store);
    sqlite3_wal_checkpoint_v2(store->writer, NULL, SQLITE_CHECKPOINT_PASSIVE, NULL, NULL);
    pthread_mutex_unlock(&store->write_mutex);
    atomic_fetch_sub(&store->large, 1);
}

/* A mutex knows no turns: who lets go of it and takes it again at once leaves it to nobody. */
void store_let_others(void)
{
    nanosleep(&(const struct timespec){.tv_nsec = 1000000}, NULL);
}

bool store_settle(struct store *store)
{
    if (!atomic_exchange(&store->unsettled, false))
        return false;
    do
        store_let_others();
    while (seal_next(store));
    checkpoint(store);
    return true;
}
