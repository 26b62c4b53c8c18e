/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_tokens.h - who may come in: hashes of tokens, never the tokens. Each change leaves a line
 * in the audit log. See store.h for threads, errors and memory.
 */
#ifndef STORE_TOKENS_H
#define STORE_TOKENS_H

#include "identity.h"
#include "secret.h"
#include "store.h"

#include <stdint.h>

/* Times are milliseconds since 1970 UTC, 0 = never. */
struct token_record {
    char id[TOKEN_ID_SIZE]; /* "t" and [a-z2-7]+ */
    char owner[OWNER_SIZE];
    enum role role;
    unsigned char hash[SECRET_HASH_SIZE];
    int64_t created_ms, expires_ms, revoked_ms;
    char *name; /* NULL = none */
};
void token_records_free(struct token_record *records, size_t count);

/* Whether it opens anything at that time. */
bool token_record_live(const struct token_record *record, int64_t now_ms);

/* hash, owner, role, name and expires_ms of `token` are kept; id and created_ms are filled in.
 * STORE_CONFLICT: there are LIMIT_TOKENS_MAX live ones, or this would be the first live one and is
 * no admin's, and nobody could make another. */
enum store_status store_tokens_add(struct store *store, struct token_record *token,
                                   const struct identity *by);

/* All there are, oldest first: those that opened nothing any more LIMIT_TOKEN_KEPT_DAYS ago are
 * forgotten when another is made, and at the daemon's start, with a line in the audit log. */
enum store_status store_tokens_list(struct store *store, struct token_record **records,
                                    size_t *count);

enum store_status store_tokens_forget(struct store *store);

/* STORE_CONFLICT: it was revoked before, or (unless `last_too`) is the last live one of an admin.
 */
enum store_status store_tokens_revoke(struct store *store, const char *id, bool last_too,
                                      const struct identity *by);

#endif
