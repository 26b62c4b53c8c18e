/* SPDX-License-Identifier: GPL-3.0-or-later
 * Jobs of a sweep are run once more: which of them, and as what. */
#include "sweep_desk.h"
#include "store_internal.h"
#include "store_sweeps.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define ONE(more)                                                                                  \
    "{\"particles\":5,\"length\":10,\"time\":1,\"time_step\":0.01,\"observables\":{\"energy\":{}"  \
    "}" more "}"
#define SWEEP(axes) "{\"base\":" ONE("") ",\"axes\":{" axes "}}"

static void failed_jobs_again(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3]")), 202);
    assert_int_equal(ask_sweep(f, "POST", "/retry", NULL), 200);
    assert_says(f, "\"retried\":0");
    char id[JOB_ID_SIZE];
    sqlite3 *db = store_read_begin(f->service.store);
    struct stmt row = stmt_init(db, "SELECT id FROM jobs ORDER BY seq LIMIT 1");
    assert_true(stmt_step(&row));
    char *text = stmt_text(&row, 0);
    snprintf(id, sizeof(id), "%s", text);
    free(text);
    stmt_fini(&row);
    store_read_end(f->service.store, db);
    assert_int_equal(store_jobs_fail(f->service.store, id, "a test"), STORE_OK);
    assert_int_equal(ask_sweep(f, "GET", "", NULL), 200);
    assert_says(f, "\"queued\":2,\"running\":0,\"done\":0,\"failed\":1");
    assert_counted(f);
    assert_int_equal(ask_sweep(f, "POST", "/retry", NULL), 202);
    assert_says(f, "\"queued\":3,\"running\":0,\"done\":0,\"failed\":0");
    assert_says(f, "\"retried\":1");
    assert_counted(f);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE state = 'failed'"), 1);
    assert_int_equal(ask_sql(f, "SELECT (SELECT job FROM jobs WHERE seq = 1) ="
                                " (SELECT job FROM jobs WHERE seq = 4)"),
                     1);
}

static int retry_cancelled(struct desk *f, const char *value)
{
    char path[64];
    const struct request_query query = {"cancelled", value};
    snprintf(path, sizeof(path), "/v1/sweeps/%s/retry", f->id);
    return desk_send(
        f, &(const struct request){
               .method = "POST", .path = path, .body = "", .query = &query, .query_count = 1});
}

/* Only when asked for; and not those that someone else has brought back. */
static void cancelled_jobs_again(void **state)
{
    struct desk *f = *state;
    char ids[2][JOB_ID_SIZE], path[64];
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3]")), 202);
    sqlite3 *db = store_read_begin(f->service.store);
    struct stmt row = stmt_init(db, "SELECT id FROM jobs ORDER BY seq");
    for (size_t i = 0; i < 2 && stmt_step(&row); i++)
        stmt_text_to(&row, 0, ids[i], sizeof(ids[i]));
    assert_int_equal(stmt_fini(&row), STORE_OK);
    store_read_end(f->service.store, db);
    for (size_t i = 0; i < 2; i++) {
        snprintf(path, sizeof(path), "/v1/jobs/%s", ids[i]);
        assert_int_equal(ask(f, "DELETE", path, NULL), 200);
    }
    assert_int_equal(ask(f, "POST", "/v1/jobs", ONE(",\"seed\":2")), 202);
    assert_int_equal(ask_sweep(f, "POST", "/retry", NULL), 200);
    assert_says(f, "\"retried\":0");
    assert_int_equal(retry_cancelled(f, "maybe"), 400);
    assert_int_equal(retry_cancelled(f, "false"), 200);
    assert_int_equal(retry_cancelled(f, "true"), 202);
    assert_says(f, "\"retried\":2");
    assert_says(f, "\"queued\":3,\"running\":0,\"done\":0,\"failed\":0,\"cancelled\":0");
    assert_counted(f);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 5); /* one new, one found */
    assert_int_equal(retry_cancelled(f, "true"), 200);
}

static void write_sql(struct desk *f, const char *sql)
{
    sqlite3 *db;
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    struct stmt row = stmt_init(db, sql);
    assert_int_equal(store_end(f->service.store, stmt_run(&row, NULL)), STORE_OK);
}

/* Of a version before this one: tried again they are what this one makes of them. */
static void outdated_jobs_anew(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3]")), 202);
    write_sql(f,
              "UPDATE jobs SET hash = CAST(seq || substr(hex(hash), 2, 31) AS BLOB),"
              " chunks = 7, core_seconds = 99, state = 'failed', finished_ms = 1,"
              " error = CASE seq WHEN 3 THEN 'of another kind' ELSE '" JOB_OUTDATED " from' END");
    assert_int_equal(ask_sweep(f, "POST", "/retry", NULL), 202);
    assert_says(f, "\"retried\":3");
    assert_counted(f);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE state = 'queued'"), 3);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE state = 'queued' AND chunks = 1"
                                " AND core_seconds < 1"),
                     2);
    assert_int_equal(ask_sql(f, "SELECT count(DISTINCT hash) FROM jobs"), 5); /* one once more */
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3,4]")), 202);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 8); /* two are found, two are new */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(failed_jobs_again),
        DESK_TEST(cancelled_jobs_again),
        DESK_TEST(outdated_jobs_anew),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
