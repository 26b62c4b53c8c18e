/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "log.h"
#include "reply.h"
#include "store_backup.h"

#include <stdlib.h>
#include <unistd.h>

static ssize_t read_file(void *state, char *to, size_t size);
static void close_file(void *state);

/* Takes as long as the disk needs for two copies, on a thread that has other connections to serve:
 * one at a time. The file has no name any more when its first byte leaves. */
void handle_backup(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)call;
    struct backup backup;
    char reason[512];
    int *fd = malloc(sizeof(*fd));
    enum store_status status =
        fd ? store_backup_open(service->store, fd, &backup, reason, sizeof(reason)) : STORE_BROKEN;
    if (!fd) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
    } else if (status == STORE_OK) {
        const struct stream stream = {.read = read_file, .free = close_file, .state = fd};
        reply_stream_take(reply, "application/vnd.sqlite3", &stream);
        log_write(LOG_LEVEL_INFO, "backup",
                  LOG_FIELDS(log_integer("bytes", backup.bytes), log_integer("jobs", backup.jobs),
                             log_text("sha256", backup.sha256)));
        fd = NULL;
    } else if (status == STORE_CONFLICT) {
        reply_problem(reply, PROBLEM_BUSY, "%s", reason);
    } else if (status == STORE_FULL) {
        reply_problem(reply, PROBLEM_DISK_FULL, "%s", reason);
    } else {
        reply_problem(reply, PROBLEM_INTERNAL, "no backup could be made: %s", reason);
    }
    free(fd);
}

static ssize_t read_file(void *state, char *to, size_t size)
{
    return read(*(int *)state, to, size);
}

static void close_file(void *state)
{
    close(*(int *)state);
    free(state);
}
