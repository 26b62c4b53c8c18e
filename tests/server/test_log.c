/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_log.c - nothing handed to the log can forge a line, a field or a terminal's escape. */
#include "log.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* 2026-01-31T12:00:00.123Z */
static const int64_t noon_ms = 1769860800123;

static void assert_line(const struct log_field *fields, const char *expected)
{
    char line[256];
    size_t length = log_print(line, sizeof line, noon_ms, LOG_LEVEL_WARNING, "disk_full", fields);

    assert_string_equal(line, expected);
    assert_int_equal(length, strlen(expected));
}

static void fields_follow_time_level_and_event(void **state)
{
    (void)state;
    assert_line(NULL, "time=2026-01-31T12:00:00.123Z level=warning event=disk_full\n");
    assert_line(
        LOG_FIELDS(log_text("job", "jabc-7"), log_integer("chunks", -4), log_number("share", 0.25)),
        "time=2026-01-31T12:00:00.123Z level=warning event=disk_full job=jabc-7 chunks=-4"
        " share=0.25\n");
}

static void hostile_values_stay_one_value(void **state)
{
    (void)state;
    assert_line(LOG_FIELDS(log_text("path", "/x\nlevel=error event=\"forged\"\\"),
                           log_text("key", "\x1b[31m\xc3\xa9\x7f"), log_text("empty", ""),
                           log_text("none", NULL), log_text("blank", "a b=c")),
                "time=2026-01-31T12:00:00.123Z level=warning event=disk_full"
                " path=\"/x\\nlevel=error event=\\\"forged\\\"\\\\\""
                " key=\"\\x1b[31m\\xc3\\xa9\\x7f\" empty=\"\" none=- blank=\"a b=c\"\n");
}

static void a_long_line_is_cut_and_ends(void **state)
{
    char text[1000], line[100];
    size_t length;

    (void)state;
    memset(text, '\x01', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    length = log_print(line, sizeof line, noon_ms, LOG_LEVEL_INFO, "x",
                       LOG_FIELDS(log_text("key", text)));
    assert_int_equal(length, sizeof line - 1);
    assert_int_equal(line[length - 1], '\n');
    assert_null(memchr(line, '\n', length - 1));
}

static void a_line_is_one_write_and_errno_is_kept(void **state)
{
    char read_back[512] = "";
    int ends[2], kept = dup(STDERR_FILENO);
    ssize_t length;

    (void)state;
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(dup2(ends[1], STDERR_FILENO), STDERR_FILENO);
    errno = ENOSPC;
    log_write(LOG_LEVEL_ERROR, "broken", LOG_FIELDS(log_integer("code", 11)));
    assert_int_equal(errno, ENOSPC);
    dup2(kept, STDERR_FILENO);
    close(kept);
    close(ends[1]);
    length = read(ends[0], read_back, sizeof read_back - 1);
    close(ends[0]);
    assert_true(length > 0);
    assert_non_null(strstr(read_back, "Z level=error event=broken code=11\n"));
    assert_int_equal(strncmp(read_back, "time=20", 7), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fields_follow_time_level_and_event),
        cmocka_unit_test(hostile_values_stay_one_value),
        cmocka_unit_test(a_long_line_is_cut_and_ends),
        cmocka_unit_test(a_line_is_one_write_and_errno_is_kept),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
