/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_store_find.c - store_find.h against what it promises: conditions, sorts, cursors; sealed
 * segments give the same answers as unsealed ones. */
#include "store_bench.h"

#include "limits.h"
#include "store_find.h"
#include "store_internal.h"
#include "store_segment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ------------------------------------------------------------------ conditions */

/* A condition as a user would write it: "diameter", "=", "0.5". */
struct wish {
    const char *path, *relation, *value;
};

static size_t read_wishes(const struct wish *wish, struct find_condition *condition)
{
    size_t count = 0;

    for (; wish->path; wish++) {
        struct find_condition *c = &condition[count++];

        *c = (struct find_condition){.path = wish->path, .value = wish->value};
        switch (wish->relation[0]) {
        case '!':
            c->relation = FIND_OTHER;
            break;
        case '>':
            c->relation = FIND_WITHIN;
            c->least = wish->value;
            break;
        case '<':
            c->relation = FIND_WITHIN;
            c->most = wish->value;
            break;
        case '#':
            c->relation = FIND_TAGGED;
            break;
        }
    }
    return count;
}

static size_t count_found(struct store *store, unsigned states, const struct wish *wishes)
{
    struct find_condition conditions[LIMIT_FILTERS_MAX];
    struct find_query query = {.states = states, .limit = 3000, .conditions = conditions};
    struct find_page page;
    size_t count;

    query.condition_count = read_wishes(wishes, conditions);
    assert_int_equal(store_find(store, &query, &page), STORE_OK);
    assert_null(page.next);
    count = page.count;
    find_page_fini(&page);
    return count;
}
#define FOUND(store, ...)                                                                          \
    count_found(store, 0, (const struct wish[]){__VA_ARGS__, {NULL, NULL, NULL}})
#define IS(path, value) FOUND(store, {path, "=", value})

/* Fills up the first segment with jobs that are like none of a test's, so that it is sealed. */
static void seal_first(struct store *store)
{
    int64_t next = bench_number(store, "SELECT coalesce(max(seq), 0) + 1 FROM jobs");
    char id[JOB_ID_SIZE], sql[1024];

    assert_true(next < SEGMENT_JOBS);
    snprintf(
        sql, sizeof sql,
        "WITH RECURSIVE n (i) AS (SELECT %lld UNION ALL SELECT i + 1 FROM n WHERE i < %d)"
        " INSERT INTO jobs (seq, id, hash, submitted_ms, chunks, job, derived)"
        " SELECT i, 'jfill' || i, CAST(printf('%%032d', i) AS BLOB), 1, 1, '{\"fill\":true}', '{}'"
        " FROM n",
        (long long)next, SEGMENT_JOBS - 2);
    if (next < SEGMENT_JOBS - 1)
        assert_int_equal(store_exec(store->writer, sql), STORE_OK);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM job_segments"), 0);
    bench_insert(store, 200, "{\"fill\":true}", id);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM job_segments"), 1);
}

static void insert_two(struct store *store)
{
    char id[JOB_ID_SIZE];

    bench_insert(
        store, 1,
        "{\"diameter\":0.5,\"seed\":9007199254740993,\"method\":\"bcd\",\"text\":\"a "
        "\\\"b\\\"\\u0001\","
        "\"potential\":{\"type\":\"cosine\",\"amplitude\":6},\"flag\":true,\"list\":[1,{\"a\":2}],"
        "\"none\":null,\"after\":-3e2,\"word\":\"7\"}",
        id);
    bench_insert(store, 2,
                 "{\"diameter\":0.1,\"seed\":9007199254740992,\"method\":\"lm\","
                 "\"potential\":{\"type\":\"cosine\",\"amplitude\":6.0}}",
                 id);
}

static void assert_two(struct store *store)
{
    assert_int_equal(IS("diameter", "0.5"), 1);
    assert_int_equal(IS("diameter", "5e-1"), 1);
    assert_int_equal(IS("diameter", "0.1"), 1);
    assert_int_equal(IS("diameter", "0.10000000000000001"), 1);
    assert_int_equal(IS("diameter", "0.1000000000001"), 0);
    assert_int_equal(IS("diameter", "0.5x"), 0);
    assert_int_equal(IS("diameter", ""), 0);
    assert_int_equal(IS("diameter", "nan"), 0);
    assert_int_equal(IS("diameter", "1e999"), 0);
    assert_int_equal(IS("diameter", "-9223372036854775808"), 0);
    assert_int_equal(IS("seed", "9007199254740993"), 1);
    assert_int_equal(IS("method", "bcd"), 1);
    assert_int_equal(IS("method", "b"), 0);
    assert_int_equal(IS("potential.amplitude", "6"), 2);
    assert_int_equal(IS("potential.amplitude", "6.0"), 2);
    assert_int_equal(FOUND(store, {"potential.type", "=", "cosine"}, {"diameter", "=", "0.5"}), 1);
    assert_int_equal(IS("flag", "true"), 1);
    assert_int_equal(IS("text", "a \"b\"\x01"), 1);
    assert_int_equal(IS("after", "-300"), 1);
    assert_int_equal(IS("word", "7"), 1); /* a text that looks like a number */
    assert_int_equal(FOUND(store, {"derived.steps", "=", "10"}, {"fill", "!", "true"}), 2);
    assert_int_equal(IS("potential", "cosine"), 0);
    assert_int_equal(IS("list", "1"), 0);
    assert_int_equal(IS("none", "null"), 0);
    assert_int_equal(IS("nothing", "1"), 0);
    assert_int_equal(FOUND(store, {"diameter", ">", "0.1"}), 2);
    assert_int_equal(FOUND(store, {"diameter", ">", "0.10000000000000001"}), 2);
    assert_int_equal(FOUND(store, {"diameter", ">", "0.11"}), 1);
    assert_int_equal(FOUND(store, {"diameter", ">", "0.6"}), 0);
    assert_int_equal(FOUND(store, {"diameter", "<", "0.1"}), 1);
    assert_int_equal(FOUND(store, {"diameter", ">", "0.05"}, {"diameter", "<", "0.4"}), 1);
    assert_int_equal(FOUND(store, {"method", ">", "0"}), 0);
    assert_int_equal(FOUND(store, {"seed", ">", "9007199254740993"}), 1);
    assert_int_equal(FOUND(store, {"diameter", "=", "0.5"}, {"fill", "!", "true"}), 1);
    assert_int_equal(FOUND(store, {"fill", "!", "true"}), 2);
    assert_int_equal(FOUND(store, {"fill", "!", "true"}, {"method", "!", "lm"}), 1);
}

static void conditions_are_met(void **state)
{
    struct store *store = ((struct bench *)*state)->store;

    insert_two(store);
    assert_two(store);
    seal_first(store);
    assert_two(store);
    /* A change of a job unseals its segment; the next start seals it anew. */
    assert_int_equal(store_exec(store->writer, "UPDATE jobs SET job = json_set(job, '$.diameter',"
                                               " 0.7) WHERE seq = 2"),
                     STORE_OK);
    assert_int_equal(IS("diameter", "0.7"), 1);
    assert_int_equal(IS("diameter", "0.1"), 0);
    bench_reopen(*state);
    store = ((struct bench *)*state)->store;
    assert_int_equal(bench_number(store, "SELECT count(*) FROM job_segments"), 1);
    assert_int_equal(IS("diameter", "0.7"), 1);
    assert_int_equal(IS("diameter", "0.1"), 0);
}

static void odd_paths_find_nothing(void **state)
{
    static const char *const paths[] = {"",        ".",     "a..b",     ".a",   "a.",  "$",
                                        "list[0]", "a' --", "\"seed\"", "Seed", "a b", "#-1"};
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE], longest[300];

    bench_insert(store, 1, "{\"seed\":1,\"list\":[1],\"a\":1}", id);
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
        assert_int_equal(IS(paths[i], "1"), 0);
    memset(longest, 'a', sizeof longest - 1);
    longest[sizeof longest - 1] = '\0';
    assert_int_equal(IS(longest, "1"), 0);
    assert_int_equal(FOUND(store, {"a", "=", "1"}, {"a", "=", "1"}, {"a", "=", "1"},
                           {"a", "=", "1"}, {"seed", "=", "1"}, {"a", "=", "1"}, {"a", "=", "1"},
                           {"a", "<", "1"}),
                     1);
}

static unsigned bit(enum job_state state)
{
    return 1U << state;
}

static void assert_states(struct store *store, size_t queued)
{
    const struct wish none[] = {{NULL, NULL, NULL}}, has[] = {{"a", "=", "1"}, {NULL, NULL, NULL}};

    assert_int_equal(count_found(store, bit(JOB_QUEUED), none), queued);
    assert_int_equal(count_found(store, bit(JOB_RUNNING), none), 1);
    assert_int_equal(count_found(store, bit(JOB_DONE), none), 1);
    assert_int_equal(count_found(store, bit(JOB_FAILED), none), 1);
    assert_int_equal(count_found(store, bit(JOB_CANCELLED), none), 1);
    assert_int_equal(count_found(store, bit(JOB_CANCELLED) | bit(JOB_DONE), none), 2);
    assert_int_equal(count_found(store, bit(JOB_CANCELLED) | bit(JOB_DONE), has), 2);
    assert_int_equal(FOUND(store, {"started_at", ">", "0"}), 3);
    assert_int_equal(FOUND(store, {"finished_at", ">", "0"}), 3);
}

static void make_states(struct store *store)
{
    char id[JOB_ID_SIZE];

    for (int i = 0; i < 4; i++) {
        bench_insert(store, i, "{\"a\":1}", id);
        assert_int_equal(i == 3 ? store_jobs_cancel(store, id) : store_jobs_start(store, id),
                         STORE_OK);
        if (i == 1)
            assert_int_equal(store_results_finish(store, id, NULL, 0), STORE_OK);
        if (i == 2)
            assert_int_equal(store_jobs_fail(store, id, "x"), STORE_OK);
    }
}

static void states_are_found_however_they_came(void **state)
{
    struct store *store = ((struct bench *)*state)->store;

    make_states(store);
    assert_states(store, 0);
    seal_first(store);
    assert_states(store, SEGMENT_JOBS - 5);
}

/* The jobs change after their segment was sealed: one, and more than stay in the news. */
static void what_happens_later_is_found(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    char id[100][JOB_ID_SIZE];

    for (int i = 0; i < 100; i++)
        bench_insert(store, i, "{\"a\":1}", id[i]);
    seal_first(store);
    for (int i = 0; i < 100; i++) {
        assert_int_equal(store_jobs_start(store, id[i]), STORE_OK);
        assert_int_equal(store_results_finish(store, id[i], NULL, 0), STORE_OK);
        assert_int_equal(FOUND(store, {"finished_at", ">", "0"}), i + 1);
        assert_int_equal(count_found(store, bit(JOB_DONE), (struct wish[]){{NULL, NULL, NULL}}),
                         i + 1);
    }
    assert_true(bench_number(store, "SELECT count(*) FROM job_news WHERE key = 3") < 100);
    assert_int_equal(bench_number(store, "SELECT count(*) FROM job_ends JOIN job_columns"
                                         " USING (id) WHERE id = (3 << 32) AND most > 0"),
                     1);
}

static void tags_owners_and_labels_are_found(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    const struct ticket ada = {
        .owner = "ada", .label = (char *)"first try", .tags = (char *)"a.b c"};
    const struct ticket bob = {.owner = "bob", .priority = -5, .tags = (char *)"c"};

    for (int i = 0; i < 2; i++) {
        struct job_new job = bench_job(i, "{\"a\":1}");
        struct job_record record;
        bool existed;

        job.ticket = i ? &bob : &ada;
        assert_int_equal(store_jobs_insert(store, &job, &record, &existed), STORE_OK);
        job_record_fini(&record);
    }
    for (int sealed = 0; sealed < 2; sealed++) {
        assert_int_equal(IS("owner", "ada"), 1);
        assert_int_equal(IS("owner", "eve"), 0);
        assert_int_equal(IS("label", "first try"), 1);
        assert_int_equal(IS("priority", "-5"), 1);
        assert_int_equal(FOUND(store, {"t", "#", "c"}), 2);
        assert_int_equal(FOUND(store, {"t", "#", "a.b"}), 1);
        assert_int_equal(FOUND(store, {"t", "#", "a"}), 0);
        assert_int_equal(FOUND(store, {"t", "#", "c"}, {"t", "#", "a.b"}), 1);
        assert_int_equal(FOUND(store, {"t", "#", "c"}, {"owner", "=", "bob"}), 1);
        if (!sealed)
            seal_first(store);
    }
}

/* --------------------------------------------------------------- sorts, cursors */

/* The seeds of a whole list, page by page of `limit`, as "3 1 2". */
static void list(struct store *store, const char *sort, size_t limit, char *seeds)
{
    struct find_query query = {.limit = limit, .sort = *sort == '-' ? sort + 1 : sort};
    struct find_condition real = {.path = "seed", .relation = FIND_WITHIN, .least = "0"};
    char *cursor = NULL;

    query.ascending = *sort != '-';
    query.conditions = &real;
    query.condition_count = 1;
    if (strcmp(query.sort, "submitted") == 0)
        query.sort = NULL;
    *seeds = '\0';
    do {
        struct find_page page;

        query.cursor = cursor;
        assert_int_equal(store_find(store, &query, &page), STORE_OK);
        free(cursor);
        cursor = page.next ? strdup(page.next) : NULL;
        assert_true(page.count == limit || !cursor);
        for (size_t i = 0; i < page.count; i++) {
            const char *seed = strstr(page.records[i].job, "\"seed\":");

            assert_non_null(seed);
            sprintf(seeds + strlen(seeds), "%s%d", *seeds ? " " : "", atoi(seed + 7));
        }
        find_page_fini(&page);
    } while (cursor);
}

static void assert_list(struct store *store, const char *sort, const char *expected)
{
    char seeds[256];

    for (size_t limit = 1; limit <= 8; limit++) {
        list(store, sort, limit, seeds);
        assert_string_equal(seeds, expected);
    }
}

/* What became of jobs: numbers and words, in the news, in columns, and of those that had ended when
 * nobody kept it. */
static void assert_outcomes(struct store *store, size_t more)
{
    assert_int_equal(IS("outcome.realizations", "40"), 1);
    assert_int_equal(FOUND(store, {"outcome.realizations", ">", "21"}), 2 + more);
    assert_int_equal(IS("outcome.target.reached", "true"), 1 + more);
    assert_int_equal(IS("outcome.target.reached", "false"), 1);
    assert_int_equal(IS("outcome.target.stopped_by", "target"), 1 + more);
    assert_int_equal(IS("outcome.reused_from", "jother"), 1);
    assert_int_equal(FOUND(store, {"outcome.target.relative_error", "<", "0.01"}), more);
    assert_list(store, "outcome.realizations", more > 0 ? "1 3 9 2" : "1 3 2");
    assert_list(store, "-outcome.target.stopped_by", more > 0 ? "9 3 2 1" : "3 2 1");
}

static void end_as(struct store *store, int seed, const char *outcome)
{
    struct samples_kept kept = {.family = (const unsigned char *)"01234567890123456789012345678901",
                                .outcome = outcome};
    const struct finish_new finish = {.kept = &kept};
    char id[JOB_ID_SIZE], job[64];

    snprintf(job, sizeof job, "{\"seed\":%d}", seed);
    bench_insert(store, seed, job, id);
    assert_int_equal(store_jobs_start(store, id), STORE_OK);
    assert_int_equal(store_results_finish_with(store, id, &finish), STORE_OK);
}

static void outcomes_are_found(void **state)
{
    struct bench *bench = *state;

    end_as(bench->store, 1, "{\"realizations\":20,\"reused_realizations\":0,\"reused_from\":null}");
    end_as(bench->store, 2,
           "{\"realizations\":40,\"reused_realizations\":16,\"reused_from\":\"jother\",\"target\":{"
           "\"reached\":false,\"stopped_by\":\"realizations\",\"relative_error\":0.5,"
           "\"statistical\":0.4,\"time_step_error\":null}}");
    end_as(bench->store, 3,
           "{\"realizations\":30,\"reused_realizations\":0,\"reused_from\":null,\"target\":{"
           "\"reached\":true,\"stopped_by\":\"target\",\"relative_error\":0.02,"
           "\"statistical\":0.02,\"time_step_error\":0}}");
    assert_outcomes(bench->store, 0);
    seal_first(bench->store);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM job_news"), 0);
    assert_outcomes(bench->store, 0);
    /* As if they had ended before outcomes were kept. */
    assert_int_equal(store_exec(bench->store->writer,
                                "DELETE FROM job_columns WHERE id >> 32 IN"
                                " (SELECT id FROM job_keys WHERE path GLOB 'outcome.*');"
                                "DELETE FROM job_ends WHERE id NOT IN"
                                " (SELECT id FROM job_columns);"
                                "DELETE FROM job_keys WHERE path GLOB 'outcome.*'"),
                     STORE_OK);
    assert_int_equal(FOUND(bench->store, {"outcome.realizations", "=", "40"}), 0);
    bench_reopen(bench);
    assert_int_equal(bench_number(bench->store, "SELECT count(*) FROM job_news"), 0);
    assert_outcomes(bench->store, 0);
    end_as(bench->store, 9,
           "{\"realizations\":35,\"reused_realizations\":0,\"reused_from\":null,\"target\":{"
           "\"reached\":true,\"stopped_by\":\"target\",\"relative_error\":0.002,"
           "\"statistical\":0.002,\"time_step_error\":0}}");
    assert_outcomes(bench->store, 1);
}

static void lists_are_sorted(void **state)
{
    static const char *const jobs[] = {
        "{\"seed\":1,\"x\":0.5,\"word\":\"b\"}",
        "{\"seed\":2,\"x\":3,\"word\":\"\"}",
        "{\"seed\":3,\"x\":-1e3}",
        "{\"seed\":4,\"word\":\"ba\"}",
        "{\"seed\":5,\"x\":3.0,\"word\":\"a\"}",
        "{\"seed\":6,\"x\":\"auto\"}",
    };
    struct store *store = ((struct bench *)*state)->store;
    char id[JOB_ID_SIZE];

    for (int i = 0; i < 6; i++)
        bench_insert(store, i, jobs[i], id);
    for (int sealed = 0; sealed < 2; sealed++) {
        assert_list(store, "-submitted", "6 5 4 3 2 1");
        assert_list(store, "submitted", "1 2 3 4 5 6");
        assert_list(store, "seed", "1 2 3 4 5 6");
        assert_list(store, "-seed", "6 5 4 3 2 1");
        /* Newest first among equals; texts behind numbers; last what has no value. */
        assert_list(store, "x", "3 1 5 2 6 4");
        assert_list(store, "-x", "6 5 2 1 3 4");
        assert_list(store, "word", "2 5 1 4 6 3");
        assert_list(store, "-word", "4 1 5 2 6 3");
        assert_list(store, "none", "6 5 4 3 2 1");
        if (!sealed)
            seal_first(store);
    }
    /* Across a sealed and an unsealed segment. */
    bench_insert(store, 7, "{\"seed\":7,\"x\":1,\"word\":\"aa\"}", id);
    assert_list(store, "x", "3 1 7 5 2 6 4");
    assert_list(store, "-word", "4 1 7 5 2 6 3");
    assert_list(store, "submitted", "1 2 3 4 5 6 7");
}

static void assert_cursor(struct store *store, const char *cursor, bool ascending,
                          enum store_status expected)
{
    struct find_query query = {.limit = 1, .cursor = cursor, .sort = "x", .ascending = ascending};
    struct find_page page = {0};

    assert_int_equal(store_find(store, &query, &page), expected);
    find_page_fini(&page);
}

static void foreign_cursors_are_refused(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct find_query query = {.limit = 1, .sort = "x"};
    struct find_page page;
    char id[JOB_ID_SIZE], *cursor, *broken;

    bench_insert(store, 1, "{\"x\":1}", id);
    bench_insert(store, 2, "{\"x\":2}", id);
    assert_int_equal(store_find(store, &query, &page), STORE_OK);
    cursor = page.next;
    page.next = NULL;
    find_page_fini(&page);
    assert_cursor(store, cursor, false, STORE_OK);
    assert_cursor(store, cursor, true, STORE_CONFLICT);
    for (size_t i = 0; i < strlen(cursor); i++) {
        broken = strdup(cursor);
        broken[i] = broken[i] == 'a' ? 'b' : 'a';
        assert_cursor(store, broken, false, STORE_CONFLICT);
        broken[i] = '\0';
        assert_cursor(store, broken, false, STORE_CONFLICT);
        free(broken);
    }
    assert_cursor(store, "", false, STORE_CONFLICT);
    assert_cursor(store, "xyz", false, STORE_CONFLICT);
    free(cursor);
}

/* Jobs that come or change while someone turns pages. */
static void pages_hold_while_jobs_come_and_go(void **state)
{
    struct store *store = ((struct bench *)*state)->store;
    struct find_query query = {.limit = 2, .sort = "x", .ascending = true};
    struct find_page page;
    char id[JOB_ID_SIZE], first[JOB_ID_SIZE] = "", *cursor;

    for (int i = 0; i < 4; i++) {
        char job[32];

        snprintf(job, sizeof job, "{\"x\":%d}", 10 * i);
        bench_insert(store, i, job, i == 0 ? first : id);
    }
    assert_int_equal(store_find(store, &query, &page), STORE_OK); /* 0 10 */
    cursor = strdup(page.next);
    find_page_fini(&page);
    bench_insert(store, 10, "{\"x\":5}", id);  /* before the page's end: not seen */
    bench_insert(store, 11, "{\"x\":15}", id); /* behind it: seen */
    assert_int_equal(store_exec(store->writer, "DELETE FROM jobs WHERE seq = 2"), STORE_OK);
    query.cursor = cursor;
    assert_int_equal(store_find(store, &query, &page), STORE_OK);
    assert_int_equal(page.count, 2);
    assert_string_equal(page.records[0].job, "{\"x\":15}");
    assert_string_equal(page.records[1].job, "{\"x\":20}");
    find_page_fini(&page);
    free(cursor);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(conditions_are_met),
        BENCH_TEST(odd_paths_find_nothing),
        BENCH_TEST(states_are_found_however_they_came),
        BENCH_TEST(what_happens_later_is_found),
        BENCH_TEST(outcomes_are_found),
        BENCH_TEST(tags_owners_and_labels_are_found),
        BENCH_TEST(lists_are_sorted),
        BENCH_TEST(foreign_cursors_are_refused),
        BENCH_TEST(pages_hold_while_jobs_come_and_go),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
