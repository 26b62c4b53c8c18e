/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store.c - opening and closing the database: directory, lock, schema, connections.
 *
 * The database file itself is opened by SQLite alone once a connection exists: an open() and
 * close() of it elsewhere in the process would drop SQLite's locks.
 */
#include "store_backup.h"
#include "store_column_cache.h"
#include "store_incoming.h"
#include "store_internal.h"
#include "store_segment.h"
#include "store_sweeps.h"

#include "log.h"
#include "migrations.inc"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

/* What store_open works on; everything in it is on the stack but `store`. */
struct opening {
    struct store *store;
    const char *dir;
    const struct store_schema *schema;
    struct store_reason reason;
};

static enum store_status refuse_sqlite(struct opening *opening, sqlite3 *db, const char *what)
{
    int code = sqlite3_extended_errcode(db);
    enum store_status status = store_fault(db, code, what);

    return store_refuse(&opening->reason, status, "%s: cannot %s: %s (%d)", opening->store->path,
                        what, sqlite3_errmsg(db), code);
}

/* ----------------------------------------------------------------- directory */

/* One directory below those that exist; the new name is on disk when it returns STORE_OK. */
static enum store_status make_one(char *path)
{
    char *slash = strrchr(path, '/');
    enum store_status status;

    if (mkdir(path, 0700) != 0)
        return errno == EEXIST ? STORE_OK : errno == ENOSPC ? STORE_FULL : STORE_BROKEN;
    if (!slash)
        return store_sync_dir(".");
    if (slash == path)
        return store_sync_dir("/");
    *slash = '\0';
    status = store_sync_dir(path);
    *slash = '/';
    return status;
}

/* As mkdir -p, for the owner's eyes only. */
static enum store_status make_dir(struct opening *opening)
{
    char *path = strdup(opening->dir);
    enum store_status status = path ? STORE_OK : STORE_BROKEN;
    struct stat info;

    for (char *p = path; path && *p && status == STORE_OK; p++) {
        if (p[0] != '/' && (p[1] == '/' || p[1] == '\0')) {
            char kept = p[1];

            p[1] = '\0';
            status = make_one(path);
            p[1] = kept;
        }
    }
    free(path);
    if (status)
        return store_refuse(&opening->reason, status, "%s: cannot create this directory: %s",
                            opening->dir, strerror(errno));
    if (stat(opening->dir, &info) != 0 || !S_ISDIR(info.st_mode))
        return store_refuse(&opening->reason, STORE_BROKEN, "%s: not a directory", opening->dir);
    return STORE_OK;
}

/* SQLite's locks and shared memory need a file system of this machine. The numbers are f_type of
 * statfs(2). FUSE is let through: it is as often a local container's as a remote one. */
static enum store_status check_file_system(struct opening *opening)
{
    static const struct {
        unsigned long type;
        const char *name;
    } remote[] = {
        {0x6969, "NFS"},          {0x517b, "SMB"},        {0xff534d42, "CIFS"},
        {0xfe534d42, "SMB2"},     {0x01021997, "9P"},     {0x5346414f, "AFS"},
        {0x6b414653, "AFS"},      {0x73757245, "Coda"},   {0x564c, "NCP"},
        {0x00c36400, "Ceph"},     {0x0bd00bd0, "Lustre"}, {0x47504653, "GPFS"},
        {0x19830326, "BeeGFS"},   {0x013111a8, "IBRIX"},  {0xaad7aaea, "PanFS"},
        {0x20030528, "OrangeFS"}, {0x7461636f, "OCFS2"},  {0x01161970, "GFS2"},
    };
    struct statfs info;

    if (statfs(opening->dir, &info) != 0)
        return store_refuse(&opening->reason, STORE_BROKEN, "%s: %s", opening->dir,
                            strerror(errno));
    for (size_t i = 0; i < sizeof remote / sizeof remote[0]; i++)
        if (((unsigned long)info.f_type & 0xffffffffUL) == remote[i].type)
            return store_refuse(
                &opening->reason, STORE_BROKEN,
                "%s: on a network file system (%s), where a database can be corrupted; "
                "use a local disk",
                opening->dir, remote[i].name);
    return STORE_OK;
}

/* The lock lives as long as the descriptor; a crash cannot leave it behind. */
static enum store_status take_lock(struct opening *opening)
{
    struct store *store = opening->store;
    char *path = NULL;
    enum store_status status = STORE_OK;

    if (asprintf(&path, "%s/bcd.lock", opening->dir) < 0)
        return store_refuse(&opening->reason, STORE_BROKEN, "out of memory");
    store->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (store->lock_fd < 0)
        status = store_refuse(&opening->reason, errno == ENOSPC ? STORE_FULL : STORE_BROKEN,
                              "%s: %s", path, strerror(errno));
    else if (flock(store->lock_fd, LOCK_EX | LOCK_NB) != 0)
        status = store_refuse(&opening->reason, STORE_CONFLICT,
                              errno == EWOULDBLOCK ? "%s: another bcdd is using this directory"
                                                   : "%s: cannot be locked",
                              path);
    free(path);
    return status;
}

/* ---------------------------------------------------------------- connections */

/* Nobody but the owner reads the file, whatever the directory's mode. SQLite gives -wal and -shm
 * the same mode. No connection exists yet. */
static enum store_status make_file(struct opening *opening)
{
    int fd = open(opening->store->path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);

    if (fd >= 0)
        close(fd);
    else if (errno != EEXIST)
        return store_refuse(&opening->reason, errno == ENOSPC ? STORE_FULL : STORE_BROKEN, "%s: %s",
                            opening->store->path, strerror(errno));
    return STORE_OK;
}

/* What holds for every connection: no schema, however it got there, may run anything odd. */
static int set_up(sqlite3 *db)
{
    int code = SQLITE_OK;

    sqlite3_extended_result_codes(db, 1);
    code = code ? code : sqlite3_busy_timeout(db, STORE_BUSY_MS);
    code = code ? code : sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, (int *)NULL);
    code = code ? code : sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, (int *)NULL);
    code = code ? code : sqlite3_db_config(db, SQLITE_DBCONFIG_DQS_DDL, 0, (int *)NULL);
    code = code ? code : sqlite3_db_config(db, SQLITE_DBCONFIG_DQS_DML, 0, (int *)NULL);
    return code;
}

static enum store_status open_connection(struct opening *opening, int flags, sqlite3 **db)
{
    int code = sqlite3_open_v2(opening->store->path, db, flags | SQLITE_OPEN_NOMUTEX, NULL);

    if (code == SQLITE_OK)
        code = set_up(*db);
    if (code == SQLITE_OK && (flags & SQLITE_OPEN_READWRITE))
        code = store_incoming_add(*db);
    if (code == SQLITE_OK)
        store_cache_add(*db);
    return code == SQLITE_OK ? STORE_OK : refuse_sqlite(opening, *db, "open the database");
}

/* One number or word that a PRAGMA answers with. */
static enum store_status ask(sqlite3 *db, const char *sql, int64_t *number, char **text)
{
    struct stmt stmt = stmt_init(db, sql);

    if (stmt_step(&stmt)) {
        if (number)
            *number = stmt_integer(&stmt, 0);
        if (text)
            *text = stmt_text(&stmt, 0);
    }
    return stmt_fini(&stmt);
}

static enum store_status open_readers(struct opening *opening)
{
    struct store *store = opening->store;
    enum store_status status = STORE_OK;

    while (status == STORE_OK && store->reader_count < STORE_READERS) {
        sqlite3 **db = &store->idle[store->reader_count];

        status = open_connection(opening, SQLITE_OPEN_READONLY, db);
        store->idle_count = ++store->reader_count;
        if (status == STORE_OK && (store_exec(*db, "PRAGMA query_only = ON") ||
                                   store_exec(*db, "PRAGMA wal_autocheckpoint = 0")))
            status = refuse_sqlite(opening, *db, "set up a reader");
    }
    return status;
}

/* --------------------------------------------------------------------- schema */

/* The database as it was, beside it: bcd.sqlite.v1.bak. It has that name only once it is whole and
 * on disk. */
static enum store_status back_up(struct opening *opening, int64_t version)
{
    sqlite3 *db = opening->store->writer;
    char *path = NULL, *partial = NULL;
    enum store_status status = STORE_BROKEN;
    struct stmt stmt;
    int fd;

    if (asprintf(&path, "%s.v%lld.bak", opening->store->path, (long long)version) < 0 ||
        asprintf(&partial, "%s.partial", path) < 0)
        goto cleanup;
    unlink(partial);
    stmt = stmt_init(db, "VACUUM INTO :path");
    stmt_bind_text(&stmt, ":path", partial);
    status = stmt_run(&stmt, NULL);
    if (status)
        goto cleanup;
    fd = open(partial, O_RDWR | O_CLOEXEC);
    if (fd < 0 || fsync(fd) != 0 || rename(partial, path) != 0 || store_sync_dir(opening->dir))
        status = errno == ENOSPC ? STORE_FULL : STORE_BROKEN;
    if (fd >= 0)
        close(fd);
cleanup:
    if (status) {
        if (partial)
            unlink(partial);
        store_refuse(&opening->reason, status,
                     "%s: cannot be backed up before its schema is brought up to date",
                     opening->store->path);
    } else {
        log_write(LOG_LEVEL_INFO, "store_backed_up", LOG_FIELDS(log_text("file", path)));
    }
    free(partial);
    free(path);
    return status;
}

/* One numbered file and its number, together or not at all. */
static enum store_status migrate_one(struct opening *opening, size_t index)
{
    sqlite3 *db;
    enum store_status status = STORE_BEGIN(opening->store, &db);
    char pragmas[96];

    if (status)
        return refuse_sqlite(opening, opening->store->writer, "begin a migration");
    snprintf(pragmas, sizeof pragmas, "PRAGMA application_id = %d; PRAGMA user_version = %zu",
             STORE_APPLICATION_ID, index + 1);
    status = store_exec(db, opening->schema->migrations[index].sql);
    if (status == STORE_OK)
        status = store_exec(db, pragmas);
    status = store_end(opening->store, status);
    if (status)
        return store_refuse(&opening->reason, status,
                            "%s: migration %s failed; nothing was changed", opening->store->path,
                            opening->schema->migrations[index].name);
    log_write(LOG_LEVEL_INFO, "store_migrated",
              LOG_FIELDS(log_text("migration", opening->schema->migrations[index].name)));
    return STORE_OK;
}

/* Whose database this is and how old; an empty file is a new one. */
static enum store_status migrate(struct opening *opening)
{
    sqlite3 *db = opening->store->writer;
    const char *path = opening->store->path;
    int64_t application = 0, version = 0, objects = 0;
    enum store_status status = STORE_OK;

    if (ask(db, "SELECT count(*) FROM sqlite_schema", &objects, NULL) ||
        ask(db, "PRAGMA application_id", &application, NULL) ||
        ask(db, "PRAGMA user_version", &version, NULL))
        return refuse_sqlite(opening, db, "read the database");
    if (application == 0 && version == 0 && objects == 0) {
        version = 0;
    } else if (application != STORE_APPLICATION_ID) {
        return store_refuse(&opening->reason, STORE_CONFLICT, "%s: a database of another program",
                            path);
    } else if (version < 1 || (uint64_t)version > opening->schema->count) {
        return store_refuse(&opening->reason, STORE_CONFLICT,
                            "%s: its schema (version %lld) is newer than this program's (%zu); "
                            "use a newer bcdd",
                            path, (long long)version, opening->schema->count);
    } else if ((size_t)version < opening->schema->count) {
        status = back_up(opening, version);
    }
    for (size_t i = (size_t)version; status == STORE_OK && i < opening->schema->count; i++)
        status = migrate_one(opening, i);
    return status;
}

/* WAL only now: a schema made before it stands in the file itself. */
static enum store_status set_up_writer(struct opening *opening)
{
    sqlite3 *db = opening->store->writer;
    char *mode = NULL, size_limit[64], cache[64];
    int64_t foreign_keys = 0, synchronous = 0;
    enum store_status status = STORE_BROKEN;

    snprintf(size_limit, sizeof size_limit, "PRAGMA journal_size_limit = %d", STORE_WAL_BYTES_KEPT);
    snprintf(cache, sizeof cache, "PRAGMA cache_size = -%d", STORE_CACHE_KIB);
    if (ask(db, "PRAGMA journal_mode = WAL", NULL, &mode) == STORE_OK && mode &&
        strcmp(mode, "wal") == 0 && store_exec(db, "PRAGMA synchronous = FULL") == STORE_OK &&
        store_exec(db, "PRAGMA foreign_keys = ON") == STORE_OK &&
        ask(db, size_limit, NULL, NULL) == STORE_OK && store_exec(db, cache) == STORE_OK &&
        ask(db, "PRAGMA foreign_keys", &foreign_keys, NULL) == STORE_OK &&
        ask(db, "PRAGMA synchronous", &synchronous, NULL) == STORE_OK && foreign_keys == 1 &&
        synchronous == 2)
        status = STORE_OK;
    free(mode);
    return status ? refuse_sqlite(opening, db, "switch to write-ahead logging") : STORE_OK;
}

/* What jobs are found by, where it is missing: all of it after a migration. A schema without it is
 * a test's. */
static enum store_status seal_segments(struct opening *opening)
{
    sqlite3 *db = opening->store->writer;
    int64_t there = 0;
    enum store_status status =
        ask(db, "SELECT count(*) FROM sqlite_schema WHERE name = 'job_segments'", &there, NULL);

    if (status == STORE_OK && there)
        status = STORE_BEGIN(opening->store, &db);
    if (status == STORE_OK && there)
        status = store_end(opening->store, store_segment_seal_all(db));
    return status ? store_refuse(&opening->reason, status,
                                 "%s: the jobs in it cannot be indexed: %s", opening->store->path,
                                 status == STORE_FULL ? "the disk is full"
                                                      : "it is damaged, or the disk is; the log "
                                                        "says what was met")
                  : STORE_OK;
}

/* ---------------------------------------------------------------------- doors */

static struct store *store_create(const char *dir)
{
    struct store *store = calloc(1, sizeof *store);

    if (!store)
        return NULL;
    store->lock_fd = -1;
    store->columns = column_cache_create();
    atomic_init(&store->tally.writable, true);
    atomic_init(&store->large, 0);
    atomic_init(&store->slices, 0);
    atomic_init(&store->unsettled, false);
    pthread_mutex_init(&store->write_mutex, NULL);
    pthread_cond_init(&store->group_ended, NULL);
    atomic_init(&store->joining, 0);
    pthread_mutex_init(&store->read_mutex, NULL);
    pthread_cond_init(&store->read_returned, NULL);
    if (asprintf(&store->path, "%s/bcd.sqlite", dir) < 0) {
        store->path = NULL;
        store_close(store);
        return NULL;
    }
    return store;
}

enum store_status store_open_schema(struct store **store, const char *dir,
                                    const struct store_schema *schema, char *reason, size_t size)
{
    struct opening opening = {store_create(dir), dir, schema, {reason, size}};
    enum store_status status;

    if (!opening.store)
        return store_refuse(&opening.reason, STORE_BROKEN, "out of memory");
    /* Nobody asks SQLite how much memory it uses; counting takes a lock for every piece. Refused
     * where SQLite was used before, which does no harm. */
    sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);
    status = make_dir(&opening);
    if (status == STORE_OK)
        status = check_file_system(&opening);
    if (status == STORE_OK)
        status = take_lock(&opening);
    if (status == STORE_OK)
        store_backup_tidy(opening.store);
    if (status == STORE_OK)
        status = make_file(&opening);
    if (status == STORE_OK)
        status = open_connection(&opening, SQLITE_OPEN_READWRITE, &opening.store->writer);
    if (status == STORE_OK)
        status = migrate(&opening);
    if (status == STORE_OK)
        status = set_up_writer(&opening);
    if (status == STORE_OK)
        status = seal_segments(&opening);
    if (status == STORE_OK)
        status = open_readers(&opening);
    if (status)
        store_close(opening.store);
    else
        *store = opening.store;
    return status;
}

const struct store_schema *store_schema(void)
{
    static const struct store_schema schema = {migrations,
                                               sizeof migrations / sizeof migrations[0]};

    return &schema;
}

enum store_status store_open(struct store **store, const char *dir, char *reason, size_t size)
{
    enum store_status status = store_open_schema(store, dir, store_schema(), reason, size);

    if (status == STORE_OK)
        store_sweeps_resume(*store); /* if it cannot, the log says so, and the next start goes on */
    return status;
}

/* Readers first: the last connection to close checkpoints, and that must be the writer. */
void store_close(struct store *store)
{
    if (!store)
        return;
    for (size_t i = 0; i < store->idle_count; i++) {
        store_cache_drop(store->idle[i]);
        sqlite3_close(store->idle[i]);
    }
    store_cache_drop(store->writer);
    if (sqlite3_close(store->writer) != SQLITE_OK)
        store_fault(store->writer, SQLITE_BUSY, "close");
    if (store->lock_fd >= 0)
        close(store->lock_fd);
    pthread_cond_destroy(&store->read_returned);
    pthread_mutex_destroy(&store->read_mutex);
    pthread_cond_destroy(&store->group_ended);
    pthread_mutex_destroy(&store->write_mutex);
    column_cache_free(store->columns);
    free(store->path);
    free(store);
}
