/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * access.h - who asks: the token of a request, held against those of the store.
 *
 * Whoever reaches a loopback address is on this machine, and may do everything as long as no token
 * was ever made. From the first one on every route that names a role needs one; that all of them
 * are revoked or have expired opens nothing again. On any other address there is nothing without.
 *
 * THREADS  Any thread. The tokens are kept in memory, and read again when one was made or revoked;
 *          only this process can do so, for it holds the store's lock.
 */
#ifndef ACCESS_H
#define ACCESS_H

#include "http.h"
#include "identity.h"
#include "store.h"

#include <stdbool.h>
#include <stddef.h>

enum access_mode {
    ACCESS_AUTO,     /* open on loopback without tokens */
    ACCESS_REQUIRED, /* never open */
    ACCESS_OPEN,     /* open, tokens or not; on loopback only */
};
bool access_mode_parse(const char *name, enum access_mode *mode);

struct access;

/* Refuses (in words, `reason`) an address off loopback while no admin has a token that is good. The
 * store is borrowed. */
enum store_status access_create(struct access **access, struct store *store, enum access_mode mode,
                                bool loopback, char *reason, size_t size);
void access_free(struct access *access);

/* After a token was made or revoked. */
enum store_status access_reload(struct access *access);

/* Who asks; role ROLE_NONE and words in `why` when nobody can be told from the request. */
struct identity access_identify(struct access *access, const struct request *request,
                                const char **why);

/* Whether somebody who was let in would be so now; if not, words in `why`. */
bool access_still(struct access *access, const struct identity *identity, const char **why);

/* Notes a refusal in log and audit log, not every one when they come thick and fast. `route` is
 * what was asked for. */
void access_note_refusal(struct access *access, const char *route, const char *why);

#endif
