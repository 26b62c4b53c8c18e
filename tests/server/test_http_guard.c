/* SPDX-License-Identifier: GPL-3.0-or-later
 * http_guard.c: who may be asked for. */
#include "http_guard.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void guard_host(void **state)
{
    static const char *const names[] = {"bcd.lab.example", "second", NULL};
    (void)state;
    static const char *const good[] = {"localhost", "LOCALHOST:1", "127.0.0.1", "127.0.0.1:65535",
                                       "127.8.8.8", "[::1]",       "[::1]:80",  "localhost:"};
    static const char *const bad[] = {"",
                                      "localhost.",
                                      "localhost:80x",
                                      "[::1",
                                      "::1",
                                      "[127.0.0.1]",
                                      "0.0.0.0",
                                      "[::2]",
                                      "127.0.0.1@evil",
                                      "10.0.0.1",
                                      "localhost/",
                                      "[localhost]",
                                      "127.0.0.1:80:80",
                                      "127.1"};
    for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++)
        assert_true(http_guard_host(good[i], "127.0.0.1", NULL));
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (http_guard_host(bad[i], "127.0.0.1", NULL))
            fail_msg("%s passes", bad[i]);
    assert_true(http_guard_host("any.example", "192.0.2.1", NULL));
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        if (http_guard_host(bad[i], "127.0.0.1", names))
            fail_msg("%s passes", bad[i]);
    assert_true(http_guard_host("BCD.lab.example:443", "127.0.0.1", names));
    assert_true(http_guard_host("second", "127.0.0.1", names));
    assert_true(http_guard_host("localhost:8080", "127.0.0.1", names));
    assert_false(http_guard_host("bcd.lab.example.evil.example", "127.0.0.1", names));
    assert_true(http_guard_host("bcd.lab.example", "192.0.2.1", names));
    assert_true(http_guard_host("192.0.2.1:80", "192.0.2.1", names));
    assert_false(http_guard_host("any.example", "192.0.2.1", names));
    assert_false(http_guard_host("localhost", "192.0.2.1", names));
    assert_true(http_guard_loopback("127.255.0.1") && http_guard_loopback("::1"));
    assert_false(http_guard_loopback("128.0.0.1") || http_guard_loopback("::") ||
                 http_guard_loopback("localhost"));
}

static void guard_target(void **state)
{
    static const struct {
        const char *target, *path, *host;
    } cases[] = {
        {"/", "/", NULL},
        {"//x/http://y", "//x/http://y", NULL},
        {"http://localhost/a/b", "/a/b", "localhost"},
        {"HTTPS://[::1]:80//a", "//a", "[::1]:80"},
        {"http://localhost", "/", "localhost"},
        {"http:///a", "/a", ""},
        {"http://", "/", ""},
        {"*", NULL, NULL},
        {"", NULL, NULL},
        {"ftp://localhost/", NULL, NULL},
        {"localhost:80", NULL, NULL},
        {"http:/a", NULL, NULL},
    };
    (void)state;
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char *target = strdup(cases[i].target), *host = NULL;
        const char *fault = http_guard_target(target, &host);
        assert_int_equal(fault == NULL, cases[i].path != NULL);
        if (cases[i].path)
            assert_string_equal(target, cases[i].path);
        assert_int_equal(host == NULL, cases[i].host == NULL);
        if (host)
            assert_string_equal(host, cases[i].host);
        free(target);
        free(host);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(guard_host),
                                       cmocka_unit_test(guard_target)};
    return cmocka_run_group_tests_name("http_guard", tests, NULL, NULL);
}
