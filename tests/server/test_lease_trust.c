/* SPDX-License-Identifier: GPL-3.0-or-later
 * Workers that cannot be trusted: who speaks for chunks that are not theirs, says what cannot be,
 * or gives back what is no result.
 * Waits: for leases to end. */
#include "lease_bench.h"

#include "limits.h"

#include <math.h>
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
static const struct lease_asker ada = {"ada", "ada:1"}, ada_too = {"ada", "ada:2"},
                                bob = {"bob", "bob:1"};

/* What somebody says of a chunk, without JSON. */
static struct lease_word word_of(const struct lease_loan *loan, const char *owner)
{
    struct lease_word word = {.chunk = loan->chunk, .ticks_done = 1, .ticks_total = 2};
    snprintf(word.id, sizeof(word.id), "%s", loan->id);
    snprintf(word.job, sizeof(word.job), "%s", loan->job);
    snprintf(word.owner, sizeof(word.owner), "%s", owner);
    return word;
}

static enum lease_answer give_back(struct lease_bench *bench, const struct lease_loan *loan,
                                   const char *owner, int64_t chunk)
{
    struct lease_word word = word_of(loan, owner);
    word.bytes = lease_bench_tally(bench->scene, chunk);
    enum lease_answer answer = leases_return(bench->leases, &word);
    lease_word_fini(&word);
    return answer;
}

static enum lease_answer hear(struct lease_bench *bench, const struct lease_word *word)
{
    return leases_hear(bench->leases, word);
}

static struct lease_counts counts(struct lease_bench *bench)
{
    struct lease_counts found;
    leases_count(bench->leases, &found);
    return found;
}

static void nobody_speaks_for_anothers_chunk(void **state)
{
    struct lease_bench bench;
    struct lease_loan mine, other, guessed;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &ada, &mine), STORE_OK);
    assert_int_equal(leases_take(bench.leases, &ada_too, &other), STORE_OK);

    /* With the lease's id and another's token; with a lease of another chunk; with a guess. */
    struct lease_word stolen = word_of(&mine, "bob"), mixed = word_of(&mine, "ada");
    stolen.failed = (char[]){"I do not like this job"};
    assert_int_equal(hear(&bench, &stolen), LEASE_STOP);
    mixed.chunk = other.chunk;
    mixed.let_go = true;
    assert_int_equal(hear(&bench, &mixed), LEASE_STOP);
    guessed = mine;
    snprintf(guessed.id, sizeof(guessed.id), "l0123456789abcdef");
    assert_int_equal(give_back(&bench, &mine, "bob", 0), LEASE_STOP);
    assert_int_equal(give_back(&bench, &guessed, "ada", 0), LEASE_STOP);
    struct lease_loan crossed = other;
    crossed.chunk = mine.chunk;
    assert_int_equal(give_back(&bench, &crossed, "ada", 1), LEASE_STOP);
    assert_int_equal(counts(&bench).unwanted, 3);
    assert_int_equal(counts(&bench).held, 2);
    assert_int_equal(counts(&bench).returned, 0);

    assert_int_equal(give_back(&bench, &mine, "ada", 0), LEASE_GO_ON);
    assert_int_equal(give_back(&bench, &other, "ada", 1), LEASE_GO_ON);
    lease_loan_fini(&mine);
    lease_loan_fini(&other);
    lease_bench_stop(&bench);
}

/* An attempt that is over may still be heard, and its result taken: it is its bits that count. But
 * who was never given the chunk gets nothing from its being free. */
static void only_earlier_attempts_come_late(void **state)
{
    struct lease_bench bench;
    struct lease_loan first, second, stranger;
    (void)state;
    lease_bench_start(&bench, LEASE_MS);
    assert_int_equal(leases_take(bench.leases, &ada, &first), STORE_OK);
    for (int i = 0; i < 1000 && counts(&bench).expired == 0; i++)
        usleep(LEASE_MS * 20);
    assert_int_equal(counts(&bench).expired, 1);
    stranger = first;
    snprintf(stranger.id, sizeof(stranger.id), "l0123456789abcdef");
    struct lease_word word = word_of(&stranger, "ada");
    assert_int_equal(hear(&bench, &word), LEASE_STOP);
    assert_int_equal(give_back(&bench, &stranger, "ada", 0), LEASE_STOP);
    assert_int_equal(leases_take(bench.leases, &bob, &second), STORE_OK);
    assert_int_equal(second.chunk, first.chunk);
    assert_int_equal(second.attempt, 2);
    assert_int_equal(give_back(&bench, &first, "bob", 0), LEASE_STOP); /* with its own token */
    assert_int_equal(give_back(&bench, &first, "ada", 0), LEASE_GO_ON);
    assert_int_equal(give_back(&bench, &second, "bob", 0), LEASE_AGAIN);
    lease_loan_fini(&first);
    lease_loan_fini(&second);
    lease_bench_stop(&bench);
}

static void nobody_uses_more_than_the_time_gives(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan, before = {.id = "l1", .job = "jtest", .chunk = 1};
    struct lease_news news;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(leases_take(bench.leases, &ada, &loan), STORE_OK);
    struct lease_word word = word_of(&loan, "ada");
    word.core_seconds = 1e300;
    assert_int_equal(hear(&bench, &word), LEASE_GO_ON);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.core_seconds > 0 && news.core_seconds < 5);
    word.core_seconds = INFINITY;
    assert_int_equal(hear(&bench, &word), LEASE_GO_ON);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.core_seconds < 5);

    /* Of a chunk that it has since before the daemon was started, the use till now was told. */
    word = word_of(&before, "ada");
    word.core_seconds = 3600;
    assert_int_equal(hear(&bench, &word), LEASE_GO_ON);
    lease_wait(bench.lease[1], 0, &news);
    assert_true(news.core_seconds < 5);
    lease_loan_fini(&loan);
    lease_bench_stop(&bench);
}

/* One machine that is broken fails no job; and it is not given the same chunk again at once. */
static void a_failure_wants_a_second_opinion(void **state)
{
    struct lease_bench bench;
    struct lease_loan loan, other, again;
    struct lease_news news;
    (void)state;
    lease_bench_start(&bench, 0);
    assert_int_equal(LIMIT_LEASE_FAILURES, 2);
    assert_int_equal(leases_take(bench.leases, &ada, &loan), STORE_OK);
    struct lease_word word = word_of(&loan, "ada");
    word.failed = (char[]){"a bit has fallen over"};
    assert_int_equal(hear(&bench, &word), LEASE_GO_ON);
    lease_wait(bench.lease[0], 0, &news);
    assert_false(news.failed);
    assert_int_equal(leases_take(bench.leases, &ada, &other), STORE_OK);
    assert_int_equal(other.chunk, 1);
    assert_int_equal(leases_take(bench.leases, &ada, &again), STORE_NOT_FOUND);
    assert_int_equal(leases_take(bench.leases, &ada_too, &again), STORE_OK);
    assert_int_equal(again.chunk, 0);

    /* What is no result counts like a run that failed. */
    struct lease_word rubbish = word_of(&again, "ada");
    rubbish.bytes = (struct blob){.bytes = strdup("rubbish"), .size = 7};
    assert_int_equal(leases_return(bench.leases, &rubbish), LEASE_REFUSED);
    lease_wait(bench.lease[0], 0, &news);
    assert_true(news.failed);
    assert_non_null(strstr(news.error.text, "no result"));
    lease_word_fini(&rubbish);
    lease_loan_fini(&loan);
    lease_loan_fini(&other);
    lease_loan_fini(&again);
    lease_bench_stop(&bench);
}

/* Each as text, and what is said about it. */
static void words_that_are_none_are_refused(void **state)
{
    static const struct {
        const char *text, *pointer;
    } bad[] = {
        {"{", ""},
        {"[]", ""},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':'AA==','sha256':'00'}", "/sha256"},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':'AA=','sha256':'00'}", "/tally"},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':'AB==','sha256':'00'}", "/tally"},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':7,'sha256':'00'}", "/tally"},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':'','sha256':'00'}", "/tally"},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':null,'sha256':'00'}", "/tally"},
        {"{'job':'j','chunk':-1,'core_seconds':1,'tally':'AA==','sha256':'00'}", "/chunk"},
        {"{'job':'j','chunk':0.5,'core_seconds':1,'tally':'AA==','sha256':'00'}", "/chunk"},
        {"{'job':'../etc','chunk':0,'core_seconds':1,'tally':'AA==','sha256':'00'}", "/job"},
        {"{'job':'j','chunk':0,'core_seconds':-1,'tally':'AA==','sha256':'00'}", "/core_seconds"},
        {"{'job':'j','chunk':0,'core_seconds':NaN,'tally':'AA==','sha256':'00'}", ""},
        {"{'job':'j','chunk':0,'core_seconds':1e999,'tally':'AA==','sha256':'00'}", ""},
        {"{'job':'j','chunk':0,'chunk':1,'core_seconds':1,'tally':'AA==','sha256':'00'}", ""},
        {"{'job':'j','chunk':0,'core_seconds':1,'tally':'AA==','sha256':'00','x':1}", "/x"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof(bad) / sizeof(*bad); i++) {
        struct bcd_errors errors = {0};
        struct lease_word word = {0};
        char *text = strdup(bad[i].text);
        bool named = false;
        for (char *at = text; *at; at++)
            *at = *at == '\'' ? '"' : *at;
        assert_false(lease_json_read_word(text, strlen(text), true, &word, &errors));
        assert_true(errors.count > 0);
        for (size_t k = 0; k < errors.count; k++)
            named =
                named || !bad[i].pointer[0] || strcmp(errors.items[k].field, bad[i].pointer) == 0;
        if (!named)
            fail_msg("%s: %s", bad[i].text, errors.items[0].field);
        lease_word_fini(&word);
        free(text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nobody_speaks_for_anothers_chunk),
        cmocka_unit_test(only_earlier_attempts_come_late),
        cmocka_unit_test(nobody_uses_more_than_the_time_gives),
        cmocka_unit_test(a_failure_wants_a_second_opinion),
        cmocka_unit_test(words_that_are_none_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
