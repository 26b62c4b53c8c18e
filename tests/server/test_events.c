/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_events.c and stream_events.c: the stream of all jobs keeps up, however many end at once.
 */
#include "stage.h"

#include "limits.h"
#include "store_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

struct fixture {
    struct stage stage;
    int made;
    char *told; /* all that the stream gave */
    size_t size;
};

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    *state = f;
    stage_open(&f->stage);
    return 0;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    stage_close(&f->stage);
    free(f->told);
    free(f);
    return 0;
}

/* Jobs that come in one transaction, few enough to be told one by one: "x1", "x2", ... */
static void make(struct fixture *f, int many)
{
    sqlite3 *db;
    char sql[400];
    assert_true(many <= STORE_WATCH_MOVES);
    snprintf(sql, sizeof(sql),
             "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT %d)"
             " INSERT INTO jobs (id, hash, submitted_ms, chunks, job, derived)"
             " SELECT 'x' || (i + %d), randomblob(32), 1, 1, '{}', '{}' FROM n",
             many, f->made);
    assert_int_equal(STORE_BEGIN(f->stage.desk.service.store, &db), STORE_OK);
    assert_int_equal(store_exec(db, sql), STORE_OK);
    assert_int_equal(store_end(f->stage.desk.service.store, STORE_OK), STORE_OK);
    f->made += many;
}

static void open_stream(struct fixture *f, const char *last)
{
    const struct request request = {
        .method = "GET", .path = "/v1/events", .body = "", .last_event_id = last};
    assert_int_equal(desk_send(&f->stage.desk, &request), 200);
    assert_non_null(f->stage.desk.reply.stream.read);
}

enum { A_MS = 1000 };

/* One read of what is there; false = there is nothing just now. */
static bool read_some(struct fixture *f)
{
    char piece[4096];
    const struct stream *stream = &f->stage.desk.reply.stream;
    ssize_t got = stream->read(stream->state, piece, sizeof(piece));
    assert_true(got > 0 || got == STREAM_LATER);
    if (got == STREAM_LATER)
        return false;
    f->told = realloc(f->told, f->size + (size_t)got + 1);
    assert_non_null(f->told);
    memcpy(f->told + f->size, piece, (size_t)got);
    f->size += (size_t)got;
    f->told[f->size] = '\0';
    return true;
}

static int times(const char *text, const char *part)
{
    int found = 0;
    for (; (text = strstr(text, part)); text++)
        found++;
    return found;
}

/* The number of queued jobs in the latest counts; -1 = there were none. */
static long long queued(const struct fixture *f)
{
    long long number = -1;
    for (const char *at = f->told; at && (at = strstr(at, "event: counts\n")); at++)
        assert_int_equal(sscanf(at, "event: counts\ndata: {\"queued\":%lld,", &number), 1);
    return number;
}

/* What waits is told as fast as it is read, without a pause between batches, and then the counts.
 */
static void all_that_waits_is_told_at_once(void **state)
{
    struct fixture *f = *state;
    open_stream(f, NULL);
    while (read_some(f))
        ;
    assert_int_equal(times(f->told, "event: counts"), 1);
    long long before = queued(f);
    f->size = 0;
    for (int i = 0; i < 5; i++)
        make(f, 200);
    while (!read_some(f)) /* the pause after the first */
        usleep(A_MS);
    while (read_some(f))
        ;
    assert_int_equal(times(f->told, "event: job\n"), 1000);
    assert_non_null(strstr(f->told, "\"id\":\"x1\""));
    assert_non_null(strstr(f->told, "\"id\":\"x1000\""));
    assert_null(strstr(f->told, "event: lost"));
    assert_int_equal(queued(f), before + 1000);
}

/* More happens than is read: the counts come all the same, and are those of now. */
static void counts_come_while_it_is_behind(void **state)
{
    struct fixture *f = *state;
    open_stream(f, NULL);
    while (read_some(f))
        ;
    long long latest = queued(f);
    int counts = 0, worst = 0, since = 0;
    for (int i = 0; i < 200 && counts < 3; i++, since++) {
        make(f, 200);
        f->size = 0;
        while (!read_some(f))
            usleep(A_MS);
        if (queued(f) < 0)
            continue;
        counts++;
        worst = since > worst ? since : worst;
        since = 0;
        assert_true(queued(f) > latest);
        latest = queued(f);
    }
    assert_int_equal(counts, 3);
    assert_true(worst < 40);
}

/* The number of each change is its own: who is cut off within a batch misses nothing. */
static void it_goes_on_within_a_batch(void **state)
{
    struct fixture *f = *state;
    open_stream(f, NULL);
    while (read_some(f))
        ;
    make(f, 10);
    while (!read_some(f))
        usleep(A_MS);
    char id[64], line[64];
    const char *third = strstr(f->told, "\"id\":\"x3\"");
    assert_non_null(third);
    while (strncmp(third, "id: ", 4) != 0)
        third--;
    assert_int_equal(sscanf(third, "id: %63s", id), 1);
    f->size = 0;
    open_stream(f, id);
    while (read_some(f))
        ;
    for (int i = 1; i <= 10; i++) {
        snprintf(line, sizeof(line), "\"id\":\"x%d\"", i);
        assert_int_equal(times(f->told, line), i > 3);
    }
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(all_that_waits_is_told_at_once),
        TEST(counts_come_while_it_is_behind),
        TEST(it_goes_on_within_a_batch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
