/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * request_json.h - bodies of requests, for those who ask (the command line): a file of the user's
 * and what the command line adds to it. Functions return malloc'ed JSON, NULL = out of memory or
 * with words in reason.
 */
#ifndef REQUEST_JSON_H
#define REQUEST_JSON_H

#include "bcd.h"

/* What is said about a submission beside its physics; borrowed. */
struct request_ticket {
    const char *label; /* NULL = not said */
    const char *const *tags;
    size_t tags_count;
    const int64_t *priority; /* NULL = not said */
};

/* The text with these keys set in place of its own. Text that is no JSON object comes back as it
 * is: the server has the words for its faults. */
char *request_json_submit(const char *text, size_t size, const struct request_ticket *ticket);

/* {"base":JOB,"axes":{...},"zip":[...]}. An axis is "/diameter=0.1,0.5" (values: JSON, or words
 * that stand for strings), "/seed=1..10" (whole numbers) or "/potential/amplitude=0..6:7" (7
 * points, the ends included; "0.1..10:7:log" in equal ratios); a zip is "/a,/b". */
struct request_sweep {
    const char *job; /* NUL-terminated; NULL = no base: an extension */
    const char *const *axes, *const *zips;
    size_t axes_count, zips_count;
    bool logarithmic;                    /* all ranges */
    const struct request_ticket *ticket; /* NULL = none */
};
char *request_json_sweep(const struct request_sweep *sweep, char *reason, size_t size);

/* {"NAME":"VALUE",...} of strings and whole numbers; NULL values are left out. */
struct request_member {
    const char *name, *text; /* text: a string, or */
    const int64_t *number;   /* a number */
};
char *request_json_members(const struct request_member *members, size_t count);

#endif
