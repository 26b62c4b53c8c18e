/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_audit.h - who did what: one line per submission, cancel, token, quota and refused
 * authentication. The newest LIMIT_AUDIT_ROWS_MAX lines are kept. See store.h for threads, errors
 * and memory.
 */
#ifndef STORE_AUDIT_H
#define STORE_AUDIT_H

#include "identity.h"
#include "store.h"

#include <stdint.h>

/* All that can be done, with blanks between. */
#define STORE_AUDIT_ACTIONS                                                                        \
    "job.submit job.cancel sweep.submit sweep.extend sweep.retry sweep.cancel token.create "       \
    "token.revoke token.forget owner.quota access.refuse"

/* A line to be written. Borrowed. */
struct audit_new {
    const struct identity *by;
    const char *action; /* one of these */
    const char *object; /* id of the job, sweep, token or owner */
    const char *detail; /* words, or "" */
};
enum store_status store_audit_write(struct store *store, const struct audit_new *line);

struct audit_line {
    int64_t seq, time_ms;
    char owner[OWNER_SIZE], token[TOKEN_ID_SIZE];
    char *action, *object, *detail;
};
void audit_lines_free(struct audit_line *lines, size_t count);

/* Newest first, lines with seq < before_seq (0 = from the newest), at most `limit`. owner, action,
 * object: NULL = any. */
struct audit_query {
    const char *owner, *action, *object;
    int64_t before_seq;
    size_t limit;
};
enum store_status store_audit_list(struct store *store, const struct audit_query *query,
                                   struct audit_line **lines, size_t *count);

#endif
