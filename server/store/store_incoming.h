/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_incoming.h - points in memory as a table that SQL reads: incoming(:rows). One statement for
 * some hundred of them takes half the time of one for each. For store*.c only.
 *
 *   place, job of its point; id, hash, seq, chunks, job_text, derived, core_seconds, bytes of a job
 */
#ifndef STORE_INCOMING_H
#define STORE_INCOMING_H

#include "store_internal.h"
#include "store_sweeps.h"

enum { INCOMING_MAX = 256 }; /* rows at a time */

/* All is borrowed while a statement runs. */
struct incoming {
    const struct sweep_point_new *points;
    size_t count;                        /* up to INCOMING_MAX */
    int64_t first_point, first_seq;      /* numbers of the first; the others follow */
    char ids[INCOMING_MAX][JOB_ID_SIZE]; /* of new jobs */
    int64_t jobs[INCOMING_MAX];          /* column "job": seq of each point's job */
};

/* Makes the table known to a connection. An SQLite code. */
int store_incoming_add(sqlite3 *db);

/* Binds the rows to the parameter :rows. */
void store_incoming_bind(struct stmt *stmt, struct incoming *incoming);

#endif
