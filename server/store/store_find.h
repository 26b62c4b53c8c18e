/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_find.h - jobs by any of their scalars, sorted by any of them, page by page.
 *
 * Scalars are named by dotted paths: those of the completed job ("diameter", "potential.type",
 * "observables.msd.last"), "derived.NAME", "results.OBSERVABLE.NAME" and "outcome.NAME" once the
 * job is done, "owner", "label", "priority", "submitted_at", "started_at" and "finished_at"
 * (milliseconds since 1970).
 *
 * A page takes time in proportion to the jobs stored, but little: columns of values are looked
 * through, not jobs (store_segment.h), and they are kept in memory (store_column_cache.h): some
 * milliseconds for a million. Pages in the default order without conditions look at what they show.
 *
 * See store.h for threads, errors and memory.
 */
#ifndef STORE_FIND_H
#define STORE_FIND_H

#include "store_jobs.h"

/* What a scalar must be. Numbers are equal within 1e-15 relative (a double written in another way
 * is still found), integers exactly; other values are texts. */
enum find_relation {
    FIND_EQUAL,
    FIND_OTHER,  /* also where there is no such scalar */
    FIND_WITHIN, /* least <= number <= most */
    FIND_TAGGED, /* has the tag `value`; there is no path */
    FIND_SWEPT,  /* belongs to the sweep with the id `value`; likewise */
    FIND_RELATIONS
};
struct find_condition {
    const char *path;
    enum find_relation relation;
    const char *value;        /* FIND_EQUAL, FIND_OTHER, FIND_TAGGED, FIND_SWEPT */
    const char *least, *most; /* FIND_WITHIN: numbers (find_is_number), or NULL */
};
bool find_is_number(const char *text);

struct find_query {
    unsigned states; /* bit 1 << enum job_state for each that is wanted; 0 = all */
    const struct find_condition *conditions;
    size_t condition_count; /* at most LIMIT_FILTERS_MAX */
    /* A path; NULL = order of submission. Among equals the newest comes first; jobs without the
     * scalar come last either way. */
    const char *sort;
    bool ascending;
    size_t limit;
    const char *cursor; /* `next` of the page before, of the same sort; NULL = from the start */
};
struct find_page {
    struct job_record *records; /* ended by find_page_fini */
    size_t count;
    char *next; /* NULL = that was all */
};
void find_page_fini(struct find_page *page);

/* A page, as of one moment. The next one goes on behind the last job shown, wherever that would be
 * by then: what comes or goes in between neither repeats a job nor hides one that stands where it
 * stood. STORE_CONFLICT: the cursor is none of this sort. */
enum store_status store_find(struct store *store, const struct find_query *query,
                             struct find_page *page);

/* Whether any job ever had this scalar. */
enum store_status store_find_known(struct store *store, const char *path, bool *known);

#endif
