/* SPDX-License-Identifier: GPL-3.0-or-later
 * What is kept as bytes: its checksum is the published one, old ones are read, damage is seen, and
 * a checkpoint taken in pieces is the one taken whole. */
#include "blob.h"
#include "kernels/xxh64.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* As xxhsum -H64 prints them; with a seed: of the sanity test of that program (xxHash 0.8),
 * whose bytes are those of fill(). */
static void test_published_sums(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint64_t sum;
    } rows[] = {
        {"", 0xef46db3751d8e999u},
        {"a", 0xd24ec4f1a98c6e5bu},
        {"abc", 0x44bc2cf5ad770999u},
        {"Nobody inspects the spammish repetition", 0xfbcea83c8a378bf1u},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        assert_true(xxh64(rows[i].text, strlen(rows[i].text), 0) == rows[i].sum);
}

static void fill(unsigned char *bytes, size_t size)
{
    uint64_t next = 2654435761u;
    for (size_t i = 0; i < size; i++) {
        bytes[i] = (unsigned char)(next >> 56);
        next *= 11400714785074694797u;
    }
}

static void test_published_sums_with_a_seed(void **state)
{
    (void)state;
    unsigned char bytes[222];
    const uint64_t seed = 2654435761u;
    static const struct {
        size_t size;
        uint64_t plain, seeded;
    } rows[] = {
        {0, 0xef46db3751d8e999u, 0xac75fda2929b17efu},
        {1, 0xe934a84adb052768u, 0x5014607643a9b4c3u},
        {4, 0x9136a0dca57457eeu, 0xcaab286bd8e9fdb5u},
        {14, 0x8282dcc4994e35c8u, 0xc3bd6bf63deb6df0u},
        {222, 0xb641ae8cb691c174u, 0x20cb8ab7ae10c14au},
    };
    fill(bytes, sizeof bytes);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        assert_true(xxh64(bytes, rows[i].size, 0) == rows[i].plain);
        assert_true(xxh64(bytes, rows[i].size, seed) == rows[i].seeded);
    }
}

enum { SIZE = BLOB_HEADER_SIZE + 2 * BLOB_PIECE_SIZE + 100 };

/* As programs before "dbcdb02" sealed: one FNV-1a over header and body. */
static void seal_as_before(unsigned char *bytes, size_t size, uint64_t identity)
{
    const uint32_t kind = BLOB_TABLE, version = BCD_RESULT_VERSION;
    const uint64_t words[] = {0, identity, size, 0, 0};
    memset(bytes, 0, BLOB_HEADER_SIZE);
    memcpy(bytes, "dbcdb01", 8);
    memcpy(bytes + 8, &kind, 4);
    memcpy(bytes + 12, &version, 4);
    memcpy(bytes + 16, words + 1, 16);
    uint64_t sum = blob_hash(bytes, size, BLOB_HASH_START);
    memcpy(bytes + 32, &sum, 8);
}

static void refuse_every_damage(unsigned char *bytes)
{
    for (size_t at = 0; at < SIZE; at += at < 64 ? 1 : 4099) {
        for (int bit = 0; bit < 8; bit++) {
            bytes[at] ^= (unsigned char)(1u << bit);
            assert_int_equal(blob_check(bytes, BLOB_TABLE, 7, SIZE, NULL), BCD_CORRUPT);
            bytes[at] ^= (unsigned char)(1u << bit);
        }
    }
    assert_int_equal(blob_check(bytes, BLOB_TABLE, 7, SIZE - 1, NULL), BCD_CORRUPT);
    assert_int_equal(blob_check(bytes, BLOB_TABLE, 8, SIZE, NULL), BCD_CORRUPT);
    assert_int_equal(blob_check(bytes, BLOB_TABLE, 7, SIZE, NULL), BCD_OK);
}

static void test_damage(void **state)
{
    (void)state;
    unsigned char *bytes = malloc(SIZE);
    fill(bytes, SIZE);
    blob_seal(bytes, BLOB_TABLE, 7, SIZE);
    refuse_every_damage(bytes);
    /* Two pieces in each other's place are none of it. */
    unsigned char *piece = malloc(BLOB_PIECE_SIZE), *body = bytes + BLOB_HEADER_SIZE;
    memcpy(piece, body, BLOB_PIECE_SIZE);
    memcpy(body, body + BLOB_PIECE_SIZE, BLOB_PIECE_SIZE);
    memcpy(body + BLOB_PIECE_SIZE, piece, BLOB_PIECE_SIZE);
    assert_int_equal(blob_check(bytes, BLOB_TABLE, 7, SIZE, NULL), BCD_CORRUPT);
    free(piece);
    free(bytes);
}

static void test_what_was_written_before(void **state)
{
    (void)state;
    unsigned char *bytes = malloc(SIZE);
    fill(bytes, SIZE);
    seal_as_before(bytes, SIZE, 7);
    refuse_every_damage(bytes);
    free(bytes);
}

/* A run of several pieces; what has not changed since is told by its sums. */
static void test_pieces_are_the_whole(void **state)
{
    (void)state;
    struct bcd_scene *scene = experiment_scene(
        "{'particles':3000,'length':6000,'diameter':0.5,'time':30,'time_step':0.001,"
        "'observables':{'msd':{'first':0.001,'last':20,'points':20},'energy':{}}}");
    struct bcd_run *run = NULL;
    assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
    const size_t size = bcd_run_checkpoint_size(run), count = bcd_run_checkpoint_pieces(run);
    assert_true(count >= 4 && (count - 1) * BCD_CHECKPOINT_PIECE < size);
    unsigned char *whole = malloc(size), *joined = malloc(size);
    uint64_t *sums = calloc(count, sizeof *sums), *before = calloc(count, sizeof *before);
    size_t same = 0, other = 0;
    for (int round = 0; round < 3; round++) {
        assert_int_equal(bcd_run_advance(run, 100, NULL), BCD_OK);
        memcpy(before, sums, count * sizeof *sums);
        bcd_run_save(run, whole);
        bcd_run_checkpoint_head(run, joined, sums);
        for (size_t i = 0, at = BCD_CHECKPOINT_HEAD; i < count; i++) {
            size_t bytes;
            const void *piece = bcd_run_checkpoint_piece(run, i, &bytes);
            bool changed = sums[i] != before[i];
            assert_true(at + bytes <= size && (i + 1 < count || at + bytes == size));
            if (changed || round == 0) /* else those of the round before stand there */
                memcpy(joined + at, piece, bytes);
            same += !changed, other += changed;
            at += bytes;
        }
        assert_memory_equal(whole, joined, size);
    }
    assert_true(same > 0 && other > 0);
    assert_int_equal(bcd_run_restore(run, joined, size, NULL), BCD_OK);
    free(whole), free(joined), free(sums), free(before);
    bcd_run_free(run);
    bcd_scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_published_sums),
        cmocka_unit_test(test_published_sums_with_a_seed),
        cmocka_unit_test(test_damage),
        cmocka_unit_test(test_what_was_written_before),
        cmocka_unit_test(test_pieces_are_the_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
