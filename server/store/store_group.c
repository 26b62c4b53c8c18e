/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_group.c - small transactions that come at the same time are committed as one: what takes
 * time is that the disk has them, and that once is enough for all. See store_internal.h.
 *
 * A member that is done, while another waits to begin, lets go of the mutex and waits; the other
 * goes on in the same transaction, behind a savepoint. Who finds nobody waiting commits for all. A
 * member that fails is taken back alone; when the commit fails, it has for all of them. So nobody
 * waits for anything but those who came before the commit, and who is alone does what they would
 * have done without all this.
 *
 * THREADS  `group` and its members: under write_mutex. `joining` is counted up before, and down
 * with the mutex.
 */
#include "store_internal.h"

#include "log.h"

/* One who is done and waits for the commit; on the stack of its thread. */
struct store_member {
    struct store_member *next;
    bool ended;
    enum store_status status;
};

/* The transaction has ended so, for all who are done. */
static void end_all(struct store *store, enum store_status status)
{
    for (struct store_member *member = store->group; member; member = member->next) {
        member->ended = true;
        member->status = status;
    }
    store->group = NULL;
    store->group_size = 0;
    pthread_cond_broadcast(&store->group_ended);
}

enum store_status store_group_commit(struct store *store)
{
    enum store_status status = STORE_BROKEN; /* by now there may be nothing to commit */

    if (!sqlite3_get_autocommit(store->writer))
        status = store_commit(store);
    if (status)
        store_rolled_back(store, status);
    end_all(store, status);
    return status;
}

enum store_status store_begin_shared(struct store *store, sqlite3 **db, const char *file, int line)
{
    enum store_status status;

    atomic_fetch_add(&store->joining, 1);
    pthread_mutex_lock(&store->write_mutex);
    atomic_fetch_sub(&store->joining, 1);
    store->joined = store->group != NULL;
    if (store->joined && store_exec(store->writer, "SAVEPOINT member") != STORE_OK) {
        store_group_commit(store);
        store->joined = false;
    }
    status = store->joined ? STORE_OK : store_begin_alone(store, file, line);
    if (status) {
        pthread_mutex_unlock(&store->write_mutex);
        return status;
    }
    store->shared = true;
    store->begin_file = file;
    store->begin_line = line;
    *db = store->writer;
    return STORE_OK;
}

/* What this one did is part of the transaction, or no longer. */
static enum store_status leave(struct store *store, enum store_status status)
{
    sqlite3 *db = store->writer;

    if (!store->joined)
        return status;
    if (status == STORE_OK)
        status = store_exec(db, "RELEASE member");
    /* Some errors have rolled back all of it by themselves already. */
    if (status && !sqlite3_get_autocommit(db) &&
        store_exec(db, "ROLLBACK TO member; RELEASE member") != STORE_OK)
        store_exec(db, "ROLLBACK");
    return status;
}

/* Until another has committed for it. */
static enum store_status wait_for_commit(struct store *store)
{
    struct store_member self = {.next = store->group};

    store->group = &self;
    store->group_size++;
    while (!self.ended)
        pthread_cond_wait(&store->group_ended, &store->write_mutex);
    return self.status;
}

enum store_status store_group_end(struct store *store, enum store_status status,
                                  struct watch *moves)
{
    enum { MEMBERS_MAX = 64 };
    bool others =
        atomic_load(&store->joining) > 0 && store->group_size < MEMBERS_MAX && !store_busy(store);

    store->shared = false;
    status = leave(store, status);
    store_watch_take(store, status == STORE_OK, moves);
    if (status == STORE_OK && others) {
        status = wait_for_commit(store);
    } else if (status == STORE_OK) {
        status = store_group_commit(store);
    } else if (store->group && sqlite3_get_autocommit(store->writer)) {
        store_rolled_back(store, status);
        end_all(store, status == STORE_FULL ? STORE_FULL : STORE_BROKEN);
    } else if (!store->group) {
        store_rolled_back(store, status);
    } else if (!others) {
        store_group_commit(store);
    }
    if (status)
        moves->watcher = NULL;
    store_health_note(store, status);
    return status;
}
