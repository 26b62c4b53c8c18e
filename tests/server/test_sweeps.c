/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sweeps without a socket: what is refused and in which words, ranges, extension, cancelling, and
 * counters that always are what counting gives. */
#include "sweep_desk.h"
#include "store_internal.h"
#include "store_sweeps.h"
#include "sweep_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define BASE                                                                                       \
    "{\"particles\":5,\"length\":10,\"time\":1,\"time_step\":0.01,\"observables\":{\"energy\":{}}" \
    "}"
#define SWEEP(axes) "{\"base\":" BASE ",\"axes\":{" axes "}}"

static int ask_list(struct desk *f, const char *name, const char *value)
{
    const struct request_query query = {name, value};
    const struct request request = {
        .method = "GET", .path = "/v1/jobs", .body = "", .query = &query, .query_count = 1};
    return desk_send(f, &request);
}

/* Jobs of a list. */
static size_t count_jobs(struct desk *f, const char *name, const char *value)
{
    size_t count = 0;
    assert_int_equal(ask_list(f, name, value), 200);
    for (const char *c = f->reply.body; (c = strstr(c, "{\"id\":\"j")); c++)
        count++;
    return count;
}

/* CHECKs and triggers are awake again when a sweep is in. */
static void what_rested_wakes_up(void **state)
{
    struct desk *f = *state;
    sqlite3 *db;
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1]")), 202);
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    assert_int_equal(sqlite3_exec(db, "UPDATE jobs SET chunks = 0", NULL, NULL, NULL),
                     SQLITE_CONSTRAINT_CHECK);
    assert_int_equal(sqlite3_exec(db, "UPDATE jobs SET state = 'done'", NULL, NULL, NULL),
                     SQLITE_CONSTRAINT_TRIGGER);
    assert_int_equal(sqlite3_exec(db, "UPDATE sweep_points SET job = 99", NULL, NULL, NULL),
                     SQLITE_CONSTRAINT_FOREIGNKEY);
    assert_int_equal(store_end(f->service.store, STORE_CONFLICT), STORE_CONFLICT);
}

/* A new trigger on the insertion of jobs must be booked in store_sweep_keep.c, too, one on their
 * changes of state in store_sweep_cancel.c, if it has anything to do with a job that never ran. */
static void triggers_that_rest_are_known(void **state)
{
    assert_int_equal(ask_sql(*state, "SELECT count(*) FROM sqlite_master WHERE type = 'trigger'"
                                     " AND tbl_name IN ('jobs', 'sweep_points', 'job_tags')"
                                     " AND sql LIKE '% INSERT ON %'"
                                     " AND name NOT IN ('jobs_count_insert', 'jobs_owner_insert')"),
                     0);
    assert_int_equal(
        ask_sql(*state, "SELECT count(*) FROM sqlite_master WHERE type = 'trigger'"
                        " AND sql GLOB '* UPDATE OF *state* ON jobs*' AND name NOT IN"
                        " ('jobs_transition', 'jobs_count_move', 'jobs_owner_move',"
                        "  'jobs_sweep_move', 'jobs_find_state', 'jobs_base', 'jobs_stand_again',"
                        "  'jobs_attempt_begin', 'jobs_attempt_end')"),
        0);
}

static void submitted_and_found_again(void **state)
{
    struct desk *f = *state;
    char first[JOB_ID_SIZE];
    const char *body = SWEEP("\"/diameter\":[0.1,0.2],\"/seed\":{\"first\":5,\"count\":3}");
    assert_int_equal(sweep_submit(f, body), 202);
    assert_says(f, "\"jobs\":6,\"states\":{\"queued\":6,\"running\":0");
    assert_says(f, "\"axes\":{\"/diameter\":[0.1,0.2],\"/seed\":[5,6,7]}");
    assert_says(f, "\"deduplicated\":false");
    assert_counted(f);
    memcpy(first, f->id, sizeof(first));
    assert_int_equal(sweep_submit(f, body), 200);
    assert_says(f, "\"deduplicated\":true");
    assert_string_equal(f->id, first);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 6);
    /* The last axis is the fastest. */
    assert_int_equal(ask_sql(f, "SELECT json_extract(job, '$.seed') FROM jobs WHERE seq ="
                                " (SELECT job FROM sweep_points WHERE point = 4)"),
                     6);
    assert_int_equal(ask_sql(f, "SELECT place = '[1,1]' FROM sweep_points WHERE point = 4"), 1);
    /* Another sweep shares the jobs that stand. */
    assert_int_equal(sweep_submit(f, SWEEP("\"/diameter\":[0.2,0.3],\"/seed\":[5]")), 202);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 7);
    assert_counted(f);
    assert_int_equal(ask(f, "GET", "/v1/sweeps", NULL), 200);
    assert_says(f, first);
    assert_says(f, "\"next\":null");
    assert_int_equal(ask(f, "GET", "/v1/sweeps/snix", NULL), 404);
    assert_int_equal(count_jobs(f, "sweep", first), 6);
    assert_int_equal(count_jobs(f, "sweep", f->id), 2);
    assert_int_equal(ask_list(f, "sweep", "snix"), 400);
}

static void labels_and_tags_of_base_and_sweep(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, "{\"base\":{\"label\":\"of the base\",\"tags\":[\"b\"],"
                                     "\"priority\":7,\"particles\":5,\"length\":10,\"time\":1,"
                                     "\"observables\":{\"energy\":{}}},\"axes\":{\"/seed\":[1,2]},"
                                     "\"tags\":[\"x\",\"a\"]}"),
                     202);
    assert_says(f, "\"label\":\"of the base\",\"tags\":[\"a\",\"x\"],\"priority\":7");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM job_tags WHERE tag IN ('a', 'x')"), 4);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE priority = 7"), 2);
}

static void refusals_name_the_place(void **state)
{
    static const struct {
        const char *body, *pointer, *words;
    } cases[] = {
        {"[]", "", "a sweep is a JSON object"},
        {"{\"axes\":{\"/seed\":[1]}}", "/base", "is required"},
        {"{\"base\":" BASE "}", "/axes", "1 to 8 axes"},
        {"{\"base\":" BASE ",\"axes\":{\"/seed\":[1]},\"x\":1}", "/x", "unknown key"},
        {"{\"base\":" BASE ",\"axes\":{\"/seed\":[1]},\"label\":1}", "/label", "must be a text"},
        {SWEEP("\"seed\":[1]"), "/axes/seed", "must be a JSON pointer"},
        {SWEEP("\"/\":[1]"), "/axes/~1", "must be a JSON pointer"},
        {SWEEP("\"/seed\":[]"), "/axes/~1seed", "must be a list of values"},
        {SWEEP("\"/seed\":7"), "/axes/~1seed", "must be a list of values"},
        {SWEEP("\"/seed\":[1,2,1]"), "/axes/~1seed/2", "is there before"},
        {SWEEP("\"/potential/amplitude\":[1]"), "/axes/~1potential~1amplitude", "no object"},
        {"{\"base\":{\"potential\":{\"type\":\"fourier\",\"cosine\":[1,2]}},\"axes\":{"
         "\"/potential/cosine/01\":[1]}}",
         "/axes/~1potential~1cosine~101", "no element of that list"},
        {SWEEP("\"/observables\":[{\"energy\":{}}],\"/observables/msd\":[{}]"),
         "/axes/~1observables~1msd", "lies within"},
        {SWEEP("\"/diameter\":{\"from\":1,\"to\":2,\"points\":1}"), "/axes/~1diameter/points",
         "at least 2"},
        {SWEEP("\"/diameter\":{\"from\":1,\"to\":1,\"points\":3}"), "/axes/~1diameter/to",
         "must differ"},
        {SWEEP("\"/diameter\":{\"from\":0,\"to\":1,\"points\":3,\"scale\":\"log\"}"),
         "/axes/~1diameter/from", "above 0"},
        {SWEEP("\"/diameter\":{\"from\":0,\"to\":1,\"points\":3,\"scale\":\"ln\"}"),
         "/axes/~1diameter/scale", "linear"},
        {SWEEP("\"/diameter\":{\"from\":0,\"to\":1,\"step\":3}"), "/axes/~1diameter/step",
         "unknown key"},
        {SWEEP("\"/seed\":{\"first\":1.5,\"count\":3}"), "/axes/~1seed/first", "an integer"},
        {SWEEP("\"/seed\":{\"first\":1,\"count\":0}"), "/axes/~1seed/count", "from 1 to"},
        {SWEEP("\"/seed\":{\"first\":1,\"count\":1000000}"), "/axes/~1seed/count",
         "LIMIT_SWEEP_POINTS_MAX"},
        {SWEEP("\"/seed\":{\"first\":1,\"count\":1000},\"/time\":{\"from\":1,\"to\":2,"
               "\"points\":101}"),
         "/axes", "make 101000 points; LIMIT_SWEEP_POINTS_MAX is 100000"},
        {SWEEP("\"/seed\":{\"first\":1,\"count\":90000},\"/time\":[1,2,1]"), "/axes",
         "make 270000 points"},
        {"{\"base\":" BASE ",\"axes\":{\"/seed\":[1]},\"zip\":[[\"/seed\",\"/time\"]]}", "/zip/0/1",
         "must be the pointer of an axis"},
        {"{\"base\":" BASE ",\"axes\":{\"/seed\":[1],\"/time\":[1,2]},\"zip\":[[\"/seed\","
         "\"/time\"]]}",
         "/zip", "cannot go together"},
        {"{\"base\":" BASE ",\"axes\":{\"/seed\":[1]},\"zip\":[\"/seed\"]}", "/zip", "list of"},
        {SWEEP("\"/nix\":[1,2]"), "/nix", "unknown key"},
        {SWEEP("\"/method\":[\"bcd\",\"leapfrog\"]"), "/method", "(point 1: /method = "},
        {SWEEP("\"/diameter\":[0.5,3,4]"), "/diameter", "(point 2: /diameter = 4)"},
        {SWEEP("\"/time\":[1,9e12]"), "", "LIMIT_CORE_SECONDS_MAX"},
    };
    struct desk *f = *state;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char pointer[128];
        assert_int_equal(sweep_submit(f, cases[i].body), 422);
        snprintf(pointer, sizeof(pointer), "\"pointer\":\"%s\"", cases[i].pointer);
        assert_says(f, pointer);
        assert_says(f, cases[i].words);
        assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 0);
    }
    assert_int_equal(sweep_submit(f, "{"), 400);
    assert_int_equal(sweep_submit(f, ""), 400);
}

/* All is told of many faulty points that fits, and no more is looked for than needed. */
static void many_faulty_points(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, SWEEP("\"/diameter\":{\"from\":3,\"to\":9,\"points\":50000}")),
                     422);
    assert_says(f, "(point 0: /diameter = 3)");
    assert_says(f, "2000 faults; the first: ");
    /* The same words everywhere are told once. */
    assert_int_equal(
        sweep_submit(f, SWEEP("\"/observables\":[{}],\"/seed\":{\"first\":1,\"count\":50}")), 422);
    assert_says(f, "50 faults; the first: /observables");
    const char *list = strstr(f->reply.body, "\"errors\"");
    assert_null(strstr(strstr(list, "(point 0") + 1, "(point"));
}

static void assert_values(const char *axis, const char *values)
{
    struct bcd_errors errors = {0};
    struct ticket ticket = {0};
    struct sweep *sweep = NULL;
    char body[512], wanted[1024];
    snprintf(body, sizeof(body), "{\"base\":{},\"axes\":{\"/x\":%s}}", axis);
    assert_int_equal(sweep_json_parse(body, strlen(body), &sweep, &ticket, &errors), BCD_OK);
    char *axes = sweep_json_axes(sweep);
    snprintf(wanted, sizeof(wanted), "{\"/x\":%s}", values);
    assert_string_equal(axes, wanted);
    free(axes);
    sweep_free(sweep);
}

/* As a physicist would write them. */
static void ranges(void **state)
{
    (void)state;
    assert_values("{\"from\":0.1,\"to\":0.5,\"points\":5}", "[0.1,0.2,0.3,0.4,0.5]");
    assert_values("{\"from\":0,\"to\":1,\"points\":11}",
                  "[0,0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9,1]");
    assert_values("{\"from\":-0.3,\"to\":0.3,\"points\":7}", "[-0.3,-0.2,-0.1,0,0.1,0.2,0.3]");
    assert_values("{\"from\":0,\"to\":1,\"points\":4}",
                  "[0,0.3333333333333333,0.6666666666666666,1]");
    assert_values("{\"from\":2,\"to\":1,\"points\":3}", "[2,1.5,1]");
    assert_values("{\"from\":1e-3,\"to\":1e3,\"points\":7,\"scale\":\"log\"}",
                  "[0.001,0.01,0.1,1,10,100,1000]");
    assert_values("{\"from\":1,\"to\":8,\"points\":4,\"scale\":\"log\"}", "[1,2,4,8]");
    assert_values("{\"from\":1e-9,\"to\":3e-9,\"points\":3,\"scale\":\"linear\"}",
                  "[1e-09,2e-09,3e-09]");
    assert_values("{\"first\":-1,\"count\":3}", "[-1,0,1]");
    assert_values("[1,0.30000000000000004,\"a\",null,{\"b\":[1.5]},true]",
                  "[1,0.30000000000000004,\"a\",null,{\"b\":[1.5]},true]");
}

static void axes_that_go_together(void **state)
{
    struct desk *f = *state;
    assert_int_equal(
        sweep_submit(f, "{\"base\":" BASE ",\"axes\":{\"/particles\":[5,10],\"/seed\":[1,2,3],"
                        "\"/length\":[10,20]},\"zip\":[[\"/length\",\"/particles\"]]}"),
        202);
    assert_says(f, "\"jobs\":6");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE json_extract(job, '$.length') ="
                                " 2 * json_extract(job, '$.particles')"),
                     6);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/particles\":[20]}}"), 422);
    assert_says(f, "as many values each");
    assert_int_equal(
        ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/particles\":[20],\"/length\":[40]}}"), 202);
    assert_says(f, "\"jobs\":9");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM sweep_points WHERE place LIKE '[2,%'"), 3);
}

/* Objects and lists, words, and places within what the base has. */
static void axes_of_any_kind(void **state)
{
    struct desk *f = *state;
    assert_int_equal(
        sweep_submit(f, "{\"base\":{\"particles\":5,\"length\":10,\"time\":1,\"observables\":"
                        "{\"density\":{\"bins\":10}}},\"axes\":{\"/potential\":[null,"
                        "{\"type\":\"cosine\",\"amplitude\":2},{\"type\":\"fourier\","
                        "\"cosine\":[1,2]}],\"/method\":[\"strang\",\"bcd\"],"
                        "\"/observables/density/bins\":[10,20]}}"),
        202);
    assert_says(f, "\"jobs\":12");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE"
                                " json_extract(job, '$.potential.type') = 'fourier'"
                                " AND json_extract(job, '$.observables.density.bins') = 20"),
                     2);
}

static void extension(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, SWEEP("\"/diameter\":[0.1,0.2],\"/seed\":[1,2]")), 202);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/diameter\":[0.2,0.4]}}"), 202);
    assert_says(f, "\"jobs\":6");
    assert_says(f, "\"/diameter\":[0.1,0.2,0.4]");
    assert_int_equal(
        ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/seed\":{\"first\":1,\"count\":3}}}"), 202);
    assert_says(f, "\"jobs\":9");
    assert_int_equal(ask_sql(f, "SELECT count(DISTINCT job) FROM sweep_points"), 9);
    assert_int_equal(ask_sql(f, "SELECT group_concat(point) = '0,1,2,3,4,5,6,7,8'"
                                " FROM sweep_points"),
                     1);
    assert_counted(f);
    /* Nothing new is nothing to do. */
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/seed\":[3]}}"), 200);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/time\":[3]}}"), 422);
    assert_says(f, "is no axis of this sweep");
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/diameter\":[0.3,7]}}"), 422);
    assert_says(f, "/diameter = 7");
    assert_int_equal(
        ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/seed\":{\"first\":1,\"count\":50000}}}"),
        422);
    assert_says(f, "LIMIT_SWEEP_POINTS_MAX");
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{}"), 422);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "nix"), 400);
    assert_int_equal(ask_sql(f, "SELECT points FROM sweeps"), 9);
    /* What began as this sweep is still found by what it began as. */
    assert_int_equal(sweep_submit(f, SWEEP("\"/diameter\":[0.1,0.2],\"/seed\":[1,2]")), 200);
    assert_says(f, "\"jobs\":9");
}

/* A job ends with the last sweep that wants it, and never when somebody wants it by itself. */
static void cancelling(void **state)
{
    struct desk *f = *state;
    char first[JOB_ID_SIZE];
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3,4]")), 202);
    memcpy(first, f->id, sizeof(first));
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[3,4,5]")), 202);
    assert_int_equal(ask(f, "POST", "/v1/jobs",
                         "{\"particles\":5,\"length\":10,\"time\":1,\"time_step\":0.01,"
                         "\"observables\":{\"energy\":{}},\"seed\":2}"),
                     200);
    memcpy(f->id, first, sizeof(first));
    assert_int_equal(ask_sweep(f, "DELETE", "", NULL), 200);
    assert_says(f,
                "\"states\":{\"queued\":3,\"running\":0,\"done\":0,\"failed\":0,\"cancelled\":1}");
    assert_counted(f);
    assert_int_equal(ask_sweep(f, "DELETE", "", NULL), 200); /* as good as before */
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/seed\":[9]}}"), 409);
    assert_int_equal(ask_sweep(f, "POST", "/retry", NULL), 409);
    /* Submitted again it is another sweep; jobs that stand are its jobs. */
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3,4]")), 202);
    assert_string_not_equal(f->id, first);
    assert_says(f, "\"queued\":4");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 6);
    assert_counted(f);
}

static int submit_with_key(struct desk *f, const char *path, const char *body)
{
    const struct request request = {.method = "POST",
                                    .path = path,
                                    .idempotency_key = "k1",
                                    .body = body,
                                    .body_size = strlen(body)};
    return desk_send(f, &request);
}

static void keys(void **state)
{
    struct desk *f = *state;
    assert_int_equal(submit_with_key(f, "/v1/sweeps", SWEEP("\"/seed\":[1,2]")), 202);
    assert_int_equal(submit_with_key(f, "/v1/sweeps", SWEEP("\"/seed\":[1,2]")), 200);
    assert_int_equal(submit_with_key(f, "/v1/sweeps", SWEEP("\"/seed\":[1,3]")), 422);
    assert_says(f, "key-reused");
    assert_int_equal(submit_with_key(f, "/v1/jobs", BASE), 422);
    assert_says(f, "key-reused");
}

/* Others' sweeps are to be looked at. */
static void roles(void **state)
{
    struct desk *f = *state;
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2]")), 202);
    struct call call = {.identity = {.owner = "mary", .role = ROLE_SUBMITTER}};
    const struct request request = {.method = "DELETE", .path = "", .body = ""};
    call.request = &request;
    memcpy(call.arg[0], f->id, sizeof(f->id));
    reply_fini(&f->reply);
    handle_sweeps_cancel(&f->service, &call, &f->reply);
    assert_int_equal(f->reply.status, 403);
    call.identity.role = ROLE_OPERATOR;
    reply_fini(&f->reply);
    handle_sweeps_cancel(&f->service, &call, &f->reply);
    assert_int_equal(f->reply.status, 200);
    assert_int_equal(ask_sql(f, "SELECT group_concat(action || ' ' || owner || ' ' || detail) ="
                                " 'sweep.submit local 2 points,sweep.cancel mary 2 points'"
                                " FROM audit WHERE object LIKE 's%'"),
                     1);
}

#define LARGE "\"/diameter\":[0.1,0.2%s],\"/seed\":{\"first\":1,\"count\":2700}"

static int submit_large(struct desk *f, const char *more)
{
    char body[512];
    snprintf(body, sizeof(body), SWEEP(LARGE), more);
    return sweep_submit(f, body);
}

/* What is made by threads while it is kept is in order, and all of it or nothing. */
static void large_sweeps(void **state)
{
    struct desk *f = *state;
    assert_int_equal(submit_large(f, ",7"), 422);
    assert_says(f, "(point 5400: /diameter = 7, /seed = 1)");
    assert_int_equal(ask_sql(f, "SELECT (SELECT count(*) FROM jobs) + (SELECT count(*) FROM sweeps)"
                                " + (SELECT count(*) FROM sweep_points)"),
                     0);
    assert_int_equal(submit_large(f, ""), 202);
    assert_int_equal(
        ask_sql(f, "SELECT count(*) FROM sweep_points AS p JOIN jobs AS j ON j.seq = p.job"
                   " WHERE p.job = p.point + 1"
                   " AND json_extract(j.job, '$.seed') = p.point % 2700 + 1"
                   " AND json_extract(j.job, '$.diameter') = (p.point / 2700 + 1) / 10.0"
                   " AND place = json_array(p.point / 2700, p.point % 2700)"),
        5400);
    assert_counted(f);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/diameter\":[0.3,7]}}"), 422);
    assert_says(f, "(point 8100: /diameter = 7, /seed = 1)");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs"), 5400);
    assert_int_equal(ask_sweep(f, "POST", "/extend", "{\"axes\":{\"/diameter\":[0.3]}}"), 202);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM sweep_points WHERE job = point + 1"), 8100);
    assert_counted(f);
    assert_true(store_settle(f->service.store));
    assert_int_equal(ask_sweep(f, "DELETE", "", NULL), 200);
    assert_says(f, "\"queued\":0,\"running\":0,\"done\":0,\"failed\":0,\"cancelled\":8100}");
    assert_counted(f);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM job_segments WHERE states GLOB '*q*'"), 0);
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM job_segments AS s JOIN job_ends AS e"
                                " ON e.id = (3 << 32 | s.segment) WHERE e.least > 0"),
                     7);
}

/* The server ended when the sweep was cancelled and not all of its jobs were: the start goes on,
 * with a job of another sweep in the list that is still wanted. */
static void cancelled_halfway(void **state)
{
    struct desk *f = *state;
    sqlite3 *db;
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[3,4]")), 202);
    assert_int_equal(sweep_submit(f, SWEEP("\"/seed\":[1,2,3]")), 202);
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    assert_int_equal(
        store_end(f->service.store, store_exec(db, "UPDATE sweeps SET cancelled_ms = 5"
                                                   " WHERE seq = (SELECT max(seq) FROM sweeps)")),
        STORE_OK);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(store_sweeps_resume(f->service.store), STORE_OK);
        assert_int_equal(ask_sweep(f, "GET", "", NULL), 200);
        assert_says(f, "\"queued\":1,\"running\":0,\"done\":0,\"failed\":0,\"cancelled\":2}");
        assert_int_equal(ask_sql(f, "SELECT count(*) FROM jobs WHERE state = 'queued'"), 2);
        assert_counted(f);
    }
}

/* The same sweep leaves nothing behind, whatever became of its jobs; nor do faults under a key. */
static void found_when_made(void **state)
{
    struct desk *f = *state;
    char first[JOB_ID_SIZE];
    sqlite3 *db;
    assert_int_equal(submit_large(f, ""), 202);
    memcpy(first, f->id, sizeof(first));
    assert_int_equal(STORE_BEGIN(f->service.store, &db), STORE_OK);
    assert_int_equal(
        store_end(f->service.store, store_exec(db, "UPDATE jobs SET state = 'cancelled',"
                                                   " finished_ms = 2 WHERE seq > 2000")),
        STORE_OK);
    assert_int_equal(submit_large(f, ""), 200);
    assert_string_equal(f->id, first);
    assert_int_equal(ask_sql(f, "SELECT (SELECT count(*) FROM jobs) * 10 +"
                                " (SELECT count(*) FROM sweeps)"),
                     54001);
    assert_counted(f);
    assert_int_equal(submit_with_key(f, "/v1/sweeps", SWEEP("\"/seed\":[1,2]")), 202);
    assert_int_equal(submit_with_key(f, "/v1/sweeps", SWEEP("\"/diameter\":[0.5,7]")), 422);
    assert_says(f, "(point 1: /diameter = 7)");
    assert_int_equal(ask_sql(f, "SELECT count(*) FROM sweeps"), 2);
}

static void post_anew(struct desk *f, const char *job)
{
    static const struct request_query force = {"force", "true"};
    const struct request request = {.method = "POST",
                                    .path = "/v1/jobs",
                                    .content_type = "application/json",
                                    .body = job,
                                    .body_size = strlen(job),
                                    .query = &force,
                                    .query_count = 1};
    assert_int_equal(desk_send(f, &request), 202);
}

/* Points that are made from the one before are what a job of their own would be. */
static void alike_but_for_the_seed(void **state)
{
    struct desk *f = *state;
    enum { JOBS = 10 };
    char *jobs[JOBS];
    assert_int_equal(sweep_submit(f, "{\"base\":{\"particles\":5,\"length\":10,\"time\":1,"
                                     "\"observables\":{\"msd\":{}},\"potential\":{\"type\":"
                                     "\"expression\",\"period\":1,\"energy\":\"sin(2*pi*x)\"}},"
                                     "\"axes\":{\"/diameter\":[0.1,0.3],"
                                     "\"/seed\":[5,0,9007199254740992,8.0,77]}}"),
                     202);
    sqlite3 *db = store_read_begin(f->service.store);
    struct stmt row = stmt_init(db, "SELECT job FROM jobs ORDER BY seq");
    for (size_t i = 0; i < JOBS; i++) {
        assert_true(stmt_step(&row));
        jobs[i] = stmt_text(&row, 0);
    }
    assert_int_equal(stmt_fini(&row), STORE_OK);
    store_read_end(f->service.store, db);
    for (size_t i = 0; i < JOBS; i++) {
        post_anew(f, jobs[i]);
        free(jobs[i]);
    }
    assert_int_equal(ask_sql(f,
                             "SELECT count(*) FROM jobs AS a JOIN jobs AS b ON b.seq = a.seq + 10"
                             " WHERE a.hash = b.hash AND a.job = b.job AND a.derived = b.derived"
                             " AND a.chunks = b.chunks AND a.core_seconds = b.core_seconds"
                             " AND a.bytes = b.bytes AND a.superseded = 1"),
                     JOBS);
    assert_int_equal(sweep_submit(f, SWEEP("\"/diameter\":[0.1,0.2],\"/seed\":[3,-1]")), 422);
    assert_says(f, "\"pointer\":\"/seed\"");
    assert_says(f, "(point 1: /diameter = 0.1, /seed = -1)");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(triggers_that_rest_are_known),
        DESK_TEST(what_rested_wakes_up),
        DESK_TEST(submitted_and_found_again),
        DESK_TEST(labels_and_tags_of_base_and_sweep),
        DESK_TEST(refusals_name_the_place),
        DESK_TEST(many_faulty_points),
        DESK_TEST(ranges),
        DESK_TEST(axes_that_go_together),
        DESK_TEST(axes_of_any_kind),
        DESK_TEST(extension),
        DESK_TEST(cancelling),
        DESK_TEST(keys),
        DESK_TEST(roles),
        DESK_TEST(large_sweeps),
        DESK_TEST(cancelled_halfway),
        DESK_TEST(found_when_made),
        DESK_TEST(alike_but_for_the_seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
