/* SPDX-License-Identifier: GPL-3.0-or-later
 * crew.c: every part of every share is done once, whoever comes late, leaves or sleeps, and nobody
 * is left waiting. */
#include "crew.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

#include <cmocka.h>

enum { HELPERS = 3, SHARES = 1000000, PARTS_MAX = 9, TERMS = 300 };

struct work {
    struct crew *crew;
    atomic_bool over;
    atomic_int done[PARTS_MAX]; /* how often, since the leader looked last */
    atomic_int beyond;          /* parts that there are none of */
    int64_t parts;
};

static void count_part(void *of, int64_t part)
{
    struct work *work = of;
    if (part < 0 || part >= work->parts)
        atomic_fetch_add(&work->beyond, 1);
    else
        atomic_fetch_add(&work->done[part], 1);
}

static bool is_over(void *context)
{
    struct work *work = context;
    return atomic_load(&work->over);
}

static void *helper(void *context)
{
    struct work *work = context;
    while (!is_over(work))
        if (!crew_help(work->crew, is_over, work))
            nanosleep(&(struct timespec){.tv_nsec = 10000}, NULL);
    return NULL;
}

/* True = each part was done once. */
static bool share(struct work *work, const struct bcd_hands *hands, int64_t parts)
{
    bool right = true;
    work->parts = parts;
    hands->share(hands->context, count_part, work, parts);
    for (int i = 0; i < PARTS_MAX; i++)
        right &= atomic_exchange(&work->done[i], 0) == (i < parts);
    return right && atomic_load(&work->beyond) == 0;
}

static int setup(void **state)
{
    struct work *work = calloc(1, sizeof(*work));
    work->crew = crew_create(2);
    *state = work;
    return work->crew ? 0 : -1;
}

static int teardown(void **state)
{
    struct work *work = *state;
    crew_free(work->crew);
    free(work);
    return 0;
}

static void begin(struct work *work, pthread_t threads[HELPERS])
{
    atomic_store(&work->over, false);
    for (int i = 0; i < HELPERS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, helper, work), 0);
}

static void end(struct work *work, pthread_t threads[HELPERS])
{
    atomic_store(&work->over, true);
    for (int i = 0; i < HELPERS; i++)
        assert_int_equal(pthread_join(threads[i], NULL), 0);
    assert_int_equal(crew_helpers(work->crew), 0);
}

/* Shares of few parts and of many in turns: who has missed the end of one must not take the next
 * one's parts for what is left of it. */
static void each_part_is_done_once(void **state)
{
    struct work *work = *state;
    pthread_t threads[HELPERS];
    struct crew_lead *lead = crew_lead(work->crew, "j", 0);
    int wrong = 0;
    assert_non_null(lead);
    begin(work, threads);
    for (int i = 0; i < SHARES; i++)
        wrong += !share(work, crew_hands(lead), i % 2 == 0 ? 1 : PARTS_MAX - i % 5);
    crew_end(lead);
    end(work, threads);
    assert_int_equal(wrong, 0);
}

/* Places are given back, and helpers of one leader do nothing of the next one's by mistake. */
static void leaders_come_and_go(void **state)
{
    struct work *work = *state;
    pthread_t threads[HELPERS];
    int wrong = 0;
    begin(work, threads);
    for (int term = 0; term < TERMS; term++) {
        struct crew_lead *lead = crew_lead(work->crew, "j", term);
        assert_non_null(lead);
        for (int i = 0; i < 20; i++)
            wrong += !share(work, crew_hands(lead), 1 + (term + i) % PARTS_MAX);
        crew_end(lead);
    }
    end(work, threads);
    assert_int_equal(wrong, 0);
}

static void there_are_so_many_places(void **state)
{
    struct work *work = *state;
    struct crew_lead *one = crew_lead(work->crew, "j", 0), *two = crew_lead(work->crew, "j", 1);
    assert_true(one && two && one != two);
    assert_null(crew_lead(work->crew, "j", 2));
    crew_end(one);
    assert_ptr_equal(crew_lead(work->crew, "j", 3), one);
    crew_end(one);
    crew_end(two);
    assert_false(crew_help(work->crew, is_over, work));
    assert_null(crew_lead(NULL, "j", 0));
    assert_false(crew_help(NULL, is_over, work));
    crew_end(NULL);
}

/* Alone, a share is done all the same. */
static void nobody_need_help(void **state)
{
    struct work *work = *state;
    struct crew_lead *lead = crew_lead(work->crew, "j", 0);
    for (int64_t parts = 0; parts <= PARTS_MAX; parts++)
        assert_true(share(work, crew_hands(lead), parts));
    assert_int_equal(crew_hands(lead)->count(crew_hands(lead)->context), 0);
    crew_end(lead);
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(each_part_is_done_once),
        TEST(leaders_come_and_go),
        TEST(there_are_so_many_places),
        TEST(nobody_need_help),
    };
    return cmocka_run_group_tests_name("crew", tests, NULL, NULL);
}
