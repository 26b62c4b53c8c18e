/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_backup.c - see store_backup.h. */
#include "store_backup.h"

#include "log.h"
#include "store_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { PAGES_A_STEP = 2000, SPARE_BYTES = 16 << 20, BUSY_TRIES = 600 };

struct copying {
    const struct backup_plan *plan;
    const char *partial; /* the copy, until it is checked */
    sqlite3 *from, *copy;
    struct backup backup;
    struct store_reason reason;
};

static bool stopped(const struct copying *copying)
{
    return copying->plan->stop && atomic_load(copying->plan->stop);
}

static int look_at_stop(void *context)
{
    return stopped(context);
}

/* What SQLite says of a connection, or that somebody wants no backup any more. */
static enum store_status explain(struct copying *copying, sqlite3 *db, const char *file)
{
    int code = sqlite3_errcode(db) & 0xff;

    if (stopped(copying))
        return store_refuse(&copying->reason, STORE_BROKEN, "stopped");
    return store_refuse(&copying->reason, code == SQLITE_FULL ? STORE_FULL : STORE_BROKEN, "%s: %s",
                        file, sqlite3_errmsg(db));
}

static enum store_status open_file(struct copying *copying, const char *file, int flags,
                                   sqlite3 **db)
{
    if (sqlite3_open_v2(file, db, flags | SQLITE_OPEN_NOMUTEX, NULL) != SQLITE_OK)
        return explain(copying, *db, file);
    sqlite3_extended_result_codes(*db, 1);
    sqlite3_busy_timeout(*db, STORE_BUSY_MS);
    sqlite3_db_config(*db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, (int *)NULL);
    sqlite3_progress_handler(*db, 10000, look_at_stop, copying);
    return STORE_OK;
}

static enum store_status ask_number(struct copying *copying, sqlite3 *db, const char *sql,
                                    int64_t *number)
{
    sqlite3_stmt *row = NULL;
    int code = sqlite3_prepare_v2(db, sql, -1, &row, NULL);

    if (code == SQLITE_OK && (code = sqlite3_step(row)) == SQLITE_ROW)
        *number = sqlite3_column_int64(row, 0);
    sqlite3_finalize(row);
    return code == SQLITE_ROW ? STORE_OK : explain(copying, db, sql);
}

/* ------------------------------------------------------------------- copying */

/* A read transaction: all that follows is of one moment. */
static enum store_status open_source(struct copying *copying)
{
    const char *from = copying->plan->from;
    int64_t application = 0;
    enum store_status status;

    if (access(from, R_OK) != 0)
        return store_refuse(&copying->reason, STORE_NOT_FOUND, "%s: %s", from, strerror(errno));
    status = open_file(copying, from, SQLITE_OPEN_READONLY, &copying->from);
    if (status == STORE_OK &&
        sqlite3_exec(copying->from, "BEGIN; SELECT 1 FROM sqlite_schema", NULL, NULL, NULL))
        status = explain(copying, copying->from, from);
    if (status == STORE_OK)
        status = ask_number(copying, copying->from, "PRAGMA application_id", &application);
    if (status == STORE_OK && application != STORE_APPLICATION_ID)
        status = store_refuse(&copying->reason, STORE_BROKEN, "%s: no database of bcdd", from);
    return status;
}

static enum store_status check_room(struct copying *copying)
{
    int64_t pages = 0, page_bytes = 0;
    enum store_status status = ask_number(copying, copying->from, "PRAGMA page_count", &pages);
    char *path = strdup(copying->partial);
    struct statvfs disk;

    if (status == STORE_OK)
        status = ask_number(copying, copying->from, "PRAGMA page_size", &page_bytes);
    if (status == STORE_OK && (!path || statvfs(dirname(path), &disk) != 0))
        status = store_refuse(&copying->reason, STORE_BROKEN, "%s: %s", copying->partial,
                              strerror(errno));
    free(path);
    if (status)
        return status;
    double needed = (double)pages * (double)page_bytes + SPARE_BYTES;
    double free_bytes = (double)disk.f_bavail * (double)disk.f_frsize;
    if (free_bytes < needed)
        return store_refuse(&copying->reason, STORE_FULL,
                            "%s: needs %.0f MB, the disk has %.0f MB left", copying->plan->to,
                            needed / 1e6, free_bytes / 1e6);
    return STORE_OK;
}

static enum store_status make_partial(struct copying *copying)
{
    int fd;

    unlink(copying->partial);
    fd = open(copying->partial, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0)
        return store_refuse(&copying->reason, errno == ENOSPC ? STORE_FULL : STORE_BROKEN, "%s: %s",
                            copying->partial, strerror(errno));
    close(fd);
    return STORE_OK;
}

static int copy_pages(struct copying *copying, sqlite3_backup *pages)
{
    int code = SQLITE_OK, tries = 0;

    while (code == SQLITE_OK && !stopped(copying)) {
        code = sqlite3_backup_step(pages, PAGES_A_STEP);
        if ((code == SQLITE_BUSY || code == SQLITE_LOCKED) && tries++ < BUSY_TRIES) {
            usleep(10000);
            code = SQLITE_OK;
        }
    }
    return code;
}

/* The copy is one file: it was taken from one with a write-ahead log, and says so in its header. */
static enum store_status copy(struct copying *copying)
{
    static const char settings[] = "PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF";
    enum store_status status =
        open_file(copying, copying->partial, SQLITE_OPEN_READWRITE, &copying->copy);
    sqlite3_backup *pages;
    int code;

    if (status == STORE_OK && sqlite3_exec(copying->copy, settings, NULL, NULL, NULL))
        status = explain(copying, copying->copy, copying->partial);
    if (status)
        return status;
    pages = sqlite3_backup_init(copying->copy, "main", copying->from, "main");
    code = pages ? copy_pages(copying, pages) : SQLITE_ERROR;
    if (pages)
        sqlite3_backup_finish(pages);
    if (code != SQLITE_DONE ||
        sqlite3_exec(copying->copy, "PRAGMA journal_mode = DELETE", NULL, NULL, NULL))
        return explain(copying, copying->copy, copying->partial);
    return STORE_OK;
}

/* ------------------------------------------------------------------ checking */

static enum store_status check_words(struct copying *copying, const char *sql, const char *good)
{
    sqlite3_stmt *row = NULL;
    int code = sqlite3_prepare_v2(copying->copy, sql, -1, &row, NULL);
    enum store_status status = STORE_OK;

    if (code == SQLITE_OK)
        code = sqlite3_step(row);
    if (code == SQLITE_ROW) {
        const char *word = (const char *)sqlite3_column_text(row, 0);

        if (!word || strcmp(word, good) != 0)
            status = store_refuse(&copying->reason, STORE_BROKEN, "the copy is damaged: %s: %s",
                                  sql, word ? word : "");
    } else if (code != SQLITE_DONE) {
        status = explain(copying, copying->copy, sql);
    }
    sqlite3_finalize(row);
    return status;
}

/* As many rows in every table as there were at that moment. */
static enum store_status check_counts(struct copying *copying)
{
    sqlite3_stmt *table = NULL;
    enum store_status status = STORE_OK;

    if (sqlite3_prepare_v2(copying->from,
                           "SELECT name FROM sqlite_schema WHERE type = 'table'"
                           " AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\'",
                           -1, &table, NULL) != SQLITE_OK)
        return explain(copying, copying->from, copying->plan->from);
    while (status == STORE_OK && sqlite3_step(table) == SQLITE_ROW) {
        char *sql = sqlite3_mprintf("SELECT count(*) FROM \"%w\"",
                                    (const char *)sqlite3_column_text(table, 0));
        int64_t there = -1, here = -2;

        status = sql ? ask_number(copying, copying->from, sql, &there) : STORE_BROKEN;
        if (status == STORE_OK)
            status = ask_number(copying, copying->copy, sql, &here);
        if (status == STORE_OK && there != here)
            status =
                store_refuse(&copying->reason, STORE_BROKEN, "the copy has %lld rows of %lld: %s",
                             (long long)here, (long long)there, sql);
        sqlite3_free(sql);
    }
    sqlite3_finalize(table);
    return status;
}

static enum store_status check(struct copying *copying)
{
    struct backup *backup = &copying->backup;
    enum store_status status = check_words(copying, "PRAGMA integrity_check", "ok");

    if (status == STORE_OK) /* a row is a fault */
        status = check_words(copying, "PRAGMA foreign_key_check", "");
    if (status == STORE_OK)
        status = check_counts(copying);
    if (status == STORE_OK)
        status = ask_number(copying, copying->copy, "PRAGMA user_version", &backup->schema);
    if (status == STORE_OK)
        status = ask_number(copying, copying->copy, "SELECT count(*) FROM jobs", &backup->jobs);
    if (status == STORE_OK)
        status =
            ask_number(copying, copying->copy, "SELECT count(*) FROM results", &backup->results);
    return status;
}

/* ----------------------------------------------------------------- finishing */

/* What stands in the file now, read back, and on disk. */
static enum store_status seal(struct copying *copying)
{
    static const size_t room = 1 << 20;
    int fd = open(copying->partial, O_RDWR | O_CLOEXEC);
    unsigned char digest[SHA256_DIGEST_LENGTH], *bytes = malloc(room);
    SHA2_CTX context;
    ssize_t got = -1;
    bool sound = fd >= 0 && bytes && fsync(fd) == 0;

    SHA256Init(&context);
    while (sound && !stopped(copying) && (got = read(fd, bytes, room)) > 0) {
        SHA256Update(&context, bytes, (size_t)got);
        copying->backup.bytes += got;
    }
    SHA256Final(digest, &context);
    for (size_t i = 0; i < sizeof digest; i++)
        snprintf(copying->backup.sha256 + 2 * i, 3, "%02x", digest[i]);
    sound = sound && got == 0;
    if (fd >= 0)
        close(fd);
    free(bytes);
    if (!sound && stopped(copying))
        return store_refuse(&copying->reason, STORE_BROKEN, "stopped");
    return sound ? STORE_OK
                 : store_refuse(&copying->reason, errno == ENOSPC ? STORE_FULL : STORE_BROKEN,
                                "%s: %s", copying->partial, strerror(errno));
}

static void close_both(struct copying *copying)
{
    sqlite3_close(copying->copy);
    sqlite3_close(copying->from);
    copying->copy = copying->from = NULL;
}

/* A copy that was checked, in `partial`; it is removed if anything fails. */
static enum store_status make(struct copying *copying)
{
    enum store_status status;

    copying->backup.taken_ms = store_now_ms();
    status = open_source(copying);
    if (status == STORE_OK)
        status = check_room(copying);
    if (status == STORE_OK)
        status = make_partial(copying);
    if (status == STORE_OK)
        status = copy(copying);
    if (status == STORE_OK)
        status = check(copying);
    close_both(copying);
    if (status == STORE_OK)
        status = seal(copying);
    if (status)
        unlink(copying->partial);
    return status;
}

/* The name, if nobody else has it; then the directory, so that it stays. */
static enum store_status give_name(struct copying *copying)
{
    const char *to = copying->plan->to;
    char *path = strdup(to);
    bool named = renameat2(AT_FDCWD, copying->partial, AT_FDCWD, to, RENAME_NOREPLACE) == 0;

    if (!named && errno == EINVAL) /* a file system that does not know this */
        named = link(copying->partial, to) == 0 && unlink(copying->partial) == 0;
    if (!named) {
        store_refuse(&copying->reason, STORE_BROKEN, "%s: %s", to, strerror(errno));
        unlink(copying->partial);
    } else if (path) {
        store_sync_dir(dirname(path));
    }
    free(path);
    return named ? STORE_OK : STORE_BROKEN;
}

enum store_status store_backup_file(const struct backup_plan *plan, struct backup *backup,
                                    char *reason, size_t size)
{
    struct copying copying = {.plan = plan, .reason = {reason, size}};
    char *partial = NULL;
    struct stat there;
    enum store_status status;

    if (lstat(plan->to, &there) == 0)
        return store_refuse(&copying.reason, STORE_CONFLICT, "%s: it is there already", plan->to);
    if (asprintf(&partial, "%s.partial", plan->to) < 0)
        return store_refuse(&copying.reason, STORE_BROKEN, "out of memory");
    copying.partial = partial;
    status = make(&copying);
    if (status == STORE_OK)
        status = give_name(&copying);
    if (status == STORE_OK)
        *backup = copying.backup;
    free(partial);
    return status;
}

/* ------------------------------------------------------------------- a store */

static char *partial_of(const struct store *store)
{
    char *path = NULL;

    return asprintf(&path, "%s.backup.partial", store->path) < 0 ? NULL : path;
}

void store_backup_tidy(const struct store *store)
{
    char *path = partial_of(store);

    if (path)
        unlink(path);
    free(path);
}

enum store_status store_backup_open(struct store *store, const atomic_int *stop,
                                    struct backup *backup, char *reason, size_t size)
{
    const struct backup_plan plan = {.from = store->path, .to = "the backup", .stop = stop};
    struct copying copying = {.plan = &plan, .reason = {reason, size}};
    enum store_status status;

    if (atomic_flag_test_and_set(&store->backing_up))
        return store_refuse(&copying.reason, STORE_CONFLICT, "another backup is being made");
    char *partial = partial_of(store);
    copying.partial = partial;
    status =
        partial ? make(&copying) : store_refuse(&copying.reason, STORE_BROKEN, "out of memory");
    if (status == STORE_OK) {
        copying.backup.fd = open(partial, O_RDONLY | O_CLOEXEC);
        if (copying.backup.fd < 0)
            status =
                store_refuse(&copying.reason, STORE_BROKEN, "%s: %s", partial, strerror(errno));
        unlink(partial);
    }
    atomic_flag_clear(&store->backing_up);
    if (status == STORE_OK)
        *backup = copying.backup;
    else
        log_write(LOG_LEVEL_ERROR, "backup_failed", LOG_FIELDS(log_text("reason", reason)));
    free(partial);
    return status;
}
