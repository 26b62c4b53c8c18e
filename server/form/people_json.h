/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * people_json.h - tokens, owners and the audit log as people see them. Printing functions return
 * malloc'ed JSON text, NULL = out of memory; readers put every fault into errors, with its pointer.
 */
#ifndef PEOPLE_JSON_H
#define PEOPLE_JSON_H

#include "bcd.h"
#include "store_audit.h"
#include "store_owners.h"
#include "store_tokens.h"

/* {"owner","role","name","expires_in":seconds}; the caller frees name. False = faults. */
bool people_json_read_token(const char *text, size_t size, int64_t now_ms,
                            struct token_record *token, struct bcd_errors *errors);

/* secret: NULL, or the token itself, shown this once. */
char *people_json_token(const struct token_record *token, const char *secret);
char *people_json_tokens(const struct token_record *tokens, size_t count);

/* {"queued_points","core_seconds_per_day","stored_bytes"}; null = the default. Quotas that are not
 * named stay as they come. */
bool people_json_read_quotas(const char *text, size_t size, double quota[QUOTAS],
                             struct bcd_errors *errors);

char *people_json_owner(const struct owner_record *owner);
char *people_json_owners(const struct owner_record *owners, size_t count);
char *people_json_me(const struct identity *me, const struct owner_record *owner);

/* next: cursor of the page that follows, 0 = none. */
char *people_json_audit(const struct audit_line *lines, size_t count, int64_t next);

/* Members of the problem "over quota": what is asked for is beyond this one. */
char *people_json_excess(const struct owner_record *owner, enum quota quota, double need);

#endif
