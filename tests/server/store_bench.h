/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_bench.h - a store in a directory of its own, for the tests of store*.c and what stands on
 * it. */
#ifndef STORE_BENCH_H
#define STORE_BENCH_H

#include "temp_dir.h"

#include "store_results.h"

struct bench {
    char dir[TEMP_DIR_SIZE];
    struct store *store;
};

/* Group and test fixtures of cmocka: *state is a struct bench. */
int bench_set_up(void **state);
int bench_tear_down(void **state);
#define BENCH_TEST(function)                                                                       \
    cmocka_unit_test_setup_teardown(function, bench_set_up, bench_tear_down)

/* Closes the store and opens it again. */
void bench_reopen(struct bench *bench);

/* A job of three chunks whose hash is all `tag`. */
struct job_new bench_job(int tag, const char *text);
/* Inserts it; it must be new. */
void bench_insert(struct store *store, int tag, const char *text, char id[JOB_ID_SIZE]);

enum job_state bench_state(struct store *store, const char *id);
int64_t bench_chunks_done(struct store *store, const char *id);
void bench_assert_blob(const struct blob *blob, const char *text);
void bench_assert_counts(struct store *store, const int64_t expected[JOB_STATES]);

/* One number that a statement answers with, on the writing connection. */
int64_t bench_number(struct store *store, const char *sql);

#endif
