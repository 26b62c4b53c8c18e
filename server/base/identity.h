/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * identity.h - who asks, and what they may do: each role may do what those before it may. Workers
 * stand apart: what they do is theirs, and an admin's.
 */
#ifndef IDENTITY_H
#define IDENTITY_H

#include <stdbool.h>
#include <stddef.h>

enum role {
    ROLE_NONE,      /* nobody needs to say who they are */
    ROLE_WORKER,    /* a program that runs chunks of jobs elsewhere, and may do nothing else */
    ROLE_READER,    /* looks at everything */
    ROLE_SUBMITTER, /* submits jobs, and cancels their own */
    ROLE_OPERATOR,  /* cancels anybody's */
    ROLE_ADMIN,     /* tokens, quotas, audit log, backups */
    ROLES
};

enum { OWNER_SIZE = 33, TOKEN_ID_SIZE = 24 };
#define OWNER_LOCAL "local" /* whoever asks from this machine while there are no tokens */

struct identity {
    char owner[OWNER_SIZE]; /* [a-z0-9_-]{1,32} */
    enum role role;
    char token[TOKEN_ID_SIZE]; /* what their token is called by; "" = none was needed */
};

const char *role_name(enum role role); /* "none", "reader", ... */

/* Roles that a person can have: not "none". */
bool role_parse(const char *name, enum role *role);

/* Whether a role may do what is for `least`. */
bool role_may(enum role role, enum role least);

bool owner_sound(const char *owner);

#endif
