/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_internal.h - what the store*.c files share: transactions on the one writing connection,
 * read-only connections from the pool, and statements bound by name. Nobody else includes this
 * (but tests/server/test_store.c, to look behind the door).
 */
#ifndef STORE_INTERNAL_H
#define STORE_INTERNAL_H

#include "store_audit.h"
#include "store_jobs.h"
#include "store_results.h"
#include "store_owners.h"
#include "store_settle.h"
#include "store_watch.h"

#include <sqlite3.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    STORE_APPLICATION_ID = 0x62636464, /* "bcdd" */
    STORE_READERS = 4,
    STORE_BUSY_MS = 10000,
    STORE_CACHE_KIB = 64 << 10, /* pages the writer keeps in memory, when it has so many to write */
    STORE_WORD_SIZE = 16,       /* of a job's state or a role, and more than any has */
    STORE_WAL_BYTES_KEPT = 64 << 20, /* a longer -wal file is cut back when it is reused */
};

/* What the transaction in progress did to jobs. */
struct watch {
    store_watcher *watcher;
    void *context;
    struct job_move moves[STORE_WATCH_MOVES];
    size_t count;
    bool more;
};

/* Counted from the start, for store_health.c. */
struct store_tally {
    atomic_int_least64_t commits, rollbacks, full, broken;
    atomic_bool writable;
    atomic_int_least64_t tried_ms, failed_ms; /* when the latest ended, and failed; 0 = never */
};

/* THREADS  `writer`, `watch`, `begin_*` and everything done with it: under write_mutex. `idle` and
 * `idle_count`: under read_mutex, read_returned is signalled when a reader comes back. The rest
 * never changes. */
struct store {
    int lock_fd;
    char *path; /* DIR/bcd.sqlite */
    struct column_cache *columns; /* NULL = no memory for it */
    pthread_mutex_t write_mutex;
    sqlite3 *writer;
    const char *begin_file; /* who began the transaction in progress, for the log */
    int begin_line;
    bool shared, joined;        /* it is of store_begin_shared; behind others of the same */
    struct store_member *group; /* who is done and waits for the commit; NULL = nobody */
    size_t group_size;
    pthread_cond_t group_ended;
    atomic_int joining; /* who waits for the mutex in store_begin_shared */
    struct watch watch;
    struct store_tally tally;
    atomic_int large;      /* transactions that take seconds, in progress or about to begin */
    atomic_int slices;     /* rows of transactions in progress that put off the same */
    atomic_bool unsettled; /* one left something to store_settle */
    pthread_mutex_t read_mutex;
    pthread_cond_t read_returned;
    sqlite3 *idle[STORE_READERS];
    size_t idle_count, reader_count;
    atomic_flag backing_up; /* one backup at a time */
};

/* One numbered file of schema/. */
struct migration {
    const char *name, *sql;
};

/* store_open with a schema other than the one compiled in, so that migration can be tested. */
struct store_schema {
    const struct migration *migrations;
    size_t count;
};
const struct store_schema *store_schema(void); /* the one compiled in */
enum store_status store_open_schema(struct store **store, const char *dir,
                                    const struct store_schema *schema, char *reason, size_t size);

/* A writing transaction: BEGIN IMMEDIATE, with the mutex held until store_end. STORE_OK hands the
 * connection over; otherwise there is nothing to end. */
#define STORE_BEGIN(store, db) store_begin((store), (db), __FILE__, __LINE__)
enum store_status store_begin(struct store *store, sqlite3 **db, const char *file, int line);

/* The same for a transaction of a few rows that touches the connection through statements alone:
 * those that come at the same time are committed together (store_group.c), and each is told what
 * became of it. */
#define STORE_BEGIN_SHARED(store, db) store_begin_shared((store), (db), __FILE__, __LINE__)
enum store_status store_begin_shared(struct store *store, sqlite3 **db, const char *file, int line);

/* Commits if status is STORE_OK, else rolls back; returns what became of it. */
enum store_status store_end(struct store *store, enum store_status status);

/* Around store_begin and store_end of a transaction with thousands of rows: store_busy is true, and
 * store_settle has something to do. */
void store_large_begin(struct store *store);
void store_large_end(struct store *store);

/* The same around many that take parts of a second, with store_let_others in between: nobody needs
 * to wait for their end. */
void store_slices_begin(struct store *store);
void store_slices_end(struct store *store);

/* Pieces of these, with the mutex held. store_begin_alone: no transaction is in progress. */
enum store_status store_begin_alone(struct store *store, const char *file, int line);
void store_rolled_back(struct store *store, enum store_status status);
enum store_status store_group_end(struct store *store, enum store_status status,
                                  struct watch *moves);
/* Commits for those who are done, of whom there are some. */
enum store_status store_group_commit(struct store *store);

/* COMMIT; a large one leaves the log as long as it is. */
enum store_status store_commit(struct store *store);

/* Between two of many transactions, so that others come to write, too. */
void store_let_others(void);

/* The transaction in progress moved jobs without triggers: who listens is told that there was
 * more than he is told. */
void store_watch_unseen(struct store *store);

/* The moves of the transaction that just ended, for store_watch_tell after write_mutex was let go;
 * they are forgotten in the store. */
void store_watch_take(struct store *store, bool committed, struct watch *taken);
void store_watch_tell(const struct watch *taken);

/* A transaction ended so. */
void store_health_note(struct store *store, enum store_status status);

/* A read-only connection; waits for one when all are out. Never fails. */
sqlite3 *store_read_begin(struct store *store);
void store_read_end(struct store *store, sqlite3 *db);

/* Why store_open or a backup failed, in words that the caller has room for. */
struct store_reason {
    char *text;
    size_t size;
};

/* Fills it in and returns the status. */
__attribute__((format(printf, 3, 4))) enum store_status
store_refuse(const struct store_reason *reason, enum store_status status, const char *format, ...);

/* What was made or renamed in a directory is on disk afterwards. */
enum store_status store_sync_dir(const char *path);

/* Logs the connection's last error with the statement, and says which status it means. */
enum store_status store_fault(sqlite3 *db, int code, const char *sql);

/* Runs statements that return nothing. */
enum store_status store_exec(sqlite3 *db, const char *sql);

/* A statement. The first failure sticks: later calls do nothing, and stmt_fini returns it. So a
 * caller opens, binds, steps and looks at the status once. */
struct stmt {
    sqlite3 *db;
    sqlite3_stmt *handle;
    const char *sql;
    enum store_status status;
};
struct stmt stmt_init(sqlite3 *db, const char *sql);
/* name is ":job" as in the SQL; an unknown name is our own mistake. Text and blobs are borrowed
 * until stmt_fini; NULL text binds NULL, an empty blob stays a blob. */
void stmt_bind_text(struct stmt *stmt, const char *name, const char *value);
void stmt_bind_integer(struct stmt *stmt, const char *name, int64_t value);
void stmt_bind_number(struct stmt *stmt, const char *name, double value);
void stmt_bind_blob(struct stmt *stmt, const char *name, const void *bytes, size_t size);
/* True while there is a row to be read. */
bool stmt_step(struct stmt *stmt);
/* Columns of the current row, copied: malloc'ed, NULL for NULL; no memory becomes the status. */
char *stmt_text(struct stmt *stmt, int column);
void *stmt_blob(struct stmt *stmt, int column, size_t *size);
/* A text in the caller's room, cut to it; "" for NULL. */
void stmt_text_to(struct stmt *stmt, int column, char *to, size_t room);
int64_t stmt_integer(struct stmt *stmt, int column);
double stmt_number(struct stmt *stmt, int column);
bool stmt_null(struct stmt *stmt, int column);
/* The array of `used` elements, which this alone has made (NULL at first), with room for one more;
 * no memory becomes the status, and the array stays. */
void *stmt_room(struct stmt *stmt, void *array, size_t used, size_t element_size);
enum store_status stmt_fini(struct stmt *stmt);
/* Ready to be bound and stepped once more. */
void stmt_again(struct stmt *stmt);

/* Runs a statement that returns no rows to its end, and makes it ready for other values. */
enum store_status stmt_run_again(struct stmt *stmt, int *changes);

/* Runs a statement that returns no rows to its end and closes it. *changes (may be NULL) = rows
 * changed by it. */
enum store_status stmt_run(struct stmt *stmt, int *changes);

/* The columns of a record, and the one row of them that a statement gives (STORE_NOT_FOUND = none;
 * ends the statement); the same of the job with this id. */
#define STORE_RECORD_COLUMNS                                                                       \
    "seq, id, hash, state, submitted_ms, started_ms, finished_ms, chunks, chunks_done, job, "      \
    "derived, error, owner, priority, label, "                                                     \
    "(SELECT group_concat(tag, ' ') FROM job_tags WHERE job_tags.job = seq), outcome, "            \
    "attempts_lost, attempts_failed"
enum store_status store_jobs_read_one(struct stmt *row, struct job_record *record);
enum store_status store_jobs_find(sqlite3 *db, const char *id, struct job_record *record);

/* What a job that is finished leaves behind; inside a transaction. */
enum store_status store_samples_add(sqlite3 *db, const char *id, const struct samples_kept *kept);

/* store_jobs_insert inside a transaction. */
enum store_status store_jobs_add(sqlite3 *db, const struct job_new *job, struct job_record *record,
                                 bool *existed);

/* store_attempts_use of one job inside a transaction. */
enum store_status store_attempts_add_use(sqlite3 *db, const char *id, double seconds);

/* store_audit_write and store_owners_get inside a transaction. */
enum store_status store_audit_add(sqlite3 *db, const struct audit_new *line);
enum store_status store_owners_find(sqlite3 *db, const char *owner, struct owner_record *record);

/* STORE_QUOTA when the owner may not have so much more. Inside the transaction that adds it. */
enum store_status store_owners_check(sqlite3 *db, const char *owner, const struct quota_need *need);

/* Statements of a connection that are kept for the next time; _add once, _drop before it is closed.
 * take: one that nobody uses, NULL = there is none. give: back, or to be finalized. */
void store_cache_add(sqlite3 *db);
void store_cache_drop(sqlite3 *db);
sqlite3_stmt *store_cache_take(sqlite3 *db, const char *sql);
void store_cache_give(sqlite3 *db, sqlite3_stmt *statement);

/* One transition inside a transaction; see store_jobs.h. error is for JOB_FAILED only. The working
 * data (chunks, checkpoints) of a job that ends here are dropped. */
enum store_status store_jobs_move(sqlite3 *db, const char *id, enum job_state to,
                                  const char *error);

/* The jobs with these seq, in this order; all must be there. records[count] is the caller's, each
 * ended by job_record_fini; untouched unless STORE_OK. */
enum store_status store_jobs_read(sqlite3 *db, const int64_t *seqs, size_t count,
                                  struct job_record *records);

/* The number that other tables know a job by. */
enum store_status store_jobs_seq(sqlite3 *db, const char *id, int64_t *seq);

/* STORE_CONFLICT if there is such a job, STORE_NOT_FOUND if not: why an UPDATE changed nothing. */
enum store_status store_jobs_why(sqlite3 *db, const char *id);

int64_t store_now_ms(void);

/* A letter and 80 random bits in base 32: nobody guesses one, and none is made twice. */
enum store_status store_make_id(char id[JOB_ID_SIZE], char kind);
enum store_status store_make_ids(char (*ids)[JOB_ID_SIZE], size_t count, char kind);

#endif
