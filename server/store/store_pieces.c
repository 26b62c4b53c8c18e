/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_pieces.c - see store_pieces.h. */
#include "store_pieces.h"

#include "log.h"
#include "store_internal.h"

#include <assert.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const uint64_t magic = 0x3173636562646362u; /* "bcdbecs1" */

/* The row: this, then a bit for each piece: which of its two places counts. */
struct row {
    uint64_t magic, size;
    unsigned char head[PIECES_HEAD_SIZE];
};

struct pieces {
    struct store *store;
    struct chunk_place place;
    char *path;
    int fd;
    size_t size, count; /* of the checkpoint, head included; pieces */
    bool any, waiting;
    size_t row_size;
    struct row *next;     /* row_size bytes: what is being put */
    unsigned char kept[]; /* a bit for each piece, as in the row */
};

/* ------------------------------------------------------------------- places */

static unsigned char *bits(struct row *row)
{
    return (unsigned char *)(row + 1);
}

static bool bit(const unsigned char *set, size_t i)
{
    return set[i / 8] >> i % 8 & 1;
}

static void set_bit(unsigned char *set, size_t i, bool value)
{
    set[i / 8] = (unsigned char)((set[i / 8] & ~(1U << i % 8)) | (unsigned)value << i % 8);
}

static size_t piece_size(const struct pieces *pieces, size_t piece)
{
    size_t left = pieces->size - PIECES_HEAD_SIZE - piece * PIECES_SIZE;

    return left < PIECES_SIZE ? left : PIECES_SIZE;
}

static off_t offset(const struct pieces *pieces, size_t piece, bool second)
{
    return (off_t)((piece + (second ? pieces->count : 0)) * PIECES_SIZE);
}

/* -------------------------------------------------------------------- files */

static enum store_status why(void)
{
    return errno == ENOSPC || errno == EDQUOT || errno == EFBIG ? STORE_FULL : STORE_BROKEN;
}

static char *file_path(const struct store *store, const struct chunk_place *place)
{
    char name[JOB_ID_SIZE + 40];

    snprintf(name, sizeof name, "checkpoints/%s.%" PRId64, place->id, place->chunk);
    return store_beside(store, name);
}

/* For the owner's eyes only, as everything in the directory. */
static enum store_status make_dir(const struct store *store)
{
    char *path = store_beside(store, "checkpoints"), *above = store_beside(store, ".");
    enum store_status status = STORE_BROKEN;

    if (path && above)
        status = mkdir(path, 0700) == 0 ? store_sync_dir(above)
                 : errno == EEXIST      ? STORE_OK
                                        : why();
    free(path);
    free(above);
    return status;
}

static size_t count_of(size_t size)
{
    return (size - PIECES_HEAD_SIZE + PIECES_SIZE - 1) / PIECES_SIZE;
}

static size_t row_size_of(size_t size)
{
    return sizeof(struct row) + count_of(size) / 8 + 1;
}

static struct pieces *make(struct store *store, const struct chunk_place *place, size_t size)
{
    size_t count = count_of(size);
    struct pieces *pieces = calloc(1, sizeof *pieces + count / 8 + 1);

    assert(size > PIECES_HEAD_SIZE);
    if (!pieces)
        return NULL;
    pieces->store = store;
    pieces->place = *place;
    pieces->fd = -1;
    pieces->size = size;
    pieces->count = count;
    pieces->row_size = row_size_of(size);
    pieces->next = calloc(1, pieces->row_size);
    pieces->path = file_path(store, place);
    if (!pieces->next || !pieces->path) {
        pieces_close(pieces, false);
        return NULL;
    }
    pieces->next->magic = magic;
    pieces->next->size = size;
    return pieces;
}

enum store_status pieces_create(struct pieces **out, struct store *store,
                                const struct chunk_place *place, size_t size)
{
    struct pieces *pieces = make(store, place, size);
    enum store_status status = pieces ? make_dir(store) : STORE_BROKEN;

    if (status == STORE_OK) {
        pieces->fd = open(pieces->path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
        status = pieces->fd >= 0 ? STORE_OK : why();
    }
    if (status == STORE_OK) {
        *out = pieces;
        return STORE_OK;
    }
    pieces_close(pieces, false);
    return status;
}

/* All of what is kept, from where it stands. */
static enum store_status read_all(const struct pieces *pieces, const struct row *row, char *to)
{
    memcpy(to, row->head, sizeof row->head);
    to += sizeof row->head;
    for (size_t i = 0; i < pieces->count; i++) {
        size_t size = piece_size(pieces, i);

        if (pread(pieces->fd, to, size, offset(pieces, i, bit(pieces->kept, i))) != (ssize_t)size)
            return STORE_NOT_FOUND;
        to += size;
    }
    return STORE_OK;
}

enum store_status pieces_open(struct pieces **out, struct store *store,
                              const struct chunk_place *place, const struct blob *row,
                              struct blob *checkpoint)
{
    struct row found;
    struct pieces *pieces;
    enum store_status status = STORE_BROKEN;
    char *bytes = NULL;

    if (row->size < sizeof found)
        return STORE_CONFLICT;
    memcpy(&found, row->bytes, sizeof found);
    if (found.magic != magic || found.size <= PIECES_HEAD_SIZE || found.size > SIZE_MAX / 4 ||
        row_size_of((size_t)found.size) != row->size) /* before so much memory is asked for */
        return STORE_CONFLICT;
    pieces = make(store, place, (size_t)found.size);
    if (!pieces)
        return STORE_BROKEN;
    memcpy(pieces->kept, (const char *)row->bytes + sizeof found, row->size - sizeof found);
    pieces->any = true;
    pieces->fd = open(pieces->path, O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    status = pieces->fd >= 0 ? STORE_OK : STORE_NOT_FOUND;
    if (status == STORE_OK && !(bytes = malloc(pieces->size)))
        status = STORE_BROKEN;
    if (status == STORE_OK)
        status = read_all(pieces, &found, bytes);
    if (status) {
        free(bytes);
        pieces_close(pieces, false);
        return status;
    }
    pieces_forget(pieces);
    *checkpoint = (struct blob){bytes, pieces->size};
    *out = pieces;
    return STORE_OK;
}

void pieces_close(struct pieces *pieces, bool removed)
{
    if (!pieces)
        return;
    if (pieces->fd >= 0) {
        close(pieces->fd);
        if (removed)
            unlink(pieces->path);
    }
    free(pieces->path);
    free(pieces->next);
    free(pieces);
}

/* ------------------------------------------------------------------- putting */

enum store_status pieces_put(struct pieces *pieces, size_t piece, const void *bytes, bool same)
{
    bool second = pieces->any && bit(pieces->kept, piece) == same;
    size_t size = piece_size(pieces, piece), done = 0;

    assert(piece < pieces->count && (!same || pieces->any));
    set_bit(bits(pieces->next), piece, second);
    while (!same && done < size) {
        ssize_t more = pwrite(pieces->fd, (const char *)bytes + done, size - done,
                              offset(pieces, piece, second) + (off_t)done);

        if (more < 0 && errno != EINTR)
            return why();
        done += more > 0 ? (size_t)more : 0;
    }
    return STORE_OK;
}

void pieces_head(struct pieces *pieces, const void *head)
{
    memcpy(pieces->next->head, head, sizeof pieces->next->head);
    pieces->waiting = true;
    sync_file_range(pieces->fd, 0, 0, SYNC_FILE_RANGE_WRITE);
}

bool pieces_any(const struct pieces *pieces)
{
    return pieces->any;
}

bool pieces_waiting(const struct pieces *pieces)
{
    return pieces->waiting;
}

/* The file's name, too. */
static enum store_status sync_all(const struct pieces *pieces)
{
    char *dir;
    enum store_status status;

    if (fdatasync(pieces->fd) != 0)
        return why();
    if (pieces->any)
        return STORE_OK;
    dir = store_beside(pieces->store, "checkpoints");
    status = dir ? store_sync_dir(dir) : STORE_BROKEN;
    free(dir);
    return status;
}

enum store_status pieces_keep(struct pieces *pieces)
{
    enum store_status status = sync_all(pieces);

    assert(pieces->waiting);
    if (status == STORE_OK)
        status = store_results_checkpoint(pieces->store, pieces->place.id, pieces->place.chunk,
                                          pieces->next, pieces->row_size);
    pieces->waiting = false;
    if (status)
        return status;
    memcpy(pieces->kept, bits(pieces->next), pieces->count / 8 + 1);
    pieces->any = true;
    return STORE_OK;
}

void pieces_forget(struct pieces *pieces)
{
    pieces->waiting = false;
}

/* -------------------------------------------------------------------- tidying */

/* "ID.CHUNK" and nothing else: what others have put there stays. */
static bool is_name(const char *name, struct chunk_place *place)
{
    char *at = NULL;
    const char *dot = strchr(name, '.');
    size_t length = dot ? (size_t)(dot - name) : 0;

    if (length < 2 || length >= sizeof place->id || dot[1] < '0' || dot[1] > '9')
        return false;
    memcpy(place->id, name, length);
    place->id[length] = '\0';
    errno = 0;
    place->chunk = strtoll(dot + 1, &at, 10);
    return *at == '\0' && errno == 0;
}

static bool is_wanted(struct store *store, const struct chunk_place *place)
{
    struct blob row = {0};
    enum store_status status = store_results_load_checkpoint(store, place->id, place->chunk, &row);
    bool other = status == STORE_OK &&
                 (row.size < sizeof magic || memcmp(row.bytes, &magic, sizeof magic) != 0);

    blob_fini(&row);
    return status != STORE_NOT_FOUND && !other;
}

void pieces_tidy(struct store *store)
{
    char *path = store_beside(store, "checkpoints");
    DIR *dir = path ? opendir(path) : NULL;
    struct dirent *entry;
    struct chunk_place place;

    while (dir && (entry = readdir(dir)) != NULL) {
        if (!is_name(entry->d_name, &place) || is_wanted(store, &place))
            continue;
        if (unlinkat(dirfd(dir), entry->d_name, 0) == 0)
            log_write(LOG_LEVEL_INFO, "checkpoint_removed",
                      LOG_FIELDS(log_text("file", entry->d_name)));
    }
    if (dir)
        closedir(dir);
    free(path);
}
