/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_backup.c - a checked copy of the database as an answer. Making it takes as long as the
 * disk needs for two copies: aside (aside.h). One at a time, until it is sent: each takes as much
 * disk as the database.
 */
#include "handle.h"
#include "log.h"
#include "reply.h"
#include "store_backup.h"

#include <stdlib.h>
#include <unistd.h>

/* A copy on its way out. */
struct sending {
    int fd;
    atomic_flag *busy; /* cleared at the end of it all; NULL = nobody counts */
};

static bool make(const struct service *service, const struct call *call, struct sending *sending,
                 struct reply *reply);
static ssize_t read_file(void *state, char *to, size_t size);
static void close_file(void *state);

void handle_backup(const struct service *service, const struct call *call, struct reply *reply)
{
    if (service->backup && atomic_flag_test_and_set(service->backup)) {
        reply_problem(reply, PROBLEM_BUSY, "another backup is being made or sent");
        return;
    }
    struct sending *sending = malloc(sizeof(*sending));
    if (!sending) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
    } else if (make(service, call, sending, reply)) {
        sending->busy = service->backup;
        const struct stream stream = {.read = read_file, .free = close_file, .state = sending};
        reply_stream_take(reply, "application/vnd.sqlite3", &stream);
        return;
    }
    free(sending);
    if (service->backup)
        atomic_flag_clear(service->backup);
}

/* False with the reply filled. The file has no name any more when its first byte leaves. */
static bool make(const struct service *service, const struct call *call, struct sending *sending,
                 struct reply *reply)
{
    char reason[512];
    struct backup backup = {.fd = -1};
    enum store_status status =
        store_backup_open(service->store, call->stop, &backup, reason, sizeof(reason));
    if (status == STORE_OK) {
        sending->fd = backup.fd;
        log_write(LOG_LEVEL_INFO, "backup",
                  LOG_FIELDS(log_integer("bytes", backup.bytes), log_integer("jobs", backup.jobs),
                             log_text("sha256", backup.sha256)));
    } else if (status == STORE_CONFLICT) {
        reply_problem(reply, PROBLEM_BUSY, "%s", reason);
    } else if (status == STORE_FULL) {
        reply_problem(reply, PROBLEM_DISK_FULL, "%s", reason);
    } else {
        reply_problem(reply, PROBLEM_INTERNAL, "no backup could be made: %s", reason);
    }
    return status == STORE_OK;
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
    if (sending->busy)
        atomic_flag_clear(sending->busy);
    free(sending);
}
