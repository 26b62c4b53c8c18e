/* SPDX-License-Identifier: GPL-3.0-or-later
 * The web page's files as handlers answer them: encodings, what a client has already, what is not
 * there. tests/node/page.mjs opens it. */
#include "desk.h"
#include "routes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

static int ask_for(struct desk *f, const char *path, const char *encoding, const char *etag)
{
    const struct request request = {.method = "GET",
                                    .path = path,
                                    .body = "",
                                    .accept_encoding = encoding,
                                    .if_none_match = etag};
    reply_fini(&f->reply);
    routes_dispatch(&f->service, &request, &f->reply);
    return f->reply.status;
}

static void pages_and_parts(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask_for(f, "/", NULL, NULL), 200);
    assert_string_equal(f->reply.content_type, "text/html; charset=utf-8");
    assert_non_null(strstr(f->reply.body, "<!doctype html>"));
    assert_int_equal(f->reply.body_size, strlen(f->reply.body));
    assert_int_equal(ask_for(f, "/page/main.js", NULL, NULL), 200);
    assert_string_equal(f->reply.content_type, "text/javascript; charset=utf-8");
    assert_int_equal(ask_for(f, "/page/style.css", NULL, NULL), 200);
    assert_string_equal(f->reply.content_type, "text/css; charset=utf-8");
    assert_int_equal(ask_for(f, "/page/icon.svg", NULL, NULL), 200);
    assert_string_equal(f->reply.content_type, "image/svg+xml");
    assert_int_equal(ask_for(f, "/page/none.js", NULL, NULL), 404);
    assert_int_equal(ask_for(f, "/page/index.html", NULL, NULL), 404);
    assert_int_equal(ask_for(f, "/page/", NULL, NULL), 404);
    assert_int_equal(ask_for(f, "/page/../main.js", NULL, NULL), 404);
}

/* A script or style from elsewhere, or within the page, would need another policy. */
static void pages_name_nothing_from_elsewhere(void **state)
{
    struct desk *f = *state;
    static const char *const never[] = {"http:",  "https:",  "//",     "<style",
                                        "style=", "onclick", "@import"};
    assert_int_equal(ask_for(f, "/", NULL, NULL), 200);
    for (size_t i = 0; i < sizeof(never) / sizeof(never[0]); i++)
        if (strstr(f->reply.body, never[i]))
            fail_msg("the page holds %s", never[i]);
}

static void packed_where_that_is_taken(void **state)
{
    struct desk *f = *state;
    static const struct {
        const char *accepted, *encoding;
    } cases[] = {
        {NULL, "identity"},       {"", "identity"},
        {"identity", "identity"}, {"gzip", "gzip"},
        {"GZIP", "gzip"},         {"deflate, gzip;q=0.5, br", "gzip"},
        {"gzip;q=0", "identity"}, {"gzip; q=0.000", "identity"},
        {"gzip;q=0.001", "gzip"}, {"br;q=1.0, *", "gzip"},
        {"xgzip", "identity"},    {"gzipx", "identity"},
        {"br,;,", "identity"},    {"deflate,gzip , br", "gzip"},
        {"x;gzip", "identity"},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        assert_int_equal(ask_for(f, "/page/main.js", cases[i].accepted, NULL), 200);
        if (strcmp(f->reply.encoding, cases[i].encoding) != 0)
            fail_msg("\"%s\" gets %s", cases[i].accepted, f->reply.encoding);
        bool packed = memcmp(f->reply.body, "\x1f\x8b", 2) == 0;
        assert_int_equal(packed, strcmp(cases[i].encoding, "gzip") == 0);
    }
}

static void what_a_client_has_is_not_sent_again(void **state)
{
    struct desk *f = *state;
    char plain[sizeof(f->reply.etag)], packed[sizeof(f->reply.etag)];
    assert_int_equal(ask_for(f, "/page/main.js", NULL, NULL), 200);
    snprintf(plain, sizeof(plain), "%s", f->reply.etag);
    assert_int_equal(ask_for(f, "/page/main.js", "gzip", NULL), 200);
    snprintf(packed, sizeof(packed), "%s", f->reply.etag);
    assert_string_not_equal(plain, packed);
    assert_non_null(strstr(f->reply.cache_control, "no-cache"));
    assert_int_equal(ask_for(f, "/page/main.js", NULL, plain), 304);
    assert_string_equal(f->reply.encoding, "identity"); /* Vary holds of this answer, too */
    assert_null(f->reply.body);
    assert_int_equal(ask_for(f, "/page/main.js", "gzip", packed), 304);
    assert_int_equal(ask_for(f, "/page/main.js", "gzip", plain), 200);
    assert_int_equal(ask_for(f, "/page/style.css", NULL, plain), 200);
}

static void scenes_of_the_papers(void **state)
{
    struct desk *f = *state;
    assert_int_equal(ask_for(f, "/v1/scenes", NULL, NULL), 200);
    assert_non_null(strstr(f->reply.body, "{\"name\":\"2022-fig3-sigma0.5-rho0.5\","));
    assert_non_null(strstr(f->reply.body, "\"doi\":\"10.1016/j.cpc.2024.109474\""));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(pages_and_parts),
        DESK_TEST(pages_name_nothing_from_elsewhere),
        DESK_TEST(packed_where_that_is_taken),
        DESK_TEST(what_a_client_has_is_not_sent_again),
        DESK_TEST(scenes_of_the_papers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
