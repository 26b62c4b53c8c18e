/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identity.h"

#include <string.h>

static const char *const role_names[ROLES] = {
    [ROLE_NONE] = "none",           [ROLE_WORKER] = "worker",     [ROLE_READER] = "reader",
    [ROLE_SUBMITTER] = "submitter", [ROLE_OPERATOR] = "operator", [ROLE_ADMIN] = "admin",
};

const char *role_name(enum role role)
{
    return role_names[role];
}

bool role_parse(const char *name, enum role *role)
{
    for (int i = ROLE_WORKER; i < ROLES; i++) {
        if (strcmp(name, role_names[i]) == 0) {
            *role = (enum role)i;
            return true;
        }
    }
    return false;
}

bool role_may(enum role role, enum role least)
{
    return least == ROLE_WORKER ? role == ROLE_WORKER || role == ROLE_ADMIN : role >= least;
}

bool owner_sound(const char *owner)
{
    size_t length = strspn(owner, "abcdefghijklmnopqrstuvwxyz0123456789_-");
    return length > 0 && length < OWNER_SIZE && owner[length] == '\0';
}
