/* SPDX-License-Identifier: GPL-3.0-or-later
 * Chunks lent to workers elsewhere: who gets which, what a heartbeat and its lack mean, what is
 * taken as a result; and that nothing said in JSON is lost or forged on the way.
 * Waits: for leases to end. */
#include "lease_bench.h"

#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { LEASE_MS = 1000 };
static const struct lease_asker node1 = {"", "node1"}, node2 = {"", "node2"}, node3 = {"", "node3"};

/* What a worker says, through JSON and back. */
static struct lease_word word_of(const struct lease_loan *loan, const struct blob *bytes,
                                 bool ended)
{
    struct lease_word said = {.chunk = loan->chunk,
                              .ticks_done = 3,
                              .ticks_total = 10,
                              .core_seconds = 0.5},
                      heard = {0};
    struct bcd_errors errors = {0};
    if (bytes)
        said.bytes = *bytes;
    snprintf(said.job, sizeof(said.job), "%s", loan->job);
    char *text = lease_json_word(&said, ended);
    assert_true(lease_json_read_word(text, strlen(text), ended, &heard, &errors));
    memcpy(heard.id, loan->id, sizeof(heard.id));
    free(text);
    return heard;
}

static enum lease_answer hear(struct lease_bench *bench, const struct lease_loan *loan, bool let_go)
{
    struct lease_word word = word_of(loan, NULL, false);
    word.let_go = let_go;
    enum lease_answer answer = leases_hear(bench->leases, &word);
    lease_word_fini(&word);
    return answer;
}

/* Takes the tally. */
static enum lease_answer give_back(struct lease_bench *bench, const struct lease_loan *loan,
                                   struct blob *tally)
{
    struct lease_word word = word_of(loan, tally, true);
    enum lease_answer answer = leases_return(bench->leases, &word);
    lease_word_fini(&word);
    blob_fini(tally);
    return answer;
}

static struct lease_counts counts(struct lease_bench *bench)
{
    struct lease_counts found;
    leases_count(bench->leases, &found);
    return found;
}

static void goes_out_and_comes_back(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan, read, second, none;
    struct lease_news news;
    struct bcd_errors errors = {0};
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &node1, &loan), STORE_OK);
    assert_int_equal(leases_take(bench.leases, &node2, &second), STORE_OK);
    assert_int_equal(leases_take(bench.leases, &node3, &none), STORE_NOT_FOUND);
    assert_int_equal(loan.chunk, 0);
    assert_int_equal(second.chunk, 1);
    assert_string_not_equal(loan.id, second.id);

    /* All of it survives JSON, and the worker's scene is the same job. */
    char *text = lease_json_loan(&loan);
    assert_true(lease_json_read_loan(text, strlen(text), &read, &errors));
    assert_string_equal(read.id, loan.id);
    assert_string_equal(read.job, "jtest");
    assert_memory_equal(read.hash, loan.hash, sizeof(read.hash));
    assert_int_equal(read.lease_ms, loan.lease_ms);
    assert_true(read.core_seconds_max == 7.5);
    assert_true(read.bytes_max == 1e9);
    free(text);
    lease_loan_fini(&read);

    assert_int_equal(hear(&bench, &loan, false), LEASE_GO_ON);
    assert_int_equal(bench.done[0], 3);
    assert_int_equal(bench.total[0], 10);
    lease_wait(bench.lease[0], 0, &news);
    assert_false(news.returned);
    assert_true(news.core_seconds == 0.5);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.core_seconds == 0); /* told once */

    struct blob tally = lease_bench_tally(bench.scene, 0),
                other = lease_bench_tally(bench.scene, 0);
    assert_int_equal(give_back(&bench, &loan, &tally), LEASE_GO_ON);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.returned);
    assert_int_equal(news.tally.size, other.size);
    assert_memory_equal(news.tally.bytes, other.bytes, other.size);
    blob_fini(&news.tally);
    blob_fini(&other);
    assert_int_equal(counts(&bench).returned, 1);
    lease_loan_fini(&loan);
    lease_loan_fini(&second);
    lease_bench_stop(&bench);
}

/* The second result of a chunk is compared, before and after the chunk has ended here. */
static void twice(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &node1, &loan), STORE_OK);
    struct blob tally = lease_bench_tally(bench.scene, 0), same = lease_bench_tally(bench.scene, 0);
    struct blob third = lease_bench_tally(bench.scene, 0),
                wrong = lease_bench_tally(bench.scene, 1);
    assert_int_equal(give_back(&bench, &loan, &tally), LEASE_GO_ON);
    assert_int_equal(give_back(&bench, &loan, &same), LEASE_AGAIN);
    assert_int_equal(hear(&bench, &loan, false), LEASE_STOP);
    lease_end(bench.lease[0]);
    bench.lease[0] = NULL;
    assert_int_equal(give_back(&bench, &loan, &third), LEASE_AGAIN);
    assert_int_equal(hear(&bench, &loan, false), LEASE_STOP);
    assert_int_equal(give_back(&bench, &loan, &wrong), LEASE_DIFFERS);
    assert_int_equal(counts(&bench).again, 2);
    assert_int_equal(counts(&bench).differed, 1);
    lease_loan_fini(&loan);
    lease_bench_stop(&bench);
}

static void only_tallies_of_the_chunk_are_taken(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan;
    struct bcd_scene *stranger = experiment_scene(
        "{'particles':4,'length':9,'diameter':1,'time':500,'time_step':0.01,'realizations':64,"
        "'observables':{'energy':{},'msd':{}}}");
    struct lease_news news;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &node1, &loan), STORE_OK);
    struct blob words = {.bytes = strdup("no tally"), .size = 8},
                theirs = lease_bench_tally(stranger, 0);
    struct blob bent = lease_bench_tally(bench.scene, 0);
    ((unsigned char *)bent.bytes)[bent.size / 2] ^= 1;
    assert_int_equal(give_back(&bench, &loan, &words), LEASE_REFUSED);
    assert_int_equal(give_back(&bench, &loan, &theirs), LEASE_REFUSED);
    assert_int_equal(give_back(&bench, &loan, &bent), LEASE_REFUSED);
    lease_wait(bench.lease[0], 0, &news);
    assert_false(news.returned);
    /* The chunk is to be had again. */
    lease_loan_fini(&loan);
    assert_int_equal(leases_take(bench.leases, &node2, &loan), STORE_OK);
    assert_int_equal(loan.chunk, 0);
    assert_int_equal(loan.attempt, 2);
    loan.chunk = 77;
    struct blob good = lease_bench_tally(bench.scene, 0);
    assert_int_equal(give_back(&bench, &loan, &good), LEASE_UNKNOWN);
    lease_loan_fini(&loan);
    bcd_scene_free(stranger);
    lease_bench_stop(&bench);
}

static void silence_ends_a_lease(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan, other, third;
    (void)state;
    lease_bench_start(&bench, LEASE_MS);
    assert_int_equal(leases_take(bench.leases, &node1, &loan), STORE_OK);
    assert_int_equal(leases_take(bench.leases, &node2, &other), STORE_OK);
    for (int i = 0; i < 1000 && counts(&bench).expired == 0; i++) {
        usleep(LEASE_MS * 20);
        assert_int_equal(hear(&bench, &other, false), LEASE_GO_ON);
    }
    assert_int_equal(counts(&bench).expired, 1);
    assert_int_equal(counts(&bench).held, 1);
    assert_int_equal(leases_take(bench.leases, &node3, &third), STORE_OK);
    assert_int_equal(third.chunk, 0);
    assert_int_equal(hear(&bench, &loan, false), LEASE_STOP); /* it is another's now */
    struct blob late = lease_bench_tally(bench.scene, 0), same = lease_bench_tally(bench.scene, 0);
    assert_int_equal(give_back(&bench, &loan, &late), LEASE_GO_ON); /* but bits are bits */
    assert_int_equal(give_back(&bench, &third, &same), LEASE_AGAIN);
    lease_loan_fini(&loan);
    lease_loan_fini(&other);
    lease_loan_fini(&third);
    lease_bench_stop(&bench);
}

/* Late, or after a restart of the daemon: who has what nobody has keeps it. */
static void a_heartbeat_takes_up_what_is_nobodys(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan = {.id = "l0123456789abcdef", .job = "jtest", .chunk = 1}, first, none;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(hear(&bench, &loan, false), LEASE_GO_ON);
    assert_int_equal(leases_take(bench.leases, &node1, &first), STORE_OK);
    assert_int_equal(first.chunk, 0);
    assert_int_equal(leases_take(bench.leases, &node1, &none), STORE_NOT_FOUND);
    struct lease_loan unknown = {.id = "l1", .job = "jother", .chunk = 1};
    assert_int_equal(hear(&bench, &unknown, false), LEASE_UNKNOWN);
    atomic_store(&bench.cancelled, true);
    assert_int_equal(hear(&bench, &loan, false), LEASE_STOP);
    lease_loan_fini(&first);
    lease_bench_stop(&bench);
}

static void a_checkpoint_goes_to_the_next(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan, next;
    struct lease_news news;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &node1, &loan), STORE_OK);
    struct blob saved = {.bytes = strdup("checkpoint"), .size = 10};
    struct lease_word word = word_of(&loan, &saved, false);
    word.let_go = true;
    assert_int_equal(leases_hear(bench.leases, &word), LEASE_GO_ON);
    lease_word_fini(&word);
    lease_wait(bench.lease[0], 0, &news);
    assert_int_equal(news.checkpoint.size, 10);
    assert_memory_equal(news.checkpoint.bytes, "checkpoint", 10);
    blob_fini(&news.checkpoint);
    lease_wait(bench.lease[0], 0, &news);
    assert_int_equal(news.checkpoint.size, 0); /* told once */
    /* A heartbeat from before, which was late, does not take it up again. */
    assert_int_equal(hear(&bench, &loan, false), LEASE_STOP);
    assert_int_equal(counts(&bench).held, 0);
    struct lease_loan old = {.id = "l0123456789abcdef", .job = "jtest", .chunk = 1};
    assert_int_equal(hear(&bench, &old, true), LEASE_GO_ON);
    assert_int_equal(hear(&bench, &old, false), LEASE_STOP);
    assert_int_equal(leases_take(bench.leases, &node2, &next), STORE_OK);
    assert_int_equal(next.chunk, 0);
    assert_int_equal(next.checkpoint.size, 10);
    assert_memory_equal(next.checkpoint.bytes, "checkpoint", 10);
    /* A run that fails twice ends the job. */
    word = word_of(&next, NULL, false);
    word.failed = strdup("no room to start");
    assert_int_equal(leases_hear(bench.leases, &word), LEASE_GO_ON);
    lease_wait(bench.lease[0], 0, &news);
    assert_false(news.failed);
    lease_loan_fini(&next);
    assert_int_equal(leases_take(bench.leases, &node1, &next), STORE_OK);
    memcpy(word.id, next.id, sizeof word.id);
    assert_int_equal(leases_hear(bench.leases, &word), LEASE_GO_ON);
    lease_word_fini(&word);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.failed);
    assert_string_equal(news.error.text, "no room to start");
    blob_fini(&saved);
    lease_loan_fini(&loan);
    lease_loan_fini(&next);
    lease_bench_stop(&bench);
}

static void bytes_with_another_checksum_are_refused(void **state)
{
    struct lease_loan loan = {.id = "l1", .job = "jtest"};
    struct lease_word heard = {0};
    struct bcd_errors errors = {0};
    char bytes[] = "bytes";
    struct lease_word said = {.bytes = {.bytes = bytes, .size = 5}};
    (void)state;
    snprintf(said.job, sizeof(said.job), "%s", loan.job);
    char *text = lease_json_word(&said, true);
    *strstr(text, "Ynl0") = 'Z'; /* another byte */
    assert_false(lease_json_read_word(text, strlen(text), true, &heard, &errors));
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].field, "/sha256");
    lease_word_fini(&heard);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(goes_out_and_comes_back),
        cmocka_unit_test(twice),
        cmocka_unit_test(only_tallies_of_the_chunk_are_taken),
        cmocka_unit_test(silence_ends_a_lease),
        cmocka_unit_test(a_heartbeat_takes_up_what_is_nobodys),
        cmocka_unit_test(a_checkpoint_goes_to_the_next),
        cmocka_unit_test(bytes_with_another_checksum_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
