/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_backup.c - a checked copy of the database as an answer. Making it takes as long as the
 * disk needs for two copies: a thread of its own does that, while the answer is held and the
 * threads of http.c serve others. One at a time, until it is sent: each takes as much disk as the
 * database.
 *
 * THREADS  A making belongs to its hold, and from done on to nobody else.
 */
#include "handle.h"
#include "limits.h"
#include "log.h"
#include "reply.h"
#include "store_backup.h"

#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

struct making {
    struct store *store;
    atomic_flag *busy; /* cleared at the end of it all; NULL = nobody counts, or given away */
    pthread_t thread;
    atomic_int stop;
    atomic_bool done;
    /* When it is done: */
    enum store_status status;
    struct backup backup; /* fd: -1 = given away */
    char reason[512];
};

/* A copy on its way out. */
struct sending {
    int fd;
    atomic_flag *busy;
};

static void begin(const struct service *service, struct reply *reply);
static void release(atomic_flag *busy);
static void *make(void *context);
static bool is_done(void *state);
static void end(void *state);
static void hold(struct making *making, struct reply *reply);
static void answer(struct making *making, struct reply *reply);
static ssize_t read_file(void *state, char *to, size_t size);
static void close_file(void *state);

void handle_backup(const struct service *service, const struct call *call, struct reply *reply)
{
    struct making *making = call->request->held;
    if (!making)
        begin(service, reply);
    else if (is_done(making))
        answer(making, reply);
    else
        reply_problem(reply, PROBLEM_BUSY, "the backup takes longer than %d s (LIMIT_BACKUP_MS)",
                      LIMIT_BACKUP_MS / 1000);
}

static void begin(const struct service *service, struct reply *reply)
{
    if (service->backup && atomic_flag_test_and_set(service->backup)) {
        reply_problem(reply, PROBLEM_BUSY, "another backup is being made or sent");
        return;
    }
    struct making *making = calloc(1, sizeof(*making));
    if (!making) {
        release(service->backup);
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        return;
    }
    making->store = service->store;
    making->busy = service->backup;
    making->backup.fd = -1;
    if (pthread_create(&making->thread, NULL, make, making) == 0) {
        pthread_setname_np(making->thread, "backup");
        hold(making, reply);
    } else {
        release(making->busy);
        free(making);
        reply_problem(reply, PROBLEM_BUSY, "no thread to be had for a backup");
    }
}

static void release(atomic_flag *busy)
{
    if (busy)
        atomic_flag_clear(busy);
}

static void *make(void *context)
{
    struct making *making = context;
    making->status = store_backup_open(making->store, &making->stop, &making->backup,
                                       making->reason, sizeof(making->reason));
    atomic_store(&making->done, true);
    return NULL;
}

static bool is_done(void *state)
{
    struct making *making = state;
    return atomic_load(&making->done);
}

/* Whoever asked has it, or has left. */
static void end(void *state)
{
    struct making *making = state;
    atomic_store(&making->stop, 1);
    pthread_join(making->thread, NULL);
    if (making->status == STORE_OK && making->backup.fd >= 0)
        close(making->backup.fd);
    release(making->busy);
    free(making);
}

static void hold(struct making *making, struct reply *reply)
{
    const struct hold hold = {
        .ready = is_done, .free = end, .state = making, .wait_ms = LIMIT_BACKUP_MS};
    reply_hold_take(reply, &hold);
}

/* The file has no name any more when its first byte leaves. */
static void answer(struct making *making, struct reply *reply)
{
    const struct backup *backup = &making->backup;
    struct sending *sending = making->status == STORE_OK ? malloc(sizeof(*sending)) : NULL;
    if (sending) {
        *sending = (struct sending){.fd = backup->fd, .busy = making->busy};
        making->backup.fd = -1;
        making->busy = NULL;
        const struct stream stream = {.read = read_file, .free = close_file, .state = sending};
        reply_stream_take(reply, "application/vnd.sqlite3", &stream);
        log_write(LOG_LEVEL_INFO, "backup",
                  LOG_FIELDS(log_integer("bytes", backup->bytes), log_integer("jobs", backup->jobs),
                             log_text("sha256", backup->sha256)));
    } else if (making->status == STORE_OK) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
    } else if (making->status == STORE_CONFLICT) {
        reply_problem(reply, PROBLEM_BUSY, "%s", making->reason);
    } else if (making->status == STORE_FULL) {
        reply_problem(reply, PROBLEM_DISK_FULL, "%s", making->reason);
    } else {
        reply_problem(reply, PROBLEM_INTERNAL, "no backup could be made: %s", making->reason);
    }
}

static ssize_t read_file(void *state, char *to, size_t size)
{
    const struct sending *sending = state;
    return read(sending->fd, to, size);
}

static void close_file(void *state)
{
    struct sending *sending = state;
    close(sending->fd);
    release(sending->busy);
    free(sending);
}
