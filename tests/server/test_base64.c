/* SPDX-License-Identifier: GPL-3.0-or-later
 * Bytes as text and back: the vectors of RFC 4648, every length, and nothing that stands for bytes
 * that another text stands for. */
#include "base64.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void vectors(void **state)
{
    static const char *const pairs[][2] = {{"", ""},
                                           {"f", "Zg=="},
                                           {"fo", "Zm8="},
                                           {"foo", "Zm9v"},
                                           {"foob", "Zm9vYg=="},
                                           {"fooba", "Zm9vYmE="},
                                           {"foobar", "Zm9vYmFy"}};
    (void)state;
    for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
        char *text = base64_print(pairs[i][0], strlen(pairs[i][0]));
        void *bytes;
        size_t size;
        assert_string_equal(text, pairs[i][1]);
        assert_true(base64_parse(text, strlen(text), &bytes, &size));
        assert_int_equal(size, strlen(pairs[i][0]));
        assert_memory_equal(bytes, pairs[i][0], size);
        free(bytes);
        free(text);
    }
}

static void every_length(void **state)
{
    unsigned char from[300];
    (void)state;
    for (size_t i = 0; i < sizeof(from); i++)
        from[i] = (unsigned char)(i * 179 + 3);
    for (size_t length = 0; length <= sizeof(from); length++) {
        char *text = base64_print(from, length);
        void *bytes;
        size_t size;
        assert_true(base64_parse(text, strlen(text), &bytes, &size));
        assert_int_equal(size, length);
        assert_memory_equal(bytes, from, length);
        free(bytes);
        free(text);
    }
}

static void wrong(void **state)
{
    static const char *const texts[] = {"Z",        "Zg",        "Zg=",  "Zh==",      "Zm9=",
                                        "Zg==Zg==", "=Zg=",      "Z===", "====",      "Zm 9",
                                        "Zm-_",     "Zm9v\nZm9", "Zg=a", "\xc3\xa4Zm"};
    (void)state;
    for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
        void *bytes = NULL;
        size_t size;
        assert_false(base64_parse(texts[i], strlen(texts[i]), &bytes, &size));
        assert_null(bytes);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vectors),
        cmocka_unit_test(every_length),
        cmocka_unit_test(wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
