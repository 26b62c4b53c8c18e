/* SPDX-License-Identifier: GPL-3.0-or-later
 * worker_share.c - bcd worker through a directory; see share_dir.h. */
#include "share_dir.h"
#include "worker_link.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Takes the first offer that nobody else takes before. All begin to look at another place, or they
 * would be in one another's way. */
enum link_status worker_share_take(struct share_dir *dir, struct lease_loan *loan, char *reason,
                                   size_t size)
{
    const int offers = share_dir_at(dir, SHARE_OFFERS), taken = share_dir_at(dir, SHARE_TAKEN);
    struct bcd_errors errors = {0};
    size_t count, length = 0;
    char(*names)[SPOOL_NAME_SIZE] = spool_list(offers, &count);
    char *text = NULL, name[SPOOL_NAME_SIZE] = "";
    for (size_t i = 0; i < count && !text; i++) {
        snprintf(name, sizeof name, "%s", names[(i + (size_t)getpid()) % count]);
        if (spool_move(offers, name, taken, name))
            text = spool_read(taken, name, SHARE_FILE_BYTES_MAX, &length);
    }
    free(names);
    if (!text)
        return LINK_NOTHING;
    bool good = lease_json_read_loan(text, length, loan, &errors) && share_name_is(name, loan);
    free(text);
    if (good)
        return LINK_OK;
    snprintf(reason, size, "the offer %s cannot be read", name);
    lease_loan_fini(loan);
    return LINK_REFUSED;
}

/* What was taken is ours as long as the daemon leaves it where it is; of a daemon that is away we
 * hear nothing either way. */
enum link_status worker_share_tell(struct share_dir *dir, const struct lease_loan *loan,
                                   const char *text, bool ended)
{
    const int to = share_dir_at(dir, ended ? SHARE_RETURNS : SHARE_WORDS);
    char name[SPOOL_NAME_SIZE];
    if (!spool_put(to, loan->id, text, strlen(text)))
        return LINK_AWAY;
    share_name(loan, name);
    if (ended || faccessat(share_dir_at(dir, SHARE_TAKEN), name, F_OK, 0) == 0 || errno != ENOENT)
        return LINK_OK;
    return LINK_STOP;
}
