/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_access.c - who gets in: tokens good and bad, roles on every route, owners and their jobs. */
#include "desk.h"
#include "limits.h"
#include "secret.h"
#include "store_internal.h"
#include "stream_counts.h"
#include "store_tokens.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

struct fixture {
    struct desk desk;
    char secret[ROLES][SECRET_SIZE]; /* of owners named like their role */
    char id[ROLES][TOKEN_ID_SIZE];
};

static const struct identity operator_here = {.owner = OWNER_LOCAL, .role = ROLE_ADMIN};

static int setup(void **state)
{
    struct fixture *f = calloc(1, sizeof(*f));
    char reason[256];
    *state = f;
    if (desk_open(&f->desk) != 0)
        return -1;
    return access_create(&f->desk.service.access, f->desk.service.store, ACCESS_AUTO, true, reason,
                         sizeof(reason)) == STORE_OK
               ? 0
               : -1;
}

static int teardown(void **state)
{
    struct fixture *f = *state;
    access_free(f->desk.service.access);
    desk_close(&f->desk);
    free(f);
    return 0;
}

/* authorization: the whole header, NULL = none. */
static int ask_with(struct fixture *f, const char *authorization, const char *method,
                    const char *path, const char *body)
{
    const struct request request = {.method = method,
                                    .path = path,
                                    .authorization = authorization,
                                    .body = body ? body : "",
                                    .body_size = body ? strlen(body) : 0};
    return desk_send(&f->desk, &request);
}

static int ask_as(struct fixture *f, enum role role, const char *method, const char *path,
                  const char *body)
{
    char header[SECRET_SIZE + 8];
    snprintf(header, sizeof(header), "Bearer %s", f->secret[role]);
    return ask_with(f, role == ROLE_NONE ? NULL : header, method, path, body);
}

static int64_t count(struct store *store, const char *sql)
{
    struct stmt row = stmt_init(store->writer, sql);
    assert_true(stmt_step(&row));
    int64_t number = stmt_integer(&row, 0);
    assert_int_equal(stmt_fini(&row), STORE_OK);
    return number;
}

/* A token straight into the store; expires_ms 0 = never. */
static void add_token(struct fixture *f, enum role role, int64_t expires_ms, char *secret, char *id)
{
    struct token_record token = {.role = role, .expires_ms = expires_ms};
    snprintf(token.owner, sizeof(token.owner), "%s", role_name(role));
    assert_true(secret_make(secret) && secret_hash(secret, token.hash));
    assert_int_equal(store_tokens_add(f->desk.service.store, &token, &operator_here), STORE_OK);
    if (id)
        snprintf(id, TOKEN_ID_SIZE, "%s", token.id);
    assert_int_equal(access_reload(f->desk.service.access), STORE_OK);
}

static void add_all(struct fixture *f)
{
    for (int role = ROLE_ADMIN; role > ROLE_NONE; role--)
        add_token(f, role, 0, f->secret[role], f->id[role]);
}

static void secrets(void **state)
{
    (void)state;
    char a[SECRET_SIZE], b[SECRET_SIZE], wrong[SECRET_SIZE + 2];
    unsigned char x[SECRET_HASH_SIZE], y[SECRET_HASH_SIZE];
    assert_true(secret_make(a) && secret_make(b));
    assert_string_not_equal(a, b);
    assert_true(secret_hash(a, x) && secret_hash(a, y) && secret_same(x, y));
    assert_true(secret_hash(b, y));
    assert_false(secret_same(x, y));
    for (size_t i = 0; i < SECRET_HASH_SIZE; i++) {
        memcpy(y, x, sizeof(y));
        y[i] ^= 1;
        assert_false(secret_same(x, y));
    }
    assert_false(secret_hash("", x) || secret_hash("bcd_", x));
    snprintf(wrong, sizeof(wrong), "%sa", a);
    assert_false(secret_hash(wrong, x));
    snprintf(wrong, sizeof(wrong), "%s", a);
    wrong[10] = 'A';
    assert_false(secret_hash(wrong, x));
    wrong[10] = '\0';
    assert_false(secret_hash(wrong, x));
}

/* Open until there is a token; then, and for good, closed to who has none. */
static void loopback_without_tokens(void **state)
{
    struct fixture *f = *state;
    char reason[256], secret[SECRET_SIZE], id[TOKEN_ID_SIZE];
    struct access *other = NULL;
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/me", NULL), 200);
    assert_says(&f->desk, "\"role\":\"admin\",\"token\":null,\"owner\":\"local\"");
    assert_int_equal(
        access_create(&other, f->desk.service.store, ACCESS_AUTO, false, reason, sizeof(reason)),
        STORE_CONFLICT);
    assert_non_null(strstr(reason, "bcdd token create"));
    add_token(f, ROLE_ADMIN, 0, secret, id);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/me", NULL), 401);
    assert_int_equal(
        access_create(&other, f->desk.service.store, ACCESS_OPEN, false, reason, sizeof(reason)),
        STORE_CONFLICT);
    assert_int_equal(
        access_create(&other, f->desk.service.store, ACCESS_AUTO, false, reason, sizeof(reason)),
        STORE_OK);
    access_free(other);
    assert_int_equal(store_tokens_revoke(f->desk.service.store, id, true, &operator_here),
                     STORE_OK);
    assert_int_equal(access_reload(f->desk.service.access), STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/me", NULL), 401);
    assert_int_equal(
        access_create(&other, f->desk.service.store, ACCESS_AUTO, false, reason, sizeof(reason)),
        STORE_CONFLICT);
}

static void named_modes(void **state)
{
    struct fixture *f = *state;
    struct access *before = f->desk.service.access;
    char reason[256], secret[SECRET_SIZE];
    assert_int_equal(access_create(&f->desk.service.access, f->desk.service.store, ACCESS_REQUIRED,
                                   true, reason, sizeof(reason)),
                     STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/me", NULL), 401);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/healthz", NULL), 200);
    access_free(f->desk.service.access);
    assert_int_equal(access_create(&f->desk.service.access, f->desk.service.store, ACCESS_OPEN,
                                   true, reason, sizeof(reason)),
                     STORE_OK);
    add_token(f, ROLE_ADMIN, 0, secret, NULL);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/me", NULL), 200);
    access_free(f->desk.service.access);
    f->desk.service.access = before;
}

static void bad_tokens(void **state)
{
    static const struct {
        const char *header, *why;
    } cases[] = {
        {"", "no token"},
        {"Bearer", "no token"},
        {"Bearer ", "no token"},
        {"Basic cm9vdDpyb290", "no token"},
        {"Bearer bcd_", "no token"},
        {"Bearer bcd_aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", "not known"},
        {"Bearer ' OR 1=1 --", "no token"},
    };
    struct fixture *f = *state;
    char secret[SECRET_SIZE], header[2 * SECRET_SIZE], id[TOKEN_ID_SIZE];
    add_all(f);
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        assert_int_equal(ask_with(f, cases[i].header, "GET", "/v1/jobs", NULL), 401);
        assert_says(&f->desk, cases[i].why);
    }
    snprintf(header, sizeof(header), "bearer  %s", f->secret[ROLE_READER]);
    assert_int_equal(ask_with(f, header, "GET", "/v1/jobs", NULL), 200);
    strcat(header, "x");
    assert_int_equal(ask_with(f, header, "GET", "/v1/jobs", NULL), 401);
    add_token(f, ROLE_ADMIN, store_now_ms() - 1, secret, NULL);
    snprintf(header, sizeof(header), "Bearer %s", secret);
    assert_int_equal(ask_with(f, header, "GET", "/v1/jobs", NULL), 401);
    assert_says(&f->desk, "has expired");
    assert_int_equal(ask_with(f, header, "GET", "/healthz", NULL), 200);
    add_token(f, ROLE_READER, store_now_ms() + 60000, secret, id);
    snprintf(header, sizeof(header), "Bearer %s", secret);
    assert_int_equal(ask_with(f, header, "GET", "/v1/jobs", NULL), 200);
    snprintf(header, sizeof(header), "/v1/tokens/%s", id);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "DELETE", header, NULL), 200);
    snprintf(header, sizeof(header), "Bearer %s", secret);
    assert_int_equal(ask_with(f, header, "GET", "/v1/jobs", NULL), 401);
    assert_says(&f->desk, "was revoked");
}

/* "/v1/jobs/{id}/results/{name}" as a path. */
static void fill_pattern(const char *pattern, char *path, size_t size)
{
    size_t used = 0;
    while (*pattern && used + 8 < size) {
        if (*pattern == '{') {
            used += (size_t)snprintf(path + used, size - used, "energy");
            pattern = strchr(pattern, '}') + 1;
        } else {
            path[used++] = *pattern++;
        }
    }
    path[used] = '\0';
}

static void every_route_keeps_lesser_roles_out(void **state)
{
    struct fixture *f = *state;
    const struct route *route;
    size_t guarded = 0;
    add_all(f);
    for (size_t i = 0; (route = routes_at(i)); i++) {
        char path[256];
        fill_pattern(route->pattern, path, sizeof(path));
        assert_true(route->role != ROLE_NONE || strncmp(path, "/v1/", 4) != 0 ||
                    strncmp(path, "/v1/schema/", 11) == 0);
        for (int role = ROLE_NONE; role < (int)route->role; role++) {
            int status = ask_as(f, role, route->method, path, "{}");
            if (status != (role == ROLE_NONE ? 401 : 403))
                fail_msg("%s %s as %s: %d", route->method, path, role_name(role), status);
            guarded++;
        }
    }
    assert_true(guarded > 30);
    assert_int_equal(ask_as(f, ROLE_READER, "GET", "/v1/jobs", NULL), 200);
    assert_int_equal(ask_as(f, ROLE_READER, "POST", "/v1/estimate", JOB("")), 200);
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "POST", "/v1/jobs", JOB("")), 202);
    assert_int_equal(ask_as(f, ROLE_OPERATOR, "DELETE", "/v1/jobs/jnone", NULL), 404);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "GET", "/v1/tokens", NULL), 200);
    assert_null(strstr(f->desk.reply.body, "bcd_"));
    assert_null(strstr(f->desk.reply.body, "hash"));
}

static void jobs_belong_to_who_submitted_them(void **state)
{
    struct fixture *f = *state;
    char id[JOB_ID_SIZE], other[JOB_ID_SIZE], path[64];
    add_all(f);
    assert_int_equal(ask_as(f, ROLE_OPERATOR, "POST", "/v1/jobs", JOB("")), 202);
    assert_says(&f->desk, "\"owner\":\"operator\"");
    desk_take_id(&f->desk, id);
    /* The same job of another is that job, and stays theirs. */
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "POST", "/v1/jobs", JOB("")), 200);
    assert_says(&f->desk, "\"owner\":\"operator\"");
    desk_take_id(&f->desk, other);
    assert_string_equal(id, other);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "DELETE", path, NULL), 403);
    assert_says(&f->desk, "belongs to operator");
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "DELETE", "/v1/jobs/jnone", NULL), 404);
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "POST", "/v1/jobs", JOB(",\"seed\":2")), 202);
    desk_take_id(&f->desk, id);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask_as(f, ROLE_READER, "DELETE", path, NULL), 403);
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "DELETE", path, NULL), 200);
    assert_int_equal(ask_as(f, ROLE_SUBMITTER, "POST", "/v1/jobs", JOB(",\"seed\":3")), 202);
    desk_take_id(&f->desk, id);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(ask_as(f, ROLE_OPERATOR, "DELETE", path, NULL), 200);
    /* All of it stands in the audit log, newest first. */
    assert_int_equal(ask_as(f, ROLE_ADMIN, "GET", "/v1/audit", NULL), 200);
    assert_says(&f->desk, "{\"entries\":[{\"owner\":\"operator\",\"token\":\"t");
    snprintf(path, sizeof(path), "\"action\":\"job.cancel\",\"object\":\"%s\"", id);
    assert_says(&f->desk, path);
    snprintf(path, sizeof(path), "\"action\":\"job.submit\",\"object\":\"%s\"", id);
    assert_says(&f->desk, path);
}

static void tokens_over_http(void **state)
{
    static const char *const bad[] = {
        "{\"owner\":\"anna\"}",
        "{\"role\":\"admin\"}",
        "{\"owner\":\"Anna\",\"role\":\"admin\"}",
        "{\"owner\":\"\",\"role\":\"admin\"}",
        "{\"owner\":7,\"role\":\"admin\"}",
        "{\"owner\":\"anna\",\"role\":\"none\"}",
        "{\"owner\":\"anna\",\"role\":\"root\"}",
        "{\"owner\":\"anna\",\"role\":\"admin\",\"expires_in\":0}",
        "{\"owner\":\"anna\",\"role\":\"admin\",\"expires_in\":\"1\"}",
        "{\"owner\":\"anna\",\"role\":\"admin\",\"expires_in\":1e12}",
        "{\"owner\":\"anna\",\"role\":\"admin\",\"days\":1}",
        "{\"owner\":\"anna\",\"role\":\"admin\",\"name\":[]}",
        "[]",
    };
    struct fixture *f = *state;
    char header[256], path[64], secret[SECRET_SIZE], id[TOKEN_ID_SIZE];
    /* The first one over loopback, which is open till then; only an admin's will do. */
    assert_int_equal(
        ask_as(f, ROLE_NONE, "POST", "/v1/tokens", "{\"owner\":\"a\",\"role\":\"operator\"}"), 409);
    assert_int_equal(ask_as(f, ROLE_NONE, "POST", "/v1/tokens",
                            "{\"owner\":\"a\",\"role\":\"admin\",\"name\":\"n \\\"1\\\"\"}"),
                     201);
    assert_int_equal(
        sscanf(f->desk.reply.body, "{\"token\":\"%56[a-z2-7_]\",\"id\":\"%23[a-z0-9]", secret, id),
        2);
    assert_says(&f->desk, "\"name\":\"n \\\"1\\\"\"");
    snprintf(f->secret[ROLE_ADMIN], SECRET_SIZE, "%s", secret);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/tokens", NULL), 401);
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (ask_as(f, ROLE_ADMIN, "POST", "/v1/tokens", bad[i]) != 422)
            fail_msg("%s: %d", bad[i], f->desk.reply.status);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "POST", "/v1/tokens", "token"), 400);
    /* The last admin's token stays, until there is another. */
    snprintf(path, sizeof(path), "/v1/tokens/%s", id);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "DELETE", path, NULL), 409);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "DELETE", "/v1/tokens/tnone", NULL), 404);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "POST", "/v1/tokens",
                            "{\"owner\":\"b\",\"role\":\"admin\",\"expires_in\":60}"),
                     201);
    assert_int_equal(sscanf(f->desk.reply.body, "{\"token\":\"%56[a-z2-7_]", secret), 1);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "DELETE", path, NULL), 200);
    assert_int_equal(ask_as(f, ROLE_ADMIN, "GET", "/v1/tokens", NULL), 401);
    snprintf(header, sizeof(header), "Bearer %s", secret);
    assert_int_equal(ask_with(f, header, "GET", "/v1/tokens", NULL), 200);
    assert_int_equal(ask_with(f, header, "DELETE", path, NULL), 409); /* once only */
}

/* A cancel and its line in the audit log are there together, or neither. */
static void a_cancel_is_noted_or_does_not_happen(void **state)
{
    struct fixture *f = *state;
    sqlite3 *db = f->desk.service.store->writer;
    char id[JOB_ID_SIZE], path[64];
    assert_int_equal(ask_as(f, ROLE_NONE, "POST", "/v1/jobs", JOB("")), 202);
    desk_take_id(&f->desk, id);
    snprintf(path, sizeof(path), "/v1/jobs/%s", id);
    assert_int_equal(store_exec(db, "CREATE TEMP TRIGGER no_room BEFORE INSERT ON main.audit"
                                    " BEGIN SELECT RAISE(ABORT, 'no room'); END"),
                     STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "DELETE", path, NULL), 500);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", path, NULL), 200);
    assert_says(&f->desk, "\"state\":\"queued\"");
    assert_int_equal(store_exec(db, "DROP TRIGGER no_room"), STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "DELETE", path, NULL), 200);
    assert_int_equal(count(f->desk.service.store, "SELECT count(*) FROM audit JOIN jobs"
                                                  " ON object = id AND state = 'cancelled'"
                                                  " WHERE action = 'job.cancel'"),
                     1);
}

static void make_old(struct store *store, const char *column, const char *id, int days)
{
    char sql[128];
    snprintf(sql, sizeof(sql), "UPDATE tokens SET %s = %lld WHERE id = '%s'", column,
             (long long)(store_now_ms() - days * INT64_C(86400000)), id);
    assert_int_equal(store_exec(store->writer, sql), STORE_OK);
}

/* What opens nothing any more is kept for a time, and then as lines in the audit log alone. */
static void old_tokens_are_forgotten(void **state)
{
    struct fixture *f = *state;
    struct store *store = f->desk.service.store;
    add_all(f);
    int64_t all = count(store, "SELECT count(*) FROM tokens");
    make_old(store, "revoked_ms", f->id[ROLE_READER], LIMIT_TOKEN_KEPT_DAYS + 1);
    make_old(store, "expires_ms", f->id[ROLE_SUBMITTER], LIMIT_TOKEN_KEPT_DAYS + 1);
    make_old(store, "revoked_ms", f->id[ROLE_OPERATOR], LIMIT_TOKEN_KEPT_DAYS - 1);
    make_old(store, "revoked_ms", f->id[ROLE_WORKER], LIMIT_TOKEN_KEPT_DAYS - 1);
    assert_int_equal(store_tokens_forget(store), STORE_OK);
    assert_int_equal(count(store, "SELECT count(*) FROM tokens"), all - 2);
    assert_int_equal(count(store, "SELECT count(*) FROM tokens WHERE owner = 'operator'"), 1);
    assert_int_equal(count(store, "SELECT count(*) FROM audit WHERE action = 'token.forget'"
                                  " AND detail GLOB 'owner reader, role reader, revoked 20*Z'"),
                     1);
    assert_int_equal(count(store, "SELECT count(*) FROM audit WHERE action = 'token.forget'"
                                  " AND detail GLOB 'owner submitter, role *, expired 20*Z'"),
                     1);
    /* The last ones stay, or the server would be open to all again. */
    make_old(store, "revoked_ms", f->id[ROLE_ADMIN], LIMIT_TOKEN_KEPT_DAYS + 1);
    assert_int_equal(store_tokens_forget(store), STORE_OK);
    assert_int_equal(count(store, "SELECT count(*) FROM tokens"), all - 2);
    assert_int_equal(access_reload(f->desk.service.access), STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/jobs", NULL), 401);
}

/* What a stream writes now; what it returns in the end. */
static ssize_t read_stream(struct stream *stream, char *text, size_t size)
{
    ssize_t got;
    size_t used = 0;
    while ((got = stream->read(stream->state, text + used, size - used - 1)) > 0)
        used += (size_t)got;
    text[used] = '\0';
    return got;
}

static void streams_end_with_their_token(void **state)
{
    struct fixture *f = *state;
    char text[4096], path[64];
    struct stream stream;
    const struct timespec gap = {.tv_nsec = (LIMIT_EVENTS_GAP_MS + 10) * 1000000L};
    assert_int_equal(
        feed_create(&f->desk.service.feed, f->desk.service.store, f->desk.service.queue), STORE_OK);
    assert_int_equal(ask_as(f, ROLE_NONE, "POST", "/v1/jobs", JOB("")), 202);
    desk_take_id(&f->desk, path);
    snprintf(text, sizeof(text), "/v1/jobs/%s/events", path);
    for (int i = 0; i < 2; i++) {
        const char *what = i ? text : "/v1/events";
        char said[4096];
        add_all(f);
        assert_int_equal(ask_as(f, ROLE_READER, "GET", what, NULL), 200);
        stream = f->desk.reply.stream;
        f->desk.reply.stream = (struct stream){0};
        assert_int_equal(read_stream(&stream, said, sizeof(said)), STREAM_LATER);
        assert_non_null(strstr(said, "retry: "));
        assert_null(strstr(said, "event: end"));
        snprintf(path, sizeof(path), "/v1/tokens/%s", f->id[ROLE_READER]);
        assert_int_equal(ask_as(f, ROLE_ADMIN, "DELETE", path, NULL), 200);
        nanosleep(&gap, NULL);
        assert_int_equal(read_stream(&stream, said, sizeof(said)), STREAM_END);
        assert_string_equal(said, "event: end\ndata: {\"reason\":\"the token was revoked\"}\n\n");
        stream_fini(&stream);
    }
    feed_free(f->desk.service.feed);
}

static void nobody_takes_all_streams(void **state)
{
    struct fixture *f = *state;
    struct stream_counts counts = STREAM_COUNTS_INIT;
    struct stream kept = {0};
    f->desk.service.streams = &counts;
    assert_int_equal(
        feed_create(&f->desk.service.feed, f->desk.service.store, f->desk.service.queue), STORE_OK);
    add_all(f);
    for (int i = 1; i < LIMIT_OWNER_STREAMS_MAX; i++)
        assert_true(stream_counts_take(&counts, "reader"));
    assert_int_equal(ask_as(f, ROLE_READER, "GET", "/v1/events", NULL), 200);
    kept = f->desk.reply.stream;
    f->desk.reply.stream = (struct stream){0};
    assert_int_equal(ask_as(f, ROLE_READER, "GET", "/v1/events", NULL), 429);
    assert_says(&f->desk, "reader has 200 event streams open already (LIMIT_OWNER_STREAMS_MAX)");
    assert_int_equal(ask_as(f, ROLE_ADMIN, "GET", "/v1/events", NULL),
                     200); /* others have theirs */
    stream_fini(&kept);
    assert_int_equal(ask_as(f, ROLE_READER, "GET", "/v1/events", NULL), 200);
    reply_fini(&f->desk.reply);
    for (int i = 1; i < LIMIT_OWNER_STREAMS_MAX; i++)
        stream_counts_give(&counts, "reader");
    assert_int_equal(counts.used, 0);
    f->desk.service.streams = NULL;
    feed_free(f->desk.service.feed);
}

/* Refusals are told, but not one by one when somebody tries many. */
static void refusals_are_noted_now_and_then(void **state)
{
    struct fixture *f = *state;
    add_all(f);
    for (int i = 0; i < 100; i++)
        assert_int_equal(ask_with(f, "Bearer x", "GET", "/v1/jobs", NULL), 401);
    assert_int_equal(
        count(f->desk.service.store, "SELECT count(*) FROM audit WHERE action = 'access.refuse'"),
        1);
}

static void the_audit_log_is_bounded(void **state)
{
    struct fixture *f = *state;
    char sql[256];
    snprintf(sql, sizeof(sql),
             "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < %d)"
             " INSERT INTO audit (time_ms, owner, action, object, detail)"
             " SELECT i, 'x', 'test', '', '' FROM n",
             LIMIT_AUDIT_ROWS_MAX + 10);
    assert_int_equal(store_exec(f->desk.service.store->writer, sql), STORE_OK);
    assert_int_equal(store_audit_write(f->desk.service.store,
                                       &(struct audit_new){&operator_here, "last", "o", "d"}),
                     STORE_OK);
    assert_int_equal(count(f->desk.service.store, "SELECT count(*) FROM audit"),
                     LIMIT_AUDIT_ROWS_MAX);
    assert_int_equal(ask_as(f, ROLE_NONE, "GET", "/v1/audit", NULL), 200);
    assert_says(&f->desk, "{\"entries\":[{\"owner\":\"local\",\"token\":null,\"action\":\"last\","
                          "\"object\":\"o\",\"detail\":\"d\",\"time\":\"20");
    assert_null(strstr(f->desk.reply.body, "\"next\":null"));
}

#define TEST(function) cmocka_unit_test_setup_teardown(function, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(secrets),
        TEST(loopback_without_tokens),
        TEST(named_modes),
        TEST(bad_tokens),
        TEST(every_route_keeps_lesser_roles_out),
        TEST(jobs_belong_to_who_submitted_them),
        TEST(tokens_over_http),
        TEST(a_cancel_is_noted_or_does_not_happen),
        TEST(old_tokens_are_forgotten),
        TEST(streams_end_with_their_token),
        TEST(nobody_takes_all_streams),
        TEST(refusals_are_noted_now_and_then),
        TEST(the_audit_log_is_bounded),
    };
    return cmocka_run_group_tests_name("access", tests, NULL, NULL);
}
