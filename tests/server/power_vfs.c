/* SPDX-License-Identifier: GPL-3.0-or-later
 * power_vfs.c - see power_vfs.h. */
#include "power_vfs.h"

#include "store_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FILES_MAX = 32, PENDING_MAX = 4096, SECTOR = 512, WRITERS_MAX = 64 };

/* A write, or with bytes NULL a cut to `at`. */
struct pending {
    int64_t at;
    size_t size;
    char *bytes;
};

/* One name on the disk. */
struct disk {
    char path[512];
    char *image; /* as of the last sync */
    size_t size;
    bool deleted; /* and the directory not synced since */
    bool made;    /* likewise */
    struct pending pending[PENDING_MAX];
    size_t count;
};

struct power_file {
    sqlite3_file base;
    struct disk *disk;
    sqlite3_file *real;
};

static struct {
    sqlite3_vfs vfs, *below;
    sqlite3_io_methods methods;
    enum power_fault fault;
    int64_t k, calls;
    bool met, dead;
    struct disk *files[FILES_MAX];
    const void *writers[WRITERS_MAX];
    int writer_count;
} power;

/* ---------------------------------------------------------------------- faults */

enum call { CALL_LOOK, CALL_CHANGE, CALL_ROOM };

/* What the fault makes of a call: SQLITE_OK = nothing. `error` = what it would be. */
static int meet(enum call call, int error)
{
    bool counts = power.fault == POWER_CUT       ? call != CALL_LOOK
                  : power.fault == POWER_FULL_ON ? call == CALL_ROOM
                                                 : power.fault != POWER_NONE;

    if (power.dead)
        return error;
    if (!counts || ++power.calls < power.k)
        return SQLITE_OK;
    if (power.fault == POWER_EIO && power.calls > power.k)
        return SQLITE_OK;
    power.met = true;
    power.dead = power.fault == POWER_CUT;
    return power.fault == POWER_FULL_ON ? SQLITE_FULL : error;
}

void power_vfs_arm(enum power_fault fault, int64_t k)
{
    power.fault = fault;
    power.k = k;
    power.calls = 0;
    power.met = false;
}

bool power_vfs_met(void)
{
    return power.met;
}

/* ------------------------------------------------------------------------ disk */

static void drop_pending(struct disk *disk)
{
    for (size_t i = 0; i < disk->count; i++)
        free(disk->pending[i].bytes);
    disk->count = 0;
}

/* What stands in the file now is what is on disk. */
static void sync_disk(struct disk *disk)
{
    FILE *file = fopen(disk->path, "rb");

    drop_pending(disk);
    free(disk->image);
    disk->image = NULL;
    disk->size = 0;
    if (!file)
        return;
    fseek(file, 0, SEEK_END);
    disk->size = (size_t)ftell(file);
    rewind(file);
    disk->image = malloc(disk->size + 1);
    if (!disk->image || fread(disk->image, 1, disk->size, file) != disk->size)
        abort();
    fclose(file);
}

static struct disk *disk_of(const char *path)
{
    size_t i = 0;

    while (i < FILES_MAX && power.files[i] && strcmp(power.files[i]->path, path) != 0)
        i++;
    if (i == FILES_MAX)
        abort();
    if (!power.files[i]) {
        power.files[i] = calloc(1, sizeof *power.files[i]);
        if (!power.files[i])
            abort();
        snprintf(power.files[i]->path, sizeof power.files[i]->path, "%s", path);
        sync_disk(power.files[i]);
    }
    return power.files[i];
}

static void remember(struct disk *disk, int64_t at, const void *bytes, size_t size)
{
    struct pending *pending = &disk->pending[disk->count++];

    if (disk->count == PENDING_MAX)
        abort();
    *pending = (struct pending){.at = at, .size = size, .bytes = bytes ? malloc(size + 1) : NULL};
    if (bytes)
        memcpy(pending->bytes, bytes, size);
}

static uint64_t roll(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005U + 1442695040888963407U;
    return *seed >> 33;
}

/* One unsynced write as the power cut left it. */
static void apply(const struct pending *pending, FILE *file, uint64_t *seed)
{
    uint64_t fate = roll(seed) % 3;

    if (!pending->bytes) {
        if (fate && ftruncate(fileno(file), pending->at) != 0)
            abort();
        return;
    }
    for (size_t done = 0; done < pending->size; done += SECTOR) {
        size_t left = pending->size - done;

        if (fate == 0 || (fate == 1 && roll(seed) % 2))
            continue;
        fseek(file, pending->at + (int64_t)done, SEEK_SET);
        fwrite(pending->bytes + done, 1, left < SECTOR ? left : SECTOR, file);
    }
    fflush(file);
}

void power_vfs_restore(uint64_t seed)
{
    for (size_t i = 0; i < FILES_MAX && power.files[i]; i++) {
        struct disk *disk = power.files[i];
        bool gone = access(disk->path, F_OK) != 0;
        FILE *file;

        if (gone && !(disk->deleted && roll(&seed) % 2))
            continue;
        file = fopen(disk->path, "wb");
        if (!file)
            abort();
        fwrite(disk->image ? disk->image : "", 1, disk->size, file);
        fflush(file);
        for (size_t p = 0; p < disk->count; p++)
            apply(&disk->pending[p], file, &seed);
        fclose(file);
    }
    power.dead = false;
    power_vfs_arm(POWER_NONE, 0);
    power_vfs_forget();
}

void power_vfs_forget(void)
{
    for (size_t i = 0; i < FILES_MAX && power.files[i]; i++) {
        drop_pending(power.files[i]);
        free(power.files[i]->image);
        free(power.files[i]);
        power.files[i] = NULL;
    }
    power.writer_count = 0;
}

int power_vfs_writers(void)
{
    return power.writer_count;
}

/* ----------------------------------------------------------------------- files */

static sqlite3_file *real_of(sqlite3_file *file)
{
    return ((struct power_file *)file)->real;
}

static struct disk *disk_behind(sqlite3_file *file)
{
    return ((struct power_file *)file)->disk;
}

static int power_close(sqlite3_file *file)
{
    return real_of(file)->pMethods->xClose(real_of(file));
}

static int power_read(sqlite3_file *file, void *to, int size, sqlite3_int64 at)
{
    int code = meet(CALL_LOOK, SQLITE_IOERR_READ);

    return code ? code : real_of(file)->pMethods->xRead(real_of(file), to, size, at);
}

static int power_write(sqlite3_file *file, const void *from, int size, sqlite3_int64 at)
{
    struct disk *disk = disk_behind(file);
    int code = meet(CALL_ROOM, SQLITE_IOERR_WRITE);

    /* What is being written when the power goes may be on disk, in part. */
    if (disk && (!code || power.met) && power.fault == POWER_CUT)
        remember(disk, at, from, (size_t)size);
    return code ? code : real_of(file)->pMethods->xWrite(real_of(file), from, size, at);
}

static int power_truncate(sqlite3_file *file, sqlite3_int64 size)
{
    int code = meet(CALL_CHANGE, SQLITE_IOERR_TRUNCATE);

    if (!code && disk_behind(file) && power.fault == POWER_CUT)
        remember(disk_behind(file), size, NULL, 0);
    return code ? code : real_of(file)->pMethods->xTruncate(real_of(file), size);
}

static bool ends_with(const char *path, const char *end)
{
    size_t a = strlen(path), b = strlen(end);

    return a >= b && strcmp(path + a - b, end) == 0;
}

static void sync_dir(void)
{
    for (size_t i = 0; i < FILES_MAX && power.files[i]; i++)
        power.files[i]->made = power.files[i]->deleted = false;
}

/* Nothing really waits for a disk here. With the first sync of a journal or log that is new SQLite
 * syncs the directory, too. */
static int power_sync(sqlite3_file *file, int flags)
{
    int code = meet(CALL_CHANGE, SQLITE_IOERR_FSYNC);

    (void)flags;
    if (code || !disk_behind(file) || power.fault != POWER_CUT)
        return code;
    sync_disk(disk_behind(file));
    if (disk_behind(file)->made && !ends_with(disk_behind(file)->path, ".sqlite"))
        sync_dir();
    return SQLITE_OK;
}

static int power_size(sqlite3_file *file, sqlite3_int64 *size)
{
    int code = meet(CALL_LOOK, SQLITE_IOERR_FSTAT);

    return code ? code : real_of(file)->pMethods->xFileSize(real_of(file), size);
}

static int power_lock(sqlite3_file *file, int level)
{
    return real_of(file)->pMethods->xLock(real_of(file), level);
}

static int power_unlock(sqlite3_file *file, int level)
{
    return real_of(file)->pMethods->xUnlock(real_of(file), level);
}

static int power_check(sqlite3_file *file, int *reserved)
{
    return real_of(file)->pMethods->xCheckReservedLock(real_of(file), reserved);
}

static int power_control(sqlite3_file *file, int what, void *argument)
{
    return real_of(file)->pMethods->xFileControl(real_of(file), what, argument);
}

static int power_sector(sqlite3_file *file)
{
    (void)file;
    return SECTOR;
}

/* A disk that promises nothing. */
static int power_traits(sqlite3_file *file)
{
    (void)file;
    return 0;
}

static int power_shm_map(sqlite3_file *file, int page, int size, int extend, void volatile **to)
{
    int code = meet(extend ? CALL_ROOM : CALL_LOOK, SQLITE_IOERR_SHMMAP);

    return code ? code : real_of(file)->pMethods->xShmMap(real_of(file), page, size, extend, to);
}

/* Slots 0 and 1 of a write-ahead log are the rights to write and to checkpoint (sqlite.org/wal). */
static int power_shm_lock(sqlite3_file *file, int slot, int count, int flags)
{
    int code = real_of(file)->pMethods->xShmLock(real_of(file), slot, count, flags);
    int i = 0;

    if (code || slot > 1 || !(flags & SQLITE_SHM_EXCLUSIVE) || !(flags & SQLITE_SHM_LOCK))
        return code;
    while (i < power.writer_count && power.writers[i] != file)
        i++;
    if (i == power.writer_count && i < WRITERS_MAX)
        power.writers[power.writer_count++] = file;
    return code;
}

static void power_shm_barrier(sqlite3_file *file)
{
    real_of(file)->pMethods->xShmBarrier(real_of(file));
}

static int power_shm_unmap(sqlite3_file *file, int delete)
{
    return real_of(file)->pMethods->xShmUnmap(real_of(file), delete);
}

/* ------------------------------------------------------------------------- vfs */

static int power_open(sqlite3_vfs *vfs, const char *path, sqlite3_file *file, int flags, int *out)
{
    struct power_file *opened = (struct power_file *)file;
    int code = meet(flags & SQLITE_OPEN_CREATE ? CALL_ROOM : CALL_LOOK, SQLITE_CANTOPEN);

    (void)vfs;
    *opened = (struct power_file){.real = (sqlite3_file *)(opened + 1)};
    bool there = path && access(path, F_OK) == 0;
    if (!code)
        code = power.below->xOpen(power.below, path, opened->real, flags, out);
    if (code)
        return code;
    opened->disk = path && power.fault == POWER_CUT ? disk_of(path) : NULL;
    if (opened->disk && !there) { /* made anew: what a file of this name held before is gone */
        opened->disk->deleted = false;
        opened->disk->made = true;
        sync_disk(opened->disk);
    }
    opened->base.pMethods = &power.methods;
    return SQLITE_OK;
}

static int power_delete(sqlite3_vfs *vfs, const char *path, int sync_dir)
{
    int code = meet(CALL_CHANGE, SQLITE_IOERR_DELETE);

    (void)vfs;
    if (!code && power.fault == POWER_CUT)
        disk_of(path)->deleted = !sync_dir;
    return code ? code : power.below->xDelete(power.below, path, 0);
}

static int power_access(sqlite3_vfs *vfs, const char *path, int flags, int *result)
{
    int code = meet(CALL_LOOK, SQLITE_IOERR_ACCESS);

    (void)vfs;
    return code ? code : power.below->xAccess(power.below, path, flags, result);
}

void power_vfs_register(void)
{
    power.below = sqlite3_vfs_find(NULL);
    power.vfs = *power.below; /* time, randomness, full names: as below */
    power.vfs.zName = "power";
    power.vfs.szOsFile = (int)sizeof(struct power_file) + power.below->szOsFile;
    power.vfs.xOpen = power_open;
    power.vfs.xDelete = power_delete;
    power.vfs.xAccess = power_access;
    power.methods = (sqlite3_io_methods){
        2,
        power_close,
        power_read,
        power_write,
        power_truncate,
        power_sync,
        power_size,
        power_lock,
        power_unlock,
        power_check,
        power_control,
        power_sector,
        power_traits,
        power_shm_map,
        power_shm_lock,
        power_shm_barrier,
        power_shm_unmap,
        NULL,
        NULL,
    };
    sqlite3_vfs_register(&power.vfs, 1);
}
