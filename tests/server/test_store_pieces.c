/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_pieces.c - store_pieces.h against what it promises. */
#include "job_bench.h"

#include "store_jobs.h"
#include "store_pieces.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

enum { PIECES = 9, LAST = 1000, SIZE = PIECES_HEAD_SIZE + (PIECES - 1) * PIECES_SIZE + LAST };

/* A checkpoint in which piece i is all version[i], and so is the head. */
static char *checkpoint(const char version[PIECES + 1])
{
    char *bytes = malloc(SIZE);

    assert_non_null(bytes);
    memset(bytes, version[0], PIECES_HEAD_SIZE);
    for (size_t i = 0; i < PIECES; i++)
        memset(bytes + PIECES_HEAD_SIZE + i * PIECES_SIZE, version[i],
               i + 1 < PIECES ? PIECES_SIZE : LAST);
    return bytes;
}

/* Puts all of it; those that `before` has alike are told to be the same. */
static enum store_status put(struct pieces *pieces, const char *version, const char *before)
{
    char *bytes = checkpoint(version);
    enum store_status status = STORE_OK;

    for (size_t i = 0; i < PIECES && status == STORE_OK; i++)
        status = pieces_put(pieces, i, bytes + PIECES_HEAD_SIZE + i * PIECES_SIZE,
                            before && before[i] == version[i]);
    if (status == STORE_OK)
        pieces_head(pieces, bytes);
    free(bytes);
    return status;
}

static struct chunk_place begin(struct bench *bench, int tag)
{
    struct chunk_place place = {.chunk = 1};

    bench_insert(bench->store, tag, "{}", place.id);
    assert_int_equal(store_jobs_start(bench->store, place.id), STORE_OK);
    return place;
}

static struct pieces *create(struct bench *bench, const struct chunk_place *place)
{
    struct pieces *pieces = NULL;

    assert_int_equal(pieces_create(&pieces, bench->store, place, SIZE), STORE_OK);
    assert_false(pieces_any(pieces));
    return pieces;
}

/* After whatever came before, as a next start finds it. */
static enum store_status find(struct bench *bench, const struct chunk_place *place,
                              struct pieces **pieces, struct blob *found)
{
    struct blob row = {0};
    enum store_status status;

    bench_reopen(bench);
    assert_int_equal(store_results_load_checkpoint(bench->store, place->id, place->chunk, &row),
                     STORE_OK);
    status = pieces_open(pieces, bench->store, place, &row, found);
    blob_fini(&row);
    return status;
}

static struct pieces *assert_kept(struct bench *bench, const struct chunk_place *place,
                                  const char *version)
{
    struct pieces *pieces = NULL;
    struct blob found = {0};
    char *wanted = checkpoint(version);

    assert_int_equal(find(bench, place, &pieces, &found), STORE_OK);
    assert_int_equal(found.size, SIZE);
    assert_memory_equal(found.bytes, wanted, SIZE);
    assert_true(pieces_any(pieces) && !pieces_waiting(pieces));
    blob_fini(&found);
    free(wanted);
    return pieces;
}

static void path_of(const struct bench *bench, const struct chunk_place *place, char path[512])
{
    snprintf(path, 512, "%s/checkpoints/%s.1", bench->dir, place->id);
}

static void what_changed_is_put(void **state)
{
    struct bench *bench = *state;
    struct chunk_place place = begin(bench, 1);
    struct pieces *pieces = create(bench, &place);
    char path[512];
    struct stat info;

    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_true(pieces_waiting(pieces));
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    path_of(bench, &place, path);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    assert_in_range(info.st_size, 1, PIECES * PIECES_SIZE); /* one place each so far */
    assert_int_equal(put(pieces, "abaaaaaab", "aaaaaaaaa"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    assert_int_equal(put(pieces, "abcaaaaac", "abaaaaaab"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    /* Gone on with after a start, in the same two places. */
    pieces = assert_kept(bench, &place, "abcaaaaac");
    assert_int_equal(put(pieces, "dbcaaaaac", "abcaaaaac"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    assert_int_equal(put(pieces, "dbceeeeee", "dbcaaaaac"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    assert_int_equal(stat(path, &info), 0);
    assert_in_range(info.st_size, 1, 2 * PIECES * PIECES_SIZE);
    pieces = assert_kept(bench, &place, "dbceeeeee");
    pieces_close(pieces, true);
    assert_int_equal(access(path, F_OK), -1);
}

/* Ended at any moment before it is kept, however much was put. */
static void a_cut_leaves_the_one_before(void **state)
{
    struct bench *bench = *state;
    struct chunk_place place = begin(bench, 1);
    struct pieces *pieces = create(bench, &place);
    char piece[PIECES_SIZE];

    memset(piece, 'z', sizeof piece);
    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    for (size_t cut = 0; cut <= PIECES; cut++) {
        for (size_t i = 0; i < cut; i++)
            assert_int_equal(pieces_put(pieces, i, piece, false), STORE_OK);
        pieces_close(pieces, false);
        pieces = assert_kept(bench, &place, "aaaaaaaaa");
    }
    /* All of it was put, and it is thought better of. */
    assert_int_equal(put(pieces, "bbbbbbbbb", "aaaaaaaaa"), STORE_OK);
    pieces_forget(pieces);
    assert_int_equal(put(pieces, "caaaaaaaa", "aaaaaaaaa"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    pieces_close(assert_kept(bench, &place, "caaaaaaaa"), false);
}

static void a_full_disk(void **state)
{
    struct bench *bench = *state;
    struct chunk_place place = begin(bench, 1);
    struct pieces *pieces = create(bench, &place);

    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    job_bench_disk(true);
    assert_int_equal(put(pieces, "bbbbbbbbb", "aaaaaaaaa"), STORE_FULL);
    assert_false(pieces_waiting(pieces));
    job_bench_disk(false);
    pieces_close(pieces, false);
    pieces = assert_kept(bench, &place, "aaaaaaaaa");
    /* The pieces have room and the row has none. */
    assert_int_equal(put(pieces, "bbbbbbbbb", "aaaaaaaaa"), STORE_OK);
    job_bench_disk(true);
    assert_int_equal(pieces_keep(pieces), STORE_FULL);
    job_bench_disk(false);
    assert_int_equal(put(pieces, "ccccccccc", "aaaaaaaaa"), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    pieces_close(assert_kept(bench, &place, "ccccccccc"), false);
}

static void what_cannot_be_read(void **state)
{
    struct bench *bench = *state;
    struct chunk_place place = begin(bench, 1), other = begin(bench, 2);
    struct pieces *pieces = create(bench, &place);
    struct blob found = {0}, row;
    char path[512];

    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    assert_int_equal(store_results_load_checkpoint(bench->store, place.id, 1, &row), STORE_OK);
    assert_int_equal(pieces_open(&pieces, bench->store, &other, &row, &found), STORE_NOT_FOUND);
    /* Rows of nothing that was ever kept in a file. */
    for (size_t size = 0; size < row.size; size++) {
        const struct blob cut = {row.bytes, size};
        assert_int_equal(pieces_open(&pieces, bench->store, &place, &cut, &found), STORE_CONFLICT);
    }
    for (size_t at = 0; at < 16; at++) { /* what it is, and how large */
        ((unsigned char *)row.bytes)[at] ^= 0xff;
        assert_int_not_equal(pieces_open(&pieces, bench->store, &place, &row, &found), STORE_OK);
        ((unsigned char *)row.bytes)[at] ^= 0xff;
    }
    blob_fini(&row);
    path_of(bench, &place, path);
    assert_int_equal(truncate(path, SIZE - PIECES_HEAD_SIZE - 1), 0);
    assert_int_equal(find(bench, &place, &pieces, &found), STORE_NOT_FOUND);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(find(bench, &place, &pieces, &found), STORE_NOT_FOUND);
}

static void touch(const struct bench *bench, const char *name)
{
    char path[512];
    int fd;

    snprintf(path, sizeof path, "%s/checkpoints/%s", bench->dir, name);
    fd = open(path, O_CREAT | O_WRONLY, 0600);
    assert_true(fd >= 0);
    close(fd);
}

static bool there(const struct bench *bench, const char *name)
{
    char path[512];

    snprintf(path, sizeof path, "%s/checkpoints/%s", bench->dir, name);
    return access(path, F_OK) == 0;
}

static void what_nobody_needs_goes(void **state)
{
    struct bench *bench = *state;
    struct chunk_place place = begin(bench, 1), gone = begin(bench, 2);
    struct pieces *pieces;
    static const char *const foreign[] = {"notes.txt", "jabc.1.old", "j", ".1", "jabc.-1", "jabc."};

    pieces_tidy(bench->store); /* no directory yet */
    pieces = create(bench, &place);
    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    pieces = create(bench, &gone);
    assert_int_equal(put(pieces, "aaaaaaaaa", NULL), STORE_OK);
    assert_int_equal(pieces_keep(pieces), STORE_OK);
    pieces_close(pieces, false);
    assert_int_equal(store_jobs_cancel(bench->store, gone.id), STORE_OK);
    touch(bench, "jnone.7");
    for (size_t i = 0; i < sizeof foreign / sizeof foreign[0]; i++)
        touch(bench, foreign[i]);
    pieces_tidy(bench->store);
    assert_false(there(bench, "jnone.7"));
    strcat(gone.id, ".1");
    assert_false(there(bench, gone.id));
    for (size_t i = 0; i < sizeof foreign / sizeof foreign[0]; i++)
        assert_true(there(bench, foreign[i]));
    pieces_close(assert_kept(bench, &place, "aaaaaaaaa"), true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(what_changed_is_put),
        BENCH_TEST(a_cut_leaves_the_one_before),
        BENCH_TEST(a_full_disk),
        BENCH_TEST(what_cannot_be_read),
        BENCH_TEST(what_nobody_needs_goes),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
